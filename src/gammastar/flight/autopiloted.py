"""The closed loop of an autopilot and a plant: sensors, computer, commands on their way, rotors, wind; one graph of a control interval.

The loop state is explicit: the plant's, the parameter of the point truly nearest, the sensors' memory, the autopilot's state, the gusts.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import engine
from gammastar.flight.draws import Draws
from gammastar.flight.plant import MOTION, Plant
from gammastar.flight.rows import RowGraph, nearest_distances, normal_rows
from gammastar.flight.sensors import Sensors
from gammastar.flight.surroundings import foot, lookups_of, outputs_of
from gammastar.flight.variation import Variation, constants_of, graphs_of, parameters_of
from gammastar.flight.wind import Wind
from gammastar.law import Law, Reference
from gammastar.law.autopilot import TELEMETRY, TELEMETRY_SIZE, Autopilot, Stepped
from gammastar.law.guidance import Guidance, Surroundings
from gammastar.law.measurement import CHANNELS
from gammastar.law.piecewise import DATA_SIZE
from gammastar.vehicle import Vehicle, join, split
from gammastar.vehicle.state import SIZE as STATE_SIZE

ERRORS = 6 * len(CHANNELS)  # of the sensors in an interval, with flags of the axes


@dataclass(frozen=True, eq=False)
class AutopilotLoop:
    """An autopilot around a plant."""

    autopilot: Autopilot
    plant: Plant
    sensors: Sensors
    wind: Wind
    varied: tuple[str, ...] = ()  # what the parameters of a step are, see `Variation`

    @property
    def guidance(self) -> Guidance:
        """Return what is flown."""
        return self.autopilot.guidance

    @property
    def law(self) -> Law:
        """Return the law that is flown."""
        return self.guidance.law

    @property
    def reference(self) -> Reference:
        """Return the reference along the path."""
        return self.guidance.reference

    @property
    def truth(self) -> Vehicle:
        """Return the vehicle that flies."""
        return self.plant.vehicle

    @property
    def interval(self) -> float:
        """Return the control interval [s]."""
        return self.autopilot.interval

    @property
    def substeps(self) -> int:
        """Return the integration steps in an interval."""
        return self.plant.substeps

    @property
    def is_ideal(self) -> bool:
        """Return that the law does not act by itself."""
        return False

    @property
    def sizes(self) -> tuple[int, int, int, int, int]:
        """Return the sizes of the parts of the state: plant, true parameter, sensors, autopilot, wind."""
        return self.plant.size, 1, self.sensors.size(1 / self.interval), self.autopilot.size, self.wind.size

    @property
    def parameter(self) -> int:
        """Return where the path parameter that the law tracks is in the state."""
        return sum(self.sizes[:3])

    @property
    def pairs(self) -> tuple[int, ...]:
        """Return the pairs of random numbers that a step draws."""
        return self.sensors.pairs + self.wind.pairs

    def start(self, state: np.ndarray, parameter: float, seed: int = 0, flight: int = 0) -> np.ndarray:
        """Return the loop state at the start of a flight from a stacked state (20,)."""
        return self.starts(state[:, None], self.law.place(parameter)[:, None], [self.reference], seed, [flight])[:, 0]

    def starts(
        self,
        states: np.ndarray,
        places: np.ndarray,
        references: Sequence[Reference],
        seed: int,
        flights: ArrayLike,
        varying: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the loop states (n, flights) at the starts of flights; arguments as for `ClosedLoop.starts`."""
        started = engine.compiled(("start", self.signature), self._started)
        given = states, places, np.empty((0, places.shape[1])) if varying is None else varying
        return np.vstack([started(*given).full(), self.wind.start(seed, flights)])

    def _started(self) -> Any:
        """Return the function (stacked state, place, parameters) -> loop state at the start, without wind."""
        state, place = ca.SX.sym("state", STATE_SIZE), ca.SX.sym("place", 1 + self.law.path.data_size)
        parameters = parameters_of(self.varied, self.law)
        loop = self.with_variation(graphs_of(self.varied, self.law, parameters))
        waiting = loop.guidance.waits_first(state, place)
        pilot = loop.autopilot.started(state[:MOTION], state[18], state[19], place[0], waiting)
        parts = loop.plant.start(state), place[0], loop.sensors.start(state, 1 / loop.interval), pilot
        return ca.Function("started", [state, place, parameters], [ca.densify(ca.vertcat(*parts))])

    def guided(self, guidance: Guidance) -> AutopilotLoop:
        """Return the same loop with another law, reference or heading."""
        return dataclasses.replace(self, autopilot=dataclasses.replace(self.autopilot, guidance=guidance))

    def continued(self, last: np.ndarray, parameter: float) -> np.ndarray:
        """Return the loop state that goes on from the last one of a phase along a new path, nearest at a parameter."""
        state = last.copy()
        sizes = self.sizes
        motion = np.concatenate([last[:18], [0.0, 0.0]])
        state[sizes[0]] = parameter
        first = self.parameter
        state[first : first + 2] = parameter, float(self.guidance.starts_waiting(motion, parameter))
        return state

    def step(self) -> engine.Step:
        """Return one interval; its core is built once for a path's kind, and the path's and the reference's numbers are looked up."""
        core = engine.compiled(self.signature, self._core)
        return engine.Step(core, lookups_of(self.guidance, self.parameter, self.interval), self.pairs)

    def given(self) -> Any:
        """Return an interval without chance, the function (loop state without wind, time, air (3,), errors (24,), rows).

        It gives the next state and the observation.
        """
        return engine.compiled(self._signature, self._given)

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters the graph of a step as a constant."""
        return (*self._signature, self.sensors.signature, self.wind.signature, self.varied)

    @property
    def _signature(self) -> tuple[Any, ...]:
        late = tuple(channel.late(1 / self.interval) for channel in self.sensors.channels)
        constant = self.guided(constants_of(self.guidance, self.varied)).autopilot.signature
        return ("autopilot loop", constant, self.plant.signature, late)

    def _core(self) -> Any:
        """Return the function (loop state, parameters, column, rows) -> (next loop state, observation) of a `Step`."""
        loop_state, column = ca.SX.sym("loop_state", sum(self.sizes)), ca.SX.sym("column", 1 + 2 * len(self.pairs))
        rows, rate = ca.SX.sym("rows", DATA_SIZE + self.law.path.data_size), 1 / self.interval
        parameters = parameters_of(self.varied, self.law)
        variation = graphs_of(self.varied, self.law, parameters)
        draws, cut = Draws(self.pairs, column[1:]), sum(self.sizes[:4])
        errors = self.sensors.drawn(column[0], draws, rate, variation.noise)
        air = self.wind.velocity(loop_state[cut:], variation.wind)
        inputs = loop_state[:cut], column[0] * self.interval, air, errors, rows
        after, observation = self.with_variation(variation)._interval(*inputs)
        wind = self.wind.advanced(loop_state[cut:], draws, rate)
        results = ca.cse([ca.densify(ca.vertcat(after, wind)), ca.densify(observation)])
        return ca.Function("core", [loop_state, parameters, column, rows], results)

    def of(self, truth: Vehicle) -> AutopilotLoop:
        """Return the same loop around another vehicle."""
        return dataclasses.replace(self, plant=dataclasses.replace(self.plant, vehicle=truth))

    def with_variation(self, variation: Variation) -> AutopilotLoop:
        """Graph: return the loop whose truth and tuning are given by graphs, or by the numbers of one flight."""
        scales = {"thrust_scale": variation.thrust, "lag_scale": variation.lag}
        plant = dataclasses.replace(self.plant, vehicle=variation.vehicle(self.truth), **scales)
        guidance = dataclasses.replace(self.guidance, law=variation.law(self.law))
        return dataclasses.replace(self.guided(guidance), plant=plant)

    def _given(self) -> Any:
        loop_state, time = ca.SX.sym("loop_state", sum(self.sizes[:4])), ca.SX.sym("time")
        wind, errors = ca.SX.sym("wind", 3), ca.SX.sym("errors", ERRORS)
        rows = ca.SX.sym("rows", DATA_SIZE + self.law.path.data_size)
        inputs = [loop_state, time, wind, errors, rows]
        return ca.Function("given", inputs, [ca.densify(each) for each in self._interval(*inputs)])

    def _interval(self, loop_state: Any, time: Any, wind: Any, errors: Any, rows: Any) -> tuple[Any, Any]:
        """Graph: return the next state and the observation of one interval; see `given`."""
        plant, true_parameter, memory, pilot = ca.vertsplit(loop_state, [0, *np.cumsum(self.sizes[:4])])
        memory, measurement = self.measured(plant, memory, errors)
        stepped = self.autopilot.step(pilot, measurement, time, Surroundings(rows[DATA_SIZE:], rows[:DATA_SIZE]))
        after, nearest, observation = self.moved(plant, true_parameter, pilot[1], stepped, wind, rows[DATA_SIZE:])
        return ca.vertcat(after, nearest, memory, stepped.state), observation

    def measured(self, plant: Any, memory: Any, errors: Any) -> tuple[Any, Any]:
        """Graph: return the next memory of the sensors, and the measurement SX (22,) as an interval begins."""
        exposed, _ = self.plant.motion(plant, ca.SX.zeros(self.plant.command_size))
        return self.sensors.measured(memory, exposed, errors, 1 / self.interval)

    def moved(
        self, plant: Any, true_parameter: Any, was_waiting: Any, stepped: Stepped, wind: Any, data: Any
    ) -> tuple[Any, Any, Any]:
        """Graph: return the plant's next state and true parameter, and the observation, from what the autopilot has done."""
        acting = self.plant.acting(plant, stepped.command)
        state, wrench = self.plant.motion(plant, acting)
        place = foot(was_waiting, stepped.waiting, stepped.parameter, true_parameter)
        observation = self._observation(state, wrench, place, wind, stepped, plant, acting, data)
        after = self.plant.step(plant, stepped.command, wind)
        followed = self.law.path.track(after[:3], ca.vertcat(place, data))
        return after, ca.if_else(stepped.waiting, stepped.parameter, followed), observation

    def _observation(
        self,
        state: Any,
        wrench: Any,
        place: Any,
        wind: Any,
        stepped: Any,
        plant: Any,
        acting: Any,
        data: Any,
    ) -> Any:
        """Graph: return what a record keeps of a row, of the true state and vehicle; see `rows`."""
        waiting, parameter = stepped.waiting, stepped.parameter
        of = outputs_of(self.law, self.truth, state, place, parameter, waiting, data, wind)
        told = dict(zip(TELEMETRY, ca.vertsplit(stepped.telemetry, _cuts(TELEMETRY)), strict=True))
        return ca.vertcat(
            *(join(state), told["input"][0], wrench[1:], ca.vec(of.transverse), of.tangential, of.yaw_value),
            *(stepped.telemetry, self.plant.speeds(plant, acting), wind),
            *(waiting, told["constrained"], of.focal_margin),
        )

    def row(self, loop_state: Any, observed: Any) -> RowGraph:
        """Graph: return what is told of a row, from the loop state and its observation."""
        told, end = STATE_SIZE + 4 + 4 * self.law.path.components + 5, observed.shape[0]
        given_up = ca.vertsplit(observed[told : told + TELEMETRY_SIZE], _cuts(TELEMETRY))[
            list(TELEMETRY).index("given_up")
        ]
        parts = split(observed[:STATE_SIZE]), observed[STATE_SIZE + 1 : STATE_SIZE + 4], loop_state[self.plant.size]
        return RowGraph(*parts, observed[end - 3] > 0, given_up, observed[end - 1])

    def rows(self, states: np.ndarray, observations: np.ndarray) -> dict[str, np.ndarray]:
        """Return the rows of a phase by the names of the record, from loop states and observations, one column each."""
        path, count = self.law.path, observations.shape[1]
        parameters = states[self.plant.size, :count]
        rotors, width = self.plant.rotor_count, 4 * path.components
        sizes = [STATE_SIZE, 4, width, 4, 1, TELEMETRY_SIZE, rotors, 3, 1, 1, 1]
        parts = np.split(observations.T, np.cumsum(sizes)[:-1], axis=1)
        state, control, transverse, tangential, yaw, telemetry, speeds, wind, waiting, constrained, focal = parts
        told = dict(zip(TELEMETRY, np.split(telemetry, _cuts(TELEMETRY)[1:-1], axis=1), strict=True))
        return {
            "state": state,
            "input": control,
            "transverse_state": normal_rows(path, parameters, transverse),
            "tangential_state": tangential,
            "yaw_output": yaw[:, 0],
            "waiting": waiting[:, 0] > 0,
            "constrained": constrained[:, 0] > 0,
            "distance": nearest_distances(path, state[:, :3], parameters, waiting[:, 0] > 0),
            "free_fall_margin": state[:, 18] / self.truth.mass,
            "focal_margin": focal[:, 0],
            "given_up": np.round(np.nan_to_num(told["given_up"][:, 0])).astype(int),
            "unknown": told["unknown"],
            "estimated_position": told["position"],
            "rotor_speeds": speeds,
            "wind": wind,
        }


def _cuts(sizes: dict[str, int]) -> list[int]:
    """Return the offsets of parts of these sizes, zero first and the end last."""
    return [0, *(int(cut) for cut in np.cumsum(list(sizes.values())))]

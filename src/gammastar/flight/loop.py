"""The closed loop as one graph: (loop state, number of the step and random numbers) -> (next loop state, observation).

The loop state is explicit: the vehicle's 20 numbers, the path parameter that the law tracks from what it measures, the
parameter of the point truly nearest, the input that a sampled law holds, and whether a target on the path waits.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import engine
from gammastar.flight.draws import Draws
from gammastar.flight.integrator import Integrator
from gammastar.flight.noise import SensorNoise, measured
from gammastar.flight.rows import RowGraph, nearest_distances, normal_rows
from gammastar.flight.surroundings import foot, lookups_of, outputs_of
from gammastar.flight.variation import Variation, constants_of, graphs_of, parameters_of, unknown_in
from gammastar.law import Law, Reference
from gammastar.law.guidance import Decision, Guidance, Surroundings
from gammastar.law.piecewise import DATA_SIZE
from gammastar.vehicle import StateGraph, Vehicle, join, split
from gammastar.vehicle.state import SIZE as STATE_SIZE

OBSERVED = ("input", "transverse", "tangential", "yaw_output", "waiting", "constrained", "focal_margin")
Feedback = Literal["continuous", "start", "middle"]
FEEDBACKS = ("continuous", "start", "middle")
PARAMETER, TRUE_PARAMETER, HELD, WAITING = (
    STATE_SIZE,
    STATE_SIZE + 1,
    slice(STATE_SIZE + 2, STATE_SIZE + 6),
    STATE_SIZE + 6,
)
LOOP_SIZE = STATE_SIZE + 7


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A law around a vehicle: what is believed, what is true, how often the law runs and how the motion is integrated."""

    guidance: Guidance
    truth: Vehicle
    integrator: Integrator
    feedback: Feedback
    interval: float  # [s] between rows of the record: the integration step, or the control interval
    substeps: int  # integration steps in an interval; 1 for continuous feedback
    noise: SensorNoise | None = None
    varied: tuple[str, ...] = ()  # what the parameters of a step are, see `Variation`
    noise_scale: Any = 1.0  # of the noise; a number or a graph

    @property
    def law(self) -> Law:
        """Return the law that is flown."""
        return self.guidance.law

    @property
    def reference(self) -> Reference:
        """Return the reference along the path."""
        return self.guidance.reference

    @property
    def is_ideal(self) -> bool:
        """Return that the law acts by itself: the thrust is a state."""
        return True

    @property
    def pairs(self) -> tuple[int, ...]:
        """Return the pairs of random numbers that a step draws."""
        return () if self.noise is None else self.noise.pairs

    def step(self) -> engine.Step:
        """Return one interval; its core is built once for a path's kind, and the path's and the reference's numbers are looked up."""
        core = engine.compiled(self.signature, self._core)
        return engine.Step(core, lookups_of(self.guidance, PARAMETER, self.interval), self.pairs)

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters the graph of `_core` as a constant."""
        timing = (self.integrator.name, self.feedback, self.interval, self.substeps)
        noise = None if self.noise is None else tuple(self.noise.deviations())
        constant = constants_of(self.guidance, self.varied).signature
        return ("step", constant, self.truth.signature, timing, noise, self.varied)

    def _core(self) -> Any:
        """Return the function (loop state (27,), parameters, column, rows) -> (next loop state, observation) of a `Step`."""
        parameters = parameters_of(self.varied, self.law)
        inputs, results = self.with_variation(graphs_of(self.varied, self.law, parameters))._interval()
        return ca.Function("core", [inputs[0], parameters, *inputs[1:]], ca.cse([ca.densify(each) for each in results]))

    def of(self, truth: Vehicle) -> ClosedLoop:
        """Return the same loop around another vehicle."""
        return dataclasses.replace(self, truth=truth)

    def with_variation(self, variation: Variation) -> ClosedLoop:
        """Graph: return the loop whose truth, noise and tuning are given by graphs, or by the numbers of one flight."""
        guidance = dataclasses.replace(self.guidance, law=variation.law(self.law))
        truth, noise = variation.vehicle(self.truth), variation.noise
        return dataclasses.replace(self, guidance=guidance, truth=truth, noise_scale=noise)

    def _interval(self) -> tuple[list[Any], list[Any]]:
        """Graph: return loop state, column and rows as symbols, and the next loop state and observation."""
        loop_state, column = ca.SX.sym("loop_state", LOOP_SIZE), ca.SX.sym("column", 1 + 2 * len(self.pairs))
        rows = ca.SX.sym("rows", DATA_SIZE + self.law.path.data_size)
        time, data = column[0] * self.interval, rows[DATA_SIZE:]
        state, around = split(loop_state[:STATE_SIZE]), Surroundings(data, rows[:DATA_SIZE])
        if self.feedback == "continuous":
            after, decision, parameter, waiting = self._continuous(loop_state, state, time, around)
        else:
            seen = state
            if self.noise is not None:
                seen = measured(state, self.noise_scale * self.noise.sample(Draws(self.pairs, column[1:])))
            after, decision, parameter, waiting = self._sampled(loop_state, state, seen, time, around)
        nearest = foot(loop_state[WAITING], waiting, parameter, loop_state[TRUE_PARAMETER])
        observation = self._observation(state, nearest, loop_state[PARAMETER], waiting, decision, data)
        return [loop_state, column, rows], [after, observation]

    def start(
        self, state: np.ndarray, parameter: float, seed: int = 0, flight: int = 0, held: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the loop state (27,) at the start of a flight or phase; the input held before is, by default, the law's there."""
        first = self.starts(state[:, None], self.law.place(parameter)[:, None], [self.reference], seed, [flight])[:, 0]
        first[HELD] = first[HELD] if held is None else held
        return first

    def starts(
        self,
        states: np.ndarray,
        places: np.ndarray,
        references: Sequence[Reference],
        seed: int,
        flights: ArrayLike,
        varying: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the loop states (27, n) at the starts of flights from stacked states (20, n), nearest at places (1 + data_size, n).

        Each has its reference, or all have one; what varies is (p, n).
        """
        keys = places[0] if self.reference.over_progress else np.zeros(places.shape[1])
        pairs = zip(references, keys, strict=True) if len(references) > 1 else [(references[0], keys)]
        data = np.hstack([reference.pieces.data(np.atleast_1d(key)) for reference, key in pairs])
        started = engine.compiled(("start", *self.signature[1:]), self._started)
        given = np.empty((0, places.shape[1])) if varying is None else varying
        return np.asarray(started(states, places, data, given).full())

    def guided(self, guidance: Guidance) -> ClosedLoop:
        """Return the same loop with another law, reference or heading."""
        return dataclasses.replace(self, guidance=guidance)

    def continued(self, last: np.ndarray, parameter: float) -> np.ndarray:
        """Return the loop state that goes on from the last one of a phase along a new path, nearest at a parameter."""
        return self.start(last[:STATE_SIZE], parameter, held=last[HELD])

    def rows(self, states: np.ndarray, observations: np.ndarray) -> dict[str, np.ndarray]:
        """Return the rows of a phase by the names of the record, from loop states and observations, one column each."""
        path, rows = self.law.path, observations.shape[1]
        states, observations = states[:, :rows].T, observations.T
        state, parameters, width = states[:, :STATE_SIZE], states[:, TRUE_PARAMETER], 4 * path.components
        waiting = observations[:, 9 + width] > 0
        return {
            "state": state,
            "input": observations[:, :4],
            "transverse_state": normal_rows(path, parameters, observations[:, 4 : 4 + width]),
            "tangential_state": observations[:, 4 + width : 8 + width],
            "yaw_output": observations[:, 8 + width],
            "waiting": waiting,
            "constrained": observations[:, 10 + width] > 0,
            "distance": nearest_distances(path, state[:, :3], parameters, waiting),
            "free_fall_margin": state[:, 18] / self.truth.mass,
            "focal_margin": observations[:, -1],
        }

    def row(self, loop_state: Any, observed: Any) -> RowGraph:
        """Graph: return what is told of a row, from the loop state and its observation."""
        end = observed.shape[0]
        return RowGraph(
            split(loop_state[:STATE_SIZE]),
            observed[1:4],
            loop_state[TRUE_PARAMETER],
            observed[end - 3] > 0,
            ca.SX(0),
            observed[end - 1],
        )

    def _started(self) -> Any:
        """Return the function (stacked state, place, data of the reference, parameters) -> loop state at time zero."""
        state, reference = ca.SX.sym("state", STATE_SIZE), ca.SX.sym("reference", DATA_SIZE)
        place = ca.SX.sym("place", 1 + self.law.path.data_size)
        parameters = parameters_of(self.varied, self.law)
        guidance = self.with_variation(graphs_of(self.varied, self.law, parameters)).guidance
        waiting = guidance.waits_first(state, place)
        decision = guidance.decide(split(state), place[0], waiting, 0.0, Surroundings(place[1:], reference))
        first = ca.vertcat(state, place[0], place[0], decision.input, waiting)
        return ca.Function("started", [state, place, reference, parameters], [ca.densify(first)])

    def _continuous(
        self, loop_state: Any, state: StateGraph, time: Any, around: Surroundings
    ) -> tuple[Any, Decision, Any, Any]:
        """Graph: feedback in every stage; the path parameter is integrated too and corrected at the end."""
        path, data, decisions = self.law.path, around.path, list[Decision]()
        parameter, waiting = self.guidance.mode(state, loop_state[PARAMETER], loop_state[WAITING], data)

        def field(now: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
            current = _with(attitude, euclidean)
            decision = self.guidance.decide(current, euclidean[11], waiting, now, around)
            decisions.append(decision)
            rate = self._vehicle_rate(self.truth, current, decision.input)
            return current.angular_velocity, ca.vertcat(rate, decision.parameter_rate)

        attitude, euclidean = self.integrator.advance(
            field, time, state.attitude, ca.vertcat(_euclidean(state), parameter), self.interval
        )
        after = _with(attitude, euclidean)
        tracked = path.track(after.position, ca.vertcat(euclidean[11], data))
        true_parameter = tracked
        if self.law.approach is not None:
            true_parameter = tracked = ca.if_else(waiting, parameter, tracked)
        loop_after = ca.vertcat(join(after), tracked, true_parameter, decisions[0].input, waiting)
        return loop_after, decisions[0], parameter, waiting

    def _sampled(
        self, loop_state: Any, state: StateGraph, seen: StateGraph, time: Any, around: Surroundings
    ) -> tuple[Any, Decision, Any, Any]:
        """Graph: the input is computed once from what is measured and held while the true vehicle moves."""
        path, data, held = self.law.path, around.path, loop_state[PARAMETER]
        tracked = ca.if_else(loop_state[WAITING], held, path.track(seen.position, ca.vertcat(held, data)))
        parameter, waiting = self.guidance.mode(seen, tracked, loop_state[WAITING], data)
        used, used_time, left = seen, time, self.interval
        if self.feedback == "middle":
            used_time, left = time + self.interval / 2, self.interval / 2
            used = self._moved(self.law.vehicle, seen, loop_state[HELD], time, self.interval / 2)
            parameter = ca.if_else(waiting, parameter, path.track(used.position, ca.vertcat(parameter, data)))
        decision = self.guidance.decide(used, parameter, waiting, used_time, around)
        ahead = parameter + left * decision.parameter_rate
        symbols = ca.SX.sym("state", STATE_SIZE), ca.SX.sym("input", 4), ca.SX.sym("time")
        moved = self._moved(self.truth, split(symbols[0]), symbols[1], symbols[2], self.interval / self.substeps)
        free = unknown_in([join(moved)], [*symbols])
        substep = ca.Function("substep", [*symbols, free], ca.cse([join(moved)]))
        vector = join(state)
        for k in range(self.substeps):
            vector = substep(vector, decision.input, time + k * self.interval / self.substeps, free)
        nearest = foot(loop_state[WAITING], waiting, parameter, loop_state[TRUE_PARAMETER])
        true_parameter = ca.if_else(waiting, parameter, path.track(vector[:3], ca.vertcat(nearest, data)))
        return ca.vertcat(vector, ahead, true_parameter, decision.input, waiting), decision, parameter, waiting

    def _moved(self, vehicle: Vehicle, state: StateGraph, control: Any, time: Any, step: float) -> StateGraph:
        """Graph: return the state after one integration step with the input held."""

        def field(now: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
            current = _with(attitude, euclidean)
            return current.angular_velocity, self._vehicle_rate(vehicle, current, control)

        return _with(*self.integrator.advance(field, time, state.attitude, _euclidean(state), step))

    @staticmethod
    def _vehicle_rate(vehicle: Vehicle, state: StateGraph, control: Any) -> Any:
        """Graph: return the rate SX (11,) of the Euclidean parts of a state."""
        return ca.vertcat(*vehicle.rates(state, control[0], control[1:4]))

    def _observation(
        self, state: StateGraph, true_parameter: Any, parameter: Any, waiting: Any, decision: Decision, data: Any
    ) -> Any:
        """Graph: return what a record keeps of a row, of the true state and vehicle; see `OBSERVED`."""
        of = outputs_of(self.law, self.truth, state, true_parameter, parameter, waiting, data)
        return ca.vertcat(
            decision.input,
            ca.vec(of.transverse),
            of.tangential,
            of.yaw_value,
            waiting,
            decision.constrained,
            of.focal_margin,
        )


def _euclidean(state: StateGraph) -> Any:
    """Graph: return everything but the attitude, SX (11,)."""
    return ca.vertcat(state.position, state.velocity, state.angular_velocity, state.thrust, state.thrust_rate)


def _with(attitude: Any, euclidean: Any) -> StateGraph:
    """Graph: return the state of an attitude and the Euclidean parts; entries after the eleventh are ignored."""
    return StateGraph(euclidean[0:3], euclidean[3:6], attitude, euclidean[6:9], euclidean[9], euclidean[10])

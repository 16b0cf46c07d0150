"""The closed loop of a compiled autopilot and a plant: what is shipped flies in place of the graph that it was written from.

Sensors, plant and record are those of every flight with an autopilot; only the control interval itself is a call of foreign code.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.flight.autopiloted import ERRORS, AutopilotLoop
from gammastar.flight.draws import Draws
from gammastar.flight.surroundings import lookups_of
from gammastar.law.autopilot import TELEMETRY_SIZE, Stepped
from gammastar.law.measurement import SIZE as MEASUREMENT_SIZE
from gammastar.law.piecewise import DATA_SIZE


class Pilot(Protocol):
    """A compiled autopilot: a pure function of its state, in `ned`."""

    @property
    def interval(self) -> float:
        """Return the control interval [s]."""

    @property
    def size(self) -> int:
        """Return how many numbers its state has; the first two are the tracked parameter, on an unbroken count, and 1 while it waits."""

    def start(self, motion: np.ndarray) -> np.ndarray:
        """Return the first state (size,) from a motion (18,) that is measured as it is."""

    def step(
        self, state: np.ndarray, measurement: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
        """Return state, command, telemetry (22,), parameter and waiting after an interval, from a measurement (22,)."""


@dataclass(frozen=True, eq=False)
class PilotedStep(engine.Step):
    """A step that calls foreign code."""

    call: Any = None  # kept here, since CasADi keeps no Python


@dataclass(frozen=True, eq=False)
class PilotedLoop(AutopilotLoop):
    """A compiled autopilot around a plant; `autopilot` is the one that it was written from."""

    pilot: Pilot = field(kw_only=True)

    @property
    def sizes(self) -> tuple[int, int, int, int, int]:
        """Return the sizes of the parts of the state: plant, true parameter, sensors, compiled autopilot, wind."""
        plant, parameter, sensors, _, wind = super().sizes
        return plant, parameter, sensors, self.pilot.size, wind

    def start(self, state: np.ndarray, parameter: float, seed: int = 0, flight: int = 0) -> np.ndarray:
        """Return the loop state at the start of a flight from a stacked state (20,)."""
        plant, sensors = self.plant.start(ca.DM(state)), self.sensors.start(ca.DM(state), 1 / self.interval)
        parts = plant, parameter, sensors, self.pilot.start(state[:18]), self.wind.start(seed, flight)
        return np.asarray(ca.vertcat(*parts).full()[:, 0])

    def step(self) -> engine.Step:
        """Return one interval, for CasADi's machine alone: its core calls foreign code."""
        call = _Call(self.pilot, self.plant.command_size)
        lookups = lookups_of(self.guidance, self.parameter, self.interval)
        return PilotedStep(self._core_of(call), lookups, self.pairs, call=call)

    def _core_of(self, call: Any) -> Any:
        """Return the function (loop state, no parameters, column, rows) -> (next loop state, observation) of a `Step`, in MX."""
        loop_state, column = ca.MX.sym("loop_state", sum(self.sizes)), ca.MX.sym("column", 1 + 2 * len(self.pairs))
        rows = ca.MX.sym("rows", DATA_SIZE + self.law.path.data_size)
        plant, true_parameter, memory, pilot, gusts = ca.vertsplit(loop_state, [0, *np.cumsum(self.sizes)])
        errors, wind, after_gusts = self._chance()(column, gusts)
        memory, measurement = self._before()(plant, memory, errors)
        pilot_after, *told = call(pilot, measurement)
        after, nearest, observation = self._after()(plant, true_parameter, pilot[1], *told, wind, rows[DATA_SIZE:])
        next_state = ca.vertcat(after, nearest, memory, pilot_after, after_gusts)
        parameters = ca.MX.sym("parameters", 0)
        return ca.Function("core", [loop_state, parameters, column, rows], [next_state, observation])

    def _chance(self) -> Any:
        column, gusts = ca.SX.sym("column", 1 + 2 * len(self.pairs)), ca.SX.sym("gusts", self.wind.size)
        draws, rate = Draws(self.pairs, column[1:]), 1 / self.interval
        errors = self.sensors.drawn(column[0], draws, rate)
        return _function([column, gusts], [errors, self.wind.velocity(gusts), self.wind.advanced(gusts, draws, rate)])

    def _before(self) -> Any:
        plant, memory = ca.SX.sym("plant", self.plant.size), ca.SX.sym("memory", self.sizes[2])
        errors = ca.SX.sym("errors", ERRORS)
        return _function([plant, memory, errors], list(self.measured(plant, memory, errors)))

    def _after(self) -> Any:
        plant, true_parameter, was_waiting = ca.SX.sym("plant", self.plant.size), ca.SX.sym("true"), ca.SX.sym("was")
        command, telemetry = ca.SX.sym("command", self.plant.command_size), ca.SX.sym("telemetry", TELEMETRY_SIZE)
        parameter, waiting, wind = ca.SX.sym("parameter"), ca.SX.sym("waiting"), ca.SX.sym("wind", 3)
        data = ca.SX.sym("data", self.law.path.data_size)
        stepped = Stepped(ca.SX(0, 1), command, telemetry, parameter, waiting)
        inputs = [plant, true_parameter, was_waiting, command, telemetry, parameter, waiting, wind, data]
        return _function(inputs, list(self.moved(plant, true_parameter, was_waiting, stepped, wind, data)))


class _Call(ca.Callback):
    """The step of a pilot as a CasADi function."""

    def __init__(self, pilot: Pilot, command_size: int) -> None:
        ca.Callback.__init__(self)
        self.pilot = pilot
        self.rows = (pilot.size, command_size, TELEMETRY_SIZE, 1, 1)
        self.construct("pilot", {})

    def get_n_in(self) -> int:
        return 2

    def get_n_out(self) -> int:
        return len(self.rows)

    def get_sparsity_in(self, index: int) -> Any:
        return ca.Sparsity.dense((self.pilot.size, MEASUREMENT_SIZE)[index], 1)

    def get_sparsity_out(self, index: int) -> Any:
        return ca.Sparsity.dense(self.rows[index], 1)

    def eval(self, arguments: Any) -> Any:
        state, measurement = (each.full()[:, 0] for each in arguments)
        return [ca.DM(each) for each in self.pilot.step(state, measurement)]


def _function(inputs: list[Any], outputs: list[Any]) -> Any:
    return ca.Function("part", inputs, ca.cse([ca.densify(each) for each in outputs]))

"""A compiled export as a pure function of its state, in `ned`: what a closed loop in Python flies in place of the graph."""

from __future__ import annotations

import ctypes
import functools
from dataclasses import dataclass

import numpy as np

from gammastar.export.load import WAITING, Compiled, loaded, told_of
from gammastar.export.program import Program
from gammastar.law.actuation import RotorSpeeds
from gammastar.law.autopilot import TELEMETRY

WORD = 4  # [bytes]: the state is handed over in words, which float64 holds exactly


@dataclass(frozen=True, eq=False)
class CompiledPilot:
    """A program compiled when it is first needed; see `gammastar.flight.software_in_the_loop.Pilot`."""

    program: Program

    @property
    def interval(self) -> float:
        """Return the control interval [s]."""
        return self.program.autopilot.interval

    @property
    def size(self) -> int:
        """Return how many numbers the state has: parameter and waiting, and the words of the C's structure."""
        return 2 + ctypes.sizeof(self.code.structures.state) // WORD

    @functools.cached_property
    def code(self) -> Compiled:
        """Return the compiled program.

        Raises:
            CompilerError: No compiler answers.
        """
        return loaded(self.program)

    def start(self, motion: np.ndarray) -> np.ndarray:
        """Return the first state (size,) from a motion (18,) that is measured as it is."""
        pilot = self.code.start(self.program.graphs.measurement(motion))
        return self._packed(pilot.state, pilot.memory[0], pilot.memory[1])

    def step(
        self, state: np.ndarray, measurement: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
        """Return state, command, telemetry (22,), parameter and waiting after an interval, from a measurement (22,)."""
        graphs, period = self.program.graphs, self.program.path.period or 0.0
        inside = state[2:].astype(np.uint32).tobytes()
        pilot = self.code.going_on(inside)
        output = pilot.step(graphs.measurement(measurement[:18], measurement[18:]))
        told = told_of(output)
        command, turned = np.array(output.command), graphs.outside
        if not isinstance(self.program.autopilot.actuation, RotorSpeeds):
            command[1:] = turned(command[1:])
        told["input"][1:] = turned(told["input"][1:])
        told["unknown"] = turned(told["unknown"].reshape(4, 3)).ravel()
        told["position"] = turned(told["position"])
        telemetry = np.concatenate([told[name] for name in TELEMETRY])
        unbroken = pilot.memory[0] + period * pilot.state.laps
        after = self._packed(pilot.state, unbroken, pilot.memory[1])
        parameter = float(told["parameter"][0]) + period * output.laps
        return after, command, telemetry, parameter, float(bool(output.flags & WAITING))

    def _packed(self, state: ctypes.Structure, parameter: float, waiting: float) -> np.ndarray:
        words = np.frombuffer(bytes(state), dtype=np.uint32)
        return np.concatenate([[parameter, waiting], words])

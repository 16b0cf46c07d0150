"""What an exported autopilot computes, as graphs that take and give numbers in the mission's frame.

A measurement is SX (22,): position [m] and velocity [m/s] in the world, the attitude row by row (body to world), body rates [rad/s],
and the freshness of the four channels.  The memory SX (n,) is the autopilot's own state and stays in `ned`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.frames import convert_vector
from gammastar.law.actuation import RotorSpeeds
from gammastar.law.autopilot import TELEMETRY, Autopilot
from gammastar.law.filter import MOTION
from gammastar.law.guidance import Surroundings
from gammastar.law.measurement import SIZE as MEASUREMENT_SIZE
from gammastar.law.piecewise import DATA_SIZE
from gammastar.path import ParametricPath

FARTHEST = 1e6  # [m] from the origin, ...
FASTEST = 1e4  # [m/s] and [rad/s]: measurements beyond are errors
SKEWED = 0.1  # of an entry of R^T R from the identity: farther is no attitude
TOLD = {**TELEMETRY, "parameter": 1}  # what an interval tells beside its command, with sizes


@dataclass(frozen=True, eq=False)
class Graphs:
    """The functions of one autopilot."""

    autopilot: Autopilot
    frame: str
    thrust: float  # [N] and ...
    thrust_rate: float  # [N/s] at the start
    near: float  # path parameter to whose turn of a closed path a start is counted

    @property
    def reads_reference(self) -> bool:
        """Return whether the reference changes its data: over time in several pieces, or over progress."""
        reference = self.autopilot.guidance.reference
        return reference.over_progress or len(reference.pieces.begins) > 1

    @property
    def data_size(self) -> int:
        """Return how many numbers of the path are looked up."""
        return int(self.autopilot.law.path.data_size)

    def interval(self) -> Any:
        """Return the function (memory, measurement, time, reference, path) -> (memory, command, told) of one control interval."""
        pilot = self.autopilot
        memory, measurement, path = ca.SX.sym("memory", pilot.size), _measurement(), self._path()
        time, reference = ca.SX.sym("time"), ca.SX.sym("reference", DATA_SIZE if self.reads_reference else 0)
        data = reference if self.reads_reference else ca.DM(pilot.guidance.reference.pieces.rows[0])
        stepped = pilot.step(memory, self._inside(measurement), time, Surroundings(path, data))
        command = stepped.command if isinstance(pilot.actuation, RotorSpeeds) else self.turned_wrench(stepped.command)
        parts = dict(
            zip(TELEMETRY, ca.vertsplit(stepped.telemetry, np.cumsum([0, *TELEMETRY.values()]).tolist()), strict=True)
        )
        parts["input"] = self.turned_wrench(parts["input"])
        parts["unknown"] = ca.vertcat(*map(self._turned, ca.vertsplit(parts["unknown"], 3)))
        parts["position"] = self._turned(parts["position"])
        told = ca.vertcat(*(parts[name] for name in TELEMETRY), stepped.parameter)
        return _function("interval", [memory, measurement, time, reference, path], [stepped.state, command, told])

    def start(self) -> Any:
        """Return the function (measurement, parameter, path) -> first memory."""
        measurement, parameter, path = _measurement(), ca.SX.sym("parameter"), self._path()
        motion = self._inside(measurement)[:MOTION]
        state = ca.vertcat(motion, self.thrust, self.thrust_rate)
        waiting = self.autopilot.guidance.waits_first(state, ca.vertcat(parameter, path))
        memory = self.autopilot.started(motion, self.thrust, self.thrust_rate, parameter, waiting)
        return _function("start", [measurement, parameter, path], [memory])

    def nearer(self) -> Any:
        """Return the function (measurement, parameter, path) -> parameter after a Newton step to the point nearest to the position."""
        measurement, parameter, path = _measurement(), ca.SX.sym("parameter"), self._path()
        where, place = self._inside(measurement)[:3], ca.vertcat(parameter, path)
        of = self.autopilot.law.path
        moved = of.track(where, place, 1) if isinstance(of, ParametricPath) else of.track(where, place)
        return _function("nearer", [measurement, parameter, path], [moved])

    def usable(self) -> Any:
        """Return the function measurement -> 1 if it may be one, 0 if it is not finite, absurd, or its attitude no rotation."""
        measurement = _measurement()
        position, velocity, rows, rates, fresh = ca.vertsplit(measurement, [0, 3, 6, 15, 18, MEASUREMENT_SIZE])
        attitude = ca.reshape(rows, 3, 3)
        limits = [(position, FARTHEST), (velocity, FASTEST), (rates, FASTEST), (fresh, 1)]
        limits += [(ca.vec(ca.mtimes(attitude.T, attitude) - ca.SX.eye(3)), SKEWED)]
        checks = [ca.fabs(entry) <= limit for vector, limit in limits for entry in ca.vertsplit(vector)]
        found = ca.det(attitude) > 0
        for check in checks:
            found = ca.logic_and(found, check)
        return _function("usable", [measurement], [found])

    def outside(self, vectors: np.ndarray) -> np.ndarray:
        """Return vectors (..., 3) of `ned` in the mission's frame, or the reverse."""
        return convert_vector(vectors, self.frame)

    def measurement(self, motion: np.ndarray, fresh: ArrayLike = (1.0, 1.0, 1.0, 1.0)) -> np.ndarray:
        """Return the measurement (22,) of a motion (18,) in `ned`; all of it is fresh when nothing else is said."""
        attitude = motion[6:15].reshape(3, 3).T
        signs = np.diag(self._signs)
        parts = [
            self.outside(motion[:3]),
            self.outside(motion[3:6]),
            (signs @ attitude @ signs).ravel(),
            self.outside(motion[15:18]),
        ]
        return np.concatenate([*parts, np.asarray(fresh)])

    @property
    def _signs(self) -> np.ndarray:
        return convert_vector(np.ones(3), self.frame)

    def _turned(self, vector: Any) -> Any:
        """Graph: return a vector SX (3,) of the mission's frame in `ned`, or the reverse."""
        return ca.DM(self._signs) * vector

    def turned_wrench(self, wrench: Any) -> Any:
        """Graph: return a wrench SX (4,), or an input, of `ned` in the mission's frame."""
        return ca.vertcat(wrench[0], self._turned(wrench[1:]))

    def _inside(self, measurement: Any) -> Any:
        """Graph: return the measurement of the autopilot, SX (22,) in `ned` with the attitude column by column."""
        position, velocity, rows, rates, fresh = ca.vertsplit(measurement, [0, 3, 6, 15, 18, MEASUREMENT_SIZE])
        signs = ca.diag(ca.DM(self._signs))
        attitude = ca.mtimes([signs, ca.reshape(rows, 3, 3).T, signs])
        return ca.vertcat(self._turned(position), self._turned(velocity), ca.vec(attitude), self._turned(rates), fresh)

    def _path(self) -> Any:
        return ca.SX.sym("path", self.data_size)


def _measurement() -> Any:
    return ca.SX.sym("measurement", MEASUREMENT_SIZE)


def _function(name: str, inputs: list[Any], outputs: list[Any]) -> Any:
    return ca.Function(name, inputs, ca.cse([ca.densify(ca.SX(each)) for each in outputs]))

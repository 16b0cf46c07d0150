"""Where the flights of a campaign begin, in the mission's frame: states to fly from, and columns to study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.frames import convert_attitude, convert_vector
from gammastar.mission import Mission, turn
from gammastar.mission.campaign import ALONG
from gammastar.path import Path
from gammastar.path.base import distinct
from gammastar.vehicle import State

PARTS = ("position", "velocity", "attitude", "angular_velocity")
AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Starts:
    """Starts of n flights: world and body axes of a frame."""

    frame: str
    position: np.ndarray  # (n, 3) [m]
    velocity: np.ndarray  # (n, 3) [m/s]
    attitude: np.ndarray  # (n, 3, 3), body to world
    angular_velocity: np.ndarray  # (n, 3) [rad/s], body
    thrust: float | None  # [N]; None is the weight
    thrust_rate: float  # [N/s]

    @classmethod
    def of(cls, mission: Mission, paths: Sequence[Path], **given: np.ndarray) -> Starts:
        """Return the starts of flights of a mission along paths, with the parts that are given, (n, ...), in place of its own.

        A position (n, 4) is a share of the path's domain and an offset [m] from the path there.
        """
        own, frame, count = mission.start(), mission.frame, len(paths)
        if "position" in given and given["position"].shape[1:] == ALONG:
            given["position"] = _beside(paths, given["position"], frame)
        parts = {
            "position": convert_vector(own.position, frame),
            "velocity": convert_vector(own.velocity, frame),
            "attitude": convert_attitude(own.attitude, frame),
            "angular_velocity": convert_vector(own.angular_velocity, frame),
        }
        every = {name: given.get(name, np.broadcast_to(part, (count, *part.shape))) for name, part in parts.items()}
        return cls(frame, **every, thrust=own.thrust, thrust_rate=own.thrust_rate)

    def states(self, places: np.ndarray) -> list[State]:
        """Return the states of some of them, in `ned`.

        Raises:
            InputError: One cannot be one, such as a position out of all range.
        """
        rest: dict[str, Any] = {"thrust": self.thrust, "thrust_rate": self.thrust_rate}
        parts = zip(*(getattr(self, name)[places] for name in PARTS), strict=True)
        return [turn.state_in_ned(x, v, r, w, self.frame, **rest) for x, v, r, w in parts]

    def section(self, place: int) -> dict[str, Any]:
        """Return one of them as the section [start] of a mission."""
        parts = {name: getattr(self, name)[place].tolist() for name in PARTS}
        thrust = {} if self.thrust is None else {"thrust": self.thrust}
        return {**parts, **thrust, "thrust_rate": self.thrust_rate}

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns (n,) that tell of them, with units.

        The tilt is that of the body's third axis from upright.  Directions are angles from the first axis of the world towards the
        second: that towards which the body's top leans, and that of its nose.
        """
        upright = 1.0 if self.frame == "enu" else -1.0
        top, nose = upright * self.attitude[:, :, 2], self.attitude[:, :, 0]
        units = {"position": "m", "velocity": "m_s", "angular_velocity": "rad_s"}
        columns = {
            f"start_{part}_{axis}_{unit}": getattr(self, part)[:, k]
            for part, unit in units.items()
            for k, axis in enumerate(AXES)
        }
        angles = {
            "start_tilt_deg": np.arccos(np.clip(self.attitude[:, 2, 2], -1.0, 1.0)),
            "start_tilt_direction_deg": np.arctan2(top[:, 1], top[:, 0]),
            "start_heading_deg": np.arctan2(nose[:, 1], nose[:, 0]),
        }
        return columns | {name: np.degrees(angle) for name, angle in angles.items()}


def unknown(count: int) -> dict[str, np.ndarray]:
    """Return the columns of starts that cannot be told, NaN."""
    none, turned = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    columns = Starts("ned", none, none, turned, none, None, 0.0).columns()
    return {name: column.copy() for name, column in columns.items()}


def _beside(paths: Sequence[Path], places: np.ndarray, frame: str) -> np.ndarray:
    """Return positions (n, 3) [m] at shares of the domains of paths, with offsets from there."""
    points = np.empty((len(paths), 3))
    for path, own in distinct(paths):
        low, high = path.domain
        points[own] = path.points(low + (high - low) * places[own, 0])
    return np.asarray(convert_vector(points, frame) + places[:, 1:])

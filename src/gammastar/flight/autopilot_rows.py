"""What a record keeps of an autopilot and its surroundings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

GIVEN_UP = ("nothing", "along", "yaw", "thrust", "roll_and_pitch")  # by the numbers in the rows
UNKNOWN = (
    *(f"unknown_{name}_{axis}" for name in ("acceleration", "jerk", "snap") for axis in "xyz"),
    *(f"unknown_angular_acceleration_{axis}" for axis in "xyz"),
)


@dataclass(frozen=True, eq=False)
class AutopilotRows:
    """What an autopilot believed and gave, and what the air did, row by row."""

    given_up: (
        np.ndarray
    )  # (n,) int, the most important thing that limits took: 0 nothing, 1 along, 2 yaw, 3 thrust, 4 roll and pitch
    unknown: (
        np.ndarray
    )  # (n, 12): unknown acceleration [m/s^2], its two rates, world, and angular acceleration [rad/s^2], body
    estimated_position: np.ndarray  # (n, 3) [m], world: what the law believed
    rotor_speeds: np.ndarray  # (n, k) [rad/s] of the true rotors
    wind: np.ndarray  # (n, 3) [m/s], world

    def columns(self) -> dict[str, np.ndarray]:
        """Return the rows as named columns (n,)."""
        columns = {"given_up": self.given_up}
        columns |= {name: self.unknown[:, k] for k, name in enumerate(UNKNOWN)}
        columns |= {f"estimated_position_{axis}": self.estimated_position[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"rotor_speed_{k + 1}": speeds for k, speeds in enumerate(self.rotor_speeds.T)}
        return columns | {f"wind_{axis}": self.wind[:, k] for k, axis in enumerate("xyz")}

    def summary(self) -> dict[str, Any]:
        """Return the numbers worth knowing first, keys with units."""
        shares = np.bincount(self.given_up, minlength=len(GIVEN_UP)) / max(len(self.given_up), 1)
        values: dict[str, Any] = {
            "given_up_share": {name: float(share) for name, share in zip(GIVEN_UP[1:], shares[1:], strict=True)},
            "unknown_acceleration_final_m_s2": float(np.linalg.norm(self.unknown[-1, :3])),
            "unknown_angular_acceleration_final_rad_s2": float(np.linalg.norm(self.unknown[-1, 9:])),
        }
        if self.rotor_speeds.size:
            values["rotor_speed_rad_s"] = {"min": float(self.rotor_speeds.min()), "max": float(self.rotor_speeds.max())}
        return values

"""Distributions of attitudes that a campaign draws: any, tilted, or turned about one axis; see `distributions`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import direction, number
from gammastar.errors import InputError


@dataclass(frozen=True, eq=False)
class AnyAttitude:
    """Uniform on SO(3), by Haar's measure.

    Source: K. Shoemake, Uniform random rotations, Graphics Gems III, 1992.
    """

    size: ClassVar[int] = 3
    shape: ClassVar[tuple[int, ...]] = (3, 3)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return rotations (n, 3, 3) for uniform numbers (n, 3)."""
        first, second = np.sqrt(1 - uniforms[:, 0]), np.sqrt(uniforms[:, 0])
        a, b = 2 * np.pi * uniforms[:, 1], 2 * np.pi * uniforms[:, 2]
        x, y, z, w = first * np.sin(a), first * np.cos(a), second * np.sin(b), second * np.cos(b)
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return np.moveaxis(np.array(rows), -1, 0)


@dataclass(frozen=True, eq=False)
class Tilted:
    """A uniform heading, then tilted by a uniform angle about a horizontal axis of uniform direction."""

    low: float = 0.0  # [deg] of tilt
    high: float = 180.0  # [deg]

    def __post_init__(self) -> None:
        _set_angles(self, 0.0, 180.0)

    size: ClassVar[int] = 3
    shape: ClassVar[tuple[int, ...]] = (3, 3)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return rotations (n, 3, 3) for uniform numbers (n, 3)."""
        tilt = np.radians(self.low + (self.high - self.low) * uniforms[:, 0])
        axis, heading = 2 * np.pi * uniforms[:, 1], 2 * np.pi * uniforms[:, 2]
        zeros = np.zeros(len(tilt))
        tilted = _turned(np.stack([tilt * np.cos(axis), tilt * np.sin(axis), zeros], 1))
        return np.asarray(tilted @ _turned(np.stack([zeros, zeros, heading], 1)))


@dataclass(frozen=True, eq=False)
class About:
    """Turned about one axis by a uniform angle, from level with the nose along the first axis."""

    axis: ArrayLike = (1.0, 0.0, 0.0)
    low: float = -180.0  # [deg]
    high: float = 180.0  # [deg]

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", direction(self.axis, "axis"))
        _set_angles(self, -360.0, 360.0)

    size: ClassVar[int] = 1
    shape: ClassVar[tuple[int, ...]] = (3, 3)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return rotations (n, 3, 3) for uniform numbers (n, 1)."""
        return _turned(np.radians(self.low + (self.high - self.low) * uniforms) * np.asarray(self.axis))


def _set_angles(distribution: Any, least: float, most: float) -> None:
    low, high = number(distribution.low, "low [deg]"), number(distribution.high, "high [deg]")
    if not least <= low < high <= most:
        raise InputError(
            f"low must be below high and both between {least:g} and {most:g} deg (got {low:g} and {high:g}); correct them"
        )
    object.__setattr__(distribution, "low", low)
    object.__setattr__(distribution, "high", high)


def _turned(vectors: np.ndarray) -> np.ndarray:
    """Return the rotations (n, 3, 3) by rotation vectors (n, 3) [rad]."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vectors).as_matrix())

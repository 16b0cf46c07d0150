"""What a campaign varies, and how: distributions that turn uniform random numbers into values.

Every distribution takes numbers in (0, 1), `size` of them for a value, so that pseudo-random numbers and points of low discrepancy serve
alike, and value k depends on the numbers of flight k alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import LARGEST, array, magnitude, number, shape_of, shortened
from gammastar.errors import InputError, ShapeError

LEAST_LEFT = 1e-12  # of a normal distribution that its cut may leave


class Distribution(Protocol):
    """A distribution over numbers, vectors (3,) or rotations (3, 3)."""

    @property
    def size(self) -> int:
        """Return how many uniform numbers a value takes."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the shape of a value: (), (3,) or (3, 3)."""

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return values (n, *shape) for uniform numbers (n, size)."""


@dataclass(frozen=True, eq=False)
class Uniform:
    """Uniform between two ends: of a number, or of the three coordinates of a vector, a box."""

    low: ArrayLike
    high: ArrayLike

    def __post_init__(self) -> None:
        _set(self, "low", "high")
        low, high = np.asarray(self.low), np.asarray(self.high)
        if not np.all(low < high):
            raise InputError(f"low must be below high (got {low.tolist()} and {high.tolist()}); swap or part them")

    @property
    def size(self) -> int:
        """Return one, or three."""
        return max(1, int(np.size(self.low)))

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the shape of the ends."""
        return np.shape(self.low)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return values (n, *shape) for uniform numbers (n, size)."""
        low, high = np.asarray(self.low), np.asarray(self.high)
        return np.asarray(low + (high - low) * uniforms.reshape(-1, *self.shape))


@dataclass(frozen=True, eq=False)
class LogUniform:
    """Uniform in the logarithm of the magnitude, between two numbers of one sign, neither zero."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _set(self, "low", "high", vectors=False)
        if not self.low < self.high or self.low * self.high <= 0:
            raise InputError(
                f"low must be below high and both of one sign, without zero (got {self.low:g} and {self.high:g}); correct them"
            )

    size: ClassVar[int] = 1
    shape: ClassVar[tuple[int, ...]] = ()

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return values (n,) for uniform numbers (n, 1)."""
        return np.asarray(self.low * (self.high / self.low) ** uniforms[:, 0])


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal, or cut to between two ends: of a number, or of the three coordinates of a vector, independently."""

    mean: ArrayLike
    deviation: ArrayLike  # standard deviation, before it is cut
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        _set(self, "mean", "deviation")
        if np.any(np.asarray(self.deviation) <= 0):
            raise InputError(
                f"deviation must be positive (got {np.asarray(self.deviation).tolist()}); leave out what does not vary"
            )
        for name in ("low", "high"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number(getattr(self, name), name))
        low, high = self._ends
        if np.any(high - low < LEAST_LEFT):
            raise InputError(
                f"low and high must leave some of the distribution (got {self.low} and {self.high}); widen them"
            )

    @property
    def size(self) -> int:
        """Return one, or three."""
        return max(1, int(np.size(self.mean)))

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the shape of the mean."""
        return np.shape(self.mean)

    @property
    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """The shares of the uncut distribution below the ends."""
        from scipy.special import ndtr

        mean, deviation = np.asarray(self.mean), np.asarray(self.deviation)
        low = -np.inf if self.low is None else self.low
        high = np.inf if self.high is None else self.high
        return ndtr((low - mean) / deviation), ndtr((high - mean) / deviation)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return values (n, *shape) for uniform numbers (n, size)."""
        from scipy.special import ndtri

        low, high = self._ends
        shares = low + (high - low) * uniforms.reshape(-1, *self.shape)
        return np.asarray(np.asarray(self.mean) + np.asarray(self.deviation) * ndtri(shares))


@dataclass(frozen=True, eq=False)
class Ball:
    """Uniform in a ball."""

    radius: float
    center: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", magnitude(self.radius, "radius", above=0))
        object.__setattr__(self, "center", array(self.center, "center", (3,)))

    size: ClassVar[int] = 3
    shape: ClassVar[tuple[int, ...]] = (3,)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return points (n, 3) for uniform numbers (n, 3)."""
        sizes = self.radius * np.cbrt(uniforms[:, :1])
        return np.asarray(self.center + sizes * _directions(uniforms[:, 1], uniforms[:, 2]))


@dataclass(frozen=True, eq=False)
class AlongPath:
    """On the path at a uniform share of its parameter's domain, and from there somewhere in a ball."""

    low: float = 0.0  # share of the domain
    high: float = 1.0
    radius: float = 0.0  # [m] of the ball

    def __post_init__(self) -> None:
        _set(self, "low", "high", vectors=False)
        if not 0 <= self.low < self.high <= 1:
            raise InputError(
                f"low must be below high and both between 0 and 1 (got {self.low:g} and {self.high:g}); give shares of the path"
            )
        object.__setattr__(self, "radius", magnitude(self.radius, "radius [m]", at_least=0))

    size: ClassVar[int] = 4
    shape: ClassVar[tuple[int, ...]] = (4,)

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return the share and the offset from the path, (n, 4), for uniform numbers (n, 4)."""
        shares = self.low + (self.high - self.low) * uniforms[:, :1]
        sizes = self.radius * np.cbrt(uniforms[:, 1:2])
        return np.hstack([shares, sizes * _directions(uniforms[:, 2], uniforms[:, 3])])


def _set(distribution: Any, first: str, second: str, vectors: bool = True) -> None:
    """Check two numbers or vectors (3,) of one shape and keep them as arrays, or as numbers."""
    shapes = {shape_of(getattr(distribution, name)) for name in (first, second)}
    if not shapes <= ({(), (3,)} if vectors else {()}) or len(shapes) > 1:
        form = "two numbers, or two lists of three" if vectors else "two numbers"
        got = " and ".join(shortened(getattr(distribution, name)) for name in (first, second))
        raise ShapeError(f"{first} and {second} must be {form} (got {got}); give both in the same form")
    for name in (first, second):
        value = getattr(distribution, name)
        checked = array(value, name, (3,)) if shapes == {(3,)} else number(value, name)
        if np.any(np.abs(checked) > LARGEST):
            raise InputError(f"{name} must be at most {LARGEST:g} (got {shortened(value)}); check its unit")
        object.__setattr__(distribution, name, checked)


def _directions(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return uniform unit vectors (n, 3) for uniform numbers (n,) each: heights on a sphere are uniform (Archimedes)."""
    height, angle = 2 * first - 1, 2 * np.pi * second
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)

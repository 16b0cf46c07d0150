"""A piecewise polynomial of degree 7 as plain numbers: what a path through waypoints is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gammastar.errors import InputError, ShapeError

DEGREE = 7
SMOOTH = 6  # derivatives that are continuous at the knots
STRAIGHT = (
    1e-3  # [rad] a bend in one segment below which jumps count absolutely: a straight line has none to compare with
)
SAMPLES = 32  # in each segment, of the search for the slowest place
POLISH = 8  # Newton steps from the best samples; they converge quadratically at a cusp

# DERIVATIVE[k, j] is the factor of l^(j - k) in the k-th derivative of l^j.
DERIVATIVE = np.array([[math.perm(j, k) for j in range(DEGREE + 1)] for k in range(DEGREE + 1)], dtype=float)


@dataclass(frozen=True, eq=False)
class Spline:
    """A curve made of polynomials, one between any two neighbouring knots; C^6 when `jumps` are rounding.

    Raises:
        ShapeError: The arrays do not fit together.
        InputError: A number is not finite, or the knots do not increase.
    """

    knots: np.ndarray  # (m+1,) [m] parameter where segments meet, increasing
    coefficients: (
        np.ndarray
    )  # (m, 3, 8) [m, 1, 1/m, ...] of the powers 0 ... 7 of (parameter - knot at the segment's start), world
    closed: bool = False  # the last segment ends where the first begins, with all derivatives

    def __post_init__(self) -> None:
        knots, coefficients = np.array(self.knots, dtype=float), np.array(self.coefficients, dtype=float)
        if knots.ndim != 1 or len(knots) < 2 or coefficients.shape != (len(knots) - 1, 3, DEGREE + 1):
            raise ShapeError(
                f"a spline of m segments must have m + 1 knots and coefficients (m, 3, {DEGREE + 1}) (got {knots.shape} and "
                f"{coefficients.shape}); give one set of coefficients a segment"
            )
        if not np.all(np.isfinite(knots)) or not np.all(np.isfinite(coefficients)) or np.any(np.diff(knots) <= 0):
            raise InputError("a spline must have finite coefficients and increasing knots (got others); correct them")
        for name, value in (("knots", knots), ("coefficients", coefficients)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def lengths(self) -> np.ndarray:
        """Return how far the parameter runs in each segment (m,) [m]."""
        return np.diff(self.knots)

    @property
    def period(self) -> float | None:
        """Return how far the parameter runs in one round [m], or None for an open spline."""
        return float(self.knots[-1] - self.knots[0]) if self.closed else None

    def segments(self, parameters: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return the segment (n,) that each parameter (n,) lies in, and how far it lies behind that segment's first knot.

        A closed spline goes on round and round; the end segments of an open one go on beyond its ends.
        """
        wanted = np.atleast_1d(np.asarray(parameters, dtype=float))
        if self.closed:
            wanted = self.knots[0] + np.mod(wanted - self.knots[0], self.knots[-1] - self.knots[0])
        segments = np.clip(np.searchsorted(self.knots, wanted, side="right") - 1, 0, len(self.knots) - 2)
        return segments, wanted - self.knots[segments]

    def evaluate(self, parameters: ArrayLike, order: int = 5) -> np.ndarray:
        """Return the derivatives (n, order + 1, 3) of the curve at parameters (n,), the point itself first."""
        segments, offsets = self.segments(parameters)
        return np.moveaxis(derivatives(self.coefficients[segments], offsets, order), 1, 2)

    def jumps(self) -> np.ndarray:
        """Return the largest jump of each derivative 0 ... 6 at any knot (7,), relative to that derivative's size.

        The size is the largest that its terms reach anywhere, or where the spline is nearly straight that of a bend of
        `STRAIGHT` in one segment of the mean length h, STRAIGHT h^(1-k).
        """
        order = np.arange(SMOOTH + 1)
        ends = derivatives(self.coefficients, self.lengths, SMOOTH)
        starts = derivatives(self.coefficients, 0 * self.lengths, SMOOTH)
        gaps = np.abs(ends - np.roll(starts, -1, axis=0)) if self.closed else np.abs(ends[:-1] - starts[1:])
        sizes = derivatives(np.abs(self.coefficients), self.lengths, SMOOTH).max(axis=(0, 1))
        return np.asarray(
            gaps.max(axis=(0, 1), initial=0.0) / np.maximum(sizes, STRAIGHT * self.lengths.mean() ** (1.0 - order))
        )

    def slowest(self) -> tuple[float, float]:
        """Return the parameter at which |sigma'| is smallest, and that value: zero is a cusp, or a turn on the spot.

        Best of the local minima of a dense sample, each polished by Newton steps on <sigma', sigma''> = 0.
        """
        samples = self.lengths[:, None] * np.linspace(0, 1, SAMPLES + 1)
        speeds = _speeds(self.coefficients[:, None], samples)
        edged = np.pad(speeds, ((0, 0), (1, 1)), constant_values=np.inf)
        rows, columns = np.nonzero((speeds < edged[:, :-2]) & (speeds <= edged[:, 2:]))
        start, length, coefficients = samples[rows, columns], self.lengths[rows], self.coefficients[rows]
        low, high = np.maximum(start - length / SAMPLES, 0), np.minimum(start + length / SAMPLES, length)
        offsets = start
        for _ in range(POLISH):
            _, first, second, third = np.moveaxis(derivatives(coefficients, offsets, 3), -1, 0)
            slope = np.sum(second * second + first * third, axis=-1)
            step = np.divide(-np.sum(first * second, axis=-1), slope, out=np.zeros_like(slope), where=slope > 0)
            offsets = np.clip(offsets + step, low, high)
        candidates = np.concatenate([self.knots[rows] + start, self.knots[rows] + offsets])
        found = np.concatenate([speeds[rows, columns], _speeds(coefficients, offsets)])
        return float(candidates[found.argmin()]), float(found.min())


def derivatives(coefficients: np.ndarray, offsets: np.ndarray, order: int) -> np.ndarray:
    """Return the derivatives (..., 3, order + 1) of polynomials with coefficients (..., 3, 8) at offsets (...,)."""
    powers = np.arange(DEGREE + 1)
    values = []
    for k in range(order + 1):
        terms = DERIVATIVE[k, k:] * offsets[..., None] ** powers[: DEGREE + 1 - k]
        values.append(np.einsum("...ij,...j->...i", coefficients[..., k:], terms))
    return np.stack(values, axis=-1)


def _speeds(coefficients: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(derivatives(coefficients, offsets, 1)[..., 1], axis=-1))

"""What a path is held to when it is made: finite, moving on everywhere, closed if it says so, and of class C^5."""

from __future__ import annotations

from typing import Any

import numpy as np

from gammastar.errors import PathError
from gammastar.path.base import Path
from gammastar.path.sampling import Samples, sample
from gammastar.path.smoothness import jump_at_seam, jumping, jumps

POINTS = 512  # samples; `certify` looks closer
STANDSTILL = 1e-9  # of the largest |sigma'|, or absolutely: slower is a cusp
SLOWING = 0.5  # of |sigma'| that its slope takes away within a sample, where a standstill may hide behind it
HALVINGS = 50  # of such an interval
CLOSED = 1e-9  # of the size of the curve: a wider gap after the period is no rounding
IN_PLANE = 1e-9  # sine of the angle between the tangent and the plane
SEAM_POINTS = 65  # samples that tell how large a jump at the seam is


def check_regular(path: Any) -> None:
    """Refuse a parametric curve that is not finite, stands still, leaves its plane or does not close, with the place."""
    low, high = path.domain
    grid = np.linspace(low, high, POINTS)
    jets = path.jets(grid, 2)
    speeds = np.linalg.norm(jets[:, 1], axis=1)
    bad = ~np.isfinite(jets).all(axis=(1, 2))
    if bad.any():
        raise PathError(
            f"{path.name} must be finite (got NaN or infinity at parameter {grid[bad.argmax()]:.4g}); "
            "check its numbers, and use casadi functions, not math"
        )
    slowest, least = _slowest(path, grid, jets)
    if least <= STANDSTILL * max(1.0, speeds.max()):
        point = (path.points(np.array([slowest]))[0].round(6) + 0.0).tolist()
        raise PathError(
            f"{path.name} must be regular (got zero speed at parameter {round(slowest, 9) + 0.0:.6g}, point {point}); "
            "give it a size, or another parameterisation"
        )
    if path.plane_normal is not None:
        leaving = np.abs(jets[:, 1] @ np.asarray(path.plane_normal)) / speeds
        if leaving.max() > IN_PLANE:
            raise PathError(
                f"{path.name} must lie in the plane of its plane_normal (got a tangent out of it at parameter "
                f"{grid[leaving.argmax()]:.4g}); leave plane_normal out"
            )
    if path.period is not None:
        gap = float(np.linalg.norm(jets[0, 0] - jets[-1, 0]))
        if gap > CLOSED * float(np.ptp(jets[:, 0], axis=0).max()):
            raise PathError(f"{path.name} must close after its period (got a gap of {gap:.3g} m); correct the period")


def check_smooth(path: Path, may_bend: bool) -> None:
    """Refuse a path that is not of class C^5, with the places: at its seam, and inside if its graph may bend there."""
    if may_bend:
        samples = sample(path)
        found = jumps(samples)
    else:
        grid = np.linspace(*path.domain, SEAM_POINTS)
        samples = Samples(path, grid, path.jets(grid), np.empty(0))
        found = jump_at_seam(samples)
    if found:
        raise PathError(jumping(path.name, found, samples.places(np.array([jump.parameter for jump in found]))))


def _slowest(path: Any, grid: np.ndarray, jets: np.ndarray) -> tuple[float, float]:
    """Return where |sigma'| is least, and that speed: among the samples, and between those where it falls and rises steeply."""
    speeds = np.linalg.norm(jets[:, 1], axis=1)
    slopes = np.sum(jets[:, 1] * jets[:, 2], axis=1)  # half the derivative of the squared speed
    drop = np.abs(slopes) * (grid[1] - grid[0]) >= SLOWING * speeds**2
    dips = np.flatnonzero((slopes[:-1] < 0) & (slopes[1:] > 0) & (drop[:-1] | drop[1:]))
    low, high = grid[dips], grid[dips + 1]
    for _ in range(HALVINGS if dips.size else 0):
        middle = (low + high) / 2
        _, first, second = np.moveaxis(path.jets(middle, 2), 1, 0)
        falls = np.sum(first * second, axis=1) < 0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    places = np.concatenate([grid, low])
    values = np.concatenate([speeds, np.linalg.norm(path.jets(low, 2)[:, 1], axis=1)]) if dips.size else speeds
    best = int(np.argmin(values))
    return float(places[best]), float(values[best])

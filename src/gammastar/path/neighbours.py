"""Which of many points are nearest to others, where both come in order along a curve: whole runs of them are looked at together.

A search tree answers the same question as fast, but the library that has one takes a quarter of a second to load, longer than the
search along a flight.
"""

from __future__ import annotations

import numpy as np

RUN = 64  # of positions, and of points, that are looked at together


def neighbours(positions: np.ndarray, points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (n, count) [m] from positions (n, 3) to the nearest of points (m, 3), nearest first, and their indices.

    A point that is farther from the middle of a run of positions than `count` others, by more than twice the run's reach, is none
    of any position's nearest; neither is a run of points that lies as far off as a whole.
    """
    distances, indices = np.empty((len(positions), count)), np.empty((len(positions), count), dtype=int)
    middles, reaches = _balls(points)
    sizes = np.minimum(RUN, len(points) - RUN * np.arange(len(middles)))
    for start in range(0, len(positions), RUN):
        rows = slice(start, start + RUN)
        (middle,), (reach,) = _balls(positions[rows])
        between = np.linalg.norm(middles - middle, axis=1)
        farthest = (between + reaches)[sizes >= count].min(initial=np.inf)
        near = between - reaches <= farthest + 2 * reach
        kept = np.flatnonzero(np.repeat(near, sizes))
        far = np.linalg.norm(points[kept] - middle, axis=1)
        kept = kept[far <= np.partition(far, count - 1)[count - 1] + 2 * reach]
        squares = sum((positions[rows, k, None] - points[kept, k]) ** 2 for k in range(3))
        chosen = np.argpartition(squares, count - 1, axis=1)[:, :count]
        chosen = np.take_along_axis(chosen, np.argsort(np.take_along_axis(squares, chosen, axis=1), axis=1), axis=1)
        distances[rows], indices[rows] = np.sqrt(np.take_along_axis(squares, chosen, axis=1)), kept[chosen]
    return distances, indices


def _balls(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (k, 3) and radii (k,) of balls that hold the runs of points (m, 3), a little large for rounding."""
    starts = np.arange(0, len(points), RUN)
    sizes = np.diff(np.append(starts, len(points)))
    middles = np.add.reduceat(points, starts, axis=0) / sizes[:, None]
    apart = np.linalg.norm(points - np.repeat(middles, sizes, axis=0), axis=1)
    return middles, np.maximum.reduceat(apart, starts) + 1e-12 * (1 + np.abs(middles).max(axis=1))

"""The nearest points of a path known by a dense row of its points: every local minimum of the row that could be it, polished."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

NEIGHBOURS = 16  # of the row's points that are looked at: the minima that could be the nearest point are among them
STEPS = 40  # of Newton, or halving where it leaves the bracket
CONVERGED = 1e-14  # of the parameter, relative


def nearest(
    positions: np.ndarray, parameters: np.ndarray, points: np.ndarray, jets: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parameters (n,) of the points nearest to positions (n, 3), and their distances (n,) [m].

    Two neighbours in the row are much nearer to each other than the path bends, so the path's distance to a position has one
    minimum between them at most.  Not finite where the position is not.

    Args:
        positions: (n, 3) [m], world.
        parameters: (m,), increasing.
        points: (m, 3) [m], of the path at these parameters.
        jets: Function of parameters (k,) to point and two derivatives (k, 3, 3) there.
    """
    from scipy.spatial import cKDTree

    found, least = np.full(len(positions), np.nan), np.full(len(positions), np.nan)
    finite = np.flatnonzero(np.isfinite(positions).all(axis=1))
    if not finite.size:
        return found, least
    asked, last = positions[finite], len(points) - 1
    distances, nodes = cKDTree(points).query(asked, k=min(NEIGHBOURS, len(points)))
    before, after = np.maximum(nodes - 1, 0), np.minimum(nodes + 1, last)
    beside = np.minimum(
        np.linalg.norm(points[before] - asked[:, None], axis=2), np.linalg.norm(points[after] - asked[:, None], axis=2)
    )
    minima = distances <= beside
    minima[:, 0] = True
    rows, columns = np.nonzero(minima)
    chosen = nodes[rows, columns]
    feet = polished(
        asked[rows],
        parameters[chosen],
        parameters[np.maximum(chosen - 1, 0)],
        parameters[np.minimum(chosen + 1, last)],
        jets,
    )
    lengths = np.linalg.norm(jets(feet)[:, 0] - asked[rows], axis=1)
    is_worse = ~(lengths <= distances[rows, columns])
    lengths[is_worse], feet[is_worse] = distances[rows, columns][is_worse], parameters[chosen][is_worse]
    order = np.lexsort((lengths, rows))
    best = order[np.unique(rows[order], return_index=True)[1]]
    found[finite], least[finite] = feet[best], lengths[best]
    return found, least


def polished(
    positions: np.ndarray,
    parameters: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    jets: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Return where <position - point, tangent> = 0 between low and high (k,), from parameters (k,) on: Newton, kept inside."""
    parameters, low, high = parameters.copy(), low.copy(), high.copy()
    moving = np.arange(len(parameters))
    for _ in range(STEPS):
        point, tangent, second = np.moveaxis(jets(parameters[moving]), 1, 0)
        error = positions[moving] - point
        lead = np.sum(error * tangent, axis=1)
        slope = np.sum(tangent * tangent, axis=1) - np.sum(error * second, axis=1)
        low[moving] = np.where(lead > 0, parameters[moving], low[moving])
        high[moving] = np.where(lead > 0, high[moving], parameters[moving])
        with np.errstate(divide="ignore", invalid="ignore"):
            following = parameters[moving] + lead / slope
        inside = (slope > 0) & (following >= low[moving]) & (following <= high[moving])
        following = np.where(inside, following, (low[moving] + high[moving]) / 2)
        steps = np.abs(following - parameters[moving])
        parameters[moving] = following
        moving = moving[steps > CONVERGED * (1 + np.abs(following))]
        if not moving.size:
            break
    return parameters

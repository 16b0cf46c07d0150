"""The nearest points of a path known by a dense row of its points: every local minimum of the row that could be it, polished."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gammastar.path.neighbours import neighbours

NEIGHBOURS = 16  # of the row's points that are looked at: the minima that could be the nearest point are among them
STEPS = 40  # of Newton, or halving where it leaves the bracket
CONVERGED = 1e-14  # of the parameter, relative
SHORT = 1e-6  # of the bracket: after a Newton step this short, the next one would be of the order of its square


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
    found, least = np.full(len(positions), np.nan), np.full(len(positions), np.nan)
    finite = np.flatnonzero(np.isfinite(positions).all(axis=1))
    if not finite.size:
        return found, least
    asked, last = positions[finite], len(points) - 1
    distances, nodes = neighbours(asked, points, min(NEIGHBOURS, len(points)))
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    reach = np.maximum(np.append(gaps, 0), np.append(0, gaps))  # by which the path may come nearer beside each point
    rows, columns = np.nonzero(distances <= distances[:, :1] + reach[nodes])
    chosen, sampled = nodes[rows, columns], distances[rows, columns]
    before, after = np.maximum(chosen - 1, 0), np.minimum(chosen + 1, last)
    beside = np.minimum(*(np.linalg.norm(points[each] - asked[rows], axis=1) for each in (before, after)))
    minima = (sampled <= beside) | (columns == 0)
    rows, chosen, sampled, low, high = (
        each[minima] for each in (rows, chosen, sampled, parameters[before], parameters[after])
    )
    known = jets(parameters)[chosen]
    places = parameters[chosen] + _step(asked[rows], known)
    places += _step(asked[rows], _ahead(known, places - parameters[chosen]))
    places = np.where(np.isfinite(places), np.clip(places, low, high), parameters[chosen])
    feet, lengths = polished(asked[rows], places, low, high, jets)
    is_worse = ~(lengths <= sampled)
    lengths[is_worse], feet[is_worse] = sampled[is_worse], parameters[chosen][is_worse]
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
) -> tuple[np.ndarray, np.ndarray]:
    """Return where <position - point, tangent> = 0 between low and high (k,), and the distances (k,) [m] there.

    Newton steps from parameters (k,) on, kept inside.  The last one is not looked at again: it is so short that the jet before it
    tells the point after it.
    """
    parameters, low, high = parameters.copy(), low.copy(), high.copy()
    enough, distances = SHORT * (high - low), np.full(len(parameters), np.nan)
    moving = np.arange(len(parameters))
    for _ in range(STEPS):
        rows, asked = jets(parameters[moving]), positions[moving]
        lead = np.sum((asked - rows[:, 0]) * rows[:, 1], axis=1)
        low[moving] = np.where(lead > 0, parameters[moving], low[moving])
        high[moving] = np.where(lead > 0, high[moving], parameters[moving])
        following = parameters[moving] + _step(asked, rows)
        inside = (following >= low[moving]) & (following <= high[moving])
        following = np.where(inside, following, (low[moving] + high[moving]) / 2)
        steps = following - parameters[moving]
        parameters[moving] = following
        distances[moving] = np.linalg.norm(asked - _ahead(rows, steps)[:, 0], axis=1)
        done = inside & (np.abs(steps) <= enough[moving]) | (np.abs(steps) <= CONVERGED * (1 + np.abs(following)))
        moving = moving[~done]
        if not moving.size:
            break
    return parameters, distances


def _step(positions: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the Newton step (k,) of <position - point, tangent> = 0 from jets (k, 3, 3); NaN towards a farthest point."""
    point, tangent, second = np.moveaxis(rows, 1, 0)
    error = positions - point
    slope = np.sum(tangent * tangent, axis=1) - np.sum(error * second, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(slope > 0, np.sum(error * tangent, axis=1) / slope, np.nan)


def _ahead(rows: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return what jets (k, 3, 3) tell of the jets a short step (k,) of the parameter ahead."""
    point, tangent, second = np.moveaxis(rows, 1, 0)
    steps = steps[:, None]
    return np.stack([point + tangent * steps + second * (steps**2 / 2), tangent + second * steps, second], axis=1)

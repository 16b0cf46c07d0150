"""The nearest point of a whole curve: cells of the parameter, split where it may be and given up where it cannot be.

A cell reaches no nearer than its samples, less half of its length.  So a search among millions of turns looks closely at
the few that are near, and its answer does not depend on how finely the whole was sampled.  What is taken from samples is
the length of a cell: a formula that rushes off and back between five of them is not seen.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gammastar.errors import PathError
from gammastar.path.nearest import polished

CELLS = 256  # that a stretch is cut into first
PIECES = 4  # that a cell is split into
SAMPLES = np.linspace(0, 1, 5)  # of each cell
FASTER = 1.5  # than at its samples a cell may be run through, at most
BEND = 0.2  # [rad] of a cell that is not split any further
MOST_CELLS = 200_000  # at a time
LEVELS = 60  # of splitting; then a cell is as narrow as rounding
CANDIDATES = 64  # cells whose nearest points are polished
DOUBLINGS = 24  # of the width of the search on an open curve

Jets = Callable[[np.ndarray], np.ndarray]


def nearest_of_all(
    name: str, jets: Jets, position: np.ndarray, domain: tuple[float, float], is_closed: bool
) -> tuple[float, float]:
    """Return the parameter of the point nearest to a position (3,) [m], and its distance [m].

    On an open curve the stretch searched is doubled until its inner half holds the best point and the last doubling has
    brought nothing nearer; a curve that comes back from farther off than that is not followed.

    Args:
        name: For messages.
        jets: Function of parameters (n,) to point and two derivatives (n, 3, 3).
        position: (3,) [m], world.
        domain: (2,) of the parameter; one period of a closed curve.
        is_closed: Whether the domain is all there is.

    Raises:
        PathError: More places are equally near than can be looked at, or there is no finite point.
    """
    low, high = domain
    best = _searched(name, jets, position, [domain], (np.nan, np.inf))
    for _ in range(0 if is_closed else DOUBLINGS):
        half, before = (high - low) / 2, best[1]
        best = _searched(name, jets, position, [(low - half, low), (high, high + half)], best)
        low, high = low - half, high + half
        if low + half <= best[0] <= high - half and not best[1] < before:
            break
    if not np.isfinite(best[1]):
        raise PathError(f"{name} must have a point nearest to the start (got no finite point); check its numbers")
    return best


def _searched(
    name: str, jets: Jets, position: np.ndarray, stretches: list[tuple[float, float]], best: tuple[float, float]
) -> tuple[float, float]:
    """Return parameter and distance of the nearest point on stretches of the curve, or the best known one if it is nearer."""
    edges = [np.linspace(low, high, CELLS + 1) for low, high in stretches]
    low, high = (np.concatenate([each[part] for each in edges]) for part in (slice(None, -1), slice(1, None)))
    nearest, found = best[1], []
    for _ in range(LEVELS):
        if not low.size:
            break
        distance, reach, bend = _measured(jets, position, low, high)
        nearest = min(nearest, float(distance.min()))
        is_near = distance - reach <= nearest
        is_done = is_near & (bend <= BEND)
        found.append(np.column_stack([low, high, distance, reach])[is_done])
        is_split = is_near & ~is_done & (low < (low + high) / 2) & ((low + high) / 2 < high)
        if is_split.sum() * PIECES > MOST_CELLS:
            raise PathError(
                f"the nearest point of {name} to {position.round(6).tolist()} must be searched among fewer than {MOST_CELLS} "
                "places equally near (got more); start nearer to the path, or give it a domain that holds the start"
            )
        cuts = np.linspace(low[is_split], high[is_split], PIECES + 1)
        low, high = cuts[:-1].ravel(), cuts[1:].ravel()
    cells = np.concatenate(found) if found else np.empty((0, 4))
    cells = cells[cells[:, 2] - cells[:, 3] <= nearest]
    low, high, _, _ = cells[np.argsort(cells[:, 2], kind="stable")[:CANDIDATES]].T
    if not low.size:
        return best
    places, distances = polished(np.tile(position, (len(low), 1)), (low + high) / 2, low, high, jets)
    distances = np.where(np.isnan(distances), np.inf, distances)
    first = int(np.argmin(distances))
    return (float(places[first]), float(distances[first])) if distances[first] < best[1] else best


def _measured(jets: Jets, position: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return for cells (k,): the least distance of their samples, how much nearer they may come, and how much they turn.

    Samples without a finite jet count as infinitely far; a cell of such samples only is never near.
    """
    places = low[:, None] + (high - low)[:, None] * SAMPLES
    rows = jets(places.ravel())
    rows[~np.isfinite(rows).all(axis=(1, 2))] = np.nan
    point, first, second = np.moveaxis(rows.reshape(*places.shape, 3, 3), 2, 0)
    with np.errstate(all="ignore"):
        distance = np.linalg.norm(point - position, axis=2)
        speed, rate = np.linalg.norm(first, axis=2), np.linalg.norm(second, axis=2)
        distance = np.where(np.isnan(distance), np.inf, distance)
        fastest, bend = np.fmax.reduce(speed, axis=1), np.fmax.reduce(rate / speed, axis=1) * (high - low)
    reach = FASTER * fastest * (high - low) / (2 * (len(SAMPLES) - 1))
    return (
        distance.min(axis=1),
        np.nan_to_num(reach, nan=0.0, posinf=np.inf),
        np.nan_to_num(bend, nan=0.0, posinf=np.inf),
    )

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

BLOCK = 128  # positions that are searched together

Jets = Callable[[np.ndarray], np.ndarray]


def nearest_of_all(
    name: str, jets: Jets, positions: np.ndarray, domain: tuple[float, float], is_closed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parameters (n,) of the points nearest to positions (n, 3) [m], and their distances (n,) [m].

    On an open curve the stretch searched is doubled until its inner half holds the best point and the last doubling has
    brought nothing nearer; a curve that comes back from farther off than that is not followed.  What is found for a position does not
    depend on the others.

    Args:
        name: For messages.
        jets: Function of parameters (n,) to point and two derivatives (n, 3, 3).
        positions: (n, 3) [m], world.
        domain: (2,) of the parameter; one period of a closed curve.
        is_closed: Whether the domain is all there is.

    Raises:
        PathError: More places are equally near than can be looked at, or there is no finite point.
    """
    parameters, distances = np.full(len(positions), np.nan), np.full(len(positions), np.inf)
    for begin in range(0, len(positions), BLOCK):
        block = np.arange(begin, min(begin + BLOCK, len(positions)))
        found = _nearest_of_block(name, jets, positions[block], domain, is_closed)
        parameters[block], distances[block] = found
    return parameters, distances


def _nearest_of_block(
    name: str, jets: Jets, positions: np.ndarray, domain: tuple[float, float], is_closed: bool
) -> tuple[np.ndarray, np.ndarray]:
    low, high = domain
    nothing = np.full(len(positions), np.nan), np.full(len(positions), np.inf)
    parameters, distances = _searched(name, jets, positions, [domain], nothing)
    open_ones = np.arange(0 if is_closed else len(positions))
    for _ in range(DOUBLINGS):
        if not open_ones.size:
            break
        half, before = (high - low) / 2, distances[open_ones]
        known = parameters[open_ones], before
        found = _searched(name, jets, positions[open_ones], [(low - half, low), (high, high + half)], known)
        parameters[open_ones], distances[open_ones] = found
        inside = (low <= found[0]) & (found[0] <= high)
        low, high = low - half, high + half
        open_ones = open_ones[~(inside & ~(found[1] < before))]
    if not np.all(np.isfinite(distances)):
        raise PathError(f"{name} must have a point nearest to the start (got no finite point); check its numbers")
    return parameters, distances


def _searched(
    name: str,
    jets: Jets,
    positions: np.ndarray,
    stretches: list[tuple[float, float]],
    best: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Return parameters and distances (n,) of the nearest points on stretches of the curve, or the best known ones if they are nearer."""
    edges = [np.linspace(low, high, CELLS + 1) for low, high in stretches]
    low, high = (np.concatenate([each[part] for each in edges]) for part in (slice(None, -1), slice(1, None)))
    owners = np.repeat(np.arange(len(positions)), len(low))
    low, high, nearest, found = np.tile(low, len(positions)), np.tile(high, len(positions)), best[1].copy(), []
    for level in range(LEVELS):
        if not low.size:
            break
        distance, reach, bend, holds = _measured(
            jets, positions[owners], low, high, len(positions) if level == 0 else 1
        )
        np.minimum.at(nearest, owners, distance)
        is_near = distance - reach <= nearest[owners]
        is_done = is_near & (bend <= BEND)
        found.append(np.column_stack([owners, low, high, distance, reach, holds])[is_done])
        is_split = is_near & ~is_done & (low < (low + high) / 2) & ((low + high) / 2 < high)
        counts = np.bincount(owners[is_split], minlength=len(positions)) * PIECES
        if counts.max() > MOST_CELLS:
            raise PathError(
                f"the nearest point of {name} to {positions[counts.argmax()].round(6).tolist()} must be searched among fewer than "
                f"{MOST_CELLS} places equally near (got more); start nearer to the path, or give it a domain that holds the start"
            )
        cuts = np.linspace(low[is_split], high[is_split], PIECES + 1)
        low, high, owners = cuts[:-1].ravel(), cuts[1:].ravel(), np.tile(owners[is_split], PIECES)
    cells = np.concatenate(found) if found else np.empty((0, 6))
    cells = cells[cells[:, 3] - cells[:, 4] <= nearest[cells[:, 0].astype(int)]]
    # Of two cells that share the nearest sample, the one that holds comes first.
    cells = cells[np.lexsort((-cells[:, 5], cells[:, 3], cells[:, 0]))]
    owners = cells[:, 0].astype(int)
    ranks = np.arange(len(owners)) - np.searchsorted(owners, owners)
    chosen = (ranks < CANDIDATES) & ((cells[:, 5] > 0) | (ranks == 0))
    owners, (_, low, high, _, _, _) = owners[chosen], cells[chosen].T
    parameters, distances = best[0].copy(), best[1].copy()
    if not low.size:
        return parameters, distances
    places, lengths = polished(positions[owners], (low + high) / 2, low, high, jets)
    order = np.lexsort((np.where(np.isnan(lengths), np.inf, lengths), owners))
    winners, first = np.unique(owners[order], return_index=True)
    places, lengths = places[order][first], lengths[order][first]
    better = lengths < distances[winners]
    parameters[winners[better]], distances[winners[better]] = places[better], lengths[better]
    return parameters, distances


def _measured(
    jets: Jets, positions: np.ndarray, low: np.ndarray, high: np.ndarray, copies: int
) -> tuple[np.ndarray, ...]:
    """Return for cells (k,): the least distance of their samples, how much nearer they may come, how much they turn, and a truth.

    It tells whether the distance falls at their begin and grows at their end, as it does about a nearest point inside.
    Samples without a finite jet count as infinitely far; a cell of such samples only is never near.  Cells that come again in so many
    `copies` for as many positions are sampled once.
    """
    own = len(low) // copies
    places = low[:own, None] + (high - low)[:own, None] * SAMPLES
    places[:, -1] = high[:own]
    rows = jets(places.ravel())
    rows[~np.isfinite(rows).all(axis=(1, 2))] = np.nan
    point, first, second = np.moveaxis(rows.reshape(*places.shape, 3, 3), 2, 0)
    width = (high - low)[:own]
    with np.errstate(all="ignore"):
        offset = point - positions.reshape(copies, own, 1, 3)
        distance = np.sqrt(np.sum(offset * offset, axis=3))
        speed, rate = np.linalg.norm(first, axis=2), np.linalg.norm(second, axis=2)
        distance = np.where(np.isnan(distance), np.inf, distance)
        slopes = np.sum(offset[:, :, [0, -1]] * first[:, [0, -1]], axis=3)
        holds = ~((slopes[:, :, 0] > 0) | (slopes[:, :, 1] < 0))
        fastest, bend = np.fmax.reduce(speed, axis=1), np.fmax.reduce(rate / speed, axis=1) * width
    reach = FASTER * fastest * width / (2 * (len(SAMPLES) - 1))
    reach, bend = np.nan_to_num(reach, nan=0.0, posinf=np.inf), np.nan_to_num(bend, nan=0.0, posinf=np.inf)
    return distance.min(axis=2).ravel(), np.tile(reach, copies), np.tile(bend, copies), holds.ravel()

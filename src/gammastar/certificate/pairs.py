"""Which pairs of places on a curve to look at: those where a chord may be perpendicular to the curve at both ends.

On a grid of pairs both conditions <sigma(s) - sigma(t), sigma'> = 0, at s and at t, change sign inside the cells that
hold such a pair.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gammastar.path.sampling import Samples

CELLS = 1500  # cells along the length of the curve, more where it turns
TURN = 0.15  # [rad] largest turn of the tangent over a cell
BLOCK = 256  # rows of the grid of pairs that are computed at a time
SLACK = 1.1  # length of a cell over its chord, at most
MOST_PAIRS = 200_000  # that are looked at together: a long path has hundreds of millions


def cells(samples: Samples, most: int | None = None) -> np.ndarray:
    """Return the samples (m,) that bound cells of about equal length, shorter where the curve turns, `most` at most."""
    tangents = samples.jets[:, 1] / samples.speeds[:, None]
    turns = np.linalg.norm(np.diff(tangents, axis=0), axis=1)
    cost = np.diff(samples.arc_lengths) / samples.length * CELLS + turns / TURN
    total = np.concatenate([[0.0], np.cumsum(cost)])
    marks = np.linspace(0, total[-1], min(int(total[-1]) + 2, most or len(total)))
    nodes = np.unique(np.searchsorted(total, marks, side="left").clip(0, len(total) - 1))
    return nodes[:-1] if samples.closed else nodes


def critical_cells(samples: Samples, nodes: np.ndarray) -> Iterator[np.ndarray]:
    """Yield blocks of pairs of samples (k, 2), corners of the cells where both perpendicularity conditions change sign."""
    points, tangents = samples.jets[nodes, 0], samples.jets[nodes, 1]
    points = points - points.mean(axis=0)
    own, count = np.sum(points * tangents, axis=1), len(nodes)
    ahead = np.empty((count, count), dtype=bool)  # <sigma_i - sigma_j, tangent_i> > 0
    for start in range(0, count, BLOCK):
        rows = slice(start, start + BLOCK)
        products = (tangents[rows, k, None] * points[:, k] for k in range(3))  # three columns are too few for threads
        ahead[rows] = own[rows, None] > sum(products)
    if samples.closed:
        ahead = np.pad(ahead, ((0, 1), (0, 1)), mode="wrap")
    mixed = _changes(ahead)
    rows_, columns = np.nonzero(mixed & mixed.T)
    around = (columns - rows_) if not samples.closed else np.minimum(columns - rows_, count - (columns - rows_))
    kept = (columns > rows_) & (around > 1)
    pairs = np.column_stack([rows_[kept], columns[kept]])
    for start in range(0, len(pairs), MOST_PAIRS):
        yield nodes[pairs[start : start + MOST_PAIRS]]


def near_critical_cells(samples: Samples, nodes: np.ndarray, within: float) -> Iterator[np.ndarray]:
    """Yield pairs as `critical_cells` does, but only of cells near enough for a distance `within` [m]."""
    ring = np.append(nodes, nodes[0]) if samples.closed else nodes
    points, tangents = samples.jets[ring, 0], samples.jets[ring, 1]
    count = len(ring) - 1
    for pairs in near_pairs(points, within):
        apart = np.abs(pairs[:, 1] - pairs[:, 0])
        pairs = pairs[(np.minimum(apart, count - apart) if samples.closed else apart) > 1]
        ahead = np.empty((2, 4, len(pairs)), dtype=bool)
        for k, corner in enumerate([(0, 0), (0, 1), (1, 0), (1, 1)]):
            first, second = (pairs + corner).T
            chord = points[first] - points[second]
            ahead[0, k] = np.sum(chord * tangents[first], axis=1) > 0
            ahead[1, k] = np.sum(chord * tangents[second], axis=1) > 0
        mixed = (ahead.any(axis=1) & ~ahead.all(axis=1)).all(axis=0)
        yield np.sort(ring[pairs[mixed]], axis=1)


def near_pairs(points: np.ndarray, within: float) -> Iterator[np.ndarray]:
    """Yield blocks (k, 2) of pairs of cells that may come nearer than `within` [m], `MOST_PAIRS` at most in each.

    A cell reaches from one of the points (n, 3) to the next.  Every pair is found from its longer cell, so that one long cell does not
    make all cells look near.
    """
    from scipy.spatial import cKDTree

    middles, lengths = (points[1:] + points[:-1]) / 2, SLACK * np.linalg.norm(np.diff(points, axis=0), axis=1)
    order = np.argsort(lengths, kind="stable")
    middles, lengths = middles[order], lengths[order]
    tree = cKDTree(middles)
    ends = np.cumsum(tree.query_ball_point(middles, within + lengths, return_length=True))
    start = 0
    while start < len(ends):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + MOST_PAIRS, side="right")), start + 1)
        found = tree.query_ball_point(middles[start:stop], (within + lengths)[start:stop])
        longer = np.repeat(np.arange(start, stop), np.diff(ends[start:stop], prepend=before))
        shorter = np.concatenate(found).astype(int)
        longer, shorter = longer[shorter < longer], shorter[shorter < longer]
        apart = np.linalg.norm(middles[longer] - middles[shorter], axis=1)
        near = apart <= within + (lengths[longer] + lengths[shorter]) / 2
        yield order[np.column_stack([longer, shorter])[near]]
        start = stop


def _changes(positive: np.ndarray) -> np.ndarray:
    """Return which cells of a grid of signs have both signs at their corners."""
    corners = positive[:-1, :-1], positive[1:, :-1], positive[:-1, 1:], positive[1:, 1:]
    some = corners[0] | corners[1] | corners[2] | corners[3]
    every = corners[0] & corners[1] & corners[2] & corners[3]
    return np.asarray(some & ~every)


def end_pairs(samples: Samples, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs (k, 2) of an end of an open curve with the samples nearest to it, and which of the two may move.

    Only pairs whose distance grows when the end is left count; the pair of the two ends needs that at both.
    """
    points, tangents = samples.jets[nodes, 0], samples.jets[nodes, 1]
    pairs, free = [], []
    last = len(nodes) - 1
    for end, inward in ((0, 1.0), (last, -1.0)):
        chords = points[end] - points
        leaving = inward * chords @ tangents[end] >= 0
        approaching = np.sum(chords * tangents, axis=1) > 0
        for k in np.flatnonzero(approaching[:-1] & ~approaching[1:] & leaving[1:]):
            if abs(k - end) > 1:
                pairs.append([nodes[end], nodes[k]])
                free.append([False, True])
    chord = points[0] - points[last]
    if chord @ tangents[0] >= 0 and chord @ tangents[last] >= 0:
        pairs.append([nodes[0], nodes[last]])
        free.append([False, False])
    return np.array(pairs, dtype=int).reshape(-1, 2), np.array(free, dtype=bool).reshape(-1, 2)

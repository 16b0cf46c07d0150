"""How close a curve comes to itself: all pairs of places whose chord is perpendicular to the curve at both ends.

Newton steps on the two parameters refine candidates found on a grid.  Between the ends of such a chord the curve turns
by pi at least, because together with the chord it is closed and turns by 2 pi (Fenchel); this keeps neighbours out,
however sharp the bend between them.

The radius of the largest tube that does not meet itself is the smaller of the least radius of curvature and half of
the least such distance.
Source: Litherland, Simon, Durumeric, Rawdon, Thickness of knots, Topology Appl. 91 (1999).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gammastar.certificate.pairs import CELLS, cells, critical_cells, end_pairs, near_critical_cells
from gammastar.path.sampling import Samples

MOST_CELLS = 3000  # of the search among all pairs; beyond, only pairs that narrow the tube are searched with all cells
CANDIDATES = 64  # pairs that Newton steps refine in one round
ROUNDS = 8  # of candidates, at most; they end when no better distance is in sight
LONG = 3.0  # cells: a pair whose first step is longer has its sign changes from somewhere else, and comes last
STEPS = 30  # of Newton; where the curve touches itself they converge linearly, the error shrinks to 2/3 each
SINGULAR = 1e-9  # relative eigenvalue below which a direction of the Newton matrix is a valley and left alone
PERPENDICULAR = 1e-5  # cosine of chord and tangent that counts as zero
ALMOST_PERPENDICULAR = 1e-3  # the same for a contact, where Newton steps may still be on their way
CONTACT = 1e-7  # of the length: a distance below it counts as zero
ROUNDING = 1e-12  # of the length: a chord this short has no direction
LEAST_TURN = np.pi - 1e-6  # [rad] of the curve between the two places, but for rounding
PARALLEL = 1e-3  # sine of the angle between two tangents that counts as zero
TIE = 1e-9  # relative: pairs whose distances differ less are equally close, and the earlier counts
DECIMALS = 9  # of a promised distance relative to the length
OVERLAP = 8  # places of parallel contact, apart from each other, that make a stretch


@dataclass(frozen=True)
class Approach:
    """The closest two parts of a curve that are not neighbours along it."""

    distance: float  # [m]
    first: float  # parameter
    second: float  # parameter
    kind: str  # 'apart', 'crosses itself', 'touches itself', 'runs over itself' or 'meets itself at its ends'

    @property
    def contact(self) -> bool:
        """Return whether the distance counts as zero."""
        return self.kind != "apart"


def closest_approach(samples: Samples, most_curvature: float) -> Approach | None:
    """Return the closest approach, or None when no chord is perpendicular at both ends, as on a line or a wide helix.

    Ends of an open curve count: there a chord needs to be perpendicular at the other end only.  An approach that narrows
    the tube, shorter than two least radii of curvature, is what the search is made for; of longer ones on a very sharp
    curve it may find the second.

    Args:
        samples: Of a regular curve without corners.
        most_curvature: Largest curvature [1/m].
    """
    wanted = cells(samples)
    nodes = wanted if len(wanted) <= MOST_CELLS else cells(samples, MOST_CELLS)
    found = _closest(samples, nodes, critical_cells(samples, nodes))
    if len(nodes) < len(wanted):
        within = 2 / most_curvature if found is None else min(found.distance, 2 / most_curvature)
        finer = _closest(samples, wanted, near_critical_cells(samples, wanted, within))
        found = min(filter(None, (finer, found)), key=lambda each: each.distance, default=None)
    return found


def _closest(samples: Samples, nodes: np.ndarray, blocks: Iterable[np.ndarray]) -> Approach | None:
    """Return the closest approach that Newton steps reach from blocks of pairs of samples (k, 2), or None."""
    chosen = _ranked(samples, nodes, blocks)
    found = _Pairs(np.empty((0, 2)), np.empty(0), np.empty(0), np.empty(0, dtype=bool), np.empty((0, 2), dtype=bool))
    for start in range(0, len(chosen.pairs), CANDIDATES):
        if len(found.distances) and found.distances.min() <= chosen.promise[start]:
            break
        rows = slice(start, start + CANDIDATES)
        refined = _refined(samples, chosen.pairs[rows], chosen.free[rows], _reach(samples, nodes))
        found = _Pairs(*(np.concatenate(both) for both in zip(found, refined, strict=True)))
    return _approach(samples, found) if len(found.distances) else None


class _Pairs(NamedTuple):
    """Pairs of places whose chord is perpendicular to the curve at both ends, or that coincide."""

    parameters: np.ndarray  # (k, 2)
    distances: np.ndarray  # (k,) [m]
    sines: np.ndarray  # (k,) of the angle between the tangents
    contact: np.ndarray  # (k,) whether the distance counts as zero
    free: np.ndarray  # (k, 2) false for an end of an open curve


def _approach(samples: Samples, found: _Pairs) -> Approach:
    """Return the closest of some pairs, and what kind of contact it is if it is one."""
    distances, firsts = found.distances, found.parameters.min(axis=1)
    nearly = np.flatnonzero(distances <= distances.min() * (1 + TIE) + TIE * CONTACT * samples.length)
    best, kind = int(nearly[np.argmin(firsts[nearly])]), "apart"
    if found.contact[best]:
        kind = "touches itself" if found.sines[best] < PARALLEL else "crosses itself"
        if not found.free[best].any():
            kind = "meets itself at its ends"
        parallel = np.flatnonzero(found.contact & (found.sines < PARALLEL))
        if len(np.unique(np.rint(firsts[parallel] / samples.span * CELLS))) >= OVERLAP:
            kind, best = "runs over itself", int(parallel[np.argmin(firsts[parallel])])
    first, second = sorted(found.parameters[best].tolist())
    return Approach(float(distances[best]), first, second, kind)


class _Candidates(NamedTuple):
    """Pairs of samples from which Newton steps may start, the most promising first."""

    pairs: np.ndarray  # (k, 2)
    free: np.ndarray  # (k, 2) false for an end of an open curve
    promise: np.ndarray  # (k,) [m] distance after one Newton step
    long: np.ndarray  # (k,) whether that step leaves the cells by far


def _ranked(samples: Samples, nodes: np.ndarray, blocks: Iterable[np.ndarray]) -> _Candidates:
    """Return the candidates that are tried, in that order; of what a block holds, only these are kept."""
    best = _judged(samples, nodes, np.empty((0, 2), dtype=int), np.empty((0, 2), dtype=bool))
    inner = ((pairs, np.ones(pairs.shape, dtype=bool)) for pairs in blocks)
    for pairs, free in itertools.chain(inner, [] if samples.closed else [end_pairs(samples, nodes)]):
        judged = _judged(samples, nodes, pairs, free)
        best = _Candidates(*(np.concatenate(both) for both in zip(best, judged, strict=True)))
        order = np.lexsort([np.round(best.promise / samples.length, DECIMALS), best.long])[: ROUNDS * CANDIDATES]
        best = _Candidates(*(column[order] for column in best))
    return best


def _judged(samples: Samples, nodes: np.ndarray, pairs: np.ndarray, free: np.ndarray) -> _Candidates:
    """Return pairs with the distance that one Newton step promises."""
    jets = samples.jets[:, :3][pairs]
    steps = newton_step(jets, free, np.inf)
    ends = samples.arc_lengths[np.append(nodes, len(samples.parameters) - 1)]
    cell = np.maximum(np.diff(ends), samples.length / 2 / len(nodes))[np.searchsorted(nodes, pairs)]
    long = (np.abs(steps) * samples.speeds[pairs] > LONG * cell).any(axis=1)
    steps *= np.minimum(1, _reach(samples, nodes) / np.maximum(np.abs(steps) * samples.speeds[pairs], 1e-300))
    moved = jets[:, :, 0] + jets[:, :, 1] * steps[..., None] + jets[:, :, 2] * steps[..., None] ** 2 / 2
    return _Candidates(pairs, free, np.linalg.norm(moved[:, 0] - moved[:, 1], axis=1), long)


def _reach(samples: Samples, nodes: np.ndarray) -> float:
    """Return the longest step of Newton [m]: two cells."""
    return float(2 * samples.length / len(nodes))


def _refined(samples: Samples, pairs: np.ndarray, free: np.ndarray, reach: float) -> _Pairs:
    """Return where Newton steps from pairs of samples (k, 2) arrive, without neighbours along the curve."""
    parameters = samples.parameters[pairs]
    for _ in range(STEPS):
        jets = samples.jets_at(parameters.ravel()).reshape(*parameters.shape, -1, 3)
        steps = newton_step(jets, free, reach)
        parameters = samples.inside(parameters + steps)
        if np.abs(steps).max() < 1e-14 * samples.span:
            break
    flat = samples.jets_at(parameters.ravel())
    turns = _turns(samples, parameters.ravel(), flat).reshape(parameters.shape)
    jets = flat.reshape(*parameters.shape, -1, 3)
    chord = jets[:, 0, 0] - jets[:, 1, 0]
    distances = np.linalg.norm(chord, axis=1)
    tangents = jets[:, :, 1] / np.linalg.norm(jets[:, :, 1], axis=2, keepdims=True)
    slant = np.where(free, np.abs(np.sum(chord[:, None] * tangents, axis=2)), 0.0).max(axis=1)
    sines = np.linalg.norm(np.cross(tangents[:, 0], tangents[:, 1]), axis=1)
    contact = (distances <= CONTACT * samples.length) & (
        (slant <= ALMOST_PERPENDICULAR * distances) | (distances <= ROUNDING * samples.length)
    )
    between = np.abs(turns[:, 1] - turns[:, 0])
    between = np.minimum(between, _turns(samples)[-1] - between) if samples.closed else between
    arrived = ((slant <= PERPENDICULAR * distances) | contact) & (between >= LEAST_TURN)
    return _Pairs(parameters[arrived], distances[arrived], sines[arrived], contact[arrived], free[arrived])


def _turns(samples: Samples, parameters: np.ndarray | None = None, jets: np.ndarray | None = None) -> np.ndarray:
    """Return by how much [rad] the tangent has turned since the start, at parameters with their jets or at the samples."""
    tangents = samples.jets[:, 1] / samples.speeds[:, None]
    turned = np.concatenate([[0.0], np.cumsum(_angles(tangents[:-1], tangents[1:]))])
    if parameters is None or jets is None:
        return turned
    before = samples.before(parameters)
    return np.asarray(
        turned[before] + _angles(tangents[before], jets[:, 1] / np.linalg.norm(jets[:, 1], axis=1)[:, None])
    )


def _angles(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the angles (n,) between unit vectors (n, 3), exact for small ones."""
    return np.asarray(2 * np.arcsin(np.minimum(np.linalg.norm(first - second, axis=1) / 2, 1.0)))


def newton_step(jets: np.ndarray, free: np.ndarray, reach: float) -> np.ndarray:
    """Return the steps (k, 2) in the two parameters towards <chord, tangent> = 0 at both ends, at most `reach` [m] long.

    Written per metre of arc the matrix is symmetric with entries of order one:
    [[1 + <c, k1>, -<t1, t2>], [-<t1, t2>, 1 - <c, k2>]], c the chord, k the curvature vectors up to tangential parts.
    """
    chord = jets[:, 0, 0] - jets[:, 1, 0]
    speeds = np.linalg.norm(jets[:, :, 1], axis=2)
    tangents = jets[:, :, 1] / speeds[..., None]
    bends = jets[:, :, 2] / speeds[..., None] ** 2
    bends = bends - tangents * np.sum(bends * tangents, axis=2, keepdims=True)
    signs = np.array([1.0, -1.0])
    gradient = np.where(free, signs * np.sum(chord[:, None] * tangents, axis=2), 0.0)
    matrix = np.empty((len(jets), 2, 2))
    matrix[:, [0, 1], [0, 1]] = np.where(free, 1 + signs * np.sum(chord[:, None] * bends, axis=2), 1.0)
    across = np.where(free.all(axis=1), -np.sum(tangents[:, 0] * tangents[:, 1], axis=1), 0.0)
    matrix[:, 0, 1] = matrix[:, 1, 0] = across
    values, vectors = np.linalg.eigh(matrix)
    usable = np.abs(values) > SINGULAR * np.abs(values).max(axis=1, keepdims=True)
    parts = np.einsum("kij,ki->kj", vectors, gradient) * np.where(usable, 1 / np.where(usable, values, 1.0), 0.0)
    steps = -np.einsum("kij,kj->ki", vectors, parts)
    longest = np.abs(steps).max(axis=1, keepdims=True)
    return np.asarray(steps * np.minimum(1.0, reach / np.maximum(longest, 1e-300)) / speeds)

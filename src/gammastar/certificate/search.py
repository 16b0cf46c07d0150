"""Extremes and roots along a path: found on the samples, then narrowed in batches until rounding stops them.

Every pass asks the path once for the jets of all searches together, because for an implicit path the call itself costs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from gammastar.path.sampling import Samples

PIECES = 16  # into which a pass cuts each bracket
PASSES = 9  # two pieces of 16 are kept: 8^9 = 1e8 in the place of an extreme, rounding in its value
ROOT_PASSES = 10  # one piece of 16 is kept: 1e12
TIE = 1e-13  # relative: what differs less is the same, and then the earlier place counts
DECIMALS = 11  # of samples relative to the largest: below is rounding, and a constant has its extreme at its start
CANDIDATES = 32  # local extremes that are narrowed, or one for so many samples: the best by a parabola through three
PER_CANDIDATE = 100

Quantity = Callable[[np.ndarray], np.ndarray]  # jets (n, 6, 3) -> (n,); not finite where it has no value


class Extreme(NamedTuple):
    """A largest or smallest value and where it is."""

    parameter: float
    value: float


class Search(NamedTuple):
    """What to look for, and between which parameters."""

    quantity: Quantity
    sign: int  # +1 for the largest value, -1 for the smallest
    brackets: np.ndarray  # (m, 3) parameters: before, at and after the best sample


def extremes(
    samples: Samples, quantities: Mapping[str, tuple[Quantity, int]], most: int | None = None
) -> dict[str, Extreme]:
    """Return the extreme of each quantity over the whole path; `sign` +1 asks for the largest, -1 for the smallest.

    At most so many local extremes are narrowed, or as many as `brackets` returns.
    """
    searches = [
        Search(quantity, sign, brackets(samples, quantity, sign)[:most]) for quantity, sign in quantities.values()
    ]
    best = {}
    for name, search, found in zip(quantities, searches, narrowed(samples, searches), strict=True):
        values = np.array([search.sign * each.value for each in found])
        close = np.flatnonzero(values >= values.max() - TIE * _size(values.max()))
        best[name] = min((found[k] for k in close), key=lambda each: each.parameter)
    return best


def narrowed(samples: Samples, searches: list[Search]) -> list[list[Extreme]]:
    """Return the extreme inside each bracket of each search; where rounding alone decides, the sample it started from."""
    regions = np.concatenate([search.brackets for search in searches])
    signs = np.repeat([search.sign for search in searches], [len(search.brackets) for search in searches])
    centres, rows = regions[:, 1], np.arange(len(regions))
    start = _evaluated(samples, searches, regions[:, 1:2])[:, 0]
    regions, places, best = regions[:, ::2], centres, start
    for _ in range(PASSES):
        grid = np.linspace(regions[:, 0], regions[:, 1], PIECES + 1, axis=1)
        values = _evaluated(samples, searches, grid)
        top = np.argmax(signs[:, None] * values, axis=1)
        regions = np.column_stack([grid[rows, np.maximum(top - 1, 0)], grid[rows, np.minimum(top + 1, PIECES)]])
        better = signs * values[rows, top] > signs * best
        places, best = np.where(better, grid[rows, top], places), np.where(better, values[rows, top], best)
    gained = signs * best > signs * start + TIE * _size(start)
    places, best = np.where(gained, places, centres), np.where(gained, best, start)
    found = [Extreme(float(place), float(value)) for place, value in zip(places, best, strict=True)]
    ends = np.cumsum([len(search.brackets) for search in searches]).tolist()
    return [found[start:end] for start, end in zip([0, *ends], ends, strict=False)]


def _evaluated(samples: Samples, searches: list[Search], grid: np.ndarray) -> np.ndarray:
    """Return the values (m, k) of each search's quantity at its rows of a grid of parameters (m, k)."""
    jets, values, start = samples.jets_at(grid.ravel()), [], 0
    for search in searches:
        end = start + len(search.brackets) * grid.shape[1]
        values.append(_numbers(search.quantity(jets[start:end]), search.sign))
        start = end
    return np.concatenate(values).reshape(grid.shape)


def negative_stretches(samples: Samples, quantity: Quantity) -> list[tuple[float, float]]:
    """Return the stretches of the parameter where a quantity is below zero, ends narrowed; seen at one sample at least.

    On a closed path a stretch across the seam is one, and its end lies beyond the period; the whole path is the whole
    domain.
    """
    below = quantity(samples.jets) < 0
    low, high = samples.low, samples.low + samples.span
    if below.all():
        return [(low, high)]
    changes = np.flatnonzero(below[1:] != below[:-1])
    regions = np.column_stack([samples.parameters[changes], samples.parameters[changes + 1]])
    roots = _roots(samples, quantity, regions, below[changes])
    ends = roots.tolist()
    if below[0]:
        ends.insert(0, low)
    if below[-1]:
        ends.append(high)
    stretches = list(zip(ends[::2], ends[1::2], strict=True))
    if samples.closed and len(stretches) > 1 and below[0] and below[-1]:
        stretches[-1] = (stretches[-1][0], high + stretches.pop(0)[1] - low)
    return stretches


def _roots(samples: Samples, quantity: Quantity, regions: np.ndarray, below: np.ndarray) -> np.ndarray:
    """Return a sign change (m,) inside each region (m, 2); `below` (m,) tells whether its left end is below zero."""
    if not len(regions):
        return np.empty(0)
    for _ in range(ROOT_PASSES):
        grid = np.linspace(regions[:, 0], regions[:, 1], PIECES + 1, axis=1)
        changed = (quantity(samples.jets_at(grid.ravel())).reshape(grid.shape) < 0) != below[:, None]
        changed[:, 0], changed[:, -1] = False, True
        first, rows = np.argmax(changed, axis=1), np.arange(len(grid))
        regions = np.column_stack([grid[rows, first - 1], grid[rows, first]])
    return np.asarray(regions.mean(axis=1))


def neighbourhood(samples: Samples, index: np.ndarray) -> np.ndarray:
    """Return the parameters (m, 3) before, at and after samples (m,).

    The seam of a closed path is a sample at both ends of the domain, and each has one neighbour.
    """
    last = len(samples.parameters) - 1
    return np.asarray(
        samples.parameters[np.column_stack([np.maximum(index - 1, 0), index, np.minimum(index + 1, last)])]
    )


def brackets(samples: Samples, quantity: Quantity, sign: int) -> np.ndarray:
    """Return brackets (m, 3) of the local extremes of a quantity that promise the most, those first, judged by its values at samples."""
    values = sign * _numbers(quantity(samples.jets), sign)
    size = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    if size > 0:
        values = np.round(values / size, DECIMALS)
    around = np.pad(values, 1, constant_values=-np.inf)
    before, after = around[:-2], around[2:]
    peaks = np.flatnonzero((values > before) & (values >= after))  # of equal neighbours the first
    if not peaks.size:
        peaks = np.array([int(np.argmax(values))])
    with np.errstate(invalid="ignore"):
        slope, bend = (after - before)[peaks] / 2, (2 * values - before - after)[peaks]
    usable = np.isfinite(bend) & (bend > 0)
    gain = np.where(usable, slope**2 / (2 * np.where(usable, bend, 1.0)), 0.0)
    promise = values[peaks] + np.where(np.isfinite(gain), gain, 0.0)
    chosen = peaks[np.argsort(-promise, kind="stable")[: max(CANDIDATES, len(values) // PER_CANDIDATE)]]
    return neighbourhood(samples, chosen)


def _numbers(values: np.ndarray, sign: int) -> np.ndarray:
    """Return values with NaN as the worst candidate for the extreme of this sign."""
    return np.where(np.isnan(values), -sign * np.inf, values)


def _size(values: np.ndarray) -> np.ndarray:
    """Return magnitudes, zero for an infinite value."""
    return np.where(np.isfinite(values), np.abs(values), 0.0)

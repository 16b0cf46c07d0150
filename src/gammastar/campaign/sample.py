"""What varies in each flight of a campaign: flight k depends on the seed and k alone, whoever flies it and however many there are."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping

import numpy as np

from gammastar import engine
from gammastar.errors import InputError
from gammastar.mission.choices import Grid
from gammastar.mission.distributions import Distribution

FIRST_CHANNEL = 2**20  # of the random numbers of a campaign, far above those of a flight

MOST_SOBOL = 2**30  # flights that points of low discrepancy are made for


def sampled(
    varied: Mapping[str, Distribution], flights: np.ndarray, seed: int, sampling: str = "random"
) -> dict[str, np.ndarray]:
    """Return the values of what varies, (n, ...) by quantity, in the flights of some numbers (n,).

    Of a list or a grid the values are places in it.

    Args:
        varied: Distribution of each quantity; their order counts.
        flights: Numbers of the flights, from zero.
        seed: Of the campaign.
        sampling: 'random', or 'sobol' for the points of low discrepancy of a scrambled Sobol sequence.
    """
    flights = np.asarray(flights, dtype=np.int64)
    sizes = {name: distribution.size for name, distribution in varied.items()}
    total = sum(sizes.values())
    uniforms = _sobol(total, flights, seed) if sampling == "sobol" else _random(total, flights, seed)
    values, first = dict[str, np.ndarray](), 0
    for name, distribution in varied.items():
        if isinstance(distribution, Grid):
            values[name] = (flights // _repeats(varied, name)) % len(distribution.choices)
        else:
            values[name] = distribution.values(uniforms[:, first : first + sizes[name]])
        first += sizes[name]
    return values


def combinations(varied: Mapping[str, Distribution]) -> int:
    """Return after how many flights the grids of a campaign have been gone through once."""
    return math.prod(len(each.choices) for each in varied.values() if isinstance(each, Grid))


def _repeats(varied: Mapping[str, Distribution], name: str) -> int:
    """Return for how many flights one value of a grid stays: until all later grids have been gone through."""
    names = list(varied)
    return combinations({later: varied[later] for later in names[names.index(name) + 1 :]})


def _random(count: int, flights: np.ndarray, seed: int) -> np.ndarray:
    """Return uniform numbers (n, count): those of a flight at its step zero, on channels that the flight itself does not use."""
    channels = range(FIRST_CHANNEL, FIRST_CHANNEL + (count + 1) // 2)
    return np.asarray(engine.uniforms(seed, flights, [0], channels)[:count, 0].T)


def _sobol(count: int, flights: np.ndarray, seed: int) -> np.ndarray:
    """Return the points (n, count) of a scrambled Sobol sequence with the flights' numbers, in the open unit cube."""
    if not count or not len(flights):
        return np.empty((len(flights), count))
    if flights.max() >= MOST_SOBOL:
        raise InputError(
            f"a Sobol sequence must have at most {MOST_SOBOL} flights (got {int(flights.max()) + 1}); use random sampling"
        )
    from scipy.stats import qmc

    sequence = qmc.Sobol(count, scramble=True, rng=np.random.default_rng(seed))
    low, high = int(flights.min()), int(flights.max())
    if low:
        sequence.fast_forward(low)
    with warnings.catch_warnings():  # about balance, which a part of a sequence does not have
        warnings.simplefilter("ignore", UserWarning)
        points = sequence.random(high - low + 1)[flights - low]
    return np.asarray(np.clip(points, 2.0**-53, 1 - 2.0**-53))

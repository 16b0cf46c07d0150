"""What a study answers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gammastar.campaign.rate import Rate


class About(NamedTuple):
    """What a mission says of itself."""

    title: str = ""
    frame: str = "ned"
    settled_within: float | None = None  # [m]


class Bin(NamedTuple):
    """Flights with a quantity from one number up to another, or at one value of it."""

    low: Any
    high: Any  # the same as low at one value
    rate: Rate
    settling: tuple[float, float] = (np.nan, np.nan)  # [s] median and 95 % quantile, of those that succeed


class Cause(NamedTuple):
    """What flights fail by."""

    status: str  # 'not settled' of a flight that flew to its end
    rate: Rate  # of it, among all flights
    first: int  # number of the first flight with it
    end: float  # [s] median of when they end
    words: str  # what the row of the first of them says; empty where it says nothing


class Map(NamedTuple):
    """Flights over two columns."""

    first: np.ndarray  # (m + 1,) edges of the first column
    second: np.ndarray  # (n + 1,) of the second one
    flights: np.ndarray  # (m, n)
    successes: np.ndarray  # (m, n)
    settling: np.ndarray  # (m, n) [s] median of those that succeed, NaN where none does

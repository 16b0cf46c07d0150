"""A share of successes, and between which bounds it is known."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri

CONFIDENCE = 0.95


class Rate(NamedTuple):
    """A share of successes, and the interval that holds the true one with the confidence of the study."""

    flights: int
    successes: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """Return successes over flights; NaN without flights."""
        return self.successes / self.flights if self.flights else float("nan")

    def values(self) -> dict[str, Any]:
        """Return its numbers by name."""
        return {
            "flights": self.flights,
            "successes": self.successes,
            "share": self.share,
            "interval": [self.low, self.high],
        }


def wilson(successes: int, flights: int, confidence: float = CONFIDENCE) -> Rate:
    """Return a rate with Wilson's score interval, which holds at shares of zero and one too.

    Source: E. B. Wilson, Probable inference, the law of succession, and statistical inference, JASA 22 (1927).
    """
    if flights == 0:
        return Rate(0, 0, 0.0, 1.0)
    z = float(ndtri((1 + confidence) / 2))
    share, square = successes / flights, z**2 / flights
    middle = (share + square / 2) / (1 + square)
    half = z / (1 + square) * np.sqrt(share * (1 - share) / flights + square / (4 * flights))
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == flights else middle + half
    return Rate(flights, successes, float(low), float(high))


def percent(share: float) -> str:
    """Return a share in percent with two decimals, or as many as it takes to tell some from none and most from all.

    >>> percent(1.0), percent(0.98416), percent(0.9999968), percent(float("nan"))
    ('100.00 %', '98.42 %', '99.9997 %', '-')
    """
    if np.isnan(share):
        return "-"
    digits = 2
    while 0 < share < 1 and round(100 * share, digits) in (0, 100) and digits < 12:
        digits += 1
    return f"{100 * share:.{digits}f} %"

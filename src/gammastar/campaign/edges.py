"""Round numbers that part what varies into bins."""

from __future__ import annotations

import itertools
import math

import numpy as np

STEPS = (1.0, 2.0, 2.5, 5.0)  # widths of bins, up to powers of ten
ANGLES = (1.0, 1.5, 2.0, 3.0, 4.5, 6.0, 9.0)  # of degrees
SLACK = 1e-9  # of a width, by which a number may lie beyond an end


def edges(low: float, high: float, most: int, angle: bool = False) -> np.ndarray:
    """Return the ends (n + 1,) of at most `most` bins of one round width that hold all numbers from low to high.

    Where not even two fit, one bin has no ends but low and high.

    >>> edges(0.9003, 1.0998, 10).tolist()[:3], edges(-179.2, 178.7, 10, angle=True).tolist()[:3]
    ([0.9, 0.92, 0.94], [-180.0, -135.0, -90.0])
    """
    if most < 2:
        return np.array([low, high])
    start = math.floor(math.log10((high - low) / most))
    for power, step in ((power, step) for power in itertools.count(start) for step in (ANGLES if angle else STEPS)):
        width = step * 10.0**power
        first, last = math.floor(low / width + SLACK), math.ceil(high / width - SLACK)
        if last - first <= most:
            scale = 10.0 ** (1 - power)  # whole numbers over a power of ten are the numbers that people write
            return np.arange(first, last + 1) * (10 * step) / scale
    raise AssertionError("widths grow without end")

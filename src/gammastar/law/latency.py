"""How many control intervals a latency takes: what a law looks ahead through, and a plant holds back."""

from __future__ import annotations

from typing import Any

import numpy as np

from gammastar.errors import InputError

MOST_PENDING = 100  # control intervals of latency; the law looks ahead through every one of them


def pending_intervals(latency: float, interval: float) -> int:
    """Return how many whole control intervals a latency [s] takes, rounded up.

    Raises:
        InputError: Too many of them.
    """
    if latency > MOST_PENDING * interval:
        raise InputError(
            f"latency must be at most {MOST_PENDING} control intervals (got {latency:g} s at {1 / interval:g} Hz); lower the control rate"
        )
    return int(whole_intervals(latency, interval))


def whole_intervals(latency: Any, interval: float) -> Any:
    """Return latencies [s], a number or (n,), in whole control intervals, rounded up."""
    return np.ceil(np.asarray(latency) / interval - 1e-6)

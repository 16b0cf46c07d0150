"""Stretches of a flight that deserve a column of their own: the approach, and life on the path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from gammastar.flight import FlightRecord

SHORTEST = 0.05  # of a flight; a shorter stretch gets no column
LARGEST = 1e150  # of what is drawn: its square is still finite
SMALLEST_SPAN = 0.05  # of the largest value in a panel: below it a constant would look like a storm


@dataclass(frozen=True)
class Window:
    """A stretch of time and the words above its column."""

    begin: float  # [s]
    end: float  # [s]
    name: str


def windows(record: FlightRecord) -> tuple[Window, ...]:
    """Return approach and path following, parted at the predicted settling time; one window when there is no such time."""
    begin, end, settled = float(record.time[0]), float(record.time[-1]), settling_time(record)
    short = SHORTEST * (end - begin)
    if settled is None or not begin + short < settled < end - short:
        return (Window(begin, end, ""),)
    kept = record.summary()["settled"]
    name = f"within {distance_text(record.settled_within)}" if kept else "not settled"
    return Window(begin, settled, "approach"), Window(settled, end, f"{name}, own scale")


def settling_time(record: FlightRecord) -> float | None:
    """Return the settling time [s] that the summary predicts, or None when the flight was too short or left no prediction."""
    predicted = record.summary()["settling_time_s"]["predicted"]
    return None if predicted is None else float(predicted)


def distance_text(distance: float) -> str:
    """Return a short length with the unit that suits it."""
    for unit, size in (("m", 1.0), ("mm", 1e-3)):
        if distance >= 0.999 * size:
            return f"{distance / size:.3g} {unit}"
    return f"{distance * 1e6:.3g} µm"


def drawable(values: np.ndarray | float) -> np.ndarray:
    """Return values cut to what matplotlib can multiply; NaN stays NaN."""
    return np.clip(values, -LARGEST, LARGEST)


def limits(values: np.ndarray) -> tuple[float, float]:
    """Return bounds for finite values with a margin of 5 %, never so close that rounding fills the panel."""
    finite = drawable(values[np.isfinite(values)])
    if not finite.size:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    span = max(high - low, SMALLEST_SPAN * max(abs(low), abs(high)), 1e-9)
    middle = (low + high) / 2
    return middle - 0.55 * span, middle + 0.55 * span


def unwrapped_gaps(time: np.ndarray, values: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values wrapped to (-period/2, period/2], with a NaN row at every wrap so that no line is drawn there."""
    rounding = 1e-9 * period  # a value that rests on the cut stays on its upper side
    wrapped = period / 2 + rounding - np.mod(period / 2 + rounding - values, period)
    jumps = np.flatnonzero(np.abs(np.diff(wrapped)) > period / 2) + 1
    return np.insert(time, jumps, np.nan), np.insert(wrapped, jumps, np.nan)

"""A speed that varies along the path, or in time."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike

from gammastar.checks import number, shortened
from gammastar.errors import InputError, UnknownNameError
from gammastar.law.piecewise import DEGREE, Piecewise
from gammastar.law.reference import Reference, require_on
from gammastar.law.schedule import SHORTEST_CHANGE, SMOOTH_STEP, Change, scheduled
from gammastar.path import Path

OVER = ("progress", "time")
SHORTEST_STRETCH = 1e-6  # of progress, between two points
SHORTEST_SEAM = 1e-3  # of the period, between the last point and the first one of the next round
SAMPLES = 64  # of a change of speed over time, among which it may turn round
SLACK = 1e-9  # of rounding at the ends
REST = np.array([1.0, 0, 0, 0, -5, 6, -2, 0])  # from flat at 1 down to 0, with slope -2 and no bend there


@dataclass(frozen=True)
class Profile:
    """A speed given at some places of the path, or at some times, and changing smoothly between them.

    From one point to the next the speed follows the polynomial S of degree 7 whose first three derivatives vanish at both ends, so it
    stays between the two and is as smooth as the law needs.

    Over time, the first speed also holds before its time, the last one for good, and the vehicle is held to the schedule.  Over
    progress, the speed belongs to where the vehicle is, not to when; it keeps one sign.  On a closed path the profile comes again
    with every turn.  On an open one the speeds at its ends hold beyond them, and a last point of speed zero is a place of rest:
    it is approached exponentially and held.  On a path that ends, the last point must be one.

    The error of the speed is a linear chain of three (Eq. (26) without its first gain) also over progress.
    """

    points: ArrayLike  # (n, 2): progress [path parameter] or time [s], growing; speed there [path parameter per second]
    over: Literal["progress", "time"] = "progress"

    def __post_init__(self) -> None:
        if self.over not in OVER:
            raise UnknownNameError("over", self.over, OVER)
        try:
            rows = [[number(value, "each number of a profile") for value in pair] for pair in self.points]  # type: ignore[union-attr]
            table = np.array(rows, dtype=float)
        except InputError:
            raise
        except (TypeError, ValueError) as error:
            raise InputError(
                f"a profile must be pairs of numbers (got {shortened(self.points)}); give [place, speed] pairs"
            ) from error
        if table.ndim != 2 or table.shape[1] != 2 or not len(table) or not np.isfinite(table).all():
            raise InputError(f"a profile must be finite pairs (got shape {table.shape}); give [place, speed] pairs")
        if np.any(np.diff(table[:, 0]) < (SHORTEST_CHANGE if self.over == "time" else SHORTEST_STRETCH)):
            raise InputError(
                f"the {self.over} of a profile must grow from point to point (got {shortened(table[:, 0].tolist())}); sort the points"
            )
        if self.over == "time" and table[0, 0] < 0:
            raise InputError(
                f"the times of a profile must not be negative (got {table[0, 0]:g} s); begin at 0 or later"
            )
        object.__setattr__(self, "points", tuple((float(place), float(speed)) for place, speed in table))
        speeds = table[:, 1] if table[:, 1].sum() >= 0 else -table[::-1, 1]
        if self.over == "progress" and not (np.all(speeds[:-1] > 0) and speeds[-1] >= 0 and speeds[0] > 0):
            raise InputError(
                f"a speed over progress must keep its sign, and may be zero at its last point only (got {table[:, 1].tolist()}); "
                "use Legs to stop on the way or to reverse"
            )

    @property
    def fastest(self) -> float:
        """Return the speed of the largest magnitude that is asked for."""
        return float(max(np.array(self.points)[:, 1], key=abs))

    @property
    def slowest(self) -> float:
        """Return the speed of the smallest magnitude, other than zero, that is asked for."""
        return float(min((speed for _, speed in np.array(self.points) if speed != 0), key=abs))

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        table = np.array(self.points)
        if self.over == "time":
            steps = itertools.pairwise(table)
            changes = [Change(a[0], b[1] - a[1], b[0] - a[0]) for a, b in steps]
            pieces = scheduled(start, float(table[0, 1]), changes)
            _require_inside(path, pieces, table)
            return Reference(pieces)
        return Reference(self._over_progress(path), holds_position=False, over_progress=True)

    def _over_progress(self, path: Path) -> Piecewise:
        """Return the speed over the coordinate."""
        table = np.array(self.points)
        for place in table[:, 0]:
            require_on(path, place, "a point of the profile")
        backwards = bool(table[:, 1].sum() < 0)
        last = table[0 if backwards else -1]
        if path.ends is not None and last[1] != 0:
            raise InputError(
                f"on a path that ends, a speed over progress must end with zero (got {last[1]:g} at {last[0]:g}); "
                "add a last point of speed 0 at or before the end"
            )
        if path.period is not None:
            if last[1] == 0 or path.period - np.ptp(table[:, 0]) < SHORTEST_SEAM * path.period:
                raise InputError(
                    f"a profile of a closed path must keep moving and leave some of its period of {path.period:.6g} between its last "
                    f"and its first point (got {np.ptp(table[:, 0]):.6g}, and the speed {last[1]:g}); use Legs to stop"
                )
            table = np.vstack([table, table[0] + [path.period, 0]])
        rows = [_transition(a[1], b[1], b[0] - a[0]) for a, b in itertools.pairwise(table)]
        if path.period is not None:
            return Piecewise(table[:-1, 0], np.stack(rows), path.period, backwards)
        slopes = (
            [polyval(x, polyder(row)) for x, row in ((0.0, rows[0]), (np.diff(table[-2:, 0])[0], rows[-1]))]
            if rows
            else [0.0] * 2
        )
        before, after = np.zeros((2, DEGREE + 1))
        before[:2] = table[0, 1] - slopes[0], slopes[0]
        after[:2] = table[-1, 1], slopes[1]
        begins = np.append(table[0, 0] - 1, table[:, 0])
        return Piecewise(begins, np.stack([before, *rows, after]), backwards=backwards)


def _require_inside(path: Path, pieces: Piecewise, table: np.ndarray) -> None:
    """Raise `InputError` when a schedule over time leaves a path that ends."""
    if path.ends is None:
        return
    times = np.linspace(0, table[-1, 0], SAMPLES * len(table)) if table[-1, 0] > 0 else np.zeros(1)
    places = pieces.values(times)
    if table[-1, 1] != 0 or places.min() < path.ends[0] - SLACK or places.max() > path.ends[1] + SLACK:
        low, high = path.ends
        raise InputError(
            f"on a path that ends, a profile over time must come to rest between {low:.6g} and {high:.6g} (got {places.min():.6g} to "
            f"{places.max():.6g}, and the speed {table[-1, 1]:g} at last); slow it down in time"
        )


def _transition(first: float, second: float, length: float) -> np.ndarray:
    """Return the coefficients (9,) of a speed that changes over a length of the path; zero at one end is a place of rest there."""
    if second == 0:
        share = first * REST
    elif first == 0:  # flown backwards: the same, seen from the other end
        share = second * np.array(
            [polyval(1.0, polyder(REST, k)) * (-1) ** k / math.factorial(k) for k in range(len(REST))]
        )
    else:
        share = (second - first) * SMOOTH_STEP
        share[0] += first
    return np.asarray(np.append(share, 0.0) / length ** np.arange(DEGREE + 1))

"""A path coordinate over time made of constant speeds and smooth changes between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gammastar.checks import number
from gammastar.law.piecewise import DEGREE, Piecewise

SMOOTH_STEP = np.array(
    [0.0, 0, 0, 0, 35, -84, 70, -20]
)  # S(u): from 0 to 1, its first three derivatives 0 at both ends
COVERED = np.append(0.0, SMOOTH_STEP / np.arange(1, DEGREE + 1))  # its integral; 1/2 at u = 1
SHORTEST_CHANGE = 1e-3  # [s] of a change of speed; no vehicle follows a shorter one
SAME_TIME = 1e-9  # [s] within which a change begins with the end of the one before


@dataclass(frozen=True)
class Change:
    """A change of speed that follows S(u), so that the coordinate is four times continuously differentiable."""

    begin: float  # [s]
    speed: float  # [path parameter per second], what is added
    duration: float  # [s]


def change_time(value: float, name: str) -> float:
    """Return a duration [s] of a change of speed, or raise `InputError` naming it."""
    return number(value, name, at_least=SHORTEST_CHANGE)


def scheduled(start: float, speed: float, changes: Sequence[Change] = ()) -> Piecewise:
    """Return the coordinate over time from a start coordinate and speed, with changes in their order, none inside another."""
    begins, rows = [0.0], [np.array([start, speed])]
    for change in changes:
        since = change.begin - begins[-1]
        place, duration = float(np.polynomial.polynomial.polyval(since, rows[-1])), change.duration
        if since <= SAME_TIME:
            del begins[-1], rows[-1]
        with np.errstate(over="ignore"):  # what is divided by infinity is zero
            during = change.speed * duration * COVERED / duration ** np.arange(DEGREE + 1)
        during[:2] += place, speed
        after = place + speed * duration + change.speed * duration / 2
        speed += change.speed
        begins += [change.begin, change.begin + duration]
        rows += [during, np.array([after, speed])]
    return Piecewise(np.array(begins), np.stack([np.pad(row, (0, DEGREE + 1 - len(row))) for row in rows]))


def to_a_stop(start: float, end: float, speed: float, duration: float) -> tuple[float, float, list[Change]]:
    """Return start, speed and changes that lead from rest to rest, at most at a speed; `end` does not lie behind.

    Where there is too little room for the speed, it is lower and the changes take the same time.
    """
    distance = (end - start) * np.sign(speed)
    if distance <= 0:
        return end, 0.0, []
    reached = np.sign(speed) * min(abs(speed), distance / duration)
    return start, 0.0, [Change(0.0, reached, duration), Change(distance / abs(reached), -reached, duration)]

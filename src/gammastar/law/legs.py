"""Schedules of legs: fly, stop at a point, hold, reverse, continue; the path is never left for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gammastar.checks import number, shortened, whole
from gammastar.errors import InputError
from gammastar.law.reference import CHANGE_TIME, Reference, require_laps, require_on
from gammastar.law.schedule import Change, change_time, scheduled, to_a_stop
from gammastar.path import Path

AT_GOAL = 1e-9  # of a period


@dataclass(frozen=True)
class Leg:
    """One part of a schedule: go to a coordinate at a speed and hold there, or go on at a speed without end."""

    speed: float  # [path parameter per second]; its sign is the direction
    to: float | None = (
        None  # path parameter; on a closed path the next time it comes in the direction of flight, at once if it is there
    )
    hold: float = 0.0  # [s] at rest after arriving
    laps: int = 0  # whole periods of a closed path flown before arriving

    def __post_init__(self) -> None:
        if number(self.speed, "leg speed [path parameter/s]") == 0:
            raise InputError(
                "the speed of a leg must not be zero (got 0); hold at the end of the leg before it instead"
            )
        number(self.hold, "leg hold [s]", at_least=0)
        whole(self.laps, "leg laps")
        if self.to is not None:
            number(self.to, "leg to [path parameter]")
        elif self.laps or self.hold:
            raise InputError(
                f"a leg without an end has no laps and no hold (got laps {self.laps} and hold {self.hold:g} s); say where it ends"
            )


@dataclass(frozen=True)
class Legs:
    """A schedule of legs; every change of speed takes the same smooth time.

    The schedule is four times continuously differentiable and is tracked exactly.  A leg shorter than its acceleration and braking is
    flown at a lower speed in the same time.  On a path that ends, a last leg without `to` leads to the end.
    """

    legs: tuple[Leg, ...]
    change_time: float = CHANGE_TIME  # [s] from rest to the speed of a leg, and back

    def __post_init__(self) -> None:
        change_time(self.change_time, "change time [s]")
        legs = tuple(self.legs) if isinstance(self.legs, Iterable) else (self.legs,)
        if isinstance(self.legs, Leg) or not all(isinstance(leg, Leg) for leg in legs):
            raise InputError(
                f"a schedule must be a list of Leg (got {shortened(self.legs)}); write Legs((Leg(1.0), ...))"
            )
        object.__setattr__(self, "legs", legs)
        if not self.legs:
            raise InputError("a schedule needs at least one leg (got none); give one")
        for k, leg in enumerate(self.legs[:-1]):
            if leg.to is None:
                raise InputError(
                    f"only the last leg may go on without end (got leg {k + 1} without 'to'); say where it stops"
                )

    @property
    def fastest(self) -> float:
        """Return the speed of the largest magnitude that is asked for."""
        return max((leg.speed for leg in self.legs), key=abs)

    def changes(self, path: Path, start: float) -> list[Change]:
        """Return the changes of speed of a flight from a coordinate."""
        changes: list[Change] = []
        time, place = 0.0, start
        for k, leg in enumerate(self.legs):
            end = _end(path, place, leg, k)
            if end is None:
                changes.append(Change(time, leg.speed, self.change_time))
                break
            _, _, there = to_a_stop(place, end, leg.speed, self.change_time)
            changes += [Change(time + change.begin, change.speed, change.duration) for change in there]
            if there:
                time = changes[-1].begin + self.change_time
            time, place = time + leg.hold, end
        return changes

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        return Reference(scheduled(start, 0.0, self.changes(path, start)))


def _end(path: Path, place: float, leg: Leg, index: int) -> float | None:
    """Return the coordinate at which a leg from a place ends, whole turns counted, or None when it does not end."""
    sense = float(np.sign(leg.speed))
    if leg.to is None:
        return None if path.ends is None else path.ends[leg.speed > 0]
    require_on(path, leg.to, f"the end of leg {index + 1}")
    require_laps(path, leg.laps, f"leg {index + 1}")
    distance = (leg.to - place) * sense
    if path.period is not None:
        distance %= path.period
        if path.period - distance < AT_GOAL * path.period:  # there already, but for rounding
            distance = 0.0
        distance += leg.laps * path.period
    elif distance < 0:
        raise InputError(
            f"leg {index + 1} must go towards its end (got {leg.to:g} from {place:.4g} at speed {leg.speed:g}); turn its speed round"
        )
    return place + sense * distance

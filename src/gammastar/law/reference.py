"""Where the vehicle should be along the path, as a smooth function of time: eta_11^ref of Eq. (26) and its derivatives.

A reference is a graph of time; its derivatives up to the fourth come from its Taylor series, so tracking it is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from gammastar import taylor
from gammastar.checks import number, shortened, whole
from gammastar.errors import InputError
from gammastar.path import Path
from gammastar.path.base import ORDER
from gammastar.taylor import Series


@dataclass(frozen=True, eq=False)
class Reference:
    """A path coordinate as a function of time, fixed once the start of a flight is known."""

    coordinate: Callable[[Any], Any]  # graph: time SX [s] -> path parameter SX; four times differentiable
    holds_position: bool = True  # whether the coordinate itself counts; a speed reference leaves it free, k_11 = 0

    def jet(self, time: Any) -> Any:
        """Graph: return SX (5,): the reference coordinate and its first four time derivatives."""
        symbol = ca.SX.sym("time")
        function = ca.Function("reference", [symbol], [ca.SX(self.coordinate(symbol))])
        series = Series((ca.SX(time), ca.SX(1), *(ca.SX(0) for _ in range(ORDER - 1))))
        return ca.vertcat(*taylor.through(function, [series])[0].derivatives())


@dataclass(frozen=True)
class Speed:
    """Constant speed along the path, eta_12^ref = speed, as in the paper's section VI; where on the path is left free."""

    speed: float  # [path parameter per second], negative runs backwards

    def __post_init__(self) -> None:
        number(self.speed, "speed [path parameter/s]")

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        return Reference(lambda time: start + self.speed * time, holds_position=False)


@dataclass(frozen=True)
class Ramp:
    """A schedule: be at start + speed * time, where start is the point nearest to the start of the flight."""

    speed: float  # [path parameter per second], negative runs backwards

    def __post_init__(self) -> None:
        number(self.speed, "speed [path parameter/s]")

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        return Reference(lambda time: start + self.speed * time)


@dataclass(frozen=True)
class Point:
    """Point stabilisation: go to a coordinate of the path and hold there; on a closed path the short way round."""

    coordinate: float  # path parameter

    def __post_init__(self) -> None:
        number(self.coordinate, "coordinate [path parameter]")

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        target = path.nearest_turn(self.coordinate, start)
        return Reference(lambda time: ca.SX(target))


@dataclass(frozen=True)
class Stop:
    """Fly at a speed, brake smoothly and come to rest exactly at a coordinate, then hold.

    Braking follows speed * (1 - S(u)) with the polynomial S of degree 7 whose first three derivatives vanish at both
    ends, so the reference is four times continuously differentiable.  It covers speed * braking_time / 2.
    """

    speed: float  # [path parameter per second], not zero
    coordinate: float  # path parameter where it stops
    braking_time: float  # [s]
    laps: int = 0  # whole periods of a closed path flown before the stop

    def __post_init__(self) -> None:
        number(self.coordinate, "coordinate [path parameter]")
        number(self.braking_time, "braking time [s]", above=0)
        if number(self.speed, "speed [path parameter/s]") == 0:
            raise InputError("the speed before a stop must not be zero (got 0); give a speed, or use a point reference")
        whole(self.laps, "laps")

    def braking_start(self, path: Path, start: float) -> float:
        """Return the time [s] at which braking begins for a flight from the path coordinate `start`."""
        least = abs(self.speed) * self.braking_time / 2
        distance = (self.coordinate - start) * (1 if self.speed > 0 else -1)
        if path.period is not None:
            distance = least + (distance - least) % path.period + self.laps * path.period
        if distance < least:
            raise InputError(
                f"a stop must lie ahead by the braking distance {least:.3g} (got {distance:.3g} along the direction of flight); "
                "move it, brake faster, or turn the speed round"
            )
        return float((distance - least) / abs(self.speed))

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        begin, duration, speed = self.braking_start(path, start), self.braking_time, self.speed

        def coordinate(time: Any) -> Any:
            return start + speed * (time - covered(time, begin, duration))

        return Reference(coordinate)


@dataclass(frozen=True)
class Leg:
    """One part of a schedule: go to a coordinate at a speed and hold there, or go on at a speed without end."""

    speed: float  # [path parameter per second]; its sign is the direction
    to: float | None = None  # path parameter; on a closed path the next time it comes in the direction of flight
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
    """A schedule of legs: fly, stop at a point, hold, reverse, continue; every change of speed takes the same smooth time.

    The speed follows the polynomial of `Stop`, so the schedule is four times continuously differentiable and is tracked exactly:
    the path is never left for it.  A leg shorter than its acceleration and braking is flown at a lower speed in the same time.
    """

    legs: tuple[Leg, ...]
    change_time: float = 1.0  # [s] from rest to the speed of a leg, and back

    def __post_init__(self) -> None:
        number(self.change_time, "change time [s]", above=0)
        if isinstance(self.legs, Leg) or not all(isinstance(leg, Leg) for leg in self.legs):
            raise InputError(
                f"a schedule must be a list of Leg (got {shortened(self.legs)}); write Legs((Leg(1.0), ...))"
            )
        object.__setattr__(self, "legs", tuple(self.legs))
        if not self.legs:
            raise InputError("a schedule needs at least one leg (got none); give one")
        for k, leg in enumerate(self.legs[:-1]):
            if leg.to is None:
                raise InputError(
                    f"only the last leg may go on without end (got leg {k + 1} without 'to'); say where it stops"
                )

    def changes(self, path: Path, start: float) -> list[tuple[float, float]]:
        """Return (time [s], change of speed) pairs, each spread over the change time, for a flight from a coordinate."""
        changes: list[tuple[float, float]] = []
        time, place = 0.0, start
        for k, leg in enumerate(self.legs):
            if leg.to is None:
                changes.append((time, leg.speed))
                break
            distance = _ahead(path, place, leg, k)
            speed = min(abs(leg.speed), distance / self.change_time) * (1 if leg.speed > 0 else -1)
            if distance > 0:
                arrival = time + distance / abs(speed)
                changes += [(time, speed), (arrival, -speed)]
                time = arrival + self.change_time
            time += leg.hold
            place += distance if leg.speed > 0 else -distance
        return changes

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        changes, duration = self.changes(path, start), self.change_time

        def coordinate(time: Any) -> Any:
            return sum((change * covered(time, begin, duration) for begin, change in changes), start + 0 * time)

        return Reference(coordinate)


def covered(time: Any, begin: float, duration: float) -> Any:
    """Graph: return what a speed that rises smoothly from 0 to 1 between begin and begin + duration has covered by a time.

    The speed is S(u) = 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7, whose first three derivatives vanish at both ends.  Both clamps act
    through the same u, so at the very instants of the joints one slope replaces the other and none is counted twice.
    """
    since = ca.fmax(time - begin, 0)
    u = ca.fmin(since / duration, 1)
    return duration * (7 * u**5 - 14 * u**6 + 10 * u**7 - 2.5 * u**8) + since - duration * u


def _ahead(path: Path, place: float, leg: Leg, index: int) -> float:
    """Return how far ahead, in the direction of a leg, its end lies."""
    assert leg.to is not None
    distance = (leg.to - place) * (1 if leg.speed > 0 else -1)
    if path.period is not None:
        return distance % path.period + leg.laps * path.period
    if distance < 0:
        raise InputError(
            f"leg {index + 1} must go towards its end (got {leg.to:g} from {place:.4g} at speed {leg.speed:g}); turn its speed round"
        )
    return distance


AnyReference = Speed | Ramp | Point | Stop | Legs

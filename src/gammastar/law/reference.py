"""Where the vehicle should be along the path, as a smooth function of time: eta_11^ref of Eq. (26) and its derivatives.

A reference is a graph of time; its derivatives up to the fourth come from its Taylor series, so tracking it is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from gammastar import taylor
from gammastar.checks import number, whole
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


def covered(time: Any, begin: float, duration: float) -> Any:
    """Graph: return what a speed that rises smoothly from 0 to 1 between begin and begin + duration has covered by a time.

    The speed is S(u) = 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7, whose first three derivatives vanish at both ends.  Both clamps act
    through the same u, so at the very instants of the joints one slope replaces the other and none is counted twice.
    """
    since = ca.fmax(time - begin, 0)
    u = ca.fmin(since / duration, 1)
    return duration * (7 * u**5 - 14 * u**6 + 10 * u**7 - 2.5 * u**8) + since - duration * u


AnyReference = Speed | Ramp | Point | Stop

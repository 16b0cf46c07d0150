"""Where the vehicle should be along the path: eta_11^ref of Eq. (26) and its derivatives, as data beside the graph.

Resolved for a path and a start, every reference is a piecewise polynomial: the path coordinate over time, or the speed over the path
coordinate.  Its four derivatives are exact, so tracking it is exact, and one compiled law serves all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np

from gammastar.checks import number, shortened, whole
from gammastar.errors import InputError
from gammastar.law.piecewise import DATA_SIZE, Piecewise, evaluated
from gammastar.law.schedule import Change, change_time, scheduled, to_a_stop
from gammastar.lookup import Lookup, the_key
from gammastar.path import Path
from gammastar.path.base import ORDER
from gammastar.taylor import Series

CHANGE_TIME = 1.0  # [s] from rest to a speed and back, where nothing else is said ...
GENTLE = 2.0  # [m/s^2] ... and longer at the ends of a path, so that the speed changes by no more than this
STEEPEST = 35 / 16  # largest slope of S
COARSE = 1e-9  # of a period: a coordinate known no better than this names no place of a closed path


@dataclass(frozen=True, eq=False)
class Reference:
    """What is wanted along a path, fixed once the start of a flight is known."""

    pieces: Piecewise  # the path coordinate over time [s], or its speed over the path coordinate
    holds_position: bool = True  # whether the coordinate itself counts; a speed leaves it free, k_11 = 0
    over_progress: bool = False  # whether the pieces are a speed over the path coordinate

    @property
    def lookup(self) -> Lookup:
        """Return the table of its data, looked up at a time [s], or at a path coordinate where it is over progress."""
        return Lookup(self.pieces.table, the_key)

    def moved(self, time: float) -> Reference:
        """Return the reference of a flight that begins at a later time [s]."""
        return self if self.over_progress else Reference(self.pieces.moved(time), self.holds_position)

    def jets(self, times: np.ndarray, tangential: np.ndarray) -> np.ndarray:
        """Return (n, 5): the reference coordinate and its first four derivatives at times (n,) and eta_1 ... eta_4 (n, 4)."""
        time, eta, data = ca.SX.sym("time"), ca.SX.sym("eta", 4), ca.SX.sym("data", DATA_SIZE)
        jet = ca.Function("jet", [time, eta, data], [ca.densify(wanted(self.over_progress, time, eta, data))])
        table = self.pieces.data(tangential[:, 0] if self.over_progress else times)
        return np.asarray(jet.map(len(times))(times[None, :], tangential.T, table).full().T)


def wanted(over_progress: bool, time: Any, tangential: Any, data: Any) -> Any:
    """Graph: return SX (5,), the reference coordinate and its first four time derivatives, from the data of its pieces.

    A speed w over the coordinate has the derivatives of w(eta_1(t)), by the series of eta_1 ... eta_4; the coordinate is the vehicle's
    own.  The error of the speed is then a linear chain of three like that of a constant speed.
    """
    if over_progress:
        along = Series.from_derivatives(ca.vertsplit(tangential[:4]))
        return ca.vertcat(tangential[0], *evaluated(data, along).derivatives())
    variable = Series((ca.SX(time), ca.SX(1), *(ca.SX(0) for _ in range(ORDER - 1))))
    return ca.vertcat(*evaluated(data, variable).derivatives())


@runtime_checkable
class AnyReference(Protocol):
    """What a flight accepts: `Speed`, `Ramp`, `Point`, `Stop`, `Legs`, `Profile`, or anything that resolves to a reference."""

    @property
    def fastest(self) -> float:
        """Return the speed [path parameter/s] of the largest magnitude that is asked for."""

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""


def reference_given(value: object) -> None:
    """Raise `InputError` unless a value is a reference; the class itself, without numbers, is none."""
    if isinstance(value, type) or not isinstance(value, AnyReference):
        raise InputError(f"reference must be one (got {shortened(value)}); make one, such as gs.Speed(1.0)")


@dataclass(frozen=True)
class Speed:
    """Constant speed along the path, eta_12^ref = speed, as in the paper's section VI; where on the path is left free.

    A path that ends is flown to its end in the direction of flight: from rest to the speed, to rest at the end, and hold there.
    """

    speed: float  # [path parameter per second], negative runs backwards

    def __post_init__(self) -> None:
        number(self.speed, "speed [path parameter/s]")

    @property
    def fastest(self) -> float:
        """Return the speed of the largest magnitude that is asked for."""
        return self.speed

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        if path.ends is None or self.speed == 0:
            return Reference(scheduled(start, self.speed), holds_position=False)
        return Reference(scheduled(*to_a_stop(start, path.ends[self.speed > 0], self.speed, gentle(path, self.speed))))


@dataclass(frozen=True)
class Ramp:
    """A schedule: be at start + speed * time, where start is the point nearest to the start of the flight.

    On a path that ends it brakes before the end and holds there.
    """

    speed: float  # [path parameter per second], negative runs backwards

    def __post_init__(self) -> None:
        number(self.speed, "speed [path parameter/s]")

    @property
    def fastest(self) -> float:
        """Return the speed of the largest magnitude that is asked for."""
        return self.speed

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        if path.ends is None or self.speed == 0:
            return Reference(scheduled(start, self.speed))
        end, speed = path.ends[self.speed > 0], abs(self.speed)
        distance = (end - start) * np.sign(self.speed)
        if distance <= 0:
            return Reference(scheduled(end, 0.0))
        duration = min(gentle(path, speed), 2 * distance / speed)
        brake = Change(distance / speed - duration / 2, -self.speed, duration)
        return Reference(scheduled(start, self.speed, [brake]))


@dataclass(frozen=True)
class Point:
    """Point stabilisation: go to a coordinate of the path and hold there; on a closed path the short way round."""

    coordinate: float  # path parameter

    def __post_init__(self) -> None:
        number(self.coordinate, "coordinate [path parameter]")

    @property
    def fastest(self) -> float:
        """Return the speed of the largest magnitude that is asked for."""
        return 0.0

    def resolved(self, path: Path, start: float) -> Reference:
        """Return the reference of a flight that starts at the path coordinate `start`."""
        require_on(path, self.coordinate, "a point")
        if path.period is not None and np.spacing(abs(self.coordinate)) > COARSE * path.period:
            raise InputError(
                f"a point must name a place of the path to {COARSE:g} of its period {path.period:.6g} (got {self.coordinate:g}, which "
                "rounding leaves open); take off whole periods"
            )
        return Reference(scheduled(path.nearest_turn(self.coordinate, start), 0.0))


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
        change_time(self.braking_time, "braking time [s]")
        if number(self.speed, "speed [path parameter/s]") == 0:
            raise InputError("the speed before a stop must not be zero (got 0); give a speed, or use a point reference")
        whole(self.laps, "laps")

    @property
    def fastest(self) -> float:
        """Return the speed of the largest magnitude that is asked for."""
        return self.speed

    def braking_start(self, path: Path, start: float) -> float:
        """Return the time [s] at which braking begins for a flight from the path coordinate `start`."""
        require_on(path, self.coordinate, "a stop")
        require_laps(path, self.laps, "a stop")
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
        brake = Change(self.braking_start(path, start), -self.speed, self.braking_time)
        return Reference(scheduled(start, self.speed, [brake]))


def gentle(path: Path, speed: float) -> float:
    """Return the time [s] of a change from rest to a speed [path parameter/s], at least `CHANGE_TIME`, that stays gentle in metres."""
    return max(CHANGE_TIME, STEEPEST * abs(speed) * path.fastest_pace / GENTLE)


def require_laps(path: Path, laps: int, what: str) -> None:
    """Raise `InputError` when laps are asked for on a path that does not come round."""
    if laps and path.period is None:
        raise InputError(
            f"laps of {what} need a closed path (got {laps} on {path.name}, which is open); leave them out"
        )


def require_on(path: Path, coordinate: float, what: str) -> None:
    """Raise `InputError` when a coordinate lies beyond the ends of a path that ends."""
    if path.ends is not None and not path.ends[0] <= coordinate <= path.ends[1]:
        low, high = path.ends
        raise InputError(
            f"{what} must lie on the path, from {low:.6g} to {high:.6g} (got {coordinate:g}); move it, or extend the path"
        )

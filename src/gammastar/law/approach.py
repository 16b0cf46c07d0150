"""Getting onto a path from anywhere: a bounded approach, a waiting target where no nearest point is unique, a thrust floor.

Near the path none of the three acts, and the closed loop is exactly linear; a flight in which one did is marked in its record.

* The first transverse error e is cut to a length e_max before it is fed back, and the speed along the path is asked for in the
  share e_max / |e|.  Far away the vehicle then comes at no more than k_1 e_max / k_2, beside what is left along the path, and the
  loop stays stable: the cut is a sector nonlinearity in [0, 1], and for the default poles the real part of the loop's frequency
  response stays above -3/8 (circle criterion).
* Near focal points the projection is not unique.  There the law holds a point of the path as a fixed target, which waits until
  the vehicle is inside the tube; entering and leaving have different margins, so the two modes do not chatter.  A vehicle that
  crosses the tube is not inside it: what counts on entering is the margin less what the velocity across the path may still take.
* The second derivative of the thrust is kept above the one with which the thrust decays to a floor: the thrust never reaches
  zero, and the attitude turns over at finite rates instead.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from gammastar.checks import number
from gammastar.errors import InputError
from gammastar.vehicle import StateGraph, Vehicle

FLOOR_SHARE = 0.05  # of the weight, when no floor is given
FLOOR_POLE = (
    20.0  # [1/s] double, with which the thrust may fall to its floor; faster than the motion, slower than rotors
)
CAPTURE_STEPS = 6  # Newton steps from the waiting target to the nearest point
CAPTURE_RESIDUAL = 1e-6  # of the nearest-point equation, relative, at which these steps count as converged


@dataclass(frozen=True)
class Approach:
    """How a vehicle gets onto a path from anywhere; needs a curve."""

    speed: float = 2.0  # [m/s] bound of the speed across the path far away
    thrust_floor: float | None = None  # [N]; None is 5 % of the weight
    leave: float = 0.3  # focal margin below which the target waits ...
    enter: float = 0.6  # ... until the margin, less what the motion across may still take, is above this one

    def __post_init__(self) -> None:
        object.__setattr__(self, "speed", number(self.speed, "approach speed [m/s]", above=0))
        if self.thrust_floor is not None:
            object.__setattr__(self, "thrust_floor", number(self.thrust_floor, "thrust floor [N]", above=0))
        leave, enter = number(self.leave, "leave"), number(self.enter, "enter")
        object.__setattr__(self, "leave", leave)
        object.__setattr__(self, "enter", enter)
        if not 0 < leave < enter < 1:
            raise InputError(
                f"margins must satisfy 0 < leave < enter < 1 (got {leave:g} and {enter:g}); keep them apart"
            )

    def floor(self, vehicle: Vehicle) -> float:
        """Return the thrust floor [N] for a vehicle.

        Raises:
            InputError: No floor was given and the vehicle has no weight to take a share of.
        """
        if self.thrust_floor is not None:
            return self.thrust_floor
        if vehicle.weight == 0:
            raise InputError("an approach without gravity needs a thrust floor [N] (got none); give one")
        return FLOOR_SHARE * vehicle.weight


def bounded(error: Any, limit: Any) -> Any:
    """Graph: return an error vector cut to a length."""
    length = ca.norm_2(error)
    return error * ca.if_else(length > limit, limit / ca.fmax(length, limit), 1)


def slowed(error: Any, limit: Any) -> Any:
    """Graph: return the share of the speed along the path that is asked for at an error vector: 1 within a length, less beyond.

    The nearest point at a given speed carries a vehicle n radii away along at n times that speed.
    """
    return limit / ca.fmax(ca.norm_2(error), limit)


def floored(state: StateGraph, control: Any, floor: float) -> Any:
    """Graph: return the input with the thrust's second derivative kept above the one of decay to a floor [N]."""
    least = -2 * FLOOR_POLE * state.thrust_rate - FLOOR_POLE**2 * (state.thrust - floor)
    return ca.vertcat(ca.fmax(control[0], least), control[1:])

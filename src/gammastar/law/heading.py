"""Where the nose points, through the reference of the yaw rate alone: nothing becomes singular, also not upside down.

With h the unit direction wanted in the world and b1, b2, b3 the body's axes, the yaw rate asked for is

    r = gain <b2, h> + <b3, h x h'> / |h across b3|^2,

the first term turning the nose towards h, the second following h as it turns.  The part of h along b3 cannot be reached by yaw;
where h is along b3, the second term is cut smoothly and the nose is free.  Opposite to h the nose rests, unstably.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array, direction, number
from gammastar.errors import InputError
from gammastar.path import ParametricPath, Path
from gammastar.vehicle import StateGraph

LEAST_ACROSS = 0.1  # length of h across b3 below which following it fades out


@runtime_checkable
class Heading(Protocol):
    """What the nose should do."""

    def yaw_rate(self, path: Path, state: StateGraph, place: Any, parameter_rate: Any) -> tuple[Any, Any]:
        """Graph: return the yaw rate wanted [rad/s] and its time derivative, as far as it is known."""


@dataclass(frozen=True)
class Azimuth:
    """The nose over a fixed direction of the world, as seen from the vehicle's own third axis."""

    direction: ArrayLike = (1.0, 0.0, 0.0)  # (3,) world; an azimuth is (cos a, sin a, 0)
    gain: float = 2.0  # [1/s] at which the nose turns in

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", number(self.gain, "heading gain [1/s]", above=0))
        object.__setattr__(self, "direction", tuple(direction(self.direction, "heading direction")))

    def yaw_rate(self, path: Path, state: StateGraph, place: Any, parameter_rate: Any) -> tuple[Any, Any]:
        """Graph: return the yaw rate that turns the nose to the direction."""
        return _turning(state, ca.DM(np.asarray(self.direction)), ca.DM.zeros(3), self.gain)


@dataclass(frozen=True)
class Along:
    """The nose along the path, in the direction of its parameter; needs a curve."""

    gain: float = 2.0  # [1/s] at which the nose turns in

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", number(self.gain, "heading gain [1/s]", above=0))

    def yaw_rate(self, path: Path, state: StateGraph, place: Any, parameter_rate: Any) -> tuple[Any, Any]:
        """Graph: return the yaw rate that turns the nose along the tangent and follows it."""
        if not isinstance(path, ParametricPath):
            raise InputError("a nose along the path needs a curve (got an implicit path); choose another heading")
        _, first, second = path.jet(place, 2)
        speed = ca.norm_2(first)
        tangent = first / speed
        turning = parameter_rate * (second - tangent * ca.dot(tangent, second)) / speed
        return _turning(state, tangent, turning, self.gain)


@dataclass(frozen=True)
class Towards:
    """The nose towards a fixed point of the world."""

    point: ArrayLike  # (3,) [m], world
    gain: float = 2.0  # [1/s] at which the nose turns in

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", number(self.gain, "heading gain [1/s]", above=0))
        object.__setattr__(self, "point", tuple(array(self.point, "heading point [m]", (3,))))

    def yaw_rate(self, path: Path, state: StateGraph, place: Any, parameter_rate: Any) -> tuple[Any, Any]:
        """Graph: return the yaw rate that turns the nose to the point and follows it; at the point itself the nose is free."""
        line = ca.DM(np.asarray(self.point)) - state.position
        length = ca.sqrt(ca.sumsqr(line) + LEAST_ACROSS**2)
        sight = line / length
        turning = -(state.velocity - sight * ca.dot(sight, state.velocity)) / length
        return _turning(state, sight, turning, self.gain)


def heading_key(heading: Heading) -> Hashable:
    """Return what names a heading's graph: its numbers, for one of these classes; for one of a user's own, nothing else has its name."""
    return heading if type(heading) in (Azimuth, Along, Towards) else object()


def _turning(state: StateGraph, wanted: Any, wanted_rate: Any, gain: float) -> tuple[Any, Any]:
    """Graph: return the yaw rate of the module's formula, and the rate of its first term."""
    first, second, third = (state.attitude[:, k] for k in range(3))
    p, _, r = ca.vertsplit(state.angular_velocity)
    across = 1 - ca.dot(third, wanted) ** 2
    following = ca.dot(third, ca.cross(wanted, wanted_rate)) / ca.fmax(across, LEAST_ACROSS**2)
    rate = -r * ca.dot(first, wanted) + p * ca.dot(third, wanted) + ca.dot(second, wanted_rate)
    return gain * ca.dot(second, wanted) + following, gain * rate

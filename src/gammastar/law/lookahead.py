"""Where a vehicle will be when a command is felt, from the wrenches that act until then."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from gammastar import so3
from gammastar.vehicle import StateGraph, Unknown, Vehicle


@dataclass(frozen=True, eq=False)
class Lookahead:
    """A believed vehicle that moves under wrenches, or under thrust and commanded body rates in their place."""

    vehicle: Vehicle
    interface: str

    def turning(self, angular_velocity: Any, wrench: Any, unknown: Unknown) -> Any:
        """Graph: return the angular acceleration SX (3,), body."""
        if self.interface == "wrench":
            return self.vehicle.angular_acceleration(angular_velocity, wrench[1:], unknown)
        extra = unknown.angular_acceleration
        following = self.vehicle.rate_bandwidth * (wrench[1:] - angular_velocity)
        return following + (ca.DM(extra) if isinstance(extra, tuple) else extra)

    def accelerations(
        self, velocity: Any, attitude: Any, angular_velocity: Any, wrench: Any, unknown: Unknown
    ) -> tuple[Any, Any]:
        """Graph: return acceleration SX (3,), world, and angular acceleration SX (3,), body."""
        state = StateGraph(ca.SX.zeros(3), velocity, attitude, angular_velocity, wrench[0], ca.SX(0))
        return self.vehicle.acceleration(state, unknown), self.turning(angular_velocity, wrench, unknown)

    def moved(self, state: StateGraph, first: Any, last: Any, step: float, unknown: Unknown) -> StateGraph:
        """Graph: return the state after a step in which the wrench goes from one to another; Simpson's rule, midpoint for the turn."""
        middle, rates = (first + last) / 2, state.angular_velocity
        halfway = rates + step / 2 * self.turning(rates, (3 * first + last) / 4, unknown)
        after = rates + step * self.turning(halfway, middle, unknown)
        turned = state.attitude @ so3.exp((rates + halfway) * step / 4), state.attitude @ so3.exp(halfway * step)

        def acceleration(velocity: Any, attitude: Any, thrust: Any, time: float) -> Any:
            there = StateGraph(state.position, velocity, attitude, rates, thrust, ca.SX(0))
            return self.vehicle.acceleration(there, ahead(unknown, time))

        begin = acceleration(state.velocity, state.attitude, first[0], 0.0)
        mid = acceleration(state.velocity + step / 2 * begin, turned[0], middle[0], step / 2)
        end = acceleration(state.velocity + step * mid, turned[1], last[0], step)
        return StateGraph(
            state.position + step * state.velocity + step**2 / 6 * (begin + 2 * mid),
            state.velocity + step / 6 * (begin + 4 * mid + end),
            turned[1],
            after,
            state.thrust,
            state.thrust_rate,
        )


def ahead(unknown: Unknown, time: float) -> Unknown:
    """Graph: return what is unknown after a time [s], when its last derivatives stay."""
    if isinstance(unknown.jerk, tuple) or time == 0.0:
        return unknown
    return unknown._replace(
        acceleration=unknown.acceleration + time * unknown.jerk + time**2 / 2 * unknown.snap,
        jerk=unknown.jerk + time * unknown.snap,
    )

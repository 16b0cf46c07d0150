"""Graph: the sum of forces, and its first two time derivatives along the flow of a vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from gammastar import so3
from gammastar.vehicle.forces import Force
from gammastar.vehicle.state import StateGraph, symbols


def total(forces: Sequence[Force], state: StateGraph, wind: Any) -> Any:
    """Graph: return the sum of forces SX (3,) [N], world."""
    value = ca.SX(3, 1)
    for force in forces:
        value = value + force.value(state, wind)
    return value


def rate(forces: Sequence[Force], state: StateGraph, wind: Any, acceleration: Any) -> Any:
    """Graph: return the time derivative SX (3,) [N/s] of the sum along the flow, in steady wind."""
    return _flow(forces)(*state, wind, acceleration)


def second_rate(
    forces: Sequence[Force],
    state: StateGraph,
    wind: Any,
    acceleration: Any,
    jerk: Any,
    angular_acceleration: Any,
    thrust_ddot: Any,
) -> Any:
    """Graph: return the second time derivative SX (3,) [N/s^2] of the sum along the flow, affine in (u_d, Omega')."""
    return _flow_of_rate(forces)(*state, wind, acceleration, jerk, angular_acceleration, thrust_ddot)


def _flow(forces: Sequence[Force]) -> Any:
    """Return the function (state, wind, acceleration) -> d' of the sum d: its slope times the rates of what it depends on."""
    state, wind, acceleration = symbols(), ca.SX.sym("wind", 3), ca.SX.sym("acceleration", 3)
    slots = ca.vertcat(state.position, state.velocity, ca.vec(state.attitude), state.thrust)
    turning = ca.vec(ca.mtimes(state.attitude, so3.hat(state.angular_velocity)))
    rates = ca.vertcat(state.velocity, acceleration, turning, state.thrust_rate)
    value = ca.jtimes(total(forces, state, wind), slots, rates)
    return ca.Function("force_rate", [*state, wind, acceleration], [ca.cse(value)])


def _flow_of_rate(forces: Sequence[Force]) -> Any:
    """Return the function (state, wind, acceleration, jerk, Omega', u_d) -> d'' of the sum d."""
    state, wind = symbols(), ca.SX.sym("wind", 3)
    acceleration, jerk, angular_acceleration = (ca.SX.sym(name, 3) for name in ("acceleration", "jerk", "alpha"))
    thrust_ddot = ca.SX.sym("thrust_ddot")
    turning = ca.vec(ca.mtimes(state.attitude, so3.hat(state.angular_velocity)))
    slots = ca.vertcat(
        *(state.position, state.velocity, ca.vec(state.attitude), state.thrust),
        *(state.angular_velocity, state.thrust_rate, acceleration),
    )
    rates = ca.vertcat(
        *(state.velocity, acceleration, turning, state.thrust_rate),
        *(angular_acceleration, thrust_ddot, jerk),
    )
    value = ca.jtimes(rate(forces, state, wind, acceleration), slots, rates)
    inputs = [*state, wind, acceleration, jerk, angular_acceleration, thrust_ddot]
    return ca.Function("force_second_rate", inputs, [ca.cse(value)])

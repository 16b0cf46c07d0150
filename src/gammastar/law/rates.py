"""What a law commands a flight controller that takes thrust and body rates: relative degree three, and an inner loop made up for.

The outputs' third derivatives are affine in the thrust rate and the body rates, so a law of one integrator less gives the body rates that
are wanted, Omega_d.  An inner loop that follows commands as Omega' = b (command - Omega) is led by command = Omega_d + Omega_d' / b: then
Omega - Omega_d decays with b, exactly, and chains and inner loop are in cascade.  Omega_d' is the derivative of the graph along the flow.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

from gammastar import so3
from gammastar.law.guidance import Guidance, Surroundings, bend, chosen
from gammastar.law.reference import wanted
from gammastar.vehicle import StateGraph, Unknown
from gammastar.vehicle.state import symbols


class RateDecision(NamedTuple):
    """Graph: what a law with the interface 'rates' does at one instant."""

    thrust_rate: Any  # SX [N/s]
    rates: Any  # SX (3,) [rad/s], body, to command
    turning: Any  # SX [m/s^2], what the bend of the path asks for at the speed along it
    parameter_rate: Any  # SX, of the tracked path parameter; zero while the target waits
    constrained: Any  # SX, 1 where the approach bends the linear law


def decide_by_rates(
    guidance: Guidance,
    state: StateGraph,
    parameter: Any,
    waiting: Any,
    time: Any,
    around: Surroundings,
    unknown: Unknown,
    pace: Any,
) -> RateDecision:
    """Graph: return thrust rate and body rates to command at a state, in the mode that holds, waiting (1) or following (0)."""
    law, bandwidth = guidance.law, guidance.law.vehicle.rate_bandwidth
    known = [ca.SX(ca.DM(each)) if isinstance(each, tuple) else each for each in unknown]
    free = _wanted(guidance)(*state[:5], parameter, waiting, time, around.path, around.reference, *known[:3], pace)
    thrust_rate, rates, turning, parameter_rate, constrained = free
    place = ca.vertcat(parameter, around.path)
    yaw_acceleration = law.yaw_acceleration(guidance.yaw, state, place, parameter_rate)
    lead = ca.vertcat(rates + turning / bandwidth, state.angular_velocity[2] + yaw_acceleration / bandwidth)
    bent = bend(law, place, parameter_rate)
    return RateDecision(thrust_rate, lead - known[3] / bandwidth, bent, parameter_rate, constrained)


def _wanted(guidance: Guidance) -> Any:
    """Return the function of all that body rates depend on -> thrust rate, body rates (2,), their derivatives, progress, constrained."""
    law, state = guidance.law, symbols()
    parameter, waiting, time, pace = (ca.SX.sym(name) for name in ("parameter", "waiting", "time", "pace"))
    data, pieces = ca.SX.sym("path", law.path.data_size), ca.SX.sym("reference", 20)
    unknown = Unknown(*(ca.SX.sym(name, 3) for name in ("d", "d_rate", "d_ddot")))
    place, over_progress = ca.vertcat(parameter, data), guidance.reference.over_progress

    def reference(tangential: Any) -> Any:
        return wanted(over_progress, time, tangential, pieces)

    control = law.rate_control(state, place, reference, guidance.reference.holds_position, unknown, pace)
    thrust_rate, rates, parameter_rate = control.thrust_rate, control.rates, control.outputs.tangential[1]
    constrained = ca.SX(0)
    if law.approach is not None:
        waited = law.wait_by_rates(state, place, unknown)
        thrust_rate, rates = chosen(waiting, waited[0], thrust_rate), chosen(waiting, waited[1], rates)
        parameter_rate = ca.if_else(waiting, 0, parameter_rate)
        constrained = ca.logic_or(waiting, ca.norm_2(control.outputs.transverse[:, 0]) > law.longest_error)
    moving = [state.position, state.velocity, ca.vec(state.attitude), state.thrust, parameter, time, *unknown[:2]]
    flow = [
        *(state.velocity, law.vehicle.acceleration(state, unknown)),
        ca.vec(ca.mtimes(state.attitude, so3.hat(state.angular_velocity))),
        *(thrust_rate, parameter_rate, ca.SX(1), unknown.jerk, unknown.snap),
    ]
    turning = ca.jtimes(rates, ca.vertcat(*moving), ca.vertcat(*flow))
    inputs = [*state[:5], parameter, waiting, time, data, pieces, *unknown[:3], pace]
    outputs = [thrust_rate, rates, turning, parameter_rate, constrained]
    options = {"allow_free": True}  # a tuning that is given by graphs is that of the graph around it
    return ca.Function("wanted", inputs, ca.cse([ca.densify(each) for each in outputs]), options)

"""Transverse feedback linearization: from state and path to chains of integrators and back; Eqs. (15)-(24)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from gammastar.path import Path, PathOutputs
from gammastar.taylor import Series
from gammastar.vehicle import CALM, NOTHING, StateGraph, Unknown, Vehicle


@dataclass(frozen=True, eq=False)
class Linearization:
    """Graph: the transformed state T(x) of Eq. (19) at one state, and the feedback (23) that makes it linear."""

    vehicle: Vehicle
    state: StateGraph
    outputs: PathOutputs
    yaw_value: Any  # SX, eta_21 = beta(r)
    yaw_slope: Any  # SX, d beta / d r
    unknown: Unknown = NOTHING  # what acts on the vehicle beyond its model

    def input_for(self, transverse_rate: Any, tangential_rate: Any, yaw_rate: Any) -> Any:
        """Graph: return the input SX (4,) that gives the chains these highest derivatives, Eq. (23).

        Solved in two closed-form steps: outputs' fourth derivatives to snap, snap and r' to (u_d, torque).
        """
        snap = self.outputs.snap(transverse_rate, tangential_rate)
        return self.vehicle.input_for(self.state, snap, yaw_rate / self.yaw_slope, self.unknown)

    def internal_state(self) -> Any:
        """Graph: return mu SX (7,), Eq. (20): the first two columns of R and the thrust."""
        return ca.vertcat(self.state.attitude[:, 0], self.state.attitude[:, 1], self.state.thrust)


def linearize(
    vehicle: Vehicle,
    path: Path,
    state: StateGraph,
    place: Any,
    yaw_output: Callable[[Any], Any],
    unknown: Unknown = NOTHING,
    wind: Any = CALM,
) -> Linearization:
    """Graph: return the outputs, their derivatives and the linearizing feedback at a state and a tracked place."""
    position = Series.from_derivatives(
        [
            state.position,
            state.velocity,
            vehicle.acceleration(state, unknown, wind),
            vehicle.jerk(state, unknown, wind),
        ]
    )
    value, slope = yaw_terms(yaw_output, state.angular_velocity[2])
    return Linearization(vehicle, state, path.outputs(position, place), value, slope, unknown)


def yaw_terms(yaw_output: Callable[[Any], Any], yaw_rate: Any) -> tuple[Any, Any]:
    """Graph: return beta(r) and its slope at a yaw rate."""
    symbol = ca.SX.sym("yaw_rate")
    value = ca.SX(yaw_output(symbol))
    beta = ca.Function("beta", [symbol], [value, ca.jacobian(value, symbol)])
    yaw_value, yaw_slope = beta(ca.SX(yaw_rate))
    return yaw_value, yaw_slope


def decoupling_matrix(linearization: Linearization) -> Any:
    """Graph: return D, the map from (u_d, torque) to the highest output derivatives, Eq. (17).

    Rows: the transverse outputs [m/s^4 per input], the path coordinate, the yaw output; shape (n + 2, 4) with n = 3 for
        a curve,
    whose transverse rows are world vectors of the normal plane and so have rank two.  Singular where the thrust is zero
    and at focal points.  Its determinant is Eq. (18) with the gradient of pi in place of sigma'.
    """
    vehicle, state, outputs = linearization.vehicle, linearization.state, linearization.outputs
    thrust_ddot, torque = ca.SX.sym("thrust_ddot"), ca.SX.sym("torque", 3)
    rates = vehicle.rates(state, thrust_ddot, torque)
    snap = vehicle.snap(state, thrust_ddot, rates.angular_velocity)
    highest = ca.vertcat(
        ca.mtimes(outputs.transverse_gradient, snap),
        ca.mtimes(outputs.tangential_gradient, snap),
        linearization.yaw_slope * rates.angular_velocity[2],
    )
    return ca.jacobian(highest, ca.vertcat(thrust_ddot, torque))

"""A vehicle of the class C_V: thrust along the body's third axis, three torques; Eqs. (1)-(4) and (7).

Forces point as in the paper: world and body third axes are down, thrust pushes along -R e3, gravity along +e3.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import magnitude, magnitudes, shape_of, three
from gammastar.errors import InputError, ShapeError
from gammastar.vehicle.state import StateGraph

DOWN = (0.0, 0.0, 1.0)  # e3, third axis of the world


class Rates(NamedTuple):
    """Graph: time derivatives of the parts of a state; the attitude moves as R' = R hat(angular_velocity)."""

    position: Any  # SX (3,) [m/s]
    velocity: Any  # SX (3,) [m/s^2]
    angular_velocity: Any  # SX (3,) [rad/s^2], body
    thrust: Any  # SX [N/s]
    thrust_rate: Any  # SX [N/s^2]


@dataclass(frozen=True, eq=False)
class Vehicle:
    """Mass properties and constant loads of one vehicle; immutable.

    Raises:
        InputError: Mass not positive, inertia not positive definite or against the triangle inequality of principal
            moments (no mass distribution has such moments), gravity negative.
        ShapeError: A vector or matrix has the wrong shape or is not finite.
    """

    mass: float  # [kg]
    inertia: ArrayLike  # (3,) diagonal or (3, 3) symmetric [kg m^2], about the centre of mass, body axes
    gravity: float = 9.80665  # [m/s^2], the standard value; 0 for a satellite
    bias_acceleration: ArrayLike = (0.0, 0.0, 0.0)  # K_t of Eq. (1), (3,) or scalar [m/s^2], world, subtracted
    bias_torque: ArrayLike = (0.0, 0.0, 0.0)  # K_r of Eq. (3), (3,) or scalar [N m], body, subtracted

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", magnitude(self.mass, "mass [kg]", above=0))
        object.__setattr__(self, "gravity", magnitude(self.gravity, "gravity [m/s^2]", at_least=0))
        object.__setattr__(self, "inertia", _inertia_matrix(self.inertia))
        for name in ("bias_acceleration", "bias_torque"):
            object.__setattr__(self, name, three(getattr(self, name), name))

    @functools.cached_property
    def signature(self) -> tuple[float, ...]:
        """Return all numbers of the vehicle in a fixed order: vehicles with one signature fly alike."""
        arrays = (self.inertia, self.bias_acceleration, self.bias_torque)
        return (self.mass, self.gravity, *(float(x) for values in arrays for x in np.ravel(values)))

    @property
    def weight(self) -> float:
        """Return m g [N], the thrust that hovers."""
        return self.mass * self.gravity

    def rates(self, state: StateGraph, thrust_ddot: Any, torque: Any) -> Rates:
        """Graph: return the right-hand side of Eq. (7) for the input (u_d [N/s^2], torque [N m], body)."""
        gyroscopic = ca.cross(
            state.angular_velocity, ca.mtimes(ca.DM(np.asarray(self.inertia)), state.angular_velocity)
        )
        angular_acceleration = ca.mtimes(
            ca.DM(np.linalg.inv(np.asarray(self.inertia))), torque - gyroscopic - ca.DM(np.asarray(self.bias_torque))
        )
        return Rates(state.velocity, self.acceleration(state), angular_acceleration, state.thrust_rate, thrust_ddot)

    def acceleration(self, state: StateGraph) -> Any:
        """Graph: return the world acceleration g e3 - (zeta1/m) R e3 - K_t [m/s^2], Eq. (1)."""
        return (
            self.gravity * ca.DM(DOWN)
            - state.thrust / self.mass * state.attitude[:, 2]
            - ca.DM(np.asarray(self.bias_acceleration))
        )

    def jerk(self, state: StateGraph) -> Any:
        """Graph: return -(1/m)(zeta2 R e3 + zeta1 R (Omega x e3)) [m/s^3], world."""
        p, q, _ = ca.vertsplit(state.angular_velocity)
        return (
            -ca.mtimes(state.attitude, ca.vertcat(state.thrust * q, -state.thrust * p, state.thrust_rate)) / self.mass
        )

    def snap(self, state: StateGraph, thrust_ddot: Any, angular_acceleration: Any) -> Any:
        """Graph: return the world snap [m/s^4], affine in (u_d, p', q') and free of r'.

        -m R^T s = u_d e3 + 2 zeta2 (q, -p, 0) + zeta1 (p r, q r, -(p^2 + q^2)) + zeta1 (q', -p', 0).
        """
        p, q, r = ca.vertsplit(state.angular_velocity)
        p_rate, q_rate, _ = ca.vertsplit(angular_acceleration)
        in_body = ca.vertcat(
            2 * state.thrust_rate * q + state.thrust * (p * r + q_rate),
            -2 * state.thrust_rate * p + state.thrust * (q * r - p_rate),
            thrust_ddot - state.thrust * (p**2 + q**2),
        )
        return -ca.mtimes(state.attitude, in_body) / self.mass

    def input_for(self, state: StateGraph, snap: Any, yaw_acceleration: Any) -> Any:
        """Graph: return the input SX (4,) (u_d, torque) that gives a snap [m/s^4] and an r' [rad/s^2].

        The inverse of `snap`, in closed form: one rotation into body axes and two divisions by the thrust.  Singular
        where the thrust is zero (free fall), and nowhere else.  Any symmetric inertia: the torque follows from all of
        Omega'.
        """
        p, q, r = ca.vertsplit(state.angular_velocity)
        w = -self.mass * ca.mtimes(state.attitude.T, snap)
        thrust_ddot = w[2] + state.thrust * (p**2 + q**2)
        q_rate = (w[0] - 2 * state.thrust_rate * q) / state.thrust - p * r
        p_rate = (-w[1] - 2 * state.thrust_rate * p) / state.thrust + q * r
        inertia = ca.DM(np.asarray(self.inertia))
        torque = (
            ca.mtimes(inertia, ca.vertcat(p_rate, q_rate, yaw_acceleration))
            + ca.cross(state.angular_velocity, ca.mtimes(inertia, state.angular_velocity))
            + ca.DM(np.asarray(self.bias_torque))
        )
        return ca.vertcat(thrust_ddot, torque)


def _inertia_matrix(inertia: ArrayLike) -> np.ndarray:
    """Return a symmetric positive definite (3, 3) inertia from three moments or a matrix, or raise."""
    shape = shape_of(inertia)
    if shape is None or shape not in {(3,), (3, 3)}:
        got = "rows of different lengths" if shape is None else f"shape {shape}"
        raise ShapeError(f"inertia [kg m^2] must be 3 moments or a 3x3 matrix (got {got}); give one of the two")
    given = magnitudes(inertia, "inertia [kg m^2]", shape)
    matrix = np.diag(given) if shape == (3,) else given
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12 * np.abs(matrix).max()):
        raise InputError(
            "inertia [kg m^2] must be symmetric (got different entries across the diagonal); check the signs"
        )
    moments = np.linalg.eigvalsh(matrix)
    if moments[0] <= 0:
        raise InputError(
            f"inertia [kg m^2] must be positive definite (got principal moments {moments.tolist()}); check the diagonal"
        )
    magnitude(moments[0], "the least moment of the inertia [kg m^2]", above=0)
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        raise InputError(
            f"inertia [kg m^2] must satisfy the triangle inequality (got principal moments {moments.tolist()}); "
            "no body has a moment larger than the sum of the other two"
        )
    matrix = (matrix + matrix.T) / 2
    matrix.setflags(write=False)
    return matrix

"""A vehicle of the class C_V: thrust along the body's third axis, three torques; Eqs. (1)-(4) and (7).

Forces point as in the paper: world and body third axes are down, thrust pushes along -R e3, gravity along +e3.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import instance, magnitude, three
from gammastar.errors import InputError
from gammastar.vehicle.flow import rate, second_rate, total
from gammastar.vehicle.forces import Buoyancy, Force, listed
from gammastar.vehicle.inertia import inertia_matrix, isotropic
from gammastar.vehicle.rotors import Rotors
from gammastar.vehicle.state import StateGraph, symbols


class Rates(NamedTuple):
    """Graph: time derivatives of the parts of a state; the attitude moves as R' = R hat(angular_velocity)."""

    position: Any  # SX (3,) [m/s]
    velocity: Any  # SX (3,) [m/s^2]
    angular_velocity: Any  # SX (3,) [rad/s^2], body
    thrust: Any  # SX [N/s]
    thrust_rate: Any  # SX [N/s^2]


class Unknown(NamedTuple):
    """Graph: what acts on a vehicle beyond its model, as an observer knows it; zero where there is none."""

    acceleration: Any = (0.0, 0.0, 0.0)  # SX (3,) [m/s^2], world: unknown force over the mass that is moved
    jerk: Any = (0.0, 0.0, 0.0)  # SX (3,) [m/s^3], its first derivative
    snap: Any = (0.0, 0.0, 0.0)  # SX (3,) [m/s^4], its second derivative
    angular_acceleration: Any = (0.0, 0.0, 0.0)  # SX (3,) [rad/s^2], body: inverse inertia times unknown torque


NOTHING = Unknown()
CALM = (0.0, 0.0, 0.0)  # [m/s] wind
LEAST_SHARE = 1e-6  # of the determinant of the map from inputs to snap that forces must leave at rest


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
    added_mass: float = 0.0  # [kg] of fluid that moves along, the same in all directions; 0 in air
    forces: Sequence[Force] = ()  # drag, buoyancy and the like
    rotors: Rotors | None = None  # what gives the wrench; None is any wrench, at once
    latency: float = 0.0  # [s] from a measurement to the beginning of what its command does
    rate_bandwidth: float = 20.0  # [rad/s] of the inner loop that takes body rates, for a law with that interface

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", magnitude(self.mass, "mass [kg]", above=0))
        object.__setattr__(self, "gravity", magnitude(self.gravity, "gravity [m/s^2]", at_least=0))
        object.__setattr__(self, "inertia", inertia_matrix(self.inertia))
        for name in ("bias_acceleration", "bias_torque"):
            object.__setattr__(self, name, three(getattr(self, name), name))
        object.__setattr__(self, "added_mass", isotropic(self.added_mass))
        object.__setattr__(self, "forces", listed(self.forces))
        if self.rotors is not None:
            instance(self.rotors, Rotors, "rotors", "make them with gs.Rotors(...) or gs.Rotors.ring(...)")
        object.__setattr__(self, "latency", magnitude(self.latency, "latency [s]", at_least=0))
        bandwidth = magnitude(self.rate_bandwidth, "rate bandwidth [rad/s]", above=0)
        object.__setattr__(self, "rate_bandwidth", bandwidth)
        if self.forces:
            _check_relative_degree(self)

    @functools.cached_property
    def signature(self) -> tuple[Any, ...]:
        """Return all numbers of the vehicle in a fixed order: vehicles with one signature fly alike."""
        arrays = (self.inertia, self.bias_acceleration, self.bias_torque)
        numbers = (float(x) for values in arrays for x in np.ravel(values))
        rotors = None if self.rotors is None else self.rotors.signature
        forces = tuple(force.signature for force in self.forces)
        return (self.mass, self.gravity, *numbers, self.added_mass, forces, rotors, self.latency, self.rate_bandwidth)

    @property
    def weight(self) -> float:
        """Return the thrust that hovers in calm air [N]: m g, less what buoyancy carries."""
        lift = sum(force.lift for force in self.forces if isinstance(force, Buoyancy))
        return abs(self.mass * self.gravity - lift)

    @property
    def feels_the_air(self) -> bool:
        """Return whether a force may depend on the motion through the air, so that wind makes a difference."""
        return any(not isinstance(force, Buoyancy) for force in self.forces)

    @property
    def moved_mass(self) -> float:
        """Return the mass [kg] that a force accelerates: the vehicle's and that of the fluid moving along."""
        return self.mass + self.added_mass

    @functools.cached_property
    def inverse_inertia(self) -> Any:
        """Return J^-1 (3, 3) [1/(kg m^2)], body axes."""
        return np.linalg.inv(np.asarray(self.inertia))

    @functools.cached_property
    def force_scale(self) -> Any:
        """Return the factor of all forces but buoyancy: one, unless the vehicle is a varied one."""
        return 1.0

    def rates(
        self, state: StateGraph, thrust_ddot: Any, torque: Any, unknown: Unknown = NOTHING, wind: Any = CALM
    ) -> Rates:
        """Graph: return the right-hand side of Eq. (7) for the input (u_d [N/s^2], torque [N m], body)."""
        acceleration = self.acceleration(state, unknown, wind)
        angular_acceleration = self.angular_acceleration(state.angular_velocity, torque, unknown)
        return Rates(state.velocity, acceleration, angular_acceleration, state.thrust_rate, thrust_ddot)

    def momentum(self, angular_velocity: Any) -> Any:
        """Graph: return J Omega SX (3,) [kg m^2/s], body; or what an angular acceleration takes in torque."""
        return ca.mtimes(_graph(self.inertia), angular_velocity)

    def angular_acceleration(self, angular_velocity: Any, torque: Any, unknown: Unknown = NOTHING) -> Any:
        """Graph: return J^-1 (torque - Omega x J Omega - K_r) SX (3,) [rad/s^2], body, Eq. (3)."""
        gyroscopic = ca.cross(angular_velocity, self.momentum(angular_velocity))
        driving = torque - gyroscopic - ca.DM(np.asarray(self.bias_torque))
        return ca.mtimes(_graph(self.inverse_inertia), driving) + _graph(unknown.angular_acceleration)

    def acceleration(self, state: StateGraph, unknown: Unknown = NOTHING, wind: Any = CALM) -> Any:
        """Graph: return the world acceleration g e3 - (zeta1/m) R e3 - K_t [m/s^2], Eq. (1), with forces over m and what is unknown."""
        constant = ca.vertcat(0, 0, self.gravity * self.mass / self.moved_mass) - ca.DM(
            np.asarray(self.bias_acceleration)
        )
        modelled = constant - state.thrust / self.moved_mass * state.attitude[:, 2]

        def force() -> Any:
            lifting = [each for each in self.forces if isinstance(each, Buoyancy)]
            others = [each for each in self.forces if not isinstance(each, Buoyancy)]
            return total(lifting, state, _graph(wind)) + self.force_scale * total(others, state, _graph(wind))

        return self._with_force(modelled, force) + _graph(unknown.acceleration)

    def jerk(self, state: StateGraph, unknown: Unknown = NOTHING, wind: Any = CALM) -> Any:
        """Graph: return -(1/m)(zeta2 R e3 + zeta1 R (Omega x e3)) [m/s^3], world, with the rate of the forces."""
        p, q, _ = ca.vertsplit(state.angular_velocity)
        turning = ca.vertcat(state.thrust * q, -state.thrust * p, state.thrust_rate)
        modelled = -ca.mtimes(state.attitude, turning) / self.moved_mass

        def force() -> Any:
            by_flow = rate(self.forces, state, _graph(wind), self.acceleration(state, unknown, wind))
            return self.force_scale * by_flow

        return self._with_force(modelled, force) + _graph(unknown.jerk)

    def snap(
        self,
        state: StateGraph,
        thrust_ddot: Any,
        angular_acceleration: Any,
        unknown: Unknown = NOTHING,
        wind: Any = CALM,
    ) -> Any:
        """Graph: return the world snap [m/s^4], affine in (u_d, Omega'); free of r' without forces.

        -m R^T s = u_d e3 + 2 zeta2 (q, -p, 0) + zeta1 (p r, q r, -(p^2 + q^2)) + zeta1 (q', -p', 0), and the second rate of the forces.
        """
        p, q, r = ca.vertsplit(state.angular_velocity)
        p_rate, q_rate, _ = ca.vertsplit(angular_acceleration)
        in_body = ca.vertcat(
            2 * state.thrust_rate * q + state.thrust * (p * r + q_rate),
            -2 * state.thrust_rate * p + state.thrust * (q * r - p_rate),
            thrust_ddot - state.thrust * (p**2 + q**2),
        )
        modelled = -ca.mtimes(state.attitude, in_body) / self.moved_mass

        def force() -> Any:
            acceleration, jerk = self.acceleration(state, unknown, wind), self.jerk(state, unknown, wind)
            known = (state, _graph(wind), acceleration, jerk, angular_acceleration, thrust_ddot)
            return self.force_scale * second_rate(self.forces, *known)

        return self._with_force(modelled, force) + _graph(unknown.snap)

    def input_for(self, state: StateGraph, snap: Any, yaw_acceleration: Any, unknown: Unknown = NOTHING) -> Any:
        """Graph: return the input SX (4,) (u_d, torque) that gives a snap [m/s^4] and an r' [rad/s^2] in calm air.

        The inverse of `snap`.  Without forces it has a closed form, one rotation into body axes and two divisions by the thrust; with
        them a 3x3 solve.  Singular where the thrust is zero (free fall) and, without forces, nowhere else.  Any symmetric inertia:
        the torque follows from all of Omega'.
        """
        if self.forces:
            thrust_ddot, p_rate, q_rate = self._solved(state, snap, yaw_acceleration, unknown)
        else:
            p, q, r = ca.vertsplit(state.angular_velocity)
            w = -self.moved_mass * ca.mtimes(state.attitude.T, -_graph(unknown.snap) + snap)
            thrust_ddot = w[2] + state.thrust * (p**2 + q**2)
            q_rate = (w[0] - 2 * state.thrust_rate * q) / state.thrust - p * r
            p_rate = (-w[1] - 2 * state.thrust_rate * p) / state.thrust + q * r
        angular_acceleration = ca.vertcat(p_rate, q_rate, yaw_acceleration) - _graph(unknown.angular_acceleration)
        torque = (
            self.momentum(angular_acceleration)
            + ca.cross(state.angular_velocity, self.momentum(state.angular_velocity))
            + ca.DM(np.asarray(self.bias_torque))
        )
        return ca.vertcat(thrust_ddot, torque)

    def rates_for(self, state: StateGraph, jerk: Any, yaw_rate: Any, unknown: Unknown = NOTHING) -> tuple[Any, Any]:
        """Graph: return the thrust rate [N/s] and the body rates SX (3,) [rad/s] that give a jerk [m/s^3] in calm air.

        The inverse of `jerk`, for a vehicle that takes thrust and body rates; those of `state` are not used.  Singular where the
        thrust is zero.
        """
        if not self.forces:
            w = -self.moved_mass * ca.mtimes(state.attitude.T, jerk - _graph(unknown.jerk))
            return w[2], ca.vertcat(-w[1] / state.thrust, w[0] / state.thrust, yaw_rate)
        symbol = ca.SX.sym("rates", 4)
        value = self.jerk(state._replace(thrust_rate=symbol[0], angular_velocity=symbol[1:]), unknown)
        at_zero, slope, by_yaw = _affine(value, symbol)
        thrust_rate, p, q = cramer(slope, jerk - at_zero - by_yaw * yaw_rate)
        return thrust_rate, ca.vertcat(p, q, yaw_rate)

    def snap_map(self, state: StateGraph, unknown: Unknown = NOTHING) -> tuple[Any, Any, Any]:
        """Graph: return the snap as s0 + B (u_d, p', q') + c r': s0 SX (3,), B SX (3, 3), c SX (3,), in calm air."""
        symbol = ca.SX.sym("input", 4)
        return _affine(self.snap(state, symbol[0], symbol[1:], unknown), symbol)

    def _solved(self, state: StateGraph, snap: Any, yaw_acceleration: Any, unknown: Unknown) -> list[Any]:
        """Graph: return (u_d, p', q') that give a snap."""
        at_zero, slope, by_yaw = self.snap_map(state, unknown)
        return cramer(slope, snap - at_zero - by_yaw * yaw_acceleration)

    def _with_force(self, modelled: Any, force: Callable[[], Any]) -> Any:
        """Graph: return an acceleration, or a derivative of it, with that of the forces; unchanged where there are none."""
        return modelled + force() / self.moved_mass if self.forces else modelled


def _affine(value: Any, symbol: Any) -> tuple[Any, Any, Any]:
    """Graph: return a vector SX (3,) that is affine in four symbols: at zero, slope (3, 3) by the first three, slope by the last."""
    slope = ca.jacobian(value, symbol)
    return ca.substitute(value, symbol, ca.SX.zeros(4)), slope[:, :3], slope[:, 3]


def cramer(matrix: Any, right: Any) -> list[Any]:
    """Graph: return the solution of a 3x3 system by Cramer's rule."""
    columns = ca.horzsplit(matrix)
    cofactors = [ca.cross(columns[k - 2], columns[k - 1]) for k in range(3)]
    determinant = ca.dot(columns[0], cofactors[0])
    return [ca.dot(right, cofactor) / determinant for cofactor in cofactors]


def _graph(value: Any) -> Any:
    """Graph: return a vector or matrix of numbers or graphs; zeros leave no trace in what they are added to."""
    return ca.DM(value) if isinstance(value, tuple | np.ndarray) else value


def _check_relative_degree(vehicle: Vehicle) -> None:
    """Raise unless the inputs reach the snap in all directions at rest: relative degree {4, 4, 4, 1} there."""
    state = symbols()
    _, slope, _ = vehicle.snap_map(state)
    function = ca.Function("slope", [*state], [ca.det(slope)])
    thrust = vehicle.weight or vehicle.mass
    determinant = float(function(np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3), thrust, 0.0))
    alone = thrust**2 / vehicle.moved_mass**3
    if not abs(determinant) > LEAST_SHARE * alone:
        raise InputError(
            f"forces must leave the input its effect on the fourth derivative of position (got {determinant / alone:.2g} of the "
            "determinant without them, at rest); a force that cancels the thrust is none of this class"
        )

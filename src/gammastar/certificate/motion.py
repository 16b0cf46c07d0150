"""What exact following at constant speed demands of a vehicle, at each place of a path.

On the path chi(t) = sigma(lambda_0 + v t), so every derivative of position is a power of the speed times a derivative of
the curve, and the thrust vector F = m (g e3 - K_t - chi'') = zeta1 R e3 gives the rest, as in `law.predict`.  With forces or added
mass the thrust vector balances them too, and `flatness` finds it.
"""

from __future__ import annotations

import functools
from enum import StrEnum
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.law import predict
from gammastar.law.flatness import Flat, flat
from gammastar.law.thrust_axis import is_bare
from gammastar.path.base import ORDER
from gammastar.taylor import Series
from gammastar.vehicle import Rotors, Vehicle
from gammastar.vehicle.wrenches import normals


class Progress(StrEnum):
    """What a constant speed is constant in."""

    PARAMETER = "parameter"  # the path's own parameter, as the references of the law
    METRES = "metres"  # arc length

    @property
    def unit(self) -> str:
        """Return the unit of a speed."""
        return "parameter/s" if self is Progress.PARAMETER else "m/s"


class Demands(NamedTuple):
    """What each place demands; not finite in free fall."""

    specific_thrust: np.ndarray  # (n,) [m/s^2], |g e3 - K_t - chi''|
    thrust: np.ndarray  # (n,) [N]
    tilt_rate: np.ndarray  # (n,) [rad/s], sqrt(p^2 + q^2), whatever the heading
    tilt_acceleration: np.ndarray  # (n,) [rad/s^2], |(p', q')| for r = 0, whatever the heading
    torque: (
        np.ndarray
    )  # (n,) [N m], bound over all headings for r = 0, see `torque_bound`; with forces the largest of some headings
    least_thrust: (
        np.ndarray
    )  # (n,) [N]; other than the thrust, which is the most, where the forces depend on the heading
    rotor_share: (
        np.ndarray
    )  # (n,) of the range of the rotors about its middle, 1 is all, the largest of some headings; 0 without rotors


def unit_derivatives(jets: np.ndarray, progress: Progress) -> np.ndarray:
    """Return (n, 5, 3): point and its first four derivatives with respect to the progress, from jets (n, 6, 3)."""
    if progress is Progress.PARAMETER:
        return np.asarray(jets[:, : ORDER + 1])
    with np.errstate(all="ignore"):
        rows = [np.array(row).T for row in _by_arc_length()(*(jets[:, k].T for k in range(1, ORDER + 1)))]
    return np.stack([jets[:, 0], *rows], axis=1)


@functools.cache
def _by_arc_length() -> Any:
    """The function of the derivatives of sigma by its parameter -> by arc length: d/ds = (1/|sigma'|) d/dlambda."""
    symbols = [ca.SX.sym(f"derivative_{k}", 3) for k in range(1, ORDER + 1)]
    field = Series.from_derivatives(symbols)
    speed = field.dot(field).sqrt()
    results = []
    for _ in range(ORDER):
        field = field / speed
        results.append(field.coefficients[0])
        field = field.rate()
    return ca.Function("by_arc_length", symbols, ca.cse(results))


def parameter_speed(jets: np.ndarray) -> np.ndarray:
    """Return |sigma'| (n,), metres per unit of the parameter."""
    return np.asarray(np.linalg.norm(jets[:, 1], axis=1))


def curvature(jets: np.ndarray) -> np.ndarray:
    """Return |sigma' x sigma''| / |sigma'|^3 (n,) [1/m]."""
    return np.asarray(np.linalg.norm(np.cross(jets[:, 1], jets[:, 2]), axis=1) / parameter_speed(jets) ** 3)


def demands(vehicle: Vehicle, derivatives: np.ndarray, speed: float | np.ndarray) -> Demands:
    """Return the demands at a speed (a number or (n,)) from derivatives at unit speed (n, 5, 3)."""
    powers = np.asarray(speed)[..., None] ** np.arange(ORDER + 1)
    scaled = derivatives * np.broadcast_to(powers, (len(derivatives), ORDER + 1))[..., None]
    bare, rotors, share = is_bare(vehicle), vehicle.rotors, np.zeros(len(derivatives))
    if rotors is not None or not bare:
        with np.errstate(all="ignore"):
            found = flat(vehicle, scaled)
        share = share if rotors is None else rotor_share(rotors, found)
    if not bare:
        rate, acceleration = (value.max(axis=0) for value in (found.tilt_rate, found.tilt_acceleration))
        torque = np.linalg.norm(found.torque, axis=2).max(axis=0)
        least, most = found.thrust.min(axis=0), found.thrust.max(axis=0)
        return Demands(least / vehicle.mass, most, rate, acceleration, torque, least, share)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        thrust, _, rate, acceleration = predict._thrust(vehicle, tuple(np.moveaxis(scaled, 1, 0)))
        rate, acceleration = (np.where(np.isnan(value), np.inf, value) for value in (rate, acceleration))
        torque = torque_bound(vehicle, rate, acceleration)
    return Demands(thrust / vehicle.mass, thrust, rate, acceleration, torque, thrust, share)


def rotor_share(rotors: Rotors, found: Flat) -> np.ndarray:
    """Return how much of the range of the rotors (n,) the wrenches of a motion use, the largest over its headings.

    Their wrenches fill a zonotope; the share is the factor by which it would have to grow about its middle to hold the one needed.
    """
    columns = rotors.mixer / rotors.units[:, None]
    least, most = rotors.least_thrusts, rotors.most_thrusts
    slabs = normals(columns)
    widths = np.abs(slabs @ columns) @ (most - least) / 2
    wrench = np.concatenate([found.thrust[..., None], found.torque], axis=2) / rotors.units
    with np.errstate(invalid="ignore"):
        shares = np.abs((wrench - columns @ (most + least) / 2) @ slabs.T) / widths
    return np.asarray(np.where(np.isnan(shares), np.inf, shares).max(axis=(0, 2)))


def torque_bound(vehicle: Vehicle, tilt_rate: np.ndarray, tilt_acceleration: np.ndarray) -> np.ndarray:
    """Return the largest |J Omega' + Omega x J Omega + K_r| (n,) [N m] over the heading, for r = r' = 0.

    With J' the first two columns of J, mu their symmetric 2x2 block and j = (J13, J23):
    |J Omega'| <= ||J'|| |(p', q')|,  |Omega x J Omega| <= |(p, q)|^2 sqrt(|j|^2 + ((mu_max - mu_min)/2)^2).
    The bound is the torque itself when J13 = J23 = 0, the block is a multiple of the identity, and K_r = 0.
    """
    inertia = np.asarray(vehicle.inertia)
    moments = np.linalg.eigvalsh(inertia[:2, :2])
    gyroscopic = np.hypot(np.linalg.norm(inertia[:2, 2]), (moments[1] - moments[0]) / 2)
    constant = np.linalg.norm(np.asarray(vehicle.bias_torque))
    torque = np.linalg.norm(inertia[:, :2], 2) * tilt_acceleration + gyroscopic * tilt_rate**2 + constant
    return np.asarray(np.where(np.isnan(torque), np.inf, torque))  # 0 times infinity in free fall


def torque_is_exact(vehicle: Vehicle) -> bool:
    """Return whether `torque_bound` is the torque itself, whatever the heading."""
    inertia = np.asarray(vehicle.inertia)
    block = inertia[:2, :2] - np.eye(2) * inertia[0, 0]
    rest = max(np.abs(block).max(), np.abs(inertia[:2, 2]).max())
    return bool(rest <= 1e-12 * inertia[0, 0] and not np.any(np.asarray(vehicle.bias_torque)))

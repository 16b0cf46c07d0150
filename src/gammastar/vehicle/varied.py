"""A vehicle whose numbers are graphs: one step then serves flights of many vehicles that differ in them."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.vehicle.body import Vehicle
from gammastar.vehicle.inertia import inertia_matrix


class Scales(NamedTuple):
    """Graphs or numbers: true numbers of a vehicle over those it is built with."""

    mass: Any = 1.0  # SX; added mass stays
    inertia: Any = (1.0, 1.0, 1.0)  # SX (3,), one for each body axis: J becomes D J D with D = diag(sqrt(scales))
    force: Any = 1.0  # SX, of all forces but buoyancy


def varied(vehicle: Vehicle, scales: Scales, rate_bandwidth: Any = None) -> Vehicle:
    """Graph: return a vehicle that builds graphs as any other does, with its numbers scaled by graphs, or another rate bandwidth.

    It is for building graphs alone: it has no signature, and nothing about it was checked.
    """
    root = ca.sqrt(ca.DM(scales.inertia) if isinstance(scales.inertia, tuple) else scales.inertia)
    outer = ca.mtimes(root, root.T)
    given = {
        "mass": vehicle.mass * scales.mass,
        "inertia": ca.DM(np.asarray(vehicle.inertia)) * outer,
        "inverse_inertia": ca.DM(np.asarray(vehicle.inverse_inertia)) / outer,
        "force_scale": scales.force,
        "rate_bandwidth": vehicle.rate_bandwidth if rate_bandwidth is None else rate_bandwidth,
    }
    result = copy.copy(vehicle)
    for name in ("signature", *given):
        result.__dict__.pop(name, None)
    result.__dict__.update(given)
    return result


def scaled(
    vehicle: Vehicle, scales: Scales, thrust: float = 1.0, lag: float = 1.0, rate_bandwidth: float | None = None
) -> Vehicle:
    """Return a vehicle with its numbers scaled by numbers, those of its rotors too, or with another rate bandwidth [rad/s]."""
    rotors = vehicle.rotors
    if rotors is not None:
        coefficients, lags = thrust * np.asarray(rotors.thrust_coefficient), lag * np.asarray(rotors.lag)
        rotors = dataclasses.replace(rotors, thrust_coefficient=coefficients, lag=lags.tolist())
    return dataclasses.replace(
        vehicle,
        mass=float(scales.mass) * vehicle.mass,
        inertia=scaled_inertia(vehicle, scales.inertia),
        forces=[force.scaled(float(scales.force)) for force in vehicle.forces],
        rotors=rotors,
        rate_bandwidth=vehicle.rate_bandwidth if rate_bandwidth is None else rate_bandwidth,
    )


def scaled_inertia(vehicle: Vehicle, scales: ArrayLike) -> np.ndarray:
    """Return a vehicle's inertia (3, 3) [kg m^2] by scales, one or (3,) for the body axes, as in `Scales`.

    Raises:
        InputError: No body has it.
    """
    root = np.sqrt(np.broadcast_to(np.asarray(scales, dtype=float), 3))
    return inertia_matrix(np.asarray(vehicle.inertia) * np.outer(root, root))

"""A vehicle whose numbers are graphs: one step then serves flights of many vehicles that differ in them."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.vehicle.body import Vehicle


class Scales(NamedTuple):
    """Graph: true numbers of a vehicle over those it is built with."""

    mass: Any = 1.0  # SX; added mass stays
    inertia: Any = (1.0, 1.0, 1.0)  # SX (3,), one for each body axis: J becomes D J D with D = diag(sqrt(scales))
    force: Any = 1.0  # SX, of all forces but buoyancy


def varied(vehicle: Vehicle, scales: Scales) -> Vehicle:
    """Graph: return a vehicle that builds graphs as any other does, with its numbers scaled by graphs.

    It is for building graphs alone: it has no signature, and nothing about it was checked.
    """
    root = ca.sqrt(ca.DM(scales.inertia) if isinstance(scales.inertia, tuple) else scales.inertia)
    outer = ca.mtimes(root, root.T)
    given = {
        "mass": vehicle.mass * scales.mass,
        "inertia": ca.DM(np.asarray(vehicle.inertia)) * outer,
        "inverse_inertia": ca.DM(np.asarray(vehicle.inverse_inertia)) / outer,
        "force_scale": scales.force,
    }
    result = copy.copy(vehicle)
    for name in ("signature", *given):
        result.__dict__.pop(name, None)
    result.__dict__.update(given)
    return result

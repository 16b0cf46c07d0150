"""Bodies: what flies, what acts on it, and the state it has."""

from gammastar.vehicle.body import CALM, NOTHING, Rates, Unknown, Vehicle
from gammastar.vehicle.forces import Buoyancy, CustomForce, Force, LinearDrag, QuadraticDrag, RotorDrag
from gammastar.vehicle.rotors import Hover, Rotors
from gammastar.vehicle.state import State, StateGraph, join, split
from gammastar.vehicle.varied import Scales, scaled, scaled_inertia, varied

__all__ = [
    "CALM",
    "NOTHING",
    "Buoyancy",
    "CustomForce",
    "Force",
    "Hover",
    "LinearDrag",
    "QuadraticDrag",
    "Rates",
    "RotorDrag",
    "Rotors",
    "Scales",
    "State",
    "StateGraph",
    "Unknown",
    "Vehicle",
    "join",
    "scaled",
    "scaled_inertia",
    "split",
    "varied",
]

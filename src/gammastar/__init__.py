"""gammastar: fly underactuated vehicles along smooth curves exactly, from any attitude."""

from gammastar import errors, so3
from gammastar.flight import INTEGRATORS, FlightRecord, SensorNoise, Status, fly
from gammastar.law import Law, Point, Prediction, Ramp, Speed, Stop, design
from gammastar.path import Curve, ImplicitPath
from gammastar.path import catalogue as paths
from gammastar.vehicle import State, Vehicle

__all__ = [
    "INTEGRATORS",
    "Curve",
    "FlightRecord",
    "ImplicitPath",
    "Law",
    "Point",
    "Prediction",
    "Ramp",
    "SensorNoise",
    "Speed",
    "State",
    "Status",
    "Stop",
    "Vehicle",
    "design",
    "errors",
    "fly",
    "paths",
    "so3",
]
__version__ = "0.1.0"

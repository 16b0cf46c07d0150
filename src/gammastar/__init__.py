"""gammastar: fly underactuated vehicles along smooth curves exactly, from any attitude."""

import typing as _typing

from gammastar import errors, so3
from gammastar.flight import INTEGRATORS, FlightRecord, Replacement, SensorNoise, Status, fly
from gammastar.law import (
    Along,
    Approach,
    Azimuth,
    Law,
    Leg,
    Legs,
    Point,
    Prediction,
    Profile,
    Ramp,
    Speed,
    Stop,
    Towards,
    design,
)
from gammastar.path import Curve, ImplicitPath
from gammastar.path import catalogue as paths
from gammastar.path.waypoints import waypoints
from gammastar.vehicle import State, Vehicle

__all__ = [
    "Along",
    "Approach",
    "Azimuth",
    "Curve",
    "FlightRecord",
    "INTEGRATORS",
    "ImplicitPath",
    "Law",
    "Leg",
    "Legs",
    "Mission",
    "Point",
    "Prediction",
    "Profile",
    "Ramp",
    "Replacement",
    "SensorNoise",
    "Speed",
    "State",
    "Status",
    "Stop",
    "Towards",
    "Vehicle",
    "design",
    "errors",
    "fly",
    "load_mission",
    "paths",
    "so3",
    "waypoints",
]
__version__ = "0.1.0"


def __dir__() -> list[str]:
    """List the public names, those that load on first use included."""
    return [*__all__, "__version__"]


def __getattr__(name: str) -> _typing.Any:
    """Load mission files on first use: reading TOML takes a library that a flight in Python does not need."""
    if name in {"Mission", "load_mission"}:
        from gammastar import mission

        return mission.Mission if name == "Mission" else mission.load
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

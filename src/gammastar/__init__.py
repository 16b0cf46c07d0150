"""gammastar: fly underactuated vehicles along smooth curves exactly, from any attitude."""

import importlib as _importlib
import importlib.util as _util
import typing as _typing
from typing import TYPE_CHECKING as _TYPE_CHECKING

from gammastar.version import VERSION as _VERSION

if _TYPE_CHECKING:
    from gammastar import errors, so3
    from gammastar.campaign.run import Campaign, campaign
    from gammastar.campaign.tune import tune
    from gammastar.certificate import Limits, certify, feasible_profile
    from gammastar.flight import (
        INTEGRATORS,
        Channel,
        FlightRecord,
        Flights,
        Gusts,
        Replacement,
        SensorNoise,
        Sensors,
        Status,
        Wind,
        fly,
        fly_many,
    )
    from gammastar.law import (
        Along,
        Approach,
        Azimuth,
        IntegralAction,
        KalmanFilter,
        Law,
        Leg,
        Legs,
        Observer,
        Point,
        Prediction,
        Profile,
        Ramp,
        Speed,
        Stop,
        Towards,
        design,
    )
    from gammastar.mission import Mission
    from gammastar.mission import load as load_mission
    from gammastar.path import Curve, ImplicitPath
    from gammastar.path import catalogue as paths
    from gammastar.path.formula import curve_from_formula, implicit_from_formula
    from gammastar.path.metres import by_length
    from gammastar.path.placement import placed
    from gammastar.path.table import read_points
    from gammastar.path.waypoints import waypoints
    from gammastar.vehicle import (
        Buoyancy,
        CustomForce,
        LinearDrag,
        QuadraticDrag,
        RotorDrag,
        Rotors,
        State,
        Vehicle,
    )
    from gammastar.vehicle import presets as vehicles

__all__ = [
    "Along",
    "Approach",
    "Azimuth",
    "Buoyancy",
    "Campaign",
    "Channel",
    "Curve",
    "CustomForce",
    "FlightRecord",
    "Flights",
    "Gusts",
    "INTEGRATORS",
    "ImplicitPath",
    "IntegralAction",
    "KalmanFilter",
    "Law",
    "Leg",
    "Legs",
    "Limits",
    "LinearDrag",
    "Mission",
    "Observer",
    "Point",
    "Prediction",
    "Profile",
    "QuadraticDrag",
    "Ramp",
    "Replacement",
    "RotorDrag",
    "Rotors",
    "SensorNoise",
    "Sensors",
    "Speed",
    "State",
    "Status",
    "Stop",
    "Towards",
    "Vehicle",
    "Wind",
    "by_length",
    "campaign",
    "certify",
    "curve_from_formula",
    "design",
    "errors",
    "feasible_profile",
    "fly",
    "fly_many",
    "implicit_from_formula",
    "load_mission",
    "paths",
    "placed",
    "read_points",
    "so3",
    "tune",
    "vehicles",
    "waypoints",
]
__version__ = _VERSION


_ROOMS = {  # room -> the public names that it has
    "campaign.run": ("Campaign",),
    "campaign.tune": ("tune",),
    "certificate": ("Limits", "certify", "feasible_profile"),
    "flight": (
        *("Channel", "FlightRecord", "Flights", "Gusts", "INTEGRATORS", "Replacement", "SensorNoise"),
        *("Sensors", "Status", "Wind", "fly", "fly_many"),
    ),
    "law": (
        *("Along", "Approach", "Azimuth", "IntegralAction", "KalmanFilter", "Law", "Leg", "Legs", "Observer"),
        *("Point", "Prediction", "Profile", "Ramp", "Speed", "Stop", "Towards", "design"),
    ),
    "mission": ("Mission",),
    "path": ("Curve", "ImplicitPath"),
    "path.formula": ("curve_from_formula", "implicit_from_formula"),
    "path.metres": ("by_length",),
    "path.placement": ("placed",),
    "path.table": ("read_points",),
    "path.waypoints": ("waypoints",),
    "vehicle": (
        *("Buoyancy", "CustomForce", "LinearDrag", "QuadraticDrag", "RotorDrag"),
        *("Rotors", "State", "Vehicle"),
    ),
}
_HOMES = {name: (room, name) for room, names in _ROOMS.items() for name in names}
_HOMES["load_mission"] = ("mission", "load")
_ALIASES = {
    "campaign": "campaign",
    "paths": "path.catalogue",
    "vehicles": "vehicle.presets",
}  # public name -> module that it stands for; a campaign is run by calling its room


def __dir__() -> list[str]:
    """List the public names, those that load on first use included."""
    return [*__all__, "__version__"]


def __getattr__(name: str) -> _typing.Any:
    """Load a public name or a room on first use, so that a command can be interrupted while libraries still load."""
    if name in _ALIASES:
        value: _typing.Any = _importlib.import_module(f"gammastar.{_ALIASES[name]}")
    elif name in _HOMES:
        room, own = _HOMES[name]
        value = getattr(_importlib.import_module(f"gammastar.{room}"), own)
    elif not name.startswith("_") and _util.find_spec(f"gammastar.{name}"):
        value = _importlib.import_module(f"gammastar.{name}")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value

"""Vehicles by name: data files with the source beside every number, in the form of a mission's [vehicle] section."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np

from gammastar.errors import UnknownNameError
from gammastar.vehicle.body import Vehicle
from gammastar.vehicle.forces import Buoyancy, Force, LinearDrag, QuadraticDrag, RotorDrag
from gammastar.vehicle.rotors import Rotors

FORCES: dict[str, type[Force]] = {
    "linear_drag": LinearDrag,
    "rotor_drag": RotorDrag,
    "quadratic_drag": QuadraticDrag,
    "buoyancy": Buoyancy,
}
"""Forces that a file can name."""


@dataclass(frozen=True, eq=False)
class Preset:
    """A vehicle with what else is known of it."""

    name: str
    title: str  # one line
    source: str  # of the numbers
    note: str  # what a user has to know, or empty
    vehicle: Vehicle
    limits: Mapping[str, float]  # by the names of a mission's [limits]; empty where none are known
    text: str  # the file, with the source beside every number

    @property
    def most_thrust(self) -> float | None:
        """Return the most thrust [N] without torque, of the rotors or as a limit; None where it is not known."""
        rotors = self.vehicle.rotors
        return self.limits.get("thrust") if rotors is None else rotors.thrust_range[1]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON, units in the keys; what is not known, or has no meaning, is None."""
        vehicle, rotors, most = self.vehicle, self.vehicle.rotors, self.most_thrust
        weight = vehicle.weight
        return {
            "name": self.name,
            "title": self.title,
            "mass_kg": vehicle.mass,
            "inertia_kg_m2": np.diag(np.asarray(vehicle.inertia)).tolist(),
            "rotors": 0 if rotors is None else rotors.count,
            "weight_N": weight,
            "most_thrust_N": most,
            "thrust_to_weight": most / weight if most is not None and weight > 0 else None,
            "hover_throttle": rotors.hover(weight).throttle if rotors is not None and weight > 0 else None,
            "source": self.source,
            "note": self.note,
        }


def names() -> list[str]:
    """Return the names of the vehicles that come with gammastar."""
    return sorted(file.name.removesuffix(".toml") for file in _shelf().iterdir() if file.name.endswith(".toml"))


def load(name: str) -> Vehicle:
    """Return a vehicle by name, such as 'hummingbird'.

    Raises:
        UnknownNameError: No vehicle has this name.
    """
    return preset(name).vehicle


def preset(name: str) -> Preset:
    """Return a vehicle by name with its title, its source and its limits.

    Raises:
        UnknownNameError: No vehicle has this name.
    """
    if not isinstance(name, str) or name not in names():
        raise UnknownNameError("a vehicle", name, names())
    return _read(name)


@functools.cache
def _read(name: str) -> Preset:
    text = (_shelf() / f"{name}.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    return Preset(
        name,
        tables["title"],
        tables["source"],
        tables.get("note", ""),
        _vehicle(tables["vehicle"]),
        tables.get("limits", {}),
        text,
    )


def _vehicle(table: Mapping[str, Any]) -> Vehicle:
    """Return the vehicle of a table: the arguments of `Vehicle`, with those of rotors and forces in tables of their own."""
    arguments = dict(table)
    if "rotors" in table:
        arguments["rotors"] = (Rotors.ring if "count" in table["rotors"] else Rotors)(**table["rotors"])
    arguments["forces"] = [_force(**force) for force in table.get("forces", ())]
    return Vehicle(**arguments)


def _force(kind: str, **arguments: Any) -> Force:
    return FORCES[kind](**arguments)


def _shelf() -> Any:
    return resources.files("gammastar") / "vehicles"

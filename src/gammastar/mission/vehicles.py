"""The [vehicle] section: the arguments of `Vehicle`, alone or over those of a preset.

[vehicle.rotors] has the arguments of `Rotors` or of `Rotors.ring`, [[vehicle.forces]] those of their classes.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator, SerializeAsAny

from gammastar.errors import InputError
from gammastar.mission import turn
from gammastar.mission.complaint import within
from gammastar.mission.tables import plain
from gammastar.mission.values import Array, Construction, Tables, choose, one_of, section_of
from gammastar.vehicle import Force, Rotors, Vehicle, presets

FORCES: dict[str, type[Construction]] = {
    kind: section_of(factory, Construction, kind=kind) for kind, factory in presets.FORCES.items()
}
RotorsSection = section_of(Rotors, Construction, {"lag": Array})
RingSection = section_of(Rotors.ring, Construction, {"lag": Array})
ChangedRotors = section_of(Rotors, Construction, {"lag": Array}, optional=True)


def _force(values: Any) -> Construction:
    return choose(values, "kind", FORCES)


def _rotors(values: Any) -> Construction:
    return _ring(values) or RotorsSection.model_validate(values)


def _changed_rotors(values: Any) -> Construction:
    return _ring(values) or ChangedRotors.model_validate(values)


def _ring(values: Any) -> Construction | None:
    """Return the section of rotors on a circle, if a table asks for them, or one that is made already."""
    if isinstance(values, Construction):
        return values
    is_ring = isinstance(values, Mapping) and {"count", "arm"} & set(values)
    return RingSection.model_validate(values) if is_ring else None


AnyForce = Annotated[SerializeAsAny[Construction], PlainValidator(_force)]
AnyRotors = Annotated[SerializeAsAny[Construction], PlainValidator(_rotors)]
AnyChange = Annotated[SerializeAsAny[Construction], PlainValidator(_changed_rotors)]
Forces = Annotated[list[AnyForce], Tables]


class VehicleArguments(Construction):
    """What `Vehicle` takes."""

    preset: Annotated[str, one_of(presets.names())] | None = None  # what the other keys change

    def vehicle(self, frame: str) -> Vehicle:
        """Return the vehicle, in `ned`."""
        given = self._given()
        arguments = {name: value for name, value in given.items() if name not in ("forces", "rotors")}
        base = None if self.preset is None else turn.vehicle_in_ned(presets.load(self.preset), frame)
        if "forces" in given:
            arguments["forces"] = [self._made(each, f"forces.{k}") for k, each in enumerate(given["forces"])]
        if "rotors" in given:
            arguments["rotors"] = self._made(given["rotors"], "rotors", None if base is None else base.rotors)
        with within("[vehicle]"):
            vehicle = Vehicle(**arguments) if base is None else dataclasses.replace(base, **arguments)
            return turn.vehicle_in_ned(vehicle, frame)

    def limits(self) -> dict[str, float]:
        """Return the limits that the preset comes with."""
        return {} if self.preset is None else dict(presets.preset(self.preset).limits)

    def written(self, frame: str) -> dict[str, Any]:
        """Return the section with every default written out, a preset by its numbers."""
        if self.preset is not None:
            return _table(turn.vehicle_in_ned(self.vehicle(frame), frame))  # the turn is its own inverse
        values = self.model_dump(exclude_none=True)
        return values if values["forces"] else {name: value for name, value in values.items() if name != "forces"}

    def _given(self) -> dict[str, Any]:
        return {name: value for name, value in self.arguments().items() if value is not None}

    @staticmethod
    def _made(section: Construction, place: str, base: Rotors | None = None) -> Force | Rotors:
        """Return what a section makes; what it leaves out is that of the rotors it changes, if there are any."""
        with within(f"[vehicle.{place}]"):
            arguments, factory = section.arguments(), section.factory()
            if isinstance(section, ChangedRotors):
                arguments = {name: value for name, value in arguments.items() if value is not None}
                if base is not None:
                    return dataclasses.replace(base, **arguments)
                _require_all(factory, arguments)
            made: Force | Rotors = factory(**arguments)
            return made


VehicleSection = section_of(Vehicle, VehicleArguments, {"forces": Forces, "rotors": AnyRotors | None})
PresetSection = section_of(Vehicle, VehicleArguments, {"forces": Forces, "rotors": AnyChange}, optional=True)


def vehicle_section(values: Any) -> VehicleArguments:
    """Return the section of a [vehicle] table: complete, or changes of a preset."""
    if isinstance(values, VehicleArguments):
        return values
    over_preset = isinstance(values, Mapping) and "preset" in values
    return (PresetSection if over_preset else VehicleSection).model_validate(values)


def force(section: Construction, place: str) -> Force:
    """Return the force of a section that stands at a place of the mission."""
    with within(place):
        made: Force = section.factory()(**section.arguments())
        return made


def _require_all(factory: Callable[..., Any], arguments: Mapping[str, Any]) -> None:
    """Raise `InputError` for the first argument without a default that is not given."""
    for name, parameter in inspect.signature(factory).parameters.items():
        if parameter.default is parameter.empty and name not in arguments:
            raise InputError(f'must have the key "{name}" (got none, and the preset has no rotors); add it')


def _table(vehicle: Vehicle) -> dict[str, Any]:
    """Return the section that makes a vehicle of built-in forces."""
    values, inertia = _fields(vehicle), np.asarray(vehicle.inertia)
    if np.array_equal(inertia, np.diag(np.diag(inertia))):
        values["inertia"] = np.diag(inertia).tolist()
    values["forces"] = [{"kind": _kind(each)} | _fields(each) for each in vehicle.forces]
    if not vehicle.forces:
        del values["forces"]
    return values if vehicle.rotors is None else values | {"rotors": _fields(vehicle.rotors)}


def _kind(force: Force) -> str:
    return next(kind for kind, factory in presets.FORCES.items() if type(force) is factory)


def _fields(value: Any) -> dict[str, Any]:
    """Return the fields of a frozen dataclass as plain data, without those that are None."""
    fields = {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
    return {name: plain(each) for name, each in fields.items() if each is not None}

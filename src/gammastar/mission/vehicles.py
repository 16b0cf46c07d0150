"""The [vehicle] section: the arguments of `Vehicle`, with [[vehicle.forces]] and [vehicle.rotors] by the arguments of their classes."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import PlainValidator, SerializeAsAny

from gammastar.mission import turn
from gammastar.mission.complaint import within
from gammastar.mission.values import Array, Construction, Tables, choose, section_of
from gammastar.vehicle import Buoyancy, Force, LinearDrag, QuadraticDrag, RotorDrag, Rotors, Vehicle

FORCES: dict[str, type[Construction]] = {
    kind: section_of(factory, Construction, kind=kind)
    for kind, factory in {
        "linear_drag": LinearDrag,
        "rotor_drag": RotorDrag,
        "quadratic_drag": QuadraticDrag,
        "buoyancy": Buoyancy,
    }.items()
}


def _force(values: Any) -> Construction:
    return choose(values, "kind", FORCES)


AnyForce = Annotated[SerializeAsAny[Construction], PlainValidator(_force)]


class VehicleArguments(Construction):
    """What `Vehicle` takes."""

    def vehicle(self, frame: str) -> Vehicle:
        """Return the vehicle, in `ned`."""
        arguments = self.arguments()
        forces: list[Force] = []
        for k, section in enumerate(arguments.pop("forces")):
            with within(f"[vehicle.forces.{k}]"):
                forces.append(section.factory()(**section.arguments()))
        if (section := arguments.pop("rotors")) is not None:
            with within("[vehicle.rotors]"):
                arguments["rotors"] = Rotors(**section.arguments())
        with within("[vehicle]"):
            return turn.vehicle_in_ned(Vehicle(**arguments, forces=forces), frame)


RotorsSection = section_of(Rotors, Construction, {"lag": Array})


def _rotors(values: Any) -> Construction:
    return RotorsSection.model_validate(values)


AnyRotors = Annotated[SerializeAsAny[Construction], PlainValidator(_rotors)]
VehicleSection = section_of(
    Vehicle, VehicleArguments, {"forces": Annotated[list[AnyForce], Tables], "rotors": AnyRotors | None}
)

"""The [reference] section: every reference along a path, by the arguments of its class."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import PlainValidator, SerializeAsAny

from gammastar.certificate import Limits, feasible_profile
from gammastar.errors import InputError
from gammastar.law import Leg, Legs, Point, Profile, Ramp, Speed, Stop
from gammastar.mission.values import Construction, Number, Positive, Tables, choose, default_of, one_of, section_of
from gammastar.path import Path
from gammastar.vehicle import Vehicle

LegSection = section_of(Leg, Construction)


class LegsSection(Construction):
    """A schedule: a list of tables, each with the arguments of `Leg`."""

    kind: Annotated[str, one_of(("legs",))] = "legs"
    legs: Annotated[list[LegSection], Tables]  # type: ignore[valid-type]
    change_time: Positive = default_of(Legs, "change_time")

    @classmethod
    def factory(cls) -> Callable[..., Legs]:
        """Return what makes the schedule of its legs."""
        return lambda legs, change_time: Legs(tuple(Leg(**leg.arguments()) for leg in legs), change_time)


class FeasibleSection(Construction):
    """A speed where the vehicle can fly it, and less where it cannot."""

    kind: Annotated[str, one_of(("feasible",))] = "feasible"
    speed: Number  # [path parameter/s]
    reserve: Number = default_of(feasible_profile, "reserve")  # share of every limit that is kept

    @classmethod
    def factory(cls) -> Callable[..., Profile]:
        """Raise `InputError`: the profile depends on the vehicle, see `profile`."""
        raise InputError(
            'must not be of the kind "feasible" in a replacement (got it there); give a profile or a speed that the vehicle can fly'
        )

    def profile(self, vehicle: Vehicle, path: Path, limits: Limits) -> Profile:
        """Return the profile of a vehicle along a path."""
        return feasible_profile(vehicle, path, self.speed, limits, self.reserve)


REFERENCES: dict[str, type[Construction]] = {
    **{
        kind.__name__.lower(): section_of(kind, Construction, kind=kind.__name__.lower())
        for kind in (Speed, Ramp, Point, Stop, Profile)
    },
    "legs": LegsSection,
    "feasible": FeasibleSection,
}


def reference_section(values: Any) -> Construction:
    """Return the section that a [reference] table asks for."""
    return choose(values, "kind", REFERENCES)


AnyReference = Annotated[SerializeAsAny[Construction], PlainValidator(reference_section)]

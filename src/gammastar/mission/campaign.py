"""The [campaign] section: what varies from flight to flight, and how.

    [[campaign.vary]]
    quantity = "truth.mass_scale"
    kind = "uniform"
    low = 0.9
    high = 1.1

Distributions of numbers, vectors and attitudes are for the quantities in `QUANTITIES`; a list or a grid is for any key of a mission.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import PlainValidator, SerializeAsAny, field_validator

from gammastar.errors import InputError, MissionError, UnknownNameError
from gammastar.mission.complaint import shown, within
from gammastar.mission.distributions import KINDS, Choice, Distribution, Grid
from gammastar.mission.tables import plain
from gammastar.mission.values import Array, Construction, Section, Tables, Text, choose, one_of, section_of

SAMPLINGS = ("random", "sobol")
NUMBER, VECTOR, ATTITUDE, ALONG = (), (3,), (3, 3), (4,)
QUANTITIES: dict[str, tuple[tuple[int, ...], ...]] = {  # and the shapes that values of each may have
    "start.position": (VECTOR, ALONG),  # [m]
    "start.velocity": (VECTOR,),  # [m/s]
    "start.attitude": (ATTITUDE,),
    "start.angular_velocity": (VECTOR,),  # [rad/s], body
    "truth.mass_scale": (NUMBER,),
    "truth.inertia_scale": (NUMBER, VECTOR),
    "truth.thrust_scale": (NUMBER,),
    "truth.force_scale": (NUMBER,),
    "wind.mean": (VECTOR,),  # [m/s]
}
SHAPES = {NUMBER: "numbers", VECTOR: "vectors", ATTITUDE: "attitudes", ALONG: "places along a path"}


def _choices(value: Any, info: Any) -> Any:
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{info.field_name} must be a list (got {shown(value)}); put the values in brackets")
    return tuple(plain(item) for item in value)


class VariedSection(Construction):
    """One quantity with its distribution."""

    quantity: Text

    def distribution(self) -> Distribution:
        """Return the distribution, which fits the quantity."""
        made: Distribution = self.factory()(**self.arguments())
        if isinstance(made, Choice | Grid):
            return made
        if self.quantity not in QUANTITIES:
            raise UnknownNameError("quantity", self.quantity, QUANTITIES)
        if made.shape not in QUANTITIES[self.quantity]:
            allowed = " or ".join(SHAPES[shape] for shape in QUANTITIES[self.quantity])
            raise InputError(
                f"{self.quantity} must vary over {allowed} (got {SHAPES[made.shape]}); choose a kind of distribution that gives them"
            )
        return made


TYPES = {"choices": Annotated[Any, PlainValidator(_choices)], "probabilities": Array | None}
VARIED: dict[str, type[VariedSection]] = {
    kind: section_of(factory, VariedSection, TYPES, kind=kind) for kind, factory in KINDS.items()
}


def _varied(values: Any) -> VariedSection:
    return choose(values, "kind", VARIED)


class CampaignSection(Section):
    """What varies, and how it is sampled."""

    sampling: Annotated[str, one_of(SAMPLINGS)] = "random"
    vary: Annotated[list[Annotated[SerializeAsAny[VariedSection], PlainValidator(_varied)]], Tables]

    @field_validator("vary")
    @classmethod
    def _something(cls, value: list[VariedSection]) -> list[VariedSection]:
        if not value:
            raise InputError("vary must be a list of tables (got none in it); add [[campaign.vary]]")
        return value

    def distributions(self) -> Mapping[str, Distribution]:
        """Return the distribution of every quantity.

        Raises:
            MissionError: A quantity varies twice.
        """
        result = dict[str, Distribution]()
        for k, section in enumerate(self.vary):
            if section.quantity in result:
                raise MissionError(
                    f"a quantity must vary once (got {section.quantity} twice); leave one of them out",
                    f"campaign.vary.{k}.quantity",
                )
            with within(f"[campaign.vary.{k}]"):
                result[section.quantity] = section.distribution()
        return result

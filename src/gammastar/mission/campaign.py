"""The [campaign] section: what varies from flight to flight, and how.

    [[campaign.vary]]
    quantity = "truth.mass_scale"
    kind = "uniform"
    low = 0.9
    high = 1.1

Distributions of numbers, vectors and attitudes are for the quantities in `QUANTITIES` and the numbers of [path], which are data for the
one program that flies the mission; a list or a grid is for any key of a mission.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto
from typing import Annotated, Any, NamedTuple

from pydantic import PlainValidator, SerializeAsAny, field_validator

from gammastar.errors import InputError, MissionError, UnknownNameError
from gammastar.law.design import CHAINS
from gammastar.mission.attitudes import About, AnyAttitude, Tilted
from gammastar.mission.changes import PATH, POLES
from gammastar.mission.choices import Choice, Grid
from gammastar.mission.complaint import shown, within
from gammastar.mission.distributions import AlongPath, Ball, Distribution, LogUniform, Normal, Uniform
from gammastar.mission.paths import PathSection
from gammastar.mission.tables import plain
from gammastar.mission.values import Array, Construction, Count, Section, Tables, Text, choose, one_of, section_of

ATTITUDES = ("start.attitude", "start.quaternion", "start.roll", "start.pitch", "start.yaw")
SAMPLINGS = ("random", "sobol")
KINDS: dict[str, type[Any]] = {
    "uniform": Uniform,
    "box": Uniform,
    "log-uniform": LogUniform,
    "normal": Normal,
    "ball": Ball,
    "along": AlongPath,
    "any": AnyAttitude,
    "tilted": Tilted,
    "about": About,
    "list": Choice,
    "grid": Grid,
}
OWN = ("campaign", "flight.seed", "flight.number")  # what a campaign has, or gives each flight
MOST_QUANTITIES = 200  # far more than a mission has keys
NUMBER, VECTOR, ATTITUDE, ALONG = (), (3,), (3, 3), (4,)
SHAPES = {NUMBER: "numbers", VECTOR: "vectors", ATTITUDE: "attitudes", ALONG: "places along a path"}


class Way(Enum):
    """How a flight gets its own value of a quantity, in one program with the others."""

    START = auto()  # where it begins
    TRUTH = auto()  # a number of what really flies, `varied` of `fly_many`
    LAW = auto()  # a law of its own
    SPEED = auto()  # a reference of its own
    LATENCY = auto()  # by a program for each number of control intervals


class Quantity(NamedTuple):
    """What may vary from flight to flight in one program."""

    way: Way
    shapes: tuple[tuple[int, ...], ...] = (NUMBER,)  # that values may have
    unit: str = ""
    parameter: str = ""  # of the way `TRUTH`: its name in `varied`
    neutral: Any = None  # and the mission's value beside it, where the two add up or multiply; None where it takes the mission's place
    zero_is_apart: bool = False  # whether flights of zero are of another program


QUANTITIES: dict[str, Quantity] = {
    "start.position": Quantity(Way.START, (VECTOR, ALONG), "m"),
    "start.velocity": Quantity(Way.START, (VECTOR,), "m/s"),
    "start.attitude": Quantity(Way.START, (ATTITUDE,)),
    "start.angular_velocity": Quantity(Way.START, (VECTOR,), "rad/s"),
    "truth.mass_scale": Quantity(Way.TRUTH, parameter="mass_scale", neutral=1.0),
    "truth.inertia_scale": Quantity(Way.TRUTH, (NUMBER, VECTOR), parameter="inertia_scale", neutral=1.0),
    "truth.thrust_scale": Quantity(Way.TRUTH, parameter="thrust_scale", neutral=1.0),
    "truth.lag_scale": Quantity(Way.TRUTH, parameter="lag_scale", neutral=1.0),
    "truth.force_scale": Quantity(Way.TRUTH, parameter="force_scale", neutral=1.0),
    "truth.noise_scale": Quantity(Way.TRUTH, parameter="noise_scale", neutral=1.0),
    "truth.latency": Quantity(Way.LATENCY, unit="s"),
    "truth.rate_bandwidth": Quantity(Way.TRUTH, unit="rad/s", parameter="rate_bandwidth"),
    "wind.mean": Quantity(Way.TRUTH, (VECTOR,), "m/s", "wind", (0.0, 0.0, 0.0)),
    POLES: Quantity(Way.LAW, unit="1/s"),
    **{f"{POLES}.{chain}": Quantity(Way.LAW, unit="1/s") for chain in CHAINS},
    "approach.speed": Quantity(Way.LAW, unit="m/s"),
    "observer.force": Quantity(Way.LAW, unit="rad/s", zero_is_apart=True),
    "observer.torque": Quantity(Way.LAW, unit="rad/s", zero_is_apart=True),
    "reference.speed": Quantity(Way.SPEED, zero_is_apart=True),
}


OF_PATH = Quantity(Way.LAW, (NUMBER, VECTOR))


def quantities_of(path: PathSection) -> dict[str, Quantity]:
    """Return what may vary in one program of a mission with a path, by key."""
    return QUANTITIES | {f"{PATH}.{key}": OF_PATH._replace(shapes=(shape,)) for key, shape in path.numbers().items()}


def quantity(name: str) -> Quantity:
    """Return one of them, of any mission."""
    return OF_PATH if name.startswith(f"{PATH}.") else QUANTITIES[name]


def _choices(value: Any, info: Any) -> Any:
    if value is None:
        return None
    if not isinstance(value, (list, tuple)):
        raise InputError(f"{info.field_name} must be a list (got {shown(value)}); put the values in brackets")
    return tuple(plain(item) for item in value)


def _say_the_same(first: str, second: str) -> bool:
    """Return whether a quantity lies within another one, or is another form of the attitude."""
    outer, inner = sorted((first, second), key=len)
    return inner.startswith(f"{outer}.") or (ATTITUDES[0] in (first, second) and {first, second} <= set(ATTITUDES))


class VariedSection(Construction):
    """One quantity with its distribution."""

    quantity: Text

    def distribution(self, known: Mapping[str, Quantity]) -> Distribution:
        """Return the distribution, which fits the quantity, one of those known if it is no list and no grid."""
        made: Distribution = self.factory()(**self.arguments())
        if isinstance(made, Choice | Grid):
            return made
        if self.quantity not in known:
            raise UnknownNameError("quantity that is no list and no grid", self.quantity, known)
        if made.shape not in (shapes := known[self.quantity].shapes):
            allowed = " or ".join(SHAPES[shape] for shape in shapes)
            raise InputError(
                f"{self.quantity} must vary over {allowed} (got {SHAPES[made.shape]}); choose a kind of distribution that gives them"
            )
        return made


TYPES = {"choices": Annotated[Any, PlainValidator(_choices)], "probabilities": Array | None, "count": Count | None}
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
        if len(value) > MOST_QUANTITIES:
            raise InputError(f"vary must be at most {MOST_QUANTITIES} tables (got {len(value)}); leave some out")
        return value

    def distributions(self, known: Mapping[str, Quantity]) -> Mapping[str, Distribution]:
        """Return the distribution of every quantity, which may be one of those known; see `quantities_of`.

        Raises:
            MissionError: A quantity varies twice, or by another one that says the same, or is the campaign's own.
        """
        result = dict[str, Distribution]()
        for k, section in enumerate(self.vary):
            if section.quantity in result:
                raise MissionError(
                    f"a quantity must vary once (got {section.quantity} twice); leave one of them out",
                    f"campaign.vary.{k}.quantity",
                )
            if section.quantity in OWN or section.quantity.startswith("campaign."):
                raise MissionError(
                    f"a quantity must not be what the campaign sets itself (got {section.quantity}); leave it out",
                    f"campaign.vary.{k}.quantity",
                )
            for other in result:
                if _say_the_same(other, section.quantity):
                    raise MissionError(
                        f"quantities must not say the same twice (got {other} and {section.quantity}); leave one of them out",
                        f"campaign.vary.{k}.quantity",
                    )
            with within(f"[campaign.vary.{k}]"):
                result[section.quantity] = section.distribution(known)
        return result

"""The sections of a mission file, and what each of them builds; numbers are in the mission's frame, `turn` takes them to `ned`.

[heading], [approach] and [limits] take the arguments of their classes: their signatures are the format, and nothing is listed twice.
For [vehicle], [path], [reference] and [[replacements]] see `vehicles`, `paths`, `references` and `replacements`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import casadi as ca
import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    PlainValidator,
    SerializeAsAny,
    ValidationInfo,
    field_validator,
    model_validator,
)

from gammastar import checks, so3
from gammastar.certificate import Limits
from gammastar.errors import InputError
from gammastar.export.program import REALS
from gammastar.flight import INTEGRATORS, fly
from gammastar.flight.loop import FEEDBACKS
from gammastar.frames import FRAMES
from gammastar.law import Along, Approach, Azimuth, Towards, design
from gammastar.law.design import CHAINS, INTERFACES
from gammastar.mission import orientation
from gammastar.mission.autopilot import FilterSection, IntegralSection, ObserverSection
from gammastar.mission.campaign import CampaignSection
from gammastar.mission.complaint import SectionError, UnknownKeyError, shown
from gammastar.mission.paths import AnyPath
from gammastar.mission.references import AnyReference
from gammastar.mission.replacements import ReplacementSection
from gammastar.mission.surroundings import SensorsSection, WindSection
from gammastar.mission.truth import NoiseSection, TruthSection
from gammastar.mission.values import (
    Array,
    Construction,
    Count,
    Number,
    Positive,
    Section,
    Tables,
    Text,
    Vector,
    choose,
    default_of,
    nested,
    one_of,
    section_of,
)
from gammastar.mission.vehicles import VehicleArguments, vehicle_section

HEADINGS: dict[str, type[Construction]] = {
    kind.__name__.lower(): section_of(kind, Construction, kind=kind.__name__.lower())
    for kind in (Along, Azimuth, Towards)
}
ApproachSection = section_of(Approach, Construction)
LimitsSection = section_of(Limits, Construction)


def body_rate(yaw_rate: Any) -> Any:
    """Graph: beta(r) = r."""
    return yaw_rate


COMPILED = "c"  # the interface of a law that flies as the C that `gammastar export` writes
LONGEST_TITLE = 200  # characters
YAW_OUTPUTS: dict[str, Callable[[Any], Any]] = {"r": body_rate, "sinh": ca.sinh, "asinh": ca.asinh}
"""Smooth beta(r) of Eq. (14), all odd: where another frame turns the third axis round, their sign turns and nothing else."""


def _poles(value: Any, info: ValidationInfo) -> Any:
    """Return poles as written: a number, a list, or a table of chains; in a list [re, im] is a complex pole."""
    if not isinstance(value, Mapping):
        return nested(value, info, depth=2)
    for chain in value:
        if chain not in CHAINS:
            raise UnknownKeyError(chain, CHAINS)
    return {chain: nested(poles, info, depth=2) for chain, poles in value.items()}


class ControllerSection(Section):
    """How the law is designed and how often it runs."""

    poles: Annotated[Any, PlainValidator(_poles)] = default_of(design, "poles")  # [1/s]
    yaw_output: Annotated[str, one_of(YAW_OUTPUTS)] = "r"
    yaw_reference: Number = default_of(fly, "yaw_reference")  # of beta(r), r about the third body axis
    feedback: Annotated[str, one_of(FEEDBACKS)] | None = default_of(fly, "feedback")
    rate: Positive | None = None  # [Hz]
    interface: Annotated[str, one_of((*INTERFACES, COMPILED))] = default_of(design, "interface")
    real: Annotated[str, one_of(REALS)] | None = None  # of the numbers of compiled C

    @model_validator(mode="after")
    def _real_of_c(self) -> ControllerSection:
        if self.real is not None and self.interface != COMPILED:
            raise SectionError(
                f'must have interface = "{COMPILED}" where real is given (got interface = "{self.interface}"); leave real out'
            )
        return self

    @property
    def commands(self) -> str:
        """Return the interface of the law: a compiled one commands what a law with a wrench does."""
        return "wrench" if self.interface == COMPILED else self.interface

    def design_poles(self) -> Any:
        """Return the poles as `design` takes them."""
        if isinstance(self.poles, Mapping):
            return {chain: _as_complex(poles) for chain, poles in self.poles.items()}
        return _as_complex(self.poles)


class StartSection(Section):
    """Where the flight begins; the attitude is a matrix, a quaternion, or roll, pitch and yaw, body to world."""

    position: Vector  # (3,) [m]
    velocity: Vector = (0.0, 0.0, 0.0)  # (3,) [m/s]
    attitude: Array | None = None  # (3, 3)
    quaternion: Array | None = None  # (4,): w, x, y, z
    roll: Number | None = None  # [deg], applied first
    pitch: Number | None = None  # [deg]
    yaw: Number | None = None  # [deg], applied last
    angular_velocity: Vector = (0.0, 0.0, 0.0)  # (3,) [rad/s], body
    thrust: Number | None = None  # [N], the weight when left out
    thrust_rate: Number = 0.0  # [N/s]

    @model_validator(mode="after")
    def _one_attitude(self) -> StartSection:
        given = [key for key in ("attitude", "quaternion") if getattr(self, key) is not None]
        angles = [key for key in ("roll", "pitch", "yaw") if getattr(self, key) is not None]
        forms = [*given, *angles[:1]]
        if len(forms) > 1:
            raise SectionError(f"must give the attitude once (got {' and '.join(forms)}); keep one of them")
        return self

    def rotation(self) -> tuple[Any, float]:
        """Return the attitude (3, 3) as given, and how far a quaternion's length was from one."""
        if self.quaternion is not None:
            quaternion = checks.array(self.quaternion, "quaternion (w, x, y, z)", (4,))
            return so3.from_quaternion(quaternion), abs(float(np.linalg.norm(quaternion)) - 1)
        if self.attitude is not None:
            return checks.array(self.attitude, "attitude", (3, 3)), 0.0
        return orientation.from_angles(self.roll or 0.0, self.pitch or 0.0, self.yaw or 0.0), 0.0


class FlightSection(Section):
    """How long and how finely the flight is computed."""

    duration: Positive = default_of(fly, "duration")  # [s]
    step: Positive = default_of(fly, "step")  # [s], the longest
    integrator: Annotated[str, one_of(INTEGRATORS)] = default_of(fly, "integrator")
    seed: Count = default_of(fly, "seed")  # of the noise
    number: Count = default_of(fly, "flight")  # among the flights of the seed
    settled_within: Positive = default_of(fly, "settled_within")  # [m] of the path


def _title(value: str) -> str:
    """Return a title as it is, if it fits into lists, the heads of files, and figures."""
    if not value.isprintable() or len(value) > LONGEST_TITLE:
        raise InputError(
            f"title must be one printable line of at most {LONGEST_TITLE} characters (got {shown(value)}); shorten it, and "
            "leave out line ends and control characters"
        )
    return value


class MissionFile(Section):
    """A mission as it is written: every section, checked for structure and types."""

    title: Annotated[Text, AfterValidator(_title)] = ""
    frame: Annotated[str, one_of(FRAMES)] = "ned"
    vehicle: SerializeAsAny[VehicleArguments]
    path: AnyPath
    controller: ControllerSection = Field(default_factory=ControllerSection)
    approach: SerializeAsAny[Construction] | None = None
    reference: AnyReference
    replacements: Annotated[list[ReplacementSection], Tables] = Field(default_factory=list)
    heading: SerializeAsAny[Construction] | None = None
    start: StartSection
    truth: TruthSection = Field(default_factory=TruthSection)
    observer: ObserverSection | None = None
    integral: IntegralSection | None = None
    filter: FilterSection | None = None
    noise: NoiseSection | None = None
    sensors: SensorsSection | None = None
    wind: WindSection | None = None
    limits: SerializeAsAny[Construction] = Field(default_factory=LimitsSection)
    flight: FlightSection = Field(default_factory=FlightSection)
    campaign: CampaignSection | None = None

    @field_validator("vehicle", mode="wrap")
    @classmethod
    def _vehicle(cls, value: Any, handler: Any) -> VehicleArguments:
        return vehicle_section(value)

    @field_validator("approach", mode="wrap")
    @classmethod
    def _approach(cls, value: Any, handler: Any) -> Construction:
        return ApproachSection.model_validate(value)

    @field_validator("heading", mode="wrap")
    @classmethod
    def _heading(cls, value: Any, handler: Any) -> Construction:
        return choose(value, "kind", HEADINGS)

    @field_validator("limits", mode="wrap")
    @classmethod
    def _limits(cls, value: Any, handler: Any) -> Construction:
        return LimitsSection.model_validate(value)


def _as_complex(poles: Any) -> Any:
    """Return poles with every pair [re, im] as one complex number."""
    if not isinstance(poles, tuple):
        return poles
    for pole in poles:
        if isinstance(pole, tuple) and len(pole) != 2:
            raise InputError(f"a complex pole must be a pair [re, im] (got {shown(list(pole))}); give two numbers")
    return [complex(*pole) if isinstance(pole, tuple) else pole for pole in poles]

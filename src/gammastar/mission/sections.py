"""The sections of a mission file, and what each of them builds; numbers are in the mission's frame, `turn` takes them to `ned`.

[vehicle] takes the arguments of `Vehicle`, [path] those of its factory in `paths`, [reference] those of its class: their signatures
are the format, and nothing is listed twice.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import casadi as ca
import numpy as np
from pydantic import Field, PlainValidator, SerializeAsAny, ValidationInfo, field_validator, model_validator

from gammastar import checks, so3
from gammastar.certificate import Limits
from gammastar.errors import InputError
from gammastar.flight import INTEGRATORS, SensorNoise, fly
from gammastar.flight.loop import FEEDBACKS
from gammastar.flight.sensors import density_preserving
from gammastar.frames import FRAMES
from gammastar.law import Leg, Legs, Point, Ramp, Speed, Stop, design
from gammastar.law.design import CHAINS
from gammastar.mission.complaint import SectionError, UnknownKeyError, shown, within
from gammastar.mission.values import (
    Array,
    Construction,
    Count,
    Number,
    Positive,
    Section,
    Text,
    Vector,
    choose,
    default_of,
    nested,
    one_of,
    section_of,
)
from gammastar.path import catalogue
from gammastar.vehicle import Vehicle

PATHS = {
    factory.__name__: section_of(factory, name=factory.__name__)
    for factory in (
        catalogue.circle,
        catalogue.ellipse,
        catalogue.line,
        catalogue.helix,
        catalogue.loop,
        catalogue.nonplanar_circle,
    )
}
LegSection = section_of(Leg)


class LegsSection(Construction):
    """A schedule: a list of tables, each with the arguments of `Leg`."""

    kind: Annotated[str, one_of(("legs",))] = "legs"
    legs: list[LegSection]  # type: ignore[valid-type]
    change_time: Positive = default_of(Legs, "change_time")

    @classmethod
    def factory(cls) -> Callable[..., Legs]:
        """Return what makes the schedule of its legs."""
        return lambda legs, change_time: Legs(tuple(Leg(**leg.arguments()) for leg in legs), change_time)


REFERENCES: dict[str, type[Construction]] = {
    **{kind.__name__.lower(): section_of(kind, kind=kind.__name__.lower()) for kind in (Speed, Ramp, Point, Stop)},
    "legs": LegsSection,
}
VehicleSection = section_of(Vehicle)
LimitsSection = section_of(Limits)


def body_rate(yaw_rate: Any) -> Any:
    """Graph: beta(r) = r."""
    return yaw_rate


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
    feedback: Annotated[str, one_of(FEEDBACKS)] = default_of(fly, "feedback")
    rate: Positive | None = None  # [Hz]

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
        yaw, pitch, roll = (angle or 0.0 for angle in (self.yaw, self.pitch, self.roll))
        return so3.yaw(yaw) @ so3.pitch(pitch) @ so3.roll(roll), 0.0


class TruthSection(Section):
    """How the vehicle that flies differs from the one that the law believes in."""

    mass_scale: Positive = 1.0  # true mass over believed mass
    inertia_scale: Array = 1.0  # true over believed, one number or one for each body axis

    def vehicle(self, believed: Vehicle) -> Vehicle:
        """Return the vehicle that flies, or the believed one itself when nothing differs.

        Scales s of the body axes turn J into D J D with D = diag(sqrt(s)): moments are scaled, products stay consistent.
        """
        scale = np.broadcast_to(self.inertia_scale, 3) if np.ndim(self.inertia_scale) == 0 else self.inertia_scale
        scales = checks.array(scale, "inertia_scale", (3,))
        if np.any(scales <= 0):
            raise InputError(
                f"inertia_scale must be positive (got {scales.tolist()}); 1 leaves the inertia as believed"
            )
        if self.mass_scale == 1 and np.all(scales == 1):
            return believed
        root = np.sqrt(scales)
        inertia = np.asarray(believed.inertia) * np.outer(root, root)
        return dataclasses.replace(believed, mass=believed.mass * self.mass_scale, inertia=inertia)


class ChannelSection(Section):
    """The noise of one sensor."""

    deviation: Array  # standard deviation, one number or one for each axis
    rate: Array  # [Hz] at which the sensor gives independent samples of it, one number or one for each axis

    def at(self, control_rate: float) -> list[float]:
        """Return the deviations (3,) at the control rate that have the same power spectral density."""
        deviations, rates = (
            checks.array(np.broadcast_to(value, 3) if np.ndim(value) == 0 else value, name, (3,))
            for name, value in (("deviation", self.deviation), ("rate [Hz]", self.rate))
        )
        return [density_preserving(s, f, control_rate) for s, f in zip(deviations, rates, strict=True)]


class NoiseSection(Section):
    """Sensor noise by channel: position [m] and velocity [m/s] in world axes, attitude [rad] and body rates [rad/s] in body axes."""

    position: ChannelSection | None = None
    velocity: ChannelSection | None = None
    attitude: ChannelSection | None = None
    angular_velocity: ChannelSection | None = None

    def at(self, control_rate: float) -> SensorNoise:
        """Return the noise per control interval."""
        channels = {name: getattr(self, name) for name in type(self).model_fields}
        noise = {}
        for name, channel in channels.items():
            if channel is not None:
                with within(f"[noise.{name}]"):
                    noise[name] = channel.at(control_rate)
        return SensorNoise(**noise)


class FlightSection(Section):
    """How long and how finely the flight is computed."""

    duration: Positive = default_of(fly, "duration")  # [s]
    step: Positive = default_of(fly, "step")  # [s], the longest
    integrator: Annotated[str, one_of(INTEGRATORS)] = default_of(fly, "integrator")
    seed: Count = default_of(fly, "seed")  # of the noise
    settled_within: Positive = default_of(fly, "settled_within")  # [m] of the path


class MissionFile(Section):
    """A mission as it is written: every section, checked for structure and types."""

    title: Text = ""
    frame: Annotated[str, one_of(FRAMES)] = "ned"
    vehicle: SerializeAsAny[Construction]
    path: SerializeAsAny[Construction]
    controller: ControllerSection = Field(default_factory=ControllerSection)
    reference: SerializeAsAny[Construction]
    start: StartSection
    truth: TruthSection = Field(default_factory=TruthSection)
    noise: NoiseSection | None = None
    limits: SerializeAsAny[Construction] = Field(default_factory=LimitsSection)
    flight: FlightSection = Field(default_factory=FlightSection)

    @field_validator("vehicle", mode="wrap")
    @classmethod
    def _vehicle(cls, value: Any, handler: Any) -> Construction:
        return VehicleSection.model_validate(value)

    @field_validator("path", mode="wrap")
    @classmethod
    def _path(cls, value: Any, handler: Any) -> Construction:
        return choose(value, "name", PATHS)

    @field_validator("limits", mode="wrap")
    @classmethod
    def _limits(cls, value: Any, handler: Any) -> Construction:
        return LimitsSection.model_validate(value)

    @field_validator("reference", mode="wrap")
    @classmethod
    def _reference(cls, value: Any, handler: Any) -> Construction:
        return choose(value, "kind", REFERENCES)


def _as_complex(poles: Any) -> Any:
    """Return poles with every pair [re, im] as one complex number."""
    if not isinstance(poles, tuple):
        return poles
    for pole in poles:
        if isinstance(pole, tuple) and len(pole) != 2:
            raise InputError(f"a complex pole must be a pair [re, im] (got {shown(list(pole))}); give two numbers")
    return [complex(*pole) if isinstance(pole, tuple) else pole for pole in poles]

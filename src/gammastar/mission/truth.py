"""The sections of what the law does not know: the vehicle that really flies, and the noise on what is measured."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

import numpy as np

from gammastar import checks
from gammastar.errors import InputError
from gammastar.flight import SensorNoise
from gammastar.flight.noise import density_preserving
from gammastar.frames import convert_vector
from gammastar.mission.complaint import within
from gammastar.mission.values import Array, NotNegative, Number, Positive, Section, Tables, Vector
from gammastar.mission.vehicles import AnyForce, force
from gammastar.vehicle import Rotors, Vehicle, scaled_inertia


class TruthSection(Section):
    """How the vehicle that flies differs from the one that the law believes in; what is left out is as believed."""

    mass_scale: Positive = 1.0  # true mass over believed mass
    inertia_scale: Array = 1.0  # true over believed, one number or one for each body axis
    thrust_scale: Array = 1.0  # true over believed thrust coefficient of the rotors, one number or one a rotor
    force_scale: Positive = 1.0  # true over believed forces, all but buoyancy; of those in [truth] too
    lag_scale: Positive = 1.0  # true over believed lag of the rotors
    noise_scale: NotNegative = (
        1.0  # true over stated standard deviations in [noise] and [sensors]; biases stay, and what [filter] believes
    )
    center_of_mass: Vector = (
        0.0,
        0.0,
        0.0,
    )  # [m] of the true centre of mass from the believed one, body axes; needs rotors
    latency: Number | None = None  # [s]
    rate_bandwidth: Positive | None = None  # [rad/s]
    bias_acceleration: Vector | None = None  # [m/s^2], world, subtracted: a steady force over the mass
    bias_torque: Vector | None = None  # [N m], body, subtracted
    forces: Annotated[list[AnyForce], Tables] | None = None  # in place of the believed ones

    def vehicle(self, believed: Vehicle, frame: str) -> Vehicle:
        """Return the vehicle that flies, in `ned`, or the believed one itself when nothing differs.

        Scales s of the body axes turn J into D J D with D = diag(sqrt(s)): moments are scaled, products stay consistent.
        """
        if not self.model_dump(exclude_defaults=True, exclude={"noise_scale"}):
            return believed
        changed: dict[str, Any] = {
            "mass": believed.mass * self.mass_scale,
            "inertia": scaled_inertia(believed, _positive(self.inertia_scale, "inertia_scale")),
            "rotors": self._rotors(believed.rotors, frame),
        }
        given = {name: getattr(self, name) for name in ("latency", "rate_bandwidth")}
        for name in ("bias_acceleration", "bias_torque"):
            value = getattr(self, name)
            given[name] = None if value is None else convert_vector(value, frame)
        forces = believed.forces
        if self.forces is not None:
            forces = [force(each, f"[truth.forces.{k}]") for k, each in enumerate(self.forces)]
        given["forces"] = [each.scaled(self.force_scale) for each in forces] if self.force_scale != 1 else forces
        return dataclasses.replace(
            believed, **changed, **{name: value for name, value in given.items() if value is not None}
        )

    def _rotors(self, believed: Rotors | None, frame: str) -> Rotors | None:
        """Return the true rotors: the centre of mass moves away from under them."""
        if believed is None:
            if (
                np.any(np.asarray(self.center_of_mass))
                or self.lag_scale != 1
                or np.any(np.asarray(self.thrust_scale) != 1)
            ):
                raise InputError(
                    "center_of_mass, thrust_scale and lag_scale need a vehicle with rotors (got one without); add [vehicle.rotors]"
                )
            return None
        offset = np.asarray(convert_vector(self.center_of_mass, frame))
        given = self.thrust_scale
        scale = np.repeat(given, believed.count) if checks.shape_of(given) == () else given
        scale = checks.array(scale, "thrust_scale", (believed.count,))
        return dataclasses.replace(
            believed,
            positions=np.asarray(believed.positions) - offset,
            thrust_coefficient=np.asarray(believed.thrust_coefficient) * scale,
            lag=tuple(self.lag_scale * lag for lag in np.asarray(believed.lag)),
        )


def _positive(scale: Any, name: str) -> np.ndarray:
    """Return three positive scales."""
    scales = checks.three(scale, name)
    if np.any(scales <= 0):
        raise InputError(f"{name} must be positive (got {scales.tolist()}); 1 leaves what is believed")
    return scales


class ChannelSection(Section):
    """The noise of one sensor."""

    deviation: Array  # standard deviation, one number or one for each axis
    rate: Array  # [Hz] at which the sensor gives independent samples of it, one number or one for each axis

    def at(self, control_rate: float) -> list[float]:
        """Return the deviations (3,) at the control rate that have the same power spectral density."""
        deviations, rates = checks.three(self.deviation, "deviation"), checks.three(self.rate, "rate [Hz]")
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

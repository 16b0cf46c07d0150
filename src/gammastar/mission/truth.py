"""The sections of what the law does not know: the vehicle that really flies, and the noise on what is measured."""

from __future__ import annotations

import dataclasses

import numpy as np

from gammastar import checks
from gammastar.errors import InputError
from gammastar.flight import SensorNoise
from gammastar.flight.sensors import density_preserving
from gammastar.mission.complaint import within
from gammastar.mission.values import Array, Positive, Section
from gammastar.vehicle import Vehicle


class TruthSection(Section):
    """How the vehicle that flies differs from the one that the law believes in."""

    mass_scale: Positive = 1.0  # true mass over believed mass
    inertia_scale: Array = 1.0  # true over believed, one number or one for each body axis

    def vehicle(self, believed: Vehicle) -> Vehicle:
        """Return the vehicle that flies, or the believed one itself when nothing differs.

        Scales s of the body axes turn J into D J D with D = diag(sqrt(s)): moments are scaled, products stay consistent.
        """
        scales = checks.three(self.inertia_scale, "inertia_scale")
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

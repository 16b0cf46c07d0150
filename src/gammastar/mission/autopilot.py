"""The sections of what runs on the vehicle's computer beside the law: [observer] or [integral], and [filter]."""

from __future__ import annotations

from typing import Any

import numpy as np

from gammastar.flight import Sensors
from gammastar.law import IntegralAction, KalmanFilter, Observer
from gammastar.mission.values import Number, Positive, Section, default_of

EXACT = 1e-6  # deviation that a filter takes for a sensor without noise


class ObserverSection(Section):
    """Bandwidths of the observers of the unknown force and torque; 0 leaves one out."""

    force: Number = default_of(Observer, "force")  # [rad/s]
    torque: Number = default_of(Observer, "torque")  # [rad/s]

    def rejection(self) -> Observer:
        """Return the observers."""
        return Observer(self.force or None, self.torque or None)


class IntegralSection(Section):
    """The pole of the integral of the error across the path."""

    pole: Positive  # [rad/s]
    largest: Positive = default_of(IntegralAction, "largest")  # [m/s^2]

    def rejection(self, chain: Any) -> IntegralAction:
        """Return the integral beside the poles of the law's transverse chain."""
        return IntegralAction(self.pole, chain, self.largest)


class FilterSection(Section):
    """What the model does not know; deviations of the samples are those of [sensors]."""

    acceleration_density: Positive = default_of(KalmanFilter, "acceleration_density")  # [m^2/s^3]
    angular_density: Positive = default_of(KalmanFilter, "angular_density")  # [rad^2/s^3]

    def estimator(self, sensors: Sensors | None, gravity: float) -> KalmanFilter:
        """Return the filter of some sensors, for a vehicle in a gravity [m/s^2]."""
        channels = (sensors or Sensors()).channels
        deviations = [np.maximum(np.asarray(channel.deviation), EXACT) for channel in channels]
        position, velocity, attitude, rates = deviations
        densities = self.acceleration_density, self.angular_density
        return KalmanFilter(position, velocity, attitude, rates, *densities, gravity)

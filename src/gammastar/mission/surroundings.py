"""The sections of what surrounds the vehicle: [sensors] and [wind]."""

from __future__ import annotations

import numpy as np

from gammastar.checks import three
from gammastar.flight import Channel, Gusts, Sensors, Wind
from gammastar.frames import convert_vector
from gammastar.mission.complaint import within
from gammastar.mission.values import Array, Number, Section, Vector, default_of


class SensorSection(Section):
    """One sensor; errors of position and velocity in the axes of the mission's frame, those of attitude and body rates in body axes."""

    deviation: Array = default_of(Channel, "deviation")  # of one sample, one number or one for each axis
    rate: Array | None = default_of(
        Channel, "rate"
    )  # [Hz], one number or one for each axis; every control interval when left out
    bias: Array = default_of(Channel, "bias")  # one number or one for each axis
    delay: Number = default_of(Channel, "delay")  # [s]
    dropout: Number = default_of(Channel, "dropout")  # probability that a sample is lost

    def channel(self, frame: str) -> Channel:
        """Return the sensor, in `ned`."""
        bias = convert_vector(three(self.bias, "bias of a sensor"), frame)
        return Channel(self.deviation, self.rate, np.asarray(bias), self.delay, self.dropout)


class SensorsSection(Section):
    """Sensors by channel; one that is left out tells the truth at every control interval."""

    position: SensorSection | None = None
    velocity: SensorSection | None = None
    attitude: SensorSection | None = None
    angular_velocity: SensorSection | None = None

    def sensors(self, frame: str) -> Sensors:
        """Return the sensors, in `ned`."""
        channels = {}
        for name in type(self).model_fields:
            if (section := getattr(self, name)) is not None:
                with within(f"[sensors.{name}]"):
                    channels[name] = section.channel(frame)
        with within("[sensors]"):
            return Sensors(**channels)


class GustsSection(Section):
    """Gusts with the Dryden spectra: along the horizontal mean wind, across it to the right, downwards."""

    deviation: Array  # [m/s], one number or three
    time: Array  # [s], one number or three

    def gusts(self) -> Gusts:
        """Return the gusts."""
        return Gusts(self.deviation, self.time)


class WindSection(Section):
    """The velocity of the air."""

    mean: Vector = (0.0, 0.0, 0.0)  # [m/s]
    gusts: GustsSection | None = None

    def wind(self, frame: str) -> Wind:
        """Return the wind, in `ned`."""
        with within("[wind]"):
            mean = convert_vector(self.mean, frame)
            return Wind(mean, None if self.gusts is None else self.gusts.gusts())

"""The parts of a mission, each built from its sections once, in `ned`; a part that cannot be built is refused with its section in front."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

from gammastar.certificate import Limits
from gammastar.errors import MissionError
from gammastar.flight import Replacement, SensorNoise, Sensors, Wind
from gammastar.law import AnyReference, Approach, Heading, Law, design
from gammastar.mission import turn
from gammastar.mission.complaint import within
from gammastar.mission.references import FeasibleSection
from gammastar.mission.sections import YAW_OUTPUTS, MissionFile
from gammastar.vehicle import State, Vehicle


@dataclass(frozen=True, eq=False)
class Parts:
    """What the sections of a mission say, as objects."""

    file: MissionFile

    @property
    def frame(self) -> str:
        """Return the frame of the file's numbers, 'ned' or 'enu'."""
        return self.file.frame

    @functools.cached_property
    def law(self) -> Law:
        """Return the law that is designed."""
        file, controller = self.file, self.file.controller
        vehicle = file.vehicle.vehicle(self.frame)
        with within("[path]"):
            path = file.path.path(self.frame)
        with within("[controller]"):
            arguments = vehicle, path, controller.design_poles(), YAW_OUTPUTS[controller.yaw_output]
            law = design(*arguments, interface=controller.commands)
        if file.approach is not None:
            with within("[approach]"):
                approach = Approach(**file.approach.arguments())
                law = design(*arguments, approach=approach, interface=controller.commands)
        if file.observer is not None and file.integral is not None:
            raise MissionError(
                "a mission must have [observer] or [integral] (got both); leave one of them out", "integral"
            )
        if file.observer is not None:
            with within("[observer]"):
                law = dataclasses.replace(law, rejection=file.observer.rejection())
        if file.integral is not None:
            with within("[integral]"):
                law = dataclasses.replace(law, rejection=file.integral.rejection(law.poles["transverse"]))
        if file.filter is not None:
            with within("[filter]"):
                law = dataclasses.replace(law, estimator=file.filter.estimator(self._stated_sensors, vehicle.gravity))
        return law

    @functools.cached_property
    def start(self) -> State:
        """Return the start."""
        start = self.file.start
        with within("[start]"):
            return turn.state_in_ned(
                start.position,
                start.velocity,
                start.rotation()[0],
                start.angular_velocity,
                self.frame,
                thrust=start.thrust,
                thrust_rate=start.thrust_rate,
            )

    @functools.cached_property
    def reference(self) -> AnyReference:
        """Return the reference along the path."""
        section = self.file.reference
        with within("[reference]"):
            if isinstance(section, FeasibleSection):
                return section.profile(self.law.vehicle, self.law.path, self.limits)
            reference: AnyReference = section.factory()(**section.arguments())
            return reference

    @functools.cached_property
    def replacements(self) -> tuple[Replacement, ...]:
        """Return what replaces the path on the way."""
        sections = enumerate(self.file.replacements)
        return tuple(each.replacement(self.frame, f"replacements.{k}") for k, each in sections)

    @functools.cached_property
    def heading(self) -> Heading | None:
        """Return where the nose is to point, if it is said."""
        section = self.file.heading
        if section is None:
            return None
        if self.file.controller.yaw_reference != 0:
            raise MissionError(
                f"[heading] must stand alone (got yaw_reference = {self.file.controller.yaw_reference:g} in [controller] too); "
                "leave one of them out",
                "controller.yaw_reference",
            )
        with within("[heading]"):
            heading: Heading = section.factory()(**turn.arguments_in_ned(section.arguments(), self.frame))
            return heading

    @functools.cached_property
    def truth(self) -> Vehicle:
        """Return the vehicle that really flies."""
        with within("[truth]"):
            stated = self._stated_noise or self._stated_sensors
            if self.file.truth.noise_scale != 1 and not (stated and stated.is_noisy):
                raise MissionError(
                    f"noise_scale needs noise (got {self.file.truth.noise_scale:g} of none); give a deviation in [noise] or [sensors]",
                    "truth.noise_scale",
                )
            return self.file.truth.vehicle(self.law.vehicle, self.frame)

    @functools.cached_property
    def sensors(self) -> Sensors | None:
        """Return the sensors as they truly are, if there are any."""
        stated = self._stated_sensors
        return None if stated is None else stated.scaled(self.file.truth.noise_scale)

    @functools.cached_property
    def _stated_sensors(self) -> Sensors | None:
        return None if self.file.sensors is None else self.file.sensors.sensors(self.frame)

    @functools.cached_property
    def wind(self) -> Wind | None:
        """Return the wind, if there is any."""
        return None if self.file.wind is None else self.file.wind.wind(self.frame)

    @functools.cached_property
    def limits(self) -> Limits:
        """Return the limits that a certificate holds the path to."""
        with within("[limits]"):
            return Limits(**(self.file.vehicle.limits() | self.file.limits.model_dump(exclude_none=True)))

    @functools.cached_property
    def noise(self) -> SensorNoise | None:
        """Return the noise of every control interval as it truly is, if there is any."""
        stated = self._stated_noise
        return None if stated is None else stated.scaled(self.file.truth.noise_scale)

    @functools.cached_property
    def _stated_noise(self) -> SensorNoise | None:
        if self.file.noise is None:
            return None
        if self.file.controller.rate is None:
            raise MissionError(
                f'[noise] needs a control rate (got feedback {self.file.controller.feedback} without one); set feedback = "middle" and '
                "rate, such as 400, in [controller]",
                "controller.rate",
            )
        with within("[noise]"):
            return self.file.noise.at(self.file.controller.rate)

    @property
    def yaw_reference(self) -> float:
        """Return the constant reference of the yaw output."""
        return turn.yaw_in_ned(self.file.controller.yaw_reference, self.frame)

    @property
    def yaw(self) -> float | Heading:
        """Return what the yaw output follows."""
        return self.yaw_reference if self.heading is None else self.heading

"""A mission: everything a flight needs, from one TOML file, checked and built."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from gammastar.certificate import Certificate, Limits, certify
from gammastar.errors import MissionError
from gammastar.export.pilot import CompiledPilot
from gammastar.export.program import DEFAULT_NAME, DEFAULT_REAL, Program
from gammastar.flight import FlightRecord, Flights, Replacement, SensorNoise, Sensors, Wind, fly, fly_many
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.flight.phases import phases_of
from gammastar.flight.timing import interval_of, timing
from gammastar.law import AnyReference, Approach, Heading, Law, Profile, design
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance
from gammastar.mission import turn
from gammastar.mission.complaint import complaint, within
from gammastar.mission.references import FeasibleSection
from gammastar.mission.resolved import resolved, with_paths_written
from gammastar.mission.sections import COMPILED, YAW_OUTPUTS, MissionFile
from gammastar.mission.tables import plain, present, put, written
from gammastar.path import Path
from gammastar.vehicle import State, Vehicle


def read(values: Mapping[str, Any]) -> MissionFile:
    """Return nested values as a mission's sections, each checked by itself.

    Raises:
        MissionError: An unknown or missing key or a value of the wrong type.
    """
    try:
        return MissionFile.model_validate(plain(values))
    except ValidationError as error:
        raise complaint(error) from None


@dataclass(frozen=True, eq=False)
class Mission:
    """A mission that can be flown: what would refuse the flight at its start refuses the mission.

    Two missions are equal when they are the same once every default is written out.

    Raises:
        GammastarError: The fitting error of the part that cannot be built, with its section in front.
    """

    file: MissionFile  # as written, in the mission's frame

    def __post_init__(self) -> None:
        law, start = self._law, self._start
        with within("[start]"):
            _, parameter = law.start_vector(start)
        with within("[reference]"):
            self._reference.resolved(law.path, parameter)
        flight = self.file.flight
        conditions = Conditions(noise=self._noise, pilot=self._pilot, **self._conditions)
        with within("[controller]"):
            sampling = conditions.sampling(law)
            interval_of(*sampling)
        with within("[flight]"):
            timing(*sampling, flight.duration)
        yaw = self._yaw if self._heading is None else self._heading
        assert (
            self.file.campaign is None or self.file.campaign.distributions()
        )  # refuses bad ones now, not when it is flown
        assert self._limits  # refuses bad limits now, not when the mission is certified
        loop, _, steps = prepared(law, start, self._reference, yaw, conditions)
        with within("[[replacements]]"):
            phases_of(law, self._reference, self._replacements, loop.interval, steps)

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> Mission:
        """Return the mission of nested values, as a TOML parser or a caller in Python gives them.

        Raises:
            MissionError: An unknown or missing key or a value of the wrong type.
            GammastarError: The numbers cannot be flown.
        """
        return cls(read(values))

    def with_values(self, changes: Mapping[str, Any]) -> Mission:
        """Return the mission with some values changed, named by dotted keys such as 'path.radius'.

        What the mission leaves open stays open: a start thrust that is the weight follows a changed mass.
        """
        values = plain(self.file.model_dump(exclude_unset=True))
        for key, value in changes.items():
            put(values, key, value)
        return Mission.from_values(values)

    @property
    def title(self) -> str:
        """Return what the mission is called, one line."""
        return self.file.title

    @property
    def frame(self) -> str:
        """Return the frame of the mission's numbers, 'ned' or 'enu'."""
        return self.file.frame

    @property
    def start_attitude_distance(self) -> float:
        """Return how far the given attitude was from a rotation: Frobenius distance, or a quaternion's length less one."""
        return max(self._start.attitude_distance, self.file.start.rotation()[1])

    def law(self) -> Law:
        """Return the law that the mission designs."""
        return self._law

    def truth(self) -> Vehicle:
        """Return the vehicle that really flies."""
        return self._truth

    def start(self) -> State:
        """Return the start, in `ned`."""
        return self._start

    @property
    def interval(self) -> float:
        """Return the control interval [s], or the integration step of a law that acts continuously."""
        return Conditions(noise=self._noise, pilot=self._pilot, **self._conditions).timing(self._law)[0]

    def certify(self) -> Certificate:
        """Return whether and how fast the mission's path can be followed, at the largest speed that its reference asks for.

        The points that it names are in the mission's frame.
        """
        return self._certificate(self._law.path, self._reference)

    def certificates(self) -> dict[str, Certificate]:
        """Return the certificates of all paths, those of replacements too, by their sections: 'path', 'replacements.0.path' ..."""
        others = {
            f"replacements.{k}.path": self._certificate(each.path, each.reference or self._reference)
            for k, each in enumerate(self._replacements)
        }
        return {"path": self.certify()} | others

    def fly(self, progress: Callable[[int, int], None] | None = None) -> FlightRecord:
        """Fly the mission and return its record, in `ned`; progress is called with (steps done, steps in all)."""
        return fly(
            self._law,
            self._start,
            reference=self._reference,
            noise=self._noise,
            seed=self.file.flight.seed,
            flight=self.file.flight.number,
            yaw_reference=self._yaw,
            heading=self._heading,
            settled_within=self.file.flight.settled_within,
            replacements=self._replacements,
            progress=progress,
            pilot=self._pilot,
            **self._conditions,
        )

    def fly_many(self, starts: Sequence[State], laws: Sequence[Law] | None = None, **given: Any) -> Flights:
        """Fly the mission from many starts, in `ned`, with one law or one a flight; the rest is as for `gs.fly_many`.

        Raises:
            MissionError: The mission replaces its path on the way, or flies as compiled C.
        """
        if self._replacements:
            raise MissionError(
                f"many flights must have one path (got {len(self._replacements)} more in [[replacements]]); leave them out",
                "replacements",
            )
        if self.file.controller.interface == COMPILED:
            raise MissionError(
                f'many flights must fly the law itself (got interface = "{COMPILED}"); leave it out: the native machine compiles all of it',
                "controller.interface",
            )
        return fly_many(
            self._law if laws is None else laws,
            starts,
            reference=self._reference,
            noise=self._noise,
            yaw_reference=self._yaw,
            heading=self._heading,
            settled_within=self.file.flight.settled_within,
            **({"seed": self.file.flight.seed} | self._conditions | given),
        )

    def autopilot(self) -> tuple[Autopilot, np.ndarray, float]:
        """Return what runs on the vehicle's computer, the stacked start (20,) in `ned`, and the path parameter nearest to it.

        A law that acts continuously in this mission is one that acts at 500 Hz.

        Raises:
            MissionError: The mission replaces its path on the way.
        """
        if self._replacements:
            raise MissionError(
                f"an autopilot must have one path (got {len(self._replacements)} more in [[replacements]]); "
                "leave them out, and make a mission of each",
                "replacements",
            )
        start, parameter = self._law.start_vector(self._start)
        conditions = Conditions(noise=self._noise, **self._conditions)
        yaw = self._yaw if self._heading is None else self._heading
        guidance = Guidance(self._law, self._reference.resolved(self._law.path, parameter), yaw)
        return conditions.autopilot(guidance), start, parameter

    def program(self, name: str = DEFAULT_NAME, real: str | None = None, version: str = "") -> Program:
        """Return the autopilot of the mission as a program that can be written in C.

        Args:
            name: Prefix of every public name in C.
            real: 'float32' or 'float64'; that of [controller] when left out, and float32 where it says nothing.
            version: Of gammastar, to be named in the files.

        Raises:
            MissionError: The mission replaces its path on the way.
            UnknownNameError: The real type is unknown.
        """
        pilot, start, parameter = self.autopilot()
        chosen = real or self.file.controller.real or DEFAULT_REAL
        return Program(name, self.title, pilot, start, parameter, self.frame, chosen, version)

    def values(self) -> dict[str, Any]:
        """Return the mission as nested plain values with every default written out."""
        conditions = Conditions(noise=self._noise, pilot=self._pilot, **self._conditions)
        feedback, _, rate = conditions.sampling(self._law)
        return resolved(self.file, self._law, feedback, rate)

    def toml(self) -> str:
        """Return the mission as TOML with every default written out; loading it gives an equal mission and the same flight."""
        return written(self.values())

    def given(self) -> dict[str, Any]:
        """Return the nested values that were given, with every path as one that needs no file."""
        return with_paths_written(self.file, self.file.model_dump(exclude_unset=True))

    def source(self) -> str:
        """Return the mission as TOML in which what was left open stays open, and which needs no other file."""
        return written(present(plain(self.given())))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mission) and self.values() == other.values()

    def __hash__(self) -> int:
        return hash(self.toml())

    def __reduce__(self) -> Any:
        return Mission.from_values, (self.given(),)

    def _certificate(self, path: Path, reference: AnyReference) -> Certificate:
        speed = reference.fastest
        if path is self._law.path and isinstance(self.file.reference, FeasibleSection):
            assert isinstance(reference, Profile)
            speed = reference.slowest  # faster is the profile only where it has been found feasible, on this path
        return certify(self._law.vehicle, path, speed, limits=self._limits, frame=self.frame)

    @property
    def _conditions(self) -> dict[str, Any]:
        """Return what `fly` and `prepared` both take."""
        controller, flight = self.file.controller, self.file.flight
        return {
            "duration": flight.duration,
            "step": flight.step,
            "feedback": controller.feedback,
            "rate": controller.rate,
            "integrator": flight.integrator,
            "truth": None if self._truth is self._law.vehicle else self._truth,
            "sensors": self._sensors,
            "wind": self._wind,
        }

    @functools.cached_property
    def _pilot(self) -> CompiledPilot | None:
        """Return what flies in place of the law's graph; None unless [controller] says so."""
        return CompiledPilot(self.program()) if self.file.controller.interface == COMPILED else None

    @property
    def _yaw(self) -> float:
        """Return the constant reference of the yaw output, in `ned`."""
        return turn.yaw_in_ned(self.file.controller.yaw_reference, self.frame)

    @functools.cached_property
    def _law(self) -> Law:
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
                law = dataclasses.replace(law, estimator=file.filter.estimator(self._sensors, vehicle.gravity))
        return law

    @functools.cached_property
    def _start(self) -> State:
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
    def _reference(self) -> AnyReference:
        section = self.file.reference
        with within("[reference]"):
            if isinstance(section, FeasibleSection):
                return section.profile(self._law.vehicle, self._law.path, self._limits)
            reference: AnyReference = section.factory()(**section.arguments())
            return reference

    @functools.cached_property
    def _replacements(self) -> tuple[Replacement, ...]:
        sections = enumerate(self.file.replacements)
        return tuple(each.replacement(self.frame, f"replacements.{k}") for k, each in sections)

    @functools.cached_property
    def _heading(self) -> Heading | None:
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
    def _truth(self) -> Vehicle:
        with within("[truth]"):
            return self.file.truth.vehicle(self._law.vehicle, self.frame)

    @functools.cached_property
    def _sensors(self) -> Sensors | None:
        return None if self.file.sensors is None else self.file.sensors.sensors(self.frame)

    @functools.cached_property
    def _wind(self) -> Wind | None:
        return None if self.file.wind is None else self.file.wind.wind(self.frame)

    @functools.cached_property
    def _limits(self) -> Limits:
        with within("[limits]"):
            return Limits(**(self.file.vehicle.limits() | self.file.limits.model_dump(exclude_none=True)))

    @functools.cached_property
    def _noise(self) -> SensorNoise | None:
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

"""A mission: everything a flight needs, from one TOML file, checked and built."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from gammastar.certificate import Certificate, certify
from gammastar.errors import MissionError
from gammastar.export.pilot import CompiledPilot
from gammastar.export.program import DEFAULT_NAME, DEFAULT_REAL, Program
from gammastar.flight import FlightRecord, Flights, fly, fly_many
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.flight.phases import phases_of
from gammastar.flight.timing import interval_of, timing
from gammastar.law import AnyReference, Law, Profile
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance
from gammastar.mission.campaign import Quantity, quantities_of
from gammastar.mission.changes import changed
from gammastar.mission.complaint import complaint, within
from gammastar.mission.parts import Parts
from gammastar.mission.references import FeasibleSection
from gammastar.mission.resolved import resolved, with_paths_written
from gammastar.mission.retuned import retuned
from gammastar.mission.sections import COMPILED, MissionFile
from gammastar.mission.tables import plain, present, written
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
        law, start = self._parts.law, self._parts.start
        with within("[start]"):
            _, parameter = law.start_vector(start)
        with within("[reference]"):
            self._parts.reference.resolved(law.path, parameter)
        flight = self.file.flight
        conditions = Conditions(noise=self._parts.noise, pilot=self._pilot, **self._conditions)
        with within("[controller]"):
            sampling = conditions.sampling(law)
            interval_of(*sampling)
        with within("[flight]"):
            timing(*sampling, flight.duration)
        if self.file.campaign is not None:  # refuses bad ones now, not when it is flown
            assert self.file.campaign.distributions(self.quantities)
        assert self._parts.limits  # refuses bad limits now, not when the mission is certified
        loop, _, steps = prepared(law, start, self._parts.reference, self._parts.yaw, conditions)
        with within("[[replacements]]"):
            phases_of(law, self._parts.reference, self._parts.replacements, loop.interval, steps)

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
        return Mission.from_values(changed(self.file.model_dump(exclude_unset=True), changes))

    @functools.cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """Return what may vary from flight to flight in one program, by key; see `gammastar.mission.campaign`."""
        return quantities_of(self.file.path)

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
        return max(self._parts.start.attitude_distance, self.file.start.rotation()[1])

    def law(self) -> Law:
        """Return the law that the mission designs."""
        return self._parts.law

    def truth(self) -> Vehicle:
        """Return the vehicle that really flies."""
        return self._parts.truth

    def start(self) -> State:
        """Return the start, in `ned`."""
        return self._parts.start

    @property
    def interval(self) -> float:
        """Return the control interval [s], or the integration step of a law that acts continuously."""
        return Conditions(noise=self._parts.noise, pilot=self._pilot, **self._conditions).timing(self._parts.law)[0]

    def certify(self) -> Certificate:
        """Return whether and how fast the mission's path can be followed, at the largest speed that its reference asks for.

        The points that it names are in the mission's frame.
        """
        return self._certificate(self._parts.law.path, self._parts.reference)

    def certificates(self) -> dict[str, Certificate]:
        """Return the certificates of all paths, those of replacements too, by their sections: 'path', 'replacements.0.path' ..."""
        others = {
            f"replacements.{k}.path": self._certificate(each.path, each.reference or self._parts.reference)
            for k, each in enumerate(self._parts.replacements)
        }
        return {"path": self.certify()} | others

    def fly(self, progress: Callable[[int, int], None] | None = None) -> FlightRecord:
        """Fly the mission and return its record, in `ned`; progress is called with (steps done, steps in all)."""
        return fly(
            self._parts.law,
            self._parts.start,
            reference=self._parts.reference,
            noise=self._parts.noise,
            seed=self.file.flight.seed,
            flight=self.file.flight.number,
            yaw_reference=self._parts.yaw_reference,
            heading=self._parts.heading,
            settled_within=self.file.flight.settled_within,
            replacements=self._parts.replacements,
            progress=progress,
            pilot=self._pilot,
            **self._conditions,
        )

    def fly_many(self, starts: Sequence[State], laws: Sequence[Law] | None = None, **given: Any) -> Flights:
        """Fly the mission from many starts, in `ned`, with one law or one a flight; the rest is as for `gs.fly_many`.

        Speeds that are given take the place of the mission's reference.

        Raises:
            MissionError: The mission replaces its path on the way, or flies as compiled C.
        """
        if self._parts.replacements:
            raise MissionError(
                f"many flights must have one path (got {len(self._parts.replacements)} more in [[replacements]]); leave them out",
                "replacements",
            )
        if self.file.controller.interface == COMPILED:
            raise MissionError(
                f'many flights must fly the law itself (got interface = "{COMPILED}"); leave it out: the native machine compiles all of it',
                "controller.interface",
            )
        return fly_many(
            self._parts.law if laws is None else laws,
            starts,
            reference=None if "speed" in given else self._parts.reference,
            noise=self._parts.noise,
            yaw_reference=self._parts.yaw_reference,
            heading=self._parts.heading,
            settled_within=self.file.flight.settled_within,
            **({"seed": self.file.flight.seed} | self._conditions | given),
        )

    def require_possible(self, varied: Mapping[str, np.ndarray]) -> None:
        """Raise `InputError` when flights of the mission cannot differ so in what really flies; values (k, flights) by name."""
        Conditions(noise=self._parts.noise, **self._conditions).require_possible(varied, self._parts.law)

    def retuned(self, values: Mapping[str, Any]) -> Law:
        """Return the law that the mission has with some values of its tuning, see `gammastar.mission.retuned`."""
        return retuned(self.file, self._parts.law, values)

    def autopilot(self) -> tuple[Autopilot, np.ndarray, float]:
        """Return what runs on the vehicle's computer, the stacked start (20,) in `ned`, and the path parameter nearest to it.

        A law that acts continuously in this mission is one that acts at 500 Hz.

        Raises:
            MissionError: The mission replaces its path on the way.
        """
        if self._parts.replacements:
            raise MissionError(
                f"an autopilot must have one path (got {len(self._parts.replacements)} more in [[replacements]]); "
                "leave them out, and make a mission of each",
                "replacements",
            )
        start, parameter = self._parts.law.start_vector(self._parts.start)
        conditions = Conditions(noise=self._parts.noise, **self._conditions)
        guidance = Guidance(
            self._parts.law, self._parts.reference.resolved(self._parts.law.path, parameter), self._parts.yaw
        )
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
        conditions = Conditions(noise=self._parts.noise, pilot=self._pilot, **self._conditions)
        feedback, _, rate = conditions.sampling(self._parts.law)
        return resolved(self.file, self._parts.law, feedback, rate)

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
        if path is self._parts.law.path and isinstance(self.file.reference, FeasibleSection):
            assert isinstance(reference, Profile)
            speed = reference.slowest  # faster is the profile only where it has been found feasible, on this path
        return certify(self._parts.law.vehicle, path, speed, limits=self._parts.limits, frame=self.frame)

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
            "truth": None if self._parts.truth is self._parts.law.vehicle else self._parts.truth,
            "sensors": self._parts.sensors,
            "wind": self._parts.wind,
        }

    @functools.cached_property
    def _parts(self) -> Parts:
        return Parts(self.file)

    @functools.cached_property
    def _pilot(self) -> CompiledPilot | None:
        """Return what flies in place of the law's graph; None unless [controller] says so."""
        return CompiledPilot(self.program()) if self.file.controller.interface == COMPILED else None

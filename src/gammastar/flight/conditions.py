"""Under which conditions a law is flown: for how long, how finely, by which vehicle in truth, with which sensors, in which wind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gammastar.checks import instance, number
from gammastar.errors import InputError, UnknownNameError
from gammastar.flight.autopiloted import AutopilotLoop
from gammastar.flight.integrator import integrator as integrator_by_name
from gammastar.flight.loop import FEEDBACKS, ClosedLoop
from gammastar.flight.noise import SensorNoise
from gammastar.flight.plant import Plant
from gammastar.flight.sensors import Channel, Sensors
from gammastar.flight.software_in_the_loop import Pilot, PilotedLoop
from gammastar.flight.timing import timing
from gammastar.flight.variation import require_effect
from gammastar.flight.wind import Wind
from gammastar.law import Law
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance
from gammastar.vehicle import Vehicle, scaled_inertia

AUTOPILOT_RATE = 500.0  # [Hz] when none is given


@dataclass(frozen=True, eq=False)
class Conditions:
    """What `fly` is told beside law, start and reference; checked on its own here, and against a law by `timing`."""

    duration: float  # [s]
    step: float  # [s], the longest of the integration
    feedback: str | None = None
    rate: float | None = None  # [Hz]
    integrator: str = "rkmk4"
    truth: Vehicle | None = None
    noise: SensorNoise | None = None
    sensors: Sensors | None = None
    wind: Wind | None = None
    pilot: Pilot | None = None  # flies in place of the graph that it was compiled from

    def __post_init__(self) -> None:
        number(self.duration, "duration [s]", above=0)
        number(self.step, "step [s]", above=0)
        for name, kind, remedy in (
            ("truth", Vehicle, "make one with gs.Vehicle(mass, inertia)"),
            ("noise", SensorNoise, "make one with gs.SensorNoise()"),
            ("sensors", Sensors, "make them with gs.Sensors()"),
            ("wind", Wind, "make one with gs.Wind(mean)"),
        ):
            if getattr(self, name) is not None:
                instance(getattr(self, name), kind, name, remedy)
        if self.feedback is not None and self.feedback not in FEEDBACKS:
            raise UnknownNameError("feedback", self.feedback, FEEDBACKS)
        if self.rate is not None:
            number(self.rate, "rate [Hz]", above=0)
        if self.noise is not None and self.sensors is not None:
            raise InputError("a flight has noise or sensors (got both); give the deviations to the sensors")
        integrator_by_name(self.integrator)

    def autopilot_for(self, law: Law) -> str | None:
        """Return what makes an autopilot necessary, or None when the law acts on the vehicle itself."""
        reasons = {
            "a vehicle with rotors": law.vehicle.rotors or self._truth(law).rotors,
            "a latency": law.vehicle.latency or self._truth(law).latency,
            "disturbance rejection": law.rejection,
            "an estimator": law.estimator,
            "sensors": self.sensors,
            "wind": self.wind,
            "the interface 'rates'": law.interface == "rates",
            "a compiled autopilot": self.pilot,
        }
        return next((reason for reason, given in reasons.items() if given), None)

    def timing(self, law: Law) -> tuple[float, int, int]:
        """Return the control interval [s], the integration steps in it, and the intervals that cover the duration.

        Raises:
            InputError: The feedback, the rate or the times do not fit each other or the law.
        """
        return timing(*self.sampling(law), float(self.duration))

    def sampling(self, law: Law) -> tuple[str, float, float | None]:
        """Return feedback, longest step [s] and control rate [Hz], with what was left out filled in."""
        reason = self.autopilot_for(law)
        feedback, rate = self.feedback, self.rate
        if reason is None:
            feedback = feedback or "continuous"
            if self.noise is not None and feedback == "continuous":
                raise InputError(
                    "sensor noise needs sampled feedback (got continuous); choose feedback 'start' or 'middle' and a rate"
                )
        elif feedback == "continuous":
            raise InputError(
                f"{reason} needs sampled feedback (got continuous); choose feedback 'middle' and a rate, such as 500"
            )
        else:
            feedback, rate = feedback or "middle", rate or AUTOPILOT_RATE
        return feedback, float(self.step), None if rate is None else float(rate)

    def loop(self, guidance: Guidance) -> ClosedLoop | AutopilotLoop:
        """Return the closed loop of a law with its guidance."""
        law, truth, method = guidance.law, self._truth(guidance.law), integrator_by_name(self.integrator)
        (interval, substeps, _), (feedback, *_) = self.timing(law), self.sampling(law)
        if self.autopilot_for(law) is None:
            return ClosedLoop(guidance, truth, method, feedback, interval, substeps, self.noise)  # type: ignore[arg-type]
        if (law.vehicle.rotors is None) != (truth.rotors is None) or (
            law.vehicle.rotors and truth.rotors and law.vehicle.rotors.count != truth.rotors.count
        ):
            raise InputError(
                "the vehicle that flies must take the commands of the one believed in (got other rotors); give both as many rotors"
            )
        rotors = law.vehicle.rotors if law.interface == "wrench" else None
        if rotors is not None and not law.vehicle.feels_the_air and rotors.thrust_range[1] <= law.vehicle.weight:
            raise InputError(
                f"rotors must be able to carry the vehicle (got {rotors.thrust_range[1]:.4g} N at most, and a weight of "
                f"{law.vehicle.weight:.4g} N); check the thrust coefficient and the fastest speed, in rad/s"
            )
        if self.wind is not None and not truth.feels_the_air:
            raise InputError(
                "wind needs a vehicle that feels it (got one whose forces do not depend on the air); give drag to the vehicle that flies"
            )
        if law.interface == "rates":
            _require_slower(max(law.vehicle.rate_bandwidth, truth.rate_bandwidth), interval)
        plant = Plant(truth, interval, substeps, method, law.interface)
        loop = self.autopilot(guidance), plant, self._sensors(), self.wind or Wind()
        if self.pilot is None:
            return AutopilotLoop(*loop)
        if self.pilot.interval != interval:
            raise InputError(
                f"a compiled autopilot must fly at its own rate (got {1 / interval:g} Hz, and it has {1 / self.pilot.interval:g} Hz); "
                "give that rate, or compile it again"
            )
        return PilotedLoop(*loop, pilot=self.pilot)

    def require_possible(self, varied: Mapping[str, np.ndarray], law: Law) -> None:
        """Raise `InputError` when something varies that makes no difference, or beyond what can be flown or what a body can have.

        Args:
            varied: Values (k, flights) by name, see `fly_many`.
            law: Of the flights, or of one of them.
        """
        measured = self.noise or self.sensors
        is_noisy = measured is not None and measured.is_noisy
        truth = self._truth(law)
        require_effect(varied, truth, law.interface, is_noisy)
        scales = varied.get("inertia_scale", np.empty((3, 0)))
        for each in scales[:, np.ptp(scales, axis=0) > 0].T:  # equal ones leave a body one
            scaled_inertia(truth, each)
        if "rate_bandwidth" in varied:
            _require_slower(float(np.max(varied["rate_bandwidth"], initial=0.0)), self.timing(law)[0])

    def autopilot(self, guidance: Guidance) -> Autopilot:
        """Return what runs on the vehicle's computer; a law that acts continuously is taken to act at `AUTOPILOT_RATE`."""
        feedback, _, rate = self.sampling(guidance.law)
        return Autopilot(guidance, 1 / (rate or AUTOPILOT_RATE), feedback != "start")

    def _truth(self, law: Law) -> Vehicle:
        return law.vehicle if self.truth is None else self.truth

    def _sensors(self) -> Sensors:
        if self.noise is None:
            return self.sensors or Sensors()
        noise = self.noise
        return Sensors(
            *(Channel(each) for each in (noise.position, noise.velocity, noise.attitude, noise.angular_velocity))
        )


def _require_slower(bandwidth: float, interval: float) -> None:
    """Raise `InputError` when an inner loop of a bandwidth [rad/s] is faster than a control interval [s]."""
    if bandwidth * interval > 1:
        raise InputError(
            f"the rate bandwidth must be at most {1 / interval:g} rad/s at this control rate (got {bandwidth:g}); "
            "an inner loop that is faster cannot be told from one of that bandwidth, so give it"
        )

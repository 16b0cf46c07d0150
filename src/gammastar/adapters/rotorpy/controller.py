"""A law as RotorPy calls it, once a control interval: states with the third axis up go in, commands within the rotors' limits come out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gammastar import so3
from gammastar.checks import array, instance, number, shortened
from gammastar.errors import InputError
from gammastar.frames import convert_attitude, convert_vector
from gammastar.law import AnyReference, Heading, Law, Reference, Speed
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance
from gammastar.law.law import Yaw
from gammastar.law.piecewise import DATA_SIZE
from gammastar.law.reference import reference_given
from gammastar.vehicle import State

FRAME = "enu"  # RotorPy's axes
RATE = 500.0  # [Hz] when none is given, as in `fly`
LATE = 1e-3  # of the control interval, by which RotorPy's clock may be off from adding up
LEAST_THRUST = 1e-3  # share of the most, with which a vehicle starts whose rotors stand still
SHAPES = {"x": (3,), "v": (3,), "q": (4,), "w": (3,)}  # of what a state of RotorPy must have


@dataclass
class Running:
    """What lasts from one call to the next."""

    step: Any  # function (memory, measurement, time, data of the reference) -> (memory, command, telemetry)
    reference: Reference
    memory: Any  # state of the autopilot
    begin: float  # [s] time of the first call
    time: float  # [s] of the latest one


class Controller:
    """A law for RotorPy: `update` is called once a control interval, in the order of time.

    It keeps the autopilot's state between two calls, and starts anew at the first one and whenever time has gone back.  Rotor speeds,
    rotor thrusts, and thrust with moments are one command in three forms, within the rotors' limits whatever happens, so a
    `Multirotor` may take any of `ABSTRACTIONS`.  Attitude, rates, velocity and acceleration in the answer only repeat what is.
    """

    def __init__(
        self,
        law: Law,
        *,
        speed: float | None = None,
        reference: AnyReference | None = None,
        rate: float = RATE,
        yaw_reference: float = 0.0,
        heading: Heading | None = None,
    ) -> None:
        """Take a law and what it is to do.

        Args:
            law: From `design`, for a vehicle with rotors, such as one of `vehicle_of`; path and start have the third axis down.
            speed: Constant speed along the path [path parameter/s], short for `reference=Speed(speed)`.
            reference: As in `fly`; exactly one of `speed` and `reference` is given.
            rate: [Hz] at which RotorPy calls: its `sim_rate`.
            yaw_reference: Constant reference of the yaw output.
            heading: In place of a constant reference.

        Raises:
            InputError: The law commands no rotors, or an argument is of another kind.
        """
        instance(law, Law, "law", "make one with gs.design(vehicle, path)")
        if law.vehicle.rotors is None or law.interface != "wrench":
            raise InputError(
                "a law for RotorPy must command rotors (got a vehicle without rotors, or the interface 'rates'); "
                "design it for rotorpy.vehicle_of(parameters)"
            )
        if (speed is None) == (reference is None):
            raise InputError(
                "a controller needs exactly one of speed and reference (got both or none); give one of them"
            )
        if reference is not None:
            reference_given(reference)
        if heading is not None:
            instance(heading, Heading, "heading", "make one with gs.Along(), gs.Azimuth() or gs.Towards()")
        self.law = law
        self.rate = number(rate, "rate [Hz]", above=0)
        self._rotors = law.vehicle.rotors
        self._wanted: AnyReference = Speed(speed) if speed is not None else reference  # type: ignore[assignment]
        self._yaw: Yaw = number(yaw_reference, "yaw reference") if heading is None else heading
        self._running: Running | None = None

    def update(self, t: float, state: Mapping[str, Any], flat_output: object = None) -> dict[str, Any]:
        """Return the commands for the interval that begins now, in RotorPy's axes and under all of its keys.

        Args:
            t: [s].
            state: x [m], v [m/s], q (i, j, k, w) and w [rad/s]; at the start also rotor_speeds [rad/s], if they are known.
            flat_output: Of RotorPy's trajectory; not used, because the law has a path.
        """
        t, told, running = number(t, "time [s]"), _told(state), self._running
        if running is None or t <= running.time:
            running = self._running = self._start(t, told, state)
        elif abs((t - running.time) * self.rate - 1) > LATE:
            raise InputError(
                f"a controller for {self.rate:g} Hz must be called at that rate (got {t - running.time:g} s since the last call); "
                "give RotorPy the same sim_rate"
            )
        running.time, time = t, t - running.begin
        reference = running.reference
        data = np.zeros(DATA_SIZE) if reference.over_progress else reference.pieces.data(np.array([time]))[:, 0]
        running.memory, command, _ = running.step(running.memory, told, time, data)
        return self._answer(command.full()[:, 0], state)

    def _start(self, time: float, told: np.ndarray, state: Mapping[str, Any]) -> Running:
        """Return the autopilot at where a flight begins; rotors that are not told of hover."""
        thrust = self.law.vehicle.weight
        if "rotor_speeds" in state:
            turning = array(state["rotor_speeds"], "rotor_speeds [rad/s]", (self._rotors.count,))
            speeds = np.clip(turning, self._rotors.slowest, self._rotors.fastest)
            thrust = max(float(self._rotors.wrench_at(speeds)[0]), LEAST_THRUST * self._rotors.thrust_range[1])
        start = State(told[:3], told[3:6], so3.unstack(told[6:15]), told[15:18], thrust)
        vector, parameter = self.law.start_vector(start)
        guidance = Guidance(self.law, self._wanted.resolved(self.law.path, parameter), self._yaw)
        autopilot = Autopilot(guidance, 1 / self.rate)
        return Running(autopilot.function(), guidance.reference, autopilot.start(vector, parameter), time, time)

    def _answer(self, speeds: np.ndarray, state: Mapping[str, Any]) -> dict[str, Any]:
        """Return rotor speeds (n,) [rad/s] in all of RotorPy's forms."""
        thrusts = np.asarray(self._rotors.thrust_coefficient) * speeds**2
        thrust, *moment = self._rotors.mixer @ thrusts
        up = Rotation.from_quat(state["q"]).as_matrix()[:, 2]
        return {
            "cmd_motor_speeds": speeds,
            "cmd_motor_thrusts": thrusts,
            "cmd_thrust": float(thrust),
            "cmd_moment": convert_vector(moment, FRAME),
            "cmd_q": np.array(state["q"], dtype=float),
            "cmd_w": np.array(state["w"], dtype=float),
            "cmd_v": np.array(state["v"], dtype=float),
            "cmd_acc": thrust / self.law.vehicle.mass * up,
        }


def _told(state: Mapping[str, Any]) -> np.ndarray:
    """Return the measurement (22,) of a state of RotorPy, every channel fresh."""
    instance(state, Mapping, "state", "pass on what RotorPy gives")
    for key, shape in SHAPES.items():
        if key not in state or np.shape(state[key]) != shape or not np.all(np.isfinite(state[key])):
            raise InputError(
                f"a state of RotorPy must have {key!r} with {shape[0]} finite numbers (got {shortened(state.get(key))}); "
                "check the simulation"
            )
    if not np.any(state["q"]):
        raise InputError(
            f"a state of RotorPy must have a quaternion 'q' other than zero (got {shortened(state['q'])}); check the simulation"
        )
    attitude = convert_attitude(Rotation.from_quat(state["q"]).as_matrix(), FRAME)
    position, velocity, rates = (convert_vector(state[key], FRAME) for key in ("x", "v", "w"))
    return np.concatenate([position, velocity, so3.stack(attitude), rates, np.ones(4)])

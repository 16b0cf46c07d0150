"""The closed loop as one graph: (loop state, time and noise) -> (next loop state, observation).

The loop state is explicit: the vehicle's 20 numbers, the path parameter that the law tracks from what it measures, the
parameter of the point truly nearest, and the input that a sampled law holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from gammastar.errors import InputError
from gammastar.flight.integrator import Integrator
from gammastar.flight.sensors import SIZE as NOISE_SIZE
from gammastar.flight.sensors import measured
from gammastar.law import Law, Linearization, Reference, linearize
from gammastar.vehicle import StateGraph, Vehicle, join, split
from gammastar.vehicle.state import SIZE as STATE_SIZE

Feedback = Literal["continuous", "start", "middle"]
FEEDBACKS = ("continuous", "start", "middle")
PARAMETER, TRUE_PARAMETER, HELD = STATE_SIZE, STATE_SIZE + 1, slice(STATE_SIZE + 2, STATE_SIZE + 6)
LOOP_SIZE = STATE_SIZE + 6
MOST_SUBSTEPS = 1000  # a control interval longer than this many integration steps is a slip, not a wish


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A law around a vehicle: what is believed, what is true, how often the law runs and how the motion is integrated."""

    law: Law
    truth: Vehicle
    reference: Reference
    yaw_reference: float  # of beta(r), constant
    integrator: Integrator
    feedback: Feedback
    interval: float  # [s] between rows of the record: the integration step, or the control interval
    substeps: int  # integration steps in an interval; 1 for continuous feedback
    noisy: bool

    def step(self) -> Any:
        """Return the function of one interval: (loop state (26,), [time, noise] (13,)) -> (next, observation)."""
        loop_state, exogenous = ca.SX.sym("loop_state", LOOP_SIZE), ca.SX.sym("exogenous", 1 + NOISE_SIZE)
        time, state = exogenous[0], split(loop_state[:STATE_SIZE])
        if self.feedback == "continuous":
            after, control = self._continuous(state, loop_state[PARAMETER], time)
        else:
            after, control = self._sampled(loop_state, state, time, exogenous[1:])
        true_parameter = loop_state[PARAMETER if self.feedback == "continuous" else TRUE_PARAMETER]
        observation = self._observation(state, true_parameter, control)
        return ca.Function("step", [loop_state, exogenous], ca.cse([ca.densify(after), ca.densify(observation)]))

    def start(self, state: np.ndarray, parameter: float) -> np.ndarray:
        """Return the loop state (26,) at the start of a flight; the held input is the law's at the start."""
        symbol = ca.SX.sym("state", STATE_SIZE)
        value = ca.Function("control", [symbol], [self._control(split(symbol), parameter, 0.0)[0]])
        return np.concatenate([state, [parameter, parameter], np.array(value(state)).ravel()])

    def _control(self, state: StateGraph, parameter: Any, time: Any) -> tuple[Any, Linearization]:
        """Graph: return the law's input SX (4,) at a state, and the linearization it used."""
        control = self.law.control(
            state,
            parameter,
            self.reference.jet(time),
            ca.vertcat(self.yaw_reference, 0),
            self.reference.holds_position,
        )
        return control.input, control.linearization

    def _continuous(self, state: StateGraph, parameter: Any, time: Any) -> tuple[Any, Any]:
        """Graph: feedback in every stage; the path parameter is integrated too and corrected at the end."""
        controls: list[Any] = []

        def field(now: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
            current = _with(attitude, euclidean)
            control, linearization = self._control(current, euclidean[11], now)
            controls.append(control)
            rate = self._vehicle_rate(self.truth, current, control)
            return current.angular_velocity, ca.vertcat(rate, linearization.outputs.tangential[1])

        attitude, euclidean = self.integrator.advance(
            field, time, state.attitude, ca.vertcat(_euclidean(state), parameter), self.interval
        )
        after = _with(attitude, euclidean)
        tracked = self.law.path.track(after.position, euclidean[11])
        return ca.vertcat(join(after), tracked, tracked, controls[0]), controls[0]

    def _sampled(self, loop_state: Any, state: StateGraph, time: Any, noise: Any) -> tuple[Any, Any]:
        """Graph: the input is computed once from what is measured and held while the true vehicle moves."""
        seen = measured(state, noise) if self.noisy else state
        parameter = self.law.path.track(seen.position, loop_state[PARAMETER])
        if self.feedback == "middle":
            used = self._moved(self.law.vehicle, seen, loop_state[HELD], time, self.interval / 2)
            used_parameter = self.law.path.track(used.position, parameter)
            control, linearization = self._control(used, used_parameter, time + self.interval / 2)
            ahead = used_parameter + self.interval / 2 * linearization.outputs.tangential[1]
        else:
            control, linearization = self._control(seen, parameter, time)
            ahead = parameter + self.interval * linearization.outputs.tangential[1]
        symbols = ca.SX.sym("state", STATE_SIZE), ca.SX.sym("input", 4), ca.SX.sym("time")
        moved = self._moved(self.truth, split(symbols[0]), symbols[1], symbols[2], self.interval / self.substeps)
        substep = ca.Function("substep", symbols, ca.cse([join(moved)]))
        vector = join(state)
        for k in range(self.substeps):
            vector = substep(vector, control, time + k * self.interval / self.substeps)
        true_parameter = self.law.path.track(vector[:3], loop_state[TRUE_PARAMETER])
        return ca.vertcat(vector, ahead, true_parameter, control), control

    def _moved(self, vehicle: Vehicle, state: StateGraph, control: Any, time: Any, step: float) -> StateGraph:
        """Graph: return the state after one integration step with the input held."""

        def field(now: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
            current = _with(attitude, euclidean)
            return current.angular_velocity, self._vehicle_rate(vehicle, current, control)

        return _with(*self.integrator.advance(field, time, state.attitude, _euclidean(state), step))

    @staticmethod
    def _vehicle_rate(vehicle: Vehicle, state: StateGraph, control: Any) -> Any:
        """Graph: return the rate SX (11,) of the Euclidean parts of a state."""
        return ca.vertcat(*vehicle.rates(state, control[0], control[1:4]))

    def _observation(self, state: StateGraph, parameter: Any, control: Any) -> Any:
        """Graph: return input, xi, eta, the yaw output and the focal margin, of the true state and vehicle."""
        true = linearize(self.truth, self.law.path, state, parameter, self.law.yaw_output)
        outputs = true.outputs
        return ca.vertcat(control, ca.vec(outputs.transverse), outputs.tangential, true.yaw_value, outputs.focal_margin)


def interval_of(feedback: str, step: float, rate: float | None) -> tuple[float, int]:
    """Return the interval [s] between rows and the integration steps in it, from a longest step [s] and a control rate [Hz].

    Raises:
        InputError: A rate with continuous feedback, none with sampled feedback, or far more steps than an interval can
            need.
    """
    if feedback == "continuous":
        if rate is not None:
            raise InputError(
                f"continuous feedback has no control rate (got {rate:g} Hz); leave it out, or choose feedback 'start' or 'middle'"
            )
        return step, 1
    if rate is None:
        raise InputError(f"feedback {feedback!r} needs a control rate [Hz] (got none); give one, such as 400")
    substeps = max(1, math.ceil(1 / rate / step - 1e-9))
    if substeps > MOST_SUBSTEPS:
        raise InputError(
            f"a control interval must hold at most {MOST_SUBSTEPS} integration steps (got {substeps}); raise the step or the rate"
        )
    return 1 / rate, substeps


def _euclidean(state: StateGraph) -> Any:
    """Graph: return everything but the attitude, SX (11,)."""
    return ca.vertcat(state.position, state.velocity, state.angular_velocity, state.thrust, state.thrust_rate)


def _with(attitude: Any, euclidean: Any) -> StateGraph:
    """Graph: return the state of an attitude and the Euclidean parts; entries after the eleventh are ignored."""
    return StateGraph(euclidean[0:3], euclidean[3:6], attitude, euclidean[6:9], euclidean[9], euclidean[10])


Progress = Callable[[int, int], None]
"""Called with (steps done, steps in all)."""

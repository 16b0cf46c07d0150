"""From a vehicle, a path and poles to the feedback law, Eqs. (23), (25), (26)."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar.checks import number
from gammastar.errors import InputError, PoleError, SingularStartError, UnknownNameError
from gammastar.law.gains import chain_poles, gains_from_poles, without_slowest
from gammastar.law.linearization import Linearization, decoupling_matrix, linearize
from gammastar.law.predict import Initial, Prediction, predict
from gammastar.law.reference import AnyReference
from gammastar.path import Path
from gammastar.vehicle import State, StateGraph, Vehicle, split

DEFAULT_POLES = (-2.2, -2.4, -2.6, -2.8)  # [1/s] distinct and near -2.5, the design's choice for the paper's scenarios
DEFAULT_YAW_POLE = -2.5  # [1/s]
CHAINS = {"transverse": 4, "transverse_2": 4, "tangential": 4, "speed": 3, "yaw": 1}  # states that each chain has
SMALLEST_MARGIN = 1e-6  # focal margin at which a start counts as singular; the law's gain grows as its inverse
YAW_RATE_RANGE = 100.0  # [rad/s] over which the slope of a yaw output is checked

Poles = complex | Sequence[complex] | Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Control:
    """Graph: what one evaluation of the law gives."""

    input: Any  # SX (4,): second derivative of the thrust [N/s^2], torque [N m], body
    linearization: Linearization


@dataclass(frozen=True, eq=False)
class Law:
    """A path-following law: parameters only, no history; made by `design`."""

    vehicle: Vehicle  # as the law believes it to be
    path: Path
    poles: Mapping[str, tuple[complex, ...]]  # [1/s] by chain: transverse, transverse_2, tangential, speed, yaw
    yaw_output: Callable[[Any], Any]  # graph: beta(r), Eq. (14)

    @functools.cached_property
    def gains(self) -> dict[str, np.ndarray]:
        """Return the gains by chain, k_1 first; Eqs. (25), (26)."""
        return {chain: gains_from_poles(poles) for chain, poles in self.poles.items()}

    def tangential_gains(self, holds_position: bool) -> np.ndarray:
        """Return (k_1, ..., k_4) of the chain along the path; without a position to hold k_1 is zero, Eq. (26)."""
        return self.gains["tangential"] if holds_position else np.concatenate([[0.0], self.gains["speed"]])

    def control(
        self, state: StateGraph, parameter: Any, reference: Any, yaw_reference: Any, holds_position: bool
    ) -> Control:
        """Graph: return the input at a state.

        Args:
            state: Measured state.
            parameter: SX, tracked path parameter.
            reference: SX (5,), reference coordinate along the path and its first four derivatives.
            yaw_reference: SX (2,), reference of beta(r) and its rate.
            holds_position: Whether the reference coordinate counts, or only its derivatives.
        """
        linearization = linearize(self.vehicle, self.path, state, parameter, self.yaw_output)
        outputs = linearization.outputs
        per_row = [self.gains["transverse"]] * (self.path.components - 1) + [self.gains["transverse_2"]]
        transverse_rate = -ca.sum2(ca.DM(np.array(per_row)) * outputs.transverse)
        tangential_rate = reference[4] - ca.dot(
            ca.DM(self.tangential_gains(holds_position)), outputs.tangential - reference[:4]
        )
        yaw_rate = yaw_reference[1] - self.gains["yaw"][0] * (linearization.yaw_value - yaw_reference[0])
        return Control(linearization.input_for(transverse_rate, tangential_rate, yaw_rate), linearization)

    def predict(
        self, start: State, reference: AnyReference, times: np.ndarray, yaw_reference: float = 0.0
    ) -> Prediction:
        """Return the closed-form flight of the exact model under continuous feedback.

        Valid while the predicted thrust is positive and no focal point is met.  Neighbouring times of an implicit path
        should be close enough for Newton steps from one to the next (a hundredth of a second).

        Args:
            start: As in `fly`.
            reference: Along the path.
            times: (n,) [s], increasing from zero or later.
            yaw_reference: Constant reference of beta(r).

        Raises:
            SingularStartError: The law has no input at the start.
            InputError: Times not increasing or negative.
        """
        x, parameter = self.start_vector(start)
        xi, eta, _ = self.transformed_state(start)
        fixed = reference.resolved(self.path, parameter)
        gains = self.gains | {"tangential": self.tangential_gains(fixed.holds_position)}
        initial = Initial(x[:3], parameter, xi, eta[:4], float(eta[4]))
        return predict(self.vehicle, self.path, gains, initial, fixed, number(yaw_reference, "yaw reference"), times)

    def decoupling_matrix(self, state: State) -> np.ndarray:
        """Return D, Eq. (17), (n + 2, 4) at a state; n is 3 for a curve and 2 for an implicit path."""
        x, parameter = self.start_vector(state)
        return np.array(self._numbers(x, parameter)[0])

    def transformed_state(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return xi (n, 4), eta (5,) with the yaw output last, and mu (7,), Eqs. (19), (20), at a state."""
        x, parameter = self.start_vector(state)
        _, xi, eta, mu, _, _ = self._numbers(x, parameter)
        return np.array(xi), np.array(eta).ravel(), np.array(mu).ravel()

    def start_vector(self, start: State) -> tuple[np.ndarray, float]:
        """Return the stacked start (20,) with an open thrust filled in, and its path parameter.

        Raises:
            SingularStartError: The thrust is zero or negative, or the position is a focal point of the path.
        """
        x = start.vector(self.vehicle.weight)
        parameter = self.path.start_parameter(x[:3])
        if not x[18] > 0:
            raise SingularStartError(
                f"thrust at the start must be positive (got {x[18]:.4g} N); in free fall the attitude has no "
                "effect on the motion: start with thrust, such as the weight, or give a vehicle without gravity a start thrust",
                {"thrust_N": float(x[18])},
            )
        margin = float(self._numbers(x, parameter)[4])
        if not margin > SMALLEST_MARGIN:
            raise SingularStartError(
                f"the start must have one nearest point of the path (got position {x[:3].tolist()} with focal margin {margin:.3g}); "
                "move it off the focal set, such as the axis of a circle",
                {"focal_margin": margin},
            )
        return x, parameter

    @functools.cached_property
    def _numbers(self) -> Any:
        """The function (state, parameter) -> D, xi, eta with yaw output, mu, focal margin, slope of beta."""
        state, parameter = ca.SX.sym("state", 20), ca.SX.sym("parameter")
        linear = linearize(self.vehicle, self.path, split(state), parameter, self.yaw_output)
        eta = ca.vertcat(linear.outputs.tangential, linear.yaw_value)
        results = [
            decoupling_matrix(linear),
            linear.outputs.transverse,
            eta,
            linear.internal_state(),
            linear.outputs.focal_margin,
            linear.yaw_slope,
        ]
        return ca.Function("numbers", [state, parameter], ca.cse([ca.densify(result) for result in results]))


def design(
    vehicle: Vehicle, path: Path, poles: Poles = DEFAULT_POLES, yaw_output: Callable[[Any], Any] | None = None
) -> Law:
    """Return the path-following law of a vehicle and a path with prescribed poles.

    Args:
        vehicle: As the law believes it to be.
        path: Curve or implicit path.
        poles: [1/s] One number for every pole; four numbers for the transverse and tangential chains alike; or a
            mapping with the keys 'transverse', 'transverse_2' (implicit paths only: its own poles for s2),
            'tangential', 'speed' (three, used when only a speed is asked for) and 'yaw', each one number or as many as
            the chain has states.  What a mapping leaves out keeps the default; 'speed' follows 'tangential' without its
            slowest pole.
        yaw_output: Graph beta(r) of Eq. (14), smooth and with a slope that never vanishes; r itself when left out.

    Raises:
        PoleError: Unstable or unpaired poles, or a number of poles that does not fit.
        InputError: The slope of the yaw output vanishes.
    """
    chosen: dict[str, Any] = {"transverse": DEFAULT_POLES, "tangential": DEFAULT_POLES, "yaw": DEFAULT_YAW_POLE}
    if isinstance(poles, Mapping):
        for key in poles:
            if key not in CHAINS:
                raise UnknownNameError("a chain of poles", key, CHAINS)
        if "transverse_2" in poles and path.components == 3:
            raise PoleError(
                "transverse_2 poles need an implicit path (got a curve, whose normal plane has no preferred axes); "
                "give 'transverse' alone, or use an implicit path"
            )
        chosen.update(poles)
    else:
        chosen.update(transverse=poles, tangential=poles, yaw=poles if np.ndim(poles) == 0 else DEFAULT_YAW_POLE)
    chosen.setdefault("transverse_2", chosen["transverse"])
    resolved = {chain: chain_poles(chosen[chain], CHAINS[chain], chain) for chain in chosen}
    resolved.setdefault("speed", without_slowest(resolved["tangential"]))
    law = Law(vehicle, path, resolved, yaw_output or _body_rate)
    assert law.gains  # refuses bad poles now, not in flight
    _check_yaw_output(law.yaw_output)
    return law


def _body_rate(yaw_rate: Any) -> Any:
    """Graph: the paper's simplest beta: r itself."""
    return yaw_rate


def _check_yaw_output(yaw_output: Callable[[Any], Any]) -> None:
    symbol = ca.SX.sym("yaw_rate")
    value = ca.SX(yaw_output(symbol))
    slope = ca.Function("slope", [symbol], [ca.densify(ca.jacobian(value, symbol))])
    grid = np.linspace(-YAW_RATE_RANGE, YAW_RATE_RANGE, 2001)
    slopes = np.array(slope(grid[None, :])).ravel()
    worst = int(np.argmin(np.abs(slopes)))
    if not np.all(np.isfinite(slopes)) or np.any(slopes == 0) or np.any(np.sign(slopes) != np.sign(slopes[0])):
        raise InputError(
            f"the yaw output beta(r) must be smooth with a slope that never vanishes (got slope {slopes[worst]:.3g} at "
            f"r = {grid[worst]:.3g} rad/s); use a strictly monotonic function such as r or sinh(r)"
        )

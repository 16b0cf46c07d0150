"""The feedback law as a graph: Eqs. (23), (25), (26)."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.errors import InputError
from gammastar.law.approach import Approach, bounded, slowed
from gammastar.law.filter import KalmanFilter
from gammastar.law.gains import gains_from_poles
from gammastar.law.heading import Heading
from gammastar.law.linearization import Linearization, linearize, yaw_terms
from gammastar.law.observer import IntegralAction, Rejection
from gammastar.path import Path, PathOutputs
from gammastar.taylor import Series
from gammastar.vehicle import NOTHING, StateGraph, Unknown, Vehicle

SMALLEST_MARGIN = 1e-6  # focal margin at which a start counts as singular; the law's gain grows as its inverse

Yaw = float | Heading


@dataclass(frozen=True, eq=False)
class Control:
    """Graph: what one evaluation of the law gives."""

    input: Any  # SX (4,): second derivative of the thrust [N/s^2], torque [N m], body
    linearization: Linearization
    rates: tuple[Any, Any, Any]  # SX: wanted highest derivatives of the transverse, tangential and yaw outputs

    def along(self) -> Any:
        """Graph: return what the input SX (4,) gains by one unit of the highest derivative along the path; the input is affine in it."""
        transverse, _, yaw = self.rates
        along = ca.SX.sym("along")
        return ca.jacobian(self.linearization.input_for(transverse, along, yaw), along)


class RateControl(NamedTuple):
    """Graph: what one evaluation of a law with the interface 'rates' gives."""

    thrust_rate: Any  # SX [N/s]
    rates: Any  # SX (2,) [rad/s], about the first two body axes
    outputs: PathOutputs  # at zero jerk


@dataclass(frozen=True, eq=False)
class Feedback:
    """The graph of a path-following law: parameters only, no history."""

    vehicle: Vehicle  # as the law believes it to be
    path: Path
    poles: Mapping[str, tuple[complex, ...]]  # [1/s] by chain: transverse, transverse_2, tangential, speed, yaw
    yaw_output: Callable[[Any], Any]  # graph: beta(r), Eq. (14)
    approach: Approach | None = None  # from anywhere; None is the paper's law and nothing else
    rejection: Rejection | None = None  # what estimates the unknown while an autopilot flies the law
    estimator: KalmanFilter | None = None  # what the law believes of its motion; None takes measurements as they are
    interface: str = "wrench"  # what is commanded: 'wrench' or 'rates', see `design`

    def __post_init__(self) -> None:
        if self.interface == "rates" and isinstance(self.rejection, IntegralAction):
            raise InputError(
                "a law that commands body rates needs an Observer (got IntegralAction, which corrects the snap); use gs.Observer()"
            )

    @functools.cached_property
    def gains(self) -> dict[str, Any]:
        """Return the gains by chain, k_1 first, (n,) numbers, or graphs of a law from `tuned`; Eqs. (25), (26)."""
        distinct = {poles: gains_from_poles(poles) for poles in dict.fromkeys(self.poles.values())}
        return {chain: distinct[poles] for chain, poles in self.poles.items()}

    def tangential_gains(self, holds_position: bool) -> Any:
        """Return (k_1, ..., k_4) of the chain along the path, one less for rates; without a position to hold k_1 is zero, Eq. (26)."""
        speed = self.gains["speed"]
        if holds_position:
            return self.gains["tangential"]
        return ca.vertcat(0, speed) if isinstance(speed, ca.SX) else np.concatenate([[0.0], speed])

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return what names the law's graph: laws with one signature differ in their path's data alone."""
        chains = tuple((chain, *gains.tolist()) for chain, gains in self.gains.items())
        return (
            *(self.vehicle.signature, self.path.graph_key, chains, self._yaw_output_key),
            *(self.approach, self.rejection, self.estimator, self.interface),
        )

    @property
    def _yaw_output_key(self) -> str:
        """The graph of beta as text: a function over changed data is another one, however equal the objects are."""
        symbol = ca.SX.sym("yaw_rate")
        return str(ca.Function("beta", [symbol], [ca.SX(self.yaw_output(symbol))]).serialize())

    def control(
        self,
        state: StateGraph,
        place: Any,
        reference: Any,
        yaw: Any,
        holds_position: bool,
        unknown: Unknown = NOTHING,
        pace: Any = 1,
    ) -> Control:
        """Graph: return the input at a state.

        Args:
            state: Measured state.
            place: SX (1 + data_size,), tracked path parameter followed by the path's data there.
            reference: SX (5,), reference coordinate along the path and its first four derivatives; or a function that returns it
                from eta_1 ... eta_4, SX (4,).
            yaw: Constant reference of beta(r), or SX (2,) with its rate, or a heading.
            holds_position: Whether the reference coordinate counts, or only its derivatives.
            unknown: What acts on the vehicle beyond its model.
            pace: Share of the reference's speed that is asked for.
        """
        linearization = linearize(self.vehicle, self.path, state, place, self.yaw_output, unknown)
        wanted = self._wanted(linearization.outputs, reference, holds_position, 4, pace)
        yaw_rate = self._yaw_rate(yaw, state, place, linearization.outputs.tangential[1], linearization.yaw_value)
        rates = (*wanted, yaw_rate)
        return Control(linearization.input_for(*rates), linearization, rates)

    def _wanted(
        self, outputs: PathOutputs, reference: Any, holds_position: bool, order: int, pace: Any
    ) -> tuple[Any, Any]:
        """Graph: return the derivatives of an order, four or three, that the transverse and tangential outputs are to have."""
        if callable(reference):
            reference = reference(outputs.tangential)
        reference = ca.vertcat(reference[0], pace * reference[1:])
        if self.approach is not None:
            reference = ca.vertcat(reference[0], slowed(outputs.transverse[:, 0], self.longest_error) * reference[1:])
        transverse, error = outputs.transverse[:, :order], outputs.tangential[:order] - reference[:order]
        error = ca.vertcat(pace * error[0], error[1:])
        if self.approach is not None:
            transverse = ca.horzcat(bounded(transverse[:, 0], self.longest_error), transverse[:, 1:])
            along = self.longest_error * ca.norm_2(outputs.tangential_gradient)
            error = ca.vertcat(bounded(error[0], along), error[1:])
        per_row = [self.gains["transverse"]] * (self.path.components - 1) + [self.gains["transverse_2"]]
        transverse_rate = -ca.sum2(ca.horzcat(*map(_graph, per_row)).T * transverse)
        return transverse_rate, reference[order] - ca.dot(_graph(self.tangential_gains(holds_position)), error)

    def rate_control(
        self,
        state: StateGraph,
        place: Any,
        reference: Any,
        holds_position: bool,
        unknown: Unknown = NOTHING,
        pace: Any = 1,
    ) -> RateControl:
        """Graph: return the thrust rate and the body rates about the first two axes at a state, for a law with the interface 'rates'.

        The third derivatives of the outputs are affine in the jerk as the fourth ones are in the snap; body rates and thrust rate of
        the state are not used.  Arguments as in `control`.
        """
        still = ca.SX.zeros(3)
        series = [state.position, state.velocity, self.vehicle.acceleration(state, unknown), still]
        outputs = self.path.outputs(Series.from_derivatives(series), place)
        transverse, tangential = self._wanted(outputs, reference, holds_position, 3, pace)
        jerk = outputs.snap(
            outputs.transverse_drift + transverse - outputs.transverse[:, 3],
            outputs.tangential_drift + tangential - outputs.tangential[3],
        )
        thrust_rate, rates = self.vehicle.rates_for(state, jerk, state.angular_velocity[2], unknown)
        return RateControl(thrust_rate, rates[:2], outputs)

    def wait_by_rates(self, state: StateGraph, place: Any, unknown: Unknown = NOTHING) -> tuple[Any, Any]:
        """Graph: return thrust rate and body rates SX (2,) that bring the vehicle to a fixed place of the path, as `wait` does."""
        error = bounded(state.position - self.path.foot(state.position, place), self.longest_error)
        chain = ca.horzcat(error, state.velocity, self.vehicle.acceleration(state, unknown))
        jerk = -ca.mtimes(chain, _graph(self.gains["transverse"]))
        thrust_rate, rates = self.vehicle.rates_for(state, jerk, state.angular_velocity[2], unknown)
        return thrust_rate, rates[:2]

    def yaw_acceleration(self, yaw: Any, state: StateGraph, place: Any, parameter_rate: Any) -> Any:
        """Graph: return the r' [rad/s^2] that the chain of the yaw output asks for."""
        value, slope = yaw_terms(self.yaw_output, state.angular_velocity[2])
        return self._yaw_rate(yaw, state, place, parameter_rate, value) / slope

    def wait(self, state: StateGraph, place: Any, yaw: Any, unknown: Unknown = NOTHING) -> Any:
        """Graph: return the input SX (4,) that brings the vehicle to a fixed place of the path and holds it there.

        The chain of the transverse outputs in all three directions, with the same poles and the same bound.
        """
        error = bounded(state.position - self.path.foot(state.position, place), self.longest_error)
        acceleration, jerk = self.vehicle.acceleration(state, unknown), self.vehicle.jerk(state, unknown)
        chain = ca.horzcat(error, state.velocity, acceleration, jerk)
        snap = -ca.mtimes(chain, _graph(self.gains["transverse"]))
        return self.vehicle.input_for(state, snap, self.yaw_acceleration(yaw, state, place, ca.SX(0)), unknown)

    @property
    def lead(self) -> Any:
        """Return the time [s] in which a velocity across the path dies out: k_2 / k_1, the sum of the poles' time constants."""
        return self.gains["transverse"][1] / self.gains["transverse"][0]

    @property
    def longest_error(self) -> Any:
        """Return the length [m] to which an approach cuts the transverse error: e_max = speed k_2 / k_1."""
        assert self.approach is not None
        return self.approach.speed * self.lead

    def _yaw_rate(self, yaw: Any, state: StateGraph, place: Any, parameter_rate: Any, value: Any) -> Any:
        """Graph: return the rate of beta(r) wanted, Eq. (26) with its sign corrected, for a constant reference or a heading."""
        if isinstance(yaw, Heading):
            wanted, wanted_rate = yaw.yaw_rate(self.path, state, place, parameter_rate)
            reference, slope = yaw_terms(self.yaw_output, wanted)
            reference_rate = slope * wanted_rate
        else:
            reference, reference_rate = ca.vertsplit(ca.vertcat(yaw, 0)[:2])
        return reference_rate - self.gains["yaw"][0] * (value - reference)


def _graph(gains: Any) -> Any:
    """Graph: return gains as a column, whether they are numbers or graphs already."""
    return gains if isinstance(gains, ca.SX) else ca.DM(gains)

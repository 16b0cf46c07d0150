"""What acts on the vehicle beyond its model, estimated while it flies: an observer, and integral action as the simple alternative.

Both are parameters only.  Their memory is a vector that the controller keeps: `start` gives its first value, `advanced` is the graph of
one control interval, `unknown` reads the estimate from it.  The two have the same methods, so a controller need not ask which it has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca
import numpy as np

from gammastar.checks import magnitude
from gammastar.errors import PoleError
from gammastar.law.gains import chain_poles, describe, gains_from_poles
from gammastar.law.measurement import fresh_axes
from gammastar.vehicle import Unknown

FRESH = (1.0, 1.0)  # all axes of velocity and angular velocity were measured in this interval
FORCE_SIZE, TORQUE_SIZE = 15, 9  # four and two vectors, and the age of the measurement that drives each axis
CHAIN_TOLERANCE = 1e-3  # relative, of roots near a double one, which rounding moves by its square root


class Rejection(Protocol):
    """What a controller needs of an estimator of the unknown: `Observer` and `IntegralAction`."""

    @property
    def size(self) -> int:
        """Return how many numbers it remembers."""

    def start(self, velocity: Any, angular_velocity: Any) -> Any:
        """Graph: return the first memory (size,) for a vehicle with this velocity (3,) [m/s], world, and these body rates (3,) [rad/s]."""

    def advanced(
        self,
        estimate: Any,
        velocity: Any,
        angular_velocity: Any,
        acceleration: Any,
        angular_acceleration: Any,
        interval: float,
        error: Any,
        fresh: Any = FRESH,
    ) -> Any:
        """Graph: return the memory SX (size,) after one more control interval, at whose end the measurements were taken.

        Args:
            estimate: SX (size,), memory at the end of the interval before.
            velocity: Measured, SX (3,) [m/s], world.
            angular_velocity: Measured, SX (3,) [rad/s], body.
            acceleration: SX (3,) [m/s^2], world: mean over the interval of what the believed vehicle does under the wrench that the
                allocation really gave, without anything unknown.
            angular_acceleration: The same, SX (3,) [rad/s^2], body.
            interval: [s].
            error: SX (3,) [m], world: position less its nearest point on the path, or less a target that waits.
            fresh: Freshness of velocity and angular velocity in this interval, see `gammastar.law.measurement`.
        """

    def unknown(self, estimate: Any) -> Unknown:
        """Graph: return what acts on the vehicle beyond its model, at the end of the interval."""


@dataclass(frozen=True)
class Observer:
    """Extended-state observers of the unknown force, with two derivatives, and of the unknown torque.

    The force observer's chain is (v, d, d', d'') with v' = a + d and d''' = 0, d an acceleration in world axes; the torque observer's
    is (Omega, t) with Omega' = w + t and t' = 0, t an angular acceleration in body axes.  Measured are v and Omega; a and w are what the
    model says.  Constant, ramp and parabola forces are followed without error, constant torques too.  Chains of integrators are
    discretised exactly: the poles of the error are exp(-bandwidth interval), at any interval.  A part left out (None) estimates zero.

    Where measurements come less often than control intervals, the estimate is predicted in between and the gain is the one for
    the time since the last measurement, which keeps the poles for any steady rate of the sensor.

    Raises:
        InputError: A bandwidth is not a finite positive number.
    """

    force: float | None = (
        40.0  # [rad/s] four equal poles at -force; measured to be good for a motor lag of milliseconds
    )
    torque: float | None = 120.0  # [rad/s] two equal poles at -torque

    def __post_init__(self) -> None:
        for name in ("force", "torque"):
            if (value := getattr(self, name)) is not None:
                checked = magnitude(value, f"bandwidth of the {name} observer [rad/s]", above=0)
                object.__setattr__(self, name, checked)

    @property
    def size(self) -> int:
        """Return how many numbers it remembers."""
        return (FORCE_SIZE if self.force is not None else 0) + (TORQUE_SIZE if self.torque is not None else 0)

    def start(self, velocity: Any, angular_velocity: Any) -> Any:
        """Graph: return the memory (size,) that knows the motion and no unknown yet."""
        force = [velocity, ca.DM.zeros(FORCE_SIZE - 3)] if self.force is not None else []
        torque = [angular_velocity, ca.DM.zeros(TORQUE_SIZE - 3)] if self.torque is not None else []
        return ca.vertcat(*force, *torque)

    def advanced(
        self,
        estimate: Any,
        velocity: Any,
        angular_velocity: Any,
        acceleration: Any,
        angular_acceleration: Any,
        interval: float,
        error: Any = None,
        fresh: Any = FRESH,
    ) -> Any:
        """Graph: return the memory SX (size,) at the time of the latest measurements; see `Rejection`.  The error is not used."""
        parts = []
        if self.force is not None:
            parts.append(_observed(estimate[:FORCE_SIZE], velocity, acceleration, self.force, interval, fresh[0]))
        if self.torque is not None:
            torque = estimate[self.size - TORQUE_SIZE :]
            parts.append(_observed(torque, angular_velocity, angular_acceleration, self.torque, interval, fresh[1]))
        return ca.vertcat(*parts) if parts else ca.SX(0, 1)

    def unknown(self, estimate: Any) -> Unknown:
        """Graph: return the estimate at the time of the latest measurements."""
        unknown = Unknown()
        if self.force is not None:
            unknown = Unknown(estimate[3:6], estimate[6:9], estimate[9:12])
        if self.torque is not None:
            unknown = unknown._replace(angular_acceleration=estimate[self.size - 6 : self.size - 3])
        return unknown


def observer_gains(count: int, bandwidth: Any, age: Any) -> list[Any]:
    """Graph: return the gains of a chain of two or four integrators whose error has equal poles p = exp(-bandwidth age).

    Ackermann's formula for the pair (F, C F), F = exp(A age), C = (1, 0, ...): the error after the correction is (I - L C) F times the
    one before.  For equal poles these are the fading-memory polynomial filters (Morrison, Introduction to Sequential Smoothing and
    Prediction, 1969, chapter 13).
    """
    q = -ca.expm1(-bandwidth * age)
    p = 1 - q
    if count == 2:
        return [q * (1 + p), q**2 / age]
    return [
        q * (1 + p) * (1 + p**2),
        q**2 * (11 + 14 * p + 11 * p**2) / (6 * age),
        2 * q**3 * (1 + p) / age**2,
        q**4 / age**3,
    ]


def _observed(estimate: Any, measured: Any, rate: Any, bandwidth: Any, interval: float, fresh: Any) -> Any:
    """Graph: return one chain after an interval, predicted with the model's mean rate and corrected where a measurement is fresh.

    A chain is its vectors, value first, and at the end, by axis, the time since the last measurement.
    """
    chain, age, new = ca.reshape(estimate[:-3], 3, -1), estimate[-3:] + interval, fresh_axes(fresh)
    count = chain.shape[1]
    predicted = [_taylor(chain[:, k:], interval) for k in range(count)]
    predicted[0] += rate * interval
    innovation = new * (measured - predicted[0])
    at_once = observer_gains(count, bandwidth, ca.DM(interval))
    later = observer_gains(count, bandwidth, age)
    usual, other = (
        [value + gain * innovation for value, gain in zip(predicted, gains, strict=True)] for gains in (at_once, later)
    )
    corrected = [ca.if_else(age == interval, *pair) for pair in zip(usual, other, strict=True)]
    return ca.vertcat(*corrected, (1 - new) * age)


def _taylor(derivatives: Any, interval: Any) -> Any:
    """Graph: return what a value (first column) becomes after an interval when its last derivative is constant."""
    value = derivatives[:, -1]
    for k in range(derivatives.shape[1] - 1, 0, -1):
        value = derivatives[:, k - 1] + value * (interval / k)
    return value


@dataclass(frozen=True)
class IntegralAction:
    """An integral of the error across the path, in world axes, that the law subtracts from its snap: the simple alternative.

    With i' = g e the chains of the transverse outputs become e^(5) + k_4 e^(4) + ... + k_1 e' + g e = 0, and g is such that `pole` is a
    root: g = pole times the product of (pole - p_i) over the law's poles p_i (their number is even).  The error across goes to zero
    under any steady disturbance as long as the directions across stay: on a straight path, or where the vehicle holds.  On a bent
    one a steady force turns against the path, and an error is left; the observer has no such limit.

    Raises:
        PoleError: The pole is not finite or positive, or so fast that the integral would make another one slower than it.
    """

    pole: float  # [rad/s] of the integral, positive
    chain: complex | Sequence[complex]  # [1/s] poles of the law's transverse chain, law.poles["transverse"]
    largest: float = (
        5.0  # [m/s^2] steady unknown acceleration that it can balance; beyond, it stands still and does not wind up
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "chain", chain_poles(self.chain, 4, "transverse"))
        object.__setattr__(self, "pole", magnitude(self.pole, "pole of the integral action [rad/s]", above=0))
        object.__setattr__(self, "largest", magnitude(self.largest, "largest balanced acceleration [m/s^2]", above=0))
        roots = np.roots([1.0, *gains_from_poles(self.chain)[::-1], self.gain])
        if roots.real.max() > -self.pole * (1 - CHAIN_TOLERANCE):
            raise PoleError(
                f"the integral action must be the slowest pole (got {self.pole:g} rad/s beside {describe(np.asarray(self.chain))}, "
                f"which moves another one to {roots.real.max():.3g}); a fifth of the law's poles always works for equal ones"
            )

    @property
    def gain(self) -> float:
        """Return g [1/s^5], which puts one root of the extended chain at minus the pole."""
        return float(self.pole * np.prod(self.pole + np.asarray(self.chain)).real)

    @property
    def size(self) -> int:
        """Return how many numbers it remembers."""
        return 3

    def start(self, velocity: Any, angular_velocity: Any) -> Any:
        """Graph: return an empty integral (3,)."""
        return ca.DM.zeros(3)

    def advanced(
        self,
        estimate: Any,
        velocity: Any,
        angular_velocity: Any,
        acceleration: Any,
        angular_acceleration: Any,
        interval: float,
        error: Any,
        fresh: Any = FRESH,
    ) -> Any:
        """Graph: return the integral SX (3,) [m/s^4], world; see `Rejection`.  Only the error is used."""
        grown = estimate + self.gain * interval * error
        most = (
            float(gains_from_poles(self.chain)[2]) * self.largest
        )  # a steady acceleration d ends at e = 0 with i = k_3 d
        return grown * (most / ca.fmax(most, ca.norm_2(grown)))

    def unknown(self, estimate: Any) -> Unknown:
        """Graph: return the integral as an unknown snap, which the law subtracts."""
        return Unknown(snap=estimate)

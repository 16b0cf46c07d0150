"""What an autopilot believes: how it moves, from its sensors and its model, and what acts on it beyond that model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine, so3
from gammastar.law.law import Law
from gammastar.law.lookahead import Lookahead
from gammastar.law.measurement import Measurement
from gammastar.vehicle import Unknown


@dataclass(frozen=True, eq=False)
class Belief:
    """The estimator and the observer of a law, once a control interval; either may be missing."""

    law: Law
    interval: float  # [s]

    @property
    def lookahead(self) -> Lookahead:
        """Return the vehicle as it is believed to move."""
        return Lookahead(self.law.vehicle, self.law.interface)

    def start(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first memories of observer and estimator, an interval before a stacked state (20,)."""
        rejection, before = self.law.rejection, self._before(state)
        memory = np.empty(0) if rejection is None else rejection.start(before[3:6], before[15:18])
        return memory, self._first_estimate(before)

    def estimated(self, estimate: Any, rejection: Any, told: Measurement, wrench: Any) -> tuple[Measurement, Any]:
        """Graph: return the motion that the law is to believe in, and the next memory of the estimator; as measured without one."""
        estimator = self.law.estimator
        if estimator is None:
            return told, ca.SX(0, 1)
        _, velocity, attitude, rates = estimator.estimate(estimate)
        unknown = Unknown() if self.law.rejection is None else self.law.rejection.unknown(rejection)
        middle = attitude @ so3.exp(rates * self.interval / 2)
        acceleration, turning = self.lookahead.accelerations(velocity, middle, rates, wrench, unknown)
        after = estimator.advanced(estimate, told, acceleration, turning, self.interval)
        position, velocity, attitude, rates = estimator.estimate(after)
        return Measurement(position, velocity, attitude, rates, ca.SX.ones(4)), after

    def rejected(
        self, rejection: Any, told: Measurement, measured: Measurement, wrench: Any, place: Any
    ) -> tuple[Any, Unknown]:
        """Graph: return the next memory of the observer, and what it says; nothing without one.

        It is driven by the samples themselves: an estimate moves with the unknown that it is told, so an observer of an estimate
        would confirm itself between two samples, and see each of them as a jump within one interval.
        """
        observer = self.law.rejection
        if observer is None:
            return ca.SX(0, 1), Unknown()
        acceleration, turning = self._meanwhile(told.velocity, told.attitude, told.angular_velocity, wrench)
        error = told.position - self.law.path.foot(told.position, place)
        memory = observer.advanced(
            *(rejection, measured.velocity, measured.angular_velocity, acceleration, turning),
            *(self.interval, error, (measured.fresh[1], measured.fresh[3])),
        )
        return memory, observer.unknown(memory)

    def _first_estimate(self, state: np.ndarray) -> np.ndarray:
        """Return the first memory of the estimator; nothing without one."""
        if self.law.estimator is None:
            return np.empty(0)
        return self.law.estimator.start(state[:3], state[3:6], so3.unstack(state[6:15]), state[15:18])

    def _before(self, state: np.ndarray) -> np.ndarray:
        """Return the motion (18,) an interval before a stacked state (20,), from where the first step leads estimates to it."""

        def build() -> Any:
            motion, thrust, h = ca.SX.sym("motion", 18), ca.SX.sym("thrust"), self.interval
            position, velocity, attitude, rates = ca.vertsplit(motion, [0, 3, 6, 15, 18])
            wrench = ca.vertcat(thrust, 0, 0, 0)
            acceleration, turning = self._meanwhile(velocity, so3.unstack(attitude), rates, wrench)
            earlier = position - h * velocity + h**2 / 2 * acceleration, velocity - h * acceleration
            turned = so3.unstack(attitude) @ so3.exp(-h * (rates - h / 2 * turning))
            parts = ca.vertcat(*earlier, so3.stack(turned), rates - h * turning)
            return ca.Function("before", [motion, thrust], [ca.densify(parts)])

        key = ("before", self.law.vehicle.signature, self.law.interface, self.interval)
        return np.asarray(engine.compiled(key, build)(state[:18], state[18]).full()[:, 0])

    def _meanwhile(self, velocity: Any, attitude: Any, angular_velocity: Any, wrench: Any) -> tuple[Any, Any]:
        """Graph: return what the model did in the mean of the interval that ends with this motion, under a wrench SX (4,).

        The acceleration SX (3,), world, and the angular acceleration SX (3,), body.
        """
        middle = attitude @ so3.exp(-angular_velocity * self.interval / 2)
        rates = angular_velocity - self.interval / 2 * self.lookahead.turning(angular_velocity, wrench, Unknown())
        return self.lookahead.accelerations(velocity, middle, rates, wrench, Unknown())

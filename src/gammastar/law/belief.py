"""What an autopilot believes: how it moves, from its sensors and its model, and what acts on it beyond that model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine, so3
from gammastar.law.filter import MOTION
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

    def start(self, motion: Any, thrust: Any) -> tuple[Any, Any]:
        """Graph: return the first memories of observer and estimator, an interval before a motion (18,) under a thrust [N]."""
        rejection, estimator, before = self.law.rejection, self.law.estimator, self._before(motion, thrust)
        memory = ca.DM(0, 1) if rejection is None else rejection.start(before[3:6], before[15:18])
        if estimator is None:
            return memory, ca.DM(0, 1)
        spread = estimator.start(np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3))[MOTION:]
        return memory, ca.vertcat(before, ca.DM(spread))

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

    def _before(self, motion: Any, thrust: float) -> Any:
        """Graph: return the motion (18,) an interval before a motion (18,), from where the first step leads estimates to it."""

        def build() -> Any:
            motion, thrust, h = ca.SX.sym("motion", MOTION), ca.SX.sym("thrust"), self.interval
            position, velocity, attitude, rates = ca.vertsplit(motion, [0, 3, 6, 15, 18])
            wrench = ca.vertcat(thrust, 0, 0, 0)
            acceleration, turning = self._meanwhile(velocity, so3.unstack(attitude), rates, wrench)
            earlier = position - h * velocity + h**2 / 2 * acceleration, velocity - h * acceleration
            turned = so3.unstack(attitude) @ so3.exp(-h * (rates - h / 2 * turning))
            parts = ca.vertcat(*earlier, so3.stack(turned), rates - h * turning)
            return ca.Function("before", [motion, thrust], [ca.densify(parts)])

        key = ("before", self.law.vehicle.signature, self.law.interface, self.interval)
        return engine.compiled(key, build)(motion, thrust)

    def _meanwhile(self, velocity: Any, attitude: Any, angular_velocity: Any, wrench: Any) -> tuple[Any, Any]:
        """Graph: return what the model did in the mean of the interval that ends with this motion, under a wrench SX (4,).

        The acceleration SX (3,), world, and the angular acceleration SX (3,), body.
        """
        middle = attitude @ so3.exp(-angular_velocity * self.interval / 2)
        rates = angular_velocity - self.interval / 2 * self.lookahead.turning(angular_velocity, wrench, Unknown())
        return self.lookahead.accelerations(velocity, middle, rates, wrench, Unknown())

"""The two integrators in front of the thrust, advanced once a control interval and kept within limits.

zeta1 is meant for the instant at which the wrench of an interval is felt, zeta2 for half an interval before: staggered like this
(leapfrog) they follow u_d at second order, though the thrust is held.  For a law that commands body rates there is one integrator: zeta1
itself is half an interval behind, and zeta2 is the rate that was asked for last.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar.law.approach import FLOOR_POLE

SIZE = 3  # zeta1 [N], zeta2 [N/s], and the derivative of the last of them that was asked for
TRACKING = 100.0  # [1/s] at which zeta1 takes to what the rotors give; at once, law and limits would swing from interval to interval
NO_BOUND = 1e30  # of that derivative, where nothing limits the thrust


@dataclass(frozen=True, eq=False)
class ThrustStates:
    """How the thrust states move; their memory is SX (3,)."""

    interval: float  # [s]
    by_rates: bool  # whether the law commands body rates
    least: float  # [N] of zeta1; -inf without a floor
    most: float  # [N]; inf without a ceiling

    def start(self, thrust: Any, thrust_rate: Any) -> Any:
        """Graph: return the first memory (3,) from the thrust [N] and its rate [N/s] at the start."""
        first = thrust if self.by_rates else thrust + self.interval / 2 * thrust_rate
        return ca.vertcat(self._limited(first), thrust_rate, 0.0)

    def seen(self, memory: Any) -> tuple[Any, Any]:
        """Graph: return zeta1 and zeta2 when the command of this interval is felt; the last derivative carries them there."""
        first, second, derivative = ca.vertsplit(memory)
        if self.by_rates:
            return first + self.interval / 2 * second, second
        return first, second + self.interval / 2 * derivative

    def bounds(self, memory: Any) -> tuple[Any, Any]:
        """Graph: return least and most of the derivative that is asked for: those with which zeta1 decays to its limits."""
        zeta1, zeta2 = self.seen(memory)

        def towards(limit: float) -> Any:
            if np.isinf(limit):
                return ca.SX(np.copysign(NO_BOUND, limit))
            if self.by_rates:
                return -FLOOR_POLE * (zeta1 - limit)
            return -2 * FLOOR_POLE * zeta2 - FLOOR_POLE**2 * (zeta1 - limit)

        return towards(self.least), towards(self.most)

    def advanced(self, memory: Any, thrust: Any, derivative: Any) -> Any:
        """Graph: return the memory after an interval, from the thrust that is really given and the derivative that was asked for."""
        if self.by_rates:
            zeta1 = memory[0] + self.interval * derivative
            return ca.vertcat(self._limited(zeta1), derivative, 0)
        zeta2 = memory[1] + self.interval * derivative
        taken = memory[0] + -np.expm1(-TRACKING * self.interval) * (thrust - memory[0])
        return ca.vertcat(self._limited(taken + self.interval * zeta2), zeta2, derivative)

    def _limited(self, thrust: Any) -> Any:
        return ca.fmin(ca.fmax(thrust, self.least), self.most)

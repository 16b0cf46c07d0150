"""When a flight must end, and what to call it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.flight.record import FlightRecord, Status
from gammastar.vehicle.state import SIZE as STATE_SIZE

SMALLEST_FOCAL_MARGIN = 1e-9
LARGEST_TURN = 0.3  # [rad] in one integration step; beyond it no method of fixed step resolves the motion
NEAR = 0.1  # of a margin's usual size: a flight that breaks down this near to a singularity broke down because of it
RESOLVED_SHARE = 0.01  # of its largest distance to the path, by which a resolved flight may be beside its closed form
RESOLVED_ROWS = 400  # at about so many that is looked at, evenly spaced


LARGEST = float(np.finfo(float).max)
CODES = tuple(Status)  # by the numbers that graphs give them; zero goes on


def status_code(after: Any, observed: Any, least_thrust: Any, step: float, is_ideal: bool) -> Any:
    """Graph: return the number of the status with which a flight ends before a step that leads to a state and observes this.

    Args:
        after: SX (n,), state of the loop after the step; NaN and infinity are not kept.
        observed: SX (k,), its observation; third from its end whether a target waits, at its end the focal margin.
        least_thrust: SX [N]; below it the law divides by rounding.
        step: [s] of the integration.
        is_ideal: Whether the law acts by itself, so that the thrust is a state.
    """
    total = ca.sum1(after) + ca.sum1(observed)
    fired = {
        Status.NOT_FINITE: ca.logic_not(ca.fabs(total) <= LARGEST),
        Status.FREE_FALL: ca.logic_not(after[STATE_SIZE - 2] > least_thrust) if is_ideal else 0,
        Status.FOCAL_POINT: ca.logic_not(
            ca.logic_or(observed[-1] > SMALLEST_FOCAL_MARGIN, observed[observed.shape[0] - 3] > 0)
        ),
        Status.UNRESOLVED: turns_too_far(after, step),
    }
    code = ca.SX(0)
    for status, where in reversed(fired.items()):
        code = ca.if_else(where, CODES.index(status), code)
    return code


def turns_too_far(state: Any, step: float) -> Any:
    """Graph: return whether the body rates of a loop's state turn the attitude too far in one integration step [s]; NaN does."""
    return ca.logic_not(ca.norm_2(state[15:18]) * step < LARGEST_TURN)


@dataclass
class Watch:
    """Looks at a flight as it goes, ends it before the first step that must not be kept, and says which criterion fired."""

    least_thrust: float  # [N]
    step: float  # [s] of the integration
    is_ideal: bool
    status: Status = Status.COMPLETED

    def __call__(self, after: np.ndarray, observed: np.ndarray) -> int | None:
        """Return how many steps of a chunk come before the first bad one, or None."""
        sizes = len(after), len(observed)
        criteria = engine.compiled(("status", *sizes, self.step, self.is_ideal), lambda: self._criteria(*sizes))
        codes = criteria(after, observed, self.least_thrust).full().ravel().astype(int)
        if not codes.any():
            return None
        first = int((codes > 0).argmax())
        self.status = CODES[codes[first]]
        return first

    def _criteria(self, size: int, width: int) -> Any:
        after, observed, least = ca.SX.sym("after", size), ca.SX.sym("observed", width), ca.SX.sym("least")
        code = status_code(after, observed, least, self.step, self.is_ideal)
        return ca.Function("criteria", [after, observed, least], [code])


class Breakdown(NamedTuple):
    """Where a flight was when it broke down; numbers, or arrays over flights."""

    thrust: Any  # [N] in its last row
    thrust_rate: Any  # [N/s]
    mean_thrust: Any  # [N] over the flight
    focal: Any  # margin in its last row
    focal_before: Any  # in the row before that, or in the last where there is one
    mean_focal: Any


def nearest_singularity(status: Any, at: Breakdown, interval: float) -> np.ndarray:
    """Return the numbers of statuses, where breakdowns are explained by the nearer singularity, if one is near in its usual size.

    Args:
        status: Numbers of statuses; others than not finite and unresolved stay.
        at: The breakdowns.
        interval: [s] between rows.
    """
    with np.errstate(all="ignore"):
        focal = np.minimum(at.focal, 2 * at.focal - at.focal_before) / at.mean_focal
        thrust = np.minimum(at.thrust, at.thrust + interval * at.thrust_rate) / at.mean_thrust
    broke = np.isin(status, [CODES.index(Status.NOT_FINITE), CODES.index(Status.UNRESOLVED)])
    cause = np.where(thrust < focal, CODES.index(Status.FREE_FALL), CODES.index(Status.FOCAL_POINT))
    return np.where(broke & (np.fmin(thrust, focal) < NEAR), cause, status)


def is_resolved(record: FlightRecord) -> bool:
    """Return whether a nominal flight keeps to the closed form of its chains.

    Both are exact but for the integration, so what parts them is the step.  Small differences are for the summary to show.
    """
    rows = np.arange(0, len(record.time), max(1, len(record.time) // RESOLVED_ROWS))
    transverse, tangential = record.law.predict_chains(record.start, record.reference, record.time[rows])
    across = np.linalg.norm(record.transverse_state[rows, :, 0] - transverse[:, :, 0], axis=1)
    metres = np.linalg.norm(record.law.path.jets(tangential[:, 0])[:, 1], axis=1)
    along = metres * np.abs(record.tangential_state[rows, 0] - tangential[:, 0])
    allowed = record.settled_within + RESOLVED_SHARE * record.distance.max()
    return bool(max(across.max(), along.max()) <= allowed)

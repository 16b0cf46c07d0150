"""When a flight must end, and what to call it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gammastar.flight.record import FlightRecord, Status
from gammastar.vehicle.state import SIZE as STATE_SIZE

SMALLEST_FOCAL_MARGIN = 1e-9
LARGEST_TURN = 0.3  # [rad] in one integration step; beyond it no method of fixed step resolves the motion
NEAR = 0.1  # of a margin's usual size: a flight that breaks down this near to a singularity broke down because of it
RESOLVED_SHARE = 0.01  # of its largest distance to the path, by which a resolved flight may be beside its closed form
RESOLVED_ROWS = 400  # at about so many that is looked at, evenly spaced


@dataclass
class Watch:
    """Looks at a scan as it goes, ends it before the first step that must not be kept, and says which criterion fired."""

    step: float  # [s] of the integration
    least_thrust: float  # [N] below it the law divides by rounding
    status: Status = Status.COMPLETED

    def __call__(self, after: np.ndarray, seen: np.ndarray) -> int | None:
        """Return how many steps of a chunk come before the first bad one, or None."""
        with np.errstate(invalid="ignore", over="ignore"):
            fired = {
                Status.NOT_FINITE: ~(np.isfinite(after).all(axis=0) & np.isfinite(seen).all(axis=0)),
                Status.FREE_FALL: ~(after[STATE_SIZE - 2] > self.least_thrust),
                Status.FOCAL_POINT: ~((seen[-1] > SMALLEST_FOCAL_MARGIN) | (seen[-3] > 0)),
                Status.UNRESOLVED: turns_too_far(after[15:18], self.step),
            }
        bad = np.any(list(fired.values()), axis=0)
        if not bad.any():
            return None
        first = int(bad.argmax())
        self.status = next(status for status, where in fired.items() if where[first])
        return first


def turns_too_far(angular_velocity: np.ndarray, step: float) -> np.ndarray:
    """Return whether body rates (3, ...) [rad/s] turn the attitude too far in one integration step [s]; NaN does."""
    return np.asarray(~(np.linalg.norm(angular_velocity, axis=0) * step < LARGEST_TURN))


def nearest_singularity(
    thrust: np.ndarray, thrust_rate: np.ndarray, focal: np.ndarray, interval: float
) -> Status | None:
    """Return the singularity that explains a breakdown: the nearer one, if one is near in its usual size, or None.

    Args:
        thrust: (n,) [N] over the flight.
        thrust_rate: (n,) [N/s].
        focal: (n,) focal margin.
        interval: [s] between rows.
    """
    before = focal[-2] if len(focal) > 1 else focal[-1]
    nearness = {
        Status.FOCAL_POINT: min(focal[-1], 2 * focal[-1] - before) / np.median(focal),
        Status.FREE_FALL: min(thrust[-1], thrust[-1] + interval * thrust_rate[-1]) / np.median(thrust),
    }
    cause = min(nearness, key=lambda status: nearness[status])
    return cause if nearness[cause] < NEAR else None


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

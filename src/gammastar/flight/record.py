"""What a flight leaves behind: arrays over time, how it ended, and a summary with units in its keys."""

from __future__ import annotations

import enum
import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gammastar.errors import InputError
from gammastar.flight.summary import Summary, summary_of
from gammastar.vehicle.state import NAMES

if TYPE_CHECKING:
    from gammastar.flight.autopilot_rows import AutopilotRows
    from gammastar.flight.phases import Phase
    from gammastar.law import AnyReference, Heading, Law, Prediction
    from gammastar.vehicle import State, Vehicle


class Status(enum.Enum):
    """How a flight ended; the value is the sentence to show."""

    COMPLETED = "flew to the end"
    FREE_FALL = "thrust fell to zero: in free fall the attitude has no effect on the motion and the law is singular"
    FOCAL_POINT = "reached a focal point of the path, where the nearest point is not unique and the law is singular"
    UNRESOLVED = "moved too fast for the integration step: take a shorter one, slower poles or a higher control rate"
    SINGULAR_START = (
        "the law has no finite input at the start: no thrust, or no nearest point of the path that is unique"
    )
    NOT_FINITE = "numbers left the finite range: the loop is unstable with this step, control rate or vehicle"


@dataclass(frozen=True, eq=False, repr=False)
class FlightRecord:
    """One flight, row by row; n rows, world frame with third axis down, body quantities in body axes.

    The transformed states are those of the true state and the true vehicle.
    """

    time: np.ndarray  # (n,) [s]
    state: np.ndarray  # (n, 20), order of the paper
    input: np.ndarray  # (n, 4): second derivative of the thrust [N/s^2], torque [N m], body
    transverse_state: np.ndarray  # (n, 2, 4): xi, components of the transverse output and three derivatives
    tangential_state: np.ndarray  # (n, 4): eta_1 ... eta_4 in the path's parameter, unwrapped
    yaw_output: np.ndarray  # (n,): eta_21 = beta(r)
    waiting: np.ndarray  # (n,) bool: a point of the path waits as a target, because no nearest point is unique
    constrained: np.ndarray  # (n,) bool: the approach bends the linear law (waiting, error cut, thrust near its floor)
    distance: np.ndarray  # (n,) [m] to the path
    free_fall_margin: np.ndarray  # (n,) [m/s^2]: thrust over mass, zero in free fall
    focal_margin: np.ndarray  # (n,): 1 on a curve, zero at focal points
    status: Status
    status_time: float  # [s] when it ended
    status_margin: float  # smaller of the two margins then: [m/s^2] for free fall, dimensionless for a focal point
    law: Law
    truth: Vehicle
    start: State
    reference: AnyReference
    yaw_reference: float | Heading  # constant reference of beta(r), or a heading
    settled_within: float  # [m]
    phases: tuple[Phase, ...]  # one, and another for every replacement of the path
    nominal: bool  # exact model, continuous feedback, one path: the closed-form prediction is the flight itself
    autopilot: AutopilotRows | None = (
        None  # what an autopilot and its surroundings did; None where the law acts by itself
    )

    @property
    def position(self) -> np.ndarray:
        """Return the positions (n, 3) [m], world."""
        return self.state[:, 0:3]

    @property
    def velocity(self) -> np.ndarray:
        """Return the velocities (n, 3) [m/s], world."""
        return self.state[:, 3:6]

    @property
    def attitude(self) -> np.ndarray:
        """Return the attitudes (n, 3, 3), body to world."""
        return self.state[:, 6:15].reshape(-1, 3, 3).swapaxes(1, 2)

    @property
    def angular_velocity(self) -> np.ndarray:
        """Return the body rates (n, 3) [rad/s]."""
        return self.state[:, 15:18]

    @property
    def thrust(self) -> np.ndarray:
        """Return the thrust zeta1 (n,) [N]."""
        return self.state[:, 18]

    @property
    def torque(self) -> np.ndarray:
        """Return the torques (n, 3) [N m], body."""
        return self.input[:, 1:]

    @property
    def internal_state(self) -> np.ndarray:
        """Return mu (n, 7), Eq. (20): the first two columns of R and the thrust."""
        return np.column_stack([self.state[:, 6:12], self.state[:, 18]])

    def __repr__(self) -> str:
        """Return how long the flight was and how it ended; its arrays fill pages."""
        return f"<a flight of {self.time[-1]:g} s in {len(self.time)} rows: {self.status.value}>"

    @property
    def completed(self) -> bool:
        """Return whether the flight reached its planned end."""
        return self.status is Status.COMPLETED

    @functools.cached_property
    def prediction(self) -> Prediction:
        """Return the closed-form flight of the believed vehicle at the recorded times.

        Raises:
            InputError: The path was replaced on the way: no single closed form holds.
        """
        if len(self.phases) > 1:
            raise InputError(
                f"a flight with a closed form must follow one path (got {len(self.phases)}); predict each phase with its own law"
            )
        return self.law.predict(self.start, self.reference, self.time, self.yaw_reference)

    def flips(self) -> int:
        """Return how often the vehicle went over: upright, upside down and upright again on the other side.

        Counted from R alone.  The third body axis R e3 crosses the horizontal downwards and upwards; a stay below that is deeper than
        30 degrees is a flip when the two crossings point to opposite sides, and none when the vehicle came back the way it went.
        """
        axis = self.attitude[:, :, 2]
        above = axis[:, 2] > 0
        leaving = np.flatnonzero(above[:-1] & ~above[1:]) + 1
        count = 0
        for begin in leaving:
            back = np.flatnonzero(above[begin:])
            if back.size and axis[begin : begin + back[0], 2].min() < -0.5:
                count += bool(axis[begin, :2] @ axis[begin + back[0], :2] < 0)
        return count

    def summary(self) -> Summary:
        """Return the numbers worth knowing first; printing it shows them as text."""
        with np.errstate(over="ignore", invalid="ignore"):  # of a flight that ran away some are infinite, and say so
            return summary_of(self)

    def columns(self) -> dict[str, np.ndarray]:
        """Return the record as named columns (n,), ready for a table; times first."""
        columns = {"time_s": self.time}
        columns |= {name: self.state[:, k] for k, name in enumerate(NAMES)}
        columns |= {
            name: self.input[:, k] for k, name in enumerate(("thrust_ddot", "torque_x", "torque_y", "torque_z"))
        }
        columns |= {f"xi_{i + 1}{j + 1}": self.transverse_state[:, i, j] for i in range(2) for j in range(4)}
        columns |= {f"eta_1{j + 1}": self.tangential_state[:, j] for j in range(4)}
        columns |= {"eta_21": self.yaw_output, "distance_m": self.distance}
        columns |= {"free_fall_margin_m_s2": self.free_fall_margin, "focal_margin": self.focal_margin}
        columns |= {"waiting": self.waiting, "constrained": self.constrained}
        columns |= {} if self.autopilot is None else self.autopilot.columns()
        return {name: np.ascontiguousarray(values) for name, values in columns.items()}

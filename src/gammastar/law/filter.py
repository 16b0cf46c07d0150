"""Where the vehicle is, from slow or noisy sensors: an error-state Kalman filter on SO(3) x R^9.

The estimate is position, velocity, attitude and angular velocity; its error is a vector of twelve numbers, in which the attitude's
is a rotation vector in body axes: R = R_estimated exp(error).  Solà, Quaternion kinematics for the error-state Kalman filter (2017),
chapters 5 and 6, with the rates as states that the model of the vehicle moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import so3
from gammastar.checks import magnitude, three
from gammastar.errors import InputError
from gammastar.law.measurement import CHANNELS, Measurement, fresh_axes

MOTION = 18  # numbers of the estimate before those of the covariance
ERRORS = 12  # three a channel: position, velocity, attitude, angular velocity
UPPER = np.triu_indices(ERRORS)
SIZE = MOTION + len(UPPER[0])


class Motion(NamedTuple):
    """Graph: how a vehicle moves, as a filter knows it."""

    position: Any  # SX (3,) [m], world
    velocity: Any  # SX (3,) [m/s], world
    attitude: Any  # SX (3, 3), body to world
    angular_velocity: Any  # SX (3,) [rad/s], body


@dataclass(frozen=True)
class KalmanFilter:
    """Deviations of the sensors and densities of what the model does not know; the estimate itself is kept by the controller.

    Over an interval the estimate moves with the mean accelerations that the model gives; what is unknown about them is white noise.
    Then each axis whose sample is new corrects the estimate, one number after the other: nothing is inverted, and the covariance
    goes through steps of Gaussian elimination, which keep a positive matrix positive.  Biases and delays are not estimated.

    Raises:
        InputError: A deviation or a density is not a finite positive number.
    """

    position: ArrayLike  # standard deviation of one sample, scalar or (3,) [m], world axes
    velocity: ArrayLike  # [m/s], world axes
    attitude: ArrayLike  # [rad], body axes
    angular_velocity: ArrayLike  # [rad/s], body axes
    acceleration_density: float = (
        0.2  # [m^2/s^3], two-sided: an unknown 1 m/s^2 that changes within 0.1 s, s^2 times 2 T
    )
    angular_density: float = 1.0  # [rad^2/s^3], two-sided: an unknown 5 rad/s^2 that changes within 0.02 s
    gravity: float | None = (
        None  # [m/s^2]: the acceleration beside it turns with the attitude's error; None: it does not
    )

    def __post_init__(self) -> None:
        for name in CHANNELS:
            values = three(getattr(self, name), f"deviation of {name}")
            if np.any(values <= 0):
                raise InputError(
                    f"deviation of {name} in a filter must be positive (got {values.tolist()}); give what one sample of the sensor has"
                )
            for value in values:
                magnitude(value, f"deviation of {name} in a filter", above=0)
            object.__setattr__(
                self, name, tuple(values.tolist())
            )  # filters of one kind are equal: one graph serves them
        for name, unit in (("acceleration_density", "m^2/s^3"), ("angular_density", "rad^2/s^3")):
            object.__setattr__(self, name, magnitude(getattr(self, name), f"{name} [{unit}]", above=0))
        if self.gravity is not None:
            object.__setattr__(self, "gravity", magnitude(self.gravity, "gravity [m/s^2]", at_least=0))

    @property
    def size(self) -> int:
        """Return how many numbers the estimate has: the motion and the upper triangle of its covariance, row by row."""
        return SIZE

    def start(
        self,
        position: ArrayLike,
        velocity: ArrayLike,
        attitude: ArrayLike,
        angular_velocity: ArrayLike,
        deviations: ArrayLike | None = None,
    ) -> np.ndarray:
        """Return the first estimate (96,) with standard deviations (12,) of its error: of one sample of each sensor when left out."""
        given = np.concatenate([np.asarray(getattr(self, name)) for name in CHANNELS])
        if deviations is not None:
            given = np.asarray(deviations, dtype=float)
        motion = (position, velocity, so3.stack(attitude), angular_velocity)
        return np.concatenate([*(np.asarray(part, dtype=float) for part in motion), np.diag(given**2)[UPPER]])

    def advanced(
        self, estimate: Any, measurement: Measurement, acceleration: Any, angular_acceleration: Any, interval: float
    ) -> Any:
        """Graph: return the estimate SX (96,) at the end of an interval, with what was measured there.

        Args:
            estimate: SX (96,), at the end of the interval before.
            measurement: What the sensors tell.
            acceleration: SX (3,) [m/s^2], world: mean over the interval of what the model of the vehicle does.
            angular_acceleration: The same, SX (3,) [rad/s^2], body.
            interval: [s].
        """
        motion, covariance = self.predicted(estimate, acceleration, angular_acceleration, interval)
        return self.corrected(motion, covariance, measurement)

    def predicted(
        self, estimate: Any, acceleration: Any, angular_acceleration: Any, interval: float
    ) -> tuple[Motion, Any]:
        """Graph: return the motion and the covariance SX (12, 12) of its error after an interval without measurements.

        With turn = interval times the mean rate the attitude moves as R exp(turn), and its error as exp(-turn) error; the error of
        the rate adds to it in the axes of the middle of the interval, to second order.
        """
        now, P, T = self.estimate(estimate), _symmetric(estimate[MOTION:]), interval
        turn = T * (now.angular_velocity + T / 2 * angular_acceleration)
        motion = Motion(
            now.position + T * now.velocity + T**2 / 2 * acceleration,
            now.velocity + T * acceleration,
            now.attitude + now.attitude @ so3.exp_increment(turn),
            now.angular_velocity + T * angular_acceleration,
        )
        F = ca.SX.eye(ERRORS)
        F[0:3, 3:6] = T * ca.SX.eye(3)
        if self.gravity is not None:
            driven = ca.mtimes(now.attitude.T, acceleration - ca.vertcat(0, 0, self.gravity))
            tilted = -ca.mtimes(now.attitude, so3.hat(driven))
            F[0:3, 6:9], F[3:6, 6:9] = T**2 / 2 * tilted, T * tilted
        F[6:9, 6:9], F[6:9, 9:12] = so3.exp(-turn), T * so3.exp(-turn / 2)
        chain = np.array([[T**3 / 3, T**2 / 2], [T**2 / 2, T]])
        noise = np.kron(np.diag([self.acceleration_density, self.angular_density]), np.kron(chain, np.eye(3)))
        return motion, ca.mtimes([F, P, F.T]) + ca.DM(noise)

    def corrected(self, motion: Motion, covariance: Any, measurement: Measurement) -> Any:
        """Graph: return the estimate SX (96,) after the axes that were measured anew, one after the other."""
        turn = so3.log(ca.mtimes(motion.attitude.T, measurement.attitude))
        innovation = ca.vertcat(
            measurement.position - motion.position,
            measurement.velocity - motion.velocity,
            turn,
            measurement.angular_velocity - motion.angular_velocity,
        )
        fresh = ca.vertcat(*(fresh_axes(each) for each in ca.vertsplit(measurement.fresh)))
        variances = np.concatenate([np.asarray(getattr(self, name)) for name in CHANNELS]) ** 2
        error = ca.SX.zeros(ERRORS)
        P = {(j, k): covariance[j, k] for j in range(ERRORS) for k in range(j, ERRORS)}
        for i in range(ERRORS):
            row, new = [P[min(i, k), max(i, k)] for k in range(ERRORS)], fresh[i]
            spread = row[i] + float(variances[i])
            error += new / spread * (innovation[i] - error[i]) * ca.vertcat(*row)
            left = (float(variances[i]) + (1 - new) * row[i]) / spread  # 1 less the gain, without its cancellation
            P = {
                (j, k): left * entry if i in (j, k) else entry - new / spread * row[j] * row[k]
                for (j, k), entry in P.items()
            }
        return ca.vertcat(
            motion.position + error[0:3],
            motion.velocity + error[3:6],
            so3.stack(motion.attitude + motion.attitude @ so3.exp_increment(error[6:9])),
            motion.angular_velocity + error[9:12],
            *P.values(),
        )

    def estimate(self, estimate: Any) -> Motion:
        """Graph: return the motion of an estimate SX (96,)."""
        position, velocity, attitude, angular_velocity, _ = ca.vertsplit(estimate, [0, 3, 6, 15, MOTION, SIZE])
        return Motion(position, velocity, so3.unstack(attitude), angular_velocity)

    def deviations(self, estimate: Any) -> Any:
        """Graph: return the standard deviations SX (12,) of the error, three a channel."""
        return ca.sqrt(ca.diag(_symmetric(estimate[MOTION:])))


def _symmetric(triangle: Any) -> Any:
    """Graph: return the matrix SX (12, 12) of its upper triangle SX (78,), row by row."""
    rows = np.zeros((ERRORS, ERRORS), dtype=int)
    rows[UPPER] = rows.T[UPPER] = np.arange(len(UPPER[0]))
    return ca.reshape(triangle[rows.ravel().tolist()], ERRORS, ERRORS)

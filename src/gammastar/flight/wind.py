"""Wind: a mean and gusts with the Dryden spectra, drawn before a flight from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import instance, magnitude, magnitudes, number, three, whole
from gammastar.errors import InputError

STREAM = 4  # of random numbers beside those of the four sensors
FOOT = 0.3048  # [m], in which the specification's formulas are written
HEIGHTS = (10 * FOOT, 1000 * FOOT)  # [m] over ground between which its low-altitude model holds
LATERAL = (
    np.sqrt(3),
    1 - np.sqrt(3),
)  # (1 + sqrt(3) x) / (1 + x)^2 is the first over (1 + x) and the second over (1 + x)^2


@dataclass(frozen=True, eq=False)
class Gusts:
    """Stationary gusts along, across and below the mean wind, independent of each other, with the Dryden spectra.

    With x = 2 pi f T, standard deviation s and correlation time T the one-sided power spectral densities [(m/s)^2/Hz] are

        along:             4 s^2 T / (1 + x^2)                   white noise through 1/(1 + T s); correlation exp(-t/T)
        across and below:  2 s^2 T (1 + 3 x^2) / (1 + x^2)^2     through (1 + sqrt(3) T s)/(1 + T s)^2; (1 - t/(2 T)) exp(-t/T)

    MIL-F-8785C, section 3.7, with T = L/V for a scale length L met at an airspeed V.

    Raises:
        InputError: A deviation is negative or a time is not positive.
    """

    deviation: ArrayLike  # s, scalar or (3,) [m/s]: along the horizontal mean wind, across it to the right, downwards
    time: ArrayLike  # T, scalar or (3,) [s]

    def __post_init__(self) -> None:
        for name, unit in (("deviation", "m/s"), ("time", "s")):
            values = magnitudes(three(getattr(self, name), f"{name} of gusts"), f"{name} of gusts [{unit}]", (3,))
            object.__setattr__(self, name, values)
        if np.any(np.asarray(self.deviation) < 0):
            raise InputError(
                f"deviation of gusts must not be negative (got {np.asarray(self.deviation).tolist()}); give standard deviations"
            )
        if np.any(np.asarray(self.time) <= 0):
            raise InputError(
                f"time of gusts must be positive (got {np.asarray(self.time).tolist()}); give the time in which gusts change"
            )
        for time in np.asarray(self.time):
            magnitude(time, "time of gusts [s]", above=0)

    @classmethod
    def dryden(cls, height: float, wind_at_6m: float, airspeed: float | None = None) -> Gusts:
        """Return the low-altitude gusts of MIL-F-8785C, section 3.7.

        With h in feet: L = h below, L = h / (0.177 + 0.000823 h)^1.2 along and across; s = 0.1 W below, and that over
        (0.177 + 0.000823 h)^0.4 along and across.

        Args:
            height: [m] over ground, 3.05 to 304.8.
            wind_at_6m: W [m/s], mean wind 20 feet over ground; 7.7, 15.4 and 23.2 are called light, moderate and severe.
            airspeed: V [m/s] at which the vehicle meets the gusts; the wind that blows past one that hovers, when left out.
        """
        height, wind_at_6m = number(height, "height [m]"), number(wind_at_6m, "wind at 6 m [m/s]", above=0)
        if not HEIGHTS[0] <= height <= HEIGHTS[1]:
            raise InputError(
                f"height of low-altitude gusts must be between {HEIGHTS[0]:.4g} and {HEIGHTS[1]:.4g} m (got {height:g}); "
                "elsewhere give deviation and time, as gs.Gusts(deviation, time)"
            )
        speed = wind_at_6m if airspeed is None else number(airspeed, "airspeed [m/s]", above=0)
        share = 0.177 + 0.000823 * height / FOOT
        length = height / share**1.2
        below = 0.1 * wind_at_6m
        deviation = (below / share**0.4, below / share**0.4, below)
        return cls(deviation, (length / speed, length / speed, height / speed))

    def density(self, frequency: ArrayLike) -> np.ndarray:
        """Return the one-sided power spectral densities (3, n) [(m/s)^2/Hz] at frequencies (n,) [Hz]."""
        s, T = np.asarray(self.deviation)[:, None], np.asarray(self.time)[:, None]
        square = (2 * np.pi * T * np.asarray(frequency, dtype=float)) ** 2
        lateral = 2 * s**2 * T * (1 + 3 * square) / (1 + square) ** 2
        return np.vstack([(4 * s**2 * T / (1 + square))[:1], lateral[1:]])

    def samples(self, seed: int, intervals: int, control_rate: float) -> np.ndarray:
        """Return (3, intervals) gusts [m/s] along, across and below; stationary from the first sample on.

        The filters are discretised exactly, so that variance and correlation of the samples are those of the continuous gusts at any
        control rate.  Sample k depends on the seed and k alone.
        """
        draws = np.random.default_rng([whole(seed, "seed"), STREAM]).standard_normal((intervals, 3, 2))
        parts = [
            _filtered(draws[:, axis], float(time) * control_rate) for axis, time in enumerate(np.asarray(self.time))
        ]
        lateral = [LATERAL[0] * part[0] + LATERAL[1] * part[1] for part in parts[1:]]
        return np.asarray(np.asarray(self.deviation)[:, None] * np.array([np.sqrt(2) * parts[0][0], *lateral]))


def _filtered(draws: np.ndarray, time: float) -> np.ndarray:
    """Return (2, n) stationary samples of w/(1 + T s) and w/(1 + T s)^2 from draws (n, 2), T in intervals.

    The white noise w has the density that gives the lateral gust variance one.  With u = 1/T, x' = A x + (w, 0)^T, A = -u [1 0; -1 1]:
    exp(A) = e^-u [1 0; u 1], the stationary covariance is P = [1/2 1/4; 1/4 1/4], and what an interval adds has P - exp(A) P exp(A)^T.
    """
    from scipy.signal import lfilter

    u = 1 / time
    decay, stationary = np.exp(-u), np.array([[0.5, 0.25], [0.25, 0.25]])
    q = -np.expm1(-2 * u)  # 1 - e^-2u
    added = stationary * q - (1 - q) * np.array([[0, u / 2], [u / 2, u / 2 + u**2 / 2]])
    first, noise = _correlated(stationary, draws[0]), _correlated(added, draws[1:].T)
    slow, _ = lfilter([1.0], [1.0, -decay], noise[0], zi=[decay * first[0]])
    slow = np.concatenate([first[:1], slow])
    slower, _ = lfilter([1.0], [1.0, -decay], noise[1] + decay * u * slow[:-1], zi=[decay * first[1]])
    return np.array([slow, np.concatenate([first[1:], slower])])


def _correlated(covariance: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """Return draws (2, ...) given a covariance (2, 2), by its Cholesky factor; one that is singular to rounding will do."""
    scale = np.sqrt(covariance[0, 0])
    share = covariance[1, 0] / scale
    own = np.sqrt(max(0.0, covariance[1, 1] - share**2))
    return np.array([scale * draws[0], share * draws[0] + own * draws[1]])


@dataclass(frozen=True, eq=False)
class Wind:
    """The velocity of the air: a mean, and gusts about it; the same everywhere, held over each control interval."""

    mean: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [m/s], world, where the air moves to
    gusts: Gusts | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", magnitudes(self.mean, "mean wind [m/s]", (3,)))
        if self.gusts is not None:
            instance(self.gusts, Gusts, "gusts", "make them with gs.Gusts(deviation, time)")

    @property
    def axes(self) -> np.ndarray:
        """Return the axes of the gusts in the columns of (3, 3), world: along, across and below; north counts as along in still air."""
        horizontal = np.array([*np.asarray(self.mean)[:2], 0.0])
        size = float(np.linalg.norm(horizontal))
        along = horizontal / size if size > 0 else np.array([1.0, 0.0, 0.0])
        down = np.array([0.0, 0.0, 1.0])
        return np.column_stack([along, np.cross(down, along), down])

    def exogenous(self, seed: int, intervals: int, control_rate: float) -> np.ndarray:
        """Return the velocity of the air (3, intervals) [m/s], world, in each control interval."""
        wind = np.tile(np.asarray(self.mean)[:, None], intervals)
        if self.gusts is None:
            return wind
        gusts = self.gusts.samples(seed, intervals, control_rate)
        for axis, velocity in zip(
            self.axes.T, gusts, strict=True
        ):  # a matrix product rounds by the length of the flight
            wind = wind + axis[:, None] * velocity
        return wind

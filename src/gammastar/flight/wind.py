"""Wind: a mean and gusts with the Dryden spectra, two filter states an axis that are part of a flight's state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import engine
from gammastar.checks import instance, magnitude, magnitudes, number, three
from gammastar.errors import InputError
from gammastar.flight.draws import FIRST_GUSTS, GUSTS, Draws, gust_pairs

SIZE = 6  # of the state of gusts: two numbers an axis
STATIONARY = np.array([[0.5, 0.25], [0.25, 0.25]])  # covariance of the two
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

    @property
    def pairs(self) -> tuple[int, ...]:
        """Return the pairs of random numbers that a step draws."""
        return gust_pairs(np.asarray(self.deviation))

    def start(self, seed: int, flights: ArrayLike = 0) -> np.ndarray:
        """Return the first state (6,), or (6, flights) of flights by their numbers: as likely as any later one."""
        pairs, numbers = gust_pairs(np.asarray(self.deviation), FIRST_GUSTS), np.atleast_1d(flights)
        uniforms = ca.SX.sym("uniforms", 2 * len(pairs))
        first = self._drawn(Draws(pairs, uniforms), FIRST_GUSTS, [STATIONARY] * 3)
        graph = ca.Function("first", [uniforms], [ca.densify(first)])
        drawn = engine.uniforms(seed, numbers, [0], pairs)[:, 0]
        states = graph.map(len(numbers))(drawn).full()
        return np.asarray(states if np.ndim(flights) else states[:, 0])

    def velocity(self, state: Any) -> Any:
        """Graph: return the gusts SX (3,) [m/s] along, across and below, from their state SX (6,)."""
        deviation, along = np.asarray(self.deviation), np.sqrt(2) * state[0]
        lateral = [LATERAL[0] * state[k] + LATERAL[1] * state[k + 1] for k in (2, 4)]
        return ca.DM(deviation) * ca.vertcat(along, *lateral)

    def advanced(self, state: Any, draws: Draws, control_rate: float) -> Any:
        """Graph: return the state SX (6,) a control interval later.

        The filters are discretised exactly, so that variance and correlation of the samples are those of the continuous gusts at any
        control rate.  Each axis holds w/(1 + T s) and w/(1 + T s)^2 of a white noise w that gives the lateral gust variance one.  With
        u = 1/T in intervals, x' = A x + (w, 0)^T, A = -u [1 0; -1 1]: exp(A) = e^-u [1 0; u 1], the stationary covariance is
        P = [1/2 1/4; 1/4 1/4], and what an interval adds has P - exp(A) P exp(A)^T.
        """
        kept, added = [], []
        for axis, time in enumerate(np.asarray(self.time)):
            u = 1 / (float(time) * control_rate)
            q = -np.expm1(-2 * u)  # 1 - e^-2u
            added.append(STATIONARY * q - (1 - q) * np.array([[0, u / 2], [u / 2, u / 2 + u**2 / 2]]))
            slow, slower = state[2 * axis], state[2 * axis + 1]
            kept += [np.exp(-u) * slow, np.exp(-u) * (u * slow + slower)]
        return ca.vertcat(*kept) + self._drawn(draws, GUSTS, added)

    def _drawn(self, draws: Draws, first: int, covariances: list[np.ndarray]) -> Any:
        """Graph: return SX (6,), two normal numbers an axis with the covariances (2, 2), zero where there is no gust."""
        rows = []
        for axis, covariance in enumerate(covariances):
            blows = np.asarray(self.deviation)[axis] > 0
            rows.append(_factor(covariance) @ draws.normals(first + axis) if blows else ca.SX.zeros(2))
        return ca.vertcat(*rows)

    def samples(self, seed: int, intervals: int, control_rate: float, flight: int = 0) -> np.ndarray:
        """Return (3, intervals) gusts [m/s] along, across and below of a flight; stationary from the first sample on."""
        state, column = ca.SX.sym("state", SIZE), ca.SX.sym("column", 1 + 2 * len(self.pairs))
        after = self.advanced(state, Draws(self.pairs, column[1:]), control_rate)
        inputs = [state, ca.SX(0, 1), column, ca.SX(0, 1)]
        core = ca.Function("gusts", inputs, [ca.densify(each) for each in (after, self.velocity(state))])
        step = engine.Step(core, channels=self.pairs)
        return engine.trace(step, self.start(seed, flight), intervals, seed=seed, flight=flight, machine="casadi")[1]


def _factor(covariance: np.ndarray) -> Any:
    """Return the Cholesky factor DM (2, 2) of a covariance (2, 2); one that is singular to rounding will do."""
    scale = np.sqrt(covariance[0, 0])
    share = covariance[1, 0] / scale
    return ca.DM(np.array([[scale, 0.0], [share, np.sqrt(max(0.0, covariance[1, 1] - share**2))]]))


def _axes(mean: Any) -> Any:
    """Graph: return the axes of the gusts about a mean wind SX (3,), in the columns of SX (3, 3)."""
    size = ca.sqrt(mean[0] ** 2 + mean[1] ** 2)
    blows = size > 0
    x, y = (ca.if_else(blows, mean[k] / ca.if_else(blows, size, 1), 1 - k) for k in range(2))
    return ca.vertcat(ca.horzcat(x, -y, 0), ca.horzcat(y, x, 0), ca.horzcat(0, 0, 1))


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
        return np.asarray(ca.evalf(_axes(ca.SX(ca.DM(np.asarray(self.mean))))).full())

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters a graph as a constant."""
        gusts = () if self.gusts is None else (*np.asarray(self.gusts.deviation), *np.asarray(self.gusts.time))
        return (*np.asarray(self.mean), *gusts)

    @property
    def size(self) -> int:
        """Return how many numbers the state of the wind has."""
        return 0 if self.gusts is None else SIZE

    @property
    def pairs(self) -> tuple[int, ...]:
        """Return the pairs of random numbers that a step draws."""
        return () if self.gusts is None else self.gusts.pairs

    def start(self, seed: int, flights: ArrayLike = 0) -> np.ndarray:
        """Return the first state (size,), or (size, flights) of flights by their numbers."""
        return np.empty((0, *np.shape(flights))) if self.gusts is None else self.gusts.start(seed, flights)

    def velocity(self, state: Any, more: Any = 0.0) -> Any:
        """Graph: return the velocity of the air SX (3,) [m/s], world, from the state of the wind, with some more (3,) in its mean."""
        mean = ca.SX(ca.DM(np.asarray(self.mean))) + more
        return mean if self.gusts is None else mean + _axes(mean) @ self.gusts.velocity(state)

    def advanced(self, state: Any, draws: Draws, control_rate: float) -> Any:
        """Graph: return the state of the wind a control interval later."""
        return state if self.gusts is None else self.gusts.advanced(state, draws, control_rate)

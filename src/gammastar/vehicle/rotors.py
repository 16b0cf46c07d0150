"""Rotors: where they are, how they turn, what they give, and how fast they follow a command.

Every rotor pushes along the body's third axis as the thrust does, by -f e3 with f = c w^2 at the speed w.  A rotor at r = (x, y, z)
adds the torque r x (-f e3) = (-y f, x f, 0), and the air turns the body against the rotor by -spin (k / c) f about the third axis.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array, magnitude, magnitudes, shape_of, shortened, whole
from gammastar.errors import InputError, ShapeError
from gammastar.vehicle.wrenches import interval, normals, radius

FEWEST = 4  # thrust and three torques need as many
MOST = 24  # an allocation compares all triples of them
ROUNDING = 1e-12  # of the thrust of all rotors
FULL_RANK = 1e-6  # least singular value of the mixer with rows of unit length


class Hover(NamedTuple):
    """What rotors do while the vehicle hovers, and how much more they could."""

    thrusts: np.ndarray  # (n,) [N]
    speeds: np.ndarray  # (n,) [rad/s]; NaN where a rotor would have to pull
    throttle: float  # largest share of its fastest speed at which a rotor turns; above 1 the vehicle cannot hover
    thrust_to_weight: float  # most thrust without torque, over the weight; infinite without weight


@dataclass(frozen=True, eq=False)
class Rotors:
    """Four or more rotors with axes along the thrust; immutable.

    Raises:
        InputError: A coefficient, limit or lag of the wrong sign, spins other than +1 and -1, or rotors that leave one of thrust and
            three torques out.
        ShapeError: Fewer than four rotors, or numbers that do not fit them.
    """

    positions: ArrayLike  # (n, 3) [m] from the centre of mass, body axes, third axis down
    spins: ArrayLike  # (n,) +1 turns right-handed about the body's third axis (clockwise from above), -1 the other way
    thrust_coefficient: ArrayLike  # c, scalar or (n,) [N s^2/rad^2]
    torque_coefficient: ArrayLike  # k, scalar or (n,) [N m s^2/rad^2]
    fastest: float  # [rad/s]
    slowest: float = 0.0  # [rad/s]
    lag: float | Sequence[float] = 0.0  # [s] time constant of the speed, one or (up, down)

    def __post_init__(self) -> None:
        shape = shape_of(self.positions)
        if shape is None or len(shape) != 2 or shape[1] != 3 or shape[0] < FEWEST:
            got = "rows of different lengths" if shape is None else f"shape {shape}"
            raise ShapeError(
                f"positions [m] of rotors must be four or more rows of three (got {got}); thrust and three torques need four rotors"
            )
        _require_few(shape[0])
        object.__setattr__(self, "positions", magnitudes(self.positions, "positions [m] of rotors", shape))
        spins = array(self.spins, "spins of rotors", shape[:1])
        if not np.all(np.abs(spins) == 1):
            raise InputError(
                f"spins of rotors must be +1 or -1 (got {shortened(spins.tolist())}); +1 is clockwise from above"
            )
        object.__setattr__(self, "spins", spins)
        for name, unit in (("thrust_coefficient", "N s^2/rad^2"), ("torque_coefficient", "N m s^2/rad^2")):
            given = getattr(self, name)
            given = np.repeat(given, shape[0]) if shape_of(given) == () else given
            checked = magnitudes(given, f"{name} [{unit}]", shape[:1])
            for value in checked:
                if name == "thrust_coefficient":
                    magnitude(value, f"{name} [{unit}]", above=0)
                else:
                    magnitude(value, f"{name} [{unit}]", at_least=0)
            object.__setattr__(self, name, checked)
        slowest = magnitude(self.slowest, "slowest speed of rotors [rad/s]", at_least=0)
        fastest = magnitude(self.fastest, "fastest speed of rotors [rad/s]", above=0)
        if slowest >= fastest:
            raise InputError(
                f"the slowest speed of rotors must be below the fastest (got {slowest:g} and {fastest:g} rad/s); swap them"
            )
        object.__setattr__(self, "slowest", slowest)
        object.__setattr__(self, "fastest", fastest)
        pair = np.repeat(self.lag, 2) if shape_of(self.lag) == () else self.lag
        lag = array(pair, "lag of rotors [s], one number or (up, down)", (2,))
        object.__setattr__(
            self, "lag", tuple(magnitude(value, "lag of rotors [s]", at_least=0) for value in lag.tolist())
        )
        least = np.linalg.svd(self.mixer / np.maximum(self.units, 1 / 1e50)[:, None], compute_uv=False)[-1]
        if not least > FULL_RANK:
            raise InputError(
                "rotors must give thrust and a torque about every axis, each by itself (got a mixer of rank below 4); "
                "place them around the centre of mass and let some of them turn the other way"
            )

    @classmethod
    def ring(
        cls,
        count: int,
        arm: float,
        thrust_coefficient: ArrayLike,
        torque_coefficient: ArrayLike,
        fastest: float,
        *,
        slowest: float = 0.0,
        lag: float | Sequence[float] = 0.0,
        first_angle: float = 0.0,
        first_spin: int = 1,
    ) -> Rotors:
        """Return rotors on a circle about the centre of mass, numbered clockwise from above, spins alternating.

        Args:
            count: How many, four or more.
            arm: [m] from the centre of mass to each.
            thrust_coefficient: [N s^2/rad^2]
            torque_coefficient: [N m s^2/rad^2]
            fastest: [rad/s]
            slowest: [rad/s]
            lag: [s]
            first_angle: [degrees] of the first rotor, from straight ahead towards the right: 0 is a plus, 45 an x of four.
            first_spin: Of the first rotor.
        """
        count, arm = whole(count, "number of rotors"), magnitude(arm, "arm of rotors [m]", above=0)
        _require_few(count)
        first, spin = (
            magnitude(first_angle, "first angle of rotors [deg]"),
            magnitude(first_spin, "first spin of rotors"),
        )
        angles = np.radians(first) + 2 * np.pi * np.arange(count) / max(count, 1)
        positions = arm * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
        spins = spin * (-1.0) ** np.arange(count)
        return cls(positions, spins, thrust_coefficient, torque_coefficient, fastest, slowest, lag)

    @functools.cached_property
    def signature(self) -> tuple[float, ...]:
        """Return all numbers in a fixed order, their count first: rotors with one signature act alike."""
        arrays = (self.positions, self.spins, self.thrust_coefficient, self.torque_coefficient, self.lag)
        numbers = (float(x) for values in arrays for x in np.ravel(np.asarray(values)))
        return (float(self.count), *numbers, self.slowest, self.fastest)

    @property
    def count(self) -> int:
        """Return n, how many rotors there are."""
        return len(np.asarray(self.positions))

    @functools.cached_property
    def mixer(self) -> np.ndarray:
        """Return the matrix (4, n) from rotor thrusts [N] to thrust [N] and torque [N m], body."""
        x, y, _ = np.asarray(self.positions).T
        torque_per_thrust = np.asarray(self.torque_coefficient) / np.asarray(self.thrust_coefficient)
        matrix = np.array([np.ones(self.count), -y, x, -np.asarray(self.spins) * torque_per_thrust])
        matrix.setflags(write=False)
        return matrix

    @functools.cached_property
    def units(self) -> np.ndarray:
        """Return the length (4,) of each row of the mixer, by which wrenches are scaled where geometry compares their parts."""
        return np.asarray(np.linalg.norm(self.mixer, axis=1))

    @property
    def least_thrusts(self) -> np.ndarray:
        """Return the thrusts (n,) [N] at the slowest speed."""
        return np.asarray(self.thrust_coefficient) * self.slowest**2

    @property
    def most_thrusts(self) -> np.ndarray:
        """Return the thrusts (n,) [N] at the fastest speed."""
        return np.asarray(self.thrust_coefficient) * self.fastest**2

    def thrusts(self, speeds: Any) -> Any:
        """Graph: return the rotor thrusts SX (n,) [N] at speeds [rad/s]."""
        return ca.DM(np.asarray(self.thrust_coefficient)) * speeds**2

    def speeds(self, thrusts: Any) -> Any:
        """Graph: return the speeds SX (n,) [rad/s] that give thrusts [N]; zero for those below zero."""
        return ca.sqrt(ca.fmax(thrusts, 0) / ca.DM(np.asarray(self.thrust_coefficient)))

    def wrench(self, thrusts: Any) -> Any:
        """Graph: return the wrench SX (4,), thrust [N] and torque [N m], of rotor thrusts [N]."""
        return ca.mtimes(ca.DM(self.mixer), thrusts)

    def wrench_at(self, speeds: ArrayLike) -> np.ndarray:
        """Return the wrench (4,), thrust [N] and torque [N m] in body axes, at rotor speeds (n,) [rad/s]."""
        turning = ca.DM(array(speeds, "rotor speeds [rad/s]", (self.count,)))
        return np.asarray(self.wrench(self.thrusts(turning)).full()[:, 0])

    def advanced(self, speeds: Any, commands: Any, interval: Any) -> Any:
        """Graph: return the speeds SX (n,) [rad/s] after an interval [s] of held commands, a number or a graph.

        Exact for w' = (command - w) / lag: the difference keeps its sign, and with it the time constant, up or down.
        """
        exp = ca.exp if isinstance(interval, ca.SX) else np.exp
        up, down = (exp(-interval / lag) if lag > 0 else 0.0 for lag in self._lags)
        left = up if self._lags[0] == self._lags[1] else ca.if_else(commands > speeds, up, down)
        return commands + (speeds - commands) * left

    def mean_thrusts(self, speeds: Any, commands: Any, interval: float) -> Any:
        """Graph: return the thrusts SX (n,) [N] in the mean over an interval [s] of held commands, from speeds at its start.

        With d = speed - command and decay e = exp(-t/lag): the mean of (command + d e)^2.
        """
        (once_up, twice_up), (once_down, twice_down) = (_mean_decays(lag, interval) for lag in self._lags)
        rising, difference = commands > speeds, speeds - commands
        once, twice = _by_way(rising, once_up, once_down), _by_way(rising, twice_up, twice_down)
        square = commands**2 + 2 * commands * difference * once + difference**2 * twice
        return ca.DM(np.asarray(self.thrust_coefficient)) * square

    def commands(self, speeds: Any, wanted: Any, interval: float) -> Any:
        """Graph: return the commands SX (n,) [rad/s] after which wanted speeds are reached in an interval [s], or come nearest.

        The inverse of `advanced`, cut to the limits.
        """
        up, down = (-np.expm1(-interval / lag) if lag > 0 else 1.0 for lag in self._lags)
        ahead = speeds + (wanted - speeds) / _by_way(wanted > speeds, up, down)
        return ca.fmin(ca.fmax(ahead, self.slowest), self.fastest)

    def reachable(self, speeds: Any, interval: float, share: float = 1.0) -> tuple[Any, Any]:
        """Graph: return the lowest and highest thrusts, SX (n,) each [N], of which rotors can go a share of the way in an interval [s]."""
        ends = (self.advanced(speeds, ca.DM.ones(self.count) * end, interval) for end in (self.slowest, self.fastest))
        wanted = (speeds + (end - speeds) / share for end in ends)
        lowest, highest = (self.thrusts(ca.fmin(ca.fmax(each, self.slowest), self.fastest)) for each in wanted)
        return lowest, highest

    def hover(self, weight: float) -> Hover:
        """Return what hovering asks of the rotors: least-norm thrusts that carry a weight [N] without torque."""
        weight = magnitude(weight, "weight [N]", at_least=0)
        thrusts = np.linalg.pinv(self.mixer) @ [weight, 0, 0, 0]
        with np.errstate(invalid="ignore"):
            speeds = np.sqrt(thrusts / np.asarray(self.thrust_coefficient))
        share = float(np.max(np.nan_to_num(speeds, nan=np.inf)) / self.fastest)
        return Hover(thrusts, speeds, share, self.thrust_range[1] / weight if weight > 0 else np.inf)

    @functools.cached_property
    def thrust_range(self) -> tuple[float, float]:
        """Return the least and the most thrust [N] that the rotors give without any torque; the least is larger if there is none."""
        columns, least, most = self.mixer / self.units[:, None], self.least_thrusts, self.most_thrusts
        slabs = ca.DM(normals(columns))
        widths = radius(slabs, ca.DM(columns), ca.DM((most - least) / 2))
        low, high = interval(slabs, widths, -ca.DM(columns @ (most + least) / 2), ca.DM([1, 0, 0, 0]))
        ends = np.array([float(low), float(high)]) * self.units[0]
        least, most = np.where(np.abs(ends) > ROUNDING * most.sum(), ends, 0.0).tolist()
        return least, most

    @property
    def _lags(self) -> tuple[float, float]:
        up, down = np.asarray(self.lag)
        return float(up), float(down)


def _require_few(count: int) -> None:
    """Raise unless the rotors are few enough for an allocation."""
    if count > MOST:
        raise InputError(
            f"there must be at most {MOST} rotors (got {count:g}); let one stand for several that are close together"
        )


def _by_way(rising: Any, up: float, down: float) -> Any:
    """Graph: return the number of rotors that speed up or of those that slow down; no choice where they are the same."""
    return up if up == down else ca.if_else(rising, up, down)


def _mean_decays(lag: float, interval: float) -> tuple[float, float]:
    """Return the means of e and of e^2 over an interval, with e = exp(-t/lag)."""
    if lag == 0:
        return 0.0, 0.0
    ratio = interval / lag
    return float(-np.expm1(-ratio) / ratio), float(-np.expm1(-2 * ratio) / (2 * ratio))

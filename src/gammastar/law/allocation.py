"""Allocation: from the wrench that the law wants to the thrusts of the rotors, within their limits and by priority.

What the rotors cannot give is given up in this order, and no more of it than there must be: the input *along* the path (the vehicle
is slower or faster than it should be, but stays on the path), the yaw torque, the thrust, and only when nothing else is left roll and
pitch torque, scaled together.  This is a lexicographic linear programme, and it has a closed form: rotor thrusts within limits give
a zonotope of wrenches, and every step cuts one number to the interval that is left to it when all that is less important is free.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.vehicle import Rotors
from gammastar.vehicle.wrenches import UNBOUNDED, clipped, interval, normals, radius, slabs_across, without_dust

NEGLIGIBLE = 1e-6  # share of what the rotors can give and are asked for, below which nothing counts as given up
FREE = (-1e9, 1e9)  # stands for no bound of `along`
TINY = 1e-30


class Extra(NamedTuple):
    """Graph: one more wish for `along`: low <= offset + slope along <= high; all SX."""

    offset: Any
    slope: Any
    low: Any
    high: Any


class Allocation(NamedTuple):
    """Graph: what the rotors are to give."""

    thrusts: Any  # SX (n,) [N], within the limits
    wrench: Any  # SX (4,) thrust [N] and torque [N m], body: what these thrusts really give
    along: Any  # SX, the tangential input that is left
    given_up: (
        Any  # SX, the most important thing touched: 0 nothing, 1 along, 2 yaw torque, 3 thrust, 4 roll and pitch torque
    )


def allocate(
    rotors: Rotors,
    base: Any,
    direction: Any,
    along: Any,
    lowest: Any,
    highest: Any,
    extras: Sequence[Extra] = (),
    within: tuple[Any, Any] = FREE,
) -> Allocation:
    """Graph: return rotor thrusts for the wrench base + direction along.

    When roll and pitch are scaled, it is those of `base`; `direction along` stays whole.

    Args:
        rotors: Their mixer is used, not their limits.
        base: SX (4,) thrust [N] and torque [N m], body, wanted without any tangential input.
        direction: SX (4,) what one unit of tangential input adds.
        along: SX, tangential input wanted.
        lowest: SX (n,) [N] thrusts that the rotors can have now, at most `highest`.
        highest: SX (n,) [N]
        extras: Wishes for `along` that count after the rotors' limits; the first counts most.
        within: SX, least and most tangential input that may be used at all; beyond them the next less important thing is given up.
    """
    own = _independent(rotors.mixer)
    basis = np.linalg.inv(rotors.mixer[:, own])
    columns = without_dust(basis @ rotors.mixer)
    lifting, _, _, yawing = without_dust(basis / np.linalg.norm(basis, axis=0)).T
    middle, half = (highest + lowest) / 2, ca.fmax(highest - lowest, 0) / 2
    tilt, slope = ca.mtimes(ca.DM(basis[:, 1:3]), base[1:3]), ca.mtimes(ca.DM(basis), direction)
    rest = ca.mtimes(ca.DM(basis[:, [0, 3]]), base[[0, 3]]) - ca.mtimes(ca.DM(columns), middle)
    usual, freedom = (within[1] + within[0]) / 2, (within[1] - within[0]) / 2
    way = slope / ca.fmax(ca.norm_2(slope), TINY)

    def cut(value: Any, offset: Any, change: Any, given_up: tuple[np.ndarray, ...] = ()) -> Any:
        """Graph: return a value cut to where the rotors can give offset + change value, but for what is given up and some `along`."""
        here, fixed = offset + slope * usual, ca.DM(normals(columns, given_up))
        widths = radius(fixed, ca.DM(columns), half) + ca.fabs(ca.mtimes(fixed, slope)) * freedom
        first = interval(fixed, widths, here, change)
        return clipped(value, interval(*slabs_across(way, columns, half, given_up), here, change, first))

    scale = clipped(cut(1, rest, tilt, (lifting, yawing)), (0, 1))
    rest = rest + scale * tilt
    rest = rest + cut(0, rest, ca.DM(lifting), (yawing,)) * ca.DM(lifting)
    rest = rest + cut(0, rest, ca.DM(yawing)) * ca.DM(yawing)
    goal = along
    for extra in reversed(extras):
        goal = clipped(goal, _range(extra))
    slabs = ca.DM(normals(columns))
    possible = interval(slabs, radius(slabs, ca.DM(columns), half), rest, slope)
    left = clipped(clipped(goal, possible), within)

    shares = _shares(columns, own, half, middle, rest + slope * left)
    thrusts = ca.fmin(ca.fmax(middle + shares, lowest), highest)
    wrench, asked = rotors.wrench(thrusts), base + direction * left
    size = ca.mtimes(ca.DM(np.abs(rotors.mixer)), half) + ca.fabs(base) + ca.fabs(direction * left)
    missed = ca.fabs(wrench - asked) > NEGLIGIBLE * size
    given_up = ca.fmax(ca.fmax(left != along, 2 * missed[3]), ca.fmax(3 * missed[0], 4 * ca.fmax(missed[1], missed[2])))
    return Allocation(thrusts, wrench, left, given_up)


def _independent(mixer: np.ndarray) -> list[int]:
    """Return the four rotors whose thrusts are the coordinates of wrenches here: those that are farthest from being dependent.

    In these coordinates most normals have one or two entries that are not zero.
    """
    scaled = mixer / np.linalg.norm(mixer, axis=1, keepdims=True)
    quadruples = itertools.combinations(range(mixer.shape[1]), 4)
    return list(max(quadruples, key=lambda chosen: abs(np.linalg.det(scaled[:, list(chosen)]))))


def _range(extra: Extra) -> tuple[Any, Any]:
    """Graph: return the interval of `along` that one wish asks for, everything when its slope is zero."""
    divisor = ca.if_else(extra.slope == 0, 1, extra.slope)
    ends = ((extra.low - extra.offset) / divisor, (extra.high - extra.offset) / divisor)
    unbounded = ca.if_else(extra.slope == 0, UNBOUNDED, 0)
    return ca.fmin(*ends) - unbounded, ca.fmax(*ends) + unbounded


def _shares(columns: np.ndarray, own: list[int], half: Any, middle: Any, wrench: Any) -> Any:
    """Graph: return thrusts SX (n,) from the middle of the ranges, within them, for a wrench, in thrusts of four, that the rotors can give.

    Four rotors have one solution.  Of more, the one of least norm where it is within the limits; otherwise one rotor after another takes
    its share of that, cut to what leaves the others able to give the rest.
    """
    count = columns.shape[1]
    least_norm = np.linalg.pinv(columns)
    away = np.eye(count) - least_norm @ columns
    preferred = ca.mtimes(ca.DM(least_norm), wrench) - ca.mtimes(ca.DM(away), middle)
    shares: dict[int, Any] = {}
    others = list(range(count))
    for rotor in sorted(set(others) - set(own)):
        others.remove(rotor)
        column = ca.DM(columns[:, rotor])
        slabs = ca.DM(normals(columns[:, others]))
        widths = radius(slabs, ca.DM(columns[:, others]), half[others])
        ends = interval(slabs, widths, wrench, -column)
        shares[rotor] = clipped(clipped(preferred[rotor], (-half[rotor], half[rotor])), ends)
        wrench = wrench - column * shares[rotor]
    shares.update({rotor: wrench[k] for k, rotor in enumerate(own)})
    return ca.vertcat(*(shares[rotor] for rotor in range(count)))

"""Allocation: what the rotors give is the solution of a lexicographic linear programme, and always within their limits."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from gammastar.law.allocation import Extra, allocate
from gammastar.vehicle import Rotors

OCTO = [[0.3, 0.1, 0], [0.25, -0.2, 0.02], [0.1, 0.3, -0.01], [-0.1, -0.25, 0], [-0.3, 0.2, 0.03], [-0.2, -0.3, 0]]
VEHICLES = {
    "quadrotor": Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500, first_angle=45),
    "uneven quadrotor": Rotors(
        [[0.2, 0.1, 0], [0.15, -0.2, 0.1], [-0.2, -0.1, 0], [-0.25, 0.2, 0]],
        [1, -1, 1, -1],
        [1e-5, 2e-5, 1e-5, 1.5e-5],
        [2e-7, 1e-7, 3e-7, 2e-7],
        900,
    ),
    "hexarotor": Rotors.ring(6, 0.2, 1e-5, 2e-7, 800),
    "uneven octorotor": Rotors(
        [*OCTO, [0.0, -0.3, 0], [-0.1, 0.3, 0]],
        [1, -1, 1, 1, -1, 1, -1, -1],
        1e-5,
        [1e-7, 3e-7, 2e-7, 2e-7, 2e-7, 4e-7, 2e-7, 2e-7],
        900,
    ),
}
SCALE, THRUST, YAW, ALONG = range(4)  # the unknowns of the programme after the rotor thrusts, most important first


class Wish(NamedTuple):
    """One input of the allocation, in numbers."""

    base: np.ndarray
    direction: np.ndarray
    along: float
    lowest: np.ndarray
    highest: np.ndarray
    within: tuple[float, float]


@functools.cache
def graph(name: str, count_of_extras: int = 0) -> ca.Function:
    """Return the allocation of a vehicle as a function of numbers."""
    rotors = VEHICLES[name]
    base, direction, along = ca.SX.sym("base", 4), ca.SX.sym("direction", 4), ca.SX.sym("along")
    lowest, highest = ca.SX.sym("lowest", rotors.count), ca.SX.sym("highest", rotors.count)
    within, extras = ca.SX.sym("within", 2), ca.SX.sym("extras", 4 * count_of_extras)
    wishes = [Extra(*ca.vertsplit(extras[4 * k : 4 * k + 4])) for k in range(count_of_extras)]
    result = allocate(rotors, base, direction, along, lowest, highest, wishes, (within[0], within[1]))
    inputs = [base, direction, along, lowest, highest, within, extras]
    return ca.Function("allocate", inputs, ca.cse([ca.densify(each) for each in result]))


def allocated(name: str, wish: Wish, *extras: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, float, int]:
    thrusts, wrench, along, given_up = graph(name, len(extras))(*wish, np.ravel(extras))
    return thrusts.full()[:, 0], wrench.full()[:, 0], float(along), int(given_up)


def wishes(name: str, count: int, seed: int) -> list[Wish]:
    """Return wishes of every kind: possible and impossible ones, limits narrowed by lag, `along` with and without power."""
    rng, rotors = np.random.default_rng(seed), VEHICLES[name]
    found = []
    for _ in range(count):
        lowest = rng.choice([0, 1]) * rng.uniform(0, 5, rotors.count)
        highest = lowest + rng.uniform(0.1, 8, rotors.count)
        size = 10 ** rng.uniform(-1, 0.7) * rng.choice([0, 1], 4)
        base = rotors.mixer @ rng.uniform(lowest, highest) + rotors.units * size * rng.normal(size=4)
        direction = rotors.units * rng.normal(size=4) * rng.choice([0, 1, 1, 1], 4) * rng.choice([0, 1, 1, 1, 1])
        along = 3 * rng.normal()
        narrow = (along - 3 * rng.random(), along + 3 * rng.random())
        found.append(Wish(base, direction, along, lowest, highest, narrow if rng.random() < 0.4 else (-1e5, 1e5)))
    return found


def solved(name: str, wish: Wish) -> list[float] | None:
    """Return scale of roll and pitch, thrust and yaw torque given up, and `along`, one programme after another; None without any."""
    rotors = VEHICLES[name]
    n, fixed = rotors.count, []
    for goal in (1.0, 0.0, 0.0, wish.along):
        # rotors' thrusts, the four unknowns, and the distance of the next of them from its goal, which is least
        rows = np.zeros((4 + len(fixed), n + 5))
        rows[:4, :n] = rotors.mixer
        rows[[1, 2], n + SCALE] = -wish.base[1:3]
        rows[0, n + THRUST] = rows[3, n + YAW] = -1
        rows[:4, n + ALONG] = -wish.direction
        rows[range(4, 4 + len(fixed)), range(n, n + len(fixed))] = 1
        right = np.array([wish.base[0], 0, 0, wish.base[3], *fixed])
        rows[:4] /= rotors.units[:, None]
        right[:4] /= rotors.units
        distance = np.zeros((2, n + 5))
        distance[:, n + len(fixed)], distance[:, -1] = (1, -1), -1
        bounds = [
            *zip(wish.lowest, wish.highest, strict=True),
            (0, 1),
            (None, None),
            (None, None),
            wish.within,
            (0, None),
        ]
        answer = linprog([0] * (n + 4) + [1], distance, [goal, -goal], rows, right, bounds, method="highs")
        if answer.status != 0:
            return None
        fixed.append(float(answer.x[n + len(fixed)]))
    return fixed


@pytest.mark.parametrize("name", VEHICLES)
def test_allocation_solves_the_lexicographic_linear_programme(name: str) -> None:
    """Roll and pitch are kept first, then thrust, then yaw torque, then `along`; HiGHS's own tolerance is 1e-7."""
    rotors, levels = VEHICLES[name], set()
    for wish in wishes(name, 120, seed=1):
        thrusts, wrench, _, given_up = allocated(name, wish)
        assert np.all((wish.lowest <= thrusts) & (thrusts <= wish.highest))
        np.testing.assert_allclose(wrench, rotors.mixer @ thrusts, rtol=0, atol=1e-12 * np.abs(thrusts).sum())
        best = solved(name, wish)
        if best is None:  # limits narrowed by lag do not let roll and pitch vanish
            assert given_up == 4
            continue
        scale, lift, turn, left = best
        expected = wish.base * [1, scale, scale, 1] + [lift, 0, 0, turn] + wish.direction * left
        np.testing.assert_allclose(wrench / rotors.units, expected / rotors.units, rtol=0, atol=1e-5)
        shares = [abs(left - wish.along), abs(turn) / rotors.units[3], abs(lift) / rotors.units[0], 1 - scale]
        if np.any(wish.direction) and all(share < 1e-8 or share > 1e-4 for share in shares):
            assert given_up == max([level for level, share in enumerate(shares, 1) if share > 1e-4], default=0)
        levels.add(given_up)
    assert levels == {0, 1, 2, 3, 4}


@pytest.mark.parametrize("name", VEHICLES)
def test_what_the_rotors_can_give_they_give_exactly(name: str) -> None:
    rotors, rng = VEHICLES[name], np.random.default_rng(2)
    for wish in wishes(name, 50, seed=3):
        inside = rotors.mixer @ rng.uniform(0.02 * wish.highest + 0.98 * wish.lowest, wish.highest)
        possible = wish._replace(base=inside - wish.direction * wish.along)
        _, wrench, along, given_up = allocated(name, possible)
        assert (along, given_up) == (wish.along, 0)
        np.testing.assert_allclose(
            wrench / rotors.units, inside / rotors.units, rtol=0, atol=1e-12 * wish.highest.sum()
        )


def test_more_than_four_rotors_share_by_least_norm_where_they_can() -> None:
    for name in ("hexarotor", "uneven octorotor"):
        rotors = VEHICLES[name]
        base = np.array([0.5 * rotors.most_thrusts.sum(), 0.05, -0.04, 0.02])
        wish = Wish(base, np.zeros(4), 0.0, rotors.least_thrusts, rotors.most_thrusts, (-1.0, 1.0))
        np.testing.assert_allclose(allocated(name, wish)[0], np.linalg.pinv(rotors.mixer) @ base, rtol=1e-12)


HOVER = Wish(np.array([5.0, 0, 0, 0]), np.zeros(4), 0.0, np.zeros(4), np.full(4, 12.5), (-1e5, 1e5))


@pytest.mark.parametrize(
    ("change", "level"),
    [
        ({}, 0),
        ({"direction": np.array([0, 0.1, 0.2, 0]), "along": 10.0}, 1),
        ({"base": np.array([5.0, 0.05, 0.1, 2.0])}, 2),
        ({"base": np.array([60.0, 0.3, 0, 0])}, 3),
        ({"base": np.array([5.0, 9.0, 12.0, 0.1])}, 4),
    ],
)
def test_each_level_of_priority_gives_up_what_it_says_and_nothing_above(change: dict[str, Any], level: int) -> None:
    wish = HOVER._replace(**change)
    _, wrench, along, given_up = allocated("quadrotor", wish)
    assert given_up == level
    asked = wish.base + wish.direction * along
    if level < 4:
        assert wrench[1:3] == pytest.approx(asked[1:3], abs=1e-12)
    else:
        assert wrench[1] / wrench[2] == pytest.approx(asked[1] / asked[2])  # their direction is kept
        assert 0 < wrench[1] < asked[1]
    if level < 3:
        assert wrench[0] == pytest.approx(asked[0])
    if level < 2:
        assert wrench[3] == pytest.approx(asked[3], abs=1e-12)
    else:
        assert abs(wrench[3] - asked[3]) > 0.01 or level > 2


def test_along_is_used_no_more_than_it_may() -> None:
    """A yaw torque that `along` could make room for is given up instead once the bound of `along` is reached."""
    wish = HOVER._replace(direction=np.array([1.0, 0, 0, 0]), base=np.array([5.0, 0, 0, 0.3]))
    _, wrench, along, given_up = allocated("quadrotor", wish)
    assert (given_up, along > 2) == (1, True)
    assert wrench[3] == pytest.approx(0.3)
    _, wrench, along, given_up = allocated("quadrotor", wish._replace(within=(-0.5, 0.5)))
    assert given_up == 2
    assert along == pytest.approx(0.5)
    assert 0 < wrench[3] < 0.3


def test_other_wishes_for_along_come_after_the_rotors_and_in_their_order() -> None:
    wish = HOVER._replace(direction=np.array([1.0, 0, 0, 0]), along=3.0)
    assert allocated("quadrotor", wish, (0.0, 2.0, -4.0, 4.0))[2] == 2.0  # low <= offset + slope along <= high
    assert allocated("quadrotor", wish, (0.0, -1.0, 1.0, 2.0))[2] == -1.0
    assert allocated("quadrotor", wish, (0.0, 1.0, 5.0, 6.0), (0.0, 1.0, 0.0, 1.0))[2] == 5.0  # the first counts most
    assert allocated("quadrotor", wish, (0.0, 0.0, 5.0, 6.0))[2] == 3.0  # no slope, no say
    assert allocated("quadrotor", wish, (0.0, 1.0, 90.0, 91.0))[2] == pytest.approx(45.0)  # four rotors of 12.5 N


def test_no_input_makes_a_thrust_that_is_no_number_or_beyond_its_limits() -> None:
    rng = np.random.default_rng(5)
    for name, rotors in VEHICLES.items():
        for _ in range(100):
            size = 10.0 ** rng.uniform(-300, 30)
            lowest = rng.uniform(0, 5, rotors.count)
            wish = Wish(
                size * rng.normal(size=4) * rng.choice([0, 1], 4),
                10.0 ** rng.uniform(-300, 20) * rng.normal(size=4) * rng.choice([0, 1], 4),
                10.0 ** rng.uniform(-20, 10) * rng.normal(),
                lowest,
                lowest + rng.choice([0, 1], rotors.count) * rng.uniform(0, 5, rotors.count),
                (-1e9, 1e9),
            )
            thrusts, wrench, along, given_up = allocated(name, wish)
            assert np.all((wish.lowest <= thrusts) & (thrusts <= wish.highest))
            assert np.all(np.isfinite(wrench))
            assert np.isfinite(along)
            assert given_up in range(5)

"""Rotors: torque of forces at their places, limits, lag, hover, and the set of wrenches that they can give."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

from gammastar.errors import GammastarError, InputError, ShapeError
from gammastar.vehicle import Rotors
from gammastar.vehicle.wrenches import normals, slabs_across
from strategies import directions, numbers

QUAD = Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500, first_angle=45, lag=(0.02, 0.05))
HEXA = Rotors.ring(6, 0.2, 1e-5, 2e-7, 800, slowest=100)
UNEVEN = Rotors(
    [[0.2, 0.1, 0], [0.15, -0.2, 0.1], [-0.2, -0.1, 0], [-0.25, 0.2, 0], [0.0, 0.3, 0]],
    [1, -1, 1, -1, 1],
    [1e-5, 2e-5, 1e-5, 1.5e-5, 1e-5],
    [2e-7, 1e-7, 3e-7, 2e-7, 0],
    900,
    100,
)
ALL = {"quadrotor": QUAD, "hexarotor": HEXA, "uneven": UNEVEN}
three = pytest.mark.parametrize("name", ALL)


# --- what they give --------------------------------------------------------------------------------------------------


@three
def test_torque_is_the_moment_of_the_forces_and_of_the_air(name: str) -> None:
    """Thrust is a force -f e3 at r: sum r x (-f e3), and -spin k w^2 about e3 against the rotor's own sense."""
    rotors, rng = ALL[name], np.random.default_rng(0)
    speeds = rng.uniform(100, 800, rotors.count)
    thrusts = rotors.thrust_coefficient * speeds**2
    torque = np.cross(rotors.positions, -thrusts[:, None] * [0, 0, 1]).sum(axis=0)
    torque[2] -= np.sum(rotors.spins * rotors.torque_coefficient * speeds**2)
    np.testing.assert_allclose(rotors.wrench_at(speeds), [thrusts.sum(), *torque], rtol=1e-13, atol=1e-15)


def test_a_rotor_on_the_left_rolls_to_the_right_and_one_ahead_pitches_up() -> None:
    """Body axes forward, right, down: positive roll lowers the right side, positive pitch raises the nose."""
    front, right, back, left = Rotors.ring(4, 0.2, 1e-5, 2e-7, 800).mixer.T
    assert front[2] > 0 > back[2]
    assert left[1] > 0 > right[1]
    assert front[3] < 0 < right[3]  # the front one turns clockwise from above, the body goes the other way


def test_a_ring_is_numbered_clockwise_from_above_starting_ahead() -> None:
    ring = Rotors.ring(6, 0.5, 1e-5, 2e-7, 800, first_angle=30, first_spin=-1)
    angles = np.degrees(np.arctan2(ring.positions[:, 1], ring.positions[:, 0])) % 360
    assert angles == pytest.approx([30, 90, 150, 210, 270, 330])
    assert ring.spins.tolist() == [-1, 1, -1, 1, -1, 1]


@three
def test_speeds_are_the_inverse_of_thrusts(name: str) -> None:
    rotors = ALL[name]
    speeds = np.linspace(0, rotors.fastest, rotors.count)
    again = rotors.speeds(rotors.thrusts(ca.DM(speeds))).full()[:, 0]
    assert again == pytest.approx(speeds)
    assert rotors.speeds(ca.DM(-np.ones(rotors.count))).full().tolist() == [[0]] * rotors.count
    assert rotors.most_thrusts == pytest.approx(rotors.thrust_coefficient * rotors.fastest**2)
    assert rotors.least_thrusts == pytest.approx(rotors.thrust_coefficient * rotors.slowest**2)


# --- lag -------------------------------------------------------------------------------------------------------------


@given(numbers(0, 1500), numbers(0, 1500), numbers(1e-3, 0.2))
def test_lag_is_the_exact_solution_and_its_mean_thrust(speed: float, command: float, interval: float) -> None:
    """Lag is w' = (command - w) / lag, with the time constant of rising or of falling, integrated to 1e-10."""
    lag = 0.02 if command > speed else 0.05
    answer = solve_ivp(
        lambda _, y: [(command - y[0]) / lag, y[0] ** 2],
        (0, interval),
        [speed, 0],
        method="DOP853",
        rtol=1e-11,
        atol=1e-8,
    )
    speeds, commands = ca.DM([speed] * 4), ca.DM([command] * 4)
    after, mean = (f(speeds, commands, interval).full()[:, 0] for f in (QUAD.advanced, QUAD.mean_thrusts))
    assert after == pytest.approx(answer.y[0, -1], rel=1e-8, abs=1e-6)
    assert mean == pytest.approx(5.57e-6 * answer.y[1, -1] / interval, rel=1e-8, abs=1e-9)


@given(numbers(0, 1500), numbers(0, 1500), numbers(1e-3, 0.2))
def test_a_command_reaches_the_speed_wanted_or_stops_at_a_limit(speed: float, wanted: float, interval: float) -> None:
    command = QUAD.commands(ca.DM([speed] * 4), ca.DM([wanted] * 4), interval)
    reached = float(QUAD.advanced(ca.DM([speed] * 4), command, interval)[0])
    if 0 < float(command[0]) < 1500:
        assert reached == pytest.approx(wanted, abs=1e-8)
    else:
        assert abs(reached - wanted) <= abs(speed - wanted)
    lowest, highest = (float(end[0]) for end in QUAD.reachable(ca.DM([speed] * 4), interval))
    assert lowest * (1 - 1e-12) <= 5.57e-6 * reached**2 <= highest * (1 + 1e-12)


def test_without_lag_a_command_is_followed_at_once() -> None:
    speeds, commands = ca.DM([100] * 6), ca.DM([200, 50, 100, 300, 800, 0])
    assert np.array_equal(HEXA.advanced(speeds, commands, 0.01).full(), commands.full())
    assert np.array_equal(HEXA.mean_thrusts(speeds, commands, 0.01).full(), HEXA.thrusts(commands).full())
    assert np.array_equal(HEXA.commands(speeds, commands, 0.01).full()[-1], [100])


def test_graphs_of_lag_are_graphs() -> None:
    speeds, commands = ca.SX.sym("speeds", 4), ca.SX.sym("commands", 4)
    step = ca.Function("step", [speeds, commands], [QUAD.advanced(speeds, commands, 0.01)])
    up = np.exp(-0.01 / 0.02)
    down = np.exp(-0.01 / 0.05)
    found = step([100, 100, 100, 100], [200, 0, 100, 1500]).full()[:, 0]
    assert found == pytest.approx([200 - 100 * up, 100 * down, 100, 1500 - 1400 * up])


# --- hover and the set of wrenches -----------------------------------------------------------------------------------


def test_hover_of_a_regular_vehicle_is_shared_equally() -> None:
    hover = QUAD.hover(0.5 * 9.81)
    assert hover.thrusts == pytest.approx([0.5 * 9.81 / 4] * 4)
    assert hover.speeds == pytest.approx([np.sqrt(0.5 * 9.81 / 4 / 5.57e-6)] * 4)
    assert hover.throttle == pytest.approx(hover.speeds[0] / 1500)
    assert hover.thrust_to_weight == pytest.approx(4 * 5.57e-6 * 1500**2 / (0.5 * 9.81))
    assert hover.throttle == pytest.approx(hover.thrust_to_weight**-0.5)
    assert QUAD.hover(1000).throttle > 1
    assert QUAD.hover(0).thrust_to_weight == np.inf


@three
def test_the_thrust_range_without_torque_is_that_of_a_linear_programme(name: str) -> None:
    rotors = ALL[name]
    limits = list(zip(rotors.least_thrusts, rotors.most_thrusts, strict=True))
    ends = [linprog(sign * rotors.mixer[0], A_eq=rotors.mixer[1:], b_eq=np.zeros(3), bounds=limits) for sign in (1, -1)]
    if all(end.status == 0 for end in ends):
        assert rotors.thrust_range == pytest.approx((ends[0].fun, -ends[1].fun), rel=1e-6)
    else:
        assert rotors.thrust_range[0] > rotors.thrust_range[1]


@three
@given(st.integers(0, 2**32 - 1))
def test_slabs_hold_what_rotors_give_and_touch_its_corners(name: str, seed: int) -> None:
    """Every wrench of a corner is inside every slab; every slab is as wide as the set: both of its sides have a corner."""
    rotors, rng = ALL[name], np.random.default_rng(seed)
    columns = rotors.mixer / rotors.units[:, None]
    slabs = normals(columns)
    widths = np.abs(slabs @ columns).sum(axis=1)
    assert np.all(np.abs(slabs @ columns @ rng.choice([-1, 1], rotors.count)) <= widths * (1 + 1e-12))
    facets = np.abs(slabs @ columns) < 1e-12
    assert np.all(facets.sum(axis=1) >= 3)  # each normal is normal to three columns, and so spans a facet


@three
@given(directions(), numbers(-1, 1))
def test_normals_across_a_direction_are_normal_to_it(name: str, way: np.ndarray, last: float) -> None:
    columns = ALL[name].mixer
    direction = np.append(way, last)
    for given_up in ((), (np.eye(4)[3],), (np.eye(4)[3], np.eye(4)[0])):
        found = ca.DM(slabs_across(ca.SX(direction), columns, ca.SX.ones(columns.shape[1]), given_up)[0]).full()
        assert np.abs(found @ direction).max() < 1e-14
        assert all(np.abs(found @ axis).max() < 1e-14 for axis in given_up)


# --- what rotors can be ----------------------------------------------------------------------------------------------

GOOD = {
    "positions": [[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]],
    "spins": [1, -1, 1, -1],
    "thrust_coefficient": 1e-5,
    "torque_coefficient": 1e-7,
    "fastest": 1000,
}
BAD = {
    "three rotors": ({"positions": [[1, 0, 0]] * 3, "spins": [1, 1, 1]}, ShapeError, "four or more"),
    "flat positions": ({"positions": [[1, 0]] * 4}, ShapeError, "four or more"),
    "uneven positions": ({"positions": [[1, 0], [1]]}, ShapeError, "different lengths"),
    "NaN position": ({"positions": [[np.nan, 1, 0], *GOOD["positions"][1:]]}, ShapeError, "finite"),
    "three spins": ({"spins": [1, -1, 1]}, ShapeError, "spins"),
    "half a spin": ({"spins": [1, -1, 1, 0.5]}, InputError, "spins"),
    "zero thrust": ({"thrust_coefficient": 0}, InputError, "thrust_coefficient"),
    "negative thrust of one": ({"thrust_coefficient": [1, 1, -1, 1]}, InputError, "thrust_coefficient"),
    "negative torque": ({"torque_coefficient": -1e-7}, InputError, "torque_coefficient"),
    "NaN torque": ({"torque_coefficient": np.nan}, ShapeError, "torque_coefficient"),
    "three coefficients": ({"torque_coefficient": [1, 1, 1]}, ShapeError, "torque_coefficient"),
    "no torque": ({"torque_coefficient": 0}, InputError, "every axis"),
    "all one way": ({"spins": [1, 1, 1, 1]}, InputError, "every axis"),
    "in a row": ({"positions": [[1, 0, 0], [2, 0, 0], [3, 0, 0], [-1, 0, 0]]}, InputError, "every axis"),
    "in one place": ({"positions": [[0, 0, 0]] * 4}, InputError, "every axis"),
    "limits crossed": ({"slowest": 1000}, InputError, "slowest"),
    "negative speed": ({"slowest": -1}, InputError, "slowest"),
    "no speed": ({"fastest": 0}, InputError, "fastest"),
    "NaN speed": ({"fastest": np.nan}, InputError, "fastest"),
    "negative lag": ({"lag": -0.1}, InputError, "lag"),
    "three lags": ({"lag": (0.1, 0.1, 0.1)}, ShapeError, "lag"),
    "too many": (
        {"positions": [[np.cos(k), np.sin(k), 0] for k in range(25)], "spins": [1] * 25},
        InputError,
        "at most 24",
    ),
    "NaN lag": ({"lag": (0.1, np.nan)}, ShapeError, "lag"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_no_rotors_are_is_refused(case: str) -> None:
    change, error, reason = BAD[case]
    with pytest.raises(error, match=reason) as caught:
        Rotors(**{**GOOD, **change})
    assert isinstance(caught.value, GammastarError)


@pytest.mark.parametrize(
    "change",
    [
        {"count": 3},
        {"count": 4.5},
        {"count": 25},
        {"count": 1e300},
        {"arm": 0},
        {"arm": np.nan},
        {"first_angle": "x"},
        {"first_angle": np.inf},
        {"first_angle": [0, 1]},
        {"first_spin": 0.5},
        {"first_spin": 1.5},
        {"first_spin": None},
    ],
)
def test_what_no_ring_is_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(GammastarError, match=r" must .*\(got .*; "):
        Rotors.ring(
            **{"count": 4, "arm": 0.2, "thrust_coefficient": 1, "torque_coefficient": 1, "fastest": 1, **change}
        )


def test_rotors_cannot_be_changed_and_have_a_signature() -> None:
    again = Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500, first_angle=45, lag=(0.02, 0.05))
    assert again.signature == QUAD.signature
    assert len({QUAD.signature, HEXA.signature, Rotors(**GOOD).signature, Rotors(**GOOD, lag=0.1).signature}) == 4
    assert all(isinstance(each, float) for each in QUAD.signature)
    assert Rotors(**GOOD, lag=0.1).lag == (0.1, 0.1)
    for each in (QUAD.positions, QUAD.spins, QUAD.thrust_coefficient, QUAD.mixer):
        with pytest.raises(ValueError, match="read-only"):
            each[0] = 1

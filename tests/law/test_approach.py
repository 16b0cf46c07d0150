"""The approach from anywhere: what it bounds, when it acts, and that near the path it does nothing."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar.law.approach import FLOOR_POLE, bounded, floored
from gammastar.law.design import DEFAULT_POLES
from gammastar.law.gains import gains_from_poles
from gammastar.vehicle import split

HUMMINGBIRD = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
POLES = (-3.4, -3.8, -4.2, -4.6)


def law(path: gs.Curve, **settings: float) -> gs.Law:
    return gs.design(HUMMINGBIRD, path, poles=POLES, approach=gs.Approach(**settings))


@pytest.mark.parametrize("size", [0.0, 0.3, 0.999, 1.001, 50.0])
def test_an_error_is_cut_to_its_length_and_keeps_its_direction(size: float) -> None:
    direction = np.array([2.0, -1.0, 2.0]) / 3
    symbol = ca.SX.sym("error", 3)
    cut = np.array(ca.Function("cut", [symbol], [bounded(symbol, 1.0)])(size * direction)).ravel()
    np.testing.assert_allclose(cut, min(size, 1.0) * direction, atol=1e-15)


@pytest.mark.parametrize("poles", [DEFAULT_POLES, (-2.5,) * 4, POLES])
def test_the_cut_loop_is_stable_by_the_circle_criterion(poles: tuple[float, ...]) -> None:
    """G(s) = k1 / (s^4 + k4 s^3 + k3 s^2 + k2 s) around a sector [0, 1] needs Re G > -1; near equal poles it is above -3/8."""
    k = gains_from_poles(poles)
    s = 1j * np.logspace(-4, 4, 200_001)
    real = (k[0] / (s**4 + k[3] * s**3 + k[2] * s**2 + k[1] * s)).real
    assert real.min() >= -0.375 - 1e-3


def test_far_away_the_vehicle_comes_at_the_approach_speed() -> None:
    """From 60 m the speed across the path never passes k1 e_max / k2 by more than the start's transient."""
    flight = gs.fly(law(gs.paths.line(), speed=2.0), gs.State(position=(0, 60, 0)), speed=0.5, duration=60, step=4e-3)
    across = np.abs(flight.velocity[:, 1])
    assert across.max() <= 2.0 * 1.05
    assert np.median(across[(flight.time > 5) & (flight.time < 25)]) == pytest.approx(2.0, rel=1e-6)
    assert flight.distance[-1] < 1e-6


def test_inside_the_bound_the_law_is_the_plain_one() -> None:
    """A start within e_max follows the closed form, and no row is marked."""
    flight = gs.fly(law(gs.paths.circle(2.0)), gs.State(position=(2.4, 0.1, 0.2)), speed=0.4, duration=6)
    assert not flight.constrained.any()
    assert flight.nominal
    assert flight.summary()["oracle"]["max_position_error_m"] < 1e-9


@pytest.mark.parametrize("height", [0.0, -1.5])
@pytest.mark.parametrize("feedback", [{}, {"feedback": "middle", "rate": 400.0}])
def test_a_start_on_the_axis_waits_and_then_follows(height: float, feedback: dict) -> None:
    """On the axis of a circle no nearest point is unique: the target waits once, and the mode changes once."""
    start = gs.State(position=(0, 0, height))
    with pytest.raises(gs.errors.SingularStartError, match="approach"):
        gs.fly(gs.design(HUMMINGBIRD, gs.paths.circle()), start, speed=0.5)
    flight = gs.fly(law(gs.paths.circle()), start, speed=0.5, duration=15, step=2e-3, **feedback)
    assert flight.completed
    assert flight.waiting[0]
    assert np.count_nonzero(np.diff(flight.waiting.astype(int))) == 1
    assert flight.distance[-1] < 1e-6
    assert flight.tangential_state[-1, 1] == pytest.approx(0.5, abs=1e-4)


def test_a_crossing_of_the_axis_is_survived() -> None:
    """At 3 m/s towards and across the axis the plain law meets the focal point; with an approach it waits, and follows."""
    start = gs.State(position=(0.7, 0, 0), velocity=(-3, 0, 0))
    assert gs.fly(gs.design(HUMMINGBIRD, gs.paths.circle(), POLES), start, speed=0.5).status is gs.Status.FOCAL_POINT
    flight = gs.fly(law(gs.paths.circle()), start, speed=0.5, duration=15, step=2e-3)
    assert flight.completed
    assert flight.waiting.any()
    assert flight.distance[-1] < 1e-6


def test_attitude_and_thrust_are_continuous_when_the_mode_changes() -> None:
    """Between neighbouring rows attitude moves by rate times step and thrust by its rate times step, also at the change."""
    flight = gs.fly(law(gs.paths.circle()), gs.State(position=(0, 0, 0)), speed=0.5, duration=8, step=1e-3)
    rates = np.linalg.norm(flight.angular_velocity, axis=1).max()
    turn = np.abs(np.diff(flight.attitude, axis=0)).max()
    assert turn <= 1.1 * rates * 1e-3
    assert np.abs(np.diff(flight.thrust)).max() <= 1.1 * np.abs(flight.state[:, 19]).max() * 1e-3


def test_the_thrust_stays_above_its_floor_from_any_attitude() -> None:
    """The floor's second-order decay is never undercut: T'' >= -2 b T' - b^2 (T - floor) from rest keeps T above it."""
    generator = np.random.default_rng(3)
    lowest = np.inf
    for _ in range(6):
        start = gs.State(position=generator.uniform(-3, 3, 3), attitude=gs.so3.random(generator))
        flight = gs.fly(law(gs.paths.ellipse((2.0, 0.7))), start, speed=0.5, duration=14, step=2e-3)
        assert flight.completed
        assert flight.distance[-1] < 1e-4
        lowest = min(lowest, flight.thrust.min())
    assert lowest >= 0.05 * HUMMINGBIRD.weight * (1 - 1e-6)


def test_the_floor_acts_only_when_the_thrust_falls_towards_it() -> None:
    state = ca.SX.sym("state", 20)
    control = ca.SX.sym("control", 4)
    kept = ca.Function("kept", [state, control], [floored(split(state), control, 1.0)])
    x = np.zeros(20)
    x[18], x[19] = 3.0, -10.0
    least = 2 * FLOOR_POLE * 10.0 - FLOOR_POLE**2 * 2.0
    np.testing.assert_allclose(np.array(kept(x, [least + 5, 1, 2, 3])).ravel(), [least + 5, 1, 2, 3])
    np.testing.assert_allclose(np.array(kept(x, [least - 5, 1, 2, 3])).ravel(), [least, 1, 2, 3])


def test_what_cannot_work_is_refused() -> None:
    with pytest.raises(gs.errors.InputError, match="needs a curve"):
        gs.design(HUMMINGBIRD, gs.paths.circle(kind="implicit"), approach=gs.Approach())
    weightless = gs.Vehicle(mass=5, inertia=(1, 1, 1), gravity=0)
    with pytest.raises(gs.errors.InputError, match="thrust floor"):
        gs.design(weightless, gs.paths.circle(), approach=gs.Approach())
    assert gs.design(weightless, gs.paths.circle(), approach=gs.Approach(thrust_floor=0.1)).approach is not None
    for wrong in ({"speed": 0.0}, {"leave": 0.6, "enter": 0.3}, {"enter": 1.0}, {"thrust_floor": -1.0}):
        with pytest.raises(gs.errors.InputError):
            gs.Approach(**wrong)


HARD = {  # starts that once went off or ended: path, position, velocity, rotation vector, body rates
    "across the tip of an ellipse": (
        gs.paths.ellipse((2.0, 0.7)),
        [[1.6273, 0.0546, 0.0], [1.0653, -2.1628, 1.2526], [0.4816, 0.3362, 2.9548], [1.64, 2.9671, 1.6013]],
    ),
    "where the nearest point changes sides while the target waits": (
        gs.paths.nonplanar_circle(),
        [[1.8305, -2.8416, -1.7003], [-2.1489, -0.3628, -0.4644], [-2.1039, 0.428, -1.7222], [2.1409, 2.4303, 3.1312]],
    ),
}


@pytest.mark.parametrize("name", HARD)
def test_a_hard_start_settles_and_its_thrust_stays_in_bounds(name: str) -> None:
    path, (position, velocity, turn, rates) = HARD[name]
    start = gs.State(position, velocity, gs.so3.exp(turn), rates)
    flight = gs.fly(law(path), start, speed=0.5, duration=14, step=2e-3)
    assert flight.completed
    assert flight.waiting[0]
    assert np.abs(np.diff(flight.waiting.astype(int))).sum() == 1  # one hand-over
    assert flight.distance[-1] < 1e-3
    assert flight.thrust.max() < 10 * HUMMINGBIRD.weight
    sample = path.points(np.linspace(*path.domain, 20_001))
    rows = slice(0, None, 200)
    nearest = np.linalg.norm(flight.position[rows, None] - sample, axis=2).min(axis=1)
    np.testing.assert_allclose(flight.distance[rows], nearest, atol=5e-4)  # the samples are 0.6 mm apart


def test_a_vehicle_that_crosses_the_tube_fast_is_not_inside_it() -> None:
    """At rest the same place is entered at once; across the path at 3 m/s the target waits, along it it does not."""
    tuned, place = law(gs.paths.circle(1.0)), (1.1, 0.0, 0.0)
    for velocity, waits in (((0, 0, 0), False), ((0, 0.8, 0), False), ((3.0, 0, 0), True), ((0, 0, 3.0), True)):
        flight = gs.fly(tuned, gs.State(place, velocity), speed=0.8, duration=8)
        assert bool(flight.waiting[0]) is waits
        assert flight.distance[-1] < 1e-3


@pytest.mark.parametrize("distance", [20.0, 100.0])
def test_far_from_a_small_circle_the_vehicle_is_not_swung_round_it(distance: float) -> None:
    """A hundred radii away the nearest point at 1 rad/s would carry it along at 100 m/s."""
    flight = gs.fly(
        law(gs.paths.circle(1.0), speed=2.0),
        gs.State((distance, 0, 0)),
        speed=1.0,
        duration=10 + distance / 2,
        step=4e-3,
    )
    assert np.linalg.norm(flight.velocity, axis=1).max() < 3.5
    assert flight.distance[-1] < 1e-6


@pytest.mark.parametrize("name", ["ellipse", "waypoints", "waypoints by length"])
def test_the_hand_over_keeps_to_the_piece_that_it_has_looked_up(name: str) -> None:
    """The candidate is sought with the polynomial of the waiting target, which is the path in its own segment only."""
    gates = gs.waypoints([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1)], closed=True)
    path, place, velocity = {
        "ellipse": (gs.by_length(gs.paths.ellipse()), (-3.020, -0.956, -1.957), (-4.85, 6.37, -4.85)),
        "waypoints": (gates, (5, 5, 5), (15, -10, 5)),
        "waypoints by length": (gs.by_length(gates), (5, 5, 5), (15, -10, 5)),
    }[name]
    flight = gs.fly(law(path), gs.State(place, velocity), speed=0.5, duration=20, step=4e-3)
    assert flight.completed
    assert flight.distance[-1] < 1e-6

"""Which constant speeds will do: closed forms for loops, parabolas and circles, and agreement with the margin itself."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from scipy.optimize import brentq

from certificate.curves import QUAD, SATELLITE, TURN, Waypoints, closed, loop, opened, ring, trefoil
from gammastar.certificate.motion import Progress, demands, unit_derivatives
from gammastar.certificate.scan import Scan
from gammastar.certificate.speeds import FLOOR, Limits, allowed_speeds, roots
from gammastar.path import Path
from gammastar.path import catalogue as paths
from gammastar.path.sampling import sample
from gammastar.vehicle import Vehicle
from strategies import numbers, vectors

G = QUAD.gravity


def allowed(path: Path, vehicle: Vehicle = QUAD, limits: Limits | None = None, progress: str = "metres"):
    return allowed_speeds(sample(path), vehicle, Progress(progress), limits or Limits())


@given(second=vectors(5.0), constant=vectors(10.0), bound=numbers(0.01, 12.0), square=numbers(0.0, 30.0))
def test_the_specific_thrust_is_below_the_bound_between_the_roots(second, constant, bound, square) -> None:
    (low,), (high,) = roots(second[None], constant, bound)
    value = np.linalg.norm(constant - square * second)
    inside = bool(low < square < high) or (low == square == 0)
    if abs(value - bound) > 1e-9 * (bound + np.linalg.norm(constant) + square * np.linalg.norm(second)):
        assert (value < bound) == inside


@pytest.mark.parametrize("radius", [0.5, 2.0, 30.0])
def test_a_vertical_loop_is_flown_slower_or_faster_than_the_root_of_g_r(radius: float) -> None:
    """At the top the specific thrust is |g - v^2/r|: v^2 below 0.95 g r, or above 1.05 g r."""
    expected = np.sqrt(np.array([1 - FLOOR, 1 + FLOOR]) * G * radius)
    slow, fast = allowed(loop(radius))
    assert slow == pytest.approx((0, expected[0]), rel=1e-12)
    assert fast == pytest.approx((expected[1], np.inf), rel=1e-12)


def test_a_stretch_narrower_than_a_sample_counts() -> None:
    """With a floor of 1e-3 m/s^2 the stretch at the top of a loop is 2e-4 rad wide, and lies between two samples."""
    path = closed(lambda t: (2 * ca.sin(t + 0.12345), 0, 2 * ca.cos(t + 0.12345)))
    (_, slow), (fast, _) = allowed(path, limits=Limits(specific_thrust=1e-3))
    assert np.array([slow, fast]) ** 2 == pytest.approx((G + np.array([-1e-3, 1e-3])) * 2, rel=1e-12)


def test_the_worst_of_many_near_equal_crests_bounds_the_speed() -> None:
    """Z'' = 2 + cos(7 l) - 1e-6 (l - 4)^2: 22 crests in one stretch, equal within less than the samples are off."""

    def vertical(t):
        return t**2 - ca.cos(7 * t) / 49 - 1e-6 * (t - 4) ** 4 / 12

    (_, slow), *_ = allowed(opened(lambda t: (t, 0, vertical(t)), -10, 10), progress="parameter")
    crest = TURN / 7 * 4
    largest = max(2 + np.cos(7 * x) - 1e-6 * (x - 4) ** 2 for x in crest + np.linspace(-1e-6, 1e-6, 201))
    assert slow**2 == pytest.approx((1 - FLOOR) * G / largest, rel=1e-9)


def test_a_speed_of_the_parameter_is_the_same_speed() -> None:
    """On a circle of 2 m the parameter runs at v / 2."""
    assert np.array(allowed(loop(2.0), progress="parameter")) == pytest.approx(np.array(allowed(loop(2.0))) / 2)


def test_a_ballistic_parabola_is_forbidden_around_its_speed() -> None:
    """(l, 0, g l^2 / (2 v^2)) at parameter speed v is free fall: (1 - u/v^2) g, everywhere."""
    path = opened(lambda t: (t, 0, G * t**2 / (2 * 3.0**2)), -1, 1)
    (_, slow), (fast, _) = allowed(path, progress="parameter")
    assert (slow, fast) == pytest.approx(3 * np.sqrt([1 - FLOOR, 1 + FLOOR]), rel=1e-12)


def test_a_vertical_wave_has_no_fast_window() -> None:
    """(l, 0, sin l): upward of every crest the acceleration shrinks to zero, so some place is in free fall at any speed."""
    ((start, slow),) = allowed(opened(lambda t: (t, 0, ca.sin(t)), -10, 10), progress="parameter")
    assert (start, slow) == (0, pytest.approx(np.sqrt((1 - FLOOR) * G), rel=1e-12))


def test_without_gravity_slow_is_what_is_forbidden() -> None:
    """On a circle the specific thrust is v^2 / r; on a straight line nothing will do; with a bias thrust all will."""
    ((slow, fast),) = allowed(paths.circle(2.0), SATELLITE)
    assert (slow, fast) == (pytest.approx(np.sqrt(2 * 1e-3), rel=1e-12), np.inf)
    assert allowed(paths.line(), SATELLITE) == ()
    loaded = Vehicle(5.0, (0.01, 0.05, 0.05), gravity=0, bias_acceleration=(0, 0.1, 0))
    assert allowed(paths.line(), loaded) == ((0, np.inf),)


def test_buoyancy_that_balances_the_weight_is_free_fall_on_a_line() -> None:
    balanced = Vehicle(5.0, (0.01, 0.05, 0.05), gravity=9.8, bias_acceleration=(0, 0, 9.8))
    assert allowed(paths.line(), balanced) == ()


def test_the_thrust_bounds_the_speed_on_a_circle() -> None:
    """The thrust is m sqrt(g^2 + (v^2/r)^2); a vehicle that cannot hover has no speed at all."""
    most, radius = 1.7 * QUAD.weight, 3.0
    exact = np.sqrt(radius * np.sqrt((most / QUAD.mass) ** 2 - G**2))
    assert np.array(allowed(paths.circle(radius), limits=Limits(thrust=most))) == pytest.approx(
        np.array([(0, exact)]), rel=1e-12
    )
    assert allowed(paths.circle(radius), limits=Limits(thrust=0.9 * QUAD.weight)) == ()


def test_a_thrust_below_the_weight_can_still_carry_a_loop_nowhere() -> None:
    """At the bottom of a loop g + v^2/r exceeds the weight at every speed."""
    assert allowed(loop(1.0), limits=Limits(thrust=0.99 * QUAD.weight)) == ()


def tilt(speed: float, radius: float) -> float:
    """Return the sine of the tilt on a level circle."""
    return speed**2 / radius / np.hypot(G, speed**2 / radius)


def test_the_tilt_rate_bounds_the_speed_on_a_circle() -> None:
    """The thrust axis turns about the vertical at v/r, tilted by theta: its rate is (v/r) sin theta."""
    radius, most = 2.0, 1.5
    exact = brentq(lambda v: v / radius * tilt(v, radius) - most, 0.1, 50, xtol=1e-14)
    ((low, high),) = allowed(paths.circle(radius), limits=Limits(tilt_rate=most))
    assert (low, high) == (0, pytest.approx(exact, rel=1e-9))


def test_the_torque_bounds_the_speed_on_a_circle() -> None:
    """With r = 0 the torque is J |b3' '| across b3: J (v/r)^2 sin theta cos theta, which is largest at some speed."""
    radius, most = 2.0, 0.006

    def torque(v: float) -> float:
        return 4e-3 * (v / radius) ** 2 * tilt(v, radius) * np.sqrt(1 - tilt(v, radius) ** 2)

    first = brentq(lambda v: torque(v) - most, 0.1, 4.4, xtol=1e-14)
    parts = allowed(paths.circle(radius), limits=Limits(torque=most))
    assert parts[0] == (0, pytest.approx(first, rel=1e-9))


LIMITS = Limits(thrust=2.2 * QUAD.weight, tilt_rate=4.0, torque=0.05)


@pytest.mark.parametrize("path", [closed(trefoil), loop(2.0), closed(lambda t: (3 * ca.cos(t), 0, ca.sin(2 * t)))])
@pytest.mark.parametrize("limits", [Limits(), LIMITS], ids=["floor alone", "all limits"])
def test_a_speed_is_allowed_exactly_when_its_margins_say_so(path: Path, limits: Limits) -> None:
    """At 60 speeds, and just inside and outside of each end, the demands on dense samples agree with the intervals."""
    intervals = np.array(allowed(path, limits=limits, progress="parameter"))
    derivatives = unit_derivatives(path.jets(np.linspace(0, TURN, 40_001)), Progress.PARAMETER)
    ends = intervals[np.isfinite(intervals) & (intervals > 0)]
    speeds = np.concatenate([np.geomspace(0.05, 20, 60), ends * (1 - 1e-6), ends * (1 + 1e-6)])
    for speed in speeds:
        found = demands(QUAD, derivatives, speed)
        fits = found.specific_thrust.min() >= limits.floor(QUAD)
        if limits is LIMITS:
            fits &= found.thrust.max() <= LIMITS.thrust
            fits &= found.tilt_rate.max() <= LIMITS.tilt_rate
            fits &= found.torque.max() <= LIMITS.torque
        assert fits == bool(np.any((intervals[:, 0] <= speed) & (speed <= intervals[:, 1]))), speed


def test_a_limit_may_forbid_speeds_in_the_middle() -> None:
    """A loop of 10 m, tilted by 10 degrees, never falls freely; near sqrt(g r) its thrust axis swings round fastest."""
    lean = np.radians(10)
    path = closed(lambda t: (10 * ca.sin(t), 10 * np.sin(lean) * ca.cos(t), 10 * np.cos(lean) * ca.cos(t)))
    (start, slow), (fast, fastest) = allowed(path, limits=Limits(tilt_rate=3.0))
    assert start == 0
    assert slow < np.sqrt(10 * G) < fast < fastest
    derivatives = unit_derivatives(path.jets(np.linspace(0, TURN, 20_001)), Progress.METRES)
    for speed in (slow, fast, fastest):
        assert demands(QUAD, derivatives, speed).tilt_rate.max() == pytest.approx(3, rel=1e-6)


def test_a_peak_between_samples_counts_at_the_end_of_an_interval() -> None:
    path = sample(ring(400))
    scan = Scan(path, QUAD, Progress.PARAMETER, None, 0.3)
    ((_, best),) = scan.parts((0.0, np.inf))[:1]
    beyond = best * 1.0001
    at_samples = demands(QUAD, unit_derivatives(path.jets, Progress.PARAMETER), beyond).torque.max()
    assert at_samples < 0.3
    assert scan.parts((best / 2, beyond)) == [(best / 2, pytest.approx(best, rel=1e-9))]


@pytest.mark.parametrize("seed", range(3))
def test_the_floor_bounds_the_speed_of_a_wild_vertical_path(seed: int) -> None:
    """A random walk in a vertical plane: hundreds of stretches come near free fall, one of them first."""
    points = np.random.default_rng(seed).normal(size=(60, 3)).cumsum(axis=0) * (1, 0, 1)
    path = Waypoints(points)
    (start, largest), *_ = allowed(path, progress="parameter")
    second = path.jets(np.linspace(0, path.period, 100_001))[:, 2]

    def least(speed: float) -> float:
        return float(np.linalg.norm((0, 0, G) - speed**2 * second, axis=1).min())

    assert start == 0
    assert 1 - 1e-9 < least(largest) / (FLOOR * G) < 1.01  # dense as they are, these samples miss the least itself
    assert all(least(largest * part) > FLOOR * G for part in np.linspace(0.01, 0.99, 20))
    assert least(largest * 1.001) < FLOOR * G


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_no_scale_of_speed_is_special(size: float) -> None:
    """Without gravity a tilt rate on a circle is v/r, whatever the size of both."""
    ((_, high),) = allowed(paths.circle(size), SATELLITE, Limits(specific_thrust=1e-9, tilt_rate=2.0))
    assert high == pytest.approx(2 * size, rel=1e-9)


def test_a_straight_line_has_no_largest_speed() -> None:
    assert allowed(paths.line(), limits=Limits(thrust=6.0, tilt_rate=1.0, torque=1.0)) == ((0, np.inf),)


def test_a_constant_torque_beyond_the_limit_leaves_no_speed() -> None:
    vehicle = Vehicle(1.0, (0.01, 0.01, 0.02), bias_torque=(0, 0, 0.2))
    assert allowed(paths.circle(), vehicle, Limits(torque=0.1)) == ()

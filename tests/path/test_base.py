"""What every path can do: name its nearest points, continue them, and measure distances."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from strategies import CURVES, PATHS, Foot, feet, numbers, vectors

few = settings(max_examples=30)  # on each of fourteen paths
CLOSED = [name for name, path in PATHS.items() if path.period is not None]


@functools.cache
def tracker(name: str) -> ca.Function:
    position, parameter = ca.SX.sym("position", 3), ca.SX.sym("parameter")
    return ca.Function("track", [position, parameter], [PATHS[name].track(position, parameter)])


@functools.cache
def samples(name: str, width: float) -> np.ndarray:
    """Return 20,001 points of a path, on its domain widened to both sides."""
    low, high = PATHS[name].domain
    return PATHS[name].points(np.linspace(low - width, high + width, 20001))


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_tracking_stays_at_the_nearest_point(name: str, data: st.DataObject) -> None:
    foot = data.draw(feet(name))
    assert float(tracker(name)(foot.position, foot.parameter)) == pytest.approx(foot.parameter, abs=1e-12 / foot.margin)


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_tracking_comes_back_from_a_guess_nearby(name: str, data: st.DataObject) -> None:
    """Two Newton steps turn an error of 1e-3 into one near 1e-12, with a constant that grows with the distance."""
    foot = data.draw(feet(name, least_margin=0.5))
    far = np.linalg.norm(foot.position - PATHS[name].points(np.array([foot.parameter]))[0])
    for guess in (-1e-3, 1e-3):
        found = float(tracker(name)(foot.position, foot.parameter + guess))
        assert found == pytest.approx(foot.parameter, abs=2e-11 * (1 + far) ** 3)


@pytest.mark.parametrize("name", CLOSED)
@few
@given(st.data(), st.integers(-5, 5))
def test_whole_turns_are_kept(name: str, data: st.DataObject, turns: int) -> None:
    """The parameter is tracked as a state: on the fifth lap it stays on the fifth lap."""
    foot = data.draw(feet(name, least_margin=0.5))
    path = PATHS[name]
    later = foot.parameter + turns * path.period
    assert float(tracker(name)(foot.position, later)) == pytest.approx(later, abs=1e-11)
    assert path.points(np.array([later])) == pytest.approx(path.points(np.array([foot.parameter])), abs=1e-11)
    assert path.distances(foot.position[None], np.array([later])) == pytest.approx(
        path.distances(foot.position[None], np.array([foot.parameter])), abs=1e-11
    )


@pytest.mark.parametrize("name", CLOSED)
@few
@given(numbers(-50, 50), numbers(-50, 50))
def test_the_nearest_turn_is_the_same_point_within_half_a_period(name: str, parameter: float, near: float) -> None:
    path = PATHS[name]
    turned = path.nearest_turn(parameter, near)
    assert abs(turned - near) <= path.period / 2 * (1 + 1e-12)
    laps = (turned - parameter) / path.period
    assert laps == pytest.approx(round(laps), abs=1e-12)


@given(numbers(-50, 50), numbers(-50, 50))
def test_an_open_path_has_one_turn_only(parameter: float, near: float) -> None:
    assert PATHS["helix"].nearest_turn(parameter, near) == parameter


@pytest.mark.parametrize("name", CLOSED)
@settings(max_examples=3)  # of 150 points each
@given(st.data())
def test_the_parameter_is_continuous_all_the_way_round(name: str, data: st.DataObject) -> None:
    """Following the path in small steps never jumps, also where an arc tangent does."""
    path = PATHS[name]
    begin = data.draw(numbers(0, 7))
    grid = begin + np.linspace(0, 2 * path.period, 150)
    points, parameter = path.points(grid), grid[0]
    for wanted, point in zip(grid, points, strict=True):
        parameter = float(tracker(name)(point, parameter))
        parameter = float(tracker(name)(point, parameter))
        assert parameter == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("name", CURVES)
@settings(max_examples=20)  # each looks at 20,000 points
@given(st.data())
def test_the_start_is_the_nearest_point_of_all(name: str, data: st.DataObject) -> None:
    """Anywhere in space, the point found is at least as near as every one of 20,000 samples."""
    path = CURVES[name]
    low, high = path.domain
    middle = path.points(np.array([data.draw(numbers(low, high))]))[0]
    position = middle + data.draw(st.sampled_from([0.1, 1.0, 20.0])) * data.draw(vectors(1.0))
    parameter = path.start_parameter(position)
    sampled = samples(name, 0.0 if path.period is not None else 4 * (high - low))
    found = float(np.linalg.norm(path.points(np.array([parameter]))[0] - position))
    assert found <= np.linalg.norm(sampled - position, axis=1).min() + 1e-12
    assert path.distances(position[None], np.array([parameter]))[0] == pytest.approx(found, abs=1e-9)


@pytest.mark.parametrize("turn", [-9.3, -4.5, 2.5, 5.0, 30.2])
def test_the_start_is_found_beyond_the_drawn_domain_of_an_open_curve(turn: float) -> None:
    """A start on the helix itself, whole turns above and below what is drawn, has distance zero."""
    helix = CURVES["helix"]
    parameter = 2 * np.pi * turn
    assert helix.start_parameter(helix.points(np.array([parameter]))[0]) == pytest.approx(parameter, abs=1e-9)


def test_the_start_is_found_on_a_branch_beyond_the_drawn_domain() -> None:
    """A local minimum inside the domain is not the answer while a wider interval holds a nearer point."""
    for position in ((0.0, 15.0, -15.0), (-1.0, 59 / 6, -5.84)):
        path, found = CURVES["twisted"], CURVES["twisted"].start_parameter(np.array(position))
        nearest = np.linalg.norm(samples("twisted", 16.0) - position, axis=1).min()
        assert np.linalg.norm(path.points(np.array([found]))[0] - position) <= nearest


@pytest.mark.parametrize("distance", [-1e5, -37.0, 12.0, 4e4])
def test_the_start_is_found_far_along_a_line(distance: float) -> None:
    line = CURVES["line"]
    tangent = np.array([1, -1, 0.5]) / 1.5
    position = np.array([1, 2, 3]) + distance * tangent + np.cross(tangent, [0, 0, 5.0])
    assert line.start_parameter(position) == pytest.approx(distance, rel=1e-12)


@pytest.mark.parametrize("name", CURVES)
@few
@given(st.data())
def test_the_distance_is_the_length_to_the_nearest_point(name: str, data: st.DataObject) -> None:
    foot = data.draw(feet(name, least_margin=0.3))
    path = CURVES[name]
    expected = np.linalg.norm(foot.position - path.points(np.array([foot.parameter]))[0])
    for guess in (0.0, 1e-4, -1e-4):
        found = path.distances(foot.position[None], np.array([foot.parameter + guess]))[0]
        assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", ["implicit circle", "quadratic circle", "implicit tilted circle"])
@few
@given(st.data())
def test_the_distance_to_an_implicit_circle_is_exact(name: str, data: st.DataObject) -> None:
    """Pi is the nearest-point projection there, Eq. (12)."""
    foot = data.draw(feet(name, least_margin=0.2))
    twin = CURVES["tilted circle" if "tilted" in name else "circle"]
    expected = twin.distances(foot.position[None], np.array([twin.start_parameter(foot.position)]))
    assert PATHS[name].distances(foot.position[None], np.array([foot.parameter])) == pytest.approx(expected, abs=1e-10)


@given(feet("parabola"))
@example(Foot(np.array([1.3346654, 0.96258077, 0.44799335]), 1.4242640687119286, 0.17))
def test_the_distance_to_any_implicit_path_is_never_too_small(foot: Foot) -> None:
    """Pi of the parabola is not its projection, so its distance is searched: right nearby, never below the true one."""
    found = PATHS["parabola"].distances(foot.position[None], np.array([foot.parameter]))[0]
    x, y, z = foot.position  # the same curve, explicitly: (s, s^2, s^3 / 10)
    roots = np.polynomial.Polynomial([-x, 1 - 2 * y, -0.3 * z, 2, 0, 0.03]).roots()  # of <point - position, tangent>
    s = roots[np.abs(roots.imag) < 1e-6].real
    true = np.linalg.norm(np.column_stack([s, s**2, s**3 / 10]) - foot.position, axis=1).min()
    assert found >= true - 1e-9
    if true < 0.2:
        assert found == pytest.approx(true, rel=1e-2, abs=1e-9)

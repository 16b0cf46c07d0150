"""Paths in the paper's form: two functions that vanish on them and one along them, Eqs. (10), (13)."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from gammastar.errors import PathError, ShapeError
from gammastar.path import ImplicitPath
from gammastar.path.tracing import Trace
from strategies import CURVES, IMPLICIT, numbers

TWINS = {"implicit circle": "circle", "quadratic circle": "circle", "implicit tilted circle": "tilted circle"}


@functools.cache
def formulas(name: str) -> ca.Function:
    path, x = IMPLICIT[name], ca.SX.sym("x", 3)
    values = [formula(*ca.vertsplit(x)) for formula in (path.first, path.second, path.coordinate)]
    return ca.Function("formulas", [x], [ca.vertcat(*values)])


@pytest.mark.parametrize("name", IMPLICIT)
@settings(max_examples=30)
@given(st.data())
def test_points_lie_on_the_path_at_their_coordinate(name: str, data: st.DataObject) -> None:
    low, high = IMPLICIT[name].domain
    grid = np.array([data.draw(numbers(low - 3, high + 3)) for _ in range(3)])
    for parameter, point in zip(grid, IMPLICIT[name].points(grid), strict=True):
        first, second, along = np.array(formulas(name)(point)).ravel()
        assert [first, second] == pytest.approx([0, 0], abs=1e-12)
        turns = (parameter - along) / (2 * np.pi) if IMPLICIT[name].period else parameter - along
        assert turns == pytest.approx(round(turns), abs=1e-12)


@pytest.mark.parametrize("name", TWINS)
def test_both_kinds_of_circle_are_the_same_curve(name: str) -> None:
    """Point and five derivatives, at angles of several turns."""
    grid = np.linspace(-7, 14, 50)
    expected = CURVES[TWINS[name]].jets(grid)
    assert IMPLICIT[name].jets(grid) == pytest.approx(expected, abs=1e-11)


def test_the_jet_of_an_implicit_path_is_that_of_its_explicit_form() -> None:
    """The parabola is (s, s^2, s^3/10) at pi = s + s^3/50; a curve of s has the same tangent line and the same points."""
    s = np.linspace(-1.2, 1.2, 9)
    explicit = np.column_stack([s, s**2, s**3 / 10])
    jets = IMPLICIT["parabola"].jets(s + s**3 / 50)
    assert jets[:, 0] == pytest.approx(explicit, abs=1e-12)
    slope = 1 + 3 * s**2 / 50  # d pi / d s
    tangent = np.column_stack([np.ones(9), 2 * s, 3 * s**2 / 10]) / slope[:, None]
    assert jets[:, 1] == pytest.approx(tangent, abs=1e-12)
    bend = np.column_stack([np.zeros(9), 2 * np.ones(9), 6 * s / 10]) / slope[:, None] ** 2
    bend -= tangent * (6 * s / 50 / slope**2)[:, None]
    assert jets[:, 2] == pytest.approx(bend, abs=1e-11)


def test_the_seed_need_only_be_near_the_path() -> None:
    path = ImplicitPath(lambda x, y, z: y - ca.sin(x), lambda x, y, z: z - 1, lambda x, y, z: x, seed=(0.5, 2.0, -3.0))
    assert path.points(np.array([0.5, -2.0])) == pytest.approx(
        np.array([[0.5, np.sin(0.5), 1], [-2, np.sin(-2), 1]]), abs=1e-12
    )


GOOD = {
    "first": lambda x, y, z: y - x**2,
    "second": lambda x, y, z: z,
    "coordinate": lambda x, y, z: x,
    "seed": (0.0, 0.0, 0.0),
}
BAD = {
    "no point": ({"first": lambda x, y, z: x**2 + y**2 + 1}, PathError, "near its seed"),
    "NaN at the seed": ({"first": lambda x, y, z: ca.sqrt(y - 5)}, PathError, "near its seed"),
    "the same function twice": ({"second": lambda x, y, z: 2 * y - 2 * x**2}, PathError, "independent|near its seed"),
    "a coordinate across": ({"coordinate": lambda x, y, z: y + z - x**2}, PathError, "independent"),
    "a constant coordinate": ({"coordinate": lambda x, y, z: ca.SX(1)}, PathError, "independent"),
    "a vector": (
        {"second": lambda x, y, z: ca.vertcat(x, y)},
        PathError,
        "s1, s2 or pi of implicit path must return scalars .got one of 2 by 1",
    ),
    "text": ({"second": lambda x, y, z: "deep"}, PathError, "CasADi scalars"),
    "a flat seed": ({"seed": (0.0, 0.0)}, ShapeError, "seed"),
    "a NaN seed": ({"seed": (0.0, 0.0, np.nan)}, ShapeError, "seed"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_path_is_refused(case: str) -> None:
    parts, error, reason = BAD[case]
    with pytest.raises(error, match=reason):
        ImplicitPath(**{**GOOD, **parts})


def test_a_formula_that_is_not_smooth_is_refused_where_its_series_is_taken() -> None:
    path = {**GOOD, "second": lambda x, y, z: z + ca.floor(x)}
    with pytest.raises(PathError, match="differentiable operations"):
        ImplicitPath(**path)


ROUND = {
    "first": lambda x, y, z: ca.sqrt(x**2 + y**2) - 1,
    "second": lambda x, y, z: z,
    "seed": (1.0, 0.0, 0.0),
}


def angle(x: ca.SX, y: ca.SX, z: ca.SX) -> ca.SX:
    return ca.atan2(y, x)


def steep(x: ca.SX, y: ca.SX, z: ca.SX) -> ca.SX:
    """Graph: an angle that does not know its quadrant: it jumps by pi where x changes sign."""
    return ca.atan(y / x)


@pytest.mark.parametrize(
    ("coordinate", "period", "reason"),
    [
        (angle, np.pi, r"must close after its period \(got a gap of 2 m after 3.14159\)"),
        (angle, 1.0, r"must close after its period \(got a gap of 0.959 m after 1\)"),
        (angle, 6.283185, r"a jump from 3.14159235 to -3.14159265 at .*, and a period of 6.283185"),
        (angle, 6.28, "and a period of 6.28"),
        (angle, 4 * np.pi, r"got a jump from 3.14159 to -3.14159 at \[-1.0, 0.0, 0.0\]\); give the period"),
        (angle, 6.0, "got a jump from 3.14159 to -3.14159"),
        (angle, None, "write an angle with atan2 and give its period"),
        (steep, np.pi, "got a gap of 2 m"),
        (steep, 2 * np.pi, r"got a jump from 1.5708 to -1.570.* at \[0.0, 1.0, 0.0\]"),
        (steep, None, r"got a jump from -1.5708 to 1.570.* at \[0.0, -1.0, 0.0\]\); write an angle with atan2"),
        (lambda x, y, z: 2 * ca.atan2(y, x), 2 * np.pi, "got a gap of 2 m"),
        (lambda x, y, z: y, None, r"as far as -10 \(got nothing below -1, at \[0.0, -1.0, 0.0\]\)"),
    ],
)
def test_a_pi_that_is_no_coordinate_of_the_path_is_refused_with_the_place(coordinate, period, reason: str) -> None:
    """A circle has one coordinate: continuous but for whole periods, and back at the same point after one, not before."""
    with pytest.raises(PathError, match=reason):
        ImplicitPath(**ROUND, coordinate=coordinate, period=period)


@pytest.mark.parametrize("turns", [1, 2, -3])
def test_an_angle_of_any_scale_and_sense_is_a_coordinate(turns: int) -> None:
    path = ImplicitPath(
        **ROUND, coordinate=lambda x, y, z: turns * ca.atan2(y, x), period=2 * np.pi * abs(turns), name="round"
    )
    expected = [np.cos(0.7 / turns), np.sin(0.7 / turns), 0]
    assert path.points(np.array([0.7]))[0] == pytest.approx(expected, abs=1e-12)


def test_a_point_outside_the_range_of_pi_is_refused_with_the_place_where_it_ends() -> None:
    """On the circle x reaches from -1 to 1."""
    path = ImplicitPath(**ROUND | {"seed": (0, -1, 0)}, coordinate=lambda x, y, z: x, domain=(-0.9, 0.9))
    assert path.points(np.array([0.999]))[0] == pytest.approx([0.999, -np.sqrt(1 - 0.999**2), 0], abs=1e-12)
    with pytest.raises(PathError, match=r"as far as 1.5 \(got nothing beyond 1, at \[1.0, -?0.0, 0.0\]"):
        path.points(np.array([0.0, 1.5]))


def test_a_point_that_newton_steps_do_not_find_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    path = ImplicitPath(**ROUND, coordinate=angle, period=2 * np.pi)
    monkeypatch.setattr(Trace, "guesses", lambda _, parameters: np.full((len(parameters), 3), 1e-3))
    with pytest.raises(PathError, match=r"one point for every pi \(got none at 1 "):
        path.points(np.array([1.0]))


DISTORTED = {  # paths whose pi is not the nearest-point projection, each with its explicit form and its parameters
    "parabola": (IMPLICIT["parabola"], lambda s: (s, s**2, s**3 / 10), (-6, 6), 4.0),
    "saddle": (
        ImplicitPath(
            lambda x, y, z: x**2 / 9 + y**2 - 1,
            lambda x, y, z: z - 0.3 * x * y,
            lambda x, y, z: ca.atan2(y, x),
            seed=(3, 0, 0),
            period=2 * np.pi,
        ),
        lambda s: (3 * np.cos(s), np.sin(s), 0.9 * np.cos(s) * np.sin(s)),
        (0, 2 * np.pi),
        5.0,
    ),
    "wave": (
        ImplicitPath(lambda x, y, z: y - 2 * ca.sin(x), lambda x, y, z: z, lambda x, y, z: x, seed=(0, 0, 0)),
        lambda s: (s, 2 * np.sin(s), 0 * s),
        (-30, 30),
        20.0,
    ),
}


@pytest.mark.parametrize("name", DISTORTED)
def test_the_distance_to_any_implicit_path_is_that_to_its_nearest_point(name: str) -> None:
    """Against 400,000 points of the explicit form: never above their least distance d, and below by what lies between them.

    Half a spacing h/2 away from the nearest point, d^2 has grown by (1 + k d) h^2/4 at most, with the curvature k below 4.
    """
    path, explicit, (low, high), size = DISTORTED[name]
    grid = np.column_stack(explicit(np.linspace(low, high, 400_001)))
    spacing = np.linalg.norm(np.diff(grid, axis=0), axis=1).max()
    positions = np.random.default_rng(5).uniform(-size, size, (500, 3))
    sampled = cKDTree(grid).query(positions)[0]
    found = path.distances(positions, np.array([path.start_parameter(position) for position in positions]))
    assert np.all(found <= sampled * (1 + 1e-12))
    assert np.all(sampled**2 - found**2 <= (1 + 4 * sampled) * spacing**2 / 4 + 1e-12)


def test_the_distance_of_what_is_no_position_is_no_number() -> None:
    path = IMPLICIT["implicit circle"]
    positions = np.array([[2.0, 0, 10], [np.nan, 0, 0]])
    assert path.distances(positions, np.array([0, np.nan])) == pytest.approx([1, np.nan], nan_ok=True)


def test_points_far_along_a_path_are_found() -> None:
    """Ten thousand metres of waves are traced in steps that follow the waves, and of a line in a few hundred long ones."""
    wave, _, _, _ = DISTORTED["wave"]
    assert wave.points(np.array([1e4]))[0] == pytest.approx([1e4, 2 * np.sin(1e4), 0], abs=1e-9)
    line = ImplicitPath(lambda x, y, z: y, lambda x, y, z: z, lambda x, y, z: x, seed=(0, 0, 0))
    assert line.points(np.array([1e6]))[0] == pytest.approx([1e6, 0, 0], abs=1e-9)
    assert len(line._course._trace.table[0]) < 1000


def test_a_trace_ends_in_bounded_time() -> None:
    wave = ImplicitPath(lambda x, y, z: y - ca.sin(x), lambda x, y, z: z, lambda x, y, z: x, seed=(0, 0, 0))
    with pytest.raises(PathError, match=r"must be traced to pi = 1e\+09 in 200000 steps \(got to"):
        wave.points(np.array([1e9]))
    with pytest.raises(PathError, match="must be traced"):
        wave.distances(np.array([[1e9, 1, 0]]), np.array([1e9]))
    grid = np.linspace(-4, 4, 100_001)
    least = np.hypot(grid, 50 - np.sin(grid)).min()  # between samples it is less by 1e-9
    assert wave.distances(np.array([[0, 50, 0]]), np.zeros(1)) == pytest.approx([least], abs=1e-8)

"""Placement is a similarity of space: it commutes with whatever a path is made of."""

from __future__ import annotations

import dataclasses
import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gammastar as gs
from gammastar import so3
from gammastar.errors import InputError, RotationError, ShapeError
from gammastar.path import Curve, ImplicitPath
from gammastar.path import catalogue as paths
from gammastar.path.placement import Placement, placed
from strategies import CURVES, IMPLICIT, PATHS, numbers, rotations, vectors

scales = st.one_of(st.just(1.0), numbers(0.1, 10))
few = settings(max_examples=12)  # every example builds its graphs anew
places = st.builds(Placement, vectors(20.0), rotations(), scales)
SOME = [
    "tilted circle",
    "helix",
    "nonplanar circle",
    "twisted",
    "implicit tilted circle",
    "quadratic circle",
    "parabola",
]


def parameters_of(name: str) -> np.ndarray:
    return np.linspace(*PATHS[name].domain, 7)[1:-1]


def at(name: str, place: Placement) -> Curve | ImplicitPath:
    return placed(PATHS[name], place.position, place.rotation, place.scale)


@pytest.mark.parametrize("name", SOME)
@few
@given(places)
def test_placed_jets_are_scaled_and_turned_jets(name: str, place: Placement) -> None:
    """sigma_placed^(k) = scale R sigma^(k), and the point itself is moved."""
    grid = parameters_of(name)
    jets, found = PATHS[name].jets(grid), at(name, place).jets(grid)
    expected = place.scale * jets @ place.rotation.T
    expected[:, 0] += place.position
    assert found == pytest.approx(expected, abs=1e-10 * place.scale * (1 + np.abs(jets).max()) + 1e-13)


@pytest.mark.parametrize("name", SOME)
@few
@given(places, places)
def test_placing_twice_is_placing_once(name: str, first: Placement, second: Placement) -> None:
    """X -> p2 + c2 R2 (p1 + c1 R1 x) is the similarity of position p2 + c2 R2 p1, rotation R2 R1, scale c2 c1."""
    grid = parameters_of(name)[:2]
    twice = placed(at(name, first), second.position, second.rotation, second.scale)
    once = placed(
        PATHS[name], second.points([first.position])[0], second.rotation @ first.rotation, second.scale * first.scale
    )
    size = 1 + second.scale * first.scale
    assert twice.points(grid) == pytest.approx(once.points(grid), abs=1e-10 * size)


@pytest.mark.parametrize("name", SOME)
def test_placing_nowhere_changes_nothing(name: str) -> None:
    grid = parameters_of(name)
    assert placed(PATHS[name]).jets(grid) == pytest.approx(PATHS[name].jets(grid), abs=1e-14)


@pytest.mark.parametrize("name", PATHS)
def test_placing_keeps_the_form_its_period_and_its_domain(name: str) -> None:
    path, moved = PATHS[name], placed(PATHS[name], (1, 2, 3), so3.roll(30), 2.0)
    assert type(moved) is type(path)
    assert (moved.name, moved.period, moved.domain) == (path.name, path.period, path.domain)


@functools.cache
def gradient_of(path: ImplicitPath) -> ca.Function:
    position = ca.SX.sym("position", 3)
    values = ca.vertcat(*(f(*ca.vertsplit(position)) for f in (path.first, path.second, path.coordinate)))
    return ca.Function("gradient", [position], [values, ca.jacobian(values, position)])


@pytest.mark.parametrize("name", IMPLICIT)
@few
@given(places, st.data())
def test_placing_keeps_the_gradients_of_an_implicit_path(name: str, place: Placement, data: st.DataObject) -> None:
    """s1 and s2 keep the length of their gradients: a distance stays one in metres.  pi keeps its values."""
    path = IMPLICIT[name]
    local = path.points(np.array([data.draw(numbers(*path.domain))]))[0] + data.draw(vectors(0.1))
    values, gradient = (np.array(v) for v in gradient_of(path)(local))
    found, turned = (np.array(v) for v in gradient_of(at(name, place))(place.points([local])[0]))
    factors = np.array([[place.scale], [place.scale], [1.0]])
    assert found == pytest.approx(factors * values, abs=1e-9 * place.scale + 1e-12)
    size = 1 + np.abs(gradient).max()
    assert turned == pytest.approx(
        factors / place.scale * gradient @ place.rotation.T, abs=1e-10 * size * (1 + 1 / place.scale)
    )


def test_the_distance_to_a_placed_circle_is_in_metres() -> None:
    """s1 = r - 1 of the unit circle, ten times as large, is the distance to the circle of ten metres."""
    circle = placed(paths.circle(kind="implicit"), (0, 0, -5), so3.pitch(40), 10.0)
    assert float(circle.first(*placed_point(circle, (1.25, 0, 0)))) == pytest.approx(2.5, abs=1e-12)
    assert circle.period == pytest.approx(2 * np.pi)


def placed_point(circle: ImplicitPath, local: tuple[float, float, float]) -> np.ndarray:
    return Placement((0, 0, -5), so3.pitch(40), 10.0).points([local])[0]


@pytest.mark.parametrize("name", [name for name, curve in CURVES.items() if curve.plane_normal is not None])
def test_the_plane_of_a_planar_curve_turns_with_it(name: str) -> None:
    turn = so3.exp([0.3, -1.2, 0.4])
    moved = placed(CURVES[name], rotation=turn)
    assert moved.plane_normal == pytest.approx(turn @ CURVES[name].plane_normal, abs=1e-12)


@given(places, vectors(5.0))
def test_the_graphs_are_inverse_to_each_other_and_to_the_numbers(place: Placement, local: np.ndarray) -> None:
    world = np.array(ca.DM(place.vector(ca.DM(local)))).ravel()
    assert world == pytest.approx(place.points([local])[0], abs=1e-13 * (1 + place.scale))
    back = np.array([float(entry) for entry in place.local(*(ca.DM(c) for c in world))])
    assert back == pytest.approx(local, abs=1e-12 * (1 + 1 / place.scale))


def test_a_rotation_printed_to_a_few_digits_is_the_nearest_one() -> None:
    printed = np.round(so3.roll(179.0), 4)
    place = Placement(rotation=printed)
    nearest, distance = so3.project(printed)
    assert np.array_equal(place.rotation, nearest)
    assert place.rotation_distance == distance > 1e-6


def test_an_exact_rotation_keeps_its_zeros() -> None:
    """A quarter turn costs no arithmetic in the graph."""
    quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    place = Placement(rotation=quarter)
    assert np.array_equal(place.rotation, quarter)
    symbol = ca.SX.sym("x", 3)
    assert ca.Function("turn", [symbol], [place.vector(symbol)]).n_instructions() == 7  # three in, one minus, three out


def test_an_axis_of_the_mission_frame_is_a_placement() -> None:
    """What is written with the third axis up is placed by diag(1, -1, -1)."""
    up = placed(paths.circle(2.0, (1, 2, 3)), rotation=np.diag([1.0, -1.0, -1.0]))
    assert up.points(np.array([0.0, np.pi / 2])) == pytest.approx(np.array([[3, -2, -3], [1, -4, -3]]), abs=1e-14)


BAD = {
    "scale zero": ({"scale": 0.0}, InputError, "scale"),
    "negative scale": ({"scale": -1.0}, InputError, "scale"),
    "scale NaN": ({"scale": np.nan}, InputError, "scale"),
    "scale of text": ({"scale": "large"}, InputError, "scale"),
    "position in the plane": ({"position": (1, 2)}, ShapeError, "position"),
    "position at infinity": ({"position": (1, 2, np.inf)}, ShapeError, "position"),
    "scaled rotation": ({"rotation": 2 * np.eye(3)}, RotationError, "rotation must be .* scale"),
    "reflection": ({"rotation": np.diag([1.0, 1.0, -1.0])}, RotationError, r"determinant \+1"),
    "rotation by numbers": ({"rotation": (1, 2, 3)}, ShapeError, "shape"),
    "rotation NaN": ({"rotation": np.full((3, 3), np.nan)}, ShapeError, "finite"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_placement_is_refused(case: str) -> None:
    keys, error, reason = BAD[case]
    with pytest.raises(error, match=reason):
        placed(paths.circle(), **keys)


def test_points_come_in_rows_of_three() -> None:
    with pytest.raises(ShapeError, match="n, 3"):
        Placement().points([1.0, 2.0, 3.0])


def test_only_known_forms_are_placed() -> None:
    with pytest.raises(InputError, match="str"):
        placed("circle")


def test_a_placement_does_not_change() -> None:
    place = Placement()
    with pytest.raises(dataclasses.FrozenInstanceError):
        place.scale = 2.0
    with pytest.raises(ValueError, match="read-only"):
        place.rotation[0, 0] = 2.0


@pytest.mark.parametrize("name", ["closed", "open", "by length"])
def test_splines_and_paths_by_their_length_are_placed_too(name: str) -> None:
    """Every point moves as a point does; metres stay metres."""
    gates = np.array([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1)], dtype=float)
    path = gs.waypoints(gates, closed=name != "open")
    if name == "by length":
        path = gs.by_length(path)
    place = Placement((1, -2, -3), gs.so3.roll(40) @ gs.so3.yaw(25), 1.5)
    moved = placed(path, place.position, place.rotation, place.scale)
    shares = np.linspace(0, 1, 50)
    scale = place.scale if name == "by length" else 1.0
    parameters = path.domain[0] + shares * (path.domain[1] - path.domain[0])
    np.testing.assert_allclose(moved.points(scale * parameters), place.points(path.points(parameters)), atol=1e-5)
    assert moved.length() == pytest.approx(1.5 * path.length(), rel=1e-9)
    assert (moved.period is None) is (path.period is None)

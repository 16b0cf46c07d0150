"""Paths in the paper's form: two functions that vanish on them and one along them, Eqs. (10), (13)."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.errors import PathError, ShapeError
from gammastar.path import ImplicitPath
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
    "a vector": ({"second": lambda x, y, z: ca.vertcat(x, y)}, PathError, "must be scalars"),
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

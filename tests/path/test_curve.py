"""Curves given by a formula: their jet, and what cannot be a curve."""

from __future__ import annotations

import functools
import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.errors import InputError, PathError
from gammastar.path import Curve
from strategies import CURVES, numbers


@functools.cache
def differentiated(name: str) -> ca.Function:
    """Return parameter -> jet of the law, and jet by differentiating the formula again and again."""
    curve, parameter = CURVES[name], ca.SX.sym("parameter")
    derivatives = [ca.vertcat(*(ca.SX(entry) for entry in _entries(curve.point(parameter))))]
    for _ in range(5):
        derivatives.append(ca.jacobian(derivatives[-1], parameter))
    return ca.Function("jets", [parameter], [ca.horzcat(*curve.jet(parameter)), ca.horzcat(*derivatives)])


def _entries(value: object) -> list:
    return list(value) if isinstance(value, tuple) else ca.vertsplit(value)


@pytest.mark.parametrize("name", CURVES)
@settings(max_examples=30)
@given(st.data())
def test_the_jet_is_the_derivatives_of_the_formula(name: str, data: st.DataObject) -> None:
    parameter = data.draw(numbers(*CURVES[name].domain))
    jet, again = (np.array(value) for value in differentiated(name)(parameter))
    assert jet.shape == (3, 6)
    assert jet == pytest.approx(again, abs=1e-11 * (1 + np.abs(again).max()))
    assert pytest.approx(jet, abs=1e-13 * (1 + np.abs(jet).max())) == CURVES[name].jets(np.array([parameter]))[0].T
    assert CURVES[name].points(np.array([parameter]))[0] == pytest.approx(jet[:, 0], abs=1e-14)


@pytest.mark.parametrize("name", CURVES)
def test_tangents_are_unit_vectors_along_the_derivative(name: str) -> None:
    grid = np.linspace(*CURVES[name].domain, 40)
    tangents = CURVES[name].tangents(grid)
    assert np.linalg.norm(tangents, axis=1) == pytest.approx(np.ones(40), abs=1e-14)
    derivatives = np.array([np.array(differentiated(name)(s)[1])[:, 1] for s in grid])
    assert np.cross(tangents, derivatives) == pytest.approx(np.zeros((40, 3)), abs=1e-12)
    assert np.all(np.sum(tangents * derivatives, axis=1) > 0)


def test_a_closed_curve_is_drawn_over_one_period() -> None:
    assert CURVES["uneven circle"].domain == (0, 2 * np.pi)


def test_a_formula_may_return_a_column() -> None:
    column = Curve(lambda s: ca.vertcat(s, 2 * s, ca.sin(s)))
    assert column.points(np.array([0.5]))[0] == pytest.approx([0.5, 1.0, np.sin(0.5)], abs=1e-15)


BAD = {
    "a point": (lambda s: (0 * s, 1, 2), {}, "zero speed"),
    "a standstill": (lambda s: (s**2, s**3, 0), {"domain": (0.0, 1.0)}, "zero speed"),
    "infinite": (lambda s: (1 / s, s, 0), {"domain": (0.0, 1.0)}, "finite"),
    "NaN": (lambda s: (ca.sqrt(s), s, 0), {}, "finite"),
    "NaN coefficients": (lambda s: (s, np.nan, 0), {}, "finite"),
    "two entries": (lambda s: (s, s), {}, "three scalars"),
    "a matrix": (lambda s: (s, s, ca.SX.eye(3)), {}, "must return scalars .got one of 3 by 3"),
    "a column of four": (lambda s: ca.vertcat(s, s, s, s), {}, "three scalars"),
    "text": (lambda s: (s, s, "deep"), {}, "CasADi scalars"),
    "not smooth": (lambda s: (s, ca.floor(s), 0), {}, "differentiable operations"),
    "a gap": (lambda s: (ca.cos(s), ca.sin(s), 0), {"period": 6.0}, "close after its period"),
    "never closed": (lambda s: (s, s, 0), {"period": 1.0}, "close after its period"),
    "no interval": (lambda s: (s, s, 0), {"domain": (1.0, 1.0)}, "interval"),
    "a wrong plane": (lambda s: (s, s**2, 0), {"plane_normal": (0, 1, 1)}, "plane_normal"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_regular_curve_is_refused(case: str) -> None:
    point, options, reason = BAD[case]
    with pytest.raises(PathError, match=reason) as caught:
        Curve(point, **options)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, "long"])
def test_a_period_is_positive(period: object) -> None:
    with pytest.raises(InputError, match="period of curve"):
        Curve(lambda s: (ca.cos(s), ca.sin(s), 0), period=period)


def test_a_formula_of_another_library_is_refused() -> None:
    """math.sin takes a symbol for NaN."""
    with pytest.raises(PathError):
        Curve(lambda s: (math.sin(s), s, 0))

"""Metres along a path and back: closed forms, whole rounds, and far beyond the domain."""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ellipe, ellipeinc

from gammastar.errors import PathError
from gammastar.path import Curve, Path
from gammastar.path import catalogue as paths
from gammastar.path.waypoints import waypoints
from strategies import PATHS, numbers

GATES = np.array([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1), (-2, 4, -2)], dtype=float)
ALL: dict[str, Path] = {**PATHS, "open waypoints": waypoints(GATES), "closed waypoints": waypoints(GATES, closed=True)}


@functools.cache
def reference(name: str, first: float, last: float) -> float:
    """Return the length by another rule: adaptive Gauss-Kronrod quadrature of the speed."""
    path = ALL[name]

    def speed(parameter: float) -> float:
        return float(np.linalg.norm(path.jets(np.array([parameter]))[0, 1]))

    inner = path.knots[(path.knots > first) & (path.knots < last)]
    return float(
        quad(speed, first, last, points=inner if inner.size else None, epsabs=1e-13, epsrel=1e-12, limit=400)[0]
    )


@pytest.mark.parametrize("name", ALL)
def test_the_length_is_the_integral_of_the_speed(name: str) -> None:
    low, high = ALL[name].domain
    middle = low + 0.37 * (high - low)
    assert ALL[name].length() == pytest.approx(reference(name, low, high), rel=1e-10)
    assert ALL[name].length(low, middle) == pytest.approx(reference(name, low, middle), rel=1e-10)


@pytest.mark.parametrize("name", ALL)
@settings(max_examples=15)
@given(st.data())
def test_at_length_inverts_the_arc_length(name: str, data: st.DataObject) -> None:
    """Inside, rounds later, and beyond the ends of an open path as far as the formula goes."""
    path = ALL[name]
    low, high = path.domain
    beyond = 3 * (high - low) if path.period is not None else 0.2 * (high - low)
    parameters = np.array([low, high, data.draw(numbers(low - beyond, high + beyond))])
    lengths = path.arc_length(parameters)
    assert path.at_length(lengths) == pytest.approx(parameters, abs=1e-10 * (high - low))
    assert path.arc_length(path.at_length(lengths)) == pytest.approx(lengths, abs=1e-10 * path.length())


@pytest.mark.parametrize(("a", "b"), [(2.0, 1.0), (5.0, 5.0), (1000.0, 1.0)])
def test_the_arc_length_of_an_ellipse_is_the_elliptic_integral(a: float, b: float) -> None:
    """From the end of the first axis by eccentric angle p: b E(p | 1 - a^2/b^2)."""
    angle = np.array([-1.0, 0.3, np.pi / 2, 3.0, 11.0])
    expected = b * ellipeinc(angle, 1 - (a / b) ** 2)
    path = paths.ellipse((a, b))
    assert path.arc_length(angle) == pytest.approx(expected, rel=1e-10)
    assert path.length() == pytest.approx(4 * a * ellipe(1 - (b / a) ** 2), rel=1e-11)


def test_a_closed_path_counts_every_round() -> None:
    circle = paths.circle(2.0)
    rounds = np.array([-3.0, -0.5, 0.0, 0.25, 1.0, 7.75])
    assert circle.arc_length(2 * np.pi * rounds) == pytest.approx(4 * np.pi * rounds, abs=1e-12)
    assert circle.at_length(4 * np.pi * rounds) == pytest.approx(2 * np.pi * rounds, abs=1e-12)


def test_an_open_path_is_measured_far_beyond_its_domain() -> None:
    """A line from -10; and the parabola (l, 0, l^2/2), of length (l sqrt(1 + l^2) + asinh l)/2 from 0."""
    line = paths.line()
    assert line.at_length([-5.0, 0.0, 1e6]) == pytest.approx([-15, -10, 1e6 - 10], rel=1e-13)
    parabola = Curve(lambda t: (t, 0, t**2 / 2), domain=(0, 1))
    where = np.array([-200.0, -3.0, 0.5, 300.0])
    assert parabola.arc_length(where) == pytest.approx(
        (where * np.sqrt(1 + where**2) + np.arcsinh(where)) / 2, rel=1e-11
    )


def test_a_trochoid_that_almost_stands_still() -> None:
    """One arch of (t - a sin t, 1 - a cos t) is 4 (1 + a) E(4 a / (1 + a)^2) long; |sigma'| has a sharp dip at each end."""
    a = 0.9999
    path = Curve(lambda t: (t - a * ca.sin(t), 1 - a * ca.cos(t), 0), domain=(-1, 4 * np.pi - 1))
    assert path.length() == pytest.approx(8 * (1 + a) * ellipe(4 * a / (1 + a) ** 2), rel=1e-11)


def test_what_a_path_does_not_have_is_refused() -> None:
    short = Curve(lambda t: (ca.tanh(t), 0, 0), domain=(-1, 1), name="short")
    with pytest.raises(PathError, match=r"short must be as long as is asked for \(got .* to 1.76159 m"):
        short.at_length([1.0, 2.0])
    root = Curve(lambda t: (ca.sqrt(t), 0, 0), domain=(1, 2), name="root")
    with pytest.raises(PathError, match="the length of root must be finite"):
        root.arc_length([-1.0])


def test_no_parameter_has_no_length() -> None:
    assert paths.circle().arc_length([]).shape == paths.line().at_length([]).shape == (0,)

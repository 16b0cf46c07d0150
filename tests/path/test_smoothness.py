"""Jumps of every derivative are found, named by order and place; what is smooth, however sharp, is not accused."""

from math import factorial
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from certificate.curves import QUAD, SATELLITE, Unchecked, Waypoints, closed, lissajous, opened, ring, trefoil
from gammastar.certificate import certify
from gammastar.path import Curve
from gammastar.path import catalogue as paths
from gammastar.path.sampling import sample
from gammastar.path.smoothness import jumps


@pytest.mark.parametrize("order", range(1, 6))
@pytest.mark.parametrize("place", [0.0, 0.3, -0.7123456, 0.99])
def test_the_derivative_that_jumps_is_named(order: int, place: float) -> None:
    """max(t - p, 0)^k is of class C^(k-1); its k-th derivative jumps by k! at p."""
    path = opened(lambda t: (t, ca.fmax(t - place, 0) ** order, 0.1 * ca.sin(5 * t)), -1, 1)
    (jump,) = jumps(sample(path))
    assert jump.order == order
    assert jump.parameter == pytest.approx(place, abs=1e-9)
    assert jump.size == pytest.approx(factorial(order), rel=1e-3)
    assert jump.knot is None


@pytest.mark.parametrize(
    ("formula", "order"),
    [
        (lambda t: (t, ca.fabs(t - 0.2), 0), 1),
        (lambda t: (t, t * ca.fabs(t), 0), 2),
        (lambda t: (t, ca.if_else(t > 0.123, 1, 0), 0), 0),
        (lambda t: (t, ca.fabs(t - 0.1) ** 2.5, 0), 3),  # the third derivative grows without bound
        (lambda t: (t, t * ca.fabs(t - 0.1) ** 1.5, 0), 2),
        (lambda t: (t, ca.fabs(t - 0.1) ** 1.25, 0), 2),  # the first derivative is continuous, barely
        (lambda t: (t, ca.fmin(ca.sin(t), 0.5), 0), 1),
    ],
)
def test_corners_of_formulas_are_found(formula, order: int) -> None:
    found = jumps(sample(opened(formula, -1, 1)))
    assert [jump.order for jump in found] == [order]


def test_a_derivative_without_a_value_is_named() -> None:
    """The Taylor series of |t|^2.5 divides by zero at t = 0, which is a sample; the law would have no value there either."""
    path = opened(lambda t: (t, ca.fabs(t) ** 2.5, 0), -1, 1)
    (jump,) = jumps(sample(path))
    assert (jump.parameter, jump.size) == (0, np.inf)
    found = certify(QUAD, path, 1.0)
    assert "no finite first derivative at parameter 0 " in found.reasons[0]
    assert found.check("smooth").place.arc_length == pytest.approx(found.length / 2, rel=1e-3)


def test_every_jump_is_found() -> None:
    """Twenty places where the fourth derivative jumps, some of them a thousand times less than others."""
    places = np.sort(np.random.default_rng(3).uniform(-1, 1, 20))
    path = opened(
        lambda t: (t, sum(10.0 ** -(k % 4) * ca.fmax(t - place, 0) ** 4 for k, place in enumerate(places)), 0), -1, 1
    )
    found = jumps(sample(path))
    assert [jump.parameter for jump in found] == pytest.approx(places.tolist(), abs=1e-6)
    assert {jump.order for jump in found} == {4}


@pytest.mark.parametrize(
    "path",
    [
        paths.circle(3.0),
        paths.circle(kind="implicit"),
        paths.line(),
        paths.nonplanar_circle(),
        paths.ellipse((1000, 1)),
        closed(trefoil),
        closed(lissajous),
        opened(lambda t: (t, 1e-4 * ca.atan(1e4 * (t - 0.3)), 0), -1, 1),  # a smooth corner of width 1e-4
        opened(lambda t: (t, ca.fmax(t - 0.3, 0) ** 6, 0), -1, 1),  # class C^5, no more
        opened(lambda t: (t + 1e6, 1e6 + ca.sin(t), 0), -1, 1),  # far from the origin
        ring(100),
    ],
    ids=lambda path: path.name,
)
def test_what_is_smooth_is_not_accused(path: Curve) -> None:
    assert jumps(sample(path)) == []


def test_the_seam_of_a_closed_path_counts() -> None:
    """A drop: the point closes, the tangent does not."""
    path = closed(lambda t: (ca.sin(np.pi * t), ca.sin(2 * np.pi * t) / 2, 0), period=1.0)
    (jump,) = jumps(sample(path))
    assert (jump.parameter, jump.order) == (0, 1)


class Pieces(Unchecked):
    """Two pieces that join at knot 1 with a jump of the third derivative."""

    knots: ClassVar = np.array([-1.0, 0.25, 1.0])


def test_a_declared_knot_is_named() -> None:
    path = Pieces(lambda t: (t, ca.fmax(t - 0.25, 0) ** 3, 0), domain=(-1, 1), name="pieces")
    (jump,) = jumps(sample(path))
    assert (jump.parameter, jump.order, jump.knot) == (0.25, 3, 1)
    (reason,) = certify(SATELLITE, path, 1.0).reasons[:1]
    assert "a jump of the third derivative at knot 1, parameter 0.25" in reason


def test_every_knot_of_a_spline_of_too_low_a_degree_is_found() -> None:
    """Degree 5 is of class C^4: the fifth derivative jumps at each knot, more often than intervals are suspected."""
    path = Waypoints(np.random.default_rng(2).normal(size=(120, 3)).cumsum(axis=0), degree=5)
    found = jumps(sample(path))
    assert {jump.order for jump in found} == {5}
    assert [jump.knot for jump in found] == list(range(1, 121))  # the last is the first

"""Samples: arc length against closed forms, places anywhere, and features that ask for more samples."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe

from certificate.curves import TURN, closed, opened, trefoil
from gammastar.path import catalogue as paths
from gammastar.path.sampling import INTERVALS, LONGEST, sample, taylor_residuals


@pytest.mark.parametrize(("a", "b"), [(2.0, 1.0), (5.0, 5.0), (1000.0, 1.0)])
def test_the_length_of_an_ellipse_is_the_complete_elliptic_integral(a: float, b: float) -> None:
    """L = 4 a E(1 - b^2/a^2); the stated error bounds the actual one."""
    samples = sample(paths.ellipse((a, b)))
    exact = 4 * a * ellipe(1 - (b / a) ** 2)
    assert abs(samples.length - exact) <= samples.length_error + 1e-13 * exact
    assert samples.length == pytest.approx(exact, rel=1e-8)


def test_the_length_of_a_trochoid_that_almost_stands_still() -> None:
    """One arch of (t - a sin t, 1 - a cos t) is 4 (1 + a) E(4 a / (1 + a)^2) long; |sigma'| has a sharp dip at each end."""
    a = 0.9999
    samples = sample(opened(lambda t: (t - a * ca.sin(t), 1 - a * ca.cos(t), 0), -1, 2 * TURN - 1))
    assert samples.length == pytest.approx(8 * (1 + a) * ellipe(4 * a / (1 + a) ** 2), rel=1e-9)


def test_arc_length_between_samples_is_exact() -> None:
    """On (l, 0, l^2/2) the length from 0 is (l sqrt(1 + l^2) + asinh l)/2; places lie anywhere, ends included."""
    samples = sample(opened(lambda t: (t, 0, t**2 / 2), -2, 3))
    where = np.array([-2.0, -1.23456789, 0.0, 1e-7, 0.777, 3.0])

    def exact(t: np.ndarray) -> np.ndarray:
        return (t * np.sqrt(1 + t**2) + np.arcsinh(t)) / 2

    places = samples.places(where)
    assert [place.arc_length for place in places] == pytest.approx(exact(where) - exact(np.array(-2.0)), abs=1e-12)
    assert [place.parameter for place in places] == pytest.approx(where)
    assert places[4].point == pytest.approx((0.777, 0, 0.777**2 / 2))


def test_places_of_a_closed_path_wrap() -> None:
    samples = sample(closed(trefoil))
    before, after = samples.places(np.array([1.0, 1.0 - TURN]))
    assert before.parameter == pytest.approx(after.parameter, abs=1e-14)
    assert before.arc_length == pytest.approx(after.arc_length, abs=1e-12)


def test_a_narrow_feature_is_resolved() -> None:
    """A step of width 1e-3 of the domain: samples gather there, and the length agrees with adaptive quadrature."""
    width = 2e-3
    path = opened(lambda t: (t, width * ca.atan((t - 0.3) / width), 0), -1, 1)
    samples = sample(path)
    assert len(samples.parameters) > INTERVALS + 1
    added = np.setdiff1d(samples.parameters, np.linspace(-1, 1, INTERVALS + 1))
    assert np.all(np.abs(added - 0.3) < 10 * width)
    exact, _ = quad(lambda t: np.hypot(1, 1 / (1 + ((t - 0.3) / width) ** 2)), -1, 1, points=[0.3], epsabs=1e-13)
    assert samples.length == pytest.approx(exact, rel=1e-9)


def test_an_uneven_parameterisation_is_sampled_evenly() -> None:
    """On (e^(6 t), 0, 0) nearly all of the length lies in the last part of the domain."""
    samples = sample(opened(lambda t: (ca.exp(6 * t), 0, 0), -1, 1))
    assert np.diff(samples.arc_lengths).max() <= LONGEST / INTERVALS * samples.length


def test_a_polynomial_of_degree_five_is_predicted_exactly() -> None:
    path = opened(lambda t: (t, t**5 - t**3, 2 * t**4), -1, 1)
    parameters = np.array([-0.9, -0.2, 0.5, 0.95])
    residuals = taylor_residuals(parameters, path.jets(parameters))
    assert np.abs(residuals).max() < 1e-12


@pytest.mark.parametrize("order", range(6))
def test_the_residual_of_a_smooth_curve_shrinks_at_its_order(order: int) -> None:
    """Residual of derivative k ~ h^(6 - k): halving the step divides it by 2^(6 - k)."""
    path = closed(trefoil)
    sizes = []
    for step in (0.02, 0.01):
        parameters = 0.4 + np.array([0.0, step])
        sizes.append(np.linalg.norm(taylor_residuals(parameters, path.jets(parameters))[0, order]))
    assert np.log2(sizes[0] / sizes[1]) == pytest.approx(6 - order, abs=0.15)

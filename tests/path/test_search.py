"""The nearest point of all: against dense sampling, however far along the curve it lies."""

import casadi as ca
import numpy as np
import pytest

from gammastar.errors import PathError
from gammastar.path import Curve
from gammastar.path import catalogue as paths

HELIX = paths.helix(1.0, 0.3)
WAVE = Curve(lambda a: (a, ca.sin(a), 0), name="wave")
FINE = Curve(lambda a: (a, ca.sin(50 * a), 0), domain=(-1, 1), name="fine wave")


def least_sampled(path: Curve, position: np.ndarray, low: float, high: float) -> float:
    """Return the least distance [m] of 200,001 points; it is above the true one by less than 1e-4 in the cases here."""
    return float(np.linalg.norm(path.points(np.linspace(low, high, 200_001)) - position, axis=1).min())


@pytest.mark.parametrize("depth", [-1000.0, -3.0, 5.0, 100.0, 1000.0])
@pytest.mark.parametrize("radius", [0.3, 2.0])
def test_the_start_is_found_among_thousands_of_turns_of_a_helix(depth: float, radius: float) -> None:
    position = np.array([0.8 * radius, 0.6 * radius, depth])
    found = HELIX.start_parameter(position)
    turn = 2 * np.pi * depth / 0.3
    least = least_sampled(HELIX, position, turn - 40, turn + 40)
    assert least - 1e-4 <= np.linalg.norm(HELIX.points(np.array([found]))[0] - position) <= least


@pytest.mark.parametrize("path", [WAVE, FINE], ids=lambda path: path.name)
@pytest.mark.parametrize("far", [0.0, -100.0, 1e4, 1e5, 1e6])
@pytest.mark.parametrize("beside", [0.5, 3.0])
def test_the_start_is_found_far_along_a_wave(path: Curve, far: float, beside: float) -> None:
    position = np.array([far, beside, 0.1])
    found = path.start_parameter(position)
    least = least_sampled(path, position, far - 4, far + 4)
    assert least - 1e-4 <= np.linalg.norm(path.points(np.array([found]))[0] - position) <= least


def test_the_nearest_of_two_parts_almost_equally_near_is_found() -> None:
    """Between the ends of a long thin ellipse, a micrometre off its middle; and by the crossing of a lemniscate."""
    ellipse = paths.ellipse((1000.0, 1.0))
    for side in (1.0, -1.0):
        point = ellipse.points(np.array([ellipse.start_parameter(np.array([3.0, side * 1e-6, 0]))]))[0]
        assert np.sign(point[1]) == side
    eight = paths.lemniscate(separation=1e-4)
    for side in (1.0, -1.0):
        point = eight.points(np.array([eight.start_parameter(np.array([0, 0, side * 1e-8]))]))[0]
        assert np.sign(point[2]) == side


def test_any_point_will_do_at_the_centre_of_a_ball_of_yarn() -> None:
    """A hundred turns on a unit sphere are all equally near to its centre."""
    yarn = Curve(
        lambda s: (ca.sin(s) * ca.cos(100 * s), ca.sin(s) * ca.sin(100 * s), ca.cos(s)), domain=(0.1, 3.0), name="yarn"
    )
    assert np.linalg.norm(yarn.points(np.array([yarn.start_parameter(np.zeros(3))]))) == pytest.approx(1, abs=1e-15)


def test_too_many_equally_near_places_are_refused() -> None:
    yarn = Curve(
        lambda s: (ca.sin(s) * ca.cos(3e4 * s), ca.sin(s) * ca.sin(3e4 * s), ca.cos(s)), domain=(0.1, 3.0), name="yarn"
    )
    with pytest.raises(PathError, match=r"the nearest point of yarn to .* must be searched among fewer than 200000"):
        yarn.start_parameter(np.zeros(3))


def test_a_curve_without_points_beyond_its_domain_is_searched_inside() -> None:
    """The root has no value below zero, and the exponential none beyond 709."""
    path = Curve(lambda s: (ca.sqrt(s), ca.exp(s), 0), domain=(0.1, 2.0))
    position = path.points(np.array([0.4]))[0] + [0, 0, 1]
    assert path.start_parameter(position) == pytest.approx(0.4, abs=1e-7)

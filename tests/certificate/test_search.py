"""Extremes and stretches along a path: on a line the first coordinate is the parameter, so quantities have closed forms."""

import numpy as np
import pytest

from certificate.curves import TURN, opened
from gammastar.certificate.search import Search, brackets, extremes, narrowed, negative_stretches
from gammastar.path import catalogue as paths
from gammastar.path.sampling import Samples, sample


@pytest.fixture(scope="module")
def line() -> Samples:
    return sample(opened(lambda t: (t, 0, 0), -10, 10))


@pytest.fixture(scope="module")
def circle() -> Samples:
    return sample(paths.circle())


def x(jets: np.ndarray) -> np.ndarray:
    return jets[:, 0, 0]


def test_extremes_are_narrowed_to_rounding(line: Samples) -> None:
    """The maximum of x exp(-x) is 1/e at 1; |x - sqrt 2| has its minimum, a corner, at sqrt 2."""
    found = extremes(
        line,
        {
            "smooth": (lambda jets: x(jets) * np.exp(-x(jets)), 1),
            "corner": (lambda jets: np.abs(x(jets) - np.sqrt(2)), -1),
            "end": (lambda jets: x(jets) ** 3, -1),
        },
    )
    assert found["smooth"].value == pytest.approx(np.exp(-1), rel=1e-14)
    assert found["smooth"].parameter == pytest.approx(
        1, abs=1e-6
    )  # an error of 1e-7 in the place is 1e-14 in the value
    assert found["corner"].value == pytest.approx(0, abs=1e-10)
    assert found["end"] == (-10, -1000)


def test_the_best_of_many_near_equal_peaks_is_found(line: Samples) -> None:
    """cos(7 x) - 1e-6 (x - 4)^2: 22 peaks, whose heights differ by less than the samples are off; the one next to 4 wins."""
    found = extremes(line, {"peaks": (lambda jets: np.cos(7 * x(jets)) - 1e-6 * (x(jets) - 4) ** 2, 1)})["peaks"]
    best = TURN / 7 * np.rint(4 * 7 / TURN)
    assert found.parameter == pytest.approx(best, abs=1e-5)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_constant_has_its_extreme_at_the_start(sign: int) -> None:
    """On a circle |sigma'| is constant but for rounding, which must not choose the place."""
    tilted = sample(paths.circle(2.0, (1, 2, 3), (1, 1, 1)))
    found = extremes(tilted, {"speed": (lambda jets: np.linalg.norm(jets[:, 1], axis=1), sign)})["speed"]
    assert found.parameter == 0


def test_a_constant_is_narrowed_at_one_place(circle: Samples) -> None:
    """Equal neighbours are one candidate, which keeps the certificate of a circle cheap."""
    assert len(brackets(circle, lambda jets: np.linalg.norm(jets[:, 1], axis=1), 1)) == 1


def test_a_peak_at_the_seam_of_a_closed_path_is_one(circle: Samples) -> None:
    quantity = lambda jets: np.cos(np.arctan2(jets[:, 0, 1], x(jets)) + 1e-4)  # noqa: E731, its maximum is just before 2 pi
    found = extremes(circle, {"before": (quantity, 1)})["before"]
    assert circle.inside(np.array([found.parameter]))[0] == pytest.approx(TURN - 1e-4, abs=1e-7)


def test_values_that_do_not_exist_lose(line: Samples) -> None:
    with np.errstate(invalid="ignore"):
        found = extremes(line, {"root": (lambda jets: np.sqrt(x(jets) - 2), -1)})["root"]
    assert found.parameter == pytest.approx(2, abs=1e-8)
    assert found.value == pytest.approx(0, abs=1e-4)


def test_each_search_stays_in_its_bracket(line: Samples) -> None:
    (found,) = narrowed(line, [Search(lambda jets: np.sin(x(jets)), 1, np.array([[0.5, 1, 2], [-5, -4.5, -4]]))])
    assert [each.parameter for each in found] == pytest.approx([np.pi / 2, -3 * np.pi / 2], abs=1e-6)


def test_stretches_end_at_the_roots(line: Samples) -> None:
    """Where cos x < 0, x is within pi/2 of an odd multiple of pi: four stretches between -10 and 10, the outer two cut off."""
    stretches = negative_stretches(line, lambda jets: np.cos(x(jets)))
    expected = [
        (max(-10, middle - np.pi / 2), min(10, middle + np.pi / 2)) for middle in np.pi * np.array([-3, -1, 1, 3])
    ]
    assert np.array(stretches) == pytest.approx(np.array(expected), abs=1e-11)


def test_a_stretch_over_the_seam_is_one(circle: Samples) -> None:
    ((start, end),) = negative_stretches(circle, lambda jets: 0.5 - x(jets))
    assert (start, end) == pytest.approx((TURN - np.pi / 3, TURN + np.pi / 3), abs=1e-10)


def test_a_quantity_below_zero_everywhere_is_the_whole_path(circle: Samples) -> None:
    assert negative_stretches(circle, lambda jets: x(jets) - 2) == [(0, TURN)]
    assert negative_stretches(circle, lambda jets: x(jets) + 2) == []

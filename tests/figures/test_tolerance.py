"""Curves over a quantity: their bands are the intervals, and every case can be drawn."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from gammastar.figures import style
from gammastar.figures.save import picture
from gammastar.figures.tolerance import Tolerance, draw_tolerance

NOTHING = np.full((2, 2), np.nan)
CURVES = {
    "bins": Tolerance(
        "mass",
        np.array([0.9, 1.0, 1.1]),
        (),
        np.array([9, 8]),
        np.array([1.0, 0.5]),
        np.array([[0.7, 1], [0.2, 0.8]]),
        NOTHING + 1,
    ),
    "an empty bin": Tolerance(
        "mass",
        np.array([0.9, 1.0, 1.1]),
        (),
        np.array([9, 0]),
        np.array([1.0, np.nan]),
        np.array([[0.7, 1], [0, 1]]),
        np.array([[1, 2], [np.nan, np.nan]]),
    ),
    "one number that never succeeds": Tolerance(
        "radius", None, [2.0], np.array([9]), np.array([0.0]), np.array([[0, 0.3]]), NOTHING[:1]
    ),
    "texts": Tolerance(
        "vehicle",
        None,
        ["hummingbird with a long name", r"$\frac$"],
        np.array([9, 8]),
        np.array([1.0, 0.5]),
        np.array([[0.7, 1], [0.2, 0.8]]),
        np.array([[1, 2], [1, 3]]),
    ),
    "no flight": Tolerance("mass", None, [], *(np.empty(shape) for shape in (0, 0, (0, 2), (0, 2)))),
}


@pytest.mark.parametrize("kind", CURVES)
def test_every_kind_of_curve_can_be_drawn(kind: str) -> None:
    figure = draw_tolerance(CURVES[kind], kind)
    assert picture(figure, "png", resolution=40).startswith(b"\x89PNG")


def test_bars_are_the_interval() -> None:
    axis = draw_tolerance(CURVES["texts"]).axes[0]
    (bars,) = axis.collections
    ends = np.array([segment[:, 1] for segment in bars.get_segments()])
    np.testing.assert_allclose(ends, 100 * CURVES["texts"].interval)
    low, high = axis.get_ylim()
    assert low < 20
    assert high >= 100
    assert [text.get_text() for text in axis.get_xticklabels()] == ["hummingbird wit…", r"$\frac$"]


def test_a_band_is_the_interval_and_ends_where_there_is_no_flight() -> None:
    axis = draw_tolerance(CURVES["an empty bin"]).axes[0]
    line, band = axis.patches
    points = band.get_path().vertices
    assert (points.min(axis=0), points.max(axis=0)) == (pytest.approx([0.9, 70]), pytest.approx([1.0, 100]))
    assert line.get_edgecolor() == pytest.approx(to_rgba(style.BLUE))


def test_names_that_do_not_fit_beside_each_other_lean() -> None:
    few = CURVES["texts"]
    many = Tolerance(
        "vehicle", None, [f"hummingbird-{k}" for k in range(6)], *(np.repeat(each, 3, 0) for each in few[3:])
    )
    angles = [{text.get_rotation() for text in draw_tolerance(each).axes[0].get_xticklabels()} for each in (few, many)]
    assert angles == [{0.0}, {45.0}]

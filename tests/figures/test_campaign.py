"""Figures of campaigns: colours part none, some and all from cells without a flight, and every case can be drawn."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from gammastar.figures import style
from gammastar.figures.campaign import COLORS, FEW, PALE, Basin, Tolerance, classes, draw_basin, draw_tolerance
from gammastar.figures.save import picture

FLIGHTS = np.array([[0, 4, 10, 10], [100, 1000, 10_000, 10]])
SUCCESSES = np.array([[0, 0, 1, 5], [90, 989, 9_999, 10]])
BASIN = Basin("x [m]", "tilt [°]", np.array([0.0, 1.0, 3.0]), np.array([0.0, 45, 90, 135, 180]), FLIGHTS, SUCCESSES)
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
        ["hummingbird with a long name", "$x$"],
        np.array([9, 8]),
        np.array([1.0, 0.5]),
        np.array([[0.7, 1], [0.2, 0.8]]),
        np.array([[1, 2], [1, 3]]),
    ),
    "no flight": Tolerance("mass", None, [], *(np.empty(shape) for shape in (0, 0, (0, 2), (0, 2)))),
}


def test_none_some_and_all_have_colours_of_their_own_and_no_flight_has_none() -> None:
    found = classes(FLIGHTS, SUCCESSES)
    assert found.mask.tolist() == (FLIGHTS == 0).tolist()
    assert found.compressed().tolist() == [0, 1, 1, 2, 3, 4, 5]


def test_cells_are_painted_where_they_are() -> None:
    figure = draw_basin([BASIN])
    axis = figure.axes[0]
    (cells,) = axis.collections
    cells.update_scalarmappable()
    colors = cells.get_facecolor().reshape(4, 2, 4)  # rows go up, columns across
    for across, up in np.argwhere(FLIGHTS > 0):
        expected = to_rgba(COLORS[classes(FLIGHTS, SUCCESSES)[across, up]], 1.0 if FLIGHTS[across, up] >= FEW else PALE)
        assert tuple(colors[up, across]) == pytest.approx(expected)
    assert colors[0, 0, 3] == 0  # what lies behind is seen
    assert axis.patch.get_hatch()
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["none", "≤ 50 %", "≤ 90 %", "≤ 99 %", "< 100 %", "all", "no flight"]
    assert axis.get_title(loc="left") == "cells of 4 to 10,000 flights, pale below 5"


def test_a_full_map_names_no_empty_cells() -> None:
    full = BASIN._replace(flights=np.full((2, 4), 7), successes=np.full((2, 4), 7), equal=True, downward=True)
    figure = draw_basin([full, full], "what costs $5 and is a long title that has to be folded into its figure")
    assert len(figure.legends[0].get_texts()) == len(COLORS)
    assert figure.axes[0].yaxis_inverted()
    assert picture(figure, "png", resolution=40).startswith(b"\x89PNG")


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
    assert [text.get_text() for text in axis.get_xticklabels()] == ["hummingbird…", "$x$"]


def test_a_band_is_the_interval_and_ends_where_there_is_no_flight() -> None:
    axis = draw_tolerance(CURVES["an empty bin"]).axes[0]
    line, band = axis.patches
    points = band.get_path().vertices
    assert (points.min(axis=0), points.max(axis=0)) == (pytest.approx([0.9, 70]), pytest.approx([1.0, 100]))
    assert line.get_edgecolor() == pytest.approx(to_rgba(style.BLUE))

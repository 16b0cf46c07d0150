"""Maps of a basin: colours part none, some and all from cells without a flight, and tell how long the others take."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from gammastar.figures.basin import COLORS, FEW, NAMES, NEVER, PALE, Basin, classes, draw_basin
from gammastar.figures.save import picture

FLIGHTS = np.array([[0, 4, 10, 10], [100, 1000, 10_000, 10]])
SUCCESSES = np.array([[0, 0, 1, 5], [80, 989, 9_999, 10]])
TIMES = np.array([[np.nan, np.nan, 9.0, 2.0], [3.0, 4.0, 5.0, 6.0]])
BASIN = Basin(
    "x [m]", "tilt [°]", np.array([0.0, 1.0, 3.0]), np.array([0.0, 45, 90, 135, 180]), FLIGHTS, SUCCESSES, TIMES
)


def painted(cells: object) -> np.ndarray:
    """Return the colours (across, up, 4) of a map."""
    cells.update_scalarmappable()  # type: ignore[attr-defined]
    return np.swapaxes(cells.get_facecolor().reshape(4, 2, 4), 0, 1)  # type: ignore[attr-defined]


def test_none_some_and_all_have_colours_of_their_own_and_no_flight_has_none() -> None:
    found = classes(FLIGHTS, SUCCESSES)
    assert found.mask.tolist() == (FLIGHTS == 0).tolist()
    assert found.compressed().tolist() == [0, 1, 2, 4, 5, 6, 7]
    assert len(COLORS) == len(set(COLORS)) == len(NAMES) == 8


def test_cells_are_painted_where_they_are() -> None:
    axis, _, bar, _ = draw_basin([BASIN]).axes
    paper, cells = axis.collections
    for across, up in np.argwhere(FLIGHTS > 0):
        opacity = 1.0 if FLIGHTS[across, up] >= FEW else PALE
        expected = to_rgba(COLORS[classes(FLIGHTS, SUCCESSES)[across, up]], opacity)
        assert tuple(painted(cells)[across, up]) == pytest.approx(expected)
        assert tuple(painted(paper)[across, up]) == pytest.approx((1, 1, 1, 1))
    assert painted(cells)[0, 0, 3] == painted(paper)[0, 0, 3] == 0  # what lies behind is seen
    assert axis.patch.get_hatch()
    assert axis.get_title(loc="left") == "cells of 4 to 10,000 flights, pale below 5, hatched without"
    assert tuple(text.get_text() for text in bar.get_xticklabels()) == NAMES
    assert bar.get_xlabel() == "share of flights that settle [%]"


def test_times_are_those_of_enough_flights_and_others_pale() -> None:
    """Nine seconds are those of one flight, which has no say in the colours; where none settles it is grey."""
    figure = draw_basin([BASIN])
    _, axis, _, bar = figure.axes
    _, never, cells = axis.collections
    assert cells.get_clim() == (2.0, 6.0)
    assert painted(never)[0, 1] == pytest.approx(to_rgba(NEVER))
    assert painted(never)[..., 3].sum() == 1
    found = painted(cells)
    expected = cells.cmap(cells.norm(TIMES))
    for across, up in np.argwhere(np.isfinite(TIMES)):
        opacity = 1.0 if SUCCESSES[across, up] >= FEW else PALE
        assert tuple(found[across, up]) == pytest.approx((*expected[across, up][:3], opacity))
    assert found[0, 0, 3] == found[0, 1, 3] == 0
    assert axis.get_title(loc="left") == "pale below 5 that settle, grey where none does"
    assert bar.get_xlabel() == "median settling time of those that settle [s]"
    assert picture(figure, "png", resolution=40).startswith(b"\x89PNG")


def test_where_nothing_settles_there_are_no_times() -> None:
    none = BASIN._replace(successes=np.zeros_like(FLIGHTS), settling=np.full(TIMES.shape, np.nan))
    axis, bar = draw_basin([none]).axes
    assert bar.get_xlabel().startswith("share")
    assert {tuple(color) for color in painted(axis.collections[1]).reshape(-1, 4) if color[3] == 1} == {
        to_rgba(COLORS[0])
    }


def test_full_maps_stand_below_each_other() -> None:
    full = np.full((2, 4), 7)
    basin = BASIN._replace(flights=full, successes=full, settling=np.full((2, 4), 2.5), equal=True, downward=True)
    figure = draw_basin([basin, basin], "what costs $5 and is a long title that has to be folded into its figure")
    assert len(figure.axes) == 6
    assert all(axis.yaxis_inverted() for axis in figure.axes[:4])
    assert figure.axes[0].get_title(loc="left") == "cells of 7 flights"
    assert figure.axes[1].get_title(loc="left") == ""
    assert picture(figure, "png", resolution=40).startswith(b"\x89PNG")


def test_few_flights_alone_have_their_own_colours() -> None:
    few = BASIN._replace(successes=np.minimum(SUCCESSES, FEW - 1))
    assert draw_basin([few]).axes[1].collections[-1].get_clim() == (2.0, 9.0)

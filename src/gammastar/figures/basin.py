"""Maps of a basin: from where flights succeed, and how long it takes from there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gammastar.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BOUNDS = (0.25, 0.5, 0.75, 0.9, 0.99)  # shares of success between which a colour stays; none and all have their own
NAMES = ("none", "≤25", "≤50", "≤75", "≤90", "≤99", "<100", "all")  # [%]
COLORS = (style.VERMILION, style.ORANGE, "#F2C25C", "#F8E7B9", "#D5E8F2", "#9CCDEB", "#56B4E9", style.BLUE)
TIMES = "viridis"  # colours of settling times, equally far apart to the eye; the slowest are the brightest
NEVER = "#BBBBBB"  # where flights start and none settles
FEW = 5  # flights in a cell, below which its colour says little
PALE = 0.35  # opacity of such a cell
HATCH = "////"  # where no flight starts
PANEL, BAR_HEIGHT = 3.1, 0.85  # [in] side of a map, and of the colours below
BAR: dict[str, Any] = {"location": "bottom", "aspect": 24, "fraction": 0.06, "pad": 0.03}


class Basin(NamedTuple):
    """How many flights start in each cell of two quantities, how many of them succeed, and how fast."""

    across: str  # label of the horizontal axis
    up: str  # label of the vertical axis
    across_edges: np.ndarray  # (m + 1,)
    up_edges: np.ndarray  # (n + 1,)
    flights: np.ndarray  # (m, n)
    successes: np.ndarray  # (m, n)
    settling: np.ndarray  # (m, n) [s] median settling time of those that succeed, NaN where none does
    equal: bool = False  # whether both axes have one scale
    downward: bool = False  # whether the vertical axis points down


def classes(flights: np.ndarray, successes: np.ndarray) -> np.ndarray:
    """Return the place in `COLORS` of every cell, masked where no flight started."""
    share = successes / np.maximum(flights, 1)
    place = 1 + np.searchsorted(BOUNDS, share)
    place = np.where(successes == 0, 0, np.where(successes == flights, len(COLORS) - 1, place))
    return np.ma.masked_array(place, mask=flights == 0)


@style.drawing()
def draw_basin(basins: Sequence[Basin], title: str = "") -> Figure:
    """Draw a row of two maps for each basin: the share of flights that succeed, and the median time that they take to settle.

    Cells of few flights are pale, those of none hatched.  Where no flight of any map settles there is nothing beside the shares.
    """
    settles = any(np.isfinite(basin.settling).any() for basin in basins)
    columns = 2 if settles else 1
    width = max(style.WIDTH, PANEL * columns)
    figure = style.new_figure(width, PANEL * len(basins) + BAR_HEIGHT + style.title_height(title, width), title)
    axes = figure.subplots(len(basins), columns, squeeze=False)
    for axis, basin in zip(axes[:, 0], basins, strict=True):
        shares = _shares(axis, basin)
    bar = _bar(figure, shares, axes[:, 0], "share of flights that settle [%]", ticks=range(len(NAMES)))
    bar.set_ticklabels(NAMES)
    bar.minorticks_off()
    if settles:
        limits, beyond = _times(basins)
        for axis, basin in zip(axes[:, 1], basins, strict=True):
            times = _settling(axis, basin, limits)
        bar = _bar(figure, times, axes[:, 1], "median settling time of those that settle [s]", extend=beyond)
        bar.ax.xaxis.set_major_formatter(style.plain)
    return figure


def _shares(axis: Axes, basin: Basin) -> Any:
    """Draw the share of flights that succeed and return what has the colours."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    _dress(axis, basin)
    colors: dict[str, Any] = {
        "cmap": ListedColormap(COLORS),
        "norm": BoundaryNorm(np.arange(len(COLORS) + 1) - 0.5, len(COLORS)),
    }
    counts = basin.flights[basin.flights > 0]
    words = [f"cells of {style.counted(counts)} flights"]
    words += [f"pale below {FEW}"] if (counts < FEW).any() else []
    words += ["hatched without"] if (basin.flights == 0).any() else []
    style.heading(axis, ", ".join(words))
    return _cells(axis, basin, classes(basin.flights, basin.successes), _opacity(basin.flights), **colors)


def _settling(axis: Axes, basin: Basin, limits: tuple[float, float]) -> Any:
    """Draw the settling time and return what has the colours."""
    _dress(axis, basin)
    never = (basin.flights > 0) & ~np.isfinite(basin.settling)
    if never.any():
        _cells(axis, basin, np.ma.masked_array(never, ~never), color=NEVER)
    few = (basin.successes > 0) & (basin.successes < FEW)
    words = [f"pale below {FEW} that settle"] if few.any() else []
    words += ["grey where none does"] if never.any() else []
    style.heading(axis, ", ".join(words))
    times, opacity = np.ma.masked_invalid(basin.settling), _opacity(basin.successes)
    return _cells(axis, basin, times, opacity, cmap=TIMES, vmin=limits[0], vmax=limits[1])


def _opacity(counts: np.ndarray) -> np.ndarray:
    return np.where(counts < FEW, PALE, 1.0)


def _dress(axis: Axes, basin: Basin) -> None:
    """Name what a map is over, and hatch it where no flight starts."""
    style.dress(axis)
    axis.grid(False)
    axis.patch.set(facecolor="white", hatch=HATCH, edgecolor=style.GRID)
    _cells(axis, basin, np.ma.masked_equal(basin.flights, 0), color="white")
    axis.set_xlabel(basin.across, fontsize=style.LABEL, color=style.INK)
    style.label(axis, basin.up)
    if basin.equal:
        axis.set_aspect("equal", adjustable="box")
    for along, scale, edges in ((basin.across, axis.xaxis, basin.across_edges), (basin.up, axis.yaxis, basin.up_edges)):
        if "°" in along:
            style.angles(scale, edges)
    if basin.downward:
        axis.invert_yaxis()


def _cells(
    axis: Axes, basin: Basin, values: Any, opacity: np.ndarray | None = None, color: str = "", **colors: Any
) -> Any:
    """Draw the cells that are not masked, in one colour or by their values, and return what has the colours."""
    from matplotlib.colors import ListedColormap

    colors = {"cmap": ListedColormap([color])} if color else colors
    shown: Any = None if opacity is None else opacity.T
    return axis.pcolormesh(basin.across_edges, basin.up_edges, values.T, alpha=shown, **colors)


def _times(basins: Sequence[Basin]) -> tuple[tuple[float, float], str]:
    """Return the settling times [s] between which colours differ, those of cells with enough flights if any has, and what lies beyond."""
    times = np.concatenate([basin.settling.ravel() for basin in basins])
    enough = np.concatenate([basin.successes.ravel() for basin in basins]) >= FEW
    told = times[np.isfinite(times)]
    chosen = times[np.isfinite(times) & enough] if (np.isfinite(times) & enough).any() else told
    low, high = float(chosen.min()), float(chosen.max())
    beyond = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    return (low, high), beyond[bool(told.min() < low), bool(told.max() > high)]


def _bar(figure: Figure, drawn: Any, axes: Any, words: str, **given: Any) -> Any:
    """Explain the colours of some panels below them."""
    from matplotlib.cm import ScalarMappable

    bar = figure.colorbar(ScalarMappable(drawn.norm, drawn.cmap), ax=axes, **BAR, **given)  # without the pale ones
    bar.set_label(words, fontsize=style.SMALL, color=style.INK)
    bar.ax.tick_params(labelsize=style.SMALL, colors=style.INK, width=style.THIN, length=2)
    bar.outline.set_visible(False)
    return bar

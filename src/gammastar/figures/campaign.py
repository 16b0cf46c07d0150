"""Figures of a campaign: from where flights succeed, and how far tolerances reach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gammastar.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BOUNDS = (0.5, 0.9, 0.99)  # shares of success between which a colour stays; none and all have their own
COLORS = (style.VERMILION, style.ORANGE, "#F6DFA4", "#C6DFEE", "#56B4E9", style.BLUE)  # from none to all
NAMES = ("none", "≤ 50 %", "≤ 90 %", "≤ 99 %", "< 100 %", "all")
EMPTY, FEW = "no flight", 5  # flights in a cell, below which its colour says little
PALE = 0.35  # opacity of such a cell
HATCH = "////"
PANEL, PAIR_HEIGHT, LEGEND_HEIGHT = (
    3.1,
    2.5,
    0.75,
)  # [in] side of a map, height of curves, and of the legend below a map
CURVE_WIDTH = 3.3  # [in] of the panel of a curve that stands alone
BAND = 0.25  # opacity of an interval
ROOM = 1.1  # of the largest value, which an axis from zero spans
LETTERS = 12  # of the name of a value below an axis


class Basin(NamedTuple):
    """How many flights start in each cell of two quantities, and how many of them succeed."""

    across: str  # label of the horizontal axis
    up: str  # label of the vertical axis
    across_edges: np.ndarray  # (m + 1,)
    up_edges: np.ndarray  # (n + 1,)
    flights: np.ndarray  # (m, n)
    successes: np.ndarray  # (m, n)
    equal: bool = False  # whether both axes have one scale
    downward: bool = False  # whether the vertical axis points down


class Tolerance(NamedTuple):
    """Success and settling time over one quantity, in n bins or at n values of it."""

    label: str
    edges: np.ndarray | None  # (n + 1,); None where these are values
    values: Sequence[Any]  # n of them, numbers or texts; none where these are bins
    flights: np.ndarray  # (n,)
    share: np.ndarray  # (n,) of successes, NaN where there is no flight
    interval: np.ndarray  # (n, 2) that holds the true share
    settling: np.ndarray  # (n, 2) [s] median and 95 % quantile, NaN where none settles


def classes(flights: np.ndarray, successes: np.ndarray) -> np.ndarray:
    """Return the place in `COLORS` of every cell, masked where no flight started."""
    share = successes / np.maximum(flights, 1)
    place = 1 + np.searchsorted(BOUNDS, share)
    place = np.where(successes == 0, 0, np.where(successes == flights, len(COLORS) - 1, place))
    return np.ma.masked_array(place, mask=flights == 0)


@style.drawing()
def draw_basin(basins: Sequence[Basin], title: str = "") -> Figure:
    """Draw maps beside each other, coloured by the share of flights that succeed; cells of few flights are pale, of none hatched."""
    width = max(style.WIDTH, PANEL * len(basins)) if len(basins) > 1 else style.WIDTH
    height = PANEL + LEGEND_HEIGHT + (0.9 if len(basins) == 1 else 0.0) + style.title_height(title, width)
    figure = style.new_figure(width, height, title)
    axes = figure.subplots(1, len(basins), squeeze=False)[0]
    for axis, basin in zip(axes, basins, strict=True):
        _map(axis, basin)
    figure.legend(
        handles=_handles(any((basin.flights == 0).any() for basin in basins)),
        title="share of flights that settle",
        loc="outside lower center",
        ncols=len(COLORS) + 1,
        fontsize=style.SMALL,
        title_fontsize=style.SMALL,
        frameon=False,
        labelcolor=style.INK,
        handlelength=1.2,
        handletextpad=0.4,
        columnspacing=1.0,
    )
    return figure


def _map(axis: Axes, basin: Basin) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    style.dress(axis)
    axis.grid(False)
    axis.patch.set(facecolor="white", hatch=HATCH, edgecolor=style.GRID)
    norm = BoundaryNorm(np.arange(len(COLORS) + 1) - 0.5, len(COLORS))
    cells = classes(basin.flights, basin.successes).T
    opacity: Any = np.where(basin.flights.T < FEW, PALE, 1.0)
    axis.pcolormesh(basin.across_edges, basin.up_edges, cells, cmap=ListedColormap(COLORS), norm=norm, alpha=opacity)
    axis.set_xlabel(basin.across, fontsize=style.LABEL, color=style.INK)
    style.label(axis, basin.up)
    if basin.equal:
        axis.set_aspect("equal", adjustable="box")
    for along, scale, edges in ((basin.across, axis.xaxis, basin.across_edges), (basin.up, axis.yaxis, basin.up_edges)):
        if "°" in along:
            _angles(scale, edges)
    if basin.downward:
        axis.invert_yaxis()
    counts = basin.flights[basin.flights > 0]
    style.heading(axis, f"cells of {_range(counts)} flights{f', pale below {FEW}' if (counts < FEW).any() else ''}")


def _angles(scale: Any, edges: np.ndarray) -> None:
    """Let ticks stand at the parts of a turn where an axis of degrees is long enough for it."""
    from matplotlib.ticker import MultipleLocator

    reach = edges[-1] - edges[0]
    step = next((step for step in (5, 10, 15, 30, 45, 60, 90) if 3 <= reach / step <= 6), None)
    if step is not None:
        scale.set_major_locator(MultipleLocator(step))


def _handles(empty: bool) -> list[Any]:
    from matplotlib.patches import Patch

    shown = [Patch(facecolor=color, label=name) for color, name in zip(COLORS, NAMES, strict=True)]
    if empty:
        shown.append(Patch(facecolor="white", hatch=2 * HATCH, edgecolor=style.FAINT, linewidth=0, label=EMPTY))
    return shown


@style.drawing()
def draw_tolerance(tolerance: Tolerance, title: str = "") -> Figure:
    """Draw the share of success with its interval, and beside it median and 95 % quantile of the settling time."""
    settles = bool(np.isfinite(tolerance.settling).any())
    width = style.WIDTH if settles else CURVE_WIDTH
    figure = style.new_figure(width, PAIR_HEIGHT + style.title_height(title, width), title)
    axes = figure.subplots(1, 2 if settles else 1, squeeze=False)[0]
    for axis in axes:
        style.dress(axis)
        axis.set_xlabel(tolerance.label, fontsize=style.LABEL, color=style.INK)
        if tolerance.edges is not None and "°" in tolerance.label:
            _angles(axis.xaxis, tolerance.edges)
    share, low, high = (100 * each for each in (tolerance.share, *tolerance.interval.T))
    _line(axes[0], tolerance, share, style.BLUE, "share", (low, high))
    told = tolerance.flights > 0
    axes[0].set_ylim(*_percents(low[told], high[told]))
    style.label(axes[0], "flights that settle [%]")
    style.heading(axes[0], f"{_range(tolerance.flights[told])} flights each, 95 % interval")
    if settles:
        for values, color, name in zip(
            tolerance.settling.T, (style.BLUE, style.VERMILION), ("median", "95 % quantile"), strict=True
        ):
            _line(axes[1], tolerance, values, color, name)
        axes[1].set_ylim(0.0, ROOM * float(np.nanmax(tolerance.settling)) or 1.0)
        style.label(axes[1], "settling time [s]")
        style.legend(axes[1])
    return figure


def _line(
    axis: Axes,
    tolerance: Tolerance,
    values: np.ndarray,
    color: str,
    name: str,
    band: tuple[np.ndarray, np.ndarray] | None = None,
) -> None:
    """Draw steps over bins, or points at values, with a band or bars around them."""
    if tolerance.edges is not None:
        axis.stairs(values, tolerance.edges, baseline=None, color=color, linewidth=style.LINE, label=name)
        if band is not None:
            low, high = (np.where(np.isfinite(values), each, np.nan) for each in band)
            axis.stairs(high, tolerance.edges, baseline=low, fill=True, color=color, alpha=BAND, linewidth=0)
        axis.set_xlim(tolerance.edges[0], tolerance.edges[-1])
        return
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in tolerance.values)
    places = np.array(tolerance.values, dtype=float) if numbers else np.arange(len(values), dtype=float)
    bars = None if band is None else np.nan_to_num(np.abs(np.stack(band) - values))
    look: dict[str, Any] = {"markersize": style.MARKER, "linewidth": style.THIN, "elinewidth": style.LINE}
    axis.errorbar(
        places, values, bars, color=color, marker="o", linestyle="-" if numbers else "none", label=name, **look
    )
    if not numbers:
        axis.set_xticks(places, [_short(str(value)) for value in tolerance.values])
        axis.set_xlim(-0.5, len(places) - 0.5)


def _percents(low: np.ndarray, high: np.ndarray) -> tuple[float, float]:
    """Return limits of an axis of percents around intervals, no farther than zero and a little above a hundred."""
    if not low.size:
        return 0.0, 100.0
    room = max(0.08 * (high.max() - low.min()), 1e-4)
    return max(0.0, float(low.min() - room)), min(float(high.max() + room), 100.0 + room)


def _range(counts: np.ndarray) -> str:
    """Return the least and the largest count in words."""
    if not counts.size:
        return "0"
    low, high = int(counts.min()), int(counts.max())
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def _short(name: str) -> str:
    return name if len(name) <= LETTERS else f"{name[: LETTERS - 1]}…"

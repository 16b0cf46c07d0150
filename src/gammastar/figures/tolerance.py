"""Curves of success and settling time over one quantity: how far a tolerance reaches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gammastar.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAIR_HEIGHT = 2.5  # [in] of curves
CURVE_WIDTH = 3.3  # [in] of the panel of a curve that stands alone
BAND = 0.25  # opacity of an interval
ROOM = 1.1  # of the largest value, which an axis from zero spans
LETTERS = 16  # of the name of a value below an axis
BESIDE = 32  # letters of all names that stand beside each other


class Tolerance(NamedTuple):
    """Success and settling time over one quantity, in n bins or at n values of it."""

    label: str
    edges: np.ndarray | None  # (n + 1,); None where these are values
    values: Sequence[Any]  # n of them, numbers or texts; none where these are bins
    flights: np.ndarray  # (n,)
    share: np.ndarray  # (n,) of successes, NaN where there is no flight
    interval: np.ndarray  # (n, 2) that holds the true share
    settling: np.ndarray  # (n, 2) [s] median and 95 % quantile, NaN where none settles


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
            style.angles(axis.xaxis, tolerance.edges)
    share, low, high = (100 * each for each in (tolerance.share, *tolerance.interval.T))
    _line(axes[0], tolerance, share, style.BLUE, "share", (low, high))
    told = tolerance.flights > 0
    axes[0].set_ylim(*_percents(low[told], high[told]))
    style.label(axes[0], "flights that settle [%]")
    style.heading(axes[0], f"{style.counted(tolerance.flights[told])} flights each, 95 % interval")
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
        names = [_short(str(value)) for value in tolerance.values]
        beside = sum(map(len, names)) <= BESIDE
        leaning: dict[str, Any] = {} if beside else {"rotation": 45, "ha": "right", "rotation_mode": "anchor"}
        axis.set_xticks(places, names, parse_math=False, **leaning)
        axis.set_xlim(-0.5, len(places) - 0.5)


def _percents(low: np.ndarray, high: np.ndarray) -> tuple[float, float]:
    """Return limits of an axis of percents around intervals, no farther than zero and a little above a hundred."""
    if not low.size:
        return 0.0, 100.0
    room = max(0.08 * (high.max() - low.min()), 1e-4)
    return max(0.0, float(low.min() - room)), min(float(high.max() + room), 100.0 + room)


def _short(name: str) -> str:
    return name if len(name) <= LETTERS else f"{name[: LETTERS - 1]}…"

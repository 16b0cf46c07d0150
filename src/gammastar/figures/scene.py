"""The flight in space: flown path, target path, and the vehicle's axes along the way, at equal scale and with height upward.

Positions come in world axes with the third one down; they are drawn as (x1, x2, -x3) with the second axis running backwards, so
that what is above is drawn above, a vehicle upside down is seen upside down, and nothing is mirrored.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gammastar.figures import style
from gammastar.figures.phases import flown_phases, target_names
from gammastar.figures.windows import settling_time

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gammastar.flight import FlightRecord
    from gammastar.path import Path

UPWARD = np.array([1.0, 1.0, -1.0])  # world, third axis down -> drawn, third axis up; `dress_space` reverses the second
SIDE = 6.4  # [in] longest side of the figure
AXIS_LENGTH = 0.065  # of a body axis, relative to the longest side of the scene
POSES = 20  # drawn along a flight, unless it is too short to have so many
TURN_WEIGHT = 0.25  # [1/rad] of the scene's size: how much a turn counts beside a way when poses are chosen
TARGET_POINTS = 361
TARGET_DASHES = (4, 2.5), (1, 1.5), (7, 2, 1, 2)  # of the path of the first phase, the second ...
SMALLEST_SIDE = 0.35  # of the longest side of the scene: a planar flight still gets a box with depth
FARTHEST = 1e9  # [m] of what is drawn: of a flight that ran away the matrices of a view in space would be singular
VIEW = (18.0, 58.0)  # [deg] elevation and azimuth


@style.drawing()
def draw_path(record: FlightRecord, title: str = "") -> Figure:
    """Draw the flight in space: flown and target path, start, and the body axes denser where the vehicle turns fast."""
    flown, targets = drawn(record.position), [drawn(points) for points in target_points(record)]
    rows, length = pose_rows(record), AXIS_LENGTH * scene_size(record)
    figure = style.new_figure(SIDE, SIDE)
    axis = figure.add_subplot(projection="3d", computed_zorder=False)
    draw_curves(axis, flown, targets, target_names(record))
    tips = draw_axes(axis, flown[rows], record.attitude[rows], length)
    dress_space(axis, *bounds(np.vstack([flown, *targets, tips])))
    fit(figure, axis, title)
    return figure


def drawn(vectors: np.ndarray) -> np.ndarray:
    """Return world vectors (..., 3) as they are drawn: third component upward, and no farther than matplotlib can see."""
    return np.asarray(np.clip(vectors, -FARTHEST, FARTHEST) * UPWARD)


def target_points(record: FlightRecord) -> list[np.ndarray]:
    """Return points (n, 3) [m] of the path of every phase: of the whole closed one, or of the stretch along which the flight went."""
    return [_stretch(phase.law.path, record.tangential_state[rows, 0]) for phase, rows in flown_phases(record)]


def _stretch(path: Path, along: np.ndarray) -> np.ndarray:
    """Return points of a path on which a flight had the coordinates `along`."""
    if path.period is not None:
        return path.points(np.linspace(0, path.period, TARGET_POINTS) + along[0])
    reach = max(0.1 * float(np.ptp(along)), 0.5)
    first, last = float(along.min()), float(along.max())
    low, high = path.domain  # beyond it there may be no path, or another branch of its formula
    return path.points(
        np.linspace(max(first - reach, min(low, first)), min(last + reach, max(high, last)), TARGET_POINTS)
    )


def scene_size(record: FlightRecord) -> float:
    """Return the longest side [m] of the box around flight and target."""
    points = [record.position, *target_points(record)]
    return float(np.ptp(drawn(np.vstack(points)), axis=0).max())


def pose_rows(record: FlightRecord, count: int = POSES) -> np.ndarray:
    """Return rows of a record at which to draw the vehicle: evenly spread over way flown plus angle turned.

    On a closed path the second lap would be drawn over the first, so it gets no poses.
    """
    last = len(record.time)
    period = record.phases[-1].law.path.period
    settled = settling_time(record)
    if period is not None and settled is not None:
        along = record.tangential_state[:, 0]
        first = int(np.searchsorted(record.time, settled))
        beyond = np.flatnonzero(np.abs(along[first:] - along[min(first, last - 1)]) > 0.9 * period)
        last = first + int(beyond[0]) if beyond.size else last
    effort = activity(record, TURN_WEIGHT * scene_size(record))[:last]
    return np.unique(np.searchsorted(effort, np.linspace(0, effort[-1], count)).clip(0, last - 1))


def activity(record: FlightRecord, turn_weight: float) -> np.ndarray:
    """Return the growing sum (n,) of way flown [m] and tilt turned, weighted [m/rad]."""
    way = np.linalg.norm(np.diff(drawn(record.position), axis=0), axis=1)
    rate = np.linalg.norm(record.angular_velocity[:, :2], axis=1)
    turn = np.diff(record.time) * (rate[1:] + rate[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(way + turn_weight * turn)])


def draw_curves(
    axis: Any, flown: np.ndarray, targets: Sequence[np.ndarray], names: Sequence[str] = ("target",)
) -> None:
    """Draw the flown path, the target paths dashed over it, and where the flight starts; arrays (n, 3) as drawn."""
    axis.plot(*flown.T, color=style.FAINT, linewidth=style.STRONG, label="flown", zorder=2)
    for k, (target, name) in enumerate(zip(targets, names, strict=True)):
        dashes = TARGET_DASHES[k % len(TARGET_DASHES)]
        axis.plot(*target.T, color=style.INK, linewidth=style.LINE, linestyle=(0, dashes), label=name, zorder=3)
    axis.plot(*flown[:1].T, color=style.INK, marker="o", markersize=5, linestyle="none", label="start", zorder=6)


def draw_axes(axis: Any, places: np.ndarray, attitudes: np.ndarray, length: float) -> np.ndarray:
    """Draw the body axes at places (n, 3) as drawn, attitudes (n, 3, 3) body to world, and return their tips (3 n, 3)."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    names = (r"$b_1$", r"$b_2$", r"$b_3$, thrust along $-b_3$")
    tips = [places + length * drawn(attitudes[:, :, k]) for k in range(3)]
    for end, name, color in zip(tips, names, style.AXIS_COLORS, strict=True):
        segments = np.stack([places, end], axis=1)
        axis.add_collection3d(Line3DCollection(segments, colors=color, linewidths=style.STRONG, label=name, zorder=5))
    return np.vstack(tips)


def bounds(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return low and high corners (3,) of a box around points (n, 3), no side much shorter than the longest."""
    low, high = points.min(axis=0), points.max(axis=0)
    longest = max(float((high - low).max()), 1e-6)
    half = np.maximum(high - low, SMALLEST_SIDE * longest) / 2
    middle = (low + high) / 2
    return middle - half, middle + half


def dress_space(axis: Any, low: np.ndarray, high: np.ndarray, view: tuple[float, float] = VIEW) -> None:
    """Give a panel in space equal scale, thin grids and axes with units."""
    from matplotlib.ticker import MaxNLocator

    axis.patch.set_visible(False)
    axis.set_xlim(low[0], high[0])
    axis.set_ylim(high[1], low[1])
    axis.set_zlim(low[2], high[2])
    axis.set_box_aspect(high - low, zoom=0.95)
    axis.view_init(*view)
    names = ("$x_1$ [m]", "$x_2$ [m]", "height $-x_3$ [m]")
    sides = (axis.xaxis, axis.yaxis, axis.zaxis)
    for side, name, reach in zip(sides, names, (high - low) / (high - low).max(), strict=True):
        side.set_pane_color((1.0, 1.0, 1.0, 0.0))
        side._axinfo["grid"].update(color=style.GRID, linewidth=style.THIN)  # matplotlib has no public way
        side.line.set_color(style.FAINT)
        side.set_major_locator(MaxNLocator(max(2, round(7 * reach)), steps=[1, 2, 5, 10]))
        side.set_major_formatter(style.plain)
        side.set_rotate_label(side is not axis.zaxis)  # left to itself the height is written upside down in some views
        side.set_label_text(name, rotation=90 if side is axis.zaxis else 0, fontsize=style.LABEL, color=style.INK)
        side.set_tick_params(labelsize=style.SMALL, colors=style.INK, pad=3 if side is axis.zaxis else 0)


def fit(figure: Figure, axis: Any, title: str, below: float = 0.0) -> None:
    """Shrink a figure to its one panel in space, with title and legend above it and room `below` [in]; its longer side becomes SIDE."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_layout_engine("none")
    canvas: Any = FigureCanvasAgg(figure)
    square, (left, bottom, right, top) = _scaled(canvas, axis, SIDE, SIDE)
    names = figure.legend(
        handles=axis.get_legend_handles_labels()[0],
        loc="upper center",
        ncols=3,
        fontsize=style.SMALL,
        frameon=False,
        labelcolor=style.INK,
        handlelength=1.6,
        columnspacing=1.4,
    )
    extent = names.get_window_extent(canvas.get_renderer())
    width = max(right - left, extent.width / figure.dpi)
    above = style.title_height(title, width)
    height = top - bottom + extent.height / figure.dpi + above + below
    figure.set_size_inches(width, height)
    margin = (width - (right - left)) / 2
    axis.set_position(((margin - left) / width, (below - bottom) / height, square / width, square / height))
    if title:
        style.entitle(figure, title, width, y=1 - 0.08 / height, va="top")
        names.set_bbox_to_anchor((0.5, 1 - above / height))


def fill(figure: Figure, axis: Any, box: tuple[float, float, float, float]) -> None:
    """Let a panel in space fill the middle of a box (left, bottom, width, height) [in] of its figure."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    whole_width, whole_height = (float(side) for side in figure.get_size_inches())
    others = [each for each in figure.axes if each is not axis]
    for each in others:
        each.set_visible(False)
    square, (left, bottom, right, top) = _scaled(FigureCanvasAgg(figure), axis, box[2], box[3])
    figure.set_size_inches(whole_width, whole_height)
    for each in others:
        each.set_visible(True)
    x = box[0] + (box[2] - right - left) / 2
    y = box[1] + (box[3] - top - bottom) / 2
    axis.set_position((x / whole_width, y / whole_height, square / whole_width, square / whole_height))


def _scaled(canvas: Any, axis: Any, width: float, height: float) -> tuple[float, tuple[float, float, float, float]]:
    """Return the square [in] in which a panel just fits into width x height [in], and where in it the ink lies.

    A panel in space leaves much of its square empty, and how much depends on the shape of the scene: draw it, look, and scale.
    """
    square = max(width, height)
    for _ in range(2):  # text does not scale with the panel, so the second look corrects the first
        left, bottom, right, top = _ink(canvas, axis, square)
        square *= min(width / (right - left), height / (top - bottom))
    return square, _ink(canvas, axis, square)


def _ink(canvas: Any, axis: Any, square: float) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top [in] of what a panel shows, with a margin, from the corner of its square of a size [in]."""
    paper, margin = 2 * square, 0.06
    canvas.figure.set_size_inches(paper, paper)
    axis.set_position((0.25, 0.25, 0.5, 0.5))
    canvas.draw()
    dark = np.asarray(canvas.buffer_rgba())[:, :, :3].min(axis=2) < 250
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    edges = np.array([columns[0], len(dark) - 1 - rows[-1], columns[-1] + 1, len(dark) - rows[0]]) / canvas.figure.dpi
    left, bottom, right, top = edges - paper / 4
    return left - margin, bottom - margin, right + margin, top + margin

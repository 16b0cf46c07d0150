"""The picture of a certificate: the path in space, coloured by what its tightest limit leaves, with the places that decide."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gammastar.figures import scene, style
from gammastar.figures.quadrotor import towards_viewer
from gammastar.figures.scene import drawn
from gammastar.frames import convert_vector

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gammastar.certificate import Certificate

PIECES = 600  # of the path, sorted by depth so that what is nearer covers what is farther
CASING, BODY, SHADOW = 6.0, 3.2, 0.8  # [pt] width of a strand's white edge, of itself and of its shadow on the floor
COLORS = (style.ORANGE, "#9FC5D8", style.BLUE)  # from the tightest place to the one with most in reserve
SMALLEST_RANGE = 0.2  # of margins that the colours span: less is one colour
BAR = (0.42, 0.11, 2.6)  # [in] bottom, height and width of the colour bar
BELOW = 0.72  # [in] that the colour bar takes below the panel
MARKS = (  # name of a check, what its place is called, marker
    ("self-distance", "closest to itself", "s"),
    ("curvature", "sharpest bend", "^"),
    ("specific thrust", "least specific thrust", "v"),
    ("most thrust", "most thrust", "D"),
    ("tilt rate", "largest tilt rate", "<"),
    ("torque", "largest torque", ">"),
)


@style.drawing()
def draw_certificate(certificate: Certificate, title: str = "") -> Figure:
    """Draw the path of a certificate; where a limit is not met it is red, and a fault is marked by a cross.

    The margin is 1 minus the used share of the tightest limit.  A path with a fault of geometry has none: it is grey.
    """
    points, margin = drawn(certificate.points), certificate.tightest_margin
    figure = style.new_figure(scene.SIDE, scene.SIDE)
    axis: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    low, high = scene.bounds(points)
    scene.dress_space(axis, low, high)
    shadow = points.copy()
    shadow[:, 2] = low[2]
    axis.plot(*shadow.T, color=style.GRID, linewidth=SHADOW, zorder=1)
    examined = any(check.name == "specific thrust" and check.value is not None for check in certificate.checks)
    colors = _Colors(margin) if examined else None
    _draw_strand(axis, points, None if colors is None else colors.of(margin))
    _mark_places(axis, certificate)
    if colors is not None and margin.min() < 0:
        axis.plot([], [], [], color=style.VERMILION, linewidth=BODY, label="beyond a limit")
    scene.fit(figure, axis, title, BELOW if colors else 0.0)
    if colors is not None:
        colors.explain(figure)
    return figure


class _Colors:
    """Colours of margins: the worst and the best of a path at the two ends, and one colour for all that is below zero."""

    def __init__(self, margin: np.ndarray) -> None:
        from matplotlib.colors import LinearSegmentedColormap, Normalize

        best = max(float(margin.max()), 0.0)
        worst = max(float(margin.min()), 0.0)
        worst = max(0.0, min(worst, best - SMALLEST_RANGE))
        self.map = LinearSegmentedColormap.from_list("margin", COLORS).with_extremes(under=style.VERMILION)
        self.norm = Normalize(worst, max(best, worst + SMALLEST_RANGE))
        self.fails = bool(margin.min() < 0)

    def of(self, margin: np.ndarray) -> np.ndarray:
        """Return a colour (n, 4) for each margin (n,)."""
        return np.asarray(self.map(self.norm(margin)))

    def explain(self, figure: Figure) -> None:
        """Add the colour bar below the panel."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.ticker import MaxNLocator

        width, height = figure.get_size_inches()
        bottom, thick, length = BAR
        place = ((width - length) / 2 / width, bottom / height, length / width, thick / height)
        bar = figure.colorbar(
            ScalarMappable(self.norm, self.map),
            cax=figure.add_axes(place),
            orientation="horizontal",
            extend="min" if self.fails else "neither",
        )
        bar.outline.set_visible(False)
        bar.ax.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        bar.ax.xaxis.set_major_formatter(style.plain)
        bar.ax.tick_params(labelsize=style.SMALL, colors=style.INK, width=style.THIN, length=3)
        bar.set_label("share of the tightest limit that is left [1]", fontsize=style.SMALL, color=style.INK)


def _draw_strand(axis: Any, points: np.ndarray, colors: np.ndarray | None) -> None:
    """Draw a path (n, 3) in pieces from the farthest to the nearest, each on a white edge that parts it from those behind."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    rows = np.unique(np.linspace(0, len(points) - 1, PIECES + 1).round().astype(int))
    first, last = rows[:-1], rows[1:]
    before, after = np.insert(rows[:-2], 0, rows[0]), np.append(rows[2:], rows[-1])
    edges = np.stack([points[first], points[first], points[last], points[last]], axis=1)
    bodies = np.stack([points[before], points[first], points[last], points[after]], axis=1)  # longer: no seam is left
    shades = np.tile(_rgba(style.FAINT), (len(first), 1)) if colors is None else colors[first]
    order = np.argsort(points[first] @ towards_viewer(axis))
    both = np.stack([edges[order], bodies[order]], axis=1).reshape(-1, 4, 3)
    paints = np.stack([np.ones_like(shades), shades[order]], axis=1).reshape(-1, 4)
    widths = np.tile([CASING, BODY], len(order))
    axis.add_collection3d(Line3DCollection(both, colors=paints, linewidths=widths, capstyle="butt", zorder=3))


def _mark_places(axis: Any, certificate: Certificate) -> None:
    """Mark the start, the place at which each limit is tightest, the sharpest bend, and what fails."""
    start = drawn(certificate.points[:1])
    axis.plot(*start.T, color=style.INK, marker="o", markersize=5, linestyle="none", label="start", zorder=6)
    for check in certificate.checks:
        fails = check.verdict == "fails"
        name, marker = next(((words, sign) for key, words, sign in MARKS if key == check.name), (check.name, ""))
        stated = marker and (check.limit is not None or check.name == "curvature")
        if check.place is None or not (stated or fails):
            continue
        points = [place.point for place in (check.place, check.second_place) if place is not None]
        places = convert_vector(points, certificate.frame)
        axis.plot(
            *drawn(places).T,
            color=style.VERMILION if fails else style.INK,
            marker="X" if fails else marker,
            markersize=8 if fails else 5.5,
            markerfacecolor=style.VERMILION if fails else "white",
            linewidth=style.THIN,
            linestyle=style.DASHED if len(places) > 1 else "none",
            label=f"{name}{_value(check)}",
            zorder=8,
        )


def _value(check: Any) -> str:
    """Return the value of a check in words, an inverse curvature as the radius that it is."""
    if check.value is None:
        return f": {check.note}" if check.note else ""
    if check.name == "curvature" and check.value > 0:
        return f": radius {style.plain(float(f'{1 / check.value:.3g}'))} m"
    return f": {style.plain(float(f'{check.value:.3g}'))} {check.unit.replace('^2', '²')}"


def _rgba(color: str) -> np.ndarray:
    from matplotlib.colors import to_rgba

    return np.array(to_rgba(color))

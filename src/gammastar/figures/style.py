"""One look for every figure: palette, sizes, panels over time, and how a panel is dressed.

Figures are made with matplotlib's object interface and nothing stays behind.  What makes or renders one does so inside `drawing`,
which keeps the user's settings of matplotlib out and its threads apart.  The palette is that of M. Okabe and K. Ito,
Color Universal Design (2008), told apart in every common form of colour blindness.
"""

from __future__ import annotations

import importlib
import textwrap
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from gammastar.errors import InputError, MissingExtraError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SETTINGS = {"svg.hashsalt": "gammastar"}  # names inside an SVG do not change from run to run
KEPT = {"backend"}  # of the user's settings: nothing here depends on it, and matplotlib would load it to restore it
_ONE_AT_A_TIME = threading.RLock()  # matplotlib's settings and its parser of formulas are one for the whole process

BLUE, VERMILION, GREEN, ORANGE, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7"
INK, FAINT, GRID = "#222222", "#767676", "#DDDDDD"
CYCLE = (BLUE, VERMILION, GREEN, PURPLE)  # of the lines in one panel; further ones are dotted
AXIS_COLORS = (VERMILION, GREEN, BLUE)  # of first, second and third axis, world or body

TITLE, LABEL, SMALL = 10.0, 9.0, 8.0  # [pt] the whole scale of text
TITLE_LETTER = 0.084  # [in] width of a letter of a title, rather more than less
THIN, LINE, STRONG = 0.6, 1.2, 1.8  # [pt] the whole scale of lines
DASHED = (0, (5, 3))  # of a guide
DOTTED = (0, (1.5, 1))  # of lines beyond the colors
WIDTH = 6.6  # [in] of every figure over time
PANEL_HEIGHT, ONLY_PANEL_HEIGHT = 1.75, 2.1  # [in] of one of its rows, of several or alone
MARKER = 4.0  # [pt] shown when a line has a single row and would be invisible


@contextmanager
def drawing() -> Iterator[None]:
    """Draw with matplotlib's own settings, whatever a file, a program or the shell of the user has set, and restore those after.

    A letter that the font lacks is drawn as an empty box, without a warning.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    require_matplotlib()
    import matplotlib

    own: dict[Any, Any] = {
        key: matplotlib.rcParamsDefault[key] for key in matplotlib.rcParamsDefault if key not in KEPT
    }
    with _ONE_AT_A_TIME, matplotlib.rc_context(own | SETTINGS), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from|Matplotlib currently does not support", UserWarning)
        yield


def require_matplotlib() -> None:
    """Raise `MissingExtraError` unless matplotlib can be imported, or `InputError` when the shell keeps it from loading."""
    _require("matplotlib.figure", "matplotlib", "drawing")


def require_pillow() -> None:
    """Raise `MissingExtraError` unless Pillow can be imported."""
    _require("PIL.Image", "pillow", "writing an animation")


def new_figure(width: float, height: float, title: str = "") -> Figure:
    """Return an empty figure of a size [in] that lays itself out, on white, with its title on top."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), facecolor="white", layout="constrained")
    if title:
        entitle(figure, title, width)
    return figure


def entitle(figure: Figure, title: str, width: float, **place: Any) -> None:
    """Write a title on top of a figure, folded to a width [in]; dollars in it are dollars and no formula."""
    figure.suptitle(folded(title, width), fontsize=TITLE, color=INK, parse_math=False, **place)


def title_height(title: str, width: float) -> float:
    """Return the height [in] that a title takes above a figure of a width [in]."""
    return 0.08 + 0.17 * (folded(title, width).count("\n") + 1) if title else 0.0


def folded(title: str, width: float) -> str:
    """Return a title on as many lines as it needs within a width [in]."""
    return "\n".join(textwrap.wrap(title, max(16, int(width / TITLE_LETTER))))


def panels(rows: int, columns: int, title: str = "") -> tuple[Figure, Any]:
    """Return a figure over time and its dressed panels, an array (rows, columns) of axes; a column shares its time axis.

    Args:
        rows: Panels above each other.
        columns: Panels beside each other.
        title: Of the figure.
    """
    height = PANEL_HEIGHT * rows if rows > 1 else ONLY_PANEL_HEIGHT
    figure = new_figure(WIDTH, height + 0.45 + title_height(title, WIDTH), title)
    axes = figure.subplots(rows, columns, sharex="col", squeeze=False)
    for axis in axes.flat:
        dress(axis)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]", fontsize=LABEL, color=INK)
    figure.align_ylabels(axes[:, 0])
    return figure, axes


def dress(axis: Axes) -> None:
    """Give a flat panel its thin grid, quiet frame and text sizes."""
    from matplotlib.ticker import MaxNLocator

    axis.grid(True, color=GRID, linewidth=THIN)
    axis.set_axisbelow(True)
    axis.tick_params(labelsize=SMALL, colors=INK, width=THIN, length=3)
    for scale in (axis.xaxis, axis.yaxis):
        scale.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        scale.set_major_formatter(plain)
    for side, spine in axis.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(FAINT)
        spine.set_linewidth(THIN)


def plain(value: float, _: object = None) -> str:
    """Return the text of a tick: never an offset or a common factor that has to be looked up elsewhere."""
    return f"{value:g}".replace("-", "−")


def angles(scale: Any, edges: Any) -> None:
    """Let the ticks of an axis of degrees between two ends stand at the parts of a turn, where it is long enough for it."""
    from matplotlib.ticker import MultipleLocator

    reach = edges[-1] - edges[0]
    step = next((step for step in (5, 10, 15, 30, 45, 60, 90) if 3 <= reach / step <= 6), None)
    if step is not None:
        scale.set_major_locator(MultipleLocator(step))


def counted(counts: Any) -> str:
    """Return the least and the largest count in words."""
    if not counts.size:
        return "0"
    low, high = int(counts.min()), int(counts.max())
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def label(axis: Axes, text: str) -> None:
    """Name what a panel shows on its vertical axis, unit in brackets."""
    axis.set_ylabel(text, fontsize=LABEL, color=INK)


def heading(axis: Axes, text: str) -> None:
    """Write a few words above the left end of a panel."""
    axis.set_title(text, fontsize=SMALL, color=FAINT, loc="left", pad=4)


def legend(axis: Axes, columns: int = 4) -> None:
    """Name the lines of a panel above its right end, where no line can hide them."""
    axis.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=columns,
        fontsize=SMALL,
        frameon=False,
        borderaxespad=0.1,
        handlelength=1.3,
        handletextpad=0.5,
        columnspacing=1.2,
        labelcolor=INK,
    )


def _require(module: str, library: str, purpose: str) -> None:
    try:
        importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError(library, "figures", purpose) from error
    except ValueError as error:  # matplotlib reads the shell's MPLBACKEND while it loads
        raise InputError(f"{library} must load (got: {error}); correct or unset MPLBACKEND") from error

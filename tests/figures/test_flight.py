"""Figures of every kind of flight: complete, with units, and nothing but themselves in their bytes."""

import dataclasses
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from xml.etree import ElementTree

import pytest

import gammastar as gs
from figures.kinds import KINDS
from gammastar import figures
from gammastar.figures.flight import DRAWINGS
from gammastar.figures.save import picture

PATHS = f"import sys; sys.path[:0] = [{str(Path(__file__).parents[1])!r}, {str(Path(figures.__file__).parents[2])!r}]"
NAMES = {"path", "states", "velocities", "rates", "inputs", "margins"}


def test_the_kinds_are_what_they_claim() -> None:
    """Guards the tests below: a flight that ends early has to end early."""
    assert KINDS["one row"]().time.shape == (1,)
    assert KINDS["ended early"]().status is gs.Status.FREE_FALL
    assert KINDS["diverged"]().status is gs.Status.UNRESOLVED
    assert KINDS["open path"]().law.path.period is None
    assert not KINDS["noisy"]().nominal
    assert all(KINDS[kind]().completed for kind in ("upside down", "noisy", "open path", "stop"))


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_flight_has_every_figure(kind: str) -> None:
    drawn = figures.draw_flight(
        KINDS[kind](), "a title long enough that a narrow figure has to fold it, more than once"
    )
    assert set(drawn) == NAMES
    for figure in drawn.values():
        assert picture(figure, "png", resolution=40).startswith(b"\x89PNG")


@pytest.mark.parametrize("kind", ["upside down", "open path", "one row"])
def test_labels_of_axes_carry_units(kind: str) -> None:
    """Inner panels share the time axis below them and have no label of their own."""
    for name, figure in figures.draw_flight(KINDS[kind]()).items():
        axes = figure.axes
        labels = [axis.get_xlabel() for axis in axes] + [axis.get_ylabel() for axis in axes]
        labels += [axis.get_zlabel() for axis in axes if hasattr(axis, "get_zlabel")]
        written = [label for label in labels if label]
        assert len(written) >= 2
        assert all("[" in label and "]" in label for label in written), (name, written)


@pytest.mark.parametrize("kind", ["upside down", "replaced"])
def test_no_text_leaves_its_figure(kind: str) -> None:
    """Titles, labels and legends lie inside the paper, also where a long title meets a narrow figure."""
    title = "recovery from almost upside down onto a circle (paper, section VI-B)"
    for name, figure in figures.draw_flight(KINDS[kind](), title).items():
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        width, height = canvas.get_width_height()
        texts = [figure._suptitle, *figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]
        texts += [a.yaxis.label for a in figure.axes] + [a.xaxis.label for a in figure.axes]
        for text in texts:
            box = text.get_window_extent(canvas.get_renderer())
            assert box.x0 >= -1, (name, text)
            assert box.x1 <= width + 1, (name, text)
            assert box.y0 >= -1, (name, text)
            assert box.y1 <= height + 1, (name, text)


def test_same_flight_gives_same_bytes() -> None:
    first, second = (figures.draw_flight(KINDS["stop"](), "stop") for _ in range(2))
    for name in NAMES:
        assert picture(first[name], "svg") == picture(second[name], "svg"), name
    for kind in ("png", "pdf"):
        assert picture(first["path"], kind) == picture(second["path"], kind)
    assert picture(first["path"], "svg") == picture(first["path"], "svg")  # drawing leaves no trace in the figure


def test_threads_draw_what_one_thread_draws() -> None:
    """Four threads at once; matplotlib alone fails here, its parser of formulas is one for the whole process."""

    def bytes_of(kind: str) -> list[bytes]:
        drawn = figures.draw_flight(KINDS[kind]())
        return [picture(drawn[name], "svg") for name in ("path", "states")]

    kinds = ["one row", "open path"] * 4
    alone = {kind: bytes_of(kind) for kind in kinds[:2]}
    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(bytes_of, kinds)) == [alone[kind] for kind in kinds]


def test_figures_use_no_pyplot_and_load_matplotlib_only_when_drawing() -> None:
    program = (
        "import sys; from figures.kinds import KINDS; from gammastar import figures; "
        "assert 'matplotlib' not in sys.modules; record = KINDS['open path'](); assert 'matplotlib' not in sys.modules; "
        "figures.draw_flight(record); assert 'matplotlib.figure' in sys.modules; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", f"{PATHS}; {program}"], check=True)


def test_drawing_changes_no_setting_of_matplotlib(tmp_path: Path) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    figures.save(figures.draw_flight(KINDS["one row"]())["path"], tmp_path / "path")
    assert dict(matplotlib.rcParams) == before


SETTINGS = {  # of a user, each of which shows in a figure or breaks it
    "text.usetex": True,
    "axes.formatter.use_locale": True,
    "font.size": 30,
    "font.family": "monospace",
    "lines.linewidth": 9,
    "axes.grid": True,
    "axes.facecolor": "black",
    "savefig.bbox": "tight",
    "savefig.facecolor": "red",
    "savefig.dpi": 10,
    "svg.fonttype": "none",
    "path.sketch": (5, 100, 2),
    "axes.unicode_minus": False,
}


@pytest.mark.parametrize("name", sorted(NAMES))
def test_figures_do_not_depend_on_the_users_settings(name: str) -> None:
    import matplotlib

    draw = DRAWINGS[name]
    expected = picture(draw(KINDS["open path"](), "-1 and more"), "svg")
    with matplotlib.rc_context(SETTINGS):
        assert picture(draw(KINDS["open path"](), "-1 and more"), "svg") == expected
        assert matplotlib.rcParams["font.size"] == 30


def test_figures_leave_the_backend_alone() -> None:
    """Whatever backend the shell or the program has chosen, it is neither loaded nor changed."""
    program = (
        "import matplotlib, sys; from figures.kinds import KINDS; from gammastar.figures import scene; "
        "figure = scene.draw_path(KINDS['one row']()); from gammastar.figures.save import picture; picture(figure, 'png'); "
        "assert dict.__getitem__(matplotlib.rcParams, 'backend') == 'pdf'; "
        "assert 'matplotlib.backends.backend_pdf' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", f"{PATHS}; {program}"], check=True, env=os.environ | {"MPLBACKEND": "pdf"})


def test_a_backend_that_does_not_exist_is_named() -> None:
    program = "from gammastar.figures import style; style.require_matplotlib()"
    command = [sys.executable, "-c", f"{PATHS}; {program}"]
    answer = subprocess.run(
        command, check=False, env=os.environ | {"MPLBACKEND": "nonsense"}, capture_output=True, text=True
    )
    assert "InputError" in answer.stderr
    assert "MPLBACKEND" in answer.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    "title",
    [
        "costs $5 and $6",
        "$\\frac$",
        "100 % {of} \\it_",
        "start \N{ROCKET} \N{HEBREW LETTER ALEF}",
        "<a & b> -- c",
        "x" * 200,
        " ",
    ],
    ids=lambda title: ascii(title)[:20],
)
def test_a_title_is_drawn_as_it_is_written(title: str) -> None:
    """No formula, no warning about missing letters (warnings are errors here), and XML that can be read."""
    for name in ("path", "rates"):
        figure = DRAWINGS[name](KINDS["one row"](), title)
        ElementTree.fromstring(picture(figure, "svg"))
        assert picture(figure, "png")


@pytest.mark.parametrize("distance", [1e308, 1e150, 5e-324])
def test_extreme_numbers_can_be_drawn(distance: float) -> None:
    record = dataclasses.replace(KINDS["one row"](), settled_within=distance)
    for name in NAMES:
        assert picture(DRAWINGS[name](record), "png", resolution=40)


def test_missing_matplotlib_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(gs.errors.MissingExtraError, match=r"gammastar\[figures\]"):
        figures.draw_flight(KINDS["one row"]())

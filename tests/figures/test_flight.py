"""Figures of every kind of flight: complete, with units, and nothing but themselves in their bytes."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import gammastar as gs
from figures.kinds import KINDS
from gammastar import figures
from gammastar.figures.save import picture

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


def test_no_text_leaves_its_figure() -> None:
    """Titles, labels and legends lie inside the paper, also where a long title meets a narrow figure."""
    title = "recovery from almost upside down onto a circle (paper, section VI-B)"
    for name, figure in figures.draw_flight(KINDS["upside down"](), title).items():
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
    tests, source = Path(__file__).parents[1], Path(figures.__file__).parents[2]
    command = f"import sys; sys.path[:0] = [{str(tests)!r}, {str(source)!r}]; {program}"
    subprocess.run([sys.executable, "-c", command], check=True)


def test_drawing_changes_no_setting_of_matplotlib(tmp_path: Path) -> None:
    import matplotlib

    before = dict(matplotlib.rcParams)
    figures.save(figures.draw_flight(KINDS["one row"]())["path"], tmp_path / "path")
    assert dict(matplotlib.rcParams) == before


def test_missing_matplotlib_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(gs.errors.MissingExtraError, match=r"gammastar\[figures\]"):
        figures.draw_flight(KINDS["one row"]())

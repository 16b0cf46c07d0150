"""The animation: slow where the vehicle turns, complete, and the same every time."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gammastar as gs
from figures.kinds import KINDS, tilt_degrees
from gammastar.figures import animate
from gammastar.figures.animation import frame_rows


def test_frames_run_through_the_whole_flight_and_linger_on_the_flip() -> None:
    record = KINDS["upside down"]()
    rows = frame_rows(record, 150)
    assert rows[0] == 0
    assert rows[-1] == len(record.time) - 1
    assert np.all(np.diff(rows) >= 0)
    over = (record.time[rows] > 0) & (record.time[rows] < 0.6)
    assert np.count_nonzero(over) > 20  # of 150, for 4 % of the flight
    assert np.abs(np.diff(tilt_degrees(record)[rows])).max() < 15


@pytest.mark.parametrize("kind", ["open path", "one row", "at rest on the path"])
def test_an_animation_has_its_frames_and_repeats(kind: str, tmp_path: Path) -> None:
    files = [animate(KINDS[kind](), tmp_path / name, seconds=1, fps=4) for name in ("first.gif", "second.gif")]
    assert files[0].read_bytes() == files[1].read_bytes()
    with Image.open(files[0]) as image:
        assert image.format == "GIF"
        assert image.info["loop"] == 0
        assert image.n_frames <= 4  # equal frames in a row become one
        assert image.n_frames == 4 or kind != "open path"


@pytest.mark.parametrize("wrong", [{"seconds": 0}, {"fps": -1}, {"seconds": float("nan")}, {"seconds": 1e4, "fps": 60}])
def test_an_animation_without_sensible_length_is_refused(wrong: dict[str, float], tmp_path: Path) -> None:
    with pytest.raises(gs.errors.InputError):
        animate(KINDS["one row"](), tmp_path / "never.gif", **wrong)
    assert list(tmp_path.iterdir()) == []

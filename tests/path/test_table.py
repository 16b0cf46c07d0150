"""Points from a file: every way to write them that is plain, and one sentence with the line for any other."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gammastar.errors import GammastarError, InputError
from gammastar.path.table import read_points
from strategies import numbers

POINTS = np.array([[0.0, 0, -1], [1, 2, -1.5], [3, 2.5, -2]])
WRITTEN = {
    "plain": "0,0,-1\n1,2,-1.5\n3,2.5,-2\n",
    "no last line break": "0,0,-1\n1,2,-1.5\n3,2.5,-2",
    "blanks after commas": "0, 0, -1\n1, 2, -1.5\n3, 2.5, -2\n",
    "semicolons": "0;0;-1\n1;2;-1.5\n3;2.5;-2\n",
    "tabs": "0\t0\t-1\n1\t2\t-1.5\n3\t2.5\t-2\n",
    "columns of blanks": "  0 0.0  -1.0 \n1  2 -1.5\n 3   2.5 -2\n",
    "exponents": "0e0,0,-1e0\n1,.2e1,-15e-1\n3,2.5,-2\n",
    "other line breaks": "0,0,-1\r\n1,2,-1.5\r\n3,2.5,-2\r\n",
    "empty lines and remarks": "# x y z\n\n0,0,-1\n  # half way\n1,2,-1.5\n   \n3,2.5,-2\n\n",
    "header": "x,y,z\n0,0,-1\n1,2,-1.5\n3,2.5,-2\n",
    "header in capitals with units": "X [m], Y [m], Z [m]\n0,0,-1\n1,2,-1.5\n3,2.5,-2\n",
    "header with suffixes": "x_m;y_m;z_m\n0;0;-1\n1;2;-1.5\n3;2.5;-2\n",
    "quoted header and a column of names": '"","x","y","z"\n"1",0,0,-1\n"2",1,2,-1.5\n"3",3,2.5,-2\n',
    "another order and further columns": "t,z,weight,y,x\n0,-1,1,0,0\n1,-1.5,nan,2,1\n2,-2,high,2.5,3\n",
    "byte order mark": "\ufeffx,y,z\n0,0,-1\n1,2,-1.5\n3,2.5,-2\n",
}


def written(folder: Path, text: str | bytes) -> Path:
    file = folder / "points.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return file


@pytest.mark.parametrize("case", WRITTEN)
def test_points_are_read_however_they_are_written(case: str, tmp_path: Path) -> None:
    file = written(tmp_path, WRITTEN[case])
    assert np.array_equal(read_points(file), POINTS)
    assert np.array_equal(read_points(str(file)), POINTS)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@given(st.lists(st.tuples(*[numbers(-1e3, 1e3)] * 3), min_size=2, max_size=20), st.sampled_from([",", ";", "\t", " "]))
def test_what_numpy_saves_is_read_to_the_last_bit(tmp_path: Path, rows: list[tuple], delimiter: str) -> None:
    points = np.array(rows)
    points[:, 0] += 1e4 * np.arange(len(points))
    file = tmp_path / "saved.csv"
    np.savetxt(file, points, delimiter=delimiter, header="x y z", fmt="%.17g")
    assert np.array_equal(read_points(file), points)


BAD: dict[str, tuple[str | bytes, str]] = {
    "nothing": ("", "no line of numbers"),
    "remarks only": ("# x,y,z\n\n", "no line of numbers"),
    "a header only": ("x,y,z\n", r"at least two points \(got 0\)"),
    "one point": ("1,2,3\n", r"at least two points \(got 1\)"),
    "text in a number": ("0,0,0\n1,two,3\n", r"y in line 2 .*'two'"),
    "text in the first line": ("0,0,O\n1,2,3\n", r"z in line 1 .*'O'"),
    "an empty cell": ("# remark\n0,0,0\n1,,3\n", r"y in line 3 .*''"),
    "NaN": ("0,0,0\n\n1,2,nan\n", r"z in line 3 .*'nan'"),
    "infinity": ("x,y,z\n0,0,0\n-inf,2,3\n", r"x in line 3 .*'-inf'"),
    "decimal commas": ("0,0;0,0;0,5\n1,5;2,0;3,0\n", "line 1"),
    "two columns": ("0,0\n1,2\n", r"line 1 .* 3 columns \(got 2\)"),
    "four columns without a header": ("0,0,0,1\n1,2,3,1\n", r"line 1 .* 3 columns \(got 4\).*header"),
    "a short line": ("0,0,0\n1,2,3\n4,5\n", r"line 3 .* 3 columns \(got 2\)"),
    "a line shorter than its header": ("x,y,z,w\n0,0,0,1\n1,2,3\n", r"line 3 .* 4 columns \(got 3\)"),
    "a header without z": ("x,y,height\n0,0,0\n1,2,3\n", "line 1 .* header"),
    "a header in millimetres": ("x [mm],y [mm],z [mm]\n0,0,0\n1,2,3\n", "line 1 .* header"),
    "a header with two x": ("x,x,y,z\n0,0,0,0\n1,1,2,3\n", "line 1 .* header"),
    "prose": ("Once upon a time\nthere was a path\n", "line 1 .* header"),
    "equal neighbours": (
        "x,y,z\n0,0,0\n# again\n1,2,3\n1.0,2,3.0\n4,5,6\n",
        r"\[1.0, 2.0, 3.0\] in line 4 and again in line 5",
    ),
    "binary": (b"\x00\xff\xfe\x01\x02\x80", "UTF-8"),
    "a long word": (b"0,0,0\n" + b"a" * 100_000 + b",2,3\n", "x in line 2"),
    "a long line of prose": (b"long " * 10_000, "line 1"),
    "an endless cell": (b"0,0,0\n" + b"1" * 200_000 + b",2,3\n", "line 2"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_the_line(case: str, tmp_path: Path) -> None:
    text, reason = BAD[case]
    file = written(tmp_path, text)
    with pytest.raises(InputError, match=reason) as caught:
        read_points(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400 + len(str(file))


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere.csv: No such file"):
        read_points(tmp_path / "nowhere.csv")
    with pytest.raises(InputError, match="directory"):
        read_points(tmp_path)


def test_a_device_and_a_pipe_are_refused_unread(tmp_path: Path) -> None:
    """The one has no end, and the other would be waited for."""
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    for file in (Path("/dev/zero"), pipe):
        with pytest.raises(InputError, match=rf"an ordinary file \(got {file}, a device or a pipe\)"):
            read_points(file)


def test_a_huge_file_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: pytest.fail("read"))
    huge = tmp_path / "huge.csv"
    with huge.open("wb") as file:
        file.truncate(60_000_000)
    with pytest.raises(InputError, match=r"at most 50 MB \(got .*huge.csv of 60 MB\)"):
        read_points(huge)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.binary(max_size=60), st.text('0123456789.,;- \n\txyzne"#', max_size=60).map(str.encode)))
def test_any_file_gives_points_or_a_sentence(tmp_path: Path, content: bytes) -> None:
    try:
        points = read_points(written(tmp_path, content))
    except GammastarError:
        return
    assert points.shape[1] == 3
    assert len(points) >= 2
    assert np.all(np.isfinite(points))

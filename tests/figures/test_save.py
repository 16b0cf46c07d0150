"""Files appear whole or not at all."""

import os
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import gammastar as gs
from gammastar.figures import save
from gammastar.figures.save import write_whole


def test_an_interrupted_write_leaves_the_old_file_and_no_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "numbers.json"
    write_whole(file, b"old")

    def broken(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", broken)
    with pytest.raises(OSError, match="disk full"):
        write_whole(file, b"new")
    assert file.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [file]


def test_folders_are_made_and_files_are_replaced(tmp_path: Path) -> None:
    file = tmp_path / "a" / "b.txt"
    for content in (b"first", b"second"):
        write_whole(file, content)
    assert file.read_bytes() == b"second"


def test_a_stem_with_a_dot_keeps_it(tmp_path: Path) -> None:
    (file,) = save(Figure(figsize=(1, 1)), tmp_path / "v1.0", ("svg",))
    assert file.name == "v1.0.svg"


def test_an_unknown_format_names_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(gs.errors.UnknownNameError, match="pdf, png, svg"):
        save(Figure(), tmp_path / "figure", ("png", "bmp"))
    assert list(tmp_path.iterdir()) == []

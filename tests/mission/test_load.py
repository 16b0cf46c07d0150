"""Finding and reading a mission: names, files, and what is neither."""

import os
from pathlib import Path
from typing import Any

import pytest

from gammastar.errors import GammastarError, InputError, MissionError, UnknownNameError
from gammastar.mission import load, names, parse, titles, value
from gammastar.mission.load import LARGEST_FILE


def test_every_name_is_loaded() -> None:
    assert all(load(name) == load(name) for name in names())


@pytest.mark.parametrize("thing", [3, None, True, 2.5, ["upright"], b"upright", {"title": "x"}])
def test_only_names_and_paths_are_loaded(thing: Any) -> None:
    with pytest.raises(MissionError, match="a mission must be a name or the path of a file"):
        load(thing)


@pytest.mark.parametrize(
    "name", ["", ".", "a\0b.toml", "x" * 5000, "x" * 5000 + ".toml", "/", "upright.toml", "~", "\n"]
)
def test_what_is_no_file_is_refused_in_one_sentence(name: str) -> None:
    with pytest.raises((MissionError, UnknownNameError)) as caught:
        load(name)
    assert "\n" not in str(caught.value)


def test_pipes_and_devices_are_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    for file in (pipe, Path("/dev/zero")):
        with pytest.raises(MissionError, match="a pipe or device"):
            load(file)


def test_a_table_of_points_is_a_regular_file(tmp_path: Path) -> None:
    pipe = tmp_path / "points.csv"
    os.mkfifo(pipe)
    for file in (pipe, Path("/dev/zero"), tmp_path):
        with pytest.raises(InputError, match=r"\[path\] points must come from an? "):
            load("upright").with_values({"path": {"name": "csv", "file": str(file)}})


def test_a_file_may_be_large_but_not_endless(tmp_path: Path) -> None:
    file, text = tmp_path / "mine.toml", load("upright").toml()
    file.write_text(text + "#" * (LARGEST_FILE - len(text)))
    assert load(file) == load("upright")
    file.write_text(text + "#" * (LARGEST_FILE - len(text) + 1))
    with pytest.raises(MissionError, match=r"at most 10000000 bytes \(got more\)"):
        load(file)


@pytest.mark.parametrize("text", ["[" * 3000, "a = " + "[" * 3000, ".".join("a" * 3000) + " = 1", "a = " + "9" * 5000])
def test_deep_and_endless_toml_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(MissionError) as caught:
        parse(text)
    assert len(str(caught.value)) < 200
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "expected"), [("2.", 2.0), ("-.5", -0.5), ("+3.", 3.0), (".", "."), ("1.2.", "1.2.")])
def test_a_number_may_end_or_begin_with_its_point(text: str, expected: object) -> None:
    """TOML wants a digit on both sides; on a command line the number is meant."""
    assert value(text) == expected
    assert type(value(text)) is type(expected)


@pytest.mark.parametrize("key", ["path.radius", "flight.seed", "title", "start.position", "controller.poles"])
@pytest.mark.parametrize(
    "text", ["", "[", "nan", "-inf", "[[[[1]]]]", "{}", "1979-05-27", "0x10", '"\\u0000"', "1e400", "a.b=1"]
)
def test_whatever_is_set_is_taken_or_refused_in_one_sentence(key: str, text: str) -> None:
    message = ""
    try:
        load("upright").with_values({key: value(text)})
    except GammastarError as error:
        message = str(error)
    assert "\n" not in message
    assert len(message) < 400


def test_titles_are_those_of_the_missions() -> None:
    found = titles()
    assert list(found) == names()
    assert found["upside-down"] == load("upside-down").title

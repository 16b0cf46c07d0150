"""Find a mission by name or file and read it."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from gammastar.errors import MissionError, UnknownNameError
from gammastar.mission.complaint import shown, within
from gammastar.mission.mission import Mission, read

LARGEST_FILE = 10_000_000  # [bytes]; a mission has a few thousand, or thirty for each waypoint
BARE_POINT = re.compile(r"[+-]?(\d+\.|\.\d+)")  # of a number that TOML wants a digit on both sides of


def names() -> list[str]:
    """Return the names of the missions that come with gammastar."""
    return sorted(file.name.removesuffix(".toml") for file in _shelf().iterdir() if file.name.endswith(".toml"))


def titles() -> dict[str, str]:
    """Return the titles of the missions that come with gammastar, by name; none of them is built for it."""
    return {name: read(_tables(_built_in(name))).title for name in names()}


def load(name_or_path: str | os.PathLike[str]) -> Mission:
    """Return a built-in mission by its name, or the mission of a TOML file by its path.

    Raises:
        UnknownNameError: Neither a built-in name nor a file.
        MissionError: The file cannot be read, is not TOML, or has an unknown or missing key or a value of the wrong type.
        GammastarError: The numbers cannot be flown.
    """
    if not isinstance(name_or_path, (str, os.PathLike)):
        raise MissionError(f"a mission must be a name or the path of a file (got {shown(name_or_path)}); give its name")
    if isinstance(name_or_path, str) and name_or_path in names():
        return parse(_built_in(name_or_path))
    path = Path(name_or_path)
    looks_like_a_name = isinstance(name_or_path, str) and path.suffix != ".toml" and len(path.parts) == 1
    if looks_like_a_name and not os.path.exists(path):
        raise UnknownNameError("mission, unless it is a file,", name_or_path, names())
    with within(f"{path}:"):
        return Mission.from_values(_anchored(_tables(_text(path)), path.absolute().parent))


def parse(text: str) -> Mission:
    """Return the mission of a text in TOML; raises as `load` does."""
    return Mission.from_values(_tables(text))


def value(text: str) -> Any:
    """Return a TOML value, or the text itself when it is none: 2.5, 2., [0, 0, 1], true, and enu all mean what they look like."""
    if BARE_POINT.fullmatch(text):
        return float(text)
    try:
        tables = _tables(f"value = {text}")
    except MissionError:
        return text
    return tables["value"] if set(tables) == {"value"} else text


def _built_in(name: str) -> str:
    return str((_shelf() / f"{name}.toml").read_text(encoding="utf-8"))


def _tables(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        cause = "it is nested too deeply" if isinstance(error, RecursionError) else " ".join(str(error).split())
        raise MissionError(f"a mission must be TOML (got: {cause}); correct it there") from error


def _anchored(tables: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return the tables of a file with the files that they name found beside it."""
    replacements = tables.get("replacements")
    others = replacements if isinstance(replacements, list) else []
    for table in [tables, *(each for each in others if isinstance(each, dict))]:
        path = table.get("path")
        if isinstance(path, dict) and isinstance(path.get("file"), str):
            path["file"] = str(folder / path["file"])
    return tables


def _text(path: Path) -> str:
    """Return the text of a file, or raise `MissionError`."""
    try:
        kind = path.stat().st_mode  # before opening it: a pipe would wait for its other end
        got = "" if stat.S_ISREG(kind) else "a directory" if stat.S_ISDIR(kind) else "a pipe or device"
        content = b"" if got else _beginning(path)
    except (OSError, ValueError) as error:
        got = ((error.strerror if isinstance(error, OSError) else None) or str(error)).lower()
    if got:
        raise MissionError(f"a mission must be a file that can be read (got: {got}); give the path of a TOML file")
    if len(content) > LARGEST_FILE:
        raise MissionError(f"a mission must have at most {LARGEST_FILE} bytes (got more); is this the right file?")
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise MissionError(
            f"a mission must be text in UTF-8 (got byte {content[error.start]:#04x} at {error.start}); save it as UTF-8"
        ) from error


def _beginning(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(LARGEST_FILE + 1)


def _shelf() -> Any:
    return resources.files("gammastar") / "missions"

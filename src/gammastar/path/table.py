"""Points from a file of comma-separated values: what a planner, a survey or a spreadsheet writes."""

from __future__ import annotations

import csv
import os
import re
import stat
from pathlib import Path

import numpy as np

from gammastar.errors import InputError

AXES = ("x", "y", "z")
DELIMITERS = (",", ";", "\t")  # the one that a file's first line holds most of; blanks where it holds none
LARGEST = 50_000_000  # bytes of a file, some half a million points
SHOWN = 60  # characters of a file that a message repeats


def read_points(file: str | os.PathLike[str]) -> np.ndarray:
    """Return the points (n, 3) [m] of a text file, one a line: x, y, z, separated by commas, semicolons, tabs or blanks.

    Without a header every line has exactly three numbers.  A header names the columns; x, y and z are taken (in any order,
    in capitals, or with their unit: 'x', 'X', 'x [m]', 'x_m'), others are ignored.  Empty lines and lines that begin with # are
    skipped.

    Raises:
        InputError: The file cannot be read, is a device or larger than `LARGEST`, has fewer than two points, or a line is not
            three finite numbers or repeats the point before it; with the line.
    """
    path = Path(file)
    lines = _lines(path)
    if not lines:
        raise InputError(f"{path} must hold points (got no line of numbers); write x, y, z, one point a line")
    delimiter = max(DELIMITERS, key=lines[0][1].count)
    delimiter = delimiter if delimiter in lines[0][1] else " "
    rows = [(number, _cells(path, number, line, delimiter)) for number, line in lines]
    columns, width = [0, 1, 2], 3
    if not any(_is_number(cell) for cell in rows[0][1]):
        columns, width = _named_columns(path, *rows[0]), len(rows[0][1])
        del rows[0]
    points = np.array([_point(path, number, cells, columns, width) for number, cells in rows]).reshape(-1, 3)
    if len(points) < 2:
        raise InputError(f"{path} must hold at least two points (got {len(points)}); add points")
    for k in np.flatnonzero(np.all(points[1:] == points[:-1], axis=1)):
        raise InputError(
            f"neighbouring points of {path} must differ (got {points[k].tolist()} in line {rows[k][0]} and again in line "
            f"{rows[k + 1][0]}); remove one of them"
        )
    return points


def _lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines that hold something, with their numbers from one."""
    try:
        found = path.stat()
        is_special = not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode))
        text = "" if is_special or found.st_size > LARGEST else path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a text in UTF-8"
        raise InputError(
            f"points must come from a readable text file (got {path}: {reason}); check the name"
        ) from error
    if is_special:
        raise InputError(f"points must come from an ordinary file (got {path}, a device or a pipe); save them first")
    if found.st_size > LARGEST:
        raise InputError(
            f"a file of points must have at most {LARGEST / 1e6:g} MB (got {path} of {found.st_size / 1e6:.3g} MB); thin it out"
        )
    lines = enumerate(text.splitlines(), start=1)
    return [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]


def _cells(path: Path, number: int, line: str, delimiter: str) -> list[str]:
    text = line.strip() if delimiter == " " else line
    try:
        (row,) = csv.reader([text], delimiter=delimiter, skipinitialspace=True)
    except csv.Error as error:
        raise InputError(
            f"line {number} of {path} must be a line of numbers (got one where {error}); correct it"
        ) from error
    return [cell.strip() for cell in row]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _named_columns(path: Path, number: int, header: list[str]) -> list[int]:
    """Return where the columns x, y and z stand."""
    names = [re.sub(r"\s*(\[m\]|\(m\)|_m)$", "", cell.lower()) for cell in header]
    for axis in AXES:
        if names.count(axis) != 1:
            raise InputError(
                f"line {number} of {path} must be three numbers or a header that names x, y and z once each (got "
                f"{', '.join(header)[:SHOWN]!r}); correct it"
            )
    return [names.index(axis) for axis in AXES]


def _point(path: Path, number: int, cells: list[str], columns: list[int], width: int) -> list[float]:
    if len(cells) != width:
        remedy = "correct the line" if width != 3 else "correct it, or name the columns x, y and z in a header"
        raise InputError(f"line {number} of {path} must have {width} columns (got {len(cells)}); {remedy}")
    point = []
    for axis, column in zip(AXES, columns, strict=True):
        if not _is_number(cells[column]) or not np.isfinite(float(cells[column])):
            raise InputError(
                f"{axis} in line {number} of {path} must be a finite number (got {cells[column][:SHOWN]!r}); correct it"
            )
        point.append(float(cells[column]))
    return point

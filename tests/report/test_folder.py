"""The files of a flight: what their parts mean is written down."""

import re
from pathlib import Path

from gammastar.mission import load

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "command-line.md"


def documented_columns() -> list[list[str]]:
    """Return the names in the tables of columns, of every record and of those with an autopilot."""
    tables = PAGE.read_text(encoding="utf-8").split("| column | unit | meaning |")[1:]
    rows = [re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for table in tables]
    return [[name for row in each for name in re.findall(r"`(\w+)`", row)] for each in rows]


def test_every_column_is_documented_in_order() -> None:
    """Of an autopilot's, the first of a vector stands for the others."""
    always, with_autopilot = documented_columns()
    short = {"flight.duration": 0.01}
    assert always == list(load("helix").with_values(short).fly().columns())
    added = list(load("quadrotor").with_values(short).fly().columns())[len(always) :]
    assert [name for name in added if not re.search(r"_([yz]|[2-9])$", name)] == with_autopilot

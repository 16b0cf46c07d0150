"""The files of a flight: what their parts mean is written down."""

import re
from pathlib import Path

from gammastar.mission import load

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "command-line.md"


def test_every_column_is_documented_in_order() -> None:
    table = PAGE.read_text(encoding="utf-8").partition("| column | unit | meaning |")[2]
    documented = [
        name for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for name in re.findall(r"`(\w+)`", row)
    ]
    record = load("helix").with_values({"flight.duration": 0.01}).fly()
    assert documented == list(record.columns())

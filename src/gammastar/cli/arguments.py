"""Arguments that several verbs take."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from gammastar import mission
from gammastar.errors import MissionError
from gammastar.mission.complaint import shown

DEEPEST_KEY = 8  # levels of a dotted key; missions have three

MissionName = Annotated[
    str, typer.Argument(metavar="MISSION", help="A built-in name (see: gammastar missions) or a TOML file.")
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a value, such as path.radius=2 or start.position=[0,1,2]; repeatable.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout and nothing else.")]


def chosen_mission(name: str, changes: list[str] | None) -> mission.Mission:
    """Return the mission of a name or file, with the values of every --set."""
    values = dict(_change(each) for each in changes or [])
    chosen = mission.load(name)
    return chosen.with_values(values) if values else chosen


def _change(words: str) -> tuple[str, Any]:
    """Return key and value of one --set."""
    key, sign, value = (part.strip() for part in words.partition("="))
    if not sign or not key:
        raise MissionError(
            f"--set must have the form key=value (got {shown(words)}); write for example --set path.radius=2", key
        )
    if key.count(".") >= DEEPEST_KEY:
        raise MissionError(
            f"--set must name a key at most {DEEPEST_KEY} levels deep (got {shown(key)}); see gammastar show", key
        )
    return key, mission.value(value)

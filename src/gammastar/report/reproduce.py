"""Fly the paper's section VI again: Figures 3 to 17 in one style, our numbers, and a page that sets both beside the paper's words."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gammastar import mission
from gammastar.errors import UnknownNameError
from gammastar.figures import save, style
from gammastar.figures.flight import DRAWINGS
from gammastar.figures.history import draw_states
from gammastar.figures.save import FORMATS
from gammastar.flight import FlightRecord
from gammastar.law.gains import describe
from gammastar.report.effort import effort_table
from gammastar.report.folder import to_json
from gammastar.report.measures import measures
from gammastar.report.messages import MESSAGES, SCENARIOS, Message
from gammastar.report.page import page
from gammastar.report.place import filled
from gammastar.report.verdict import Context, Judgement

FLIGHT_SHARE, EFFORT_SHARE = (
    10,
    10,
)  # steps of progress that a flight and the table of efforts count for; a figure counts for one
INDEX, NUMBERS = "index.html", "numbers.json"
TRANSVERSE_UNITS = ("m$^2$", "m")  # of s1 = x1^2 + x2^2 - 1 and s2 = x3 - 10


def reproduce(
    out: Path,
    progress: Callable[[int, int], None] | None = None,
    missions: Mapping[str, mission.Mission] | None = None,
) -> dict[str, Any]:
    """Write figure-03 ... figure-17 (PNG and SVG), index.html and numbers.json into a folder, and return the numbers.

    Args:
        out: Folder, made when missing; files of the same names are replaced when all are complete.
        progress: Called with (steps done, steps in all).
        missions: Variants of scenarios by name, such as one with other poles; the built-in missions otherwise.

    Raises:
        UnknownNameError: A variant of a scenario that section VI does not have.
        MissingExtraError: matplotlib is not installed.
    """
    variants = dict(missions or {})
    for name in variants:
        if name not in SCENARIOS:
            raise UnknownNameError("a scenario of section VI", name, SCENARIOS)
    style.require_matplotlib()
    steps = _Steps(progress, FLIGHT_SHARE * len(SCENARIOS) + EFFORT_SHARE + len(MESSAGES))
    records = {}
    for name in SCENARIOS:
        chosen = variants.get(name) or mission.load(name)
        records[name] = chosen.fly(steps.part(FLIGHT_SHARE))
        steps.advance(FLIGHT_SHARE)
    numbers = _numbers(records)
    steps.advance(EFFORT_SHARE)
    judged = [(each, each.judge(_context(each, numbers))) for each in MESSAGES]
    numbers["figures"] = [_entry(message, judgement) for message, judgement in judged]
    with filled(out) as made:
        for message, _ in judged:
            save(_drawn(message, records[message.scenario]), made / message.stem)
            steps.advance(1)
        (made / NUMBERS).write_text(to_json(numbers), encoding="utf-8", newline="\n")
        (made / INDEX).write_text(page(judged, numbers), encoding="utf-8", newline="\n")
    return numbers


def file_names() -> list[str]:
    """Return the names of the files that `reproduce` writes."""
    return [INDEX, NUMBERS, *(name for message in MESSAGES for name in _files(message))]


def _files(message: Message) -> list[str]:
    return [f"{message.stem}.{kind}" for kind in FORMATS]


def _numbers(records: Mapping[str, FlightRecord]) -> dict[str, Any]:
    vehicle = records["upright"].law.vehicle
    inertia = np.diag(vehicle.inertia)
    return {
        "vehicle": {
            "mass_kg": vehicle.mass,
            "inertia_kg_m2": inertia.tolist(),
            "radius_of_gyration_m": math.sqrt(inertia[0] / vehicle.mass),
        },
        "scenarios": {name: measures(record) | {"poles": _poles(record)} for name, record in records.items()},
        "effort": effort_table(records["upright"], records["upside-down"]),
    }


def _context(message: Message, numbers: dict[str, Any]) -> Context:
    return Context(numbers["scenarios"][message.scenario], numbers["scenarios"], numbers["effort"])


def _drawn(message: Message, record: FlightRecord) -> Any:
    if message.drawing == "states":
        return draw_states(record, message.title, TRANSVERSE_UNITS)
    return DRAWINGS[message.drawing](record, message.title)


def _entry(message: Message, judgement: Judgement) -> dict[str, Any]:
    return {
        "number": message.number,
        "scenario": message.scenario,
        "section": message.section,
        "claim": message.claim,
        "verdict": judgement.verdict.value,
        "numbers": dict(judgement.numbers),
        "remark": judgement.remark,
        "files": _files(message),
    }


def _poles(record: FlightRecord) -> str:
    """Return the poles of the chains that act, as words."""
    chains = {name: describe(np.array(record.law.poles[name])) for name in ("transverse", "speed", "yaw")}
    return "; ".join(f"{name} poles {poles}" for name, poles in chains.items()).replace("-", "−") + " [1/s]"


class _Steps:
    """Progress of the whole, from the progress of its parts."""

    def __init__(self, progress: Callable[[int, int], None] | None, total: int) -> None:
        self.progress, self.total, self.done = progress, total, 0

    def advance(self, steps: int) -> None:
        self.done += steps
        self._tell(self.done)

    def part(self, steps: int) -> Callable[[int, int], None]:
        return lambda done, total: self._tell(self.done + steps * done // max(total, 1))

    def _tell(self, done: int) -> None:
        if self.progress is not None:
            self.progress(done, self.total)

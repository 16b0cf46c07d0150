"""What is certified of a path: numbers with places and verdicts, and the sentences that follow from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from gammastar.certificate.motion import Progress
from gammastar.errors import UnknownNameError
from gammastar.path.sampling import Place


class Verdict(StrEnum):
    """What became of one check."""

    OK = "ok"
    FAILS = "fails"  # the path is not flyable as asked
    STATED = "stated"  # a number without a requirement
    SKIPPED = "not examined"  # has no meaning while an earlier check fails


@dataclass(frozen=True)
class Check:
    """One row of the table."""

    name: str
    value: float | None  # None where there is none, or it has no bound
    unit: str
    verdict: Verdict
    place: Place | None = None
    second_place: Place | None = None  # the other end of a closest approach or of a stretch
    limit: float | None = None  # in the same unit: what the value has to keep to
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Return plain data; `value` and `limit` are in `unit`."""
        row = {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "limit": self.limit,
            "verdict": str(self.verdict),
            "place": self.place.as_dict() if self.place else None,
            "second_place": self.second_place.as_dict() if self.second_place else None,
            "note": self.note,
        }
        return {key: _plain(value) for key, value in row.items()}


@dataclass(frozen=True, eq=False)
class Certificate:
    """Whether and how fast a vehicle can follow a path exactly, known before any flight; made by `certify`."""

    path: str  # its name
    frame: str  # of the points that checks, stretches and reasons name, 'ned' or 'enu'
    flyable: bool  # at the requested speed
    reasons: tuple[str, ...]  # a sentence for each requirement that fails; empty when flyable
    checks: tuple[Check, ...]  # rows of a table
    progress: Progress  # what the speeds below are constant in
    speed: float  # [parameter/s or m/s] as requested
    allowed_speeds: tuple[tuple[float, float], ...]  # [as speed] intervals, slowest first; empty when none will do
    metres_per_progress: tuple[float, float]  # least and largest |sigma'| [m], or (1, 1) when progress is in metres
    length: float  # [m]
    stretches: tuple[tuple[Place, Place], ...]  # where the specific thrust is below its floor
    saturated: tuple[tuple[Place, Place], ...]  # where the rotors cannot give the wrench
    parameters: np.ndarray = field(repr=False)  # (n,) of a picture of the path
    arc_lengths: np.ndarray = field(repr=False)  # (n,) [m]
    points: np.ndarray = field(repr=False)  # (n, 3) [m], in `ned` whatever the frame
    tightest_margin: np.ndarray = field(repr=False)  # (n,) 1 - used share of the tightest limit, -1 to 1; 0 meets it

    @property
    def largest_speed(self) -> float | None:
        """Return the largest constant speed [as `speed`] reached without a gap from the slowest that is allowed.

        None when no speed is allowed, infinity when nothing bounds it.  Faster intervals may follow in `allowed_speeds`.
        """
        return self.allowed_speeds[0][1] if self.allowed_speeds else None

    def check(self, name: str) -> Check:
        """Return the row of a name.

        Raises:
            UnknownNameError: No row has this name.
        """
        rows = {each.name: each for each in self.checks}
        if name not in rows:
            raise UnknownNameError("a check", name, rows)
        return rows[name]

    def in_metres(self, speed: float) -> tuple[float, float]:
        """Return the least and largest speed [m/s] along the path at a speed of progress."""
        return abs(speed) * self.metres_per_progress[0], abs(speed) * self.metres_per_progress[1]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON: units in the keys, no NaN or infinity; an open upper end of speeds is null."""
        largest = self.largest_speed
        data = {
            "path": self.path,
            "flyable": self.flyable,
            "reasons": list(self.reasons),
            "progress": str(self.progress),
            "speed_per_s": self.speed,
            "speed_m_per_s": list(self.in_metres(self.speed)),
            "largest_speed_per_s": largest,
            "largest_speed_m_per_s": None if largest is None else list(self.in_metres(largest)),
            "allowed_speeds_per_s": [list(interval) for interval in self.allowed_speeds],
            "length_m": self.length,
            "free_fall_stretches": [[first.as_dict(), last.as_dict()] for first, last in self.stretches],
            "saturated_stretches": [[first.as_dict(), last.as_dict()] for first, last in self.saturated],
            "checks": [each.as_dict() for each in self.checks],
        }
        return {key: _plain(value) for key, value in data.items()}


def _plain(value: Any) -> Any:
    """Return nested lists and numbers with None for what JSON cannot hold."""
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""A verdict on one message of the paper, what it rests on, and what it is judged by."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

from gammastar.report.measures import Measures


class Verdict(enum.Enum):
    """Whether the paper's message about a figure holds in our flight."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"


@dataclass(frozen=True)
class Judgement:
    """A verdict, the numbers it rests on, and what to know about it."""

    verdict: Verdict
    numbers: tuple[tuple[str, str], ...]  # what, and its value with unit
    remark: str = ""


@dataclass(frozen=True)
class Context:
    """What a message is judged by."""

    own: Measures
    others: dict[str, Measures]  # by scenario
    effort: dict[str, Any]

"""What a study finds, as tables for people."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from gammastar.campaign.columns import label
from gammastar.campaign.rate import percent

CHANCE = "the least and the most of several bins differ by chance too, and where intervals overlap it may be that alone"
QUANTILES = ("0%", "50%", "95%", "99%", "100%")  # of those that are known, in the tables


class Table(NamedTuple):
    """Words in rows."""

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()  # sentences below it


def opening(found: Mapping[str, Any]) -> list[str]:
    """Return the first lines: the mission, the flights, and how many of them succeed."""
    rate, within = found["success"], found["settled_within_m"]
    missing = f"; {found['flights_missing']:,} are still to be flown" if found["flights_missing"] else ""
    bound = "" if within is None else f" within {within:g} m"
    low, high = map(percent, rate["interval"])
    late = f"{found['settled_late']:,} of them only in the last quarter of their time: longer flights tell whether they stay"
    return [
        *([found["mission"]] if found["mission"] else []),
        f"{found['flights']:,} flights of the seed {found['seed']}{missing}",
        f"{percent(rate['share'])} settle{bound} ({rate['successes']:,}); {100 * found['confidence']:g} % interval {low} to {high}",
        *([late] if found["settled_late"] else []),
    ]


def tables(found: Mapping[str, Any], whole: bool) -> list[Table]:
    """Return the tables of what is found.

    Args:
        found: By `findings`.
        whole: Whether every bin of every quantity is shown, or of each only where success is least and most frequent; where all flights
            settle, those in which they do so soonest and latest.
    """
    frame, quantities = found["frame"], found["by"]
    made, digest = [_causes(found), _distributions(found)], _digest if found["causes"] else _times
    made += [_bins(name, by, frame) for name, by in quantities.items()] if whole else [digest(quantities, frame)]
    return [table for table in made if table.rows]


def as_text(found: Mapping[str, Any], whole: bool) -> str:
    """Return the lines and the tables for a terminal."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    console = Console(width=1000)  # a table takes what it needs, and is cut nowhere
    with console.capture() as capture:
        for title, head, rows, notes in tables(found, whole):
            table = RichTable(
                box=SIMPLE_HEAD, title=Text(title), title_justify="left", title_style="bold", pad_edge=False
            )
            for k, name in enumerate(head):
                table.add_column(Text(name), justify="left" if k == 0 else "right")
            for row in rows:
                table.add_row(*map(Text, row))
            console.print(table)
            for note in notes:
                console.print(Text(f" {note}"))
            if notes:
                console.print()
    lines = (line.rstrip() for line in capture.get().splitlines())
    return "\n".join([*opening(found), "", *lines]).rstrip("\n")


def _causes(found: Mapping[str, Any]) -> Table:
    rows = [
        (
            each["cause"].replace("_", " "),
            f"{each['flights']:,}",
            percent(each["share"]),
            _interval(each["interval"]),
            _number(each["median_end_time_s"]),
            str(each["first_flight"]),
        )
        for each in found["causes"]
    ]
    notes = [f"{each['cause'].replace('_', ' ')}: {each['sentence']}" for each in found["causes"] if each["sentence"]]
    head = ("cause", "flights", "share", "interval", "median end [s]", "first flight")
    return Table("why flights fail", head, rows, notes)


def _distributions(found: Mapping[str, Any]) -> Table:
    rows = [
        (label(name), *(_number(values[each]) for each in QUANTILES))
        for name, values in found["distributions"].items()
        if values
    ]
    return Table("flights that settle", ("", "least", "median", "95 %", "99 %", "most"), rows)


def _digest(quantities: Mapping[str, Any], frame: str) -> Table:
    """Return a row for each quantity: where flights succeed least and most often, as far as their intervals tell."""
    rows = []
    for name, by in quantities.items():
        told = [each for each in by["bins"] if each["flights"]]
        if not told:
            continue
        worst = min(told, key=lambda each: (each["interval"][1], each["share"]))
        best = max(told, key=lambda each: (each["interval"][0], each["share"]))
        rows.append((label(name, frame), *_told(worst), *_told(best)))
    head = ("success by", "least at", "share", "interval", "most at", "share", "interval")
    return Table("what success depends on", head, rows, (CHANCE,) if rows else ())


def _times(quantities: Mapping[str, Any], frame: str) -> Table:
    """Return a row for each quantity: where flights settle soonest and latest, by their medians."""
    rows = []
    for name, by in quantities.items():
        told = sorted((each for each in by["bins"] if each["flights"]), key=lambda each: each["settling_time_s"]["50%"])
        if told:
            ends = (
                (_place(each), *(_number(each["settling_time_s"][key]) for key in ("50%", "95%")))
                for each in (told[0], told[-1])
            )
            rows.append((label(name, frame), *(word for end in ends for word in end)))
    head = ("settling time [s] by", "soonest at", "median", "95 %", "latest at", "median", "95 %")
    return Table("what the settling time depends on", head, rows)


def _bins(name: str, by: Mapping[str, Any], frame: str) -> Table:
    rows = [
        (*_told(each), f"{each['flights']:,}", *(_number(each["settling_time_s"][key]) for key in ("50%", "95%")))
        for each in by["bins"]
    ]
    if by["flights_without"]:
        rows.append(("in none of these", "", "", f"{by['flights_without']:,}", "", ""))
    head = (label(name, frame), "success", "interval", "flights", "settling time [s]: median", "95 %")
    return Table(f"by {name}", head, rows)


def _told(each: Mapping[str, Any]) -> tuple[str, str, str]:
    return _place(each), percent(each["share"]), _interval(each["interval"]) if each["flights"] else "-"


def _place(each: Mapping[str, Any]) -> str:
    return _value(each["value"]) if "value" in each else f"{_number(each['low'])} to {_number(each['high'])}"


def _interval(ends: Sequence[float]) -> str:
    low, high = map(percent, ends)
    return f"{low.removesuffix(' %')} to {high}"


def _value(value: Any) -> str:
    return _number(value) if isinstance(value, float) else str(value)


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"

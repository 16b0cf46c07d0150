"""What the verb `tune` reads and prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gammastar.cli.output import json_object, text
from gammastar.errors import InputError
from gammastar.mission.complaint import shown

SHOWN = 12  # tunings of the front, evenly from all of it; JSON has them all
POLES = "controller.poles"


def weights(words: Sequence[str] | None) -> dict[str, float]:
    """Return the weights of every --cost by term; a term alone has weight one."""
    given = (_term(word, "--cost") for word in words or ())
    return {name: 1.0 if value is None else value for name, value in given}


def limits(words: Sequence[str] | None) -> dict[str, float | None]:
    """Return the largest means of every --limit by term; None for a term alone."""
    return dict(_term(word, "--limit") for word in words or ())


def _term(word: str, option: str) -> tuple[str, float | None]:
    """Return a term, with its number if it has one."""
    name, sign, number = (part.strip() for part in word.partition("="))
    try:
        return name, float(number) if sign else None
    except ValueError:
        raise InputError(
            f"{option} must have the form term=number (got {shown(word)}); write for example {option} peak_rate_rad_s=0.5"
        ) from None


def tuned(data: Mapping[str, Any], file: Path | None, as_json: bool) -> None:
    """Print what a search for a tuning has found, and where the mission is that has it."""
    if as_json:
        json_object({**data, "file": None if file is None else str(file)})
        return
    lines = [str(data["mission"]), "", _cost(data), "", *_table(_means(data)), "", *_table(_numbers(data)), ""]
    lines += [*_front(data), str(data["message"])]
    if file is not None:
        lines.append(f"wrote {file}")
    text("\n".join(lines))


def _cost(data: Mapping[str, Any]) -> str:
    cost = data["cost"]
    summands = " + ".join(f"{weight:g} {name}" for name, weight in cost["weights"].items() if weight)
    limits = "".join(f", {name} at most {limit:.6g}" for name, limit in cost["limits"].items())
    flights = "1 flight" if data["flights"] == 1 else f"{data['flights']} flights"
    return (
        f"cost: {summands}{limits}; means of {flights}, a failed one counts {cost['failure']:g} times\n"
        f"{data['evaluations']} tunings flown"
    )


def _means(data: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of what the mission's own tuning and the one found mean, where any is not zero."""
    kinds = ["searched", "other"] if data["other_flights"] else ["searched"]
    columns = [data[who][kind] for kind in kinds for who in ("own", "found")]
    head = ["mean", "own", "found", *(["own, other flights", "found, other flights"] if len(kinds) == 2 else [])]
    rows = [(name, *(f"{column[name]:.4g}" for column in columns)) for name in columns[0]]
    return [tuple(head), *(row for row in rows if any(float(value) for value in row[1:]))]


def _numbers(data: Mapping[str, Any]) -> list[tuple[str, ...]]:
    rows = [(each["name"], f"{each['own']:.4g}", f"{each['found']:.4g}", each["unit"]) for each in data["tuned"]]
    poles = [(f"{chain} poles", _poles(own), _poles(data["found"][POLES][chain]), "1/s") for chain, own in _moved(data)]
    return [("tuned", "own", "found", ""), *rows, *poles]


def _moved(data: Mapping[str, Any]) -> list[tuple[str, Any]]:
    found = data["found"][POLES]
    return [(chain, poles) for chain, poles in data["own"][POLES].items() if found[chain] != poles]


def _poles(poles: Sequence[Any]) -> str:
    """Return poles in a few letters, each conjugate pair once."""
    upper = [pole for pole in poles if not isinstance(pole, list) or pole[1] > 0]
    return ", ".join(f"{p[0]:.3g}±{p[1]:.3g}i" if isinstance(p, list) else f"{p:.3g}" for p in upper)


def _front(data: Mapping[str, Any]) -> list[str]:
    """Return the lines of the tunings that none other surpasses in all terms of the cost."""
    front, cost = data["front"], data["cost"]
    names = [name for name in front[0] if name in cost["weights"] or name in cost["limits"]]
    places = sorted({round(k * (len(front) - 1) / (SHOWN - 1)) for k in range(SHOWN)})
    rows = [tuple(f"{front[place][name]:.4g}" for name in (*names, "cost")) for place in places]
    said = f"{len(front)} tunings that none other surpasses in every term" + (
        f", {len(rows)} of them" if len(rows) < len(front) else ""
    )
    return [said, "", *_table([(*names, "cost"), *rows]), ""] if len(names) > 1 else []


def _table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]

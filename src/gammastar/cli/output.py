"""What the verbs print on stdout: text for people, or one JSON object for programs."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, TextIO, cast

from gammastar.cli.process import note

HIDDEN = (
    "mission",
    "message",
    "certificate",
    "versions",
)  # of a flight's table: they stand around it, or in the JSON object only
OFTEN_LIMITED = 0.1  # of a flight; those that settle from upside down are below
MARKS = {"holds": "green", "definition": "green", "misprint": "yellow", "false": "yellow", "failed": "bold red"}


class OutputError(Exception):
    """Stdout cannot be written; `cause` says why."""

    def __init__(self, cause: OSError) -> None:
        super().__init__(str(cause))
        self.cause = cause


@contextmanager
def reported() -> Iterator[None]:
    """Let whatever a block prints on stdout fail as `OutputError`: libraries that print, such as help, explain other errors themselves.

    Raises:
        OutputError: Nobody receives it.
    """
    with redirect_stdout(cast(TextIO, _Reported(sys.stdout))):
        yield


class _Reported:
    """A stream that raises `OutputError` where another raises `OSError`."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, words: str) -> int:
        try:
            return self._stream.write(words)
        except OSError as error:
            raise OutputError(error) from error

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            raise OutputError(error) from error


def text(words: str, end: str = "\n") -> None:
    """Print plain text on stdout."""
    print(words, end=end, flush=True)


def json_object(values: Mapping[str, Any]) -> None:
    """Print one JSON object on stdout."""
    from gammastar.report.folder import to_json

    text(to_json(values), end="")


def flight(summary: Mapping[str, Any], files: Sequence[Path], as_json: bool) -> None:
    """Print a flight: title, numbers, where the files are, and how it ended."""
    if as_json:
        json_object({**summary, "files": [str(file) for file in files]})
    else:
        _flight_as_text(summary, files)
    if summary["status"] != "completed":
        note(f"the flight ended at {summary['end_time_s']:g} s: {summary['message']}")


def _flight_as_text(summary: Mapping[str, Any], files: Sequence[Path]) -> None:
    from gammastar.flight import Summary

    numbers = Summary({key: value for key, value in summary.items() if key not in HIDDEN})
    lines = [str(summary["mission"]), "", str(numbers), ""]
    if files:
        lines += [f"wrote {files[0].parent}: {', '.join(file.name for file in files)}", ""]
    if summary["status"] == "completed":
        lines.append(f"{summary['end_time_s']:g} s: {summary['message']}{_unsettled(summary)}")
    text("\n".join(lines))


def _unsettled(summary: Mapping[str, Any]) -> str:
    """Return how far a flight that did not settle is from its path, and what to change where its rotors could not follow."""
    if summary["settled"]:
        return ""
    limited = sum(summary.get("autopilot", {}).get("given_up_share", {}).values())
    words = f", not settled: {summary['distance_m']['rms_last_quarter']:.3g} m from the path in the last quarter (RMS)"
    if limited > OFTEN_LIMITED:
        words += f"; rotors at their limits in {limited:.0%} of the flight: lower the speed, or slow the poles or the observers"
    return words


def certificate(data: Mapping[str, Any], table: str, files: Sequence[Path], as_json: bool) -> None:
    """Print a certificate: title, table, why not if so, and where the files are."""
    if as_json:
        json_object({**data, "files": [str(file) for file in files]})
        return
    wrote = [f"wrote {', '.join(str(file) for file in files)}"] if files else []
    text("\n".join([str(data["mission"]), "", table, *wrote]))


def no_certificate(reason: str, as_json: bool) -> None:
    """Print why a path is refused before there is anything to certify."""
    if as_json:
        json_object({"flyable": False, "reasons": [reason], "files": []})
    else:
        text(f"not flyable: {reason}")


def export(facts: Mapping[str, Any], folder: Path, as_json: bool) -> None:
    """Print what an export is and where it is."""
    if as_json:
        json_object({**facts, "folder": str(folder), "files": [str(folder / file) for file in facts["files"]]})
        return
    lines = [
        str(facts["mission"]),
        "",
        f"{facts['target']}, {facts['real']}: {facts['operations']} operations every {facts['interval_s']:g} s ({facts['rate_Hz']:g} Hz), "
        f"state {facts['state_bytes']} bytes, tables {facts['table_bytes']} bytes",
        f"wrote {folder}: {', '.join(facts['files'])}",
    ]
    text("\n".join(lines))


def study(found: Mapping[str, Any], words: str, files: Sequence[Path], as_json: bool) -> None:
    """Print what a campaign teaches, and where the page is that shows it."""
    if as_json:
        json_object({**found, "files": [str(file) for file in files]})
        return
    drawn = len({file.stem for file in files if file.suffix == ".png"})
    others = [file.name for file in files if file.suffix not in (".png", ".svg")]
    wrote = ["", f"wrote {files[0].parent}: {', '.join(others)} and {drawn} figures"] if files else []
    text("\n".join([words, *wrote]))


def campaign(facts: Mapping[str, Any], as_json: bool) -> None:
    """Print how many flights of a campaign there are, how many settled, what this run did, and how to go on."""
    if as_json:
        json_object(facts)
        return
    from gammastar.campaign.rate import percent

    share, low, high = map(percent, (facts["share"], *facts["interval"]))
    lines = [
        str(facts["mission"]),
        "",
        f"{facts['flights']} flights, {facts['successes']} settled: {share}, and between {low} and {high} of all such flights do "
        "(95 % confidence)",
    ]
    lines += [f"{each['flights']} did not: {each['cause']}" for each in facts["causes"]]
    if facts["rows_written"]:
        lines.append(
            f"flew {facts['rows_written']} in {facts['wall_time_s']:.3g} s, {facts['flights_per_s']:.3g} flights/s and "
            f"{facts['steps_per_s']:.3g} steps/s, by {facts['machine']}"
        )
    text("\n".join([*lines, f"wrote {facts['out']}; see gammastar study {facts['out']}"]))


def missions(titles: Mapping[str, str], as_json: bool) -> None:
    """Print names and titles of missions."""
    if as_json:
        json_object({"missions": [{"name": name, "title": title} for name, title in titles.items()]})
        return
    width = max(map(len, titles))
    text("\n".join(f"{name:<{width}}  {title}" for name, title in titles.items()))


def vehicles(rows: Sequence[Mapping[str, Any]], as_json: bool) -> None:
    """Print what vehicles weigh and can do; a dash where a number is not known or has no meaning."""
    if as_json:
        json_object({"vehicles": list(rows)})
        return
    head = ("name", "mass [kg]", "inertia [kg m^2]", "rotors", "thrust to weight", "hover throttle", "source")
    lines = [head]
    for row in rows:
        inertia = ", ".join(f"{moment:.3g}" for moment in row["inertia_kg_m2"])
        shares = ("-" if row[key] is None else f"{row[key]:.3g}" for key in ("thrust_to_weight", "hover_throttle"))
        lines.append((row["name"], f"{row['mass_kg']:g}", inertia, str(row["rotors"] or "-"), *shares, row["source"]))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    text("\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines))


def reproduction(numbers: Mapping[str, Any], index: Path, as_json: bool) -> None:
    """Print how many of the paper's messages hold, and where the page is that shows why."""
    if as_json:
        json_object(numbers)
        return
    verdicts = Counter(figure["verdict"] for figure in numbers["figures"])
    said = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common())
    text(
        f"{len(numbers['figures'])} figures of section VI, flown again; of what the paper says of them: {said}\nwrote {index}"
    )


def claims(results: Sequence[Mapping[str, Any]], as_json: bool) -> None:
    """Print the verdict on every claim, in the order of the paper."""
    counts = {verdict: sum(result["verdict"] == verdict for result in results) for verdict in MARKS}
    if as_json:
        json_object({"claims": list(results), "verdicts": counts})
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table("claim", "verdict", "what the paper states, what was found, and how", show_lines=True)
    for result in results:
        words = Text.assemble(
            (result["statement"], "bold"), f"\n{result['evidence']}", (f" [{result['method']}]", "dim")
        )
        if result["correction"]:
            words.append(f"\nread instead: {result['correction']}")
        claim = Text.assemble(result["key"], (f"\n{result['where']}", "dim"))
        table.add_row(claim, Text(result["verdict"], style=MARKS[result["verdict"]]), words)
    console = Console()
    with console.capture() as capture:
        console.print(table)
        console.print(", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count), highlight=False)
    text(capture.get(), end="")

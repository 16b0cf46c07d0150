"""The phases of a flight in figures: one for every path that it followed."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from gammastar.figures import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gammastar.flight import FlightRecord
    from gammastar.flight.phases import Phase


def flown_phases(record: FlightRecord) -> list[tuple[Phase, slice]]:
    """Return the phases of a record with their rows; one that ended before its first row is left out."""
    rows = itertools.pairwise([*(phase.row for phase in record.phases), len(record.time)])
    return [(phase, slice(*each)) for phase, each in zip(record.phases, rows, strict=True) if each[0] < each[1]]


def target_names(record: FlightRecord) -> list[str]:
    """Return what the path of each phase is called in a legend."""
    _, *later = (record.time[rows.start] for _, rows in flown_phases(record))
    return ["target at first", *(f"target from {time:.4g} s" for time in later)] if later else ["target"]


def mark_replacements(axis: Axes, record: FlightRecord, named: bool = False) -> None:
    """Draw a thin line where the path was replaced, into a panel over time."""
    for k, (_, rows) in enumerate(flown_phases(record)[1:]):
        name = "path replaced" if named and k == 0 else None
        axis.axvline(record.time[rows.start], color=style.FAINT, linewidth=style.THIN, label=name, zorder=1)

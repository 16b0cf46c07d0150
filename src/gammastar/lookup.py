"""Numbers looked up beside a graph: the coefficients of a segment, of a path through waypoints or of a reference over time.

A table is data.  Every machine that runs a graph reads it in its own way, and all agree on what stands in `Table`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.checks import shortened
from gammastar.errors import InputError, ShapeError


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of numbers, each of which holds from its begin on; the first one also before, the last one for good.

    With a period the variable is first taken back by whole periods n, and `shifts` n is added to the row.

    Raises:
        ShapeError: There is not one begin for each row, or not one shift for each of its numbers.
        InputError: Begins do not grow, or the period is not positive.
    """

    begins: np.ndarray  # (m,) growing, in units of the variable
    rows: np.ndarray  # (m, width)
    period: float | None = None
    shifts: Any = None  # (width,), what a period adds; nothing when left out

    def __post_init__(self) -> None:
        begins, rows = np.asarray(self.begins, dtype=float), np.asarray(self.rows, dtype=float)
        width = rows.shape[-1] if rows.ndim else 0
        shifts = np.zeros(width) if self.shifts is None else np.asarray(self.shifts, dtype=float)
        if rows.ndim != 2 or not len(rows) or begins.shape != rows.shape[:1] or shifts.shape != (width,):
            raise ShapeError(
                f"a table must have a begin for each row and a shift for each column (got begins {begins.shape}, rows {rows.shape} and "
                f"shifts {shifts.shape}); give (m,), (m, width) and (width,)"
            )
        if not np.all(begins[:-1] <= begins[1:]) or np.isnan(begins[0]):
            raise InputError(
                f"begins of a table must grow (got {shortened(begins.tolist())}); sort them with their rows"
            )
        if self.period is not None and not 0 < self.period < np.inf:
            raise InputError(
                f"period of a table must be positive (got {self.period}); leave it out where nothing repeats"
            )
        for name, values in (("begins", begins), ("rows", rows), ("shifts", shifts)):
            object.__setattr__(self, name, values)

    @property
    def width(self) -> int:
        """Return how many numbers a row has."""
        return int(np.shape(self.rows)[1])

    def at(self, values: np.ndarray) -> np.ndarray:
        """Return the rows (width, n) at values (n,) of the variable."""
        if self.period is None:
            return np.asarray(self.rows[self._index(values)].T)
        whole = np.floor((values - self.begins[0]) / self.period)
        return np.asarray(
            self.rows[self._index(values - whole * self.period)].T + np.multiply.outer(self.shifts, whole)
        )

    def graph(self, value: Any) -> Any:
        """Graph (MX): return the row (width,) at a value of the variable, from a table bound as a constant."""
        whole = ca.MX(0) if self.period is None else ca.floor((value - self.begins[0]) / self.period)
        index = ca.low(ca.DM(np.append(self.begins, np.inf)), value - whole * (self.period or 0.0))
        row = ca.MX(ca.DM(self.rows.T))[:, index]
        return row if self.period is None else row + whole * ca.DM(self.shifts)

    def _index(self, values: np.ndarray) -> np.ndarray:
        return np.clip(np.searchsorted(self.begins, values, side="right") - 1, 0, len(self.begins) - 1)


class Lookup(NamedTuple):
    """A table, and where to look in it: `variable(key, rows)`, from what is known and the rows looked up before, one below the other.

    What is known is a path's parameter, a time, or a whole step's inputs; the variable is written so that it takes graphs and arrays.
    """

    table: Any  # Table; in a step that many flights take also a sequence of them, of one width and one for each flight
    variable: Callable[[Any, Any], Any]

    def within(self, key: Callable[[Any, Any], Any], before: int) -> Lookup:
        """Return the same lookup as one of several: its key comes from what is known and all rows, `before` of which are not its own."""
        return Lookup(self.table, lambda known, rows: self.variable(key(known, rows), rows[before:]))


def the_key(key: Any, rows: Any) -> Any:
    """Graph or numbers: return the key, where a table is looked up at what is known."""
    return key


def numbers_at(lookups: Sequence[Lookup], keys: np.ndarray) -> np.ndarray:
    """Return the rows (w, n) of all lookups, one below the other, for keys (n,)."""
    rows = np.empty((0, len(keys)))
    for lookup in lookups:
        rows = np.vstack([rows, lookup.table.at(lookup.variable(keys, rows))])
    return rows


def graph_at(lookups: Sequence[Lookup], key: Any) -> Any:
    """Graph (MX): return the rows (w,) of all lookups, one below the other."""
    rows = ca.MX(0, 1)
    for lookup in lookups:
        rows = ca.vertcat(rows, lookup.table.graph(lookup.variable(key, rows)))
    return rows

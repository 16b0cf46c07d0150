"""A function of one variable in polynomial pieces, as data beside a graph: the schedule of a reference, or a speed over a path.

The graph evaluates two neighbouring pieces that reach it as numbers, and takes the later one from where it begins.  Which two they
are is looked up outside the graph, once a step, so one compiled law serves every schedule, however many pieces it has, and
within a step a joint is met exactly.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar.lookup import Table
from gammastar.taylor import Series

DEGREE = 8
ROW = DEGREE + 2  # numbers of a piece: where it begins, and its coefficients
DATA_SIZE = 2 * ROW


@dataclass(frozen=True, eq=False)
class Piecewise:
    """Pieces of degree eight; the first one also holds before it begins, the last one for good."""

    begins: np.ndarray  # (m,) growing, in units of the variable
    coefficients: np.ndarray  # (m, up to 9) of the powers 0, 1, ... of the variable less the begin
    period: float | None = None  # after which the pieces come again
    backwards: bool = (
        False  # whether the variable falls: the neighbour that goes with a piece is then the one before it
    )

    def __post_init__(self) -> None:
        begins, coefficients = np.asarray(self.begins, dtype=float), np.asarray(self.coefficients, dtype=float)
        missing = DEGREE + 1 - coefficients.shape[1]
        object.__setattr__(self, "begins", begins)
        object.__setattr__(self, "coefficients", np.pad(coefficients, ((0, 0), (0, missing))))

    @property
    def rows(self) -> np.ndarray:
        """Return (m, 20): every piece with the one that follows it; the last one of a periodic function is followed by the first."""
        rows = np.column_stack([self.begins, self.coefficients])
        last = rows[:1] + self.period * np.eye(1, ROW) if self.period else rows[-1:]
        return np.hstack([rows, np.concatenate([rows[1:], last])])

    @functools.cached_property
    def table(self) -> Table:
        """Return the pieces as a table of their data (20,), which is what the graph needs at a value of the variable."""
        rows = self.rows
        shifts = (self.period or 0.0) * (np.eye(1, 2 * ROW)[0] + np.eye(1, 2 * ROW, ROW)[0])
        if self.backwards:
            first = rows[-1:] - shifts if self.period else rows[:1]
            rows = np.concatenate([first, rows[:-1]])
        return Table(self.begins, rows, self.period, shifts)

    def data(self, values: np.ndarray) -> np.ndarray:
        """Return the data (20, n) that the graph needs at values (n,) of the variable."""
        return self.table.at(values)

    def moved(self, by: float) -> Piecewise:
        """Return the same function later in its variable."""
        return Piecewise(self.begins + by, self.coefficients, self.period, self.backwards)

    def values(self, variables: np.ndarray, derivative: int = 0) -> np.ndarray:
        """Return the function or a derivative of it, (n,), at values (n,) of the variable."""
        data = self.data(np.asarray(variables, dtype=float))
        power = np.arange(derivative, DEGREE + 1)
        factors = np.prod([power - k for k in range(derivative)], axis=0) if derivative else np.ones(len(power))
        data = np.where(variables >= data[ROW], data[ROW:], data[:ROW])
        steps = (variables - data[0])[:, None] ** (power - derivative)
        return np.asarray(np.sum(steps * factors * data[1 + power].T, axis=1))


def evaluated(data: Any, variable: Series) -> Series:
    """Graph: return the series of the function along a series of its variable, from its data SX (20,) there."""
    later = variable.coefficients[0] >= data[ROW]
    row = [ca.if_else(later, data[ROW + k], data[k]) for k in range(ROW)]
    step = variable - Series.constant(row[0], variable.order)
    result = Series.constant(row[-1], variable.order)
    for coefficient in reversed(row[1:-1]):
        result = result * step + Series.constant(coefficient, variable.order)
    return result

"""Emitted Python on NumPy's arrays: all flights take a step together.

It needs no compiler, and is a check of the other machines that shares nothing with them but the graph.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from gammastar.engine.batch import Batch, Progress
from gammastar.engine.python_source import python_source
from gammastar.engine.step import Step
from gammastar.engine.tape import Tape, tape_of
from gammastar.engine.virtual import observed
from gammastar.lookup import Table

Function = Callable[..., tuple[np.ndarray, ...]]


class Arrays:
    """Flies steps as emitted Python."""

    def __init__(self, step: Step) -> None:
        self.step = step
        self.core = _function(tape_of(step.core, (0,)))
        self.variables = [_function(tape_of(each)) for each in step.variables()]

    def fly(self, batch: Batch, workers: int, tell: Progress) -> np.ndarray:
        """Return the final states (n, flights); workers make no difference."""
        ends = batch.starts.copy()
        for k, (flying, states) in enumerate(self._flown(batch)):
            ends[:, flying] = states
            ended = batch.flights - int(batch.going(ends).sum())
            tell((k + 1) * (batch.flights - ended) + batch.steps * ended)
        tell(batch.steps * batch.flights)
        return ends

    def stretch(self, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (n, steps) after each step of one flight, and its observations (k, steps)."""
        states = np.array([state[:, 0] for _, state in self._flown(batch)]).reshape(-1, batch.starts.shape[0]).T
        return states, observed(self.step, batch, states)

    def _flown(self, batch: Batch) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield after each step the places of the flights that went on (m,), and their states (n, m)."""
        flying, states = np.arange(batch.flights), batch.starts
        for k in range(batch.first, batch.first + batch.steps):
            going = batch.going(states)
            flying, states = flying[going], states[:, going]
            if not len(flying):
                return
            inputs = states, batch.parameters[:, flying], batch.columns(k, 1)[:, 0, flying]
            with np.errstate(all="ignore"):
                (states,) = self.core(np, *inputs, self._rows(flying, *inputs))
            yield flying, states

    def _rows(self, flying: np.ndarray, *inputs: np.ndarray) -> np.ndarray:
        """Return what the flights (m,) look up (w, m)."""
        rows = np.empty((0, len(flying)))
        for lookup, variable in zip(self.step.lookups, self.variables, strict=True):
            (values,) = variable(np, *inputs, rows)
            rows = np.vstack([rows, _at(lookup.table, flying, values[0])])
        return rows


def _at(tables: Any, flying: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the rows (w, m) of one table for all flights, or of one for each."""
    if isinstance(tables, Table):
        return tables.at(values)
    columns = [tables[flight].at(values[k : k + 1]) for k, flight in enumerate(flying)]
    return np.hstack(columns)


def _function(tape: Tape) -> Function:
    space: dict[str, Any] = {}
    exec(compile(python_source(tape), "<emitted>", "exec"), space)
    found: Function = space["step"]
    return found

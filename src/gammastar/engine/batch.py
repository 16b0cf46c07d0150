"""Flights of one step, side by side: what every machine is given, checked once."""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import shortened
from gammastar.engine.random import checked_flights, checked_seed, uniforms
from gammastar.engine.step import Step, tables_of
from gammastar.errors import InputError, ShapeError
from gammastar.lookup import Table

MOST_STEPS = 2**53  # beyond, the number of a step is no double
Progress = Callable[[int], None]  # called with the number of steps done so far


@dataclass(frozen=True, eq=False)
class Batch:
    """Starts of a step with the rest that their flights depend on."""

    step: Step
    starts: np.ndarray  # (n, flights)
    steps: int  # to be flown
    first: int  # number of the first step
    seed: int  # of the random numbers
    numbers: np.ndarray  # (flights,) of the flights: keys of their random numbers, uint64
    parameters: np.ndarray  # (p, flights)

    @property
    def flights(self) -> int:
        """Return how many flights there are."""
        return int(self.starts.shape[1])

    def alone(self, flight: int) -> Batch:
        """Return a batch of one of the flights."""
        one = slice(flight, flight + 1)
        return dataclasses.replace(
            self,
            step=self.step.of(flight),
            starts=self.starts[:, one],
            numbers=self.numbers[one],
            parameters=self.parameters[:, one],
        )

    def later(self, starts: np.ndarray, done: int, steps: int) -> Batch:
        """Return the batch that goes on from states (n, flights) after some steps, for a number of steps."""
        return dataclasses.replace(self, starts=starts, first=self.first + done, steps=steps)

    def columns(self, first: int, count: int) -> np.ndarray:
        """Return the columns (1 + 2 c, count, flights) of steps: their numbers and their random numbers."""
        steps = np.arange(first, first + count)
        drawn = uniforms(self.seed, self.numbers, steps, self.step.channels)
        return np.concatenate([np.broadcast_to(steps[:, None], (1, count, self.flights)), drawn])

    def going(self, states: np.ndarray) -> np.ndarray:
        """Return which of states (n, ...) belong to flights that go on, as truths (...); NaN for a status does not."""
        status = self.step.status
        return np.ones(states.shape[1:], dtype=bool) if status is None else np.asarray(states[status] == 0)


def batch(
    step: Step,
    starts: ArrayLike,
    steps: int,
    first: int,
    seed: int,
    flights: Sequence[int] | np.ndarray | None,
    parameters: ArrayLike | None,
) -> Batch:
    """Return flights from starts (n, flights), or raise `InputError`; parameters are (p,) or (p, flights), and flights count from zero."""
    states = np.array(_numbers(starts, "starts"), ndmin=2)
    if states.ndim != 2 or states.shape[0] != step.size:
        raise ShapeError(f"starts must be ({step.size}, flights) (got {np.shape(starts)}); give a column a flight")
    count, size = states.shape[1], int(step.core.numel_in(1))
    numbers = checked_flights(flights, count)
    told = np.empty(0) if parameters is None else _numbers(parameters, "parameters")
    given = told[:, None] if told.ndim == 1 else told
    if given.shape not in ((size, 1), (size, count)):
        raise ShapeError(
            f"parameters must be ({size},) or ({size}, {count}) (got {told.shape}); give them for all flights or for each"
        )
    begin, count_of_steps = _whole(first, "first"), _whole(steps, "steps")
    if begin + count_of_steps > MOST_STEPS:
        raise InputError(
            f"first and steps must be at most 2^53 together (got {shortened(first)} and {shortened(steps)}); take fewer"
        )
    for lookup in step.lookups:
        if not isinstance(lookup.table, Table) and len(lookup.table) != count:
            raise ShapeError(
                f"tables must be one for all flights or {count} (got {len(lookup.table)}); give one a start"
            )
        if len({table.width for table in tables_of(lookup)}) > 1:
            raise ShapeError("tables of flights must have rows of one width (got several); fill the narrow ones up")
    return Batch(
        step,
        states,
        count_of_steps,
        begin,
        checked_seed(seed),
        numbers.astype(np.uint64),
        np.array(np.broadcast_to(given, (size, count))),
    )


def _numbers(values: ArrayLike, name: str) -> np.ndarray:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{name} must be numbers in columns (got {shortened(values)}); give numbers alone") from error


def _whole(value: Any, name: str) -> int:
    try:
        found = operator.index(value)
    except TypeError:
        found = -1
    if found < 0:
        raise InputError(f"{name} must be a whole number from zero (got {shortened(value)}); count intervals")
    return found

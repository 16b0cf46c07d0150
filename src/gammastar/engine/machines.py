"""Machines by name: how the flights of a step are flown, many at once for their ends, or one with its record."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import whole
from gammastar.engine.arrays import Arrays
from gammastar.engine.batch import Batch, Progress, batch
from gammastar.engine.native import Native
from gammastar.engine.step import Step
from gammastar.engine.virtual import CHUNK, Virtual
from gammastar.errors import CompilerError, MachineWarning, ShapeError, UnknownNameError

Stop = Callable[[np.ndarray, np.ndarray], int | None]


class Machine(Protocol):
    """What flies the step that it was made for."""

    def fly(self, batch: Batch, workers: int, tell: Progress) -> np.ndarray:
        """Return the final states (n, flights)."""

    def stretch(self, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (n, steps) after each step of one flight and its observations (k, steps), both up to its end."""


KINDS: dict[str, Callable[[Step], Machine]] = {"casadi": Virtual, "native": Native, "python": Arrays}
AUTO = "auto"


def run(
    step: Step,
    starts: ArrayLike,
    steps: int,
    *,
    seed: int = 0,
    flights: Sequence[int] | np.ndarray | None = None,
    parameters: ArrayLike | None = None,
    first: int = 0,
    machine: str = AUTO,
    workers: int | None = None,
    progress: Progress | None = None,
) -> np.ndarray:
    """Return the final states (n, flights) of flights from starts (n, flights); memory does not grow with the steps.

    A flight ends after its steps, or with the step that sets its status.  What it becomes depends on the step, its start, its parameters,
    the seed and its number, and, on one machine, to the last bit on nothing else.

    Args:
        step: What is flown.
        starts: A column a flight.
        steps: How many each flight takes at most.
        seed: Of the random numbers.
        flights: Numbers of the flights, which their random numbers go with; counted from zero when left out.
        parameters: (p,) for all flights, or (p, flights).
        first: Number of the first step, for flights that go on.
        machine: 'casadi', 'native', 'python', or 'auto': native, or casadi with a warning where no compiler answers.
        workers: Threads of the native machine; as many as there are processors for this process when left out.
        progress: Called with the number of steps done so far, in all flights; one that has ended counts as all of its steps.
    """
    given = batch(step, starts, steps, first, seed, flights, parameters)
    threads = processors() if workers is None else whole(workers, "workers", 1)
    return machine_of(machine, step).fly(given, threads, progress or _nothing)


def trace(
    step: Step,
    start: ArrayLike,
    steps: int,
    *,
    seed: int = 0,
    flight: int = 0,
    parameters: ArrayLike | None = None,
    first: int = 0,
    machine: str = AUTO,
    stop: Stop | None = None,
    progress: Progress | None = None,
    chunk: int = CHUNK,
) -> tuple[np.ndarray, np.ndarray]:
    """Return every state (n, steps + 1) and observation (k, steps) of one flight, the same bits as `run` on that machine.

    Args:
        step: What is flown.
        start: (n,).
        steps: How many at most.
        seed: Of the random numbers.
        flight: Its number, which its random numbers go with.
        parameters: (p,).
        first: Number of the first step.
        machine: As for `run`.
        stop: Given the states after and observations of a chunk, return how many of its steps to keep, or None to go on.
        progress: Called with the number of steps done so far.
        chunk: Steps between two looks; fewer when a step is long, so that an interruption is heard soon.
    """
    if np.ndim(start) != 1:
        raise ShapeError(f"start must be ({step.size},) (got {np.shape(start)}); give the state of one flight")
    whole = batch(step, np.asarray(start)[:, None], steps, first, seed, [flight], parameters)
    flying, done = machine_of(machine, step), 0
    states, observations = [whole.starts], [np.empty((step.core.numel_out(1), 0))]
    while done < whole.steps and whole.going(states[-1][:, -1]):
        count = min(chunk, whole.steps - done)
        after, observed = flying.stretch(whole.later(states[-1][:, -1:], done, count))
        kept = stop(after, observed) if stop is not None else None
        states.append(after[:, :kept])
        observations.append(observed[:, :kept])
        if kept is not None:
            break
        done += count
        if progress is not None:
            progress(done)
    return np.hstack(states), np.hstack(observations)


def machine_of(name: str, step: Step) -> Machine:
    """Return the machine of a name for a step; see `run`."""
    if name not in (AUTO, *KINDS):
        raise UnknownNameError("machine", name, (AUTO, *KINDS))
    try:
        return KINDS["native" if name == AUTO else name](step)
    except CompilerError as error:
        if name != AUTO:
            raise
        warnings.warn(
            f"CasADi's machine flies, some hundred times slower than native: {error}", MachineWarning, stacklevel=3
        )
        return Virtual(step)


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _nothing(done: Any) -> None:
    pass

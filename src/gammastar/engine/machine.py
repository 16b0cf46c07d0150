"""Evaluate a step graph many times in a row on CasADi's virtual machine: no compiler, starts at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

CHUNK = 500  # steps between two looks at the results; a look costs little, a longer chunk is computed past an early end


def scan(
    step: Any,
    state: np.ndarray,
    exogenous: Callable[[int, int], np.ndarray],
    steps: int,
    stop: Callable[[np.ndarray, np.ndarray], int | None] | None = None,
    progress: Callable[[int], None] | None = None,
    chunk: int = CHUNK,
) -> tuple[np.ndarray, np.ndarray]:
    """Run (state, exogenous column) -> (next state, observation) over a number of steps.

    Args:
        step: CasADi function of two inputs and two outputs.
        state: (n,) start.
        exogenous: Given a first step and the one after the last, returns their columns (m, count).
        steps: How many.
        stop: Given the states after and observations of a chunk, return how many of its steps to keep, or None to go
            on.
        progress: Called with the number of steps done so far.
        chunk: Steps between two looks; fewer when a step is long, so that an interruption is heard soon.

    Returns:
        States (n, steps + 1) with the start first, and observations (k, steps times the columns of one observation);
        both end early when `stop` says so.
    """
    states, observations, done = [np.asarray(state, dtype=float)[:, None]], [], 0
    runs: dict[int, Any] = {}
    while done < steps:
        count = min(chunk, steps - done)
        if count not in runs:
            runs[count] = step.mapaccum("run", count)
        columns = exogenous(done, done + count)
        # .full(): NumPy's own conversion turns a Ctrl-C that arrives inside it into a SystemError
        after, observed = (value.full() for value in runs[count](states[-1][:, -1], columns))
        kept = stop(after, observed) if stop is not None else None
        if kept is not None:
            states.append(after[:, :kept])
            observations.append(observed[:, : kept * (observed.shape[1] // count)])
            break
        states.append(after)
        observations.append(observed)
        done += count
        if progress is not None:
            progress(done)
    return np.hstack(states), np.hstack(observations) if observations else np.empty((step.size1_out(1), 0))

"""CasADi's virtual machine: no compiler, starts at once, one flight after the other."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from gammastar.engine.batch import Batch, Progress
from gammastar.engine.step import Step

CHUNK = 500  # steps between two looks at what has come out; a look costs little, and what lies beyond an end is computed in vain


class Virtual:
    """Flies steps as CasADi evaluates their graphs."""

    def __init__(self, step: Step) -> None:
        self.step = step
        self._several = functools.lru_cache(4)(lambda graph, count: graph.mapaccum("run", count))

    def fly(self, batch: Batch, workers: int, tell: Progress) -> np.ndarray:
        """Return the final states (n, flights); workers make no difference."""
        ends, done, shared = batch.starts.copy(), 0, self.step.without_observation()
        one = shared.graph() if shared.is_shared else None
        for flight in range(batch.flights):
            alone = batch.alone(flight)
            graph = one or shared.of(flight).graph()
            for begin in range(0, batch.steps, CHUNK):
                count = min(CHUNK, batch.steps - begin)
                if not batch.going(ends[:, flight]):
                    break
                states, _ = self._flown(graph, alone.later(ends[:, flight, None], begin, count))
                ends[:, flight] = states[:, -1]
                tell(done + begin + count)
            done += batch.steps
            tell(done)
        return ends

    def stretch(self, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (n, steps) after each step of one flight, and its observations (k, steps)."""
        return self._flown(self._graph, batch)

    @functools.cached_property
    def _graph(self) -> Any:
        return self.step.of(0).graph()

    def _flown(self, graph: Any, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Return states and observations of one flight up to its end."""
        columns = batch.columns(batch.first, batch.steps)[:, :, 0]
        given = np.repeat(batch.parameters, batch.steps, axis=1)
        # .full(): NumPy's own conversion turns a Ctrl-C that arrives inside it into a SystemError
        results = self._several(graph, batch.steps)(batch.starts[:, 0], given, columns)
        states, observations = (each.full() for each in results)
        ended = np.flatnonzero(~batch.going(states))
        kept = ended[0] + 1 if len(ended) else batch.steps
        return states[:, :kept], observations[:, :kept]


def scan(
    function: Any, state: np.ndarray, exogenous: Callable[[int, int], np.ndarray], steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Run a function (state, column) -> (next state, observation) over columns that are known, as the law's closed form is.

    Args:
        function: CasADi function.
        state: (n,) start.
        exogenous: Given a first step and the one after the last, returns their columns (m, count).
        steps: How many.

    Returns:
        States (n, steps + 1) with the start first, and observations (k, steps times the columns of one observation).
    """
    several = functools.cache(lambda count: function.mapaccum("run", count))
    states, observations = [np.asarray(state, dtype=float)[:, None]], [np.empty((function.size1_out(1), 0))]
    for done in range(0, steps, CHUNK):
        count = min(CHUNK, steps - done)
        after, observed = several(count)(states[-1][:, -1], exogenous(done, done + count))
        states.append(after.full())
        observations.append(observed.full())
    return np.hstack(states), np.hstack(observations)


def observed(step: Step, batch: Batch, states: np.ndarray) -> np.ndarray:
    """Return the observations (k, steps) of one flight whose states (n, steps) after each step are known."""
    before = np.hstack([batch.starts, states])[:, :-1]
    count = states.shape[1]
    if count == 0:
        return np.empty((step.core.numel_out(1), 0))
    given = np.repeat(batch.parameters, count, axis=1)
    return np.asarray(step.of(0).graph()(before, given, batch.columns(batch.first, count)[:, :, 0])[1].full())

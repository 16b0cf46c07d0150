"""The search for the least of a function that is only told by flying: the evolution strategy CMA-ES of N. Hansen, by his library.

It needs no derivatives, takes ranks alone, so no scale of costs matters, and learns which coordinates go together.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from gammastar.errors import MissingExtraError


def search(
    evaluate: Callable[[np.ndarray], np.ndarray],
    low: np.ndarray,
    high: np.ndarray,
    evaluations: int,
    seed: int,
) -> None:
    """Call `evaluate` with points (n, d), which returns values (n,), until it has had as many points as asked for.

    It begins at zero with steps of one.  When a run has converged, another begins at the best point found, with twice as many points
    at a time.  Same seed and values, same points.

    Args:
        evaluate: The function to be minimised; it keeps what it wants to remember.
        low: (d,) ends of the coordinates, zero or below.
        high: (d,), zero or above.
        evaluations: How many points in all.
        seed: Of the strategy.

    Raises:
        MissingExtraError: The library is not installed.
    """
    cma = library()
    random, best, least = np.random.default_rng([seed, len(low)]), np.zeros(len(low)), np.inf
    done, size = 0, None
    while done < evaluations:
        options = {
            "bounds": [low, high],
            "randn": lambda *shape: random.standard_normal(shape),
            "seed": np.nan,  # the global generator of NumPy is left alone
            "verbose": -10,
            "verb_log": 0,
            **({} if size is None else {"popsize": size}),
        }
        with warnings.catch_warnings():  # its advice is on the shape of other problems
            warnings.simplefilter("ignore")
            strategy = cma.CMAEvolutionStrategy(best, 1.0, options)
            size = strategy.popsize
            while done < evaluations and not strategy.stop():
                points = np.array(strategy.ask())[: evaluations - done]
                values = np.asarray(evaluate(points))
                done += len(points)
                if values.min() < least:
                    least, best = float(values.min()), points[values.argmin()]
                if len(points) == size:
                    strategy.tell(list(points), values.tolist())
        size *= 2


def library() -> Any:
    """Return the library of CMA-ES, or raise `MissingExtraError`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import cma
    except ImportError as error:
        raise MissingExtraError("cma", "campaign", "tuning") from error
    return cma

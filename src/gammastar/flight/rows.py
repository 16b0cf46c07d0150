"""What a row of a flight tells, and from columns of a trace to rows of a record."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gammastar.path import ParametricPath, Path
from gammastar.vehicle import StateGraph


class RowGraph(NamedTuple):
    """Graph: what is told of one row, of the true vehicle."""

    state: StateGraph
    torque: Any  # SX (3,) [N m], body
    parameter: Any  # SX, of the point of the path truly nearest
    waiting: Any  # SX, 1 while a target waits
    given_up: Any  # SX, the most important thing that limits took, by its number in `AutopilotRows`
    focal_margin: Any  # SX


def normal_rows(path: Path, parameters: np.ndarray, transverse: np.ndarray) -> np.ndarray:
    """Return the components (n, 2, 4) of transverse outputs (n, 4 times their rows), at path parameters (n,)."""
    rows = len(parameters)
    if not rows:
        return np.empty((0, 2, 4))
    return path.normal_components(parameters, transverse.reshape(rows, 4, path.components).swapaxes(1, 2))


def nearest_distances(path: Path, positions: np.ndarray, parameters: np.ndarray, waiting: np.ndarray) -> np.ndarray:
    """Return the distances (n,) [m] of positions (n, 3) to a path, followed along it from parameters (n,).

    Where a target waits no foot is followed, and the whole path is searched.
    """
    with np.errstate(over="ignore"):  # the last row of a flight that ran away may be that far
        distance = path.distances(positions, parameters) if len(parameters) else np.empty(0)
        if waiting.any():
            assert isinstance(path, ParametricPath)
            distance[waiting] = np.minimum(distance[waiting], path.global_distances(positions[waiting]))
    return distance

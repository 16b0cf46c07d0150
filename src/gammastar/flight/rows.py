"""From columns of a scan to rows of a record."""

from __future__ import annotations

import numpy as np

from gammastar.path import ParametricPath, Path


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

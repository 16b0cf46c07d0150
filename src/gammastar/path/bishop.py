"""Rotation-minimising (Bishop) frames: the normals in which transverse vectors become two plain scalar chains.

The law never needs them; records and the oracle do, to show and predict components.
Source: R. L. Bishop, There is more than one way to frame a curve, Amer. Math. Monthly 82 (1975).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

TOLERANCE = 1e-12  # relative and absolute, of the transport; far below the flights it is compared with


def transported_normals(
    tangent_and_rate: Callable[[float], tuple[np.ndarray, np.ndarray]],
    parameters: np.ndarray,
    tangents: np.ndarray,
    reference: float,
) -> np.ndarray:
    """Return normal frames (n, 3, 2) at parameters (n,), transported along the curve from the parameter `reference`.

    A normal n moves by n' = -<n, t'> t; both start in `initial_normals` at the reference.

    Args:
        tangent_and_rate: Unit tangent (3,) and its derivative with respect to the parameter.
        parameters: (n,) where the frames are wanted, in any order.
        tangents: (n, 3) unit tangents there.
        reference: Where the transport starts.
    """
    from scipy.integrate import solve_ivp

    def transport(parameter: float, first: np.ndarray) -> np.ndarray:
        tangent, turning = tangent_and_rate(parameter)
        return np.asarray(-(first @ turning) * tangent)

    first = initial_normals(tangent_and_rate(reference)[0])[:, 0]
    unique, places = np.unique(parameters, return_inverse=True)
    normals = np.empty((len(unique), 3))
    for side in (unique >= reference, unique < reference):
        if not side.any():
            continue
        targets = unique[side] if unique[side][0] >= reference else unique[side][::-1]
        solution = (
            solve_ivp(transport, (reference, targets[-1]), first, "DOP853", targets, rtol=TOLERANCE, atol=TOLERANCE)
            if targets[-1] != reference
            else None
        )
        values = np.tile(first, (len(targets), 1)) if solution is None else solution.y.T
        normals[side] = values if unique[side][0] >= reference else values[::-1]
    normals = normals[places]
    normals -= np.sum(normals * tangents, axis=1, keepdims=True) * tangents
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.stack([normals, np.cross(normals, tangents)], axis=-1)


def initial_normals(tangent: np.ndarray) -> np.ndarray:
    """Return two unit normals (3, 2) of a unit tangent (3,): the second points down as far as it can."""
    down = np.array([0.0, 0.0, 1.0]) if abs(tangent[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    second = down - tangent * (tangent @ down)
    second /= np.linalg.norm(second)
    return np.column_stack([np.cross(tangent, second), second])

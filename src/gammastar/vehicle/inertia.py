"""What resists being moved: the inertia about the centre of mass, and fluid that moves along."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import magnitude, magnitudes, shape_of, shortened
from gammastar.errors import InputError, ShapeError

MEASURED = 0.02  # relative: by so much moments that were measured one by one may miss the triangle inequality


def inertia_matrix(inertia: ArrayLike) -> np.ndarray:
    """Return a symmetric positive definite (3, 3) inertia from three moments or a matrix, or raise."""
    shape = shape_of(inertia)
    if shape is None or shape not in {(3,), (3, 3)}:
        got = "rows of different lengths" if shape is None else f"shape {shape}"
        raise ShapeError(f"inertia [kg m^2] must be 3 moments or a 3x3 matrix (got {got}); give one of the two")
    given = magnitudes(inertia, "inertia [kg m^2]", shape)
    matrix = np.diag(given) if shape == (3,) else given
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12 * np.abs(matrix).max()):
        raise InputError(
            "inertia [kg m^2] must be symmetric (got different entries across the diagonal); check the signs"
        )
    moments = np.linalg.eigvalsh(matrix)
    if moments[0] <= 0:
        raise InputError(
            f"inertia [kg m^2] must be positive definite (got principal moments {moments.tolist()}); check the diagonal"
        )
    magnitude(moments[0], "the least moment of the inertia [kg m^2]", above=0)
    if moments[2] > (moments[0] + moments[1]) * (1 + MEASURED):
        raise InputError(
            f"inertia [kg m^2] must satisfy the triangle inequality (got principal moments {moments.tolist()}); "
            "no body has a moment larger than the sum of the other two"
        )
    matrix = (matrix + matrix.T) / 2
    matrix.setflags(write=False)
    return matrix


def isotropic(added_mass: Any) -> float:
    """Return the added mass [kg] as one number, or raise."""
    shape = shape_of(added_mass)
    if shape != ():
        raise InputError(
            f"the added mass [kg] must be one number, the same in all directions (got {shortened(added_mass)}); unequal ones bring the "
            "body rates into the force (Coriolis terms), and the vehicle leaves the class: give their mean and say so"
        )
    return magnitude(added_mass, "added mass [kg]", at_least=0)

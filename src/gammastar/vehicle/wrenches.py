"""What a set of rotors can give: wrenches (thrust, torque) that fill a zonotope, cut out of space by known slabs.

Rotor thrusts f between lowest and highest are middle + half u with |u_i| <= 1.  The wrenches mixer f then fill a zonotope about
mixer middle, and it is the intersection of the slabs |n . (wrench - mixer middle)| <= sum_i |n . column_i| half_i, where n is
normal to three columns of the mixer (Ziegler, Lectures on Polytopes, Lecture 7).  The normals depend on the mixer alone, so limits
that change in flight need no new geometry.  Where a direction of the wrench may be given up, the set is projected along it, and
the normals are those to that direction and one column fewer.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

SMALL = 1e-8  # sine of an angle below which directions count as parallel: the root of the rounding error
DIGITS = 14  # after the point, of numbers near one
UNBOUNDED = 1e30  # end of an interval that has none


def normals(columns: np.ndarray, given_up: Sequence[np.ndarray] = ()) -> np.ndarray:
    """Return the unit normals (k, 4) of the slabs of a zonotope, projected along what may be given up.

    Args:
        columns: (4, n) of the mixer, rows scaled to similar size.
        given_up: Directions (4,) of the wrench, at most two.
    """
    found = _crosses([(*given_up, *chosen) for chosen in itertools.combinations(_units(columns), 3 - len(given_up))])
    lengths = np.linalg.norm(found, axis=1)
    found = found[lengths > SMALL] / lengths[lengths > SMALL, None]
    leading = found[np.arange(len(found)), np.argmax(np.abs(found) > SMALL, axis=1)]
    _, first = np.unique(np.round(found * np.sign(leading)[:, None], 9), axis=0, return_index=True)
    return without_dust(found[np.sort(first)])


def slabs_across(
    direction: Any, columns: np.ndarray, half: Any, given_up: Sequence[np.ndarray] = ()
) -> tuple[Any, Any]:
    """Graph: return normals SX (k, 4) as `normals` does, with a direction that may be given up as well, and half the widths SX (k,).

    The normals are not of unit length: the generalised cross product is linear in the direction.  A direction that is given up only so
    far adds its own segment to the set, whose slabs are then these and those of `normals`; it adds nothing to the width of these.

    Args:
        direction: SX (4,).
        columns: (4, n) of the mixer, rows scaled to similar size.
        half: SX (n,), the largest coefficients of the columns.
        given_up: Directions (4,) of the wrench, at most one fewer than of `normals`.
    """
    fixed = [(*given_up, *chosen) for chosen in itertools.combinations(_units(columns), 2 - len(given_up))]
    by_axis = np.stack([without_dust(_crosses([(*pair, axis) for pair in fixed])) for axis in np.eye(4)])
    across = {
        row: ca.fabs(ca.dot(ca.DM(row), direction)) for row in map(_facing, np.reshape(by_axis @ columns, (4, -1)).T)
    }

    def width(k: int) -> Any:
        return sum(across[_facing(by_axis[:, k] @ column)] * half[i] for i, column in enumerate(columns.T))

    slab_normals = sum((ca.DM(by_axis[k]) * direction[k] for k in range(4)), ca.SX(len(fixed), 4))
    return slab_normals, ca.vertcat(*(width(k) for k in range(len(fixed))))


def interval(
    slab_normals: Any, radius: Any, offset: Any, slope: Any, within: tuple[Any, Any] = (-UNBOUNDED, UNBOUNDED)
) -> tuple[Any, Any]:
    """Graph: return least and greatest x with offset + slope x inside every slab; the least is the greater one when there is none.

    Args:
        slab_normals: SX (k, 4) or numbers, of unit length or shorter.
        radius: SX (k,), half the width of each slab in units of its normal.
        offset: SX (4,) from the middle of the set.
        slope: SX (4,); slabs along it say nothing about x.
        within: Ends that x has already.
    """
    here, change = ca.mtimes(slab_normals, offset), ca.mtimes(slab_normals, slope)
    counts = change**2 > SMALL**2 * ca.sumsqr(slope)
    least, most = (ca.SX(end) for end in within)
    for k in range(change.numel()):
        middle, reach = -here[k] / change[k], radius[k] / ca.fabs(change[k])  # infinite where they do not count
        least, most = (
            ca.if_else(counts[k], ca.fmax(least, middle - reach), least),
            ca.if_else(counts[k], ca.fmin(most, middle + reach), most),
        )
    return least, most


def radius(slab_normals: Any, columns: Any, half: Any) -> Any:
    """Graph: return half the widths SX (k,) of slabs about columns (4, n) with coefficients up to half SX (n,)."""
    across = ca.mtimes(slab_normals, columns)
    return ca.mtimes(ca.fabs(ca.DM(without_dust(across)) if isinstance(across, ca.DM) else across), half)


def clipped(value: Any, ends: tuple[Any, Any]) -> Any:
    """Graph: return a value cut to an interval."""
    return ca.fmin(ca.fmax(value, ends[0]), ends[1])


def without_dust(matrix: Any) -> np.ndarray:
    """Return a matrix of numbers near one without their rounding errors: zeros are zero, equal numbers equal, and graphs shorter."""
    return np.asarray(np.round(np.asarray(matrix, dtype=float), DIGITS) + 0.0)


def _facing(row: np.ndarray) -> tuple[float, ...]:
    """Return a row, without rounding errors, or its opposite: the one whose first entry beside zeros is positive."""
    clean = without_dust(row)
    leading = clean[np.flatnonzero(clean)[:1]].sum()
    return tuple((clean * np.sign(leading) + 0.0).tolist())


def _units(columns: np.ndarray) -> list[np.ndarray]:
    return list((columns / np.linalg.norm(columns, axis=0)).T)


def _crosses(triples: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """Return the generalised cross products (k, 4) of triples of vectors (4,): normal to all three, zero if they are dependent."""
    rows = np.array(triples, dtype=float).reshape(-1, 3, 4)
    minors = [np.linalg.det(np.delete(rows, k, axis=2)) * (-1) ** k for k in range(4)]
    return np.column_stack(minors)

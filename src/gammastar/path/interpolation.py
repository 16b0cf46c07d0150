"""Waypoints joined by the curve of least snap: the interpolating spline of degree 7, natural at open ends.

Among all curves through the waypoints at given parameters, it minimises the integral of the squared fourth derivative.
Its fourth derivative is a cubic spline: sigma'''' = sum_j gamma_j N_j with the cubic B-splines N_j on the waypoints'
parameters (inside an open path, so that the derivatives 4, 5, 6 vanish at its ends; all the way round on a closed one).
By the Peano kernel of divided differences, f[l_i, ..., l_(i+4)] (l_(i+4) - l_i) = (1/6) integral of N_i f'''', so

    G gamma = 6 D,   G_ij = integral of N_i N_j,   D_i = f[l_(i+1), ..., l_(i+4)] - f[l_i, ..., l_(i+3)].

G is banded, and up to the scale of its rows its condition number has a bound that no spacing of the waypoints changes;
the usual system for the coefficients of the spline itself has none, and loses half the digits of the snap on 300
waypoints.  Continuity of the derivatives 4, 5, 6 holds by construction.  The lower ones follow from four waypoints at
a time, through which sigma minus the fourfold integral of sigma'''' is a cubic polynomial.

Source: C. de Boor, A Practical Guide to Splines, revised ed., Springer 2001, chapters IX, XIII; I. J. Schoenberg, Spline
interpolation and the higher derivatives, Proc. Nat. Acad. Sci. USA 51 (1964).
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gammastar.errors import InputError, PathError, ShapeError, UnknownNameError
from gammastar.path.spline import DEGREE, Spline

SPACINGS = ("chord", "centripetal")
NEIGHBOURS = 4  # waypoints that settle the derivatives 1, 2, 3 at one of them
FARTHEST = 1e12  # [m] from the origin, a slip beyond
EQUAL = 1e-9  # of the whole length: neighbouring waypoints this near to each other are one
STANDSTILL = 1e-6  # of the mean speed of the parameter: slower is a cusp
CONTINUOUS = 1e-6  # relative, of jumps that rounding may leave before the waypoints are refused
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact up to degree 7; products of two cubics have degree 6
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2  # on the unit interval


def interpolated(
    waypoints: ArrayLike, closed: bool = False, spacing: Literal["chord", "centripetal"] = "chord"
) -> Spline:
    """Return the C^6 spline of least snap through waypoints, each reached at the length of the polygon up to it.

    Two waypoints give a straight line, three a parabola, four a cubic: the polynomial of least degree, without snap.  A
    closed path returns from the last waypoint to the first, which is not repeated.

    Args:
        waypoints: (n, 3) [m], world; n >= 2, on a closed path n >= 3.
        closed: Return to the first waypoint, with all derivatives.
        spacing: How far the parameter runs between two waypoints.  'chord': their distance, so that |sigma'| stays near 1
            and the parameter near the arc length, and an evenly flown curve is reproduced best.  'centripetal': as the root
            of the distance (with the same sum); where distances differ a hundredfold it swings out far less, at the price of
            sharper bends, almost cusps, at the short ones.

    Raises:
        ShapeError: Not n rows of three numbers, or too few of them.
        InputError: A number is not finite.
        PathError: Two neighbours are equal, the curve would turn on the spot, or distances differ too much for a smooth
            curve in double precision; with the indices, counted from zero.
    """
    if spacing not in SPACINGS:
        raise UnknownNameError("spacing", spacing, SPACINGS)
    points = _checked(waypoints, closed)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    steps = chords if spacing == "chord" else np.sqrt(chords) * (chords.sum() / np.sqrt(chords).sum())
    knots = np.concatenate([[0.0], np.cumsum(steps)])
    spline = Spline(knots, _coefficients(knots, points, closed), closed)
    parameter, speed = spline.slowest()
    if speed <= STANDSTILL:
        first = int(spline.segments(parameter)[0][0])
        raise PathError(
            f"the curve through the waypoints must not stand still (got zero speed between waypoints[{first}] and waypoints"
            f"[{(first + 1) % (len(points) - closed)}]); it turns on the spot there, add a waypoint beside the way back"
        )
    if spline.jumps().max() > CONTINUOUS:
        worst = int(np.argmin(chords))
        raise PathError(
            f"waypoints must be spaced evenly enough for a smooth curve (got distances from {chords.min():.3g} m after "
            f"waypoints[{worst}] to {chords.max():.3g} m); remove or add waypoints"
        )
    return spline


def _checked(waypoints: ArrayLike, closed: bool) -> np.ndarray:
    """Return the points (n, 3) of an open path, or (n+1, 3) of a closed one with the first repeated."""
    try:
        points = np.array(waypoints, dtype=float)
    except (TypeError, ValueError) as error:
        raise ShapeError(
            "waypoints must be n rows of three numbers (got rows of other things); correct them"
        ) from error
    least = 3 if closed else 2
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < least:
        kind = "closed" if closed else "open"
        raise ShapeError(
            f"waypoints must be at least {least} rows of three numbers for a path that is {kind} (got shape {points.shape}); "
            "add or correct rows"
        )
    for k in np.flatnonzero(~(np.abs(points) <= FARTHEST).all(axis=1)):
        raise InputError(f"waypoints[{k}] must be finite, within {FARTHEST:g} m (got {points[k].tolist()}); correct it")
    if closed:
        points = np.vstack([points, points[:1]])
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    for k in np.flatnonzero(chords <= EQUAL * chords.sum()):
        back = closed and k == len(chords) - 1
        remedy = "leave out the last, a closed path returns by itself" if back else "remove one of them"
        raise PathError(
            f"neighbouring waypoints must differ (got {points[k].tolist()} at waypoints[{k}] and waypoints[{0 if back else k + 1}], "
            f"{chords[k]:.3g} m apart); {remedy}"
        )
    return points


def _coefficients(knots: np.ndarray, points: np.ndarray, closed: bool) -> np.ndarray:
    """Return the coefficients (m, 3, 8) of the spline of least snap through points (m+1, 3) at knots (m+1,)."""
    steps = np.diff(knots)
    count = len(steps)
    snap = _snap(knots, points, closed)
    result = np.zeros((count, 3, DEGREE + 1))
    for k in range(4):
        result[:, :, 4 + k] = snap(knots[:-1], nu=k) / math.factorial(4 + k)
    if closed:
        knots, points, first = *_continued(knots, points, 3), np.arange(count) + 2
    else:
        first = np.clip(np.arange(count) - 1, 0, max(count + 1 - NEIGHBOURS, 0))
    window = first[:, None] + np.arange(min(NEIGHBOURS, len(knots)))
    start = np.arange(count) + (3 if closed else 0)
    offsets = knots[window] - knots[start, None]
    cubic = points[window] - points[start, None] - _integrated(snap, knots[window], knots[start], closed)
    fractions = offsets / steps[:, None]
    lower = np.linalg.solve(fractions[:, :, None] ** np.arange(window.shape[1]), cubic)
    lower /= steps[:, None, None] ** np.arange(window.shape[1])[:, None]
    result[:, :, : window.shape[1]] = np.swapaxes(lower, 1, 2)
    result[:, :, 0] = points[start]
    return result


def _snap(knots: np.ndarray, points: np.ndarray, closed: bool) -> Any:
    """Return the fourth derivative, a cubic `scipy.interpolate.BSpline` of three components."""
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_matrix, diags
    from scipy.sparse.linalg import spsolve

    steps = np.diff(knots)
    total = len(knots) + 2  # cubic B-splines that reach into the interval
    if closed:
        padded, around = _continued(knots, points, 3)
        unknowns = len(steps)
        moments = 6 * np.diff(_third_differences(padded, around), axis=0)[:unknowns]
        places = np.arange(total), np.arange(total) % unknowns
    else:
        padded = np.concatenate(
            [knots[0] - steps[0] * np.arange(3, 0, -1), knots, knots[-1] + steps[-1] * np.arange(1, 4)]
        )
        unknowns = max(len(knots) - 4, 0)
        if unknowns == 0:
            return BSpline(padded, np.zeros((total, 3)), 3)
        moments = 6 * np.diff(_third_differences(knots, points), axis=0)
        places = np.arange(unknowns) + 3, np.arange(unknowns)
    chosen = csr_matrix((np.ones(len(places[0])), places), shape=(total, unknowns))
    nodes, weights = _nodes(knots)
    basis = BSpline.design_matrix(nodes.ravel(), padded, 3) @ chosen
    gram = (basis.T @ diags(weights.ravel()) @ basis).tocsc()
    return BSpline(padded, chosen @ spsolve(gram, moments), 3)


def _integrated(snap: Any, ends: np.ndarray, starts: np.ndarray, closed: bool) -> np.ndarray:
    """Return the fourfold integrals (m, q, 3) of the snap from knots (m,) to windows of q knots around them (m, q).

    integral from l_0 to l of (l - t)^3 / 6 sigma''''(t) dt, exact by Gauss nodes in each segment between the knots.
    """
    nodes, weights = _nodes(ends)
    nodes, weights = nodes.reshape(len(ends), -1), weights.reshape(len(ends), -1)
    from_start, from_end = nodes[:, None] - starts[:, None, None], nodes[:, None] - ends[:, :, None]
    between = np.where((from_start > 0) & (from_end < 0), 1.0, 0.0) - np.where(
        (from_start < 0) & (from_end > 0), 1.0, 0.0
    )
    kernel = between * (-from_end) ** 3 / 6 * weights[:, None]
    low, high = snap.t[3], snap.t[-4]
    values = snap(low + np.mod(nodes - low, high - low) if closed else nodes)
    return np.asarray(np.einsum("mqt,mtc->mqc", kernel, values))


def _nodes(knots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss nodes and weights (..., m, 4) of the segments between knots (..., m+1)."""
    steps = np.diff(knots)[..., None]
    return knots[..., :-1, None] + steps * NODES, steps * WEIGHTS


def _third_differences(knots: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the third divided differences (n-3, 3)."""
    for k in (1, 2, 3):
        points = np.diff(points, axis=0) / (knots[k:] - knots[:-k])[:, None]
    return points


def _continued(knots: np.ndarray, points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return knots and points of a closed path, continued by some on both sides."""
    turns, places = np.divmod(np.arange(-count, len(knots) + count), len(knots) - 1)
    return knots[places] + turns * (knots[-1] - knots[0]), points[places]

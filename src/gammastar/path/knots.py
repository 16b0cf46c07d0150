"""Closed paths with crossings in plan, knotted or not; every one is kept apart in the third dimension, so it is embedded.

They stand about the origin, upright; `placement.placed` puts them where they are flown.
"""

from __future__ import annotations

import functools
import math
from itertools import combinations
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array, magnitude, magnitudes, number
from gammastar.errors import InputError, PathError, UnknownNameError
from gammastar.path.curve import Curve
from gammastar.path.placement import FULL_TURN

MOST_WAVES = 1000  # in one period, a slip beyond
TOUCHING = 1e-9  # of half a turn: phases this near to a crossing are refused as one


def lemniscate(size: float = 2.5, separation: float = 1.0, kind: Literal["closed", "rising"] = "closed") -> Curve:
    """Return (2 A cos a, A sin 2a, z): the figure eight of Gerono, its two branches kept apart where they cross in plan.

    In the plane the eight meets itself at a = pi/2 and 3 pi/2, and no law could tell the branches apart there.  Closed,
    it gets a wave z = (d/2) sin a, and passes the crossing d/2 below its plane first and d/2 above it then.  Rising, it climbs
    by d from one passage to the next, z = -d a / pi, and is open.  The parameter a is an angle [rad]; at zero the eight is
    at its far end on the first axis and runs towards the second.

    Source: Path-Flyer flies it with A = 2.5 m, flat, or rising with z = a + 3 (upwards), a separation of pi metres.

    Args:
        size: A [m]; the eight is 4 A long and 2 A wide.
        separation: d [m], the vertical distance of the branches at the crossing.
        kind: 'closed', or 'rising'.
    """
    size, separation = magnitude(size, "size [m]", above=0), magnitude(separation, "separation [m]", above=0)
    if kind not in {"closed", "rising"}:
        raise UnknownNameError("kind", kind, ("closed", "rising"))

    point = functools.partial(_eight, size, separation, kind)
    if kind == "rising":
        return Curve(point, name="lemniscate", domain=(0.0, 2 * FULL_TURN))
    return Curve(point, period=FULL_TURN, name="lemniscate")


def lissajous(
    amplitudes: ArrayLike = (2.0, 2.0, 1.0),
    frequencies: ArrayLike = (1, 2, 3),
    phases: ArrayLike = (90.0, 90.0, 0.0),
) -> Curve:
    """Return the curve with coordinates A_i cos(n_i a + p_i): one oscillation for each axis, by the angle a [rad].

    It is embedded if and only if its frequencies have no common factor in pairs and, for each axis k with n_k > 1, the
    other two phases are out of step: (n_j p_i - n_i p_j) / pi is no whole number.  For a + b and a - b give the same
    coordinate i when n_i b or n_i a + p_i is a multiple of pi: a common factor of two axes gives a b that serves both,
    and phases in step an a that does, and in either case the third axis is served by a choice of the other.  What fails is
    refused with the axes; how far apart the branches are is for the certificate.

    Source: Bogle, Hearst, Jones, Stoilov, Lissajous knots, J. Knot Theory Ramifications 3 (1994).

    Args:
        amplitudes: (3,) A_i [m], positive.
        frequencies: (3,) n_i, whole and positive.
        phases: (3,) p_i [deg].

    Raises:
        PathError: The curve meets itself, or runs back along itself.
    """
    sizes = magnitudes(amplitudes, "amplitudes [m]", (3,))
    for size in sizes:
        magnitude(size, "amplitude [m]", above=0)
    counts = [
        _whole(number(count, "frequency", above=0), "frequency") for count in array(frequencies, "frequencies", (3,))
    ]
    if max(counts) > MOST_WAVES:
        raise InputError(f"a frequency must be at most {MOST_WAVES} (got {max(counts):.4g}); lower it")
    lags = array(phases, "phases [deg]", (3,))
    aligned = []
    for i, j in combinations(range(3), 2):
        k, names = 3 - i - j, f"{'xyz'[i]} and {'xyz'[j]}"
        if math.gcd(counts[i], counts[j]) > 1:
            raise PathError(
                f"the frequencies of {names} must have no common factor (got {counts[i]} and {counts[j]}); "
                "the curve would meet itself, change one of them"
            )
        step = (counts[j] * (lags[i] % 360) - counts[i] * (lags[j] % 360)) / 180
        aligned.append(abs(step - round(step)) <= TOUCHING)
        if aligned[-1] and counts[k] > 1:
            raise PathError(
                f"the phases of {names} must be out of step (got {lags[i]:g} and {lags[j]:g} deg at frequencies {counts[i]} "
                f"and {counts[j]}); the curve would meet itself, change one of them"
            )
    if all(aligned):
        raise PathError(
            f"the phases must be out of step (got {lags.tolist()} deg); the curve would run back along itself"
        )
    turns = np.radians(lags)
    return Curve(
        functools.partial(_oscillations, sizes, counts, turns),
        period=FULL_TURN,
        name="lissajous",
    )


def viviani(radius: float = 2.0, separation: float = 1.0) -> Curve:
    """Return rho (cos^2 a, cos a sin a, sin a) with rho = r + (d/2) cos a: Viviani's curve, opened where it meets itself.

    With d = 0 it is where a sphere of radius r meets the cylinder over half its radius, and goes twice through its
    point on the first axis, at a = 0 and pi.  The sphere's radius is therefore made to vary by d over the curve, which parts the two
    passages by d and nothing else meets: directions from the centre are those of Viviani's curve.  The
    parameter a [rad] is longitude and latitude in one (latitude towards down).

    Source: V. Viviani, 1692; as the Clelia curve of equal angles, e.g. A. Gray, Modern Differential Geometry.

    Args:
        radius: r [m].
        separation: d [m], positive and below 2 r.
    """
    radius, separation = magnitude(radius, "radius [m]", above=0), magnitude(separation, "separation [m]", above=0)
    if separation >= 2 * radius:
        raise InputError(
            f"separation must stay below twice the radius (got {separation:g} m at a radius of {radius:g} m); lower it"
        )

    return Curve(functools.partial(_window, radius, separation), period=FULL_TURN, name="viviani")


def trefoil(radius: float = 3.0, height: float = 1.0) -> Curve:
    """Return (r/3 (sin a + 2 sin 2a), r/3 (cos a - 2 cos 2a), -h sin 3a): the simplest knot, by the angle a [rad].

    Source: the usual parameterisation; the same knot as `torus_knot` of 2 and 3 or its mirror image, in a rounder shape.

    Args:
        radius: r [m], of its three lobes in plan.
        height: h [m], of the wave that parts the strands; negative gives the mirror image, zero is refused.
    """
    third, height = magnitude(radius, "radius [m]", above=0) / 3, magnitude(height, "height [m]")
    if height == 0:
        magnitude(abs(height), "height [m] (as a magnitude)", above=0)
    return Curve(
        functools.partial(_three_lobes, third, height),
        period=FULL_TURN,
        name="trefoil",
    )


def torus_knot(p: int = 2, q: int = 3, radius: float = 2.0, tube: float = 0.75) -> Curve:
    """Return ((R + r cos qa) cos pa, (R + r cos qa) sin pa, r sin qa): p turns about the axis, q about the tube.

    It is knotted when neither p nor q is 1.  The parameter a is an angle [rad] that runs once round the whole knot, right-handed
    about the third axis (down) for positive p.

    Source: standard, e.g. D. Rolfsen, Knots and Links, 1976.

    Args:
        p: Turns about the axis; not zero, negative runs the other way.
        q: Turns about the tube, without a factor in common with p; of the other sign, the mirror image.
        radius: R [m], of the circle in the middle of the tube.
        tube: r [m], of the tube; below R.
    """
    p, q = _whole(p, "p"), _whole(q, "q")
    if math.gcd(p, q) != 1:
        raise PathError(
            f"p and q must have no common factor (got {p} and {q}); the knot would be run through more than once"
        )
    radius, tube = magnitude(radius, "radius [m]", above=0), magnitude(tube, "tube [m]", above=0)
    if tube >= radius:
        raise InputError(f"tube must stay below the radius (got {tube:g} m at a radius of {radius:g} m); lower it")

    return Curve(functools.partial(_on_torus, p, q, radius, tube), period=FULL_TURN, name="torus knot")


def _whole(value: object, name: str) -> int:
    """Return a whole number other than zero."""
    result = number(value, name)
    if result != round(result) or result == 0:
        raise InputError(f"{name} must be a whole number other than zero (got {result:g}); correct it")
    return int(result)


def _eight(size: float, separation: float, kind: str, angle: Any) -> tuple[Any, Any, Any]:
    depth = separation / 2 * ca.sin(angle) if kind == "closed" else -separation / np.pi * angle
    return 2 * size * ca.cos(angle), size * ca.sin(2 * angle), depth


def _oscillations(sizes: np.ndarray, counts: list[int], phases: np.ndarray, angle: Any) -> tuple[Any, ...]:
    return tuple(sizes[i] * ca.cos(counts[i] * angle + phases[i]) for i in range(3))


def _window(radius: float, separation: float, angle: Any) -> tuple[Any, Any, Any]:
    cosine, sine = ca.cos(angle), ca.sin(angle)
    reach = radius + separation / 2 * cosine
    return reach * cosine * cosine, reach * cosine * sine, reach * sine


def _three_lobes(third: float, height: float, angle: Any) -> tuple[Any, Any, Any]:
    return (
        third * (ca.sin(angle) + 2 * ca.sin(2 * angle)),
        third * (ca.cos(angle) - 2 * ca.cos(2 * angle)),
        -height * ca.sin(3 * angle),
    )


def _on_torus(p: int, q: int, radius: float, tube: float, angle: Any) -> tuple[Any, Any, Any]:
    reach = radius + tube * ca.cos(q * angle)
    return reach * ca.cos(p * angle), reach * ca.sin(p * angle), tube * ca.sin(q * angle)

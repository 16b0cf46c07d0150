"""Open paths: lines and what waves, winds or runs along them; placed by `placement.placed` where nothing else is said."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any, cast

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array, direction, magnitude, magnitudes
from gammastar.errors import InputError, ShapeError
from gammastar.path.curve import Curve
from gammastar.path.placement import DOWN, FULL_TURN, Placement, plane_frame


def line(point: ArrayLike = (0.0, 0.0, 0.0), along: ArrayLike = (1.0, 0.0, 0.0)) -> Curve:
    """Return a straight line through a point (3,) [m] along a direction; its parameter is the distance from the point [m]."""
    start, tangent = magnitudes(point, "point [m]", (3,)), direction(along, "along")
    normal = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
    normal /= np.linalg.norm(normal)
    place = Placement(start, np.column_stack([tangent, np.cross(normal, tangent), normal]))
    return Curve(functools.partial(_straight, place), name="line", plane_normal=tuple(normal))


def helix(
    radius: float = 1.0, pitch: float = 1.0, center: ArrayLike = (0.0, 0.0, 0.0), axis: ArrayLike = DOWN
) -> Curve:
    """Return a helix, open at both ends; its parameter is the angle [rad], right-handed about `axis`.

    Args:
        radius: [m].
        pitch: Rise along the axis in one turn [m]; negative winds the other way, zero is refused (it would run into
            itself).
        center: (3,) [m], world: a point of the axis, level with angle zero.
        axis: (3,) direction, world.
    """
    radius, pitch = magnitude(radius, "radius [m]", above=0), magnitude(pitch, "pitch [m]")
    if pitch == 0:
        magnitude(abs(pitch), "pitch [m] (as a magnitude)", above=0)
    place = Placement(magnitudes(center, "center [m]", (3,)), plane_frame(axis))
    rise = pitch / FULL_TURN
    return Curve(
        functools.partial(_screw, place, radius, rise),
        name="helix",
        domain=(-2 * FULL_TURN, 2 * FULL_TURN),
    )


def sine(amplitude: float = 1.0, wavelength: float = 6.0) -> Curve:
    """Return (l, A sin(2 pi l / L), 0): a wave in the horizontal plane about the first axis, towards its positive end.

    The parameter l is the distance along the axis [m], not along the wave.  An amplitude of zero is refused: that is
    a `line`.

    Args:
        amplitude: [m]; negative begins towards the negative second axis.
        wavelength: [m].
    """
    amplitude, wavelength = magnitude(amplitude, "amplitude [m]"), magnitude(wavelength, "wavelength [m]", above=0)
    if amplitude == 0:
        magnitude(abs(amplitude), "amplitude [m] (as a magnitude)", above=0)
    wave_number = FULL_TURN / wavelength
    return Curve(
        functools.partial(_wave, amplitude, wave_number),
        name="sine",
        plane_normal=DOWN,
        domain=(-2 * wavelength, 2 * wavelength),
    )


def spiral(spacing: float = 1.0, turns: float = 3.0, rise: float = 0.0) -> Curve:
    """Return (c a cos a, c a sin a, -rise a / 2 pi) with c = spacing / 2 pi: the spiral of Archimedes, from its centre.

    Its parameter is the angle a [rad], right-handed about the third axis (down), from zero.  It is regular at the
    centre, where it leaves along the first axis.  It begins there: at negative angles it would be the mirror image,
    which a flat one meets again on the second axis.

    Source: flown by Path-Flyer as (.5 A a cos a, ...), A = 1.25 m, a spacing of pi A; the defaults are chosen by us.

    Args:
        spacing: Between neighbouring turns [m].
        turns: How many of them there are; any positive number.
        rise: Upwards in one turn [m]; negative sinks, zero is flat.
    """
    growth = magnitude(spacing, "spacing [m]", above=0) / FULL_TURN
    end = magnitude(turns, "turns", above=0) * FULL_TURN
    climb = magnitude(rise, "rise [m]") / FULL_TURN
    return Curve(
        functools.partial(_winding, growth, climb),
        name="spiral",
        plane_normal=DOWN if climb == 0 else None,
        domain=(0.0, end),
    )


def polynomial(coefficients: ArrayLike, domain: ArrayLike = (0.0, 1.0)) -> Curve:
    """Return the curve whose coordinates are polynomials of its parameter, e.g. one piece of a planned trajectory.

    Args:
        coefficients: One row for each of x, y, z [m], ascending: (c0, c1, c2, ...) is c0 + c1 l + c2 l^2 + ...; rows may
            differ in length.
        domain: (2,) from where to where the parameter l runs [of any unit; m where c1 has length one].

    Raises:
        ShapeError: There are not three rows of numbers, or a row is empty.
    """
    try:
        rows = [np.array(row, dtype=float).reshape(-1) for row in cast(Iterable[Any], coefficients)]
    except (TypeError, ValueError) as error:
        raise ShapeError(
            f"coefficients must be three rows of numbers (got {coefficients!r}); give one row an axis"
        ) from error
    if len(rows) != 3 or min(row.size for row in rows) == 0:
        raise ShapeError(
            f"coefficients must be three rows of at least one number (got {[row.size for row in rows]} numbers); "
            "give one row an axis, [0] for none"
        )
    for axis, row in zip("xyz", rows, strict=True):
        if not np.all(np.isfinite(row)):
            raise InputError(
                f"the coefficients of {axis} must be finite (got {row.tolist()}); replace NaN and infinity"
            )

    low, high = array(domain, "domain", (2,))
    return Curve(
        functools.partial(_polynomials, rows),
        name="polynomial",
        domain=(float(low), float(high)),
    )


def _straight(place: Placement, distance: Any) -> Any:
    return place.vector((distance, 0, 0))


def _screw(place: Placement, radius: float, rise: float, angle: Any) -> Any:
    return place.vector((radius * ca.cos(angle), radius * ca.sin(angle), rise * angle))


def _wave(amplitude: float, wave_number: float, distance: Any) -> tuple[Any, Any, Any]:
    return distance, amplitude * ca.sin(wave_number * distance), 0


def _winding(growth: float, climb: float, angle: Any) -> tuple[Any, Any, Any]:
    return growth * angle * ca.cos(angle), growth * angle * ca.sin(angle), -climb * angle


def _polynomials(rows: list[np.ndarray], parameter: Any) -> tuple[Any, ...]:
    """Graph: return the value of each row's polynomial, by Horner's rule."""
    values = []
    for row in rows:
        value = ca.SX(float(row[-1]))
        for coefficient in row[-2::-1]:
            value = value * parameter + float(coefficient)
        values.append(value)
    return tuple(values)

"""Circles and what is nearly one: closed paths by the angle about a centre."""

from __future__ import annotations

import functools
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import magnitude, magnitudes, number
from gammastar.errors import UnknownNameError
from gammastar.path.curve import Curve
from gammastar.path.implicit import ImplicitPath
from gammastar.path.placement import DOWN, FULL_TURN, Placement, plane_frame


def circle(
    radius: float = 1.0,
    center: ArrayLike = (0.0, 0.0, 0.0),
    normal: ArrayLike = DOWN,
    kind: Literal["curve", "implicit"] = "curve",
    coordinates: Literal["distance", "quadratic"] = "distance",
) -> Curve | ImplicitPath:
    """Return a circle; its parameter is the angle [rad], right-handed about `normal`.

    About the default normal (down) it is atan2(y, x), as in the paper.

    Args:
        radius: [m].
        center: (3,) [m], world.
        normal: (3,) direction of the axis, world; any length.
        kind: 'curve', or 'implicit' with the functions of the paper.
        coordinates: Of the implicit kind: s1 is 'distance' r - radius, or 'quadratic' r^2 - radius^2 as printed in
            section VI.
    """
    if kind not in {"curve", "implicit"}:
        raise UnknownNameError("kind", kind, ("curve", "implicit"))
    if coordinates not in {"distance", "quadratic"}:
        raise UnknownNameError("coordinates", coordinates, ("distance", "quadratic"))
    radius = magnitude(radius, "radius [m]", above=0)
    place = Placement(magnitudes(center, "center [m]", (3,)), plane_frame(normal))
    if kind == "curve":
        return _round("circle", radius, radius, place)

    return ImplicitPath(
        functools.partial(_across, place, radius, coordinates),
        functools.partial(_height, place),
        functools.partial(_angle, place),
        seed=tuple(place.points([(radius, 0, 0)])[0]),
        period=FULL_TURN,
        name="circle",
    )


def ellipse(semi_axes: ArrayLike = (2.0, 1.0), center: ArrayLike = (0.0, 0.0, 0.0), normal: ArrayLike = DOWN) -> Curve:
    """Return an ellipse with semi-axes (a, b) [m] by eccentric angle [rad], right-handed about `normal`."""
    a, b = (magnitude(axis, "semi-axis [m]", above=0) for axis in magnitudes(semi_axes, "semi_axes [m]", (2,)))
    return _round("ellipse", a, b, Placement(magnitudes(center, "center [m]", (3,)), plane_frame(normal)))


def loop(radius: float = 1.0, center: ArrayLike = (0.0, 0.0, 0.0), heading: float = 0.0) -> Curve:
    """Return a vertical circle by the angle [rad] from its lowest point: forward at the bottom, then up.

    Args:
        radius: [m].
        center: (3,) [m], world.
        heading: Direction of flight at the bottom [deg], from the world's first axis towards its second.
    """
    radius = magnitude(radius, "radius [m]", above=0)
    middle, turn = magnitudes(center, "center [m]", (3,)), np.radians(number(heading, "heading [deg]"))
    forward = np.array([np.cos(turn), np.sin(turn), 0.0])
    frame = np.column_stack([np.array(DOWN), forward, np.cross(DOWN, forward)])
    return _round("loop", radius, radius, Placement(middle, frame))


def nonplanar_circle(
    radius: float = 1.5, height: float = 1.0, amplitude: float = 0.25, wavelength: float = 3.0
) -> Curve:
    """Return (R cos a, R sin a, h + A sin(2 pi R cos(a) / L)): a circle in plan with a wave in height.

    The defaults are the path of the design's sampled-control figures.  The third axis is down as everywhere, so
    `height` is depth.
    """
    radius, wavelength = magnitude(radius, "radius [m]", above=0), magnitude(wavelength, "wavelength [m]", above=0)
    height, amplitude = magnitude(height, "height [m]"), magnitude(amplitude, "amplitude [m]")

    point = functools.partial(_wavy, radius, height, amplitude, wavelength)
    return Curve(point, period=FULL_TURN, name="nonplanar circle")


def _round(name: str, a: float, b: float, place: Placement) -> Curve:
    return Curve(
        functools.partial(_oval, a, b, place),
        period=FULL_TURN,
        name=name,
        plane_normal=tuple(np.asarray(place.rotation)[:, 2]),
    )


def _oval(a: float, b: float, place: Placement, angle: Any) -> Any:
    return place.vector((a * ca.cos(angle), b * ca.sin(angle), 0))


def _wavy(radius: float, height: float, amplitude: float, wavelength: float, angle: Any) -> tuple[Any, Any, Any]:
    x = radius * ca.cos(angle)
    return x, radius * ca.sin(angle), height + amplitude * ca.sin(FULL_TURN * x / wavelength)


def _across(place: Placement, radius: float, coordinates: str, x: Any, y: Any, z: Any) -> Any:
    """Graph: return s1, which vanishes at the radius."""
    a, b, _ = place.local(x, y, z)
    return ca.sqrt(a**2 + b**2) - radius if coordinates == "distance" else a**2 + b**2 - radius**2


def _height(place: Placement, x: Any, y: Any, z: Any) -> Any:
    """Graph: return s2, the height over the plane."""
    return place.local(x, y, z)[2]


def _angle(place: Placement, x: Any, y: Any, z: Any) -> Any:
    """Graph: return pi."""
    a, b, _ = place.local(x, y, z)
    return ca.atan2(b, a)

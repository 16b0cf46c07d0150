"""Paths by name: each returns a curve (or an implicit path) placed in the world, third axis down."""

from __future__ import annotations

from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array, direction, number
from gammastar.errors import UnknownNameError
from gammastar.path.curve import Curve
from gammastar.path.implicit import ImplicitPath

DOWN = (0.0, 0.0, 1.0)
FULL_TURN = 2 * np.pi


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
    radius = number(radius, "radius [m]", above=0)
    middle, frame = array(center, "center [m]", (3,)), plane_frame(normal)
    if kind == "curve":
        return Curve(
            lambda angle: _placed(middle, frame, (radius * ca.cos(angle), radius * ca.sin(angle), 0)),
            period=FULL_TURN,
            name="circle",
            plane_normal=tuple(frame[:, 2]),
        )
    if kind != "implicit":
        raise UnknownNameError("kind", kind, ("curve", "implicit"))
    if coordinates not in {"distance", "quadratic"}:
        raise UnknownNameError("coordinates", coordinates, ("distance", "quadratic"))

    def local(x: Any, y: Any, z: Any) -> list[Any]:
        return ca.vertsplit(ca.mtimes(_sparse(frame.T), ca.vertcat(x, y, z) - _sparse(middle)))

    def across(x: Any, y: Any, z: Any) -> Any:
        a, b, _ = local(x, y, z)
        return ca.sqrt(a**2 + b**2) - radius if coordinates == "distance" else a**2 + b**2 - radius**2

    def angle(x: Any, y: Any, z: Any) -> Any:
        a, b, _ = local(x, y, z)
        return ca.atan2(b, a)

    return ImplicitPath(
        across,
        lambda x, y, z: local(x, y, z)[2],
        angle,
        seed=tuple(middle + radius * frame[:, 0]),
        period=FULL_TURN,
        name="circle",
    )


def ellipse(semi_axes: ArrayLike = (2.0, 1.0), center: ArrayLike = (0.0, 0.0, 0.0), normal: ArrayLike = DOWN) -> Curve:
    """Return an ellipse with semi-axes (a, b) [m] by eccentric angle [rad], right-handed about `normal`."""
    a, b = (number(axis, "semi-axis [m]", above=0) for axis in array(semi_axes, "semi_axes [m]", (2,)))
    middle, frame = array(center, "center [m]", (3,)), plane_frame(normal)
    return Curve(
        lambda angle: _placed(middle, frame, (a * ca.cos(angle), b * ca.sin(angle), 0)),
        period=FULL_TURN,
        name="ellipse",
        plane_normal=tuple(frame[:, 2]),
    )


def loop(radius: float = 1.0, center: ArrayLike = (0.0, 0.0, 0.0), heading: float = 0.0) -> Curve:
    """Return a vertical circle by the angle [rad] from its lowest point: forward at the bottom, then up.

    Args:
        radius: [m].
        center: (3,) [m], world.
        heading: Direction of flight at the bottom [deg], from the world's first axis towards its second.
    """
    radius = number(radius, "radius [m]", above=0)
    middle, turn = array(center, "center [m]", (3,)), np.radians(number(heading, "heading [deg]"))
    forward = np.array([np.cos(turn), np.sin(turn), 0.0])
    frame = np.column_stack([np.array(DOWN), forward, np.cross(DOWN, forward)])
    return Curve(
        lambda angle: _placed(middle, frame, (radius * ca.cos(angle), radius * ca.sin(angle), 0)),
        period=FULL_TURN,
        name="loop",
        plane_normal=tuple(frame[:, 2]),
    )


def line(point: ArrayLike = (0.0, 0.0, 0.0), along: ArrayLike = (1.0, 0.0, 0.0)) -> Curve:
    """Return a straight line through a point (3,) [m] along a direction; its parameter is the distance from the point [m]."""
    start, tangent = array(point, "point [m]", (3,)), direction(along, "along")
    normal = np.cross(tangent, np.eye(3)[np.argmin(np.abs(tangent))])
    return Curve(
        lambda distance: _placed(start, np.column_stack([tangent, np.zeros(3), np.zeros(3)]), (distance, 0, 0)),
        name="line",
        plane_normal=tuple(normal / np.linalg.norm(normal)),
    )


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
    radius, pitch = number(radius, "radius [m]", above=0), number(pitch, "pitch [m]")
    if pitch == 0:
        number(abs(pitch), "pitch [m] (as a magnitude)", above=0)
    middle, frame = array(center, "center [m]", (3,)), plane_frame(axis)
    rise = pitch / FULL_TURN
    return Curve(
        lambda angle: _placed(middle, frame, (radius * ca.cos(angle), radius * ca.sin(angle), rise * angle)),
        name="helix",
        domain=(-2 * FULL_TURN, 2 * FULL_TURN),
    )


def nonplanar_circle(
    radius: float = 1.5, height: float = 1.0, amplitude: float = 0.25, wavelength: float = 3.0
) -> Curve:
    """Return (R cos a, R sin a, h + A sin(2 pi R cos(a) / L)): a circle in plan with a wave in height.

    The defaults are the path of the design's sampled-control figures.  The third axis is down as everywhere, so
    `height` is depth.
    """
    radius, wavelength = number(radius, "radius [m]", above=0), number(wavelength, "wavelength [m]", above=0)
    height, amplitude = number(height, "height [m]"), number(amplitude, "amplitude [m]")

    def point(angle: Any) -> tuple[Any, Any, Any]:
        x = radius * ca.cos(angle)
        return x, radius * ca.sin(angle), height + amplitude * ca.sin(FULL_TURN * x / wavelength)

    return Curve(point, period=FULL_TURN, name="nonplanar circle")


def plane_frame(normal: ArrayLike) -> np.ndarray:
    """Return a rotation (3, 3) with the unit normal as third column; the identity for 'down'."""
    third = direction(normal, "normal")
    helper = np.array([1.0, 0.0, 0.0]) if abs(third[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = helper - third * (third @ helper)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(third, first), third])


def _placed(center: np.ndarray, frame: np.ndarray, local: tuple[Any, Any, Any]) -> Any:
    """Graph: return center + frame @ local; exact zeros of the frame cost nothing."""
    return _sparse(center) + ca.mtimes(_sparse(frame), ca.vertcat(*local))


def _sparse(values: np.ndarray) -> Any:
    return ca.sparsify(ca.DM(values))

"""Where a path lies in the world: turned, scaled and moved by the same keys, whatever its form."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import so3
from gammastar.checks import direction, magnitude, magnitudes
from gammastar.errors import InputError, RotationError, ShapeError
from gammastar.path.base import Path
from gammastar.path.curve import Curve
from gammastar.path.implicit import ImplicitPath
from gammastar.path.metres import MetricPath, by_length
from gammastar.path.waypoints import WaypointPath

Placeable = TypeVar("Placeable", bound=Path)

ORIGIN = (0.0, 0.0, 0.0)
UPRIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
DOWN = (0.0, 0.0, 1.0)  # the third axis of the world
FULL_TURN = 2 * np.pi
EXACT = 1e-14  # distance to SO(3) up to which a rotation is taken as it is, its zeros and ones included


@dataclass(frozen=True, eq=False)
class Placement:
    """The similarity x -> position + scale R x that takes a path from its own axes to the world.

    A rotation printed to a few digits is meant: the nearest one is taken, and `rotation_distance` tells how far it was.

    Raises:
        ShapeError: The position is not three numbers, or the rotation not 3x3.
        RotationError: The rotation scales, reflects or shears.
        InputError: The scale is not a positive number.
    """

    position: ArrayLike = ORIGIN  # (3,) [m], world, of the origin of the path's own axes
    rotation: ArrayLike = UPRIGHT  # (3, 3), the path's own axes to world
    scale: float = 1.0  # dimensionless, metres in the world for one of the path's own
    rotation_distance: float = field(
        init=False, default=0.0
    )  # Frobenius norm, from the rotation given to the one taken

    def __post_init__(self) -> None:
        try:
            rotation, distance = so3.project(self.rotation)
        except RotationError as error:
            raise RotationError(
                f"rotation must be a rotation matrix within {so3.PROJECTION_LIMIT:g} of SO(3) (got distance "
                f"{error.distance:.3g}); give orthonormal columns with determinant +1, and a size as scale",
                error.distance,
            ) from error
        if distance <= EXACT:
            rotation = np.array(self.rotation, dtype=float)
        rotation.setflags(write=False)
        object.__setattr__(self, "position", magnitudes(self.position, "position [m]", (3,)))
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "scale", magnitude(self.scale, "scale", above=0))
        object.__setattr__(self, "rotation_distance", distance)

    def points(self, points: ArrayLike) -> np.ndarray:
        """Return points (n, 3) [m] of the path's own axes in the world, e.g. waypoints before a curve is laid through them."""
        local = np.asarray(points, dtype=float)
        if local.ndim != 2 or local.shape[1] != 3:
            raise ShapeError(f"points must have shape (n, 3) (got {local.shape}); give three coordinates each")
        return np.asarray(self.position + self.scale * local @ np.asarray(self.rotation).T)

    def vector(self, local: Any) -> Any:
        """Graph: return position + scale R x for a column or three scalars; zeros of the rotation cost nothing."""
        entries = local if isinstance(local, (tuple, list, np.ndarray)) else ca.vertsplit(local)
        matrix, position = (self.scale * np.asarray(self.rotation)).tolist(), np.asarray(self.position).tolist()
        rows = zip(position, matrix, strict=True)
        return ca.vertcat(*(p + (a * entries[0] + b * entries[1] + c * entries[2]) for p, (a, b, c) in rows))

    def local(self, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
        """Graph: return R^T (chi - position) / scale, the inverse of `vector`, as three scalars."""
        rows = sparse(np.asarray(self.rotation).T / self.scale)
        first, second, third = ca.vertsplit(ca.mtimes(rows, ca.vertcat(x, y, z) - sparse(self.position)))
        return first, second, third


def placed(
    path: Placeable, position: ArrayLike = ORIGIN, rotation: ArrayLike = UPRIGHT, scale: float = 1.0
) -> Placeable:
    """Return a path turned, then scaled, then moved: position + scale R sigma, with its parameter, period and domain kept.

    A curve keeps its parameter, so an angle stays an angle, and a parameter that was a length in metres counts metres
    of the path before it was scaled; only a path by its length counts its new metres.

    An implicit path becomes scale s1(x), scale s2(x) and pi(x) at x = R^T (chi - position) / scale.  The factor keeps
    the gradients of s1 and s2 on the path as long as they were: a distance stays a distance in metres, and gains keep
    their meaning.  pi is not multiplied, so that an angle stays an angle and keeps its period.

    Args:
        path: Of any kind of this package.
        position: (3,) [m], world.
        rotation: (3, 3), the path's own axes to world, applied first; printed to a few digits, the nearest one is taken.
        scale: Dimensionless, positive.
    """
    place = Placement(position, rotation, scale)
    if isinstance(path, Curve):
        normal = path.plane_normal
        if normal is not None:
            normal = tuple(np.asarray(place.rotation) @ normal)
        return replace(path, point=functools.partial(_moved, place, path.point), plane_normal=normal)
    if isinstance(path, ImplicitPath):
        return replace(
            path,
            first=functools.partial(_seen, place, path.first, place.scale),
            second=functools.partial(_seen, place, path.second, place.scale),
            coordinate=functools.partial(_seen, place, path.coordinate, 1.0),
            seed=tuple(place.points([path.seed])[0]),
        )
    if isinstance(path, WaypointPath):
        coefficients = place.scale * np.einsum("ij,mjk->mik", np.asarray(place.rotation), path.spline.coefficients)
        coefficients[:, :, 0] += place.position
        return replace(path, spline=replace(path.spline, coefficients=coefficients))
    if isinstance(path, MetricPath):
        return by_length(placed(path.inner, position, rotation, scale))  # type: ignore[return-value]
    raise InputError(f"only a path is placed (got {type(path).__name__}); make one with gs.paths, or place its points")


def _moved(place: Placement, point: Callable[[Any], Any], parameter: Any) -> Any:
    """Graph: return a curve's point where it is placed."""
    return place.vector(point(parameter))


def _seen(place: Placement, formula: Callable[..., Any], factor: float, x: Any, y: Any, z: Any) -> Any:
    """Graph: return a multiple of a formula of the path's own axes at a position in the world."""
    return factor * formula(*place.local(x, y, z))


def plane_frame(normal: ArrayLike) -> np.ndarray:
    """Return a rotation (3, 3) with the unit normal as third column; the identity for 'down'."""
    third = direction(normal, "normal")
    helper = np.array([1.0, 0.0, 0.0]) if abs(third[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = helper - third * (third @ helper)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(third, first), third])


def sparse(values: ArrayLike) -> Any:
    """Graph: return numbers as a matrix whose exact zeros are structural."""
    return ca.sparsify(ca.DM(np.asarray(values)))

"""The [path] section: every form of a path, by the arguments of its function, and placed by the same keys.

The placement x -> position + scale R x acts in the mission's axes on the path as its own arguments give it.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator, SerializeAsAny

from gammastar.errors import InputError
from gammastar.mission import turn
from gammastar.mission.orientation import AnglesSection, Rotation, matrix_of
from gammastar.mission.values import (
    Array,
    Construction,
    Flag,
    Number,
    Positive,
    Rows,
    Text,
    Vector,
    choose,
    default_of,
    one_of,
    section_of,
)
from gammastar.path import Curve, Path, catalogue
from gammastar.path.formula import curve_from_formula, implicit_from_formula
from gammastar.path.interpolation import SPACINGS
from gammastar.path.metres import by_length
from gammastar.path.placement import ORIGIN, Placement, placed
from gammastar.path.table import read_points
from gammastar.path.waypoints import WaypointPath, waypoints

PROGRESS = ("parameter", "metres")
IMPLICIT_KEYS = {"s1", "s2", "pi", "seed"}  # by which a formula is one of position, not of a parameter


class PathSection(Construction):
    """A path and where it lies."""

    position: Vector = ORIGIN  # (3,) [m] of the origin of the path's own axes
    rotation: Rotation = AnglesSection()  # the path's own axes to the mission's
    scale: Positive = 1.0  # metres in the world for one of the path's own
    progress: Annotated[str, one_of(PROGRESS)] = "parameter"  # what counts along it: its own parameter, or metres

    @property
    def is_implicit(self) -> bool:
        """Return whether the path is given by functions of position, not as a curve."""
        return bool(IMPLICIT_KEYS & type(self).model_fields.keys()) or getattr(self, "kind", None) == "implicit"

    def placement(self, frame: str) -> dict[str, Any]:
        """Return the arguments of `Placement`, in `ned`."""
        return turn.placement_in_ned(self.position, matrix_of(self.rotation), self.scale, frame)

    def path(self, frame: str) -> Path:
        """Return the path, in `ned`."""
        path: Any = self.placed(frame)
        result: Path = by_length(path) if self.progress == "metres" else path
        return result

    def placed(self, frame: str) -> Path:
        """Return the path with its own parameter, in `ned`."""
        path: Any = turn.path_in_ned(self.factory(), self.arguments(), frame)
        place = self.placement(frame)
        stays = not np.any(place["position"]) and np.array_equal(place["rotation"], np.eye(3)) and place["scale"] == 1
        # A curve whose place is said shares the graph of those elsewhere; simplified, its own is the same.
        is_said = isinstance(path, Curve) and not self.model_fields_set.isdisjoint(place)
        result: Path = path if stays and not is_said else placed(path, **place)
        return result

    def numbers(self) -> dict[str, tuple[int, ...]]:
        """Return the shapes of the numbers () and vectors (3,) of the section by their keys, those of tables in it by dotted ones.

        Counts, such as those of a knot, are none: they are whole.
        """
        return dict(_shapes(self.model_dump(exclude_none=True)))

    def written(self) -> dict[str, Any]:
        """Return the section with every default written out: its name, what gives the path, and where it lies."""
        values = self.model_dump(exclude_none=True)
        return dict(sorted(values.items(), key=lambda item: (item[0] != "name", item[0] in PathSection.model_fields)))


class CatalogueSection(PathSection):
    """A path by name; an open curve may be given ends."""

    ends: Array | None = None  # (2,) path parameter, where a flight stops

    def placed(self, frame: str) -> Path:
        """Return the path with its own parameter, in `ned`."""
        path = super().placed(frame)
        if self.ends is None:
            return path
        if not isinstance(path, Curve):
            raise InputError(f"ends need a curve (got an implicit {path.name}); leave them out")
        return dataclasses.replace(path, ends=self.ends)


class SplineSection(PathSection):
    """What paths through points have in common; the points are placed, then joined, so the parameter counts metres as flown."""

    closed: Flag = default_of(waypoints, "closed")
    spacing: Annotated[str, one_of(SPACINGS)] = default_of(waypoints, "spacing")
    before: Number = default_of(waypoints, "before")  # [m] straight on ahead of the first point
    after: Number = default_of(waypoints, "after")  # [m] straight on beyond the last point
    blend: Number | None = default_of(waypoints, "blend")  # [m] in which the bend fades out there

    @property
    def rows(self) -> Any:
        """Return the points (n, 3) [m] in the mission's axes, before they are placed."""
        raise AssertionError("each section of this kind has its own")

    def placed(self, frame: str) -> WaypointPath:
        """Return the path with its own parameter, in `ned`."""
        points = Placement(**self.placement(frame)).points(turn.points_in_ned(self.rows, frame))
        spacing: Any = self.spacing
        return waypoints(points, self.closed, spacing, before=self.before, after=self.after, blend=self.blend)


class WaypointsSection(SplineSection):
    """Points joined by the curve of least snap."""

    name: Annotated[str, one_of(("waypoints",))] = "waypoints"
    points: Rows  # (n, 3) [m]

    @property
    def rows(self) -> Any:
        """Return the points (n, 3) [m] as given."""
        return self.points


class TableSection(SplineSection):
    """Points from a file of comma-separated values, joined likewise; written out as waypoints."""

    name: Annotated[str, one_of(("csv",))] = "csv"
    file: Text

    @functools.cached_property
    def rows(self) -> Any:
        """Return the points (n, 3) [m] of the file, read once."""
        return read_points(self.file)

    def written(self) -> dict[str, Any]:
        """Return the section as waypoints: what was flown stays, whatever becomes of the file."""
        values = super().written()
        del values["name"], values["file"]
        return {"name": "waypoints", "points": self.rows} | values


def _shapes(values: Mapping[str, Any]) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield the shapes of numbers and vectors by key."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from ((f"{key}.{inner}", shape) for inner, shape in _shapes(value))
        elif isinstance(value, float):
            yield key, ()
        elif isinstance(value, tuple) and len(value) == 3 and all(isinstance(each, float) for each in value):
            yield key, (3,)


CATALOGUE = {name: section_of(getattr(catalogue, name), CatalogueSection, name=name) for name in catalogue.__all__}
CURVE_FORMULA = section_of(curve_from_formula, PathSection, name="formula")
IMPLICIT_FORMULA = section_of(implicit_from_formula, PathSection, name="formula")
PATHS: dict[str, type[PathSection]] = {
    **CATALOGUE,
    "waypoints": WaypointsSection,
    "csv": TableSection,
    "formula": CURVE_FORMULA,
}


def path_section(values: Any) -> PathSection:
    """Return the section that a [path] table asks for."""
    is_implicit = isinstance(values, Mapping) and bool(IMPLICIT_KEYS & set(values))
    return choose(values, "name", PATHS | {"formula": IMPLICIT_FORMULA} if is_implicit else PATHS)


AnyPath = Annotated[SerializeAsAny[PathSection], PlainValidator(path_section)]

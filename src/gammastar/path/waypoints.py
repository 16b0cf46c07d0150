"""A path through waypoints: a spline whose coefficients reach the law as data, so one law serves every such path.

The graph evaluates one segment's polynomial; which segment it is, is looked up outside the graph, once a step.  Within a step the
parameter may leave the segment by a little; its polynomial and the next one agree there up to the sixth derivative.

An open path ends at its last waypoint: there a flight stops.  So that a vehicle beside an end, or beyond it, has a nearest point too, the
curve itself runs on straight for good, as smooth as the rest.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import number, truth
from gammastar.errors import InputError
from gammastar.lookup import Lookup, Table, the_key
from gammastar.path.base import JET_ORDER
from gammastar.path.extension import extended, run_out
from gammastar.path.interpolation import FARTHEST, interpolated
from gammastar.path.jet import Jet
from gammastar.path.parametric import ParametricPath
from gammastar.path.regularity import check_regular
from gammastar.path.spline import Spline

POWERS = 8  # coefficients of a polynomial of degree seven
ENDLESS = 1e30
OUTSIDE = (
    0.02  # of a segment, by which its polynomial is still the path: neighbours differ by the seventh power of that
)


@dataclass(frozen=True, eq=False)
class WaypointPath(ParametricPath):
    """A C^6 spline of degree seven as a path; its parameter is the spline's."""

    spline: Spline
    name: str = "waypoints"

    plane_normal = None

    def __post_init__(self) -> None:
        low, high = float(self.spline.knots[0]), float(self.spline.knots[-1])
        object.__setattr__(self, "domain", (low, high))
        object.__setattr__(self, "period", high - low if self.spline.closed else None)
        object.__setattr__(self, "ends", None if self.spline.closed else (low, high))
        check_regular(self)

    @functools.cached_property
    def _table(self) -> Spline:
        """The spline, an open one with straight lines beyond its ends, whose segments are looked up."""
        return self.spline if self.spline.closed else run_out(self.spline)

    @property
    def graph_key(self) -> Hashable:
        """Return what names the path's graph, which all waypoint paths share."""
        return WaypointPath

    @property
    def knots(self) -> np.ndarray:
        """Return the parameters (m + 1,) at which segments meet: where a report looks for what is not smooth."""
        return self.spline.knots

    @functools.cached_property
    def _lengths(self) -> np.ndarray:
        """How far the parameter runs in each segment (m,); the last one of an open path goes on for good."""
        lengths = np.diff(self._table.knots)
        return lengths if self.spline.closed else np.append(lengths[:-1], ENDLESS)

    def jet(self, place: Any, order: int = JET_ORDER) -> Jet:
        """Graph: return (sigma, ..., sigma^(order)) at a place: parameter, begin of the segment, coefficients."""
        step, rows = place[0] - place[1], ca.reshape(place[2 : 2 + 3 * POWERS], POWERS, 3).T
        return tuple(_derivatives([rows[:, i] for i in range(POWERS)], step, order))

    def jets(self, parameters: np.ndarray, order: int = JET_ORDER) -> np.ndarray:
        """Return (n, order + 1, 3): point and derivatives with respect to the parameter, at parameters (n,)."""
        wanted = np.atleast_1d(np.asarray(parameters, dtype=float))
        segment, begin = self._segments(wanted)
        rows, step = self._table.coefficients[segment], (wanted - begin)[:, None]
        return np.stack(_derivatives(list(np.moveaxis(rows, -1, 0)), step, order), axis=1)

    def holds(self, parameter: Any, data: Any) -> Any:
        """Graph: return whether a parameter lies in the segment whose data these are, or so little outside that it does not matter."""
        slack, step = OUTSIDE * data[-1], parameter - data[0]
        return ca.logic_and(step > -slack, step < data[-1] + slack)

    @functools.cached_property
    def lookups(self) -> tuple[Lookup, ...]:
        """Return the table of segments: where each begins, its coefficients, axis by axis, and how long it is."""
        begins = self._table.knots[:-1]
        rows = np.column_stack([begins, self._table.coefficients.reshape(len(begins), -1), self._lengths])
        shifts = None if self.period is None else self.period * np.eye(1, rows.shape[1])[0]
        return (Lookup(Table(begins, rows, self.period, shifts), the_key),)

    def _segments(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return indices of segments (n,) and the parameters at which they begin, whole periods included."""
        knots = self._table.knots
        whole = self.period * np.floor((parameters - knots[0]) / self.period) if self.period else 0.0
        segment = np.clip(np.searchsorted(knots, parameters - whole, side="right") - 1, 0, len(knots) - 2)
        return segment, knots[segment] + whole


def waypoints(
    points: ArrayLike,
    closed: bool = False,
    spacing: Literal["chord", "centripetal"] = "chord",
    name: str = "waypoints",
    *,
    before: float = 0.0,
    after: float = 0.0,
    blend: float | None = None,
) -> WaypointPath:
    """Return the C^6 path of least snap through points (n, 3) [m], world; see `gammastar.path.interpolation`.

    Args:
        points: In the order of flight, at least two; on a closed path the first is not repeated.
        closed: Return to the first point.
        spacing: Of the parameter: 'chord' is close to the distance flown, 'centripetal' tamer where distances differ much.
        name: For messages.
        before: How far the parameter runs straight on ahead of the first point, of an open path; the length added is that times |sigma'|
            at the end.  See `gammastar.path.extension`.
        after: Likewise beyond the last point.
        blend: How much of that the bend takes to fade out [m].
    """
    spline = interpolated(points, truth(closed, "closed"), spacing)
    for side, length in (("before", before), ("after", after)):
        if number(length, f"{side} [m]", at_least=0) > FARTHEST:
            raise InputError(f"{side} must be at most {FARTHEST:g} m (got {length:g} m); check its unit")
    if before != 0 or after != 0 or blend is not None:
        spline = extended(spline, before, after, blend)
    return WaypointPath(spline, name)


def _derivatives(coefficients: list[Any], step: Any, order: int) -> list[Any]:
    """Return sum_i c_i step^i and its derivatives up to an order, on SX columns or on arrays (n, 3) alike.

    The polynomial is moved to the step by repeated synthetic division, Horner's scheme: of its new coefficients the k-th is the k-th
    derivative over k!.
    """
    moved = list(coefficients)
    for k in range(order + 1):
        for i in reversed(range(k, len(moved) - 1)):
            moved[i] = moved[i] + step * moved[i + 1]
    return [math.factorial(k) * moved[k] for k in range(order + 1)]

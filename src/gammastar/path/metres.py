"""A path with its arc length as parameter: progress, speeds and places in metres.

The parameter of the path below is a spline of the arc length, sigma(lambda(s)), so the curve itself is exact and only its pace is
fitted: the parameter runs with one metre a metre to within a millionth.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from gammastar.checks import instance
from gammastar.errors import InputError, PathError
from gammastar.lookup import Lookup, Table, the_key
from gammastar.path.base import JET_ORDER
from gammastar.path.jet import Jet
from gammastar.path.parametric import ParametricPath
from gammastar.path.waypoints import ENDLESS, OUTSIDE
from gammastar.taylor import Series

POWERS = 8  # coefficients of a polynomial of degree seven
NODES = (32, 64, 128, 256, 512, 1024, 2048)  # of the fit, tried in turn
PACE = 1e-6  # by which the fitted pace may be off one metre a metre
BEYOND = 0.25  # of its length by which an open path is fitted beyond its ends, where it goes on


@dataclass(frozen=True, eq=False)
class MetricPath(ParametricPath):
    """A curve whose parameter counts the metres from the start of its domain; made by `by_length`."""

    inner: ParametricPath
    knots_m: np.ndarray  # (m + 1,) [m] where the polynomials of lambda(s) meet
    coefficients: np.ndarray  # (m, 8) of the powers of s less the knot before

    def __post_init__(self) -> None:
        length, closed = self.inner.length(), self.inner.period is not None
        for name, value in {
            "name": self.inner.name,
            "domain": (0.0, length),
            "period": length if closed else None,
            "ends": None if closed else (0.0, length),
            "plane_normal": self.inner.plane_normal,
        }.items():
            object.__setattr__(self, name, value)

    def with_data(self) -> MetricPath:
        """Return the same path with the numbers of the one below as data."""
        inner = self.inner.with_data()
        return self if inner is self.inner else replace(self, inner=inner)

    @property
    def graph_key(self) -> Hashable:
        """Return what names the path's graph: the one below, by its length."""
        return MetricPath, self.inner.graph_key

    @property
    def knots(self) -> np.ndarray:
        """Return the metres (k,) at which the pieces of the path below join."""
        return self.inner.arc_length(self.inner.knots) if len(self.inner.knots) else np.empty(0)

    def jet(self, place: Any, order: int = JET_ORDER) -> Jet:
        """Graph: return (sigma, ..., sigma^(order)) by arc length at a place: metres, then what `data` returns."""
        step = Series((place[0] - place[1], ca.SX(1), *(ca.SX(0) for _ in range(order - 1))))
        parameter = Series.constant(place[1 + POWERS], order)
        for coefficient in reversed(ca.vertsplit(place[2 : 1 + POWERS])):
            parameter = parameter * step + Series.constant(coefficient, order)
        inner = self.inner.jet(ca.vertcat(parameter.coefficients[0], place[3 + POWERS :]), order)
        change = Series((ca.SX(0), *parameter.coefficients[1:]))
        result = Series.constant(inner[order] / math.factorial(order), order)
        for k in reversed(range(order)):
            result = result * change + Series.constant(inner[k] / math.factorial(k), order)
        return tuple(result.derivatives())

    def jets(self, parameters: np.ndarray, order: int = JET_ORDER) -> np.ndarray:
        """Return (n, order + 1, 3): point and derivatives with respect to the arc length [m], at parameters (n,)."""
        return self._sampled(np.atleast_1d(np.asarray(parameters, dtype=float)), order)

    @property
    def lookups(self) -> tuple[Lookup, ...]:
        """Return the table of lambda(s): begin, coefficients and length of each polynomial; then those of the path below, at lambda(s)."""
        own = Lookup(self._polynomials, the_key)
        return own, *(lookup.within(_below, own.table.width) for lookup in self.inner.lookups)

    def holds(self, parameter: Any, data: Any) -> Any:
        """Graph: return whether data looked up elsewhere are the path's own at a parameter, here and below."""
        step, length = parameter - data[0], data[1 + POWERS]
        inside = ca.logic_and(step > -OUTSIDE * length, step < (1 + OUTSIDE) * length)
        return ca.logic_and(inside, self.inner.holds(_below(parameter, data), data[2 + POWERS :]))

    @functools.cached_property
    def _polynomials(self) -> Table:
        """The table of lambda(s); an open path goes on at the pace of the ends of the fit."""
        if self.period is not None:
            rows = np.column_stack([self.knots_m[:-1], self.coefficients, np.diff(self.knots_m)])
            shifts = np.zeros(rows.shape[1])
            shifts[:2] = self.period, self.inner.period
            return Table(self.knots_m[:-1], rows, self.period, shifts)
        step = self.knots_m[-1] - self.knots_m[-2]
        powers = np.arange(POWERS)
        last, slope = (
            self.coefficients[-1] @ step**powers,
            self.coefficients[-1, 1:] @ (powers[1:] * step ** powers[:-1]),
        )
        before = np.zeros((2, POWERS))
        before[0, :2] = self.coefficients[0, 0] - self.coefficients[0, 1], self.coefficients[0, 1]
        before[1, :2] = last, slope
        begins = np.concatenate([[self.knots_m[0] - 1], self.knots_m])
        coefficients = np.vstack([before[:1], self.coefficients, before[1:]])
        return Table(begins, np.column_stack([begins, coefficients, np.append(np.diff(begins), ENDLESS)]))


def _below(metres: Any, data: Any) -> Any:
    """Graph or numbers: return lambda(s), the parameter of the path below, from the data there."""
    result, step = data[POWERS], metres - data[0]
    for k in reversed(range(1, POWERS)):
        result = result * step + data[k]
    return result


def by_length(path: ParametricPath) -> MetricPath:
    """Return a curve with its arc length [m] from the start of its domain as parameter.

    Raises:
        InputError: The path is implicit, or goes on for good without `ends`: then no finite table holds its lengths.
        PathError: Its pace cannot be fitted to a millionth.
    """
    instance(path, ParametricPath, "path by its length", "give a curve; an implicit path has pi as its coordinate")
    if path.period is None and path.ends is None:
        raise InputError(
            f"{path.name} must be closed or have ends to be measured (got neither); give it some, such as "
            "dataclasses.replace(path, ends=(0, 10))"
        )
    length = path.length()
    margins = [0.0] if path.period is not None else [BEYOND * length, 0.0]
    for margin in margins:
        try:
            for count in NODES:
                fitted = _fitted(path, np.linspace(-margin, length + margin, count + 1))
                if fitted is not None:
                    return fitted
        except PathError:
            if margin == margins[-1]:
                raise
    raise PathError(
        f"the pace of {path.name} must vary slowly enough to be fitted (got {NODES[-1]} pieces that do not); keep its parameter"
    )


def _fitted(path: ParametricPath, metres: np.ndarray) -> MetricPath | None:
    """Return the path with lambda(s) interpolated at arc lengths (n,) [m], or None where its pace is off between them."""
    from scipy.interpolate import PPoly, make_interp_spline

    parameters = path.at_length(metres)
    steady = (parameters[-1] - parameters[0]) / (metres[-1] - metres[0])
    rest = parameters - parameters[0] - steady * (metres - metres[0])
    if path.period is not None:
        rest[-1] = rest[0]
    spline = make_interp_spline(metres, rest, k=POWERS - 1, bc_type="periodic" if path.period is not None else None)
    pieces = PPoly.from_spline(spline)
    kept = np.flatnonzero(np.diff(pieces.x) > 1e-9 * (metres[-1] - metres[0]))
    inside = kept[(pieces.x[kept] >= metres[0] - 1e-12) & (pieces.x[kept] < metres[-1] - 1e-12)]
    knots = np.append(pieces.x[inside], metres[-1])
    coefficients = pieces.c[::-1, inside].T.copy()
    coefficients[:, 0] += parameters[0] + steady * (knots[:-1] - metres[0])
    coefficients[:, 1] += steady
    between = np.linspace(metres[0], metres[-1], 8 * len(metres))
    reached = parameters[0] + steady * (between - metres[0]) + pieces(between)
    pace = np.linalg.norm(path.jets(reached, 2)[:, 1], axis=1) * (steady + pieces.derivative()(between))
    return MetricPath(path, knots, coefficients) if np.all(np.abs(pace - 1) <= PACE) else None

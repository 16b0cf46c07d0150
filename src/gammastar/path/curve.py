"""A path given by a formula for its points; its derivatives are taken of the formula."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import taylor
from gammastar.checks import direction, magnitude
from gammastar.errors import PathError
from gammastar.path.base import JET_ORDER, interval
from gammastar.path.jet import Jet
from gammastar.path.parametric import ParametricPath
from gammastar.path.regularity import check_regular, check_smooth
from gammastar.path.smoothness import may_bend
from gammastar.path.symbols import called, scalars
from gammastar.path.template import TemplateCurve, read
from gammastar.taylor import Series

DOMAIN = (-10.0, 10.0)  # where an open curve is looked at, if nothing else is said


@dataclass(frozen=True, eq=False)
class Curve(ParametricPath):
    """A regular curve of class C^5 given by a formula.

    Raises:
        PathError: The formula is not three scalars, cannot be differentiated, is not finite, stands still or is not of class
            C^5 somewhere in its domain; with the place.
    """

    point: Callable[[Any], Any]  # graph: parameter SX -> three scalars [m], world; any CasADi expression
    period: float | None = None  # of the parameter, for a closed curve
    name: str = "curve"
    plane_normal: tuple[float, float, float] | None = None
    domain: tuple[float, float] = DOMAIN
    ends: tuple[float, float] | None = None  # of an open curve that a flight does not leave: it stops there

    def __post_init__(self) -> None:
        if self.period is not None:
            magnitude(self.period, f"period of {self.name}", above=0)
            object.__setattr__(self, "domain", (0.0, float(self.period)))
        if self.ends is not None:
            if self.period is not None:
                raise PathError(f"{self.name} must be closed or end (got a period and ends); leave one of them out")
            object.__setattr__(self, "ends", interval(self.ends, f"ends of {self.name}"))
            object.__setattr__(self, "domain", self.ends)
        object.__setattr__(self, "domain", interval(self.domain, f"domain of {self.name}"))
        if self.plane_normal is not None:
            object.__setattr__(self, "plane_normal", tuple(direction(self.plane_normal, "plane_normal")))
        self._check()

    def _check(self) -> None:
        """Refuse a curve that cannot be a path; the graphs of another one of its formula tell most that can."""
        if not self._is_path_by_data:
            check_regular(self)
            check_smooth(self, may_bend(self._point_function))

    def with_data(self) -> ParametricPath:
        """Return the same curve with the numbers of its formula as data; itself where it needs them, as zero times infinity does."""
        return self._with_data if self._is_path_by_data else self

    @functools.cached_property
    def _is_path_by_data(self) -> bool:
        try:
            check_regular(self._with_data)
            check_smooth(self._with_data, self._with_data.template.may_bend)
        except PathError:
            return False
        return True

    @functools.cached_property
    def _with_data(self) -> TemplateCurve:
        """The curve whose graphs are there already if there was another one of this formula."""
        template, numbers = read(self._formula)
        return TemplateCurve(template, numbers, self.name, self.period, self.plane_normal, self.domain, self.ends)

    def jet(self, place: Any, order: int = JET_ORDER) -> Jet:
        """Graph: return (sigma, sigma', ..., sigma^(order)), SX (3,) each, by pushing a series through the formula."""
        series = Series((ca.SX(place)[0], ca.SX(1), *(ca.SX(0) for _ in range(order - 1))))
        scalars = taylor.through(self._point_function, [series])
        return tuple(ca.vertcat(*rows) for rows in zip(*(s.derivatives() for s in scalars), strict=True))

    def jets(self, parameters: np.ndarray, order: int = JET_ORDER) -> np.ndarray:
        """Return (n, order + 1, 3): point and derivatives with respect to the parameter, at parameters (n,)."""
        return self._sampled(np.atleast_1d(np.asarray(parameters, dtype=float)), order)

    @functools.cached_property
    def _point_function(self) -> Any:
        return self._formula()

    def _formula(self) -> Any:
        """Return the function parameter -> x, y, z."""
        parameter = ca.SX.sym("parameter")
        entries = scalars(_entries(called(self.point, [parameter], self.name)), self.name)
        if len(entries) != 3:
            raise PathError(
                f"the formula of {self.name} must return three scalars (got {len(entries)} entries); return x, y, z"
            )
        return ca.Function("point", [parameter], entries)


def _entries(value: Any) -> list[Any]:
    """Return what a formula returned as a list: a tuple, a list, a NumPy array, or a column of symbols or numbers."""
    if isinstance(value, (ca.SX, ca.DM)):
        return list(ca.vertsplit(value))
    return list(value) if isinstance(value, (tuple, list, np.ndarray)) else [value]

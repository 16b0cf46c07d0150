"""What the law needs from a path: two coordinates that vanish on it, one along it, and their derivatives up to snap.

Both kinds of path, implicit and curve, answer with the same `PathOutputs`; nothing above this floor asks which kind it
was.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import magnitudes, number, row
from gammastar.errors import PathError
from gammastar.lookup import Lookup, numbers_at
from gammastar.path.arc_length import ArcLength
from gammastar.taylor import Series

ORDER = 4  # outputs are differentiated up to snap, the first derivative that the input reaches
PACE_SAMPLES = 257  # of |sigma'|
JET_ORDER = 5  # derivatives of a curve that enter them off the curve


@dataclass(frozen=True, eq=False)
class PathOutputs:
    """Graph: the outputs (alpha, pi) of Eqs. (10), (13), their derivatives, and how snap enters the fourth ones.

    transverse' s fourth derivative is transverse_drift + transverse_gradient @ snap, and likewise for the tangential
    one.  For a curve the transverse output is a vector of the normal plane in world axes (n = 3), for an implicit path
    it is (s1, s2) (n = 2).
    """

    transverse: Any  # SX (n, 4), columns xi_1 ... xi_4: value to third derivative
    tangential: Any  # SX (4,), eta_1 ... eta_4 in the path's parameter
    transverse_drift: Any  # SX (n,)
    tangential_drift: Any  # SX
    transverse_gradient: Any  # SX (n, 3)
    tangential_gradient: Any  # SX (1, 3)
    focal_margin: Any  # SX, dimensionless: 1 on the path, 0 where the coordinates break down
    snap: Any  # callable (transverse_rate SX (n,), tangential_rate SX) -> SX (3,) [m/s^4], world


class Path(ABC):
    """A smooth embedded curve in space; its parameter is tracked as a state, so progress on a closed path never wraps."""

    name: str  # as messages call it
    period: float | None  # length of the parameter interval of a closed path, None for an open one
    domain: tuple[float, float]  # one period of a closed path; where an open one is checked, searched first, and drawn
    components: int  # rows of the transverse output: 3 for a curve, 2 for an implicit path
    ends: tuple[float, float] | None = None  # parameters at which an open path ends; None where it goes on for good

    @property
    def knots(self) -> np.ndarray:
        """Return the parameters (k,) at which the path's pieces join, as a spline's do; none where one formula holds."""
        return np.empty(0)

    @property
    def graph_key(self) -> Hashable:
        """Return what names the path's graph: paths with one key differ in their data alone."""
        return self

    def with_data(self) -> Path:
        """Return the same path with its numbers as data where they can be: paths of one formula then have one `graph_key`."""
        return self

    @property
    def lookups(self) -> tuple[Lookup, ...]:
        """Return what is looked up at a parameter: the numbers that the graph needs beside it, such as the coefficients of a segment."""
        return ()

    @functools.cached_property
    def data_size(self) -> int:
        """Return how many numbers these are."""
        return sum(lookup.table.width for lookup in self.lookups)

    def data(self, parameters: np.ndarray) -> np.ndarray:
        """Return the path's data (data_size, n) at parameters (n,); a `place` is a parameter followed by its data."""
        return numbers_at(self.lookups, np.atleast_1d(np.asarray(parameters, dtype=float)))

    def holds(self, parameter: Any, data: Any) -> Any:
        """Graph: return whether data looked up elsewhere are the path's own at a parameter; always, where it needs none."""
        return ca.SX(1)

    @abstractmethod
    def outputs(self, position: Series, place: Any) -> PathOutputs:
        """Graph: return the outputs along a position series (value to jerk; higher coefficients are ignored)."""

    @abstractmethod
    def track(self, position: Any, place: Any) -> Any:
        """Graph: return the parameter SX of the nearest point, continued from a nearby earlier place SX (1 + data_size,)."""

    @abstractmethod
    def foot(self, position: Any, place: Any) -> Any:
        """Graph: return the point SX (3,) of the path at a tracked place; `position` is a guess where one is needed."""

    @abstractmethod
    def position_series(self, transverse: Any, tangential: Any, guess: Any, data: Any = None) -> Series:
        """Graph: return the position series whose outputs these are, the inverse of `outputs` (order = columns - 1).

        Args:
            transverse: SX (n, k), columns as in `PathOutputs.transverse`.
            tangential: SX (k,).
            guess: SX (3,), a position nearby; a curve does not need it.
            data: SX (data_size,), of a path that has any.
        """

    @abstractmethod
    def distance(self, position: Any, place: Any, ends: tuple[Any, Any]) -> Any:
        """Graph: return the distance [m] of a position to the nearest point, continued from a place, between two parameters."""

    def start_parameter(self, position: np.ndarray) -> float:
        """Return the parameter of the point nearest to a position (3,) [m], searched globally."""
        return float(self.start_parameters(np.asarray(position, dtype=float)[None])[0])

    @abstractmethod
    def start_parameters(self, positions: np.ndarray) -> np.ndarray:
        """Return the parameters (n,) of the points nearest to positions (n, 3) [m], searched globally, each for itself."""

    @abstractmethod
    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) [m] of the path at parameters (n,)."""

    @abstractmethod
    def jets(self, parameters: np.ndarray) -> np.ndarray:
        """Return (n, 6, 3): point and first five derivatives with respect to the parameter, at parameters (n,)."""

    @abstractmethod
    def normal_components(self, parameters: np.ndarray, transverse: np.ndarray) -> np.ndarray:
        """Return transverse outputs (k, n, 4) as two components each, (k, 2, 4), plain derivatives of each other."""

    @abstractmethod
    def normal_vectors(self, parameters: np.ndarray, components: np.ndarray, reference: float) -> np.ndarray:
        """Invert `normal_components`; `reference` is the first parameter that was given there."""

    @abstractmethod
    def distances(self, positions: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the distances (n,) [m] of positions (n, 3) to the path, continued from parameters (n,)."""

    def length(self, first: float | None = None, last: float | None = None) -> float:
        """Return the length [m] between two parameters, by default of the whole domain: one round of a closed path."""
        low, high = self.domain
        first = low if first is None else number(first, "first [path parameter]")
        last = high if last is None else number(last, "last [path parameter]")
        return float(np.diff(self.arc_length([first, last]))[0])

    def arc_length(self, parameters: ArrayLike) -> np.ndarray:
        """Return the arc length (n,) [m] from the start of the domain to parameters (n,), negative before it.

        A closed path counts every round.  Relative error below 1e-9, of a path that its jets resolve.

        Raises:
            ShapeError: The parameters are no finite numbers.
            PathError: The path has no finite speed there, or pi does not get there.
        """
        return self._arc_length.at(row(parameters, "parameters"))

    def at_length(self, lengths: ArrayLike) -> np.ndarray:
        """Return the parameters (n,) at arc lengths (n,) [m] from the start of the domain, the inverse of `arc_length`.

        Raises:
            ShapeError: The lengths are no finite numbers.
            PathError: The path is not as long.
        """
        return self._arc_length.parameters(row(lengths, "lengths [m]"))

    @functools.cached_property
    def _arc_length(self) -> ArcLength:
        return ArcLength(self.name, self.jets, self.domain, self.period is not None)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone: graphs that have been built from them are built again where they are needed."""
        return {
            name: value
            for name, value in self.__dict__.items()
            if not isinstance(getattr(type(self), name, None), functools.cached_property)
        }

    @functools.cached_property
    def fastest_pace(self) -> float:
        """Return the largest of some samples of |sigma'| [m per unit of the parameter] in the domain."""
        return float(np.linalg.norm(self.jets(np.linspace(*self.domain, PACE_SAMPLES))[:, 1], axis=1).max())

    def nearest_turn(self, parameter: float, near: float) -> float:
        """Return `parameter` shifted by whole periods to lie nearest to `near`; unchanged on an open path."""
        return parameter if self.period is None else parameter + self.period * round((near - parameter) / self.period)


def distinct(paths: Sequence[Path]) -> Iterator[tuple[Path, list[int]]]:
    """Yield each path of a list once, with the places at which it is."""
    places = dict[int, list[int]]()
    for k, path in enumerate(paths):
        places.setdefault(id(path), []).append(k)
    yield from ((paths[own[0]], own) for own in places.values())


def interval(given: Any, name: str) -> tuple[float, float]:
    """Return the domain or the ends of a path as two increasing numbers."""
    low, high = magnitudes(given, name, (2,))
    if not low < high:
        raise PathError(f"the {name} must be an interval (got {low:g} to {high:g}); give low < high")
    return float(low), float(high)

"""A path given as in the paper: two functions s1, s2 that vanish on it and one function pi along it, Eqs. (10), (13).

The functions are graphs of position; their derivatives along a flight come from pushing its Taylor series through them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import taylor
from gammastar.checks import magnitude, magnitudes
from gammastar.errors import PathError
from gammastar.path.base import JET_ORDER, ORDER, Path, PathOutputs, interval
from gammastar.path.course import Course
from gammastar.path.regularity import check_smooth
from gammastar.path.smoothness import has_switches
from gammastar.path.symbols import called, scalars
from gammastar.path.tracing import inverted
from gammastar.taylor import Series

SEED_STEPS = 50  # Newton steps from the seed onto the path
FOOT_STEPS = 8  # Newton steps from a position off the path to its foot
NEAREST_STEPS = 3  # Newton steps from there to the nearest point, whatever its pi
SOLVE_STEPS = 4  # Newton steps from a neighbouring solution


@dataclass(frozen=True, eq=False)
class ImplicitPath(Path):
    """The set where two functions of position vanish, with a third one that grows along it.

    It is traced once at construction: one period of a closed path, the domain of an open one.

    Raises:
        PathError: A formula is not a scalar or cannot be differentiated; no point of the path is found from `seed`;
            the three gradients are dependent there (Assumption 1, Lemma 3); pi jumps or turns back on the way; the
            path does not come back to the same point after a period; or it is not of class C^5 somewhere.
    """

    first: Callable[[Any, Any, Any], Any]  # graph: s1(x, y, z)
    second: Callable[[Any, Any, Any], Any]  # graph: s2(x, y, z)
    coordinate: Callable[[Any, Any, Any], Any]  # graph: pi(x, y, z), e.g. an angle with atan2
    seed: tuple[float, float, float]  # [m] a point on the path or near it
    period: float | None = None  # of pi on a closed path, 2 pi for an angle
    name: str = "implicit path"
    domain: tuple[float, float] = (-10.0, 10.0)  # of pi, where an open path is checked and drawn

    components = 2

    def __post_init__(self) -> None:
        if self.period is not None:
            magnitude(self.period, f"period of {self.name}", above=0)
            object.__setattr__(self, "domain", (0.0, float(self.period)))
        object.__setattr__(self, "domain", interval(self.domain, f"domain of {self.name}"))
        object.__setattr__(self, "seed", tuple(magnitudes(self.seed, f"seed of {self.name}", (3,)).tolist()))
        assert self._jet_sampler  # refuses formulas that have no Taylor rule now, not in flight
        values, gradient = (np.array(value) for value in self._gradient_sampler(self._seed_point))
        size = np.prod(np.linalg.norm(gradient, axis=1))
        if not np.all(np.isfinite(values)) or not np.all(np.isfinite(gradient)) or np.abs(values[:2]).max() > 1e-9:
            raise PathError(
                f"{self.name} must have a point near its seed (got none from {self.seed}); move the seed onto the path"
            )
        if abs(np.linalg.det(gradient)) <= 1e-9 * max(float(size), 1e-300):
            raise PathError(
                f"the gradients of s1, s2 and pi of {self.name} must be independent on the path (got dependent ones at "
                f"{self._seed_point.round(6).tolist()}); choose functions with nonzero independent gradients"
            )
        self._course.check()
        check_smooth(self, has_switches(self._functions))

    def outputs(self, position: Series, place: Any) -> PathOutputs:
        """Graph: return the outputs along a position series; pi continues the parameter, whole periods included."""
        chi = Series((*position.coefficients[:ORDER], ca.SX(3, 1)))
        rows = [Series(tuple(c[i] for c in chi.coefficients)) for i in range(3)]
        first, second, along = (s.derivatives() for s in taylor.through(self._functions, rows))
        gradient = self._gradient(chi.coefficients[0])
        inverse, determinant = inverted(gradient)
        lengths = [ca.norm_2(gradient[i, :]) for i in range(3)]
        independence = ca.fabs(determinant) / (lengths[0] * lengths[1] * lengths[2])

        def snap(transverse_rate: Any, tangential_rate: Any) -> Any:
            return ca.mtimes(
                inverse,
                ca.vertcat(transverse_rate - ca.vertcat(first[ORDER], second[ORDER]), tangential_rate - along[ORDER]),
            )

        return PathOutputs(
            transverse=ca.vertcat(ca.horzcat(*first[:ORDER]), ca.horzcat(*second[:ORDER])),
            tangential=ca.vertcat(self._continued(along[0], place), *along[1:ORDER]),
            transverse_drift=ca.vertcat(first[ORDER], second[ORDER]),
            tangential_drift=along[ORDER],
            transverse_gradient=gradient[:2, :],
            tangential_gradient=gradient[2, :],
            focal_margin=independence * self._slope_on_path / lengths[2],
            snap=snap,
        )

    def track(self, position: Any, place: Any) -> Any:
        """Graph: return pi(position), shifted by whole periods to continue the parameter."""
        return self._continued(self._functions(*ca.vertsplit(position))[2], place)

    def foot(self, position: Any, place: Any) -> Any:
        """Graph: return the point of the path with this pi, by Newton steps from a position nearby."""
        return self._solved(ca.vertcat(0, 0, place), position, FOOT_STEPS)

    def position_series(self, transverse: Any, tangential: Any, guess: Any, data: Any = None) -> Series:
        """Graph: return the position series with these outputs: Newton steps, then one linear solve a derivative."""
        order = tangential.shape[0] - 1
        targets = [
            Series.from_derivatives(ca.horzsplit(row)) for row in (transverse[0, :], transverse[1, :], tangential.T)
        ]
        value = self._solved(ca.vertcat(*(t.coefficients[0] for t in targets)), guess, SOLVE_STEPS)
        inverse, _ = inverted(self._gradient(value))
        chi = [value]
        for k in range(1, order + 1):
            rows = [Series((*(c[i] for c in chi), ca.SX(0))) for i in range(3)]
            known = taylor.through(self._functions, rows)
            missing = ca.vertcat(*(t.coefficients[k] - s.coefficients[k] for t, s in zip(targets, known, strict=True)))
            chi.append(ca.mtimes(inverse, missing))
        return Series(tuple(chi))

    def distance(self, position: Any, place: Any, ends: tuple[Any, Any]) -> Any:
        """Graph: return the distance [m] to the nearest point, by Newton steps from the point with the same pi; it has no ends.

        The last step is not looked at again: the jet before it tells the point after it.
        """
        parameter, jet, ahead = self.track(position, place), self._sampler(2), ca.SX(0)
        point = self.foot(position, parameter)
        for _ in range(NEAREST_STEPS):
            parameter = parameter + ahead
            point, tangent, second = jet(parameter, point)
            error = position - point
            ahead = ca.dot(error, tangent) / (ca.dot(tangent, tangent) - ca.dot(error, second))
        return ca.norm_2(error - tangent * ahead - second * ahead**2 / 2)

    def start_parameters(self, positions: np.ndarray) -> np.ndarray:
        """Return pi at positions (n, 3): the coordinate function is the projection, Eq. (13)."""
        return np.array([float(self._functions(*position)[2]) for position in positions])

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) at parameters (n,), traced from the seed.

        Raises:
            PathError: Pi does not get as far on the path.
        """
        return self._course.points(np.atleast_1d(np.asarray(parameters, dtype=float)))

    def jets(self, parameters: np.ndarray) -> np.ndarray:
        """Return (n, 6, 3): point and first five derivatives with respect to pi, at parameters (n,)."""
        wanted = np.atleast_1d(np.asarray(parameters, dtype=float))
        rows = self._jet_sampler.map(len(wanted))(wanted[None, :], self.points(wanted).T)
        return np.stack([np.array(row).T for row in rows], axis=1)

    def normal_components(self, parameters: np.ndarray, transverse: np.ndarray) -> np.ndarray:
        """Return (s1, s2) and their derivatives as they are: they already are two chains."""
        return transverse

    def normal_vectors(self, parameters: np.ndarray, components: np.ndarray, reference: float) -> np.ndarray:
        """Return the components as they are, the inverse of `normal_components`."""
        return components

    def distances(self, positions: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the distances (n,) [m] to the nearest points of the path, whatever pi is; see `gammastar.path.course`."""
        return self._course.distances(np.atleast_2d(np.asarray(positions, dtype=float)), np.asarray(parameters))

    def _continued(self, coordinate: Any, parameter: Any) -> Any:
        """Graph: return the coordinate plus the whole periods that bring it nearest to `parameter`."""
        if self.period is None:
            return coordinate
        return coordinate + self.period * ca.floor((parameter - coordinate) / self.period + 0.5)

    @functools.cached_property
    def _functions(self) -> Any:
        symbols = [ca.SX.sym(axis) for axis in "xyz"]
        formulas = {"s1": self.first, "s2": self.second, "pi": self.coordinate}
        values = [called(formula, symbols, f"{key} of {self.name}") for key, formula in formulas.items()]
        return ca.Function("outputs", symbols, scalars(values, f"s1, s2 or pi of {self.name}"))

    @functools.cached_property
    def _gradient(self) -> Any:
        """The function position -> gradients of s1, s2, pi as rows (3, 3)."""
        position = ca.SX.sym("position", 3)
        values = ca.vertcat(*self._functions(*ca.vertsplit(position)))
        return ca.Function("gradient", [position], [ca.densify(ca.jacobian(values, position))])

    @functools.cached_property
    def _gradient_sampler(self) -> Any:
        position = ca.SX.sym("position", 3)
        return ca.Function(
            "gradient", [position], [ca.vertcat(*self._functions(*ca.vertsplit(position))), self._gradient(position)]
        )

    def _solved(self, target: Any, guess: Any, steps: int) -> Any:
        """Graph: return the position where (s1, s2, pi) take the target values, by Newton steps from a guess."""
        position = guess
        for _ in range(steps):
            values = ca.vertcat(*self._functions(*ca.vertsplit(position)))
            values = ca.vertcat(values[:2], self._continued(values[2], target[2]))
            position = position + ca.mtimes(inverted(self._gradient(position))[0], target - values)
        return position

    @functools.cached_property
    def _course(self) -> Course:
        return Course(self.name, self.domain, self.period, self._seed_point, self._gradient_sampler, self._sampler(2))

    def _sampler(self, order: int) -> Any:
        parameter, guess = ca.SX.sym("parameter"), ca.SX.sym("guess", 3)
        moving = ca.vertcat(parameter, 1, ca.SX.zeros(order - 1))
        series = self.position_series(ca.SX.zeros(2, order + 1), moving, guess)
        return ca.Function("jet", [parameter, guess], ca.cse([ca.densify(row) for row in series.derivatives()]))

    @functools.cached_property
    def _jet_sampler(self) -> Any:
        return self._sampler(JET_ORDER)

    @functools.cached_property
    def _slope_on_path(self) -> float:
        """The length of the gradient of pi on the path, at its seed."""
        return float(np.linalg.norm(np.array(self._gradient(self._seed_point))[2]))

    @functools.cached_property
    def _seed_point(self) -> np.ndarray:
        """Return a point of the path: minimal steps from the seed that solve the linearised s1 = s2 = 0."""
        point = np.asarray(self.seed, dtype=float)
        for _ in range(SEED_STEPS):
            values, gradient = (np.array(value) for value in self._gradient_sampler(point))
            if not np.all(np.isfinite(gradient)):
                break
            point = point - np.linalg.pinv(gradient[:2]) @ values[:2, 0]
        return point

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
from gammastar.checks import array, number
from gammastar.errors import PathError
from gammastar.path.base import JET_ORDER, ORDER, Path, PathOutputs
from gammastar.taylor import Series

SEED_STEPS = 50  # Newton steps from the seed onto the path
FOOT_STEPS = 8  # Newton steps from a position off the path to its foot
SOLVE_STEPS = 4  # Newton steps from a neighbouring solution
TABLE_STEP = 0.05  # [units of pi] between solutions traced one from the other
RETURN_STEPS = 3  # Newton steps back onto the path after each of the following
ON_PATH = 1e-10  # [m], and relative: how near the path a foot must be, so that no distance comes out too small
DISTANCE_STEPS = 8  # of the sequential projection that polishes a distance


@dataclass(frozen=True, eq=False)
class ImplicitPath(Path):
    """The set where two functions of position vanish, with a third one that grows along it.

    Raises:
        PathError: A formula is not a scalar or cannot be differentiated; no point of the path is found from `seed`; or
            the three gradients are dependent there (Assumption 1, Lemma 3).
    """

    first: Callable[[Any, Any, Any], Any]  # graph: s1(x, y, z)
    second: Callable[[Any, Any, Any], Any]  # graph: s2(x, y, z)
    coordinate: Callable[[Any, Any, Any], Any]  # graph: pi(x, y, z), e.g. an angle with atan2
    seed: tuple[float, float, float]  # [m] a point on the path or near it
    period: float | None = None  # of pi on a closed path, 2 pi for an angle
    name: str = "implicit path"
    domain: tuple[float, float] = (-10.0, 10.0)  # of pi, where an open path is drawn

    components = 2

    def __post_init__(self) -> None:
        if self.period is not None:
            number(self.period, f"period of {self.name}", above=0)
            object.__setattr__(self, "domain", (0.0, float(self.period)))
        object.__setattr__(self, "seed", tuple(array(self.seed, f"seed of {self.name}", (3,)).tolist()))
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

    def outputs(self, position: Series, place: Any) -> PathOutputs:
        """Graph: return the outputs along a position series; pi continues the parameter, whole periods included."""
        chi = Series((*position.coefficients[:ORDER], ca.SX(3, 1)))
        rows = [Series(tuple(c[i] for c in chi.coefficients)) for i in range(3)]
        first, second, along = (s.derivatives() for s in taylor.through(self._functions, rows))
        gradient = self._gradient(chi.coefficients[0])
        inverse, determinant = _inverse(gradient)
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
        inverse, _ = _inverse(self._gradient(value))
        chi = [value]
        for k in range(1, order + 1):
            rows = [Series((*(c[i] for c in chi), ca.SX(0))) for i in range(3)]
            known = taylor.through(self._functions, rows)
            missing = ca.vertcat(*(t.coefficients[k] - s.coefficients[k] for t, s in zip(targets, known, strict=True)))
            chi.append(ca.mtimes(inverse, missing))
        return Series(tuple(chi))

    def start_parameter(self, position: np.ndarray) -> float:
        """Return pi at a position: the coordinate function is the projection, Eq. (13)."""
        return float(self._functions(*position)[2])

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) at parameters (n,): Newton steps from a table that is continued from the seed."""
        wanted = np.atleast_1d(np.asarray(parameters, dtype=float))
        start = self.start_parameter(self._seed_point)
        if self.period is not None:
            wanted = start + np.mod(wanted - start, self.period)
        nodes = np.rint((wanted - start) / TABLE_STEP).astype(int)
        table = {0: self._seed_point}
        for sign, count in ((1, max(0, nodes.max())), (-1, max(0, -nodes.min()))):
            for k in range(1, count + 1):
                guess = table[sign * (k - 1)]
                table[sign * k] = np.array(self._point_solver(start + sign * k * TABLE_STEP, guess)).ravel()
        guesses = np.array([table[node] for node in nodes])
        found = np.array(self._point_solver.map(len(wanted))(wanted[None, :], guesses.T)).T
        if not np.all(np.isfinite(found)):
            raise PathError(f"{self.name} could not be traced from its seed; give a seed on the path and a smooth pi")
        return found

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
        """Return the distances (n,) [m]: from the point with the same pi, polished by projections onto the linearised path.

        Exact when pi is the nearest-point projection, Eq. (12), and to second order near the path otherwise; never too
        small by more than the residual of the Newton steps.
        """
        feet = self.points(np.array(self._functions.map(len(positions))(*positions.T[:, None, :])[2]).ravel())
        return np.array(self._distance_solver.map(len(positions))(positions.T, feet.T)).ravel()

    def _continued(self, coordinate: Any, parameter: Any) -> Any:
        """Graph: return the coordinate plus the whole periods that bring it nearest to `parameter`."""
        if self.period is None:
            return coordinate
        return coordinate + self.period * ca.floor((parameter - coordinate) / self.period + 0.5)

    @functools.cached_property
    def _functions(self) -> Any:
        symbols = [ca.SX.sym(axis) for axis in "xyz"]
        try:
            values = [ca.SX(formula(*symbols)) for formula in (self.first, self.second, self.coordinate)]
        except (TypeError, NotImplementedError) as error:
            raise PathError(
                f"the formulas of {self.name} must return CasADi scalars (got {error}); use casadi functions, not numpy or math"
            ) from error
        if any(value.shape != (1, 1) for value in values):
            raise PathError(
                f"s1, s2 and pi of {self.name} must be scalars (got {[v.shape for v in values]}); return one number each"
            )
        return ca.Function("outputs", symbols, values)

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
            position = position + ca.mtimes(_inverse(self._gradient(position))[0], target - values)
        return position

    @functools.cached_property
    def _point_solver(self) -> Any:
        parameter, guess = ca.SX.sym("parameter"), ca.SX.sym("guess", 3)
        return ca.Function("point", [parameter, guess], [self._solved(ca.vertcat(0, 0, parameter), guess, SOLVE_STEPS)])

    @functools.cached_property
    def _jet_sampler(self) -> Any:
        parameter, guess = ca.SX.sym("parameter"), ca.SX.sym("guess", 3)
        moving = ca.vertcat(parameter, 1, ca.SX.zeros(JET_ORDER - 1))
        series = self.position_series(ca.SX.zeros(2, JET_ORDER + 1), moving, guess)
        return ca.Function("jet", [parameter, guess], ca.cse([ca.densify(row) for row in series.derivatives()]))

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

    def _step_onto_path(self, point: Any, ahead: Any) -> Any:
        """Graph: return the shortest step that solves s1 = s2 = 0, linearised at a point, from a position ahead of it."""
        values = ca.vertcat(*self._functions(*ca.vertsplit(point))[:2])
        rows = self._gradient(point)[:2, :]
        residual = values + ca.mtimes(rows, ahead)
        return -ca.mtimes(rows.T, ca.mtimes(_inverse_of_two(ca.mtimes(rows, rows.T)), residual))

    @functools.cached_property
    def _distance_solver(self) -> Any:
        position, foot = ca.SX.sym("position", 3), ca.SX.sym("foot", 3)
        nearest, point = ca.norm_2(position - foot), foot
        for _ in range(DISTANCE_STEPS):
            point = position + self._step_onto_path(point, position - point)
            for _ in range(RETURN_STEPS):
                point = point + self._step_onto_path(point, ca.DM.zeros(3))
            distance = ca.norm_2(position - point)
            left = ca.norm_2(self._step_onto_path(point, ca.DM.zeros(3)))
            is_nearer = ca.logic_and(distance < nearest, left < ON_PATH * (1 + distance))
            nearest = ca.if_else(is_nearer, distance, nearest)
        return ca.Function("distance", [position, foot], [nearest])


def _inverse(matrix: Any) -> tuple[Any, Any]:
    """Graph: return the inverse of an SX (3, 3) by cross products of its rows, and its determinant."""
    first, second, third = (matrix[i, :].T for i in range(3))
    columns = ca.horzcat(ca.cross(second, third), ca.cross(third, first), ca.cross(first, second))
    determinant = ca.dot(first, columns[:, 0])
    return columns / determinant, determinant


def _inverse_of_two(matrix: Any) -> Any:
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    return ca.vertcat(ca.horzcat(matrix[1, 1], -matrix[0, 1]), ca.horzcat(-matrix[1, 0], matrix[0, 0])) / determinant

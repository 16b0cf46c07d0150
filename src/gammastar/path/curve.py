"""A path given as a regular curve sigma(lambda): only its jet at the nearest parameter enters, in any parameterisation.

With e = chi - sigma(lambda) and lambda solving <e, sigma'> = 0 along the flight, the transverse output is e itself, and
xi_{k+1} = P d/dt xi_k with the projector P onto the normal plane.  In any rotation-minimising frame the components of
xi_k are plain derivatives of the components of e, so this is the paper's construction without a frame: nothing to
compute, store or close up around a loop, and zero curvature is no special case.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import taylor
from gammastar.checks import array, direction, number
from gammastar.errors import PathError
from gammastar.path import bishop
from gammastar.path.base import JET_ORDER, ORDER, Path, PathOutputs
from gammastar.taylor import Series

NEWTON_STEPS = 2  # from a guess off by 1e-3 the error is 1e-6, then 1e-12 (quadratic)
SMALLEST_SLOPE = 1e-3  # of the tracking equation, relative: inside the focal set Newton would run to the farthest point
SEARCH_POINTS = 4096  # samples of the global search for the start
SEARCH_DOUBLINGS = 24  # of the half-width of the search on an open curve


@dataclass(frozen=True, eq=False)
class Curve(Path):
    """A regular curve of class C^5 with its parameter tracked by Newton steps inside the graph.

    Raises:
        PathError: The formula is not three scalars, cannot be differentiated, is not finite, or stands still somewhere.
    """

    point: Callable[[Any], Any]  # graph: parameter SX -> three scalars [m], world; any CasADi expression
    period: float | None = None  # of the parameter, for a closed curve
    name: str = "curve"
    plane_normal: tuple[float, float, float] | None = None  # of a planar curve: its normal frame is then closed form
    domain: tuple[float, float] = (-10.0, 10.0)  # where an open curve is checked, searched first, and drawn

    components = 3

    def __post_init__(self) -> None:
        if self.period is not None:
            number(self.period, f"period of {self.name}", above=0)
            object.__setattr__(self, "domain", (0.0, float(self.period)))
        low, high = array(self.domain, f"domain of {self.name}", (2,))
        if not low < high:
            raise PathError(f"the domain of {self.name} must be an interval (got {low:g} to {high:g}); give low < high")
        if self.plane_normal is not None:
            object.__setattr__(self, "plane_normal", tuple(direction(self.plane_normal, "plane_normal")))
        self._check_regular()

    def jet(self, parameter: Any, order: int = JET_ORDER) -> tuple[Any, ...]:
        """Graph: return (sigma, sigma', ..., sigma^(order)), SX (3,) each, at a parameter."""
        series = Series((parameter, ca.SX(1), *(ca.SX(0) for _ in range(order - 1))))
        scalars = taylor.through(self._point_function, [series])
        return tuple(ca.vertcat(*rows) for rows in zip(*(s.derivatives() for s in scalars), strict=True))

    def outputs(self, position: Series, parameter: Any) -> PathOutputs:
        """Graph: return the outputs along a position series; see the module's first lines and `outputs_from_jet`."""
        return outputs_from_jet(self.jet(parameter), position, parameter)

    def track(self, position: Any, parameter: Any, steps: int = NEWTON_STEPS) -> Any:
        """Graph: return the parameter of the nearest point by Newton steps on <chi - sigma, sigma'> = 0."""
        for _ in range(steps):
            point, tangent, second = self.jet(parameter, 2)
            error = position - point
            speed_squared = ca.dot(tangent, tangent)
            slope = ca.fmax(speed_squared - ca.dot(error, second), SMALLEST_SLOPE * speed_squared)
            parameter = parameter + ca.dot(error, tangent) / slope
        return parameter

    def position_series(self, transverse: Any, tangential: Any, guess: Any = None) -> Series:
        """Graph: return the position series with these outputs; the transverse columns are vectors of the normal plane."""
        order = transverse.shape[1] - 1
        step = Series.from_derivatives([ca.SX(0), *ca.vertsplit(tangential[1:])])
        jet = self.jet(tangential[0])
        tangent = _along(jet[1:], step)
        field = Series((transverse[:, order],))
        for k in reversed(range(order)):
            field = _normal_field(transverse[:, k], field, tangent)
        return _along(jet, step) + field

    def start_parameter(self, position: np.ndarray) -> float:
        """Return the parameter of the nearest point: best of a dense sample, then Newton steps.

        On an open curve the sampled interval is doubled until the best sample lies inside it.
        """
        low, high = self.domain
        for _ in range(SEARCH_DOUBLINGS):
            grid = np.linspace(low, high, SEARCH_POINTS)
            distances = np.linalg.norm(self.points(grid) - position, axis=1)
            best = int(np.argmin(distances))
            if self.period is not None or 0 < best < SEARCH_POINTS - 1:
                break
            low, high = low - (high - low) / 2, high + (high - low) / 2
        parameter = float(grid[best])
        for _ in range(20):
            parameter = float(self._tracker(position, parameter))
        return parameter

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) [m] at parameters (n,)."""
        return np.column_stack([np.array(c).ravel() for c in self._sampler(np.atleast_1d(parameters)[None, :])])

    def jets(self, parameters: np.ndarray) -> np.ndarray:
        """Return (n, 6, 3): point and first five derivatives with respect to the parameter, at parameters (n,)."""
        rows = self._jet_sampler(np.atleast_1d(parameters)[None, :])
        return np.stack([np.array(row).T for row in rows], axis=1)

    def tangents(self, parameters: np.ndarray) -> np.ndarray:
        """Return the unit tangents (n, 3) at parameters (n,)."""
        derivative = np.array(self._derivative_sampler(np.atleast_1d(parameters)[None, :])[1]).T
        return np.asarray(derivative / np.linalg.norm(derivative, axis=1, keepdims=True))

    def normals(self, parameters: np.ndarray, reference: float) -> np.ndarray:
        """Return rotation-minimising normal frames (n, 3, 2), transported from the parameter `reference`."""
        tangents = self.tangents(parameters)
        if self.plane_normal is not None:
            second = np.broadcast_to(np.asarray(self.plane_normal), tangents.shape)
            return np.stack([np.cross(tangents, second), second], axis=-1)
        return bishop.transported_normals(self._tangent_and_rate, parameters, tangents, reference)

    def normal_components(self, parameters: np.ndarray, transverse: np.ndarray) -> np.ndarray:
        """Return the components (k, 2, 4) of normal vectors (k, 3, 4) in a rotation-minimising frame."""
        return np.asarray(np.einsum("kia,kij->kaj", self.normals(parameters, float(parameters[0])), transverse))

    def normal_vectors(self, parameters: np.ndarray, components: np.ndarray, reference: float) -> np.ndarray:
        """Return the normal vectors (k, 3, m) of components (k, 2, m)."""
        return np.asarray(np.einsum("kia,kaj->kij", self.normals(parameters, reference), components))

    def distances(self, positions: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the distances (n,) [m] to the nearest points, polished from parameters (n,)."""
        polished = np.array(self._tracker.map(len(positions))(positions.T, parameters[None, :])).ravel()
        return np.asarray(np.linalg.norm(positions - self.points(polished), axis=1))

    @functools.cached_property
    def _point_function(self) -> Any:
        parameter = ca.SX.sym("parameter")
        try:
            entries = [ca.SX(entry) for entry in _entries(self.point(parameter))]
        except (TypeError, NotImplementedError) as error:
            raise PathError(
                f"the formula of {self.name} must return three CasADi scalars (got {error}); use casadi functions, not numpy or math"
            ) from error
        if len(entries) != 3 or any(entry.shape != (1, 1) for entry in entries):
            raise PathError(
                f"the formula of {self.name} must return three scalars (got {len(entries)} entries); return x, y, z"
            )
        return ca.Function("point", [parameter], entries)

    @functools.cached_property
    def _sampler(self) -> Any:
        parameter = ca.SX.sym("parameter")
        return ca.Function("points", [parameter], self._point_function.call([parameter]))

    @functools.cached_property
    def _derivative_sampler(self) -> Any:
        parameter = ca.SX.sym("parameter")
        return ca.Function("jet", [parameter], list(self.jet(parameter, 2)))

    @functools.cached_property
    def _jet_sampler(self) -> Any:
        parameter = ca.SX.sym("parameter")
        return ca.Function("jet", [parameter], ca.cse([ca.densify(row) for row in self.jet(parameter)]))

    @functools.cached_property
    def _tracker(self) -> Any:
        position, parameter = ca.SX.sym("position", 3), ca.SX.sym("parameter")
        return ca.Function("track", [position, parameter], [self.track(position, parameter)])

    def _tangent_and_rate(self, parameter: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the unit tangent (3,) and its derivative (3,) with respect to the parameter."""
        _, first, second = (np.array(value).ravel() for value in self._derivative_sampler(parameter))
        speed = np.linalg.norm(first)
        tangent = first / speed
        return tangent, (second - tangent * (tangent @ second)) / speed

    def _check_regular(self) -> None:
        grid = np.linspace(*self.domain, 512)
        values = [np.array(value) for value in self._derivative_sampler(grid[None, :])]
        speeds = np.linalg.norm(values[1], axis=0)
        bad = ~np.isfinite(np.vstack(values)).all(axis=0)
        if bad.any():
            raise PathError(
                f"{self.name} must be finite (got NaN or infinity at parameter {grid[bad.argmax()]:.4g}); "
                "check its numbers"
            )
        if speeds.min() <= 1e-9 * max(1.0, speeds.max()):
            raise PathError(
                f"{self.name} must be regular (got zero speed at parameter {grid[speeds.argmin()]:.4g}); "
                "give it a size, or another parameterisation"
            )
        if self.plane_normal is not None and np.abs(np.asarray(self.plane_normal) @ values[1] / speeds).max() > 1e-9:
            raise PathError(
                f"{self.name} must lie in the plane of its plane_normal (got a tangent out of it); leave it out"
            )
        if self.period is not None:
            gap = float(np.linalg.norm(self.points(np.array(self.domain[:1])) - self.points(np.array(self.domain[1:]))))
            size = float(np.ptp(values[0], axis=1).max())
            if gap > 1e-9 * size:
                raise PathError(
                    f"{self.name} must close after its period (got a gap of {gap:.3g} m); correct the period"
                )


def outputs_from_jet(jet: tuple[Any, ...], position: Series, parameter: Any) -> PathOutputs:
    """Graph: return the outputs from a curve's jet (sigma, ..., sigma^(5)) alone: one law serves every curve.

    lambda(t) solves <chi - sigma(lambda), sigma'(lambda)> = 0 order by order; each order costs one division by
    |sigma'|^2 - <e, sigma''>, which vanishes at focal points.
    """
    chi = Series((*position.coefficients[:ORDER], ca.SX(3, 1)))
    slope = ca.dot(jet[1], jet[1]) - ca.dot(chi.coefficients[0] - jet[0], jet[2])
    step: list[Any] = [ca.SX(0)]
    for k in range(1, ORDER + 1):
        trial = Series((*step, ca.SX(0)))
        error = chi.truncated(k) - _along(jet, trial)
        step.append(error.dot(_along(jet[1:], trial)).coefficients[k] / slope)
    progress = Series(tuple(step))
    error, tangent = chi - _along(jet, progress), _along(jet[1:], progress)
    fields = [error]
    for _ in range(ORDER):
        fields.append(_normal_part(fields[-1].rate(), tangent))
    rates = progress.derivatives()
    speed_squared = ca.dot(jet[1], jet[1])
    drift, rate_drift = fields[ORDER].coefficients[0], rates[ORDER]

    def snap(transverse_rate: Any, tangential_rate: Any) -> Any:
        across = transverse_rate - drift
        along = (slope * (tangential_rate - rate_drift) - ca.dot(jet[1], across)) / speed_squared
        return across + along * jet[1]

    return PathOutputs(
        transverse=ca.horzcat(*(f.coefficients[0] for f in fields[:ORDER])),
        tangential=ca.vertcat(parameter, *rates[1:ORDER]),
        transverse_drift=drift,
        tangential_drift=rate_drift,
        transverse_gradient=ca.SX.eye(3) - ca.mtimes(jet[1], jet[1].T) / speed_squared,
        tangential_gradient=jet[1].T / slope,
        focal_margin=slope / speed_squared,
        snap=snap,
    )


def _along(jet: tuple[Any, ...], step: Series) -> Series:
    """Graph: return the series of sigma(lambda + step(t)) from the jet of sigma at lambda; step starts at zero."""
    coefficients = [jet[0], *(ca.SX(*jet[0].shape) for _ in range(step.order))]
    power = Series.constant(1.0, step.order)
    for k in range(1, step.order + 1):
        power = power * step
        for i in range(k, step.order + 1):  # the first k coefficients of step^k are zero
            coefficients[i] = coefficients[i] + jet[k] / math.factorial(k) * power.coefficients[i]
    return Series(tuple(coefficients))


def _normal_part(field: Series, tangent: Series) -> Series:
    """Graph: return P field, the part orthogonal to the tangent."""
    along = field.dot(tangent) / tangent.dot(tangent)
    return field - along * tangent


def _normal_field(value: Any, normal_rate: Series, tangent: Series) -> Series:
    """Graph: return the normal field w, w(0) = value, P w' = normal_rate.

    The rest of w' follows from <tangent, w> = 0: w' = normal_rate - tangent <tangent', w> / |tangent|^2.
    """
    field = Series((value,))
    turning, square = tangent.rate(), tangent.dot(tangent)
    for _ in range(normal_rate.order + 1):
        along = turning.dot(field) / square
        field = (normal_rate - along * tangent).truncated(field.order).integrated_from(value)
    return field


def _entries(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (tuple, list)) else list(ca.vertsplit(value))

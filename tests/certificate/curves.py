"""Curves that the tests of the certificate share: with closed forms, with faults, and turned anyhow in space."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from scipy.interpolate import make_interp_spline

from gammastar.path import Curve, Path
from gammastar.vehicle import Vehicle

TURN = 2 * np.pi
QUAD = Vehicle(mass=0.5, inertia=(4e-3, 4e-3, 7e-3), gravity=9.80665)
SATELLITE = Vehicle(mass=5.0, inertia=(8.05e-3, 5.158e-2, 5.124e-2), gravity=0.0)

Formula = Callable[[Any], tuple[Any, Any, Any]]


def trefoil(t: Any) -> tuple[Any, Any, Any]:
    return ca.sin(t) + 2 * ca.sin(2 * t), ca.cos(t) - 2 * ca.cos(2 * t), -ca.sin(3 * t)


def lissajous(t: Any) -> tuple[Any, Any, Any]:
    return ca.sin(3 * t + 0.3), ca.sin(4 * t), ca.sin(7 * t)


def figure_eight(t: Any) -> tuple[Any, Any, Any]:
    """Graph: cross itself at right angles to nothing in particular, at parameters 0 and pi."""
    return 2 * ca.sin(t), ca.sin(2 * t), 0 * t


def pinched(t: Any) -> tuple[Any, Any, Any]:
    """Graph: touch itself without crossing, at parameters pi/2 and 3 pi/2."""
    return 2 * ca.cos(t), ca.sin(t) * ca.cos(t) ** 2, 0 * t


def uneven(t: Any) -> Any:
    """Graph: a change of parameter that keeps the period 2 pi."""
    return t + 0.3 * ca.sin(t)


class Unchecked(Curve):
    """A curve that nobody has looked at before the certificate does."""

    def _check(self) -> None:
        pass


def closed(formula: Formula, period: float = TURN) -> Curve:
    return Unchecked(formula, period=period, name="closed")


def opened(formula: Formula, low: float, high: float) -> Curve:
    return Unchecked(formula, domain=(low, high), name="opened")


def placed(formula: Formula, rotation: np.ndarray, shift: np.ndarray) -> Formula:
    """Return the formula of a curve turned and moved."""
    return lambda t: tuple(ca.vertsplit(ca.mtimes(ca.DM(rotation), ca.vertcat(*formula(t))) + ca.DM(shift)))


def loop(radius: float) -> Curve:
    """Return a vertical circle, its top (third axis down) at parameter pi."""
    return closed(lambda t: (radius * ca.sin(t), 0, radius * ca.cos(t)))


class Waypoints:
    """A closed spline through points: jets from SciPy, and nothing else that a certificate needs."""

    name = "waypoints"

    def __init__(self, points: np.ndarray, degree: int = 7) -> None:
        self.knots = np.arange(len(points) + 1.0)
        self.period = float(len(points))
        self.domain = (0.0, self.period)
        spline = make_interp_spline(self.knots, np.vstack([points, points[:1]]), k=degree, bc_type="periodic")
        self._derivatives = [spline.derivative(k) if k else spline for k in range(6)]

    def jets(self, parameters: np.ndarray) -> np.ndarray:
        inside = np.mod(parameters, self.period)
        return np.stack([derivative(inside) for derivative in self._derivatives], axis=1)


Path.register(Waypoints)  # certified by what it has, like any other path


class Harmonics:
    """A closed curve of random harmonics, in space or in a plane."""

    name = "harmonics"
    period = TURN
    domain = (0.0, TURN)
    knots = np.empty(0)

    def __init__(self, count: int, seed: int, planar: bool) -> None:
        generator = np.random.default_rng(seed)
        self._orders = np.arange(1, count + 1)
        self._sines, self._cosines = generator.normal(size=(2, count, 3)) / self._orders[:, None] ** 1.5
        if planar:
            self._sines[:, 2] = self._cosines[:, 2] = 0

    def jets(self, parameters: np.ndarray) -> np.ndarray:
        phases = [np.outer(parameters, self._orders) + k * np.pi / 2 for k in range(6)]
        rows = [
            (np.sin(phase) * self._orders**k) @ self._sines + (np.cos(phase) * self._orders**k) @ self._cosines
            for k, phase in enumerate(phases)
        ]
        return np.stack(rows, axis=1)


def ring(count: int, seed: int = 1) -> Waypoints:
    """Return a path through points scattered about a large closed curve."""
    angle = np.linspace(0, TURN, count, endpoint=False)
    points = np.column_stack([20 * np.cos(angle), 14 * np.sin(angle), 3 * np.sin(3 * angle)])
    return Waypoints(points + np.random.default_rng(seed).normal(scale=0.4, size=points.shape))


def wandering(count: int, seed: int = 1) -> Waypoints:
    """Return a path through the points of a random walk that comes back to its start."""
    steps = np.random.default_rng(seed).normal(size=(count, 3))
    return Waypoints(np.cumsum(steps - steps.mean(axis=0), axis=0))

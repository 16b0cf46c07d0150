"""One step of a motion on SO(3) x R^n: R' = R hat(Omega), y' = f; each method states its order, and tests measure it.

R' = R hat(Omega) multiplies on the right, which flips the sign of the commutator in textbook RKMK4; in Cayley
coordinates the exact coordinate rate `so3.cayley_rate` is used instead, so no commutator appears.  Averaging the stage
rates of an RK4 into one exponential would have order 2, not 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import so3
from gammastar.errors import UnknownNameError

Field = Callable[[Any, Any, Any], tuple[Any, Any]]
"""Graph: (time SX, attitude SX (3, 3), euclidean SX (n,)) -> (body rate SX (3,), euclidean rate SX (n,))."""


@dataclass(frozen=True)
class Integrator:
    """A method of fixed step; `advance` is a graph: (field, time, attitude, euclidean, step) -> (attitude, euclidean)."""

    name: str
    order: int  # of the global error, for smooth fields
    keeps_group: bool  # whether R stays in SO(3) up to rounding, whatever the step
    source: str
    advance: Callable[[Field, Any, Any, Any, Any], tuple[Any, Any]]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta scheme; it checks itself: rows sum to nodes, weights to one."""

    nodes: tuple[float, ...]
    rows: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        assert np.allclose([sum(row) for row in self.rows], self.nodes, rtol=0, atol=1e-14)
        assert abs(sum(self.weights) - 1) < 1e-14


CLASSICAL = Tableau((0.0, 0.5, 0.5, 1.0), ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6))


@dataclass(frozen=True)
class LowStorage:
    """A scheme in 2N storage: dy_i = a_i dy_{i-1} + h f(y_{i-1}), y_i = y_{i-1} + b_i dy_i; it checks itself."""

    a: tuple[float, ...]
    b: tuple[float, ...]
    nodes: tuple[float, ...]

    def __post_init__(self) -> None:
        weights = np.zeros((len(self.a), len(self.a)))  # rows: how y_i depends on the stage rates
        update, total = np.zeros(len(self.a)), np.zeros(len(self.a))
        for i, (a, b) in enumerate(zip(self.a, self.b, strict=True)):
            assert abs(total.sum() - self.nodes[i]) < 1e-10
            update = a * update + np.eye(len(self.a))[i]
            total = total + b * update
            weights[i] = total
        assert abs(total.sum() - 1) < 1e-10


CARPENTER_KENNEDY = LowStorage(
    a=(
        0.0,
        -567301805773 / 1357537059087,
        -2404267990393 / 2016746695238,
        -3550918686646 / 2091501179385,
        -1275806237668 / 842570457699,
    ),
    b=(
        1432997174477 / 9575080441755,
        5161836677717 / 13612068292357,
        1720146321549 / 2090206949498,
        3134564353537 / 4481467310338,
        2277821191437 / 14882151754819,
    ),
    nodes=(
        0.0,
        1432997174477 / 9575080441755,
        2526269341429 / 6820363962896,
        2006345519317 / 3224310063776,
        2802321613138 / 2924317926251,
    ),
)


def _combination(coefficients: tuple[float, ...], values: list[Any]) -> Any:
    """Graph: return the sum of coefficient times value, skipping exact zeros."""
    terms = [c * value for c, value in zip(coefficients, values, strict=False) if c != 0]
    return sum(terms[1:], terms[0]) if terms else 0


def _turned(attitude: Any, increment: Any) -> Any:
    """Graph: return R (I + D) as R + R D.

    The entries of I + D near one round the same way in every step of a steady turn, and 60,000 equal roundings add up where
    different ones cancel.
    """
    return attitude + attitude @ increment


def _composed(first: Any, second: Any) -> Any:
    """Graph: return D with I + D = (I + D1)(I + D2): increments are composed first and turn the attitude once."""
    return first + second + first @ second


def _rkmk4_cayley(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
    """Graph: classical RK4 for (w, y) with R = R0 cay(w)."""
    turns: list[Any] = []
    rates: list[Any] = []
    for node, row in zip(CLASSICAL.nodes, CLASSICAL.rows, strict=True):
        if not row:
            omega, rate = field(time, attitude, euclidean)
            turns.append(omega)
        else:
            w = step * _combination(row, turns)
            omega, rate = field(
                time + node * step,
                _turned(attitude, so3.cayley_increment(w)),
                euclidean + step * _combination(row, rates),
            )
            turns.append(so3.cayley_rate(w, omega))
        rates.append(rate)
    moved = _turned(attitude, so3.cayley_increment(step * _combination(CLASSICAL.weights, turns)))
    return moved, euclidean + step * _combination(CLASSICAL.weights, rates)


def _cf4(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
    """Graph: the commutator-free method with two exponentials in the last stage and in the update."""
    k1, f1 = field(time, attitude, euclidean)
    half = so3.exp_increment(step * k1 / 2)
    k2, f2 = field(time + step / 2, _turned(attitude, half), euclidean + step * f1 / 2)
    middle = _turned(attitude, so3.exp_increment(step * k2 / 2))
    k3, f3 = field(time + step / 2, middle, euclidean + step * f2 / 2)
    last = _turned(attitude, _composed(half, so3.exp_increment(step * (k3 - k1 / 2))))
    k4, f4 = field(time + step, last, euclidean + step * f3)
    moved = _composed(
        so3.exp_increment(step * (3 * k1 + 2 * k2 + 2 * k3 - k4) / 12),
        so3.exp_increment(step * (-k1 + 2 * k2 + 2 * k3 + 3 * k4) / 12),
    )
    return _turned(attitude, moved), euclidean + step * (f1 + 2 * f2 + 2 * f3 + f4) / 6


def _lie_euler(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
    """Graph: one exponential of the rate at the start."""
    omega, rate = field(time, attitude, euclidean)
    return _turned(attitude, so3.exp_increment(step * omega)), euclidean + step * rate


def _carpenter_kennedy(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
    """Graph: five stages in 2N storage, each update one exponential."""
    turn: Any = 0
    change: Any = 0
    moved: Any = ca.SX(3, 3)
    scheme = CARPENTER_KENNEDY
    for a, b, node in zip(scheme.a, scheme.b, scheme.nodes, strict=True):
        omega, rate = field(time + node * step, _turned(attitude, moved), euclidean)
        turn, change = a * turn + step * omega, a * change + step * rate
        moved, euclidean = _composed(moved, so3.exp_increment(b * turn)), euclidean + b * change
    return _turned(attitude, moved), euclidean


def _rk4_entries(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
    """Graph: classical RK4 on the nine entries of R as if they were free; it leaves the group."""

    def rates(node: float, R: Any, y: Any) -> tuple[Any, Any]:
        omega, rate = field(time + node * step, R, y)
        return R @ so3.hat(omega), rate

    slopes: list[Any] = []
    changes: list[Any] = []
    for node, row in zip(CLASSICAL.nodes, CLASSICAL.rows, strict=True):
        R, y = attitude + step * _combination(row, slopes), euclidean + step * _combination(row, changes)
        slope, change = rates(node, R, y)
        slopes.append(slope)
        changes.append(change)
    weights = CLASSICAL.weights
    return attitude + step * _combination(weights, slopes), euclidean + step * _combination(weights, changes)


INTEGRATORS = {
    method.name: method
    for method in (
        Integrator(
            "rkmk4",
            4,
            True,
            "Munthe-Kaas, BIT 38 (1998), in the Cayley coordinates of Iserles, Found. Comput. Math. 1 (2001)",
            _rkmk4_cayley,
        ),
        Integrator("cf4", 4, True, "Celledoni, Marthinsen, Owren, FGCS 19 (2003), Eq. (12)", _cf4),
        Integrator("lie-euler", 1, True, "Iserles et al., Acta Numerica 9 (2000)", _lie_euler),
        Integrator(
            "carpenter-kennedy",
            4,
            True,
            "Carpenter, Kennedy, NASA TM 109112 (1994), on a group as in Bazavov, Chuna, arXiv:2101.05320",
            _carpenter_kennedy,
        ),
        Integrator("rk4", 4, False, "Kutta (1901), on the nine entries; for comparison only", _rk4_entries),
    )
}


def integrator(name: str) -> Integrator:
    """Return a method by name, or raise `UnknownNameError` with the known ones."""
    if not isinstance(name, str) or name not in INTEGRATORS:
        raise UnknownNameError("integrator", name, INTEGRATORS)
    return INTEGRATORS[name]

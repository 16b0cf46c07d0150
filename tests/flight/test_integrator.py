"""Integrators: each has the order it declares, on a torqued body, on a free one with an exact solution, and keeps the group.

The closed loop against the oracle is measured in test_oracle.py.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.integrate

from gammastar import engine, so3
from gammastar.errors import UnknownNameError
from gammastar.flight.integrator import (
    CARPENTER_KENNEDY,
    CLASSICAL,
    INTEGRATORS,
    Field,
    Integrator,
    LowStorage,
    Tableau,
    integrator,
)

IDENTITY = np.eye(3)
INERTIA = np.diag([0.01, 0.02, 0.025])
LOADED, FREE = np.array([1.0, 2.0, -1.0]), np.array([0.5, -1.0, 2.0])


def torqued_body(time: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
    """Graph: a body under a torque that changes with time and with attitude."""
    J = ca.DM(INERTIA)
    torque = ca.vertcat(0.02 * ca.cos(2 * time), 0.01 * ca.sin(3 * time), 0.015) + 0.01 * attitude[2, :].T
    return euclidean, ca.mtimes(ca.inv(J), torque - ca.cross(euclidean, ca.mtimes(J, euclidean)))


def free_body(time: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
    """Graph: the same body without torque."""
    J = ca.DM(INERTIA)
    return euclidean, -ca.mtimes(ca.inv(J), ca.cross(euclidean, ca.mtimes(J, euclidean)))


def free_symmetric_body(time: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
    """Graph: a body with moments (A, A, C), no torque."""
    J = ca.DM(np.diag([0.02, 0.02, 0.03]))
    return euclidean, -ca.mtimes(ca.inv(J), ca.cross(euclidean, ca.mtimes(J, euclidean)))


def turned(
    advance: Callable, field: Field, steps: int, duration: float, rates: np.ndarray, attitude: np.ndarray = IDENTITY
) -> tuple[np.ndarray, np.ndarray]:
    """Return attitudes (steps + 1, 3, 3) and rates from an attitude."""
    x, time = ca.SX.sym("x", 12), ca.SX.sym("time")
    R, w = advance(field, time, ca.reshape(x[:9], 3, 3), x[9:], duration / steps)
    step = ca.Function("step", [x, time], [ca.densify(ca.vertcat(ca.vec(R), w)), ca.SX(0)])
    times = np.arange(steps)[None] * duration / steps
    states, _ = engine.scan(step, np.concatenate([so3.stack(attitude), rates]), lambda a, b: times[:, a:b], steps)
    return states[:9].T.reshape(-1, 3, 3).swapaxes(1, 2), states[9:].T


@functools.cache
def reference() -> np.ndarray:
    """Return attitude and rates of the torqued body after 2 s: an adaptive integrator of order 8 on a quaternion."""

    def rate(time: float, y: np.ndarray) -> np.ndarray:
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        R = so3.from_quaternion(q)
        torque = np.array([0.02 * np.cos(2 * time), 0.01 * np.sin(3 * time), 0.015]) + 0.01 * R[2]
        turning = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([turning, np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))])

    y = np.concatenate([[1, 0, 0, 0], LOADED])
    y = scipy.integrate.solve_ivp(rate, (0, 2), y, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return np.concatenate([so3.from_quaternion(y[:4] / np.linalg.norm(y[:4])).ravel(), y[4:]])


def order_of(errors: list[float]) -> float:
    """Return the slope of the error over the step: fitted over halvings, both ends weighted alike."""
    return float(-np.polyfit(np.arange(len(errors)), np.log2(errors), 1)[0])


def torqued_order(advance: Callable, counts: tuple[int, ...]) -> float:
    errors = []
    for count in counts:
        attitudes, rates = turned(advance, torqued_body, count, 2.0, LOADED)
        errors.append(float(np.linalg.norm(np.concatenate([attitudes[-1].ravel(), rates[-1]]) - reference())))
    return order_of(errors)


COUNTS = {1: (2000, 4000, 8000), 2: (200, 400, 800), 4: (80, 160, 320, 640)}


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_the_order_on_a_torqued_body_is_the_declared_one(method: Integrator) -> None:
    assert torqued_order(method.advance, COUNTS[method.order]) == pytest.approx(method.order, abs=0.15)


def averaged_rk4(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
    """Graph: the classic mistake: RK4 whose stage rates are averaged into one exponential."""
    k1, f1 = field(time, attitude, euclidean)
    k2, f2 = field(time + step / 2, attitude @ so3.exp(step * k1 / 2), euclidean + step * f1 / 2)
    k3, f3 = field(time + step / 2, attitude @ so3.exp(step * k2 / 2), euclidean + step * f2 / 2)
    k4, f4 = field(time + step, attitude @ so3.exp(step * k3), euclidean + step * f3)
    moved = attitude @ so3.exp(step * (k1 + 2 * k2 + 2 * k3 + k4) / 6)
    return moved, euclidean + step * (f1 + 2 * f2 + 2 * f3 + f4) / 6


def test_the_measurement_tells_a_wrong_method_apart() -> None:
    """Averaging the stage rates has order 2, not 4 (design, section 3.8); the same harness says so."""
    assert torqued_order(averaged_rk4, COUNTS[2]) == pytest.approx(2, abs=0.15)


def test_a_flipped_commutator_sign_would_be_found() -> None:
    """The Cayley rate with the sign of left multiplication drops rkmk4 to a low order."""

    def flipped(field: Field, time: Any, attitude: Any, euclidean: Any, step: Any) -> tuple[Any, Any]:
        right = so3.cayley_rate
        try:
            so3.cayley_rate = lambda w, omega: right(-w, omega)
            return INTEGRATORS["rkmk4"].advance(field, time, attitude, euclidean, step)
        finally:
            so3.cayley_rate = right

    assert torqued_order(flipped, COUNTS[2]) < 2.2


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_the_order_on_a_free_symmetric_body_is_at_least_the_declared_one(method: Integrator) -> None:
    """Exact solution: R = exp(t H / A) exp((1 - C / A) w3 t e3) with the constant angular momentum H in the world."""
    ratio = 0.03 / 0.02
    momentum = np.array([FREE[0], FREE[1], ratio * FREE[2]])  # H / A
    exact = so3.exp(2.0 * momentum) @ so3.exp([0, 0, 2.0 * (1 - ratio) * FREE[2]])
    errors = []
    for count in COUNTS[method.order]:
        attitudes, _ = turned(method.advance, free_symmetric_body, count, 2.0, FREE)
        errors.append(np.linalg.norm(attitudes[-1] - exact))
    assert order_of(errors) > method.order - 0.15


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_energy_and_angular_momentum_of_a_free_body_are_kept_to_the_order(method: Integrator) -> None:
    losses = []
    for count in (400, 800):
        attitudes, rates = turned(method.advance, free_body, count, 4.0, FREE)
        momentum = np.einsum("kij,kj->ki", attitudes, rates @ INERTIA)
        energy = np.einsum("ki,ij,kj->k", rates, INERTIA, rates)
        losses.append(
            max(
                np.abs(momentum - momentum[0]).max() / np.linalg.norm(momentum[0]), np.abs(energy / energy[0] - 1).max()
            )
        )
    assert losses[0] < {1: 5e-2, 4: 1e-6}[method.order]
    assert losses[1] < losses[0] / 2 ** (method.order - 0.3)


@pytest.mark.parametrize("name", ["cf4", "lie-euler", "carpenter-kennedy"])
def test_exponential_methods_are_exact_for_a_constant_rate(name: str) -> None:
    """One step of a whole turn's size: the flow is a one-parameter subgroup."""
    rate = np.array([0.7, -0.4, 0.9])
    field = lambda time, attitude, euclidean: (ca.DM(rate), 0 * euclidean)  # noqa: E731
    attitudes, _ = turned(INTEGRATORS[name].advance, field, 3, 4.0, rate)
    assert attitudes[-1] == pytest.approx(so3.exp(4.0 * rate), abs=1e-14)


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_euclidean_parts_are_integrated_to_the_order_too(method: Integrator) -> None:
    """Y' = cos(3 t) y, y = exp(sin(3 t) / 3): the nodes in time are right."""
    errors = []
    for count in (20, 40, 80):
        field = lambda time, attitude, y: (0 * y, ca.cos(3 * time) * y)  # noqa: E731
        _, y = turned(method.advance, field, count, 2.0, np.ones(3))
        errors.append(abs(y[-1, 0] - np.exp(np.sin(6.0) / 3)))
    assert order_of(errors) > method.order - 0.15


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_group_methods_stay_on_the_group_whatever_the_step(method: Integrator) -> None:
    """60 s at 2 ms, and 6 s at 0.2 s: rounding for group methods; plain RK4 on nine entries leaves at its own order."""
    fine = so3.drift(turned(method.advance, free_body, 30_000, 60.0, FREE)[0])
    coarse = so3.drift(turned(method.advance, free_body, 30, 6.0, FREE)[0])
    if method.keeps_group:
        assert fine <= 1e-12
        assert coarse <= 1e-14
    else:
        assert coarse > 1e-4
        assert fine > 1e-12


@pytest.mark.parametrize("name", [name for name, method in INTEGRATORS.items() if method.keeps_group])
def test_a_steady_rotation_does_not_repeat_its_rounding(name: str) -> None:
    """60 s at 1 ms and a constant rate: every step is the same, its rounding must not be (60,000 x 1e-16 would be 6e-12)."""
    field = lambda time, attitude, euclidean: (euclidean, 0 * euclidean)  # noqa: E731
    for rate in ([0.1, 0.05, 0.02], [0.0, 0.3, 0.0], [1.0, 0.0, 0.0]):
        attitudes, _ = turned(INTEGRATORS[name].advance, field, 60_000, 60.0, np.array(rate))
        assert so3.drift(attitudes) <= 1e-12


@pytest.mark.parametrize("speed", [1.4, 2.0])
@pytest.mark.parametrize("name", [name for name, method in INTEGRATORS.items() if method.keeps_group])
def test_a_steady_circle_does_not_repeat_its_rounding(name: str, speed: float) -> None:
    """The attitude of a circle flight without yaw rate: R e3 goes round a cone, and its height is the same number for 60 s."""

    def circling(time: Any, attitude: Any, euclidean: Any) -> tuple[Any, Any]:
        return speed * ca.vertcat(attitude[2, 0], attitude[2, 1], 0), 0 * euclidean

    tilted = so3.exp([0, np.arctan(speed**2 / 9.8), 0])
    attitudes, _ = turned(INTEGRATORS[name].advance, circling, 60_000, 60.0, np.zeros(3), tilted)
    assert np.abs(attitudes[:, 2, 2] - tilted[2, 2]).max() < (0.2 if name == "lie-euler" else 1e-9)
    assert so3.drift(attitudes) <= 1e-12


def test_the_order_is_not_bought_by_more_stages_alone() -> None:
    """Carpenter and Kennedy's five stages pay: a smaller error per step than the four of rkmk4 (design: about a third)."""
    errors = {}
    for name in ("rkmk4", "carpenter-kennedy"):
        attitudes, rates = turned(INTEGRATORS[name].advance, torqued_body, 160, 2.0, LOADED)
        errors[name] = np.linalg.norm(np.concatenate([attitudes[-1].ravel(), rates[-1]]) - reference())
    assert errors["carpenter-kennedy"] < errors["rkmk4"]


# --- coefficients check themselves -----------------------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 1, 2, 3])
def test_an_altered_weight_is_noticed(place: int) -> None:
    weights = list(CLASSICAL.weights)
    weights[place] += 1e-6
    with pytest.raises(AssertionError):
        dataclasses.replace(CLASSICAL, weights=tuple(weights))


@pytest.mark.parametrize("place", [1, 2, 3])
def test_an_altered_row_or_node_is_noticed(place: int) -> None:
    nodes = list(CLASSICAL.nodes)
    nodes[place] += 1e-6
    with pytest.raises(AssertionError):
        dataclasses.replace(CLASSICAL, nodes=tuple(nodes))
    rows = list(CLASSICAL.rows)
    rows[place] = (*rows[place][:-1], rows[place][-1] + 1e-6)
    with pytest.raises(AssertionError):
        Tableau(CLASSICAL.nodes, tuple(rows), CLASSICAL.weights)


@pytest.mark.parametrize(
    ("part", "place"), [("a", 1), ("a", 4), ("b", 0), ("b", 2), ("b", 4), ("nodes", 0), ("nodes", 3)]
)
def test_an_altered_low_storage_coefficient_is_noticed(part: str, place: int) -> None:
    values = list(getattr(CARPENTER_KENNEDY, part))
    values[place] += 1e-6
    with pytest.raises(AssertionError):
        LowStorage(**{**dataclasses.asdict(CARPENTER_KENNEDY), part: tuple(values)})


def test_the_low_storage_scheme_meets_the_order_conditions() -> None:
    """As a Butcher table: sum b c^k = 1/(k + 1) up to order 4, and the two conditions with the matrix."""
    stages = len(CARPENTER_KENNEDY.a)
    rows, update, total = [], np.zeros(stages), np.zeros(stages)
    for i, (a, b) in enumerate(zip(CARPENTER_KENNEDY.a, CARPENTER_KENNEDY.b, strict=True)):
        rows.append(total.copy())
        update = a * update + np.eye(stages)[i]
        total = total + b * update
    A, weights, c = np.array(rows), total, np.array(CARPENTER_KENNEDY.nodes)
    for k in range(4):
        assert weights @ c**k == pytest.approx(1 / (k + 1), abs=1e-12)
    assert weights @ A @ c == pytest.approx(1 / 6, abs=1e-12)
    assert weights @ A @ c**2 == pytest.approx(1 / 12, abs=1e-12)
    assert weights @ (c * (A @ c)) == pytest.approx(1 / 8, abs=1e-12)
    assert weights @ A @ A @ c == pytest.approx(1 / 24, abs=1e-12)


def test_an_unknown_integrator_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="did you mean"):
        integrator("rkmk5")
    assert all(integrator(name).name == name and method.source for name, method in INTEGRATORS.items())

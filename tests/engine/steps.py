"""Graphs of the package for the tests of its back ends: closed loops with starts and what comes to them from outside, and path jets."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar import so3
from gammastar.engine import Step
from gammastar.engine.batch import batch
from gammastar.engine.compiler import compiler
from gammastar.engine.native import Native
from gammastar.engine.tape import OPERATIONS
from gammastar.errors import CompilerError
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.lookup import Lookup, Table
from gammastar.mission import load
from gammastar.vehicle import Vehicle

ROTORS = gs.Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500.0, lag=0.005, first_angle=45)
QUADROTOR = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81, rotors=ROTORS)


@dataclasses.dataclass(frozen=True)
class Loop:
    step: Step
    starts: np.ndarray  # (n, flights)
    interval: float  # [s]


def looped(law: gs.Law, starts: list[gs.State], speed: float) -> Loop:
    """Return the closed loop of a law with states at the starts, without noise and at a constant speed."""
    loop, _, _ = prepared(law, starts[0], gs.Speed(speed), 0.0, Conditions(1.0, 1e-3))
    first = [loop.start(*law.start_vector(start)) for start in starts]
    return Loop(loop.step(), np.column_stack(first), loop.interval)


def random_starts(center: tuple[float, float, float], count: int) -> list[gs.State]:
    """Return starts within 0.3 m of a point, tilted by up to 20 degrees about two axes: no flight meets free fall."""
    draw = np.random.default_rng(5)
    turns = [so3.roll(draw.uniform(-20, 20)) @ so3.pitch(draw.uniform(-20, 20)) for _ in range(count)]
    places = np.asarray(center) + draw.uniform(-0.3, 0.3, (count, 3))
    return [gs.State(place, attitude=turn) for place, turn in zip(places, turns, strict=True)]


@functools.cache
def paper_circle() -> Loop:
    """Return the paper's circle with continuous feedback and rkmk4."""
    return looped(load("upside-down").law(), random_starts((1.3, 0.0, 9.8), 64), 1.0)


@functools.cache
def quadrotor() -> Loop:
    """Return an autopilot with observers around a quadrotor with rotors."""
    law = gs.design(QUADROTOR, gs.paths.circle(), -4, rejection=gs.Observer(), approach=gs.Approach())
    return looped(law, random_starts((1.5, 0.0, 0.0), 64), 1.0)


@functools.cache
def jet(name: str) -> Any:
    """Return the function parameter -> point and five derivatives (18,) of a path by name."""
    parameter = ca.SX.sym("parameter")
    return ca.Function("jet", [parameter], [ca.vertcat(*getattr(gs.paths, name)().jet(parameter))])


OF_TWO = ("add", "sub", "mul", "div", "copysign", "fmod", "fmin", "fmax", "lt", "le", "eq", "ne", "and", "or")
OF_TWO += ("if_else_zero", "pow", "hypot", "atan2")


def step_of(size: int, parameters: int, after: Any, **rest: Any) -> Step:
    """Return the step whose next state is a function of (state (size,), parameters, number of the step)."""
    symbols = ca.SX.sym("state", size), ca.SX.sym("parameters", parameters), ca.SX.sym("number")
    nothing = ca.SX(0, 1)
    return Step(ca.Function("core", [*symbols, nothing], [after(*symbols), nothing]), **rest)


def stepped(step: Step, parameters: np.ndarray, lanes: int | None = None) -> np.ndarray:
    """Return the states (n, flights) after one step of compiled C from zeros with parameters (p, flights)."""
    one = batch(step, np.zeros((step.size, parameters.shape[1])), 1, 0, 0, None, parameters)
    return Native(step, lanes).fly(one, 1, lambda done: None)


@functools.cache
def every_operation() -> Step:
    """Return the step (a state that is left behind, two parameters x and y) -> every operation of x and y, in the order of the table."""

    def after(state: Any, given: Any, number: Any) -> Any:
        results = []
        for name in OPERATIONS:
            code = getattr(ca, f"OP_{name.upper()}")
            second = 2.5 if name == "constpow" else given[1]
            two = name in OF_TWO or name == "constpow"
            results.append(ca.SX.binary(code, given[0], second) if two else ca.SX.unary(code, given[0]))
        return ca.vertcat(*results)

    return step_of(len(OPERATIONS), 2, after)


def tiny(constant: float) -> Step:
    """Return a step that compiles in a tenth of a second: a constant times the state, and one more."""
    return step_of(1, 0, lambda state, parameters, number: constant * state + 1)


@functools.cache
def noisy() -> Step:
    """Return a step with everything that a step may have: noise from two channels, a table beside another, a parameter and a status."""
    state, parameters, column, rows = (
        ca.SX.sym("state", 3),
        ca.SX.sym("p"),
        ca.SX.sym("column", 5),
        ca.SX.sym("rows", 3),
    )
    push = ca.sqrt(-2 * ca.log(column[1])) * ca.cos(2 * np.pi * column[2]) + column[3] - column[4]
    after = ca.vertcat(
        0.99 * state[0] + 0.1 * ca.sin(state[1]) + 0.01 * push + parameters,
        state[1] + 0.05 * rows[0] + 0.01 * rows[2] + 0.01,
        state[0] > 2,
    )
    core = ca.Function("core", [state, parameters, column, rows], [after, ca.vertcat(2 * state[0], rows[1], column[0])])
    first = Lookup(ROUND, lambda inputs, _: inputs.state[1])
    second = Lookup(STAIRS, lambda inputs, before: before[1] + 0.001 * inputs.column[0])
    return Step(core, (first, second), channels=(3, 7), status=2)


ROUND = Table(np.array([0, 1, 2.5]), np.array([[1, 0.0], [2, 1], [-1, 3]]), 3.0, np.array([0.0, 0.1]))
STAIRS = Table(np.linspace(0, 4, 7), 0.1 * np.arange(7.0)[:, None])
UPWARD = Table(STAIRS.begins, STAIRS.rows + 5)


def noisy_starts(count: int) -> np.ndarray:
    """Return starts (3, count) of the noisy step, about half of which end early in 400 steps."""
    return np.vstack([np.random.default_rng(0).normal(size=(2, count)), np.zeros((1, count))])


def unanswered() -> str:
    """Return why tests that compile are skipped, or nothing where a compiler answers."""
    try:
        compiler()
    except CompilerError as error:
        return str(error)
    return ""


REASON = unanswered()
needs_compiler = pytest.mark.skipif(bool(REASON), reason=REASON or "a compiler answers")

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
from gammastar.engine.compiler import compiler
from gammastar.engine.tape import OPERATIONS
from gammastar.errors import CompilerError
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.mission import load
from gammastar.vehicle import Vehicle

ROTORS = gs.Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500.0, lag=0.005, first_angle=45)
QUADROTOR = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81, rotors=ROTORS)


@dataclasses.dataclass(frozen=True)
class Loop:
    step: Any  # CasADi function
    starts: np.ndarray  # (n, lanes)
    outside: Any  # (first, end) -> (m, count)
    interval: float  # [s]


def looped(law: gs.Law, starts: list[gs.State], speed: float) -> Loop:
    """Return the closed loop of a law with states at the starts."""
    loop, _, _ = prepared(law, starts[0], gs.Speed(speed), 0.0, Conditions(1.0, 1e-3))
    first = [loop.start(*law.start_vector(start)) for start in starts]

    def outside(a: int, b: int) -> np.ndarray:
        return loop.outside(np.arange(a, b) * loop.interval, loop.samples(0, b)[:, a:b])

    return Loop(loop.step(), np.column_stack(first), outside, loop.interval)


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


@functools.cache
def every_operation() -> Any:
    """Return the step (a state that is left behind, two numbers x and y) -> every operation of x and y, in the order of the table."""
    state, given = ca.SX.sym("state", len(OPERATIONS)), ca.SX.sym("given", 2)
    results = []
    for name in OPERATIONS:
        number = getattr(ca, f"OP_{name.upper()}")
        second = 2.5 if name == "constpow" else given[1]
        two = name in OF_TWO or name == "constpow"
        results.append(ca.SX.binary(number, given[0], second) if two else ca.SX.unary(number, given[0]))
    return ca.Function("every", [state, given], [ca.vertcat(*results), ca.SX(0, 1)])


def tiny(constant: float) -> Any:
    """Return a step that compiles in a tenth of a second."""
    state, given = ca.SX.sym("state"), ca.SX.sym("given")
    return ca.Function("tiny", [state, given], [constant * state + given, ca.SX(0, 1)])


def unanswered() -> str:
    """Return why tests that compile are skipped, or nothing where a compiler answers."""
    try:
        compiler()
    except CompilerError as error:
        return str(error)
    return ""


REASON = unanswered()
needs_compiler = pytest.mark.skipif(bool(REASON), reason=REASON or "a compiler answers")

"""Branches change when a value is computed, never what it is."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from engine import steps
from gammastar import engine
from gammastar.engine import branches
from gammastar.engine.branches import Branch, branched
from gammastar.engine.c_source import c_source
from gammastar.engine.native import Native

GIVEN, GRAPHS, LANES = 6, 60, 400


def random_values(draw: np.random.Generator, given: Any) -> list[Any]:
    """Return some values of a graph in which choices depend on each other in every way: one within, after, and beside another."""
    values, truths = ca.vertsplit(given), [given[0] < given[1], given[2] < given[3]]
    for _ in range(draw.integers(20, 80)):
        a, b, c = (values[draw.integers(max(0, len(values) - 14), len(values))] for _ in range(3))
        s, t = (truths[draw.integers(max(0, len(truths) - 4), len(truths))] for _ in range(2))
        match draw.integers(9):
            case 0:
                truths.append(a < b)
            case 1:
                truths.append(ca.logic_and(s, t))
            case 2:
                truths.append(ca.logic_or(s, ca.logic_not(t)))
            case 3 | 4 | 5:
                values.append(ca.if_else(s, a * b, c - a))
            case 6:
                values.append(ca.if_else(c, a + b, 0))
            case _:
                least = ca.fmin(ca.fmax(a, 0.1), b)  # never NaN
                values.append((a * b + c, ca.fmax(a, b) - c, least, a / (1 + b * b))[draw.integers(4)])
    return [*values[-3:], *(1 * truth for truth in truths[-2:])]


@steps.needs_compiler
@pytest.mark.parametrize("least_work", [1, branches.LEAST_WORK])
def test_values_are_those_without_branches(least_work: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit what NumPy reads off the tape, with NaN, infinities and zeros among what is given."""
    monkeypatch.setattr(branches, "LEAST_WORK", least_work)
    draw, given = np.random.default_rng(3), ca.SX.sym("given", GIVEN)
    results = ca.cse(ca.vertcat(*(each for _ in range(GRAPHS) for each in random_values(draw, given))))
    step = steps.step_of(
        results.numel(), GIVEN, lambda state, parameters, number: ca.substitute(results, given, parameters)
    )
    assert Native(step, lanes=1).source.count("if (") > GRAPHS
    numbers = draw.normal(size=(GIVEN, LANES))
    special = draw.choice([np.nan, np.inf, 0.0], numbers.shape)
    numbers = np.where(draw.uniform(size=numbers.shape) < 0.05, special, numbers)
    tape, zeros = engine.tape_of(step.core, (0,)), np.zeros((step.size, LANES))
    (expected,) = tape.evaluate(zeros, numbers, np.zeros((1, LANES)), np.empty((0, LANES)))
    np.testing.assert_array_equal(steps.stepped(step, numbers, lanes=1), expected)


def shaped(items: list[Any]) -> list[Any]:
    """Return how many values are computed, level by level; of a branch its two sides."""
    found: list[Any] = [sum(not isinstance(each, Branch) for each in items)]
    return found + [tuple(shaped(side) for side in each.sides) for each in items if isinstance(each, Branch)]


def test_what_one_side_needs_alone_is_computed_there() -> None:
    """Of two sides that share a sine, the shared one stays outside; a choice within a side is a branch within the branch."""
    x, y, z = (ca.SX.sym(name) for name in "xyz")
    shared = ca.sin(z)
    inner = ca.if_else(y < z, ca.exp(shared), ca.cos(y))
    graph = ca.Function("f", [x, y, z], [ca.if_else(x < y, inner + 1, ca.exp(y) * shared)])
    #         sin(z), x < y;  y < z, + 1;      exp(shared)  cos(y)    exp(y), times shared
    assert shaped(branched(engine.tape_of(graph)).items) == [2, ([2, ([1], [1])], [2])]


def test_a_branch_that_saves_little_is_a_choice_in_one_line() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    text = c_source(engine.tape_of(ca.Function("f", [x, y], [ca.if_else(x < y, x * y, 2)])))
    assert "if (" not in text
    assert " ? v" in text
    assert " : 2.0;" in text


def test_the_second_of_two_conditions_waits_for_the_first() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    text = c_source(engine.tape_of(ca.Function("f", [x, y], [ca.logic_and(x < y, ca.exp(x) < ca.sin(y))])))
    assert text.index("if (") < text.index("real_exp(x0[0])")

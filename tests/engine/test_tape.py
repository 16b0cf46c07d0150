"""A tape is the graph: NumPy's reading of it gives what CasADi's virtual machine gives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from engine import steps
from gammastar import engine
from gammastar.engine.tape import OPERATIONS
from gammastar.errors import InputError


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    """Compare to rounding, which the sines of two libraries bring in and differences of large numbers carry on."""
    scale = np.abs(expected).max(axis=1, keepdims=True)
    assert np.array_equal(np.isnan(found), np.isnan(expected))
    assert np.all(np.abs(found - expected) <= 1e-11 * scale)


@pytest.mark.parametrize("kind", ["paper_circle", "quadrotor"])
def test_a_closed_loop_is_read_as_the_virtual_machine_reads_it(kind: str) -> None:
    loop = getattr(steps, kind)()
    states = loop.starts * (1 + 1e-3 * np.random.default_rng(0).normal(size=loop.starts.shape))
    nothing, numbers = np.empty((0, states.shape[1])), np.arange(states.shape[1])[None]
    rows = np.repeat(
        loop.step.lookups[0].table.at(np.zeros(1)), states.shape[1], axis=1
    )  # a constant speed: one row for good
    found = engine.tape_of(loop.step.core).evaluate(states, nothing, numbers, rows)
    for one, expected in zip(found, loop.step.graph()(states, nothing, numbers), strict=True):
        assert_same(one, expected.full())


@pytest.mark.parametrize("name", ["trefoil", "viviani", "sine", "spiral"])
def test_a_path_jet_is_read_as_the_virtual_machine_reads_it(name: str) -> None:
    parameters = np.linspace(0.1, 3.0, 30)[None]
    (found,) = engine.tape_of(steps.jet(name)).evaluate(parameters)
    assert_same(found, steps.jet(name)(parameters).full())


@pytest.mark.parametrize("kind", ["paper_circle", "quadrotor"])
def test_a_slot_is_not_taken_while_its_value_is_needed(kind: str) -> None:
    """And few slots are enough: far fewer than values, and no more than CasADi's own."""
    step = getattr(steps, kind)().step.core
    tape = engine.tape_of(step)
    holder: dict[int, int] = {}
    for k, each in enumerate(tape.instructions):
        if each.operation in OPERATIONS:
            assert all(holder.get(tape.slots[v], v) == v for v in each.inputs if tape.slots[v] >= 0)
            holder[tape.slots[k]] = k
    assert tape.work <= step.expand().sz_w()
    assert tape.work < tape.operations / 10


def test_outputs_that_are_left_out_cost_nothing() -> None:
    x = ca.SX.sym("x")
    function = ca.Function("f", [x], [x + 1, ca.sin(ca.cos(x))])
    assert engine.tape_of(function, outputs=(0,)).operations == 1
    assert engine.tape_of(function).operations == 3


def test_functions_that_are_called_are_expanded_and_matrices_are_stacked_by_columns() -> None:
    x = ca.SX.sym("x", 2, 2)
    inner = ca.Function("inner", [x], [ca.mtimes(x, x.T)])
    outer = ca.MX.sym("outer", 2, 2)
    function = ca.Function("outer", [outer], [inner(inner(outer)), ca.MX(ca.Sparsity.lower(2), 3.0)])
    given = np.array([[1.0, 2.0], [3.0, 4.0]])
    squared, sparse = engine.tape_of(function).evaluate(given.ravel(order="F"))
    assert squared == pytest.approx(np.linalg.matrix_power(given @ given.T, 2).ravel(order="F"), rel=1e-14)
    assert sparse.tolist() == [3, 3, 0, 3]


@pytest.mark.parametrize("values", [(np.nan, 1.0), (1.0, np.nan), (0.0, np.nan), (np.nan, np.nan), (0.0, -0.0)])
def test_comparisons_and_choices_treat_nan_as_the_virtual_machine_does(values: tuple[float, float]) -> None:
    x = ca.SX.sym("x", 2)
    a, b = x[0], x[1]
    choices = [ca.fmin(a, b), ca.fmax(a, b), ca.if_else(a, b, 7.0), ca.if_else(a < b, 1.0, 2.0), ca.sign(a)]
    truths = [a < b, a <= b, a == b, a != b, ca.logic_not(a), ca.logic_and(a, b), ca.logic_or(a, b)]
    function = ca.Function("f", [x], [ca.vertcat(*choices, *truths)])
    (found,) = engine.tape_of(function).evaluate(np.array(values))
    assert found == pytest.approx(function(values).full()[:, 0], nan_ok=True, abs=0)


def test_what_is_no_scalar_operation_known_here_is_refused_in_one_sentence() -> None:
    x, place = ca.SX.sym("x"), ca.MX.sym("place")
    with pytest.raises(InputError, match=r"must consist of .* \(got 'erf'\); write it with these"):
        engine.tape_of(ca.Function("f", [x], [ca.erf(x)]))
    table = ca.Function("table", [place], [ca.MX(ca.DM([1, 2, 3]))[ca.floor(place)]])
    with pytest.raises(InputError, match=r"must consist of scalar operations \(got .*'table'\); evaluate tables"):
        engine.tape_of(table)
    with pytest.raises(InputError, match=r"must have \[1\] rows \(got \[2\]\)"):
        engine.tape_of(ca.Function("f", [x], [x + 1])).evaluate(np.zeros(2))

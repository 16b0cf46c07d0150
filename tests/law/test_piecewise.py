"""Piecewise polynomials as data: the graph, the numbers and the table agree, at joints and round a period."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from numpy.polynomial.polynomial import polyder, polyval

from gammastar.law.piecewise import DATA_SIZE, Piecewise, evaluated
from gammastar.taylor import Series
from strategies import numbers

OPEN = Piecewise(np.array([0.0, 1.0, 2.5]), np.random.default_rng(0).normal(size=(3, 9)))
PERIODIC = Piecewise(np.array([0.3, 1.0, 2.5]), np.random.default_rng(1).normal(size=(3, 5)), period=4.0)


def expected(pieces: Piecewise, value: float, derivative: int) -> float:
    """Return a derivative by walking the pieces one by one."""
    if pieces.period is not None:
        while value < pieces.begins[0]:
            value += pieces.period
        while value >= pieces.begins[0] + pieces.period:
            value -= pieces.period
    k = max([0, *(i for i, begin in enumerate(pieces.begins) if begin <= value)])
    return float(polyval(value - pieces.begins[k], polyder(pieces.coefficients[k], derivative)))


@pytest.mark.parametrize("pieces", [OPEN, PERIODIC], ids=["open", "periodic"])
@settings(max_examples=60)
@given(numbers(-6, 9))
def test_graph_and_numbers_are_the_polynomial_of_the_piece(pieces: Piecewise, value: float) -> None:
    symbol, data = ca.SX.sym("value"), ca.SX.sym("data", DATA_SIZE)
    line = Series((symbol, ca.SX(1), *(ca.SX(0) for _ in range(3))))
    graph = ca.Function("jet", [symbol, data], [ca.vertcat(*evaluated(data, line).derivatives())])
    wanted = [expected(pieces, value, k) for k in range(5)]
    scale = 1 + np.abs(wanted).max()
    assert graph(value, pieces.data(np.array([value]))).full().ravel() == pytest.approx(wanted, abs=1e-9 * scale)
    for k in range(5):
        assert pieces.values(np.array([value]), k) == pytest.approx(wanted[k], abs=1e-9 * scale)


@pytest.mark.parametrize("pieces", [OPEN, PERIODIC], ids=["open", "periodic"])
def test_the_table_looked_up_in_a_graph_holds_the_same_data(pieces: Piecewise) -> None:
    values = np.linspace(-6, 9, 301) + 1e-4  # beside the joints
    symbol = ca.MX.sym("value")
    lookup = ca.Function("lookup", [symbol], [pieces.table.graph(symbol)])
    found = lookup.map(len(values))(values[None, :]).full()
    np.testing.assert_allclose(found, pieces.data(values), atol=1e-12)


@pytest.mark.parametrize("pieces", [OPEN, PERIODIC], ids=["open", "periodic"])
def test_the_data_of_a_step_hold_across_the_next_joint(pieces: Piecewise) -> None:
    """Fetched just before a joint, the data give the value just behind it exactly."""
    symbol, data = ca.SX.sym("value"), ca.SX.sym("data", DATA_SIZE)
    graph = ca.Function("value", [symbol, data], [evaluated(data, Series((symbol,))).coefficients[0]])
    joints = np.append(pieces.begins[1:], pieces.begins[0] + (pieces.period or np.nan))
    for joint in joints[np.isfinite(joints)]:
        fetched = pieces.data(np.array([joint - 1e-3]))
        for later in (1e-12, 5e-4, 1e-3):
            found = float(graph(joint + later, fetched))
            assert found == pytest.approx(expected(pieces, joint + later, 0), abs=1e-12)


def test_moved_pieces_are_the_same_later() -> None:
    values = np.linspace(-1, 5, 50)
    np.testing.assert_allclose(OPEN.moved(2.0).values(values + 2.0), OPEN.values(values), rtol=1e-12, atol=1e-12)

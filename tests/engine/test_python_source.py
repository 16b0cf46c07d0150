"""The Python of a tape: readable, and for every operation what CasADi's virtual machine gives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from engine import steps
from engine.test_c_source import EDGES, LISTED
from gammastar import engine


def function(tape: engine.Tape, name: str = "step") -> object:
    space: dict[str, object] = {}
    exec(engine.python_source(tape, name), space)
    return space[name]


def test_the_text_is_one_line_a_value() -> None:
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y")
    outputs = [ca.if_else(x[0] < y, ca.asin(x[1]), 0.5), x[1] - 2, ca.SX(0, 1)]
    text = engine.python_source(engine.tape_of(ca.Function("f", [x, y], outputs)), name="law")
    assert (
        text
        == """\
def law(xp, x0, x1):
    shape = xp.broadcast_shapes(x0.shape[1:], x1.shape[1:])
    v0 = x0[0] < x1[0]
    v1 = xp.arcsin(x0[1])
    v1 = xp.where(v0, v1, 0.0)
    v0 = xp.logical_not(v0)
    v0 = xp.where(v0, 0.5, 0.0)
    v0 = v1 + v0
    y0_0 = v0
    v0 = x0[1] - 2.0
    y1_0 = v0
    y0 = xp.stack([xp.broadcast_to(y0_0, shape)])
    y1 = xp.stack([xp.broadcast_to(y1_0, shape)])
    y2 = xp.empty((0, *shape))
    return y0, y1, y2,
"""
    )


def test_every_operation_gives_what_the_virtual_machine_gives_at_the_edges() -> None:
    x, y = (each.ravel() for each in np.meshgrid(EDGES, EDGES))
    given = np.zeros((len(LISTED), len(x))), np.stack([x, y]), np.zeros((1, len(x)))
    emitted = function(engine.tape_of(steps.every_operation().core, (0,)))
    with np.errstate(all="ignore"):
        (found,) = emitted(np, *given, np.empty((0, len(x))))
    expected = steps.every_operation().graph()(*given)[0].full()
    for name, one, row in zip(LISTED, found, expected, strict=True):
        assert one == pytest.approx(row, rel=2e-15, abs=0, nan_ok=True), name


@pytest.mark.parametrize("value", [0.1, -2.5e-7, 5e-324, np.inf, -np.inf, np.nan])
def test_constants_read_back_as_the_same_number(value: float) -> None:
    x = ca.SX.sym("x")
    (found,) = function(engine.tape_of(ca.Function("f", [x], [ca.SX(value)])))(np, np.zeros((1, 3)))
    assert found.shape == (1, 3)
    assert found.tobytes() == np.full((1, 3), value).tobytes()

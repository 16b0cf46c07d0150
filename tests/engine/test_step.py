"""A step with tables is one function of its inputs."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from gammastar.engine import Step
from gammastar.lookup import Lookup, Table

STATE, PARAMETERS, COLUMN = ca.SX.sym("state", 2), ca.SX.sym("parameters"), ca.SX.sym("column", 3)


def test_the_graph_looks_up_at_what_the_inputs_tell() -> None:
    rows = ca.SX.sym("rows")
    after = ca.vertcat(STATE[0] + PARAMETERS * rows, STATE[1] + COLUMN[1] - COLUMN[2])
    core = ca.Function("core", [STATE, PARAMETERS, COLUMN, rows], [after, COLUMN[0]])
    table = Table(np.array([0.0, 1.0]), np.array([[5.0], [7.0]]))
    step = Step(core, (Lookup(table, lambda inputs, _: inputs.state[0] + inputs.column[0]),), channels=(0,))
    after, observed = step.graph()([0.5, 0.0], 2.0, [1.0, 0.25, 0.125])
    assert after.full().ravel() == pytest.approx([14.5, 0.125])
    assert float(observed) == 1.0


def test_a_step_without_tables_stays_a_scalar_graph() -> None:
    core = ca.Function("core", [STATE, ca.SX(0, 1), COLUMN[:1], ca.SX(0, 1)], [STATE * COLUMN[0], ca.SX(0, 1)])
    graph = Step(core).graph()
    assert graph.is_a("SXFunction")
    assert graph([1.0, 2.0], [], 3.0)[0].full().ravel() == pytest.approx([3.0, 6.0])

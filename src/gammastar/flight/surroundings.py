"""What comes to a loop's graph from outside a step, and what is looked up beside it: shared by both closed loops."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.law import Law, linearize
from gammastar.law.guidance import Guidance, chosen
from gammastar.law.piecewise import DATA_SIZE
from gammastar.lookup import graph_at
from gammastar.vehicle import CALM, StateGraph, Vehicle


class Outputs(NamedTuple):
    """Graph: outputs of the true vehicle along the path, or towards the target that waits on it."""

    transverse: Any  # SX (path.components, 4)
    tangential: Any  # SX (4,)
    yaw_value: Any  # SX
    focal_margin: Any  # SX


def outside(guidance: Guidance, times: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return the columns (m, n) that come from outside at times (n,) with samples: for a reference over time, its data too."""
    reference = guidance.reference
    return np.vstack([times, samples] if reference.over_progress else [times, samples, reference.pieces.data(times)])


def with_lookups(core: Any, guidance: Guidance, size: int, parameter: int, samples: int) -> Any:
    """Return the function (loop state (size,), a column from outside) -> what `core` gives, with the data looked up that it needs.

    Args:
        core: Function of the loop state, and of time, samples, data of the reference and data of the path.
        guidance: Path and reference.
        size: Of the loop state.
        parameter: Where the path parameter is in it.
        samples: How many come from outside beside the time.
    """
    path, reference = guidance.law.path, guidance.reference
    if path.data_size == 0 and not reference.over_progress:
        return core
    known = 1 + samples
    column = known + (0 if reference.over_progress else DATA_SIZE)
    state, given = ca.MX.sym("loop_state", size), ca.MX.sym("outside", column)
    place = state[parameter]
    wanted = graph_at([reference.lookup], place) if reference.over_progress else given[known:]
    inputs = ca.vertcat(given[:known], wanted, graph_at(path.lookups, place))
    return ca.Function("step", [state, given], core(state, inputs))


def foot(was_waiting: Any, waiting: Any, parameter: Any, true_parameter: Any) -> Any:
    """Graph: return the parameter of the true foot; where a target has just waited, the one that the law takes to."""
    return ca.if_else(ca.logic_and(was_waiting, ca.logic_not(waiting)), parameter, true_parameter)


def outputs_of(
    law: Law,
    truth: Vehicle,
    state: StateGraph,
    true_parameter: Any,
    parameter: Any,
    waiting: Any,
    data: Any,
    wind: Any = CALM,
) -> Outputs:
    """Graph: return the outputs of a true state and vehicle.

    While the target waits, xi is the error to it and its derivatives, and eta the target, at rest.
    """
    true = linearize(truth, law.path, state, ca.vertcat(true_parameter, data), law.yaw_output, wind=wind)
    transverse, tangential = true.outputs.transverse, true.outputs.tangential
    if law.approach is not None:
        error = state.position - law.path.foot(state.position, ca.vertcat(parameter, data))
        acceleration, jerk = truth.acceleration(state, wind=wind), truth.jerk(state, wind=wind)
        transverse = chosen(waiting, ca.horzcat(error, state.velocity, acceleration, jerk), transverse)
        tangential = chosen(waiting, ca.vertcat(parameter, 0, 0, 0), tangential)
    return Outputs(transverse, tangential, true.yaw_value, true.outputs.focal_margin)

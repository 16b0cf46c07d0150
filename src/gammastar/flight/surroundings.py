"""What is looked up beside a loop's graph, and the outputs that it tells: shared by both closed loops."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca

from gammastar import engine
from gammastar.law import Law, linearize
from gammastar.law.guidance import Guidance, chosen
from gammastar.law.piecewise import DATA_SIZE
from gammastar.lookup import Lookup
from gammastar.vehicle import CALM, StateGraph, Vehicle


class Outputs(NamedTuple):
    """Graph: outputs of the true vehicle along the path, or towards the target that waits on it."""

    transverse: Any  # SX (path.components, 4)
    tangential: Any  # SX (4,)
    yaw_value: Any  # SX
    focal_margin: Any  # SX


def lookups_of(guidance: Guidance, parameter: int, interval: float) -> tuple[Lookup, ...]:
    """Return the lookups of a step: the reference's (20,), then the path's.

    Args:
        guidance: Path and reference.
        parameter: Where the path parameter is in the state.
        interval: [s] of a step.
    """

    def place(inputs: engine.Inputs, rows: Any) -> Any:
        return inputs.state[parameter]

    def time(inputs: engine.Inputs, rows: Any) -> Any:
        return inputs.column[0] * interval

    reference = guidance.reference
    first = reference.lookup.within(place if reference.over_progress else time, 0)
    return first, *(lookup.within(place, DATA_SIZE) for lookup in guidance.law.path.lookups)


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

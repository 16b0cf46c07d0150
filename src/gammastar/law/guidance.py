"""What a law does at one instant of a flight: its reference, its heading, and whether it follows the path or a target waits on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.law.approach import CAPTURE_RESIDUAL, CAPTURE_STEPS, floored
from gammastar.law.heading import Heading, heading_key
from gammastar.law.law import Law, Yaw
from gammastar.law.reference import Reference, wanted
from gammastar.path import ParametricPath
from gammastar.vehicle import NOTHING, StateGraph, Unknown, split
from gammastar.vehicle.state import SIZE as STATE_SIZE

UNKNOWN_BEND = 1e30  # [m/s^2]


@dataclass(frozen=True, eq=False)
class Decision:
    """Graph: what the law does at one instant."""

    input: Any  # SX (4,), kept above the thrust floor of an approach
    free: Any  # SX (4,), the same without that floor
    along: Callable[[], Any]  # graph SX (4,): what `free` gains by one unit of the highest derivative along the path
    per_metre: Any  # SX, path parameter per metre of the vehicle's motion along the path
    turning: Any  # SX [m/s^2], what the bend of the path asks for at the speed along it
    parameter_rate: Any  # SX, of the tracked path parameter; zero while the target waits
    constrained: Any  # SX, 1 where the approach bends the linear law: target waiting, error cut or thrust on its way to the floor


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Graph: the numbers of this step's part of the path and of the reference."""

    path: Any  # SX (path.data_size,)
    reference: Any  # SX (20,), see `gammastar.law.piecewise`


@dataclass(frozen=True, eq=False)
class Guidance:
    """A law with what it is to do along its path and about its yaw."""

    law: Law
    reference: Reference
    yaw: Yaw  # constant reference of beta(r), or a heading

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return everything that enters the graph as a constant."""
        reference = (self.reference.holds_position, self.reference.over_progress)
        return self.law.signature, reference, heading_key(self.yaw) if isinstance(self.yaw, Heading) else self.yaw

    def decide(
        self,
        state: StateGraph,
        parameter: Any,
        waiting: Any,
        time: Any,
        around: Surroundings,
        unknown: Unknown = NOTHING,
        pace: Any = 1,
    ) -> Decision:
        """Graph: return the input at a state in the mode that holds, waiting (1) or following (0), at a share of the speed asked for."""
        law, place, over_progress = self.law, ca.vertcat(parameter, around.path), self.reference.over_progress

        def reference(tangential: Any) -> Any:
            return wanted(over_progress, time, tangential, around.reference)

        control = law.control(state, place, reference, self.yaw, self.reference.holds_position, unknown, pace)
        outputs = control.linearization.outputs
        per_metre, turning = ca.norm_2(outputs.tangential_gradient), bend(law, place, outputs.tangential[1])
        if law.approach is None:
            return Decision(control.input, control.input, control.along, per_metre, turning, outputs.tangential[1], 0)
        waited = law.wait(state, place, self.yaw, unknown)
        free = chosen(waiting, waited, control.input)
        kept = floored(state, free, law.approach.floor(law.vehicle))
        cut = ca.norm_2(outputs.transverse[:, 0]) > law.longest_error
        constrained = ca.logic_or(ca.logic_or(waiting, cut), kept[0] > free[0])

        def along() -> Any:
            return chosen(waiting, ca.SX.zeros(4), control.along())

        return Decision(
            kept, free, along, per_metre, turning, ca.if_else(waiting, 0, outputs.tangential[1]), constrained
        )

    def mode(self, state: StateGraph, parameter: Any, waiting: Any, data: Any) -> tuple[Any, Any]:
        """Graph: return the parameter to use and whether the target waits, from what held until now."""
        law = self.law
        if law.approach is None:
            return parameter, ca.SX(0)
        assert isinstance(law.path, ParametricPath)
        candidate = law.path.track(state.position, ca.vertcat(parameter, data), CAPTURE_STEPS)
        entering, residual = self._entering(state, ca.vertcat(candidate, data))
        captured = ca.logic_and(entering > law.approach.enter, ca.fabs(residual) < CAPTURE_RESIDUAL)
        captured = ca.logic_and(captured, law.path.holds(candidate, data))
        margin, _, _ = law.path.nearness(state.position, state.velocity, ca.vertcat(parameter, data))
        still = ca.if_else(waiting, ca.logic_not(captured), margin < law.approach.leave)
        return ca.if_else(waiting, ca.if_else(captured, candidate, parameter), parameter), still

    def starts_waiting(self, state: np.ndarray, parameter: float) -> bool:
        """Return whether a flight from a stacked state (20,), nearest at a parameter, starts with a target that waits."""
        law = self.law
        if law.approach is None:
            return False
        waits = engine.compiled(("waits", law.path.graph_key, law.lead, law.approach.enter), self._waits)
        return bool(waits(state, law.place(parameter)))

    def waits_first(self, state: Any, place: Any) -> Any:
        """Graph: return whether a flight from a stacked state (20,), nearest at a place, starts with a target that waits."""
        approach = self.law.approach
        return ca.SX(0) if approach is None else self._entering(split(state), place)[0] < approach.enter

    def _entering(self, state: StateGraph, place: Any) -> tuple[Any, Any]:
        """Graph: return the focal margin that is left when the velocity across the path has died out, and the place's residual."""
        assert isinstance(self.law.path, ParametricPath)
        margin, rate, residual = self.law.path.nearness(state.position, state.velocity, place)
        return margin - self.law.lead * rate, residual

    def _waits(self) -> Any:
        """Return the function (state, place) -> whether a flight starts by waiting."""
        state, place = ca.SX.sym("state", STATE_SIZE), ca.SX.sym("place", 1 + self.law.path.data_size)
        return ca.Function("waits", [state, place], [self.waits_first(state, place)])


def bend(law: Law, place: Any, parameter_rate: Any) -> Any:
    """Graph: return |sigma''| times the square of the parameter's rate [m/s^2]; of an implicit path, which has no jet, no bound of it."""
    if not isinstance(law.path, ParametricPath):
        return ca.SX(UNKNOWN_BEND)
    return ca.norm_2(law.path.jet(place, 2)[2]) * parameter_rate**2


def chosen(condition: Any, first: Any, second: Any) -> Any:
    """Graph: return one of two matrices, entry by entry, so that what is not chosen may be infinite."""
    pairs = zip(ca.vertsplit(ca.vec(first)), ca.vertsplit(ca.vec(second)), strict=True)
    return ca.reshape(ca.vertcat(*(ca.if_else(condition, a, b) for a, b in pairs)), *second.shape)

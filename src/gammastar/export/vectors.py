"""A flight of the vehicle as its autopilot believes it to be, on CasADi's machine: moments of it are what C is tested with."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from gammastar.errors import InputError
from gammastar.export.graphs import FARTHEST, FASTEST
from gammastar.export.program import Program
from gammastar.export.tables import WIDEST
from gammastar.law.filter import MOTION
from gammastar.so3 import stack, unstack
from gammastar.vehicle import StateGraph, Unknown

MOMENTS = 24  # of the flight
LONGEST = 4000  # intervals


@dataclass(frozen=True, eq=False)
class Moment:
    """One control interval: what goes in, and what must come out."""

    interval: int  # its number
    memory: np.ndarray  # (n,)
    measurement: np.ndarray  # (22,), in the mission's frame
    after: np.ndarray  # (n,)
    command: np.ndarray
    told: np.ndarray


def moments(program: Program, duration: float, count: int = MOMENTS) -> list[Moment]:
    """Return moments of a flight from the mission's start, some of its first intervals and some over a duration [s].

    Fewer if the flight goes where measurements are refused, or beyond all numbers.

    Raises:
        InputError: It does so at its start.
    """
    pilot = program.autopilot
    steps = min(LONGEST, max(count, round(duration / pilot.interval)))
    kept = set(np.unique(np.round(np.geomspace(1, steps, count)).astype(int) - 1))
    move, motion = believed(program), program.start[:MOTION]
    memory = program.started(program.graphs.measurement(motion))
    found = []
    for k in range(steps):
        measurement = program.graphs.measurement(motion)
        after, command, told = program.stepped(memory, measurement, k)
        results = np.concatenate([memory, after, command, told])
        if not float(program.functions["usable"](measurement)) or not np.all(np.abs(results) < WIDEST[program.real]):
            break
        if k in kept:
            found.append(Moment(k, memory, measurement, after, command, told))
        memory = after
        motion = move(motion, memory[program.wrench]).full()[:, 0]
    if not found:
        raise InputError(
            f"the start of an export must be within {FARTHEST:g} m, {FASTEST:g} m/s and {FASTEST:g} rad/s, with finite commands of the law "
            "(got one that its autopilot would refuse); start nearer to the path"
        )
    return found


def sizes_of(found: list[Moment]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how large each number of memory, command and what is told becomes, at least one: errors are told as shares of that."""
    columns = [np.stack([getattr(each, name) for each in found]) for name in ("after", "command", "told")]
    memory, command, told = (np.maximum(1, np.abs(each).max(axis=0)) for each in columns)
    return memory, command, told


def believed(program: Program, interval: float | None = None) -> ca.Function:
    """Return the function (motion (18,), wrench (4,)) -> motion an interval later, of the believed vehicle."""
    motion, wrench = ca.SX.sym("motion", MOTION), ca.SX.sym("wrench", 4)
    position, velocity, attitude, rates = ca.vertsplit(motion, [0, 3, 6, 15, MOTION])
    state = StateGraph(position, velocity, unstack(attitude), rates, ca.SX(0), ca.SX(0))
    moved = program.autopilot.belief.lookahead.moved(
        state, wrench, wrench, interval or program.autopilot.interval, Unknown()
    )
    parts = [moved.position, moved.velocity, stack(moved.attitude), moved.angular_velocity]
    return ca.Function("move", [motion, wrench], [ca.cse(ca.densify(ca.vertcat(*parts)))])

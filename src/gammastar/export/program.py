"""An autopilot as a program for another computer: functions as lists of instructions, tables, and what both are compared with."""

from __future__ import annotations

import functools
import itertools
import re
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.engine import Tape, tape_of
from gammastar.errors import InputError, UnknownNameError
from gammastar.export.graphs import TOLD, Graphs
from gammastar.law.actuation import RotorSpeeds
from gammastar.law.autopilot import Autopilot
from gammastar.path import ParametricPath
from gammastar.path.base import Path

BEND = 0.2  # [rad] by which a path turns between two of the samples among which a start is sought, at most
SAMPLES = (64, 2048)  # fewest and most of them
COUNTS = 2**32 - 1  # of control intervals; what a reference holds for later is left out
NEWTON_STEPS = 16  # from a sample to the nearest point
NAME = re.compile(r"[a-z][a-z0-9_]*")
TAKEN = (
    *(
        "selftest",
        "assert",
        "float",
        "limits",
        "math",
        "stddef",
        "stdint",
        "stdio",
        "stdlib",
        "string",
        "time",
    ),  # files
    *(
        "app",
        "controller",
        "crazyflie",
        "freertos",
        "log",
        "param",
        "stabilizer_types",
        "task",
    ),  # with the target crazyflie
    "look_up",  # functions that read tables are called so
)
DEFAULT_NAME = "mission"
DEFAULT_REAL = "float32"
REALS = {"float32": "float", "float64": "double"}


class Samples(NamedTuple):
    """Points of a path at equal steps of its parameter."""

    first: float  # path parameter
    step: float
    points: np.ndarray  # (m, 3) [m], in the mission's frame


class Schedule(NamedTuple):
    """A reference over time, by control intervals: rows of its data, each from some interval on, with times counted from its begin."""

    first: np.ndarray  # (m,) number of the first interval in which a row holds
    begin: np.ndarray  # (m,) whole intervals before its begin ...
    rest: np.ndarray  # (m,) [s] ... and what is left
    rows: np.ndarray  # (m, 20)


@dataclass(frozen=True, eq=False)
class Program:
    """One mission's autopilot, ready to be written in C.

    Raises:
        InputError: The name is no C identifier.
        UnknownNameError: The real type is unknown.
    """

    name: str  # prefix of every public name of the C
    title: str
    autopilot: Autopilot
    start: np.ndarray  # (20,) where the mission starts, in `ned`
    parameter: float  # of the path, nearest to it
    frame: str = "ned"
    real: str = DEFAULT_REAL
    version: str = ""  # of gammastar

    def __post_init__(self) -> None:
        if not NAME.fullmatch(self.name) or self.name in TAKEN:
            raise InputError(
                f"the name of an export must consist of small letters, digits and _, a letter first, and not be taken "
                f"(got {self.name!r}); rename it"
            )
        if self.real not in REALS:
            raise UnknownNameError("real", self.real, REALS)

    @property
    def path(self) -> Path:
        """Return the path that is flown."""
        return self.autopilot.law.path

    @property
    def c_real(self) -> str:
        """Return the C type of a number."""
        return REALS[self.real]

    @functools.cached_property
    def graphs(self) -> Graphs:
        """Return the functions as graphs."""
        return Graphs(self.autopilot, self.frame, float(self.start[18]), float(self.start[19]), self.parameter)

    @functools.cached_property
    def functions(self) -> dict[str, Any]:
        """Return the functions, in the order in which they are written."""
        graphs = self.graphs
        return {each.name(): each for each in (graphs.usable(), graphs.nearer(), graphs.start(), graphs.interval())}

    @functools.cached_property
    def tapes(self) -> dict[str, Tape]:
        """Return the instructions of the functions, and of the variables of path tables beyond the first."""
        return {name: tape_of(each) for name, each in (self.functions | self.variables).items()}

    @functools.cached_property
    def variables(self) -> dict[str, Any]:
        """Return the functions (parameter, rows so far) -> variable of the path's tables that are looked up at something else."""
        found, width = dict[str, Any](), 0
        for k, lookup in enumerate(self.path.lookups):
            if width:
                parameter, rows = ca.SX.sym("parameter"), ca.SX.sym("rows", width)
                found[f"variable_{k}"] = ca.Function(
                    f"variable_{k}", [parameter, rows], [ca.densify(ca.SX(lookup.variable(parameter, rows)))]
                )
            width += lookup.table.width
        return found

    @property
    def operations(self) -> int:
        """Return the scalar operations of one control interval; the search of a start is not among them."""
        return sum(self.tapes[name].operations for name in ("usable", "interval", *self.variables))

    @property
    def command_names(self) -> list[str]:
        """Return what the numbers of a command are, with units."""
        pilot = self.autopilot
        if isinstance(pilot.actuation, RotorSpeeds):
            return [f"speed of rotor {k + 1} [rad/s]" for k in range(pilot.actuation.command_size)]
        if pilot.law.interface == "rates":
            return ["thrust [N]", *(f"rate about body axis {axis} [rad/s]" for axis in "xyz")]
        return ["thrust [N]", *(f"torque about body axis {axis} [N m]" for axis in "xyz")]

    @property
    def wrench(self) -> slice:
        """Return where the memory after a step holds the wrench that acts in the interval then begun, or thrust and rates commanded."""
        sizes = self.autopilot.sizes
        first = sum(sizes[name] for name in itertools.takewhile(lambda name: name != "history", sizes))
        return slice(first, first + 4)

    @property
    def wraps(self) -> float | None:
        """Return the period that is taken off the tracked parameter: of a closed path on which no place is asked for."""
        return None if self.autopilot.guidance.reference.holds_position else self.path.period

    @functools.cached_property
    def samples(self) -> Samples | None:
        """Return where a start is sought; None on an implicit path, whose coordinate tells it."""
        path = self.path
        if not isinstance(path, ParametricPath):
            return None
        low, high = path.domain
        if path.period is None:
            low, high = min(low, self.parameter), max(high, self.parameter)
        count = SAMPLES[0]
        while count < SAMPLES[1] and _bend(path, np.linspace(low, high, count + 1)) > BEND:
            count *= 2
        parameters = np.linspace(low, high, count + 1)
        kept = parameters[:-1] if path.period is not None else parameters
        return Samples(low, (high - low) / count, self.graphs.outside(path.points(kept)))

    @functools.cached_property
    def schedule(self) -> Schedule | None:
        """Return the reference over time; None where its data do not change, or depend on the place."""
        reference, interval = self.autopilot.guidance.reference, self.autopilot.interval
        if reference.over_progress or not self.graphs.reads_reference:
            return None
        begins, rows = reference.pieces.begins, reference.pieces.rows.copy()
        rows[:, [0, 10]] -= begins[:, None]
        whole = np.floor(begins / interval)
        first = np.ceil(begins / interval - 1e-9)
        reached = first <= COUNTS
        whole, rest, first = whole[reached], (begins - whole * interval)[reached], first[reached]
        return Schedule(first.astype(int), whole.astype(int), rest, rows[reached])

    def rows(self, parameter: float) -> np.ndarray:
        """Return the path's data (data_size,) at a parameter."""
        return self.path.data(np.array([parameter]))[:, 0]

    def stepped(
        self, memory: np.ndarray, measurement: np.ndarray, count: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return memory, command and what is told after control interval `count`, from CasADi's machine: what the C is held against."""
        reference, time = self.autopilot.guidance.reference, count * self.autopilot.interval
        wanted = np.empty(0)
        if reference.over_progress:
            wanted = reference.lookup.table.at(memory[:1])[:, 0]
        elif self.schedule is not None:
            held = max(0, int(np.searchsorted(self.schedule.first, count, side="right")) - 1)
            wanted = self.schedule.rows[held]
            time = (count - int(self.schedule.begin[held])) * self.autopilot.interval - self.schedule.rest[held]
        results = self.functions["interval"](memory, measurement, time, wanted, self.rows(memory[0]))
        after, command, told = (each.full()[:, 0] for each in results)
        if self.wraps is not None:
            low = self.path.domain[0]
            after[0] -= self.wraps * np.floor((after[0] - low) / self.wraps)
        return after, command, told

    def started(self, measurement: np.ndarray) -> np.ndarray:
        """Return the first memory from a first measurement, near the start of the mission."""
        return np.asarray(self.functions["start"](measurement, self.parameter, self.rows(self.parameter)).full()[:, 0])


def c_name(name: str) -> str:
    """Return what a mission or a file is called as a prefix in C: small letters, digits and _, a letter first."""
    words = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return words if words[:1].isalpha() and words not in TAKEN else f"{DEFAULT_NAME}_{words}".strip("_")


def _bend(path: ParametricPath, parameters: np.ndarray) -> float:
    """Return the largest angle [rad] between tangents at neighbouring parameters."""
    tangents = path.tangents(parameters)
    return float(2 * np.arcsin(np.clip(np.linalg.norm(np.diff(tangents, axis=0), axis=1) / 2, 0, 1)).max())


def split_told(told: np.ndarray) -> dict[str, np.ndarray]:
    """Return what an interval tells, (27,), by name."""
    return dict(zip(TOLD, np.split(told, np.cumsum(list(TOLD.values()))[:-1]), strict=True))

"""An export compiled for this machine and called from Python, so that what is shipped is what is tested."""

from __future__ import annotations

import ctypes
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.engine.compiler import compiler, library
from gammastar.export.c99 import sources
from gammastar.export.graphs import TOLD
from gammastar.export.program import Program, split_told
from gammastar.export.sizes import CHANNELS, UNKNOWN, Structures, structures

LOCAL_INCLUDE = re.compile(r'^#include "\w+\.h"\n', re.MULTILINE)
MEASUREMENT_REFUSED, RESULT_REFUSED, NOT_STARTED, WAITING, CONSTRAINED = (1 << k for k in range(5))


@dataclass(frozen=True, eq=False)
class Compiled:
    """The structures and functions of a program's C."""

    program: Program
    library: ctypes.CDLL
    structures: Structures

    def start(self, measurement: np.ndarray) -> Pilot:
        """Return an autopilot that flies from a first measurement (22,), in the mission's frame."""
        state = self.structures.state()
        getattr(self.library, f"{self.program.name}_start")(
            ctypes.byref(state), ctypes.byref(self.measured(measurement))
        )
        return Pilot(self, state)

    def going_on(self, state: bytes) -> Pilot:
        """Return an autopilot in a state that another one has been in."""
        return Pilot(self, self.structures.state.from_buffer_copy(state))

    def measured(self, measurement: np.ndarray) -> Any:
        """Return a measurement (22,) as its structure."""
        result, first = self.structures.measurement(), 0
        for channel, size in CHANNELS.items():
            getattr(result, channel)[:] = measurement[first : first + size].tolist()
            first += size
        result.fresh[:] = np.round(7 * measurement[first:]).astype(int).tolist()
        return result


@dataclass(frozen=True, eq=False)
class Pilot:
    """A compiled autopilot in flight; its state is the C's own."""

    code: Compiled
    state: Any

    def step(self, measurement: np.ndarray) -> Any:
        """Return the output of one control interval from a measurement (22,), in the mission's frame."""
        output, code = self.code.structures.output(), self.code
        pointers = (ctypes.byref(each) for each in (self.state, code.measured(measurement), output))
        getattr(code.library, f"{code.program.name}_step")(*pointers)
        return output

    @property
    def memory(self) -> np.ndarray:
        """Return what the autopilot remembers (n,), in `ned`."""
        return np.array(self.state.memory)


def told_of(output: Any) -> dict[str, np.ndarray]:
    """Return what an output tells beside its command by the names of `TOLD`."""
    parts = [list(output.input), bool(output.flags & WAITING), bool(output.flags & CONSTRAINED), output.given_up]
    parts += [*(list(getattr(output, name)) for name in UNKNOWN), list(output.position), output.parameter]
    told = split_told(np.concatenate([np.atleast_1d(np.asarray(part, dtype=float)) for part in parts]))
    assert told.keys() == TOLD.keys()
    return told


def loaded(program: Program) -> Compiled:
    """Return a program compiled for this machine; once and for all when an earlier run met the same one.

    Raises:
        CompilerError: No compiler answers.
    """
    made = library(compiler(), f"#pragma GCC visibility push(default)\n{single_file(program)}")
    for name in ("start", "step"):
        getattr(made, f"{program.name}_{name}").restype = None
    return Compiled(program, made, structures(program))


def single_file(program: Program) -> str:
    """Return the C of a program as one text."""
    files = sources(program)
    order = [f"{program.name}{ending}" for ending in (".h", "_tables.h", "_tables.c", ".c")]
    return "\n".join(LOCAL_INCLUDE.sub("", files[name]) for name in order if name in files)

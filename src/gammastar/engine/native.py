"""Run many lanes of a step as compiled C: the lanes lie side by side in vector registers, each a flight of its own."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.engine.c_source import c_source, part
from gammastar.engine.compiler import compiler, library
from gammastar.engine.tape import Tape, tape_of
from gammastar.errors import InputError, ShapeError

WORK = 10**8  # operations between two looks at interruptions: a tenth of a second where nothing is vectorised
LONGEST = 10_000  # steps between two looks, so that columns take little memory however few the lanes


@dataclass(frozen=True, eq=False)
class NativeStep:
    """A compiled step (state, exogenous column) -> next state."""

    tape: Tape
    lanes: int  # in a vector register
    source: str  # C
    library: ctypes.CDLL

    def run(
        self,
        states: np.ndarray,
        exogenous: Callable[[int, int], np.ndarray],
        steps: int,
        progress: Callable[[int], None] | None = None,
    ) -> np.ndarray:
        """Return the states (n, lanes) after a number of steps from states (n, lanes); memory does not grow with the steps.

        Args:
            states: A column a lane, as many as wanted.  NaN stays in its lane.
            exogenous: Given a first step and the one after the last, returns their columns: (m, count), shared by all
                lanes, or (m, count, lanes).
            steps: How many.
            progress: Called with the number of steps done so far.
        """
        size, outside = self.tape.sizes
        now = np.array(states, dtype=float, order="C", ndmin=2)
        if now.ndim != 2 or now.shape[0] != size:
            raise ShapeError(f"states must be ({size}, lanes) (got {np.shape(states)}); give a column a lane")
        lanes, done = now.shape[1], 0
        chunk = min(LONGEST, max(1, WORK // max(1, lanes * self.tape.operations)))
        while done < steps and lanes:
            count = min(chunk, steps - done)
            columns = np.asarray(exogenous(done, done + count), dtype=float)
            if columns.shape not in ((outside, count), (outside, count, lanes)):
                raise ShapeError(
                    f"exogenous columns must be ({outside}, {count}) or ({outside}, {count}, {lanes}) (got {columns.shape}); "
                    "give a column a step, for all lanes or for each"
                )
            rows = np.ascontiguousarray(np.swapaxes(columns, 0, 1))
            numbers = (ctypes.c_longlong(lanes), ctypes.c_longlong(count))
            self.library.run(*numbers, *map(_address, (now, rows)), ctypes.c_int(rows.ndim - 2))
            done += count
            if progress is not None:
                progress(done)
        return now


def native_step(step: Any, lanes: int | None = None) -> NativeStep:
    """Return a step compiled for this machine; it was compiled once and for all when an earlier run met the same one.

    Args:
        step: CasADi function of `scan`'s signature; its observation is left out.
        lanes: In a vector register; as many as the machine's registers hold when left out.

    Raises:
        CompilerError: No compiler answers, or it refuses.
        InputError: The step has parts that are no scalar operations, such as tables looked up inside.
    """
    if step.n_in() != 2 or step.numel_in(0) != step.numel_out(0):
        raise InputError(
            f"a step must take (state, exogenous) to the next state first (got {step}); give one that `scan` takes"
        )
    maker, tape = compiler(), tape_of(step, outputs=(0,))
    width = maker.lanes if lanes is None else lanes
    exported = '__attribute__((visibility("default")))'
    head = f"#define EXPORTED {exported}\n#define SIZE {tape.sizes[0]}\n#define OUTSIDE {tape.sizes[1]}\n"
    source = head + c_source(tape, lanes=width) + part("run.c")
    return NativeStep(tape, width, source, library(maker, source))


def run(
    step: Any,
    states: np.ndarray,
    exogenous: Callable[[int, int], np.ndarray],
    steps: int,
    progress: Callable[[int], None] | None = None,
) -> np.ndarray:
    """Return the final states of a step over lanes; see `NativeStep.run`."""
    return native_step(step).run(states, exogenous, steps, progress)


def _address(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)

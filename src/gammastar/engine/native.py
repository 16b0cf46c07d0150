"""Compiled C: flights lie side by side in vector registers, each at a step of its own, and a lane that is free takes the next one."""

from __future__ import annotations

import ctypes
import functools
import threading
from typing import Any

import numpy as np

from gammastar.engine.batch import Batch, Progress
from gammastar.engine.c_source import c_file, part
from gammastar.engine.compiler import Compiler, compiler, library
from gammastar.engine.step import Step, tables_of
from gammastar.engine.tape import tape_of
from gammastar.engine.virtual import observed

MOST_TAPES = 256  # of cores, kept at a time
LOOK = 0.1  # [s] between two looks at progress and interruptions


class Native:
    """Flies steps as compiled C.

    Args:
        step: To be compiled; it was compiled once and for all when an earlier run met the same core with the same kind of tables.
        lanes: In a vector register; as many as the machine's registers hold when left out.
        maker: Compiler; the machine's when left out.

    Raises:
        CompilerError: No compiler answers, or it refuses.
    """

    def __init__(self, step: Step, lanes: int | None = None, maker: Compiler | None = None) -> None:
        maker = maker or compiler()
        self.step, self.lanes = step, lanes or maker.lanes
        self.source = _source(step, self.lanes)
        self.library = library(maker, self.source)

    def fly(self, batch: Batch, workers: int, tell: Progress) -> np.ndarray:
        """Return the final states (n, flights), flown by a number of threads."""
        job = _job(self.step, batch)
        needed = min(workers, -(-batch.flights // self.lanes))
        done = np.zeros((needed, 8), dtype=np.int64)  # a line of the cache for each
        counters = [_address(each) for each in done]
        threads = [threading.Thread(target=self.library.run, args=(ctypes.byref(job), each)) for each in counters]
        try:
            for each in threads:
                each.start()
            for each in threads:
                while each.is_alive():
                    each.join(LOOK)
                    tell(int(done[:, 0].sum()))
        finally:  # after an interruption too: nothing goes on in the background
            job.stop = 1
            for each in threads:
                if each.ident is not None:  # an interruption may come before the last ones have begun
                    each.join()
        tell(int(done[:, 0].sum()))
        return job.ends

    def stretch(self, batch: Batch) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (n, steps) after each step of one flight, and its observations (k, steps).

        CasADi's machine makes the observations of the states.
        """
        job, states = _job(self.step, batch), np.empty((batch.steps, self.step.size))
        job.states = states.ctypes.data
        self.library.run(ctypes.byref(job), _address(np.zeros(1, dtype=np.int64)))
        states = states[: job.flown[0]].T
        return states, observed(self.step, batch, states)


class _Table(ctypes.Structure):
    """`struct table` of c/run.c."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("begins", "rows", "shifts")),
        ("period", ctypes.c_double),
        ("count", ctypes.c_longlong),
    )


class _Job(ctypes.Structure):
    """`struct job` of c/run.c."""

    _fields_ = (
        *((name, ctypes.c_longlong) for name in ("flights", "steps", "first")),
        *((name, ctypes.c_void_p) for name in ("starts", "parameters", "numbers", "tables", "table_of")),
        *((name, ctypes.c_void_p) for name in ("end_states", "states", "steps_flown")),
        ("seed", ctypes.c_ulonglong),
        ("next", ctypes.c_longlong),
        ("stop", ctypes.c_int),
    )

    ends: np.ndarray
    flown: np.ndarray
    held: list[Any]  # what the pointers point to


def _job(step: Step, batch: Batch) -> _Job:
    """Return a job with its results to be filled in: `ends` (n, flights) and `flown` (flights,)."""
    job = _Job(flights=batch.flights, steps=batch.steps, first=batch.first, seed=batch.seed)
    distinct = {id(table): table for lookup in step.lookups for table in tables_of(lookup)}
    place = {key: k for k, key in enumerate(distinct)}
    tables, arrays = (_Table * len(distinct))(), list[np.ndarray]()
    for entry, table in zip(tables, distinct.values(), strict=True):
        kept = [np.ascontiguousarray(each, dtype=float) for each in (table.begins, table.rows, table.shifts)]
        entry.begins, entry.rows, entry.shifts = (each.ctypes.data for each in kept)
        entry.period, entry.count = table.period or np.inf, len(kept[0])
        arrays += kept
    places = [np.array([place[id(table)] for table in tables_of(lookup)]) for lookup in step.lookups]
    table_of = np.array([np.broadcast_to(each, batch.flights) for each in places], dtype=np.int64)
    job.ends, job.flown = np.empty(batch.starts.shape), np.zeros(batch.flights, dtype=np.int64)
    given = [np.ascontiguousarray(each) for each in (batch.starts, batch.parameters, batch.numbers)]
    job.starts, job.parameters, job.numbers = (each.ctypes.data for each in given)
    job.tables, job.table_of = ctypes.addressof(tables), table_of.ctypes.data
    job.end_states, job.steps_flown = job.ends.ctypes.data, job.flown.ctypes.data
    job.held = [tables, table_of, *arrays, *given]
    return job


def _address(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


@functools.lru_cache(maxsize=MOST_TAPES)
def _core(core: Any) -> Any:
    return tape_of(core, (0,))


def _source(step: Step, lanes: int) -> str:
    """Return the C of a step: its core, where it looks, its sizes, and what flies it."""
    tapes = {"core": _core(step.core), **{f"variable{k}": tape_of(each) for k, each in enumerate(step.variables())}}
    firsts = np.cumsum([0, *step.widths]).tolist()
    cases = "".join(
        f"    if (j == {k}) variable{k}(state, parameters, column, rows, x);\n" for k in range(len(firsts) - 1)
    )
    sizes = {
        "SIZE": step.size,
        "PARAMETERS": step.core.numel_in(1),
        "CHANNELS": len(step.channels),
        "LOOKUPS": len(step.lookups),
        "ROWS": firsts[-1],
        "STATUS": -1 if step.status is None else step.status,
    }
    lines = [
        *(f"#define {name} {value}" for name, value in sizes.items()),
        '#define EXPORTED __attribute__((visibility("default")))',
        f"static const unsigned long long NUMBERS[] = {{{', '.join(map(str, [*step.channels, 0]))}}};",
        f"static const long long FIRST_ROWS[] = {{{', '.join(map(str, firsts))}}};",
        "static void variable(int j, const real *state, const real *parameters, const real *column, const real *rows, real *x) {",
        "    (void)j, (void)state, (void)parameters, (void)column, (void)rows, (void)x;",
        f"{cases}}}\n\n",
    ]
    rest = "\n".join(lines) + part("random.h") + part("run.c")
    return c_file(tapes, lanes=lanes, rest=rest, of_rest=("floor",))

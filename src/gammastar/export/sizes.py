"""How an export lies in memory: the structures of its C, and its sizes."""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

from gammastar.export.program import Program
from gammastar.export.tables import tables_of

CHANNELS = {"position": 3, "velocity": 3, "attitude": 9, "angular_velocity": 3}
UNKNOWN = ("acceleration", "jerk", "snap", "angular_acceleration")


class Structures(NamedTuple):
    """The structures of an export, as Python sees them."""

    state: type[ctypes.Structure]
    measurement: type[ctypes.Structure]
    output: type[ctypes.Structure]


def structures(program: Program) -> Structures:
    """Return the structures of a program's header."""
    real: Any = ctypes.c_float if program.real == "float32" else ctypes.c_double
    measurement = [*((name, real * size) for name, size in CHANNELS.items()), ("fresh", ctypes.c_uint8 * 4)]
    output = [
        *(("command", real * len(program.command_names)), ("input", real * 4)),
        *((name, real * 3) for name in UNKNOWN),
        *(("position", real * 3), ("parameter", real), ("laps", ctypes.c_int32)),
        *(("given_up", ctypes.c_uint32), ("flags", ctypes.c_uint32)),
    ]
    told = type("Output", (ctypes.Structure,), {"_fields_": output})
    counts = [("interval", ctypes.c_uint32), ("laps", ctypes.c_int32), ("is_started", ctypes.c_uint32)]
    sample = ("sample", real * sum(CHANNELS.values()))
    state = [("memory", real * program.autopilot.size), *counts, sample, ("last", told)]
    return Structures(
        type("State", (ctypes.Structure,), {"_fields_": state}),
        type("Measurement", (ctypes.Structure,), {"_fields_": measurement}),
        told,
    )


def state_bytes(program: Program) -> int:
    """Return the size of the state that a caller owns [bytes]."""
    return ctypes.sizeof(structures(program).state)


def table_bytes(program: Program) -> int:
    """Return the size of the constant tables [bytes]."""
    width = 4 if program.real == "float32" else 8
    count = sum(table.rows.size + len(table.begins) for table in tables_of(program).values())
    count += 0 if program.samples is None else program.samples.points.size
    schedule = program.schedule
    if schedule is None:
        return width * count
    return width * (count + schedule.rows.size + len(schedule.rest)) + 8 * len(schedule.first)

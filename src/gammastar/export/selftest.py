"""The self-test of an export: recorded moments of a flight, as C."""

from __future__ import annotations

import numpy as np

from gammastar.export.c99 import filled, placeholders, template
from gammastar.export.program import Program, split_told
from gammastar.export.tables import numbers
from gammastar.export.vectors import Moment, sizes_of

TOLERANCES = {"float32": 5e-3, "float64": 1e-10}  # of the size of a number; observers enlarge rounding a thousandfold
COMPARED = (
    "input",
    "unknown",
    "position",
    "parameter",
)  # of what an interval tells; what is on or off may turn by rounding


def selftest(program: Program, moments: list[Moment]) -> str:
    """Return `selftest.c` with these moments."""
    real = program.real
    memory, command, told = sizes_of(moments)
    return filled(
        template("selftest.c"),
        placeholders(program)
        | {
            "moments": str(len(moments)),
            "tolerance": repr(TOLERANCES[real]),
            "moment_rows": ",\n".join(_row(each, real) for each in moments),
            "memory_sizes": numbers(memory, real),
            "command_sizes": numbers(command, real),
            "told_sizes": numbers(_compared(told), real),
        },
    )


def _row(moment: Moment, real: str) -> str:
    parts = moment.memory, moment.measurement[:18], moment.after, moment.command, _compared(moment.told)
    inside = ",\n    ".join(f"{{{numbers(part, real)}}}" for part in parts)
    return f"    {{{moment.interval}u,\n    {inside}}}"


def _compared(told: np.ndarray) -> np.ndarray:
    parts = split_told(told)
    return np.concatenate([parts[name] for name in COMPARED])

"""What an export is made for, and the files that each target has."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gammastar.errors import UnknownNameError
from gammastar.export.c99 import filled, placeholders, sources, template
from gammastar.export.crazyflie import COMMAND, FRAME, crazyflie
from gammastar.export.graphs import FARTHEST, FASTEST
from gammastar.export.program import Program
from gammastar.export.selftest import selftest
from gammastar.export.sizes import state_bytes, table_bytes
from gammastar.export.vectors import moments
from gammastar.law.actuation import RotorSpeeds

DURATION = 20.0  # [s] of the flight of which moments are recorded, when nothing else is said
PARTS = {
    "waits": "the waiting and approach modes",
    "observer": "the observer of unknown forces and torques",
    "filter": "the filter of the sensors",
    "rotors": "the allocation to rotors with their limits and lag",
}
PRECISION = {
    "wrapped": " The parameter of the path is kept within one period, so that it is as precise after hours as at the start.",
    "growing": " The parameter of the path grows for good here: in float32 it is known to a ten-millionth of itself.",
    "bounded": "",
}


def c99(program: Program, duration: float = DURATION) -> dict[str, str]:
    """Return the files of a folder of C99 by their names: header, source, tables, self-test, Makefile, README."""
    files, values = sources(program), placeholders(program)
    written = sorted(name for name in files if name.endswith(".c"))
    values |= {
        "objects": " ".join(name.replace(".c", ".o") for name in written),
        "headers": " ".join(sorted(name for name in files if name.endswith(".h"))),
    }
    return files | {
        "selftest.c": selftest(program, moments(program, duration)),
        "Makefile": filled(template("Makefile"), values),
        "README.md": filled(template("README.md"), values | _facts(program)),
    }


TARGETS: dict[str, Callable[[Program, float], dict[str, str]]] = {"c99": c99, "crazyflie": crazyflie}


def files_of(program: Program, target: str, duration: float = DURATION) -> dict[str, str]:
    """Return the files of an export by their names.

    Raises:
        UnknownNameError: The target is unknown.
    """
    if target not in TARGETS:
        raise UnknownNameError("target", target, TARGETS)
    return TARGETS[target](program, duration)


def differences(target: str) -> dict[str, Any]:
    """Return the facts of an export that its target decides, whatever the program is."""
    return {"frame": FRAME, "command": COMMAND} if target == "crazyflie" else {}


def _facts(program: Program) -> dict[str, str]:
    """Return the placeholders of the README alone."""
    pilot, law = program.autopilot, program.autopilot.law
    present = {
        "waits": law.approach,
        "observer": law.rejection,
        "filter": law.estimator,
        "rotors": isinstance(pilot.actuation, RotorSpeeds),
    }
    parts = ["the law, the evaluation of the path, the reference, progress along the path"]
    parts += [words for key, words in PARTS.items() if present[key]]
    return {
        "parts": ", ".join(parts),
        "delay": f"{pilot.horizon:.4g}",
        "farthest": f"{FARTHEST:g}",
        "fastest": f"{FASTEST:g}",
        "operations": f"{program.operations}",
        "state_bytes": str(state_bytes(program)),
        "table_bytes": str(table_bytes(program)),
        "precision": PRECISION["wrapped" if program.wraps else "bounded" if program.path.ends else "growing"],
        "start_thrust": f"{program.start[18]:.6g}",
    }

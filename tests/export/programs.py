"""Programs to export, and flights of them in the world that their autopilot believes in."""

from __future__ import annotations

import functools
import shutil
import subprocess
import tempfile
from typing import Any

import numpy as np
import pytest

from gammastar.export.program import Program, c_name
from gammastar.export.vectors import believed
from gammastar.law.filter import MOTION
from gammastar.mission import load

needs_compiler = pytest.mark.skipif(not any(map(shutil.which, ("gcc", "clang", "cc"))), reason="no C compiler answers")


@functools.cache
def has_sanitizers() -> bool:
    """Return whether the C compiler can watch addresses and undefined behaviour."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["cc", "-fsanitize=address,undefined", "-x", "c", "-", "-o", f"{folder}/a"]
        try:
            answer = subprocess.run(
                words, input="int main(void) { return 0; }", text=True, capture_output=True, check=False
            )
        except OSError:
            return False
        return answer.returncode == 0


@functools.cache
def exported(name: str, real: str = "float64", **changes: Any) -> Program:
    """Return the program of a built-in mission, with values of its sections changed: flight__duration=2.0."""
    mission = load(name).with_values({key.replace("__", "."): value for key, value in changes.items()})
    return mission.program(c_name(name), real)


def flown(pilot: Any, made: Program, motion: np.ndarray, steps: int) -> np.ndarray:
    """Return the motions (steps + 1, 18) of the believed vehicle under a compiled pilot."""
    move, wrench, motions = believed(made), made.wrench, [motion]
    for _ in range(steps):
        pilot.step(made.graphs.measurement(motions[-1]))
        motions.append(move(motions[-1], pilot.memory[wrench]).full()[:, 0])
    return np.array(motions)


def start_of(made: Program) -> np.ndarray:
    """Return the motion (18,) at the start of the mission."""
    return made.start[:MOTION]

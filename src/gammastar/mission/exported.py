"""A mission as a program for the vehicle's computer."""

from __future__ import annotations

import re

from gammastar.export.program import Program
from gammastar.mission.mission import Mission

DEFAULT_NAME = "mission"


def program(mission: Mission, name: str = DEFAULT_NAME, real: str = "float32", version: str = "") -> Program:
    """Return the autopilot of a mission as a program that can be written in C.

    Args:
        mission: Of one path.
        name: Prefix of every public name; see `c_name`.
        real: 'float32' or 'float64'.
        version: Of gammastar, to be named in the files.

    Raises:
        MissionError: The mission replaces its path on the way.
        UnknownNameError: The real type is unknown.
    """
    pilot, start, parameter = mission.autopilot()
    return Program(name, mission.title, pilot, start, parameter, mission.frame, real, version)


def c_name(name: str) -> str:
    """Return what a mission or a file is called as a prefix in C: small letters, digits and _, a letter first."""
    words = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return words if words[:1].isalpha() else f"{DEFAULT_NAME}_{words}".strip("_")

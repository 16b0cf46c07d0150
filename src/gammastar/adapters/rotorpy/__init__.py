"""RotorPy as a plant that is not ours: a controller for its loop, and its vehicles as a law may believe them to be.

RotorPy has worlds and bodies with the third axis up, `enu` of `gammastar.frames`; all else here has it down, and this room is where the
two meet.  Its plant brings rotors with limits and lag, drag and 9.81 m/s^2 of its own, whatever a law believes.  Checked against
RotorPy 3.0.0.
"""

from gammastar.adapters.rotorpy.controller import Controller
from gammastar.adapters.rotorpy.plant import (
    ABSTRACTIONS,
    GRAVITY,
    Flown,
    environment,
    flown,
    initial_state,
    parameters,
    vehicle_of,
)

__all__ = [
    "ABSTRACTIONS",
    "Controller",
    "Flown",
    "GRAVITY",
    "environment",
    "flown",
    "initial_state",
    "parameters",
    "vehicle_of",
]

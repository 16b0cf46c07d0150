"""What runs a graph."""

from gammastar.engine.compiled import compilations, compiled
from gammastar.engine.machine import CHUNK, scan
from gammastar.engine.native import NativeStep, native_step, run
from gammastar.engine.random import uniforms
from gammastar.engine.step import Inputs, Step
from gammastar.engine.tape import Tape, tape_of

__all__ = [
    "CHUNK",
    "NativeStep",
    "Inputs",
    "Step",
    "Tape",
    "compilations",
    "compiled",
    "native_step",
    "run",
    "scan",
    "tape_of",
    "uniforms",
]

"""What runs a graph."""

from gammastar.engine.compiled import compilations, compiled
from gammastar.engine.machines import processors, run, trace
from gammastar.engine.python_source import python_source
from gammastar.engine.random import checked_flights, uniforms
from gammastar.engine.step import Inputs, Step
from gammastar.engine.tape import Tape, tape_of
from gammastar.engine.virtual import CHUNK, scan

__all__ = [
    "CHUNK",
    "Inputs",
    "Step",
    "Tape",
    "checked_flights",
    "compilations",
    "compiled",
    "processors",
    "python_source",
    "run",
    "scan",
    "tape_of",
    "trace",
    "uniforms",
]

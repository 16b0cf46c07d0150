"""What runs a graph."""

from gammastar.engine.compiled import compilations, compiled
from gammastar.engine.machine import CHUNK, scan

__all__ = ["CHUNK", "compilations", "compiled", "scan"]

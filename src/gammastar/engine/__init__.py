"""What runs a graph."""

from gammastar.engine.machine import CHUNK, scan

__all__ = ["CHUNK", "scan"]

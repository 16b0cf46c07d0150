"""What runs a graph."""

from gammastar.engine.machine import scan

__all__ = ["scan"]

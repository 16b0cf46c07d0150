"""Curves: what is flown along."""

from gammastar.path.base import Path, PathOutputs
from gammastar.path.curve import Curve
from gammastar.path.implicit import ImplicitPath

__all__ = ["Curve", "ImplicitPath", "Path", "PathOutputs"]

"""Curves: what is flown along."""

from gammastar.path.base import Path, PathOutputs
from gammastar.path.curve import Curve, ParametricPath
from gammastar.path.implicit import ImplicitPath

__all__ = ["Curve", "ImplicitPath", "ParametricPath", "Path", "PathOutputs"]

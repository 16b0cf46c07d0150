"""Curves: what is flown along."""

from gammastar.path.base import Path, PathOutputs
from gammastar.path.curve import Curve
from gammastar.path.implicit import ImplicitPath
from gammastar.path.parametric import ParametricPath

__all__ = ["Curve", "ImplicitPath", "ParametricPath", "Path", "PathOutputs"]

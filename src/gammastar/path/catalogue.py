"""Paths by name: each returns a curve (or an implicit path) in world axes, third axis down.

| closed | parameter | open | parameter |
|---|---|---|---|
| circle, ellipse, loop, nonplanar_circle | angle [rad] | line, sine | distance along the axis [m] |
| lemniscate, lissajous, viviani | angle [rad] | helix, spiral, rising lemniscate | angle [rad] |
| trefoil, torus_knot | angle [rad] | polynomial | its own |
"""

from gammastar.path.circles import circle, ellipse, loop, nonplanar_circle
from gammastar.path.knots import lemniscate, lissajous, torus_knot, trefoil, viviani
from gammastar.path.placement import plane_frame as plane_frame
from gammastar.path.strands import helix, line, polynomial, sine, spiral

__all__ = [
    "circle",
    "ellipse",
    "helix",
    "lemniscate",
    "line",
    "lissajous",
    "loop",
    "nonplanar_circle",
    "polynomial",
    "sine",
    "spiral",
    "torus_knot",
    "trefoil",
    "viviani",
]

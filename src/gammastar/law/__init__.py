"""The feedback law as a graph with explicit state, its gains, references and its closed-form prediction."""

from gammastar.law.design import Control, Law, design
from gammastar.law.gains import gains_from_poles
from gammastar.law.linearization import Linearization, decoupling_matrix, linearize
from gammastar.law.predict import Prediction
from gammastar.law.reference import AnyReference, Point, Ramp, Reference, Speed, Stop

__all__ = [
    "AnyReference",
    "Control",
    "Law",
    "Linearization",
    "Point",
    "Prediction",
    "Ramp",
    "Reference",
    "Speed",
    "Stop",
    "decoupling_matrix",
    "design",
    "gains_from_poles",
    "linearize",
]

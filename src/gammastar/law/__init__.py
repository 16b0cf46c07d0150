"""The feedback law as a graph with explicit state, its gains, references and its closed-form prediction."""

from gammastar.law.allocation import Allocation, Extra, allocate
from gammastar.law.approach import Approach
from gammastar.law.design import design
from gammastar.law.filter import KalmanFilter
from gammastar.law.gains import gains_from_poles
from gammastar.law.heading import Along, Azimuth, Heading, Towards
from gammastar.law.law import Control, Law
from gammastar.law.legs import Leg, Legs
from gammastar.law.linearization import Linearization, decoupling_matrix, linearize
from gammastar.law.observer import IntegralAction, Observer, Rejection
from gammastar.law.predict import Prediction
from gammastar.law.profile import Profile
from gammastar.law.reference import AnyReference, Point, Ramp, Reference, Speed, Stop

__all__ = [
    "Allocation",
    "Along",
    "AnyReference",
    "Approach",
    "Azimuth",
    "Control",
    "Extra",
    "Heading",
    "IntegralAction",
    "KalmanFilter",
    "Law",
    "Leg",
    "Legs",
    "Linearization",
    "Observer",
    "Point",
    "Prediction",
    "Profile",
    "Ramp",
    "Reference",
    "Rejection",
    "Speed",
    "Stop",
    "Towards",
    "allocate",
    "decoupling_matrix",
    "design",
    "gains_from_poles",
    "linearize",
]

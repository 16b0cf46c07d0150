"""Bodies: what flies, and the state it has."""

from gammastar.vehicle.body import Rates, Vehicle
from gammastar.vehicle.state import State, StateGraph, join, split

__all__ = ["Rates", "State", "StateGraph", "Vehicle", "join", "split"]

"""A law whose tuning is a graph: one step then serves flights of many tunings."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, NamedTuple

from gammastar.law.law import Law
from gammastar.law.observer import Observer


class Tuning(NamedTuple):
    """Graph: what a law has in place of its numbers; None leaves a number as it is."""

    gains: Mapping[str, Any] | None = None  # SX (n,) by chain, as `Law.gains`
    approach_speed: Any = None  # SX [m/s]
    force: Any = None  # SX [rad/s], bandwidth of the force observer
    torque: Any = None  # SX [rad/s], bandwidth of the torque observer


def tuned(law: Law, tuning: Tuning) -> Law:
    """Graph: return a law that builds graphs as any other does, with its tuning given by graphs.

    It is for building graphs alone: it has no signature, and nothing about it was checked.
    """
    result = copy.copy(law)
    if tuning.gains is not None:
        result.__dict__["gains"] = {**law.gains, **tuning.gains}
    if tuning.approach_speed is not None:
        result.__dict__["approach"] = _with(law.approach, speed=tuning.approach_speed)
    bandwidths = {name: value for name in ("force", "torque") if (value := getattr(tuning, name)) is not None}
    if bandwidths:
        assert isinstance(law.rejection, Observer)
        result.__dict__["rejection"] = _with(law.rejection, **bandwidths)
    return result


def _with(given: Any, **changes: Any) -> Any:
    """Return a copy of a frozen object with some of its fields graphs."""
    result = copy.copy(given)
    result.__dict__.update(changes)
    return result

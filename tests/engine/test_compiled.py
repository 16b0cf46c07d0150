"""Graphs are built once for everything that enters them as a constant."""

from __future__ import annotations

import importlib

import numpy as np

import gammastar as gs
from gammastar import engine

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
GATES = np.array([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1)], dtype=float)


def flown(points: np.ndarray, closed: bool, **how: object) -> gs.FlightRecord:
    """Design and fly a path through waypoints from beside its first one."""
    path = gs.waypoints(points, closed=closed)
    law = gs.design(VEHICLE, path, poles=-3)
    return gs.fly(law, gs.State(points[0] + 0.1), **{"speed": 0.5, "duration": 0.2, **how})


def test_one_compiled_law_serves_all_waypoint_paths_starts_and_schedules() -> None:
    flown(GATES, closed=True)
    flown(GATES, closed=True, speed=None, reference=gs.Ramp(0.5))
    before = engine.compilations()
    for shift in range(3):
        flown(GATES + np.array([shift, 0, -shift]), closed=True, speed=0.3 + shift)
        flown(GATES[: 3 + shift % 2] * 1.5, closed=False, speed=None, reference=gs.Legs((gs.Leg(1.0, to=2.0),)))
    assert engine.compilations() == before


def test_what_enters_a_graph_as_a_constant_makes_another() -> None:
    flown(GATES, closed=True)
    before = engine.compilations()
    flown(GATES, closed=True, duration=0.3)
    assert engine.compilations() == before
    flown(GATES, closed=True, step=5e-4)
    assert engine.compilations() > before


def test_what_was_used_longest_ago_goes_first(monkeypatch) -> None:
    module = importlib.import_module("gammastar.engine.compiled")
    monkeypatch.setattr(module, "_kept", type(module._kept)())
    monkeypatch.setattr(module, "MOST_KEPT", 2)
    for key in ("a", "b", "a", "c"):
        engine.compiled(key, lambda key=key: key.upper())
    assert list(module._kept) == ["a", "c"]
    before = engine.compilations()
    assert engine.compiled("a", lambda: "again") == "A"
    assert engine.compilations() == before

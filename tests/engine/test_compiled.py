"""Graphs are built once for everything that enters them as a constant."""

from __future__ import annotations

import dataclasses
import importlib

import casadi as ca
import numpy as np
import pytest

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


CIRCLE = gs.paths.circle()
BASE = {"vehicle": VEHICLE, "poles": -3, "path": CIRCLE}
SAMPLED = {"feedback": "middle", "rate": 100.0}
VARIANTS = {
    "belief": ({"vehicle": dataclasses.replace(VEHICLE, mass=0.6)}, {"truth": VEHICLE}),
    "truth": ({}, {"truth": dataclasses.replace(VEHICLE, mass=0.6)}),
    "poles": ({"poles": -4}, {}),
    "path": ({"path": gs.paths.circle(1.2)}, {}),
    "yaw output": ({"yaw_output": ca.sinh}, {"yaw_reference": 0.5}),
    "heading": ({}, {"heading": gs.Azimuth((0, 1, 0))}),
    "other heading": ({}, {"heading": gs.Azimuth((0, -1, 0))}),
    "approach": ({"approach": gs.Approach(speed=0.2)}, {}),
    "other approach": ({"approach": gs.Approach(speed=0.2, thrust_floor=4.9)}, {}),
    "integrator": ({}, {"integrator": "lie-euler"}),
    "ramp": ({}, {"speed": None, "reference": gs.Ramp(0.5)}),
    "over progress": ({}, {"speed": None, "reference": gs.Profile(((0, 0.5), (1, 0.6)))}),
    "sampled": ({}, SAMPLED),
    "held from the start": ({}, SAMPLED | {"feedback": "start"}),
    "noise": ({}, SAMPLED | {"noise": gs.SensorNoise(position=(0.01, 0.01, 0.01))}),
}


def end_of(name: str) -> np.ndarray:
    """Return the last state of a variant of a short flight."""
    design, how = VARIANTS[name]
    chosen = BASE | design
    law = gs.design(chosen.pop("vehicle"), chosen.pop("path"), **chosen)
    start = gs.State((1.3, 0.4, -0.2), angular_velocity=(0.1, -0.2, 0.5))
    return gs.fly(law, start, **{"speed": 0.5, "duration": 0.3, **how}).state[-1]


def test_no_two_flights_share_a_graph_that_are_not_the_same(monkeypatch) -> None:
    """Flown one after the other, each variant ends where it ends in a process that has built nothing before; all end elsewhere."""
    module = importlib.import_module("gammastar.engine.compiled")
    monkeypatch.setattr(module, "_kept", type(module._kept)())
    together = {name: end_of(name) for name in VARIANTS}
    for name in VARIANTS:
        module._kept.clear()
        assert np.array_equal(together[name], end_of(name)), name
    ends = np.array(list(together.values()))
    distances = np.abs(ends[:, None] - ends).max(axis=2) + np.eye(len(ends))
    assert distances.min() > 0


class Turned:
    """A heading of a user's own, whose data may change."""

    rate = 1.0

    def yaw_rate(self, path, state, place, parameter_rate) -> tuple:
        """Return a constant yaw rate."""
        return self.rate, 0.0


def test_changed_data_of_a_users_function_are_seen() -> None:
    """Equal objects over changed data: a bound method, a closure, a heading."""
    factor, heading = [1.0], Turned()
    ends = []
    for value in (1.0, 4.0):
        factor[0], heading.rate = value, value
        law = gs.design(VEHICLE, CIRCLE, -3, yaw_output=lambda rate: factor[0] * rate)
        start = gs.State((1.2, 0, 0), angular_velocity=(0, 0, 0.5))
        assert law.transformed_state(start)[1][4] == pytest.approx(0.5 * value)
        plain = gs.design(VEHICLE, CIRCLE, -3)
        ends.append(gs.fly(plain, start, speed=0.5, duration=3, heading=heading).angular_velocity[-1, 2])
    assert ends == pytest.approx([1.0, 4.0], abs=1e-2)


def test_what_cannot_be_hashed_is_no_hindrance() -> None:
    heading, approach = gs.Azimuth(gain=np.array(2.0)), gs.Approach(speed=np.array(2.0))
    law = gs.design(VEHICLE, CIRCLE, -3, approach=approach)
    assert gs.fly(law, gs.State((1.2, 0, 0)), speed=0.5, duration=0.1, heading=heading).completed

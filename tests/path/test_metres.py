"""Curves by their arc length: the same curve, one metre a metre, round after round and beyond its ends."""

from __future__ import annotations

import numpy as np
import pytest

import gammastar as gs
from gammastar import engine
from gammastar.errors import InputError
from gammastar.lookup import graph_at
from gammastar.path.metres import PACE, by_length

GATES = [(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1)]
PATHS = {
    "circle": gs.paths.circle(2.0),
    "ellipse": gs.paths.ellipse((2.0, 0.7)),
    "trefoil": gs.paths.trefoil(),
    "closed waypoints": gs.waypoints(GATES, closed=True),
    "open waypoints": gs.waypoints(GATES),
    "parabola": gs.Curve(lambda t: (t, t**2, 0 * t), ends=(-1.0, 2.0)),
}
VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)


@pytest.mark.parametrize("name", PATHS)
def test_the_curve_is_the_same_at_the_pace_of_one(name: str) -> None:
    path, metric = PATHS[name], by_length(PATHS[name])
    length = path.length()
    assert metric.domain == (0.0, length)
    turns = 2.5 if path.period else 1.1
    metres = np.linspace(-(turns - 1) * length, turns * length, 700)
    jets = metric.jets(metres)
    np.testing.assert_allclose(metric.points(metres), path.points(path.at_length(metres)), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(jets[:, 1], axis=1), 1, atol=5 * PACE)
    assert np.abs(np.sum(jets[:, 1] * jets[:, 2], axis=1)).max() < 1e-3  # acceleration is across at a steady pace


@pytest.mark.parametrize("name", PATHS)
def test_every_derivative_is_the_derivative_of_the_one_before(name: str) -> None:
    metric = by_length(PATHS[name])
    metres = np.random.default_rng(0).uniform(*metric.domain, 60)
    step = 1e-5
    differences = (metric.jets(metres + step) - metric.jets(metres - step)) / (2 * step)
    jets = metric.jets(metres)
    for k in range(4):
        size = np.abs(jets[:, k + 1]).max()
        np.testing.assert_allclose(differences[:, k], jets[:, k + 1], atol=1e-5 * (1 + size))


@pytest.mark.parametrize("name", ["ellipse", "closed waypoints", "open waypoints"])
def test_a_speed_in_metres_a_second_is_flown(name: str) -> None:
    """And exactly: within rounding of the path, at the speed asked for, as the closed form says."""
    metric = by_length(PATHS[name])
    record = gs.fly(
        gs.design(VEHICLE, metric, poles=(-3, -3.2, -3.4, -3.6)),
        gs.State(metric.points(np.array([0.5]))[0]),
        speed=0.6,
        duration=10,
    )
    late = (record.time > 8) & (record.tangential_state[:, 0] < metric.domain[1] - 1 if metric.ends else True)
    np.testing.assert_allclose(np.linalg.norm(record.velocity[late], axis=1), 0.6, rtol=1e-4)
    assert record.distance.max() < 1e-9
    assert record.summary()["oracle"]["max_position_error_m"] < 1e-6


def test_the_graph_looks_up_what_the_numbers_say() -> None:
    for name in ("ellipse", "closed waypoints", "open waypoints"):
        import casadi as ca

        metric = by_length(PATHS[name])
        symbol = ca.MX.sym("metres")
        lookup = ca.Function("lookup", [symbol], [graph_at(metric.lookups, symbol)])
        metres = np.linspace(-1, 1.3 * metric.domain[1], 101) + 1e-5
        found = lookup.map(len(metres))(metres[None, :]).full()
        np.testing.assert_allclose(found, metric.data(metres), rtol=1e-9, atol=1e-9)


def test_waypoint_paths_by_their_length_share_one_graph_too() -> None:
    def flown(shift: float) -> None:
        metric = by_length(gs.waypoints(np.array(GATES) + shift, closed=True))
        law = gs.design(VEHICLE, metric, poles=-3)
        gs.fly(law, gs.State(np.array(GATES[0]) + shift + 0.1), speed=0.5, duration=0.2)

    flown(0.0)
    before = engine.compilations()
    flown(1.0)
    assert engine.compilations() == before


def test_what_has_no_table_of_lengths_is_refused() -> None:
    for wrong in (gs.paths.helix(), gs.paths.circle(kind="implicit"), "circle"):
        with pytest.raises(InputError):
            by_length(wrong)

"""Paths through waypoints: data for one graph, and flown as exactly as any formula."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar.errors import InputError
from gammastar.lookup import graph_at
from gammastar.path.sampling import sample
from gammastar.path.smoothness import jumps
from gammastar.path.waypoints import WaypointPath

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
ANGLES = np.linspace(0, 2 * np.pi, 12, endpoint=False)
POINTS = np.column_stack([3 * np.cos(ANGLES), 2 * np.sin(ANGLES), 0.4 * np.sin(3 * ANGLES)])
OPEN, CLOSED = (gs.waypoints(POINTS, closed=closed) for closed in (False, True))


@pytest.mark.parametrize("path", [OPEN, CLOSED], ids=["open", "closed"])
def test_graph_table_and_numbers_agree(path: WaypointPath) -> None:
    """The jet from looked-up data equals the spline's own numbers: inside segments, at knots, and a period further on."""
    symbol, place = ca.MX.sym("parameter"), ca.SX.sym("place", 1 + path.data_size)
    lookup = ca.Function("lookup", [symbol], [graph_at(path.lookups, symbol)])
    jet = ca.Function("jet", [place], [ca.horzcat(*path.jet(place))])
    low, high = path.domain
    shift = path.period or 0.0
    for parameter in [*np.linspace(low, high - 1e-9, 41), *path.spline.knots[:-1]]:
        for wanted in (parameter, parameter + shift, parameter - 2 * shift):
            data = np.array(lookup(wanted)).ravel()
            np.testing.assert_allclose(data, path.data(np.array([wanted]))[:, 0], rtol=0, atol=1e-12)
            graph = np.array(jet(np.concatenate([[wanted], data]))).T
            expected = path.spline.evaluate([wanted], 5)[0]
            scale = np.abs(expected).max(axis=1, keepdims=True) + 1
            assert np.abs((graph - expected) / scale).max() < 1e-7
            assert np.abs((path.jets(np.array([wanted]))[0] - expected) / scale).max() < 1e-7


@pytest.mark.parametrize("path", [OPEN, CLOSED], ids=["open", "closed"])
def test_a_flight_along_waypoints_follows_its_closed_form(path: WaypointPath) -> None:
    """Also across the knots, which the flight passes by the dozen: the graph's extrapolation within a step is not seen."""
    flight = gs.fly(
        gs.design(VEHICLE, path, poles=-3), gs.State(position=POINTS[1] + 0.2), speed=0.6, duration=12, step=2e-3
    )
    assert flight.completed
    assert flight.distance[-1] < 1e-9
    assert flight.summary()["oracle"]["max_position_error_m"] < 1e-7


def test_an_extended_path_runs_straight_on_smoothly() -> None:
    """No jump of five derivatives is found over the whole domain, the ends are straight, and the waypoints keep their places."""
    plain, path = gs.waypoints(POINTS), gs.waypoints(POINTS, before=3.0, after=5.0, blend=2.0)
    low, high = path.domain
    assert (low, high) == pytest.approx((-3, plain.domain[1] + 5), abs=1e-12)
    assert jumps(sample(path)) == []
    ends = path.jets(np.array([low, low + 0.9, high - 2.9, high, high + 10]))
    assert ends[:, 2:] == pytest.approx(np.zeros((5, 4, 3)), abs=1e-11)
    grid = np.linspace(*plain.domain, 50)
    assert path.jets(grid) == pytest.approx(plain.jets(grid), abs=1e-12)
    assert gs.waypoints(POINTS, after=1.0).domain[0] == 0
    with pytest.raises(InputError, match="only an open path is extended"):
        gs.waypoints(POINTS, closed=True, before=1.0)


def test_a_vehicle_flies_on_along_the_extension() -> None:
    """Over the last waypoint and 4 m of the straight: the distance stays rounding."""
    path = gs.waypoints(POINTS, before=3.0, after=9.0)
    law = gs.design(VEHICLE, path, poles=-3)
    length = path.spline.knots[-1] - 9.0
    point = path.points(np.array([length - 4.0]))[0]
    flight = gs.fly(law, gs.State(position=point), speed=1.0, duration=9.0)
    assert flight.tangential_state[-1, 0] > length + 3
    assert flight.distance.max() < 1e-6


def test_a_closed_path_goes_round_more_than_once() -> None:
    flight = gs.fly(
        gs.design(VEHICLE, CLOSED, poles=-3),
        gs.State(position=POINTS[0]),
        speed=1.5,
        duration=15,
        feedback="middle",
        rate=400,
    )
    assert flight.tangential_state[-1, 0] > 1.2 * CLOSED.period
    assert flight.distance[flight.time > 8].max() < 1e-5


def test_an_approach_works_on_waypoints() -> None:
    law = gs.design(VEHICLE, CLOSED, poles=(-3.4, -3.8, -4.2, -4.6), approach=gs.Approach())
    generator = np.random.default_rng(4)
    for _ in range(4):
        start = gs.State(position=generator.uniform(-4, 4, 3), attitude=gs.so3.random(generator))
        flight = gs.fly(law, start, speed=0.5, duration=15, step=2e-3)
        assert flight.completed
        assert flight.distance[-1] < 1e-4

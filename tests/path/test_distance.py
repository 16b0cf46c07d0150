"""The distance as a graph, and many nearest points at once: both are those of one position after the other."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar.path import Path

ELLIPSE = gs.implicit_from_formula("x**2/4 + y**2 - 1", "z", pi="atan2(y, x)", seed=(2, 0, 0), period=2 * np.pi)
COURSE = gs.waypoints([(0, 0, -2), (4, 1, -3), (6, 5, -1.5), (2, 8, -1)])
SHORT = gs.Curve(lambda t: (t, t**2 / 2, 0), ends=(0.0, 1.0))
PATHS = {"ellipse": ELLIPSE, "waypoints": COURSE, "ends": SHORT, "trefoil": gs.paths.trefoil()}


def places(path: Path, size: float) -> np.ndarray:
    """Return positions (60, 3) around points of the path, and beyond its ends where it has some."""
    draw = np.random.default_rng(1)
    margin = 0.2 if path.ends is not None else 0.0
    low, high = path.domain
    return path.points(np.linspace(low - margin, high + margin, 60)) + draw.uniform(-size, size, (60, 3))


@pytest.mark.parametrize("name", PATHS)
def test_the_distance_as_a_graph_is_that_of_the_nearest_point(name: str) -> None:
    """From a parameter a little off; on the ellipse pi is not the parameter of the nearest point."""
    path = PATHS[name]
    positions = places(path, 0.2)
    parameters = path.start_parameters(positions)
    near = parameters + 1e-3 * np.cos(np.arange(len(parameters)))
    position, place, ends = ca.SX.sym("position", 3), ca.SX.sym("place", 1 + path.data_size), ca.SX.sym("ends", 2)
    graph = ca.Function("distance", [position, place, ends], [path.distance(position, place, (ends[0], ends[1]))])
    found = graph(positions.T, np.vstack([near, path.data(near)]), path.ends or (-np.inf, np.inf)).full().ravel()
    assert found == pytest.approx(path.distances(positions, parameters), abs=1e-9)


@pytest.mark.parametrize("name", PATHS)
def test_many_nearest_points_are_found_as_each_alone(name: str) -> None:
    """To the last bit, near and far, in blocks of any size."""
    path = PATHS[name]
    positions = np.vstack([places(path, 0.5), 10 * places(path, 1.0)])
    together = path.start_parameters(np.tile(positions, (2, 1)))
    assert np.array_equal(together[: len(positions)], together[len(positions) :])
    for k in range(0, len(positions), 17):
        assert path.start_parameter(positions[k]) == together[k]
    assert path.start_parameters(np.empty((0, 3))).shape == (0,)

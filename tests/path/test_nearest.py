"""The nearest points of a path from a dense row of its points."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from gammastar.path.nearest import nearest, polished

ROW = np.linspace(0, 2 * np.pi, 513)


def ellipse_jets(parameters: np.ndarray) -> np.ndarray:
    """Return point and two derivatives (n, 3, 3) of an ellipse with semi-axes 2 and 1."""
    cosine, sine = np.cos(parameters), np.sin(parameters)
    point = np.column_stack([2 * cosine, sine, 0 * sine])
    return np.stack([point, np.column_stack([-2 * sine, cosine, 0 * sine]), -point], axis=1)


def test_a_flight_asks_for_little_more_than_one_jet_a_row() -> None:
    """The row's own jets foretell the foot, so that one Newton step from there is enough for most."""
    asked: list[int] = []

    def jets(parameters: np.ndarray) -> np.ndarray:
        asked.append(len(parameters))
        return ellipse_jets(parameters)

    angles = np.linspace(0, 6, 20_000)
    offsets = np.column_stack([0 * angles, 0 * angles, np.exp(-angles)])
    feet, distances = nearest(ellipse_jets(angles)[:, 0] + offsets, ROW, ellipse_jets(ROW)[:, 0], jets)
    assert feet == pytest.approx(angles, abs=1e-12)
    assert distances == pytest.approx(np.exp(-angles), rel=1e-12)
    assert sum(asked) < 1.25 * len(angles) + len(ROW)


def test_the_nearest_of_two_strands_is_found_between_points_of_the_row() -> None:
    """On the short axis of the ellipse both ends are candidates; a hair to one side the nearer one wins."""
    positions = np.array([[0, 1e-9, 0], [0, -1e-9, 0], [0, 0, 5], [1.9, 0, 0]])
    feet, distances = nearest(positions, ROW, ellipse_jets(ROW)[:, 0], ellipse_jets)
    assert feet[:2] == pytest.approx([np.pi / 2, 3 * np.pi / 2])
    assert distances == pytest.approx([1 - 1e-9, 1 - 1e-9, np.sqrt(26), 0.1], abs=1e-12)


def test_the_distance_of_a_polished_point_is_its_own() -> None:
    position = np.array([[3.0, 2.0, 1.0]])
    foot, distance = polished(position, np.array([0.3]), np.array([0.0]), np.array([1.5]), ellipse_jets)
    point, tangent, _ = ellipse_jets(foot)[0]
    assert abs((position[0] - point) @ tangent) < 1e-9
    assert distance == pytest.approx(np.linalg.norm(position[0] - point), rel=1e-14)


def test_distances_along_an_implicit_path_need_no_library_that_is_slow_to_load() -> None:
    """Loading scipy.spatial takes a quarter of a second, more than the distances of a whole flight."""
    code = (
        "import sys, numpy as np, gammastar as gs; path = gs.paths.circle(kind='implicit'); "
        "path.distances(np.ones((5, 3)), np.zeros(5)); print('scipy.spatial' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"

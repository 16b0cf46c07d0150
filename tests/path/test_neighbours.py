"""The nearest of many points, against a search tree."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gammastar.path.neighbours import RUN, neighbours

ANGLES = np.linspace(0, 2 * np.pi, 1000)
RANDOM = np.random.default_rng(3)
POINTS = {
    "a circle": np.column_stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES]),
    "a tight helix far from the origin": np.column_stack([np.cos(40 * ANGLES), np.sin(40 * ANGLES), ANGLES]) + 1e6,
    "points in no order": RANDOM.normal(size=(700, 3)),
    "as many as are asked for": RANDOM.normal(size=(16, 3)),
    "one run and a point": RANDOM.normal(size=(RUN + 1, 3)),
    "one place again and again": np.ones((300, 3)),
}


@pytest.mark.parametrize("name", POINTS)
@pytest.mark.parametrize("count", [1, 16])
@pytest.mark.parametrize("way", ["along a line", "in no order"])
def test_neighbours_are_those_of_a_search_tree(name: str, count: int, way: str) -> None:
    """From far away through the middle to the other side; distances agree to rounding, also where several points are equally near."""
    points = POINTS[name]
    middle = points.mean(axis=0)
    positions = middle + np.linspace(-5, 5, 3 * RUN + 7)[:, None] * np.array([1.0, 0.3, 0.0])
    if way == "in no order":
        positions = middle + RANDOM.normal(size=(RUN + 5, 3))
    distances, indices = neighbours(positions, points, count)
    expected = cKDTree(points).query(positions, k=[*range(1, count + 1)])[0]
    assert distances == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert np.linalg.norm(points[indices] - positions[:, None], axis=2) == pytest.approx(distances, rel=1e-12)

"""Paths travel to other processes: what the package makes can be pickled, before and after it has been used."""

from __future__ import annotations

import pickle
from typing import Any

import casadi as ca
import numpy as np
import pytest

from gammastar import so3
from gammastar.path import Curve, Path
from gammastar.path import catalogue as paths
from gammastar.path.formula import curve_from_formula, implicit_from_formula
from gammastar.path.placement import placed
from gammastar.path.waypoints import waypoints

KNOT = np.array([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1)], dtype=float)
MADE: dict[str, Path] = {
    **{name: getattr(paths, name)() for name in sorted(set(paths.__all__) - {"polynomial"})},
    "polynomial": paths.polynomial([[0, 1], [0, 0, 1], [2]]),
    "rising lemniscate": paths.lemniscate(kind="rising"),
    "implicit circle": paths.circle(kind="implicit", normal=(1, 1, 1), coordinates="quadratic"),
    "open waypoints": waypoints(KNOT),
    "closed waypoints": waypoints(KNOT, closed=True),
    "formula": curve_from_formula("lambda", "a*sin(lambda)", "-1", constants={"a": 0.5}),
    "implicit formula": implicit_from_formula("sqrt(x**2+y**2)-1", "z", "atan2(y, x)", (1, 0, 0), period="2*pi"),
    "placed knot": placed(paths.trefoil(), (1, 2, 3), so3.pitch(30), 0.5),
    "placed implicit circle": placed(paths.circle(kind="implicit"), (1, 2, 3), so3.roll(50), 2.0),
}


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("is_used", [False, True])
def test_a_path_comes_back_as_it_was(name: str, is_used: bool) -> None:
    path: Any = MADE[name]
    low, high = path.domain
    grid = np.linspace(low, high, 7)
    jets = path.jets(grid)
    if is_used:
        path.start_parameter(path.points(grid[3:4])[0] + 0.01)
    again = pickle.loads(pickle.dumps(path))
    assert again.jets(grid) == pytest.approx(jets, abs=1e-13)
    assert (again.name, again.period, again.domain) == (path.name, path.period, path.domain)
    with pytest.raises(AttributeError):
        again.name = "another"


def test_what_travels_is_small() -> None:
    """The fields, not the graphs that have been built from them."""
    path = paths.torus_knot()
    path.jets(np.zeros(1))
    assert len(pickle.dumps(path)) < 1000


def test_a_callable_of_the_user_travels_if_it_can() -> None:
    assert pickle.loads(pickle.dumps(Curve(wave))).points(np.array([0.5]))[0] == pytest.approx([0.5, np.sin(0.5), 0])
    with pytest.raises((pickle.PicklingError, AttributeError)):
        pickle.dumps(Curve(lambda s: (s, ca.sin(s), 0)))


def wave(s: Any) -> tuple[Any, Any, Any]:
    return s, ca.sin(s), 0

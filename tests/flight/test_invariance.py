"""On a path the vehicle stays, accelerating or not; kicked off it, it comes back: every path of the catalogue."""

from __future__ import annotations

import numpy as np
import pytest

import gammastar as gs
from gammastar.path import catalogue

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
POLES = (-2.7, -2.9, -3.1, -3.3)


def path_of(name: str) -> gs.Curve:
    """Return a path of the catalogue."""
    arguments = {"coefficients": ((0, 1), (0, 0, 0.05), (-1,))} if name == "polynomial" else {}
    return getattr(gs.paths, name)(**arguments)


@pytest.mark.parametrize("name", catalogue.__all__)
def test_the_path_is_an_invariant_set_and_attracts(name: str) -> None:
    """From rest on the path up to 0.8 m/s nothing leaves it; a kick of 0.5 m/s and 0.5 rad/s decays like the closed form."""
    path = path_of(name)
    law = gs.design(VEHICLE, path, POLES)
    first, tangent = path.jets(np.array([path.domain[0]]))[0, :2]
    speed = 0.8 / np.linalg.norm(tangent)
    steady = gs.fly(law, gs.State(first), speed=speed, duration=8)
    assert steady.completed
    assert steady.distance.max() < 1e-10
    state = steady.state[-1].copy()
    state[3:6] += 0.5 * np.array([2, -1, 2]) / 3
    state[15:18] += 0.5 * np.array([-1, 2, 2]) / 3
    kicked = gs.fly(law, gs.State.from_vector(state), speed=speed, duration=8)
    assert kicked.distance.max() > 0.01
    assert kicked.distance[-1] < 1e-5
    assert kicked.summary()["oracle"]["max_position_error_m"] < 1e-7

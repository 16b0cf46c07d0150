"""Twenty numbers in the paper's order, Eq. (7)."""

from __future__ import annotations

import dataclasses

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from gammastar import so3
from gammastar.errors import GammastarError, RotationError, ShapeError
from gammastar.vehicle import State, join, split
from gammastar.vehicle.state import NAMES, SIZE
from strategies import UPRIGHT, UPSIDE_DOWN, numbers, rotations, states, vectors


def test_the_order_is_that_of_the_paper() -> None:
    """chi, v, columns of R, Omega, zeta1, zeta2."""
    R = so3.exp([0.1, 0.2, 0.3])
    x = State((1, 2, 3), (4, 5, 6), R, (7, 8, 9), 10, 11).vector(0.0)
    assert x.tolist() == [1, 2, 3, 4, 5, 6, *so3.project(R)[0].T.ravel(), 7, 8, 9, 10, 11]
    assert len(NAMES) == SIZE == len(x)
    assert NAMES[6:9] == ("r11", "r21", "r31")
    assert NAMES[15] == "angular_velocity_x"
    assert NAMES[18:] == ("thrust", "thrust_rate")


@given(states())
def test_vector_and_from_vector_are_inverses(x: np.ndarray) -> None:
    assert State.from_vector(x).vector(1.0) == pytest.approx(x, abs=1e-14)  # one projection onto SO(3)


@given(states())
def test_split_and_join_are_inverses(x: np.ndarray) -> None:
    assert np.array_equal(np.array(BOTH(x)[0]).ravel(), x)


@given(rotations(), states())
def test_split_reads_the_attitude_column_by_column(R: np.ndarray, x: np.ndarray) -> None:
    x[6:15] = so3.stack(R)
    assert np.array_equal(np.array(BOTH(x)[1]), R)


SYMBOL = ca.SX.sym("state", 20)
BOTH = ca.Function("both", [SYMBOL], [join(split(SYMBOL)), split(SYMBOL).attitude])


@given(numbers(0.1, 50.0))
def test_an_open_thrust_becomes_the_weight_that_flies(weight: float) -> None:
    assert State((0, 0, 0)).vector(weight)[18] == weight
    assert State((0, 0, 0), thrust=2.0).vector(weight)[18] == 2.0


@pytest.mark.parametrize("printed", [UPRIGHT, UPSIDE_DOWN], ids=["upright", "upside down"])
def test_a_printed_rotation_is_projected_and_its_distance_kept(printed: object) -> None:
    state = State((0, 0, 0), attitude=printed)
    rotation, distance = so3.project(printed)
    assert np.array_equal(state.attitude, rotation)
    assert state.attitude_distance == distance > 0
    assert so3.drift(state.attitude) < 1e-15


def test_a_state_cannot_be_changed() -> None:
    state = State((1, 2, 3))
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.position = (0, 0, 0)
    for part in (state.position, state.velocity, state.attitude, state.angular_velocity):
        with pytest.raises(ValueError, match="read-only"):
            part[0] = 1


@given(vectors())
def test_a_state_keeps_no_reference_to_what_came_in(position: np.ndarray) -> None:
    attitude = np.eye(3)
    state = State(position, attitude=attitude)
    position[0], attitude[0, 0] = 99, 99
    assert state.position[0] != 99
    assert state.attitude[0, 0] == 1


@pytest.mark.parametrize(
    ("parts", "error"),
    [
        ({"position": (1, 2)}, ShapeError),
        ({"position": (1, 2, np.nan)}, ShapeError),
        ({"velocity": 3.0}, ShapeError),
        ({"angular_velocity": [[1, 2, 3]]}, ShapeError),
        ({"attitude": np.eye(2)}, ShapeError),
        ({"attitude": -np.eye(3)}, RotationError),
        ({"attitude": 1.1 * np.eye(3)}, RotationError),
        ({"thrust": np.inf}, GammastarError),
        ({"thrust": "much"}, GammastarError),
        ({"thrust_rate": np.nan}, GammastarError),
    ],
)
def test_a_part_that_cannot_be_is_refused(parts: dict, error: type[Exception]) -> None:
    with pytest.raises(error):
        State(**{"position": (0, 0, 0), **parts})


@pytest.mark.parametrize("vector", [np.zeros(19), np.full(20, np.nan), np.zeros((20, 1))])
def test_a_stacked_state_is_twenty_finite_numbers(vector: np.ndarray) -> None:
    with pytest.raises(ShapeError, match="state"):
        State.from_vector(vector)

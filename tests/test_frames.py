"""The map between north-east-down and z-up: S = diag(1, -1, -1) on both sides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gammastar import so3
from gammastar.errors import UnknownNameError
from gammastar.frames import FRAMES, REVERSAL, check_frame, convert_attitude, convert_vector
from strategies import batches, rotations, vectors

any_frame = st.sampled_from(FRAMES)


@given(any_frame, batches(vectors(10.0)), batches(rotations()))
def test_converting_twice_is_the_identity(frame: str, many: np.ndarray, turns: np.ndarray) -> None:
    assert np.array_equal(convert_vector(convert_vector(many, frame), frame), many)
    assert np.array_equal(convert_attitude(convert_attitude(turns, frame), frame), turns)


@given(any_frame, rotations(), vectors(10.0))
def test_body_vectors_turn_alike_in_both_frames(frame: str, R: np.ndarray, body: np.ndarray) -> None:
    """R b in the world is the same vector whether R and b are converted first or the result is."""
    converted = convert_attitude(R, frame) @ convert_vector(body, frame)
    assert converted == pytest.approx(convert_vector(R @ body, frame), abs=1e-14)


@given(any_frame, rotations(), rotations())
def test_converted_attitudes_are_rotations_and_compose(frame: str, R: np.ndarray, S: np.ndarray) -> None:
    turned = convert_attitude(R, frame)
    assert so3.drift(turned) <= so3.drift(R) + 1e-15
    assert np.linalg.det(turned) == pytest.approx(1, abs=1e-14)
    assert convert_attitude(R @ S, frame) == pytest.approx(turned @ convert_attitude(S, frame), abs=1e-15)


@given(any_frame, vectors(5.0), vectors(5.0))
def test_cross_products_are_kept(frame: str, a: np.ndarray, b: np.ndarray) -> None:
    """Det S = 1, so rates and torques, which are cross products, convert as positions do: hat(S w) = S hat(w) S."""
    converted = np.cross(convert_vector(a, frame), convert_vector(b, frame))
    assert converted == pytest.approx(convert_vector(np.cross(a, b), frame), abs=1e-13)
    assert so3.hat(convert_vector(a, frame)) == pytest.approx(convert_attitude(so3.hat(a), frame), abs=0)


def test_ten_metres_up_is_ten_metres_negative_down() -> None:
    assert convert_vector([1, 2, 10], "enu").tolist() == [1, -2, -10]
    assert convert_vector([1, 2, 10], "ned").tolist() == [1, 2, 10]


@given(rotations())
def test_thrust_pushes_along_the_upward_body_axis_in_enu(R: np.ndarray) -> None:
    """Inside, thrust is -R e3 with e3 down; of the converted attitude it is +R e3 with e3 up."""
    inside = -R[:, 2]
    assert convert_vector(inside, "enu") == pytest.approx(convert_attitude(R, "enu")[:, 2], abs=0)


@pytest.mark.parametrize("frame", FRAMES)
def test_a_batch_is_converted_element_by_element(frame: str) -> None:
    generator = np.random.default_rng(0)
    many, turns = (
        generator.normal(size=(4, 5, 3)),
        np.array([so3.random(generator) for _ in range(6)]).reshape(2, 3, 3, 3),
    )
    assert np.array_equal(convert_vector(many, frame)[3, 1], convert_vector(many[3, 1], frame))
    assert convert_attitude(turns, frame)[1, 2] == pytest.approx(convert_attitude(turns[1, 2], frame), abs=0)


@pytest.mark.parametrize("frame", FRAMES)
def test_the_answer_is_a_copy(frame: str) -> None:
    vector, turn = np.arange(3.0), np.eye(3)
    convert_vector(vector, frame)[:] = 7
    convert_attitude(turn, frame)[:] = 7
    assert vector.tolist() == [0, 1, 2]
    assert np.array_equal(turn, np.eye(3))


def test_the_reversal_is_its_own_inverse_and_a_half_turn() -> None:
    assert np.array_equal(REVERSAL @ REVERSAL, np.eye(3))
    assert so3.roll(180) == pytest.approx(REVERSAL, abs=1e-15)


@pytest.mark.parametrize(
    "convert", [check_frame, lambda f: convert_vector([0, 0, 0], f), lambda f: convert_attitude(np.eye(3), f)]
)
def test_an_unknown_frame_is_refused_with_the_known_ones(convert) -> None:
    with pytest.raises(UnknownNameError, match=r"enu, ned .*did you mean") as caught:
        convert("neds")
    assert caught.value.known == ["enu", "ned"]

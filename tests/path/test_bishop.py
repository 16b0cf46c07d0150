"""Rotation-minimising frames: the exact solution on a helix, and the two laws that define them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from gammastar.path.bishop import initial_normals, transported_normals
from strategies import CURVES, directions

RADIUS, RISE = 1.3, 0.4  # of the helix (r cos a, r sin a, b a)


def helix_tangent(angle: float) -> tuple[np.ndarray, np.ndarray]:
    size = np.hypot(RADIUS, RISE)
    tangent = np.array([-RADIUS * np.sin(angle), RADIUS * np.cos(angle), RISE]) / size
    return tangent, np.array([-RADIUS * np.cos(angle), -RADIUS * np.sin(angle), 0]) / size


def frenet(angle: float) -> np.ndarray:
    """Return the principal normal and the binormal as columns (3, 2)."""
    tangent, turning = helix_tangent(angle)
    normal = turning / np.linalg.norm(turning)
    return np.column_stack([normal, np.cross(tangent, normal)])


def test_on_a_helix_the_frame_turns_back_by_the_total_torsion() -> None:
    """N = N cos(f) - B sin(f) with f' = torsion times speed = b / sqrt(r^2 + b^2) per radian: the exact solution."""
    angles = np.array([2.0, -3.0, 0.3, 25.0, 0.3, 0.9])
    tangents = np.array([helix_tangent(angle)[0] for angle in angles])
    frames = transported_normals(helix_tangent, angles, tangents, 0.3)
    start = frenet(0.3).T @ initial_normals(helix_tangent(0.3)[0])
    for angle, frame in zip(angles, frames, strict=True):
        turn = -RISE / np.hypot(RADIUS, RISE) * (angle - 0.3)
        c, s = np.cos(turn), np.sin(turn)
        exact = frenet(angle) @ np.array([[c, -s], [s, c]]) @ start
        assert frame == pytest.approx(
            exact, abs=1e-9
        )  # steps of 1e-12 over 25 rad, read between them by a polynomial of degree 7


@pytest.mark.parametrize("name", CURVES)
def test_frames_are_orthonormal_and_normal_to_the_path(name: str) -> None:
    parameters = np.linspace(-1.4, 1.4, 23)
    frames, tangents = CURVES[name].normals(parameters, 0.2), CURVES[name].tangents(parameters)
    for frame, tangent in zip(frames, tangents, strict=True):
        full = np.column_stack([frame[:, 0], frame[:, 1], tangent])
        assert full.T @ full == pytest.approx(np.eye(3), abs=1e-14)
        assert np.cross(frame[:, 0], tangent) == pytest.approx(frame[:, 1], abs=1e-14)


@pytest.mark.parametrize("name", CURVES)
def test_frames_do_not_turn_about_the_path(name: str) -> None:
    """n1' is along the tangent: its component along n2 vanishes (central differences, error 1e-8 of second order)."""
    step = 1e-4
    for parameter in (-1.1, -0.3, 0.0, 0.6, 1.3):
        before, here, after = CURVES[name].normals(parameter + np.array([-step, 0, step]), 0.1)
        rate = (after - before) / (2 * step)
        assert abs(here[:, 1] @ rate[:, 0]) < 1e-7
        assert abs(here[:, 0] @ rate[:, 1]) < 1e-7


def test_the_frame_of_a_planar_curve_is_its_plane_normal() -> None:
    """The closed form taken for planar curves is what the transport gives, up to the constant first frame."""
    curve = CURVES["ellipse"]
    parameters = np.linspace(-2, 5, 15)
    closed = curve.normals(parameters, 0.5)
    transported = transported_normals(curve._tangent_and_rate, parameters, curve.tangents(parameters), 0.5)
    turns = np.einsum("kia,kib->kab", closed, transported)
    assert turns == pytest.approx(np.broadcast_to(turns[0], turns.shape), abs=1e-11)


@given(directions())
def test_the_first_frame_is_normal_and_its_second_vector_points_down(tangent: np.ndarray) -> None:
    first, second = initial_normals(tangent).T
    assert np.column_stack([first, second, tangent]).T @ np.column_stack([first, second, tangent]) == pytest.approx(
        np.eye(3), abs=1e-14
    )
    if abs(tangent[2]) < 0.9:
        assert second[2] == pytest.approx(np.sqrt(1 - tangent[2] ** 2), abs=1e-14)

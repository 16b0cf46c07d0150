"""Named curves are what their names say: radius, plane, pitch, direction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.errors import GammastarError, InputError, ShapeError, UnknownNameError
from gammastar.path import catalogue as paths
from strategies import directions, numbers, vectors

few = settings(max_examples=20)  # each builds a path
GRID = np.linspace(-8, 8, 41)


def curvature_and_torsion(jets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return curvature and torsion (n,) from jets (n, 6, 3): the Frenet formulas in any parameter."""
    first, second, third = jets[:, 1], jets[:, 2], jets[:, 3]
    binormal = np.cross(first, second)
    size = np.linalg.norm(binormal, axis=1)
    return size / np.linalg.norm(first, axis=1) ** 3, np.sum(binormal * third, axis=1) / size**2


@pytest.mark.parametrize("kind", ["curve", "implicit"])
@few
@given(st.data())
def test_a_circle_has_its_radius_its_plane_and_its_sense(kind: str, data: st.DataObject) -> None:
    """Curvature 1/r, no torsion, tangent = axis x radius vector: right-handed about its normal, at unit angular speed."""
    radius, center, normal = data.draw(numbers(0.1, 20)), data.draw(vectors(10.0)), data.draw(directions())
    jets = paths.circle(radius, center, 3 * normal, kind=kind).jets(GRID[:5])
    outward = jets[:, 0] - center
    assert np.linalg.norm(outward, axis=1) == pytest.approx(np.full(5, radius), rel=1e-12)
    assert outward @ normal == pytest.approx(np.zeros(5), abs=1e-12 * (1 + radius))
    assert jets[:, 1] == pytest.approx(np.cross(normal, outward), abs=1e-11 * (1 + radius))
    bend, twist = curvature_and_torsion(jets)
    assert bend == pytest.approx(np.full(5, 1 / radius), rel=1e-9)
    assert twist == pytest.approx(np.zeros(5), abs=1e-9 / radius)


@few
@given(numbers(-3, 3))
def test_the_angle_of_the_papers_circle_is_atan2(angle: float) -> None:
    for kind in ("curve", "implicit"):
        path = paths.circle(1.0, (0, 0, 10), kind=kind)
        x, y, z = path.points(np.array([angle]))[0]
        assert np.arctan2(y, x) == pytest.approx(angle, abs=1e-12)
        assert z == pytest.approx(10, abs=1e-12)
        assert path.start_parameter(np.array([3.2, 5.0, 0.0])) % (2 * np.pi) == pytest.approx(
            np.arctan2(5, 3.2), abs=1e-12
        )


@few
@given(numbers(0.2, 5), numbers(0.2, 5), directions())
def test_an_ellipse_has_its_semi_axes(a: float, b: float, normal: np.ndarray) -> None:
    path = paths.ellipse((a, b), (1, 2, 3), normal)
    local = (path.points(GRID) - [1, 2, 3]) @ paths.plane_frame(normal)
    assert (local[:, 0] / a) ** 2 + (local[:, 1] / b) ** 2 == pytest.approx(np.ones(41), rel=1e-12)
    assert local[:, 2] == pytest.approx(np.zeros(41), abs=1e-13)
    assert path.points(np.array([0.0, np.pi / 2])) == pytest.approx(
        np.array([1, 2, 3]) + paths.plane_frame(normal)[:, :2].T * [[a], [b]], abs=1e-12
    )


@pytest.mark.parametrize("heading", [0.0, 90.0, -135.0])
def test_a_loop_starts_at_its_lowest_point_forward_and_then_up(heading: float) -> None:
    """Down is positive: the lowest point has the largest third coordinate."""
    path = paths.loop(2.0, (1, 2, -5), heading)
    bottom, quarter, top, three = path.points(np.array([0, np.pi / 2, np.pi, 3 * np.pi / 2]))
    forward = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0])
    assert bottom == pytest.approx([1, 2, -3], abs=1e-14)
    assert quarter == pytest.approx(np.array([1, 2, -5]) + 2 * forward, abs=1e-14)
    assert top == pytest.approx([1, 2, -7], abs=1e-14)
    assert three == pytest.approx(np.array([1, 2, -5]) - 2 * forward, abs=1e-14)
    jets = path.jets(np.array([0.0, np.pi / 2]))
    assert jets[0, 1] == pytest.approx(2 * forward, abs=1e-14)
    assert jets[1, 1] == pytest.approx([0, 0, -2], abs=1e-14)


@few
@given(vectors(10.0), directions(), numbers(-50, 50))
def test_a_line_is_measured_in_metres(point: np.ndarray, along: np.ndarray, distance: float) -> None:
    path = paths.line(point, 7 * along)
    jets = path.jets(np.array([0.0, distance]))
    assert jets[0, 0] == pytest.approx(point, abs=1e-13)
    assert jets[1, 0] == pytest.approx(point + distance * along, abs=1e-12)
    assert jets[:, 1] == pytest.approx(np.array([along, along]), abs=1e-14)
    assert np.all(jets[:, 2:] == 0)


@few
@given(numbers(0.1, 5), numbers(0.05, 5), st.booleans(), directions())
def test_a_helix_has_its_radius_and_its_pitch(radius: float, pitch: float, left: bool, axis: np.ndarray) -> None:
    """One turn rises by the pitch; curvature r/(r^2 + b^2) and torsion b/(r^2 + b^2) with b = pitch / 2 pi."""
    pitch = -pitch if left else pitch
    path = paths.helix(radius, pitch, (1, 2, 3), axis)
    jets = path.jets(GRID[:6])
    later = path.points(GRID[:6] + 2 * np.pi)
    assert later - jets[:, 0] == pytest.approx(np.tile(pitch * axis, (6, 1)), abs=1e-12)
    outward = jets[:, 0] - [1, 2, 3]
    across = outward - np.outer(outward @ axis, axis)
    assert np.linalg.norm(across, axis=1) == pytest.approx(np.full(6, radius), rel=1e-12)
    rise = pitch / (2 * np.pi)
    assert outward @ axis == pytest.approx(rise * GRID[:6], abs=1e-12)
    bend, twist = curvature_and_torsion(jets)
    assert bend == pytest.approx(np.full(6, radius / (radius**2 + rise**2)), rel=1e-9)
    assert twist == pytest.approx(np.full(6, rise / (radius**2 + rise**2)), rel=1e-8)


def test_the_nonplanar_circle_is_the_one_of_the_design() -> None:
    """R = 1.5 m, height 1 + 0.25 sin(2 pi x / 3)."""
    x, y, z = paths.nonplanar_circle().points(GRID).T
    assert np.hypot(x, y) == pytest.approx(np.full(41, 1.5), abs=1e-14)
    assert z == pytest.approx(1 + 0.25 * np.sin(2 * np.pi * x / 3), abs=1e-14)
    assert np.arctan2(y, x) == pytest.approx(np.arctan2(np.sin(GRID), np.cos(GRID)), abs=1e-13)


@given(directions())
def test_the_plane_frame_is_a_rotation_about_its_normal(normal: np.ndarray) -> None:
    frame = paths.plane_frame(2.5 * normal)
    assert frame.T @ frame == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(frame) == pytest.approx(1, abs=1e-14)
    assert frame[:, 2] == pytest.approx(normal, abs=1e-15)


def test_the_plane_frame_of_down_is_the_world() -> None:
    assert np.array_equal(paths.plane_frame((0, 0, 1)), np.eye(3))


BAD = {
    "circle of no radius": (lambda: paths.circle(0.0), InputError, "radius"),
    "circle of negative radius": (lambda: paths.circle(-1.0), InputError, "radius"),
    "circle of NaN": (lambda: paths.circle(np.nan), InputError, "radius"),
    "circle of text": (lambda: paths.circle("wide"), InputError, "radius"),
    "implicit circle of no radius": (lambda: paths.circle(0.0, kind="implicit"), InputError, "radius"),
    "circle without a plane": (lambda: paths.circle(1.0, normal=(0, 0, 0)), InputError, "normal"),
    "circle in two dimensions": (lambda: paths.circle(1.0, (1, 2)), ShapeError, "center"),
    "circle of a third kind": (lambda: paths.circle(kind="explicit"), UnknownNameError, "curve, implicit"),
    "circle with polar coordinates": (
        lambda: paths.circle(kind="implicit", coordinates="polar"),
        UnknownNameError,
        "distance, quadratic",
    ),
    "flat ellipse": (lambda: paths.ellipse((1.0, 0.0)), InputError, "semi-axis"),
    "ellipse of one axis": (lambda: paths.ellipse(1.0), ShapeError, "semi_axes"),
    "loop of no radius": (lambda: paths.loop(0.0), InputError, "radius"),
    "loop towards NaN": (lambda: paths.loop(1.0, heading=np.nan), InputError, "heading"),
    "line without direction": (lambda: paths.line((0, 0, 0), (0, 0, 0)), InputError, "along"),
    "line to infinity": (lambda: paths.line((0, 0, np.inf)), ShapeError, "point"),
    "helix of no radius": (lambda: paths.helix(0.0), InputError, "radius"),
    "helix of no pitch": (lambda: paths.helix(1.0, 0.0), InputError, "pitch"),
    "nonplanar circle of no radius": (lambda: paths.nonplanar_circle(0.0), InputError, "radius"),
    "nonplanar circle of no wavelength": (lambda: paths.nonplanar_circle(wavelength=0.0), InputError, "wavelength"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_shape_without_size_is_refused_by_name(case: str) -> None:
    make, error, reason = BAD[case]
    with pytest.raises(error, match=reason) as caught:
        make()
    assert isinstance(caught.value, GammastarError)


def test_wrong_coordinates_are_refused_for_a_curve_too() -> None:
    """A typing slip must not pass because this kind does not need the argument."""
    with pytest.raises(UnknownNameError, match="coordinates"):
        paths.circle(1.0, coordinates="polar")

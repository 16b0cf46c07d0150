"""The waves, knots and spirals of the catalogue are what their formulas say, and none of them meets itself."""

from __future__ import annotations

import inspect
import math
from itertools import combinations

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gammastar.errors import GammastarError, InputError, PathError, ShapeError, UnknownNameError
from gammastar.path import Curve
from gammastar.path import catalogue as paths
from strategies import numbers

GRID = np.linspace(0, 2 * np.pi, 61)
few = settings(max_examples=25)  # every example builds its graphs anew


def closest_approach(curve: Curve, low: float, high: float, apart: float, count: int = 1200) -> float:
    """Return the smallest distance [m] of two of `count` points whose parameters differ by more than `apart`."""
    grid = np.linspace(low, high, count, endpoint=False)
    points = curve.points(grid)
    gaps = np.abs(grid[:, None] - grid)
    if curve.period is not None:
        gaps = np.minimum(gaps, curve.period - gaps)
    return float(np.linalg.norm(points[:, None] - points, axis=-1)[gaps > apart].min())


@pytest.mark.parametrize("name", paths.__all__)
def test_every_shape_has_defaults_and_says_what_it_is(name: str) -> None:
    factory = getattr(paths, name)
    assert inspect.getdoc(factory)
    if name == "polynomial":
        return
    curve = factory()
    assert np.all(np.isfinite(curve.jets(np.linspace(*curve.domain, 9))))


def test_the_catalogue_is_sorted() -> None:
    assert paths.__all__ == sorted(set(paths.__all__))


@few
@given(numbers(0.1, 5), numbers(0.5, 20), st.booleans())
def test_a_sine_has_its_amplitude_and_its_wavelength(size: float, wavelength: float, down: bool) -> None:
    amplitude = -size if down else size
    x, y, z = paths.sine(amplitude, wavelength).points(wavelength * np.array([0, 0.25, 0.5, 1.75, -2.25])).T
    assert x == pytest.approx(wavelength * np.array([0, 0.25, 0.5, 1.75, -2.25]))
    assert y == pytest.approx(amplitude * np.array([0, 1, 0, -1, -1]), abs=1e-13 * size)
    assert np.all(z == 0)


@few
@given(numbers(0.5, 5), numbers(0.01, 2))
def test_the_branches_of_a_lemniscate_pass_at_their_separation(size: float, separation: float) -> None:
    """(2 A cos a, A sin 2a): the crossing in plan is at a = pi/2 and 3 pi/2, one branch above the other."""
    closed, rising = paths.lemniscate(size, separation), paths.lemniscate(size, separation, kind="rising")
    plan = np.column_stack([2 * size * np.cos(GRID), size * np.sin(2 * GRID)])
    for curve in (closed, rising):
        assert curve.points(GRID)[:, :2] == pytest.approx(plan, abs=1e-13 * size)
    first, second = closed.points(np.array([0.5, 1.5]) * np.pi)
    assert first - second == pytest.approx([0, 0, separation], abs=1e-13 * size)  # down is positive: the first is lower
    heights = -rising.points(np.pi * np.array([0.5, 1.5, 2.5, 3.5]))[:, 2]
    assert np.diff(heights) == pytest.approx(np.full(3, separation), rel=1e-12)


@pytest.mark.parametrize("separation", [0.1, 0.5])
def test_a_lemniscate_comes_no_nearer_to_itself_than_its_separation(separation: float) -> None:
    closed, rising = paths.lemniscate(2.5, separation), paths.lemniscate(2.5, separation, kind="rising")
    assert closest_approach(closed, 0, 2 * np.pi, 0.5) == pytest.approx(separation, rel=0.02)
    assert closest_approach(rising, 0, 4 * np.pi, 0.5) == pytest.approx(separation, rel=0.02)


def test_a_rising_lemniscate_is_the_one_of_path_flyer() -> None:
    """(2 A cos g, A sin 2g, g + 3) with the third axis up."""
    curve = paths.lemniscate(2.5, np.pi, kind="rising")
    expected = np.column_stack([5 * np.cos(GRID), 2.5 * np.sin(2 * GRID), -GRID])
    assert curve.points(GRID) == pytest.approx(expected, abs=1e-14 * 10)


FREQUENCIES = [c for c in np.ndindex(5, 5, 5) if min(c) > 0] + [(2, 3, 5), (3, 4, 5), (5, 2, 3)]


def meets_itself(frequencies: tuple[int, int, int], steps: tuple[int, int, int]) -> bool:
    """Return whether cos(n_i a + p_i) repeats a point, phases in steps of 15 degrees.

    Every double point has parameters that are multiples of pi / (12 n_i n_k), so a grid of that fineness holds them all.
    """
    count = 24 * math.prod(frequencies)
    angles = 2 * np.pi * np.arange(count) / count
    points = np.column_stack([np.cos(n * angles + p * np.pi / 12) for n, p in zip(frequencies, steps, strict=True)])
    rounded = np.unique(np.round(points, 9) + 0.0, axis=0)
    return len(rounded) < count


@given(st.sampled_from(FREQUENCIES), st.tuples(*[st.integers(-12, 12)] * 3))
def test_a_lissajous_curve_is_refused_exactly_when_it_meets_itself(
    frequencies: tuple[int, int, int], steps: tuple[int, int, int]
) -> None:
    try:
        paths.lissajous((1, 1, 1), frequencies, np.multiply(steps, 15.0))
    except PathError:
        assert meets_itself(frequencies, steps)
    else:
        assert not meets_itself(frequencies, steps)


def test_meeting_itself_is_noticed() -> None:
    """Guards the test above: one that does, one that does not, and one that runs back along itself."""
    assert meets_itself((1, 2, 3), (6, 6, 0)) is False
    assert meets_itself((1, 2, 4), (6, 6, 0)) is True
    assert meets_itself((1, 1, 1), (0, 0, 0)) is True


@few
@given(st.tuples(*[numbers(0.1, 5)] * 3), st.tuples(*[numbers(-180, 180)] * 3))
def test_a_lissajous_curve_has_its_coordinates(sizes: tuple, phases: tuple) -> None:
    try:
        curve = paths.lissajous(sizes, (1, 2, 3), phases)
    except PathError:
        assume(False)
    expected = np.column_stack(
        [a * np.cos(n * GRID + np.radians(p)) for a, n, p in zip(sizes, (1, 2, 3), phases, strict=True)]
    )
    assert curve.points(GRID) == pytest.approx(expected, abs=1e-13)


@few
@given(numbers(0.5, 5), numbers(0.01, 0.9))
def test_vivianis_curve_lies_in_vivianis_directions(radius: float, share: float) -> None:
    """On the unit sphere its points satisfy x^2 + y^2 = x; the two passages of that point are d apart."""
    separation = share * radius
    points = paths.viviani(radius, separation).points(GRID)
    lengths = np.linalg.norm(points, axis=1, keepdims=True)
    x, y, _ = (points / lengths).T
    assert x**2 + y**2 == pytest.approx(x, abs=1e-13)
    assert lengths.ravel() == pytest.approx(radius + separation / 2 * np.cos(GRID), rel=1e-13)
    first, second = paths.viviani(radius, separation).points(np.array([0, np.pi]))
    assert first - second == pytest.approx([separation, 0, 0], abs=1e-13 * radius)


@pytest.mark.parametrize("separation", [0.05, 0.4])
def test_vivianis_curve_comes_no_nearer_to_itself_than_its_separation(separation: float) -> None:
    found = closest_approach(paths.viviani(2.0, separation), 0, 2 * np.pi, 0.5)
    assert found == pytest.approx(separation, rel=0.02)


PAIRS = [(p, q) for p in (1, 2, 3, -3, 5) for q in (1, 2, 3, -2, 7) if math.gcd(p, q) == 1]


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_a_torus_knot_winds_p_and_q_times_around_its_torus(p: int, q: int) -> None:
    curve = paths.torus_knot(p, q, radius=2.0, tube=0.5)
    x, y, z = curve.points(np.linspace(0, 2 * np.pi, 4001)).T
    out = np.hypot(x, y) - 2
    assert out**2 + z**2 == pytest.approx(np.full(4001, 0.25), abs=1e-14)
    turns = [np.unwrap(np.arctan2(*pair))[-1] / (2 * np.pi) for pair in ((y, x), (z, out))]
    assert turns == pytest.approx([p, q], abs=1e-9)
    assert closest_approach(curve, 0, 2 * np.pi, 0.3) > 0.05


@few
@given(numbers(0.5, 5), numbers(0.1, 2))
def test_a_trefoil_has_three_equal_lobes_and_a_mirror_image(radius: float, height: float) -> None:
    """In plan y + i x = r/3 (exp(i a) - 2 exp(-2 i a)), which a third of a turn of the parameter multiplies by exp(2 pi i / 3)."""
    left, right = paths.trefoil(radius, height), paths.trefoil(radius, -height)
    x, y, z = left.points(GRID).T
    assert y + 1j * x == pytest.approx(
        radius / 3 * (np.exp(1j * GRID) - 2 * np.exp(-2j * GRID)), abs=1e-14 * radius * 3
    )
    assert z == pytest.approx(-height * np.sin(3 * GRID), abs=1e-14)
    x, y, later = left.points(GRID + 2 * np.pi / 3).T
    assert y + 1j * x == pytest.approx(np.exp(2j * np.pi / 3) * (left.points(GRID) @ [1j, 1, 0]), abs=1e-13 * radius)
    assert later == pytest.approx(z, abs=1e-13)
    assert right.points(GRID) == pytest.approx(left.points(GRID) * [1, 1, -1], abs=1e-13)
    assert np.linalg.norm(left.points(np.array([np.pi / 3]))[0, :2]) == pytest.approx(radius, rel=1e-13)


def test_the_strands_of_the_knots_keep_apart() -> None:
    """Half the parameter of a crossing away; figures of the default shapes, found by this search."""
    assert closest_approach(paths.trefoil(), 0, 2 * np.pi, 0.7) > 1.2
    assert closest_approach(paths.torus_knot(), 0, 2 * np.pi, 0.7) > 0.8
    assert closest_approach(paths.lissajous(), 0, 2 * np.pi, 0.7) > 0.9


@few
@given(numbers(0.1, 5), numbers(0.5, 6), numbers(-2, 2))
def test_a_spiral_grows_by_its_spacing_in_each_turn(spacing: float, turns: float, rise: float) -> None:
    curve = paths.spiral(spacing, turns, rise)
    assert curve.domain == (0.0, turns * 2 * np.pi)
    angles = np.array([0.0, 1.0, 1.0 + 2 * np.pi, 5.0])
    x, y, z = curve.points(angles).T
    assert np.hypot(x, y) == pytest.approx(spacing * angles / (2 * np.pi), abs=1e-13)
    assert -z == pytest.approx(rise * angles / (2 * np.pi), abs=1e-13)
    jet = curve.jets(np.array([0.0]))[0]
    assert jet[1] == pytest.approx([spacing / (2 * np.pi), 0, -rise / (2 * np.pi)], abs=1e-14)


@few
@given(st.lists(st.lists(numbers(-3, 3), min_size=1, max_size=7), min_size=3, max_size=3), numbers(-1.5, 1.5))
def test_a_polynomial_is_the_one_of_its_coefficients(rows: list[list[float]], parameter: float) -> None:
    rows = [[row[0], 1 + abs(row[0]), *row[1:]] for row in rows]
    try:
        curve = paths.polynomial(rows, (-1.5, 1.5))
    except PathError:
        assume(False)
    polynomials = [np.polynomial.Polynomial(row) for row in rows]
    expected = np.array([[p.deriv(k)(parameter) if k else p(parameter) for p in polynomials] for k in range(6)])
    assert curve.jets(np.array([parameter]))[0] == pytest.approx(expected, abs=1e-12 * (1 + np.abs(expected).max()))


def test_the_closed_shapes_close_and_the_open_ones_do_not() -> None:
    closed = {name for name in paths.__all__ if name != "polynomial" and getattr(paths, name)().period is not None}
    assert closed == {*paths.__all__} - {"helix", "line", "polynomial", "sine", "spiral"}
    assert paths.lemniscate(kind="rising").period is None


def test_shapes_are_graphs_of_a_symbol() -> None:
    """Every one of them can stand in a graph: a symbol in, three scalars out."""
    symbol = ca.SX.sym("a")
    for name in set(paths.__all__) - {"polynomial"}:
        point = getattr(paths, name)().point(symbol)
        assert ca.vertcat(*point).shape == (3, 1) if isinstance(point, tuple) else point.shape == (3, 1)


BAD = {
    "flat sine": (lambda: paths.sine(0.0), InputError, "amplitude"),
    "sine of no wavelength": (lambda: paths.sine(1.0, -1.0), InputError, "wavelength"),
    "lemniscate of no size": (lambda: paths.lemniscate(0.0), InputError, "size"),
    "lemniscate that crosses itself": (lambda: paths.lemniscate(separation=0.0), InputError, "separation"),
    "lemniscate that flies": (lambda: paths.lemniscate(kind="flying"), UnknownNameError, "closed, rising"),
    "lissajous in the plane": (lambda: paths.lissajous((1, 1, 0)), InputError, "amplitude"),
    "lissajous of two numbers": (lambda: paths.lissajous((1, 1)), ShapeError, "amplitudes"),
    "lissajous of half a turn": (lambda: paths.lissajous(frequencies=(1, 2.5, 3)), InputError, "frequency"),
    "lissajous of negative frequency": (lambda: paths.lissajous(frequencies=(1, -2, 3)), InputError, "frequency"),
    "lissajous of far too many waves": (lambda: paths.lissajous(frequencies=(1e308, 1, 1)), InputError, "at most 1000"),
    "lissajous with a common factor": (lambda: paths.lissajous(frequencies=(2, 4, 1)), PathError, "x and y"),
    "lissajous in step": (lambda: paths.lissajous(phases=(90, 180, 0)), PathError, "x and y"),
    "lissajous along itself": (lambda: paths.lissajous(frequencies=(1, 1, 1), phases=(0, 180, 0)), PathError, "back"),
    "lissajous at no phase": (lambda: paths.lissajous(phases=(0, np.nan, 0)), ShapeError, "phases"),
    "viviani that crosses itself": (lambda: paths.viviani(separation=0.0), InputError, "separation"),
    "viviani through its centre": (lambda: paths.viviani(1.0, 2.0), InputError, "separation"),
    "viviani of no radius": (lambda: paths.viviani(0.0), InputError, "radius"),
    "flat trefoil": (lambda: paths.trefoil(height=0.0), InputError, "height"),
    "trefoil of no radius": (lambda: paths.trefoil(0.0), InputError, "radius"),
    "knot run through twice": (lambda: paths.torus_knot(2, 4), PathError, "common factor"),
    "knot of no turns": (lambda: paths.torus_knot(0, 1), InputError, "p must"),
    "knot of half turns": (lambda: paths.torus_knot(2, 1.5), InputError, "q must"),
    "knot through its axis": (lambda: paths.torus_knot(tube=2.0), InputError, "tube"),
    "knot of no tube": (lambda: paths.torus_knot(tube=0.0), InputError, "tube"),
    "spiral of no spacing": (lambda: paths.spiral(0.0), InputError, "spacing"),
    "spiral of no turns": (lambda: paths.spiral(turns=0.0), InputError, "turns"),
    "spiral to infinity": (lambda: paths.spiral(rise=np.inf), InputError, "rise"),
    "polynomial of two axes": (lambda: paths.polynomial([[0, 1], [1]]), ShapeError, "three rows"),
    "polynomial of nothing": (lambda: paths.polynomial([[0, 1], [], [1]]), ShapeError, "at least one"),
    "polynomial of text": (lambda: paths.polynomial([[0, 1], ["a"], [1]]), ShapeError, "three rows"),
    "polynomial of a number": (lambda: paths.polynomial(3), ShapeError, "three rows"),
    "polynomial of NaN": (lambda: paths.polynomial([[0, 1], [np.nan], [1]]), InputError, "coefficients of y"),
    "polynomial that stands still": (lambda: paths.polynomial([[0], [1], [2]]), PathError, "regular"),
    "polynomial backwards": (lambda: paths.polynomial([[0, 1], [1], [2]], (1, 0)), PathError, "domain"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_shape_is_refused_by_name(case: str) -> None:
    make, error, reason = BAD[case]
    with pytest.raises(error, match=reason) as caught:
        make()
    assert isinstance(caught.value, GammastarError)
    assert "\n" not in str(caught.value)


@given(st.permutations([2, 3, 5]))
def test_any_two_axes_in_step_are_named(frequencies: list[int]) -> None:
    for i, j in combinations(range(3), 2):
        phases = [17.0, 29.0, 61.0]
        phases[j] = frequencies[j] * phases[i] / frequencies[i]
        with pytest.raises(PathError, match=f"phases of {'xyz'[i]} and {'xyz'[j]}"):
            paths.lissajous((1, 1, 1), frequencies, phases)


def test_whole_turns_of_a_phase_change_nothing() -> None:
    """Not even a huge number of them, beyond which no step between phases can be counted."""
    turned = paths.lissajous(phases=(90.0 + 3600, 90.0 - 720, 0.0)).points(np.linspace(0, 6, 9))
    assert np.allclose(turned, paths.lissajous().points(np.linspace(0, 6, 9)), atol=1e-12)
    assert paths.lissajous(phases=(1e308, 1e308, 1e307)).period is not None

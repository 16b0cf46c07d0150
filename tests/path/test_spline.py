"""Waypoints are joined by the one curve of least snap: through every one of them, C^6, and straight on where it is extended."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gammastar.errors import GammastarError, InputError, PathError, ShapeError, UnknownNameError
from gammastar.path.extension import PIECES, extended
from gammastar.path.interpolation import interpolated
from gammastar.path.placement import Placement
from gammastar.path.spline import DEGREE, SMOOTH, Spline
from strategies import numbers, rotations, vectors

SPACINGS = ["chord", "centripetal"]
few = settings(max_examples=25)


@st.composite
def walks(draw: st.DrawFn, least: int = 2, most: int = 30) -> np.ndarray:
    """Return waypoints (n, 3) of a walk that turns by less than a right angle, with steps from a tenth of a metre to ten."""
    count = draw(st.integers(least, most))
    seed = draw(st.integers(0, 2**32 - 1))
    generator = np.random.default_rng(seed)
    heading = np.cumsum(generator.uniform(-1, 1, count))
    steps = np.exp(generator.uniform(np.log(0.1), np.log(10), count))
    climb = generator.uniform(-0.5, 0.5, count)
    return np.cumsum(steps[:, None] * np.column_stack([np.cos(heading), np.sin(heading), climb]), axis=0)


def ring(count: int, seed: int, spread: float = 4.0) -> np.ndarray:
    """Return waypoints (n, 3) around a closed course with a wave in height, at uneven angles (largest gap over smallest)."""
    generator = np.random.default_rng(seed)
    gaps = np.exp(generator.uniform(0, np.log(spread), count))
    angles = 2 * np.pi * np.cumsum(gaps) / gaps.sum()
    return np.column_stack([10 * np.cos(angles), 6 * np.sin(angles), 2 * np.sin(3 * angles)])


closed_or_open = st.one_of(
    st.tuples(walks(), st.just(False)),
    st.tuples(st.builds(ring, st.integers(3, 40), st.integers(0, 999)), st.just(True)),
)


@few
@given(closed_or_open, st.sampled_from(SPACINGS))
def test_the_curve_goes_through_its_waypoints(course: tuple[np.ndarray, bool], spacing: Any) -> None:
    waypoints, closed = course
    spline = interpolated(waypoints, closed, spacing)
    assert len(spline.coefficients) == len(waypoints) - (not closed)
    found = spline.evaluate(spline.knots, 0)[:, 0]
    expected = np.vstack([waypoints, waypoints[:1]]) if closed else waypoints
    assert found == pytest.approx(expected, abs=1e-13 * (1 + np.abs(waypoints).max()))
    assert spline.period == (spline.knots[-1] if closed else None)


@few
@given(closed_or_open, st.sampled_from(SPACINGS))
def test_six_derivatives_are_continuous(course: tuple[np.ndarray, bool], spacing: Any) -> None:
    waypoints, closed = course
    assert interpolated(waypoints, closed, spacing).jumps().max() < 1e-9


@few
@given(walks(least=5))
def test_open_ends_are_natural(waypoints: np.ndarray) -> None:
    """The derivatives 4, 5, 6 vanish at both ends, to the size of what they are made of in the end segments."""
    spline = interpolated(waypoints)
    ends = spline.evaluate(spline.knots[[0, -1]], SMOOTH)[:, 4:]
    inside = np.abs(spline.coefficients[:, :, 4:]).max(axis=(0, 1))
    reach = spline.lengths.max()
    sizes = [sum(5040 * inside[j] * reach ** (j + 4 - k) for j in range(4)) for k in (4, 5, 6)]
    assert np.abs(ends).max(axis=(0, 2)) == pytest.approx(np.zeros(3), abs=1e-12 * (1e-9 + max(sizes)))


def wiggle(spline: Spline, seed: int) -> np.ndarray:
    """Return coefficients (m, 3, 8) of a C^3 curve that vanishes at all knots, with random derivatives 1, 2, 3 there."""
    generator = np.random.default_rng(seed)
    knots = len(spline.knots) - (1 if spline.closed else 0)
    slopes = generator.normal(size=(knots, 3, 3))
    slopes = np.concatenate([slopes, slopes[:1]]) if spline.closed else slopes
    coefficients = np.zeros_like(spline.coefficients)
    for k, length in enumerate(spline.lengths):
        rows = np.zeros((8, 8))
        for order in range(4):
            for j in range(order, 8):
                factor = np.prod(np.arange(j - order + 1, j + 1.0))
                rows[order, j] = factor if j == order else 0
                rows[4 + order, j] = factor
        scale = length ** np.arange(1, 4)[:, None]
        data = np.vstack([np.zeros((1, 3)), slopes[k] * scale, np.zeros((1, 3)), slopes[k + 1] * scale])
        coefficients[k] = np.linalg.solve(rows, data).T / length ** np.arange(8)
    return coefficients


def snap_product(first: Spline, second: np.ndarray) -> float:
    """Return the integral of the inner product of two fourth derivatives, by Gauss nodes that are exact for it."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    total = 0.0
    for a, b, length in zip(first.coefficients, second, first.lengths, strict=True):
        at = (nodes + 1) / 2 * length
        values = [
            sum(np.outer(at ** (j - 4), c[:, j]) * np.prod(np.arange(j - 3, j + 1.0)) for j in range(4, 8))
            for c in (a, b)
        ]
        total += float(weights @ np.sum(values[0] * values[1], axis=1)) * length / 2
    return total


@few
@given(closed_or_open, st.integers(0, 999))
def test_no_curve_through_the_waypoints_has_less_snap(course: tuple[np.ndarray, bool], seed: int) -> None:
    """The snap is orthogonal to that of every C^3 curve w that vanishes at the waypoints: |s + w|^2 = |s|^2 + |w|^2."""
    waypoints, closed = course
    spline = interpolated(waypoints, closed)
    bump = wiggle(spline, seed)
    own, other = snap_product(spline, spline.coefficients), snap_product(Spline(spline.knots, bump, closed), bump)
    assert abs(snap_product(spline, bump)) <= 1e-9 * np.sqrt(own * other) + 1e-12
    factor = np.sqrt(own / other)
    more = Spline(spline.knots, spline.coefficients + 0.1 * factor * bump, closed)
    assert snap_product(more, more.coefficients) == pytest.approx(1.01 * own, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize(("closed", "count"), [(False, 9), (False, 40), (True, 9), (True, 40)])
def test_the_curve_is_the_one_of_an_independent_library(closed: bool, count: int) -> None:
    """`scipy.interpolate.make_interp_spline` of degree 7 solves for B-spline coefficients instead."""
    from scipy.interpolate import make_interp_spline

    waypoints = ring(count, 5, spread=3.0)
    spline = interpolated(waypoints, closed)
    ends = [(k, np.zeros(3)) for k in (4, 5, 6)]
    points = np.vstack([waypoints, waypoints[:1]]) if closed else waypoints
    other = make_interp_spline(spline.knots, points, k=7, bc_type="periodic" if closed else (ends, ends))
    grid = np.linspace(spline.knots[0], spline.knots[-1], 301)[:-1]
    found = spline.evaluate(grid, 4)
    for k, tolerance in enumerate([1e-10, 1e-10, 1e-9, 1e-8, 1e-7]):
        assert found[:, k] == pytest.approx(other(grid, nu=k), abs=tolerance * 10)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [100, 300])
@pytest.mark.parametrize("spread", [1.0, 10.0, 1000.0])
def test_many_and_uneven_waypoints_lose_no_digits(closed: bool, count: int, spread: float) -> None:
    spline = interpolated(ring(count, 3, spread), closed)
    assert spline.jumps().max() < 1e-9
    assert spline.slowest()[1] > 0.9


def test_the_error_on_a_circle_falls_with_the_eighth_power_of_the_spacing() -> None:
    """A spline of degree 7 has order 8; on even points of a circle the polygon is a uniform parameter."""
    errors = []
    for count in (12, 24, 48):
        angles = 2 * np.pi * np.arange(count) / count
        spline = interpolated(np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]), closed=True)
        points = spline.evaluate(np.linspace(0, spline.knots[-1], 1000), 0)[:, 0]
        errors.append(np.abs(np.linalg.norm(points, axis=1) - 1).max())
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert slopes == pytest.approx([8, 8], abs=0.3)


@given(vectors(10.0), vectors(10.0))
def test_two_waypoints_make_a_straight_line(first: np.ndarray, second: np.ndarray) -> None:
    length = np.linalg.norm(second - first)
    assume(length > 1e-3)
    spline = interpolated([first, second])
    jets = spline.evaluate(length * np.array([0, 0.25, 1.0, 1.5]), 6)
    assert jets[:, 0] == pytest.approx(first + np.outer([0, 0.25, 1, 1.5], second - first), abs=1e-13)
    assert jets[:, 1] == pytest.approx(np.tile((second - first) / length, (4, 1)), abs=1e-13)
    assert np.all(jets[:, 2:] == 0)


@few
@given(walks(least=3, most=4))
def test_three_waypoints_make_a_parabola_and_four_a_cubic(waypoints: np.ndarray) -> None:
    """The polynomial of least degree, the same in all segments."""
    spline = interpolated(waypoints)
    degree = len(waypoints) - 1
    assert np.all(spline.coefficients[:, :, degree + 1 :] == 0)
    grid = np.linspace(spline.knots[0], spline.knots[-1], 7)
    expected = np.column_stack([np.polyfit(spline.knots, row, degree) for row in waypoints.T])
    for axis in range(3):
        values = np.polyval(expected[:, axis], grid)
        assert spline.evaluate(grid, 0)[:, 0, axis] == pytest.approx(values, abs=1e-8 * (1 + np.abs(waypoints).max()))


@few
@given(vectors(1.0), st.lists(numbers(0.05, 5.0), min_size=2, max_size=20), vectors(10.0))
def test_waypoints_in_a_line_make_a_straight_line(along: np.ndarray, steps: list[float], start: np.ndarray) -> None:
    assume(np.linalg.norm(along) > 0.1)
    along = along / np.linalg.norm(along)
    distances = np.concatenate([[0], np.cumsum(steps)])
    spline = interpolated(start + np.outer(distances, along))
    jets = spline.evaluate(np.linspace(0, distances[-1], 50), 1)
    assert np.cross(jets[:, 0] - start, along) == pytest.approx(np.zeros((50, 3)), abs=1e-11)
    assert jets[:, 1] == pytest.approx(np.tile(along, (50, 1)), abs=1e-10)
    assert spline.jumps().max() < 1e-9


@few
@given(closed_or_open, st.builds(Placement, vectors(10.0), rotations(), numbers(0.1, 10)), st.sampled_from(SPACINGS))
def test_placing_the_waypoints_places_the_curve(
    course: tuple[np.ndarray, bool], place: Placement, spacing: Any
) -> None:
    """Equal up to rounding, with a parameter that is scaled like a length."""
    waypoints, closed = course
    here, there = interpolated(waypoints, closed, spacing), interpolated(place.points(waypoints), closed, spacing)
    assert there.knots == pytest.approx(place.scale * here.knots, rel=1e-12)
    grid = np.linspace(here.knots[0], here.knots[-1], 50)
    size = place.scale * (1 + np.abs(here.evaluate(grid, 0)).max()) + np.abs(place.position).max()
    expected = place.points(here.evaluate(grid, 0)[:, 0])
    assert there.evaluate(place.scale * grid, 0)[:, 0] == pytest.approx(expected, abs=1e-9 * size)


@few
@given(walks())
def test_the_way_back_is_the_same_curve(waypoints: np.ndarray) -> None:
    there, back = interpolated(waypoints), interpolated(waypoints[::-1])
    grid = np.linspace(0, there.knots[-1], 40)
    points = there.evaluate(grid, 0)[:, 0]
    assert back.evaluate(there.knots[-1] - grid, 0)[:, 0] == pytest.approx(
        points, abs=1e-9 * (1 + np.abs(points).max())
    )


@few
@given(st.integers(3, 20), st.integers(0, 99), st.integers(1, 19))
def test_a_closed_curve_does_not_know_where_it_begins(count: int, seed: int, shift: int) -> None:
    waypoints = ring(count, seed)
    shift %= count
    here, there = interpolated(waypoints, closed=True), interpolated(np.roll(waypoints, -shift, axis=0), closed=True)
    grid = np.linspace(0, here.period, 40)
    assert there.evaluate(grid - here.knots[shift], 3) == pytest.approx(here.evaluate(grid, 3), abs=1e-9)


def test_a_chord_is_one_metre_of_the_parameter() -> None:
    """'chord' counts the polygon in metres; 'centripetal' its roots, with the same sum."""
    waypoints = [(0, 0, 0), (1, 0, 0), (5, 0, 0), (5, 9, 0)]
    assert interpolated(waypoints).knots == pytest.approx([0, 1, 5, 14])
    assert interpolated(waypoints, spacing="centripetal").knots == pytest.approx(14 * np.array([0, 1, 3, 6]) / 6)


def test_centripetal_spacing_swings_out_less_where_distances_differ_much() -> None:
    """A closed zigzag whose last leg is forty times the others: the chord one leaves the polygon by more than that leg."""
    generator = np.random.default_rng(5)
    waypoints = np.column_stack([np.arange(40), generator.uniform(-1, 1, 40), np.zeros(40)])
    reach = [
        np.abs(s.evaluate(np.linspace(0, s.period, 4000), 0)[:, 0, 1]).max()
        for s in (interpolated(waypoints, True, spacing) for spacing in SPACINGS)
    ]
    assert reach[0] > 10 * reach[1]


@few
@given(closed_or_open, numbers(-1.5, 2.5), st.integers(0, 6))
def test_evaluation_is_the_polynomial_of_its_segment(course: tuple, share: float, order: int) -> None:
    waypoints, closed = course
    spline = interpolated(waypoints, closed)
    parameter = share * spline.knots[-1]
    found = spline.evaluate([parameter], order)
    assert found.shape == (1, order + 1, 3)
    (segment,), (offset,) = spline.segments(parameter)
    assert 0 <= segment < len(spline.lengths)
    wrapped = parameter % spline.period if closed else parameter
    assert spline.knots[segment] + offset == pytest.approx(wrapped, abs=1e-12 * spline.knots[-1])
    if closed or 0 <= share < 1:
        assert -1e-12 <= offset <= spline.lengths[segment] * (1 + 1e-12)
    for axis in range(3):
        polynomial = np.polynomial.Polynomial(spline.coefficients[segment, axis])
        expected = [polynomial.deriv(k)(offset) if k else polynomial(offset) for k in range(order + 1)]
        assert found[0, :, axis] == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1 + np.abs(expected).max()))


@few
@given(closed_or_open)
def test_the_slowest_place_is_at_most_as_fast_as_every_sample(course: tuple) -> None:
    spline = interpolated(*course)
    parameter, speed = spline.slowest()
    grid = np.linspace(0, spline.knots[-1], 3000)
    speeds = np.linalg.norm(spline.evaluate(grid, 1)[:, 1], axis=1)
    assert speed <= speeds.min() * (1 + 1e-9)
    assert speed == pytest.approx(np.linalg.norm(spline.evaluate([parameter], 1)[0, 1]), abs=1e-9)


def test_a_jump_is_found_and_measured() -> None:
    """Two straight pieces with a bend of a right angle, and a gap of two metres on three."""
    pieces = np.zeros((2, 3, DEGREE + 1))
    pieces[0, 0, 1] = pieces[1, 1, 1] = 1
    pieces[1, 0, 0] = 1
    assert Spline([0, 1, 2], pieces).jumps() == pytest.approx([0, 1, 0, 0, 0, 0, 0])
    pieces[1, 0, 0] = 3
    assert Spline([0, 1, 2], pieces).jumps()[:2] == pytest.approx([2 / 3, 1])


extensions = st.tuples(st.sampled_from([0.0, 0.5, 20.0]), numbers(0.1, 20.0), st.sampled_from([None, 0.3, 0.9]))


@few
@given(walks(), extensions)
def test_an_extended_curve_is_smooth_and_unchanged_inside(waypoints: np.ndarray, extension: tuple) -> None:
    before, after, share = extension
    spline = interpolated(waypoints)
    blend = None if share is None else share * min(x for x in (before, after) if x > 0)
    try:
        longer = extended(spline, before, after, blend)
    except PathError:
        return
    assert longer.knots[[0, -1]] == pytest.approx([-before, spline.knots[-1] + after], abs=1e-12 * spline.knots[-1])
    first = (PIECES + 1) * (before > 0)
    assert np.array_equal(longer.coefficients[first : first + len(spline.coefficients)], spline.coefficients)
    assert np.array_equal(longer.knots[first : first + len(spline.knots)], spline.knots)
    assert longer.jumps().max() < 1e-9
    assert np.all(longer.coefficients[-1, :, 2:] == 0)
    if before > 0:
        assert np.abs(longer.coefficients[0, :, 2:]).max() < 1e-12


@few
@given(walks(least=3))
def test_the_extension_of_the_way_back_is_the_same(waypoints: np.ndarray) -> None:
    spline, back = interpolated(waypoints), interpolated(waypoints[::-1])
    try:
        ahead, behind = extended(spline, before=5.0), extended(back, after=5.0)
    except PathError:
        return
    grid = np.linspace(-5, 0, 20)
    points = ahead.evaluate(grid, 0)[:, 0]
    assert behind.evaluate(spline.knots[-1] - grid, 0)[:, 0] == pytest.approx(
        points, abs=1e-8 * (1 + np.abs(points).max())
    )


@few
@given(walks(least=3, most=3), numbers(0.2, 3.0))
def test_a_bend_fades_out_without_bending_back(waypoints: np.ndarray, blend: float) -> None:
    """The second derivative of a parabola falls to zero and never rises; the direction turns by half of it over the fade."""
    spline = interpolated(waypoints)
    try:
        longer = extended(spline, after=4.0, blend=blend)
    except PathError:
        return
    jets = longer.evaluate(spline.knots[-1] + np.linspace(0, 4, 201), 2)
    bend = jets[0, 2]
    share = jets[:, 2] @ bend / (bend @ bend)
    assert jets[:, 2] == pytest.approx(np.outer(share, bend), abs=1e-9 * np.linalg.norm(bend))
    assert np.diff(share).max() < 1e-9
    assert (share[0], share[-1]) == pytest.approx((1, 0), abs=1e-9)
    assert jets[-1, 1] == pytest.approx(jets[0, 1] + 0.5 * blend * bend, abs=1e-9 * (1 + blend * np.linalg.norm(bend)))


def test_a_straight_line_runs_straight_on() -> None:
    longer = extended(interpolated([(0, 0, 0), (2, 0, 0)]), 3.0, 4.0)
    grid = np.linspace(-5, 9, 30)
    assert longer.evaluate(grid, 6)[:, :2] == pytest.approx(
        np.stack([np.outer(grid, [1, 0, 0]), np.tile([1, 0, 0], (30, 1))], axis=1), abs=1e-12
    )
    assert longer.knots[0] == -3
    assert longer.knots[-1] == 6


def test_no_extension_is_no_change() -> None:
    spline = interpolated(ring(8, 1))
    assert np.array_equal(extended(spline).coefficients, spline.coefficients)


RING = ring(6, 0)
LINE = interpolated([(0, 0, 0), (1, 0, 0)])
BAD = {
    "one waypoint": (lambda: interpolated([(1, 2, 3)]), ShapeError, r"at least 2 .*\(1, 3\)"),
    "no waypoint": (lambda: interpolated([]), ShapeError, "at least 2"),
    "a closed path of two": (lambda: interpolated(RING[:2], closed=True), ShapeError, "at least 3 .* closed"),
    "waypoints in the plane": (lambda: interpolated([(0, 0), (1, 1)]), ShapeError, r"\(2, 2\)"),
    "a number": (lambda: interpolated(3.0), ShapeError, "rows of three"),
    "text": (lambda: interpolated([("a", "b", "c"), (1, 2, 3)]), ShapeError, "rows of three"),
    "ragged rows": (lambda: interpolated([(1, 2, 3), (1, 2)]), ShapeError, "rows of three"),
    "NaN": (lambda: interpolated([*RING[:3], (0, np.nan, 0)]), InputError, r"waypoints\[3\] .*nan"),
    "infinity": (lambda: interpolated([(np.inf, 0, 0), *RING]), InputError, r"waypoints\[0\] .*inf"),
    "a galaxy": (lambda: interpolated([(0, 0, 0), (1e200, 0, 0)]), InputError, r"waypoints\[1\]"),
    "equal neighbours": (
        lambda: interpolated([*RING[:4], RING[3], RING[4]]),
        PathError,
        r"waypoints\[3\] and waypoints\[4\]",
    ),
    "almost equal neighbours": (
        lambda: interpolated([*RING, RING[5] + 1e-12]),
        PathError,
        r"waypoints\[5\] and waypoints\[6\]",
    ),
    "all equal": (lambda: interpolated([(1, 1, 1)] * 4), PathError, r"waypoints\[0\] and waypoints\[1\]"),
    "a closed path with its first repeated": (
        lambda: interpolated([*RING, RING[0]], closed=True),
        PathError,
        r"waypoints\[6\] and waypoints\[0\].*leave out the last",
    ),
    "there and back": (
        lambda: interpolated([(0, 0, 0), (2, 0, 0), (1, 0, 0)]),
        PathError,
        r"stand still .*waypoints\[0\] and waypoints\[1\]",
    ),
    "a closed line": (lambda: interpolated([(0, 0, 0), (1, 0, 0), (2, 0, 0)], closed=True), PathError, "stand still"),
    "steps from a fraction of a micrometre to metres": (
        lambda: interpolated(ring(50, 3, 3e7), True),
        PathError,
        "evenly enough",
    ),
    "an unknown spacing": (lambda: interpolated(RING, spacing="even"), UnknownNameError, "centripetal, chord"),
    "a closed extension": (lambda: extended(interpolated(RING, closed=True), 1.0), InputError, "open"),
    "a negative extension": (lambda: extended(LINE, -1.0), InputError, "before"),
    "an extension of NaN": (lambda: extended(LINE, after=np.nan), InputError, "after"),
    "a blend beyond the extension": (lambda: extended(LINE, after=1.0, blend=2.0), InputError, "blend"),
    "a blend of nothing": (lambda: extended(LINE, after=1.0, blend=0.0), InputError, "blend"),
    "knots that do not fit": (lambda: Spline([0, 1, 2], np.zeros((1, 3, 8))), ShapeError, "segment"),
    "coefficients of degree 5": (lambda: Spline([0, 1], np.zeros((1, 3, 6))), ShapeError, "segment"),
    "knots backwards": (lambda: Spline([1, 0], np.zeros((1, 3, 8))), InputError, "increasing"),
    "a coefficient of NaN": (lambda: Spline([0, 1], np.full((1, 3, 8), np.nan)), InputError, "finite"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_course_is_refused_in_one_sentence(case: str) -> None:
    make, error, reason = BAD[case]
    with pytest.raises(error, match=reason) as caught:
        make()
    assert isinstance(caught.value, GammastarError)
    assert "\n" not in str(caught.value)


def test_a_spline_does_not_change() -> None:
    """Its arrays are copies and read-only: a law that was given them keeps flying what it was given."""
    knots, pieces = np.array([0.0, 1.0]), np.ones((1, 3, 8))
    spline = Spline(knots, pieces)
    pieces[:] = 2
    assert np.all(spline.coefficients == 1)
    with pytest.raises(ValueError, match="read-only"):
        spline.knots[0] = 3

"""Closest approach of a curve to itself: closed forms, brute force, contact of every kind, and turned anyhow in space."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from certificate.curves import (
    TURN,
    Harmonics,
    closed,
    figure_eight,
    lissajous,
    opened,
    pinched,
    placed,
    trefoil,
    uneven,
    wandering,
)
from gammastar import so3
from gammastar.certificate import embedding, pairs
from gammastar.certificate.embedding import MOST_CELLS, Approach, closest_approach, newton_step
from gammastar.certificate.motion import curvature
from gammastar.certificate.pairs import cells
from gammastar.certificate.search import extremes
from gammastar.path import Path
from gammastar.path import catalogue as paths
from gammastar.path.sampling import sample
from gammastar.path.waypoints import waypoints


def approach(path: Path) -> Approach | None:
    samples = sample(path)
    return closest_approach(samples, extremes(samples, {"curvature": (curvature, 1)})["curvature"].value)


@pytest.mark.parametrize("path", [paths.circle(2.0), paths.circle(2.0, (1, 2, 3), (1, 1, 1), kind="implicit")])
def test_a_circle_is_its_diameter_away(path: Path) -> None:
    found = approach(path)
    assert found.kind == "apart"
    assert found.distance == pytest.approx(4, rel=1e-14)
    assert found.second - found.first == pytest.approx(np.pi, abs=1e-6)


@pytest.mark.parametrize("axes", [(2.0, 1.0), (1.0, 3.0), (1000.0, 1.0)])
def test_an_ellipse_is_its_small_axis_away(axes: tuple[float, float]) -> None:
    found = approach(paths.ellipse(axes))
    assert found.distance == pytest.approx(2 * min(axes), rel=1e-13)
    quarter = 0.0 if axes[0] < axes[1] else np.pi / 2
    assert (found.first, found.second) == pytest.approx((quarter, quarter + np.pi), abs=1e-9)


@pytest.mark.parametrize(("radius", "pitch"), [(1.0, 1.0), (2.0, 0.5), (1.0, 2.0)])
def test_a_helix_is_one_turn_away(radius: float, pitch: float) -> None:
    """d^2(a) = 2 r^2 (1 - cos a) + (p a / 2 pi)^2 has its minimum where r^2 sin a + (p / 2 pi)^2 a = 0, a between pi and 2 pi."""
    rise = pitch / TURN
    angle = brentq(lambda a: radius**2 * np.sin(a) + rise**2 * a, 4.7, TURN, xtol=1e-14)
    distance = np.sqrt(2 * radius**2 * (1 - np.cos(angle)) + (rise * angle) ** 2)
    found = approach(paths.helix(radius, pitch))
    assert found.distance == pytest.approx(distance, rel=1e-12)
    assert found.second - found.first == pytest.approx(angle, abs=1e-6)


@pytest.mark.parametrize("path", [paths.line(), paths.helix(1.0, 4.0), opened(lambda t: (t, t**2, 0), -5, 5)])
def test_what_never_doubles_back_has_no_approach(path: Path) -> None:
    assert approach(path) is None


def least_of_all_pairs(path: Path, count: int) -> float:
    """Return the least local minimum of the distance over a grid of pairs, neighbours left out; infinite without one."""
    points = path.jets(np.linspace(0, TURN, count, endpoint=False))[:, 0]
    distance = cdist(points, points)
    least = np.ones(distance.shape, dtype=bool)
    for shift in ((1, 0), (0, 1), (1, 1), (1, -1)):
        least &= (distance < np.roll(distance, shift, (0, 1))) & (
            distance < np.roll(distance, np.negative(shift), (0, 1))
        )
    rows, columns = np.nonzero(least)
    gap = np.abs(rows - columns)
    return float(distance[rows, columns][np.minimum(gap, count - gap) > 3].min(initial=np.inf))


@pytest.mark.parametrize("formula", [trefoil, lissajous])
def test_knots_agree_with_all_pairs(formula) -> None:
    """A pair of the grid misses a place by half a step h at most, and the distance d by h^2 / (2 d)."""
    path = closed(formula)
    found, step = approach(path).distance, sample(path).speeds.max() * TURN / 3000
    assert found == pytest.approx(least_of_all_pairs(path, 3000), abs=step**2 / (2 * found))


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("count", [3, 8, 20])
@pytest.mark.parametrize("seed", range(3))
def test_random_curves_come_no_closer_than_found(seed: int, count: int, planar: bool) -> None:
    """No local minimum over all pairs is below the distance found; in a plane one on the grid's scale is a crossing."""
    path = Harmonics(count, seed, planar)
    found, least = approach(path), least_of_all_pairs(path, 1500)
    assert (found.distance if found else np.inf) <= least + 1e-12
    if planar and least < 1e-3:
        assert found.kind == "crosses itself"


def test_fingers_beside_each_other_are_measured() -> None:
    """Forty fingers have hundreds of pairs that are almost perpendicular; the closest true one is between two tips."""

    def star(t):
        radius = 1 + 0.3 * ca.cos(40 * t)
        return radius * ca.cos(t), radius * ca.sin(t), 0 * t

    path = closed(star)
    found = approach(path)
    first, second = path.jets(np.array([found.first, found.second]))[:, :2]
    assert np.abs((first[0] - second[0]) @ np.array([first[1], second[1]]).T).max() < 1e-9
    assert found.distance <= least_of_all_pairs(path, 3000) + 1e-12


@pytest.mark.parametrize(
    "path",
    [
        opened(lambda t: (t - 0.999 * ca.sin(t), 1 - 0.999 * ca.cos(t), 0), -20, 20),  # almost a cusp at every turn
        opened(lambda t: (t - 0.99999 * ca.sin(t), 1 - 0.99999 * ca.cos(t), 0), -20, 20),
        opened(lambda t: (t, 1e4 * t**2, 0), -1, 1),  # a hairpin
        opened(lambda t: (t**2, t**3 + 1e-3 * t, 0), -1, 1),
    ],
)
def test_a_sharp_turn_is_no_contact(path: Path) -> None:
    assert approach(path) is None


def test_a_sharp_turn_at_the_seam_is_no_contact() -> None:
    """A limacon that is almost a cardioid, its sharp turn at parameter zero."""
    found = approach(
        closed(lambda t: (2 * ca.cos(t) - 0.999 * ca.cos(2 * t), 2 * ca.sin(t) - 0.999 * ca.sin(2 * t), 0))
    )
    assert (found.kind, found.distance) == ("apart", pytest.approx(4, rel=1e-9))


def test_a_small_loop_is_a_crossing() -> None:
    """The trochoid with 1.001 instead has loops of 1e-4 m, one at each turn."""
    found = approach(opened(lambda t: (t - 1.001 * ca.sin(t), 1 - 1.001 * ca.cos(t), 0), -20, 20))
    assert found.kind == "crosses itself"
    assert abs(found.second - found.first) < 0.2


def test_along_a_valley_newton_stays() -> None:
    """All diameters of a circle are equally long: from a chord next to one, the steps share what is missing."""
    jets = paths.circle().jets(np.array([0.3, 0.3 + np.pi + 0.01]))[None]
    assert newton_step(jets, np.ones((1, 2), dtype=bool), np.inf)[0] == pytest.approx([0.005, -0.005], rel=1e-4)


def test_a_crossing_is_found_with_both_places() -> None:
    found = approach(closed(figure_eight))
    assert found.kind == "crosses itself"
    assert found.distance < 1e-14
    assert (found.first, found.second) == pytest.approx((0, np.pi), abs=1e-12)


def test_a_crossing_lifted_apart_is_no_crossing() -> None:
    """(2 sin t, sin 2t, h cos t): the strands pass each other 2 h apart."""
    found = approach(closed(lambda t: (2 * ca.sin(t), ca.sin(2 * t), 0.01 * ca.cos(t))))
    assert found.kind == "apart"
    assert found.distance == pytest.approx(0.02, rel=1e-12)


def test_touching_is_found_with_both_places() -> None:
    found = approach(closed(pinched))
    assert found.kind == "touches itself"
    assert found.distance < 1e-8
    assert (found.first, found.second) == pytest.approx((np.pi / 2, 3 * np.pi / 2), abs=1e-3)


def test_touching_in_space_is_found() -> None:
    """Two parts of a bent loop that touch at one point with parallel tangents, out of any plane."""
    found = approach(closed(lambda t: (*pinched(t)[:2], 0.4 * ca.cos(t) ** 2 + 0.1 * ca.cos(t) ** 3)))
    assert found.kind == "touches itself"


@pytest.mark.parametrize("period", [2 * TURN, 3 * TURN])
def test_a_path_that_covers_itself_is_found(period: float) -> None:
    found = approach(closed(lambda t: (ca.cos(t), ca.sin(t), 0), period))
    assert found.kind == "runs over itself"
    assert (found.second - found.first) % TURN == pytest.approx(0, abs=1e-6)


def test_an_open_path_that_overruns_its_start_is_found() -> None:
    assert approach(opened(lambda t: (ca.cos(t), ca.sin(t), 0), 0, 6.6)).kind == "runs over itself"


def test_an_open_path_that_ends_where_it_starts_is_told_apart() -> None:
    found = approach(opened(lambda t: (ca.cos(t), ca.sin(t), 0), 0, TURN))
    assert found.kind == "meets itself at its ends"
    assert (found.first, found.second) == (0, TURN)


def test_an_end_near_the_middle_of_the_path_counts() -> None:
    """A hook whose end comes 0.1 m above its straight part."""
    path = opened(lambda t: (ca.sin(t), 1 - ca.cos(t) + 0 * t, 0), 0, TURN - np.arccos(0.9))
    found = approach(path)
    assert found.distance == pytest.approx(np.hypot(np.sin(np.arccos(0.9)), 0.1), rel=1e-12)
    assert found.second == path.domain[1]


def test_a_long_path_is_searched_where_it_comes_close() -> None:
    """More cells than all pairs are formed of: the closest approach agrees with dense samples in a tree."""
    path = wandering(600, seed=4)
    found = approach(path)
    assert len(cells(sample(path))) > MOST_CELLS
    parameters = np.linspace(0, path.period, 200_001)[:-1]
    points = path.jets(parameters)[:, 0]
    spacing = np.linalg.norm(np.diff(points, axis=0), axis=1).max()
    near = cKDTree(points).query_pairs(found.distance + spacing, output_type="ndarray")
    gap = np.abs(parameters[near[:, 1]] - parameters[near[:, 0]])
    near = near[np.minimum(gap, path.period - gap) > 1.5]
    least = np.linalg.norm(points[near[:, 0]] - points[near[:, 1]], axis=1).min()
    assert found.distance <= least <= found.distance + spacing


def crowded(count: int) -> Path:
    """Return a path through random points of a box 100 m wide."""
    return waypoints(np.random.default_rng(0).uniform(-50, 50, (count, 3)))


def test_near_pairs_are_all_pairs_of_cells_that_come_near() -> None:
    """Cells of unequal length: whatever comes nearer than 0.5 m, looked for between dense points of every cell."""
    samples = sample(crowded(20))
    points = samples.jets[cells(samples, 200), 0]
    shares = np.linspace(0, 1, 30)[:, None, None]
    dense = points[:-1] + shares * (points[1:] - points[:-1])
    found = {frozenset(pair) for block in pairs.near_pairs(points, 0.5) for pair in block.tolist()}
    for k in range(len(points) - 1):
        distances = np.linalg.norm(dense[:, k, None, None] - dense, axis=3).min(axis=(0, 1))
        assert all({k, other} in found for other in np.flatnonzero(distances < 0.5) if other != k)


def test_pairs_of_a_crowded_path_are_looked_at_block_by_block(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fifty million pairs of cells, of which only some are ever held at once; the answer is the one of all together."""
    sizes, judged = [], embedding._judged

    def watched(samples, nodes, chosen, free):
        sizes.append(len(chosen))
        return judged(samples, nodes, chosen, free)

    monkeypatch.setattr(embedding, "_judged", watched)
    path = crowded(600)
    found, samples = approach(path), sample(path)
    assert found.distance == pytest.approx(8.46130e-4, abs=1e-8)
    assert sum(sizes) > 2 * pairs.MOST_PAIRS
    points = samples.jets[cells(samples), 0]
    sizes += [len(block) for block in pairs.near_pairs(points, 10.0)]
    assert max(sizes) <= pairs.MOST_PAIRS


def test_a_crossing_beside_many_near_strands_is_found() -> None:
    """A flat coil of 12 turns, 0.05 m apart, crossed by its own way out."""

    def coil(t):
        radius = 1 + 0.05 / TURN * t
        back = ca.fmax(t - 12 * TURN, 0) ** 6 * 1e-3  # class C^5
        return (radius - back) * ca.cos(t), (radius - back) * ca.sin(t), 0 * t

    found = approach(opened(coil, 0, 12 * TURN + 3.5))
    assert found.kind == "crosses itself"


@pytest.mark.parametrize("seed", range(3))
def test_place_and_turn_in_space_change_nothing(seed: int) -> None:
    generator = np.random.default_rng(seed)
    rotation, shift = so3.exp(generator.normal(size=3)), generator.normal(size=3) * 10
    for formula in (trefoil, lissajous, figure_eight, pinched):
        still, moved = approach(closed(formula)), approach(closed(placed(formula, rotation, shift)))
        assert moved.kind == still.kind
        assert moved.distance == pytest.approx(still.distance, abs=1e-7 if still.contact else 1e-12)


def test_the_parameterisation_changes_nothing() -> None:
    still, moved = approach(closed(trefoil)), approach(closed(lambda t: trefoil(uneven(t))))
    assert moved.distance == pytest.approx(still.distance, rel=1e-12)

"""Samples of a campaign: flight k alone is flight k among others; distributions are what they say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from gammastar import so3
from gammastar.campaign.sample import sampled
from gammastar.errors import InputError
from gammastar.mission.attitudes import About, AnyAttitude, Tilted
from gammastar.mission.choices import Choice, Grid
from gammastar.mission.distributions import AlongPath, Ball, LogUniform, Normal, Uniform

COUNT = 20_000
FLIGHTS = np.arange(COUNT)
SAMPLINGS = ["random", "sobol"]
ALPHA = 1e-4  # of a goodness-of-fit test; the seeds are fixed


def of(distribution: object, sampling: str = "random", seed: int = 3) -> np.ndarray:
    return sampled({"x": distribution}, FLIGHTS, seed, sampling)["x"]  # type: ignore[dict-item]


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_a_flight_alone_is_the_flight_among_others(sampling: str) -> None:
    varied = {"a": AnyAttitude(), "b": Uniform(0, 1), "c": Grid([1, 2, 3]), "d": Ball(2.0)}
    together = sampled(varied, np.arange(100), 7, sampling)
    for flight in (0, 17, 99):
        alone = sampled(varied, np.array([flight]), 7, sampling)
        for name, values in together.items():
            np.testing.assert_array_equal(alone[name][0], values[flight])


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_seeds_give_different_flights(sampling: str) -> None:
    assert not np.any(of(Uniform(0, 1), sampling, 1) == of(Uniform(0, 1), sampling, 2))


@pytest.mark.parametrize("sampling", SAMPLINGS)
@pytest.mark.parametrize(
    ("distribution", "expected"),
    [
        (Uniform(-2, 3), stats.uniform(-2, 5).cdf),
        (LogUniform(0.1, 10), lambda x: np.log(x / 0.1) / np.log(100)),
        (LogUniform(-12, -3), lambda x: np.log(x / -12) / np.log(3 / 12)),
        (Normal(1, 0.05), stats.norm(1, 0.05).cdf),
        (Normal(1, 0.05, low=0.9, high=1.02), stats.truncnorm(-2, 0.4, 1, 0.05).cdf),
    ],
)
def test_numbers_follow_their_distribution(distribution: object, expected: object, sampling: str) -> None:
    assert stats.kstest(of(distribution, sampling), expected).pvalue > ALPHA  # type: ignore[arg-type]


def test_points_are_uniform_in_a_ball() -> None:
    points = of(Ball(2.0, (1.0, 0.0, -1.0))) - [1.0, 0.0, -1.0]
    sizes = np.linalg.norm(points, axis=1)
    assert stats.kstest((sizes / 2) ** 3, "uniform").pvalue > ALPHA
    assert stats.kstest(points[:, 0] / sizes, stats.uniform(-1, 2).cdf).pvalue > ALPHA


def test_attitudes_are_uniform_on_the_rotations() -> None:
    """The angle of a uniform rotation has the density (1 - cos a) / pi, and where it takes an axis is uniform on the sphere."""
    rotations = of(AnyAttitude())
    assert so3.drift(rotations) < 1e-14
    angles = np.arccos(np.clip((np.trace(rotations, axis1=1, axis2=2) - 1) / 2, -1, 1))
    assert stats.kstest(angles, lambda a: (a - np.sin(a)) / np.pi).pvalue > ALPHA
    for entry in rotations.reshape(COUNT, 9).T:
        assert stats.kstest(entry, stats.uniform(-1, 2).cdf).pvalue > ALPHA


def test_tilts_are_those_asked_for_and_headings_uniform() -> None:
    rotations = of(Tilted(30, 90))
    tilts = np.degrees(np.arccos(np.clip(rotations[:, 2, 2], -1, 1)))
    assert stats.kstest(tilts, stats.uniform(30, 60).cdf).pvalue > ALPHA
    assert (
        stats.kstest(np.arctan2(rotations[:, 1, 2], rotations[:, 0, 2]), stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue
        > ALPHA
    )


def test_turns_about_an_axis_are_rolls() -> None:
    rotations = sampled({"x": About((1, 0, 0), 178, 180)}, np.arange(5), 0)["x"]
    angles = np.degrees(np.arctan2(rotations[:, 2, 1], rotations[:, 1, 1]))
    assert np.all((angles > 178) & (angles < 180))
    np.testing.assert_allclose(rotations, [so3.roll(angle) for angle in angles], atol=1e-12)


def test_choices_have_their_probabilities() -> None:
    counts = np.bincount(of(Choice(["a", "b", "c"], [0.2, 0.0, 0.8])), minlength=3)
    assert counts[1] == 0
    assert stats.binomtest(int(counts[0]), COUNT, 0.2).pvalue > ALPHA


def test_grids_go_through_all_combinations_in_turn() -> None:
    varied = {"slow": Grid([1, 2]), "noise": Uniform(0, 1), "fast": Grid([1, 2, 3])}
    values = sampled(varied, np.arange(8), 0)
    assert values["slow"].tolist() == [0, 0, 0, 1, 1, 1, 0, 0]
    assert values["fast"].tolist() == [0, 1, 2, 0, 1, 2, 0, 1]


def test_points_of_low_discrepancy_fill_evenly() -> None:
    halves = of(Uniform(0, 1), "sobol")[:1024]
    assert np.bincount((halves * 64).astype(int), minlength=64).tolist() == [16] * 64


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Uniform(1, 1), "low must be below high"),
        (lambda: Uniform(-1.7e308, 1.7e308), r"low must be at most 1e\+50"),
        (lambda: Normal(0, 1e300), r"deviation must be at most 1e\+50"),
        (lambda: Uniform(0, float("nan")), "finite"),
        (lambda: Uniform((0, 0, 0), 1), "same form"),
        (lambda: LogUniform(-1, 1), "one sign"),
        (lambda: Normal(0, 0), "deviation must be positive"),
        (lambda: Normal(0, 1, low=50, high=60), "must leave some"),
        (lambda: Ball(-1), "positive|greater|above"),
        (lambda: Tilted(0, 190), "between 0 and 180"),
        (lambda: AlongPath(0.5, 1.5), "between 0 and 1"),
        (lambda: Choice([]), "at least one"),
        (lambda: Choice([1, 2], [0.5, 0.4]), "sum to one"),
        (lambda: Grid("abc"), "list"),
    ],
)
def test_what_is_no_distribution_is_refused(make: object, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()  # type: ignore[operator]

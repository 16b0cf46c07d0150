"""What a tuning costs, by hand: weights, limits, flights that fail, and the front."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gammastar.campaign.cost import TERMS, Cost, Judge, front
from gammastar.errors import InputError

SHARES = ("failed", "unsettled")


def columns(settling: list[float], rate: list[float], status: list[str]) -> dict[str, np.ndarray]:
    count = len(status)
    told = {name: np.ones(count) for name in TERMS if name not in SHARES}
    return told | {"settling_time_s": np.array(settling), "peak_rate_rad_s": np.array(rate), "status": np.array(status)}


OWN = columns([2.0, 4.0, np.nan], [10.0, 20.0, np.nan], ["completed", "completed", "diverged"])


def test_a_cost_is_the_weighted_sum_of_means() -> None:
    judge = Judge.of(Cost({"settling_time_s": 1.0, "peak_rate_rad_s": 0.1}), 10.0, OWN)
    means = judge.means(columns([1.0, 3.0], [5.0, 7.0], ["completed"] * 2))
    assert means["settling_time_s"] == 2.0
    assert judge.merit(means) == pytest.approx(2.0 + 0.1 * 6.0)


def test_a_flight_that_fails_counts_a_multiple_of_the_own_mean() -> None:
    """3 s and 15 rad/s are the means of what the own tuning completes; whatever the failed flight told, it counts ten times these."""
    judge = Judge.of(Cost({"settling_time_s": 1.0, "peak_rate_rad_s": 1.0}), 10.0, OWN)
    means = judge.means(columns([0.1, 1.0], [0.1, 1.0], ["diverged", "completed"]))
    assert means["settling_time_s"] == pytest.approx((30.0 + 1.0) / 2)
    assert means["peak_rate_rad_s"] == pytest.approx((150.0 + 1.0) / 2)
    assert means["failed"] == 0.5
    assert Judge.of(Cost(failure=2.0), 10.0, OWN).means(OWN)["peak_rate_rad_s"] == pytest.approx((10 + 20 + 30) / 3)


def test_a_flight_that_does_not_settle_counts_twice_its_duration() -> None:
    judge = Judge.of(Cost(), 10.0, OWN)
    means = judge.means(columns([np.nan, 2.0], [1.0, 1.0], ["completed"] * 2))
    assert means["settling_time_s"] == 11.0
    assert (means["unsettled"], means["failed"]) == (0.5, 0.0)


def test_limits_outweigh_costs() -> None:
    """An open limit is the mean of the own tuning; one exceeded by a tenth costs ten times the own tuning more."""
    whole = columns([2.0, 4.0], [10.0, 20.0], ["completed"] * 2)
    judge = Judge.of(Cost({"peak_rate_rad_s": 1.0}, {"settling_time_s": None, "failed": 0.0}), 10.0, whole)
    assert judge.cost.limits == {"settling_time_s": 3.0, "failed": 0.0}
    kept = judge.means(columns([3.0], [5.0], ["completed"]))
    assert judge.merit(kept) == 5.0
    broken = judge.means(columns([3.3], [4.0], ["completed"]))
    assert judge.merit(broken) == pytest.approx(4.0 + 100 * 15.0 * 0.1)
    assert judge.merit(judge.means(whole)) == 15.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"weights": {"settling_time": 1.0}}, 'did you mean "settling_time_s"'),
        ({"limits": {"thrust": 1.0}}, "a term of a cost must be one of"),
        ({"weights": {"settling_time_s": -1.0}}, "weight of settling_time_s must be at least 0"),
        ({"limits": {"settling_time_s": -1.0}}, "limit of settling_time_s must be at least 0"),
        ({"weights": {"settling_time_s": None}}, "weight of settling_time_s must be a number"),
        ({"weights": {"settling_time_s": 0.0}}, "a cost must have a positive weight"),
        ({"weights": {}}, "a cost must have a positive weight"),
        ({"weights": ["settling_time_s"]}, "weights must be given by term"),
        ({"weights": {"settling_time_s": 1e300}}, "weight of settling_time_s must be between"),
        ({"failure": 0.5}, "failure must be at least 1"),
        ({"failure": 1e300}, "failure must be between"),
    ],
)
def test_bad_costs_are_refused_in_a_sentence(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Cost(**arguments)


def test_a_mission_whose_own_tuning_always_fails_is_refused() -> None:
    with pytest.raises(InputError, match="none of 1"):
        Judge.of(Cost(), 10.0, columns([1.0], [1.0], ["diverged"]))


def test_the_front_is_what_none_surpasses() -> None:
    """By the definition, on random points with equal ones among them."""
    points = np.random.default_rng(0).integers(0, 6, (60, 3)).astype(float)
    kept = front(points)

    def surpassed(point: np.ndarray) -> bool:
        return any(np.all(other <= point) and np.any(other < point) for other in points)

    assert {tuple(points[k]) for k in kept} == {tuple(point) for point in points if not surpassed(point)}
    assert len({tuple(points[k]) for k in kept}) == len(kept)

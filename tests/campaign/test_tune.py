"""Tuning as a whole: a known optimum, the same flights for all, judgement on others, and a mission that flies what was found."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import ttest_rel

import gammastar as gs
from gammastar.campaign import tune as module
from gammastar.campaign.cost import Cost
from gammastar.campaign.flown import rows
from gammastar.campaign.setting import Setting
from gammastar.campaign.trials import Trials, flights_of
from gammastar.campaign.tune import Tuner
from gammastar.errors import InputError
from gammastar.mission import Mission, parse

MASS, HEIGHT, WITHIN = 0.5, 1.0, 1e-3
PLAIN: dict[str, Any] = {
    "vehicle": {"mass": MASS, "inertia": [3e-3, 3e-3, 5e-3], "gravity": 9.81},
    "path": {"name": "line"},
    "reference": {"kind": "speed", "speed": 0.0},
    "start": {"position": [0.0, 0.0, -HEIGHT]},
    "controller": {"poles": -2.5},
    "flight": {"duration": 6.0, "step": 5e-3, "settled_within": WITHIN},
}
NOISY = PLAIN | {
    "controller": {"poles": -2.5, "feedback": "middle", "rate": 100.0},
    "flight": {"duration": 2.0, "step": 1e-2, "settled_within": 0.2},
    "noise": {"position": {"deviation": 1e-2, "rate": 100.0}},
    "campaign": {"vary": [{"quantity": "start.position", "kind": "ball", "radius": 1.0}]},
}


def tuned(values: dict[str, Any], **given: Any) -> module.Tuned:
    return gs.tune(Mission.from_values(values), machine="casadi", **given)


def test_the_pole_of_a_known_optimum_is_found() -> None:
    """Straight above a line only the thrust acts: T = m (g + z''), z the height, with four equal poles p of the chain.

    z = h exp(-s)(1 + s + s^2/2 + s^3/6) with s = p t settles at s_1 where it is the tolerance, and z'' = h p^2 exp(-s)(s^3/6 - s^2/2)
    is largest at s = 3 + sqrt(3).  So w s_1 / p + m (g + k p^2) is least at p^3 = w s_1 / (2 m k).  The cost is flat there: its steps of
    one interval of the settling time leave a few percent of the pole, and the thrust is read at the ends of intervals.
    """
    settled = brentq(lambda s: HEIGHT * np.exp(-s) * (1 + s + s**2 / 2 + s**3 / 6) - WITHIN, 1, 50)
    top = 3 + np.sqrt(3)
    curvature = HEIGHT * np.exp(-top) * (top**3 / 6 - top**2 / 2)
    best = 3.6
    weight = 2 * MASS * curvature * best**3 / settled
    cost = {"settling_time_s": weight, "max_thrust_N": 1.0}
    found = tuned(PLAIN, cost=cost, only=["transverse.frequency"], evaluations=24)
    assert np.real(found.candidate.poles["transverse"]) == pytest.approx([-best] * 4, rel=0.03)
    assert found.unseen[1]["settling_time_s"] == pytest.approx(settled / best, rel=0.03)
    assert found.unseen[1]["max_thrust_N"] == pytest.approx(MASS * (9.81 + curvature * best**2), rel=0.01)
    assert not found.other_flights
    assert "the mission's only flight" in found.message


def test_same_seed_same_tuning_and_another_seed_another() -> None:
    given: dict[str, Any] = {"flights": 3, "evaluations": 4}
    first, again, other = tuned(NOISY, **given), tuned(NOISY, **given), tuned(NOISY, seed=1, **given)
    assert first.as_dict() == again.as_dict()
    assert first.tried[0][1] != other.tried[0][1]
    assert len(first.tried) == 5


def test_every_candidate_flies_the_flights_that_it_would_fly_alone() -> None:
    """Common random numbers: the means of a tuning do not depend on which others are tried with it."""
    found = tuned(NOISY, flights=3, evaluations=6)
    tuner = Tuner(Mission.from_values(NOISY), 3, 1, machine="casadi")
    for candidate, means in found.tried[1:3]:
        (columns,) = tuner.seen.fly([candidate])
        assert found.judge.means(columns) == means


def test_what_is_found_is_judged_by_flights_that_the_search_has_not_seen() -> None:
    found = tuned(NOISY, flights=3, evaluations=4)
    tuner = Tuner(Mission.from_values(NOISY), 3, 1, machine="casadi")
    assert tuner.unseen is not None
    assert not set(tuner.seen.numbers) & set(tuner.unseen.numbers)
    for trials, means in ((tuner.seen, found.tried[0][1]), (tuner.unseen, found.unseen[0])):
        assert found.judge.means(trials.fly([found.tried[0][0]])[0]) == means


def test_the_mission_that_is_written_flies_what_was_found() -> None:
    """The same numbers on the first of the flights that the search had not seen, and its own tuning is what it says."""
    found = tuned(NOISY, flights=3, evaluations=10)
    assert found.is_better
    own, best = (found.judge.cost.of(means) for means in found.unseen)
    assert found.improvement == own / best > 1
    assert f"{best:.4g} on 30 other flights, where the mission's own costs {own:.4g}" in found.message
    mission = parse(found.toml())
    assert mission == found.mission
    assert mission.law().poles == found.candidate.poles
    again = Tuner(mission, 3, 1, machine="casadi")
    assert again.unseen is not None
    columns = again.unseen.fly([module.Candidate.of(mission.law())])[0]
    assert found.judge.means(columns) == found.unseen[1]
    assert mission.fly().completed


def test_how_sure_it_is_follows_from_the_differences_flight_by_flight() -> None:
    """Student's t of paired samples, as SciPy computes it; an interval that holds zero may be chance."""
    found = tuned(NOISY, flights=3, evaluations=10)
    assert found.costs is not None
    own, best = found.costs
    assert (len(own), np.mean(own), np.mean(best)) == pytest.approx((30, *found._costs))
    low, high = found.saving_interval or (0.0, 0.0)
    assert (low, high) == pytest.approx(tuple(ttest_rel(own, best).confidence_interval(0.95)))
    assert 0 < low < high
    assert found.message.endswith(f"(with a confidence of 95 %, between {low:.3g} and {high:.3g} less)")
    tilted = best + np.linspace(-9.0, 9.0, len(best))
    assert dataclasses.replace(found, costs=(own, tilted)).message.endswith("which may be chance: raise flights")
    assert dataclasses.replace(found, costs=(own[:1], best[:1])).saving_interval is None


def test_points_of_a_grid_without_chance_judge_once() -> None:
    """They recur after all combinations, and are no other flights then; with noise they are."""
    grid = {"quantity": "reference.speed", "kind": "grid", "low": 0.5, "high": 1.0, "count": 5}
    mission = Mission.from_values(PLAIN | {"campaign": {"vary": [grid]}})
    assert flights_of(mission, 2) == (range(2), range(2, 5))
    assert flights_of(mission, 24) == (range(5), None)
    assert flights_of(Mission.from_values(NOISY | {"campaign": {"vary": [grid]}}), 2) == (range(2), range(2, 22))
    found = tuned(PLAIN | {"campaign": {"vary": [grid]}}, flights=5, evaluations=4)
    assert (found.flights, found.other_flights) == (5, 0)
    assert found.best == 0 or "on all 5 flights of the mission" in found.message


def test_limits_may_cost_more() -> None:
    """The mission's own tuning turns too fast: to turn slower takes longer, and nothing is said of how much less that costs."""
    found = tuned(NOISY, flights=3, evaluations=10)
    own, best = found.unseen
    limits = {"peak_rate_rad_s": own["peak_rate_rad_s"] / 2}
    judge = dataclasses.replace(found.judge, cost=dataclasses.replace(found.judge.cost, limits=limits))
    slower = best | {"settling_time_s": own["settling_time_s"] + 1.0, "peak_rate_rad_s": own["peak_rate_rad_s"] / 2}
    found = dataclasses.replace(found, judge=judge, unseen=(own, slower))
    assert found.is_better
    assert found.improvement < 1
    assert found.message.endswith(f"the mission's own costs {judge.cost.of(own):.4g}, but is farther above its limits")


def test_what_is_no_better_on_other_flights_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The other flights of the one found are replaced by far worse ones."""
    given: dict[str, Any] = {"flights": 3, "evaluations": 10}
    tuner = Tuner(Mission.from_values(NOISY), machine="casadi", **given)
    tuner.run()
    flown = tuner._flown

    def worse(*arguments: Any) -> Any:
        own, best = flown(*arguments)
        return [own, best | {"settling_time_s": best["settling_time_s"] + 100.0}]

    monkeypatch.setattr(tuner, "_flown", worse)
    found = tuner.tuned()
    assert found.best != 0
    assert not found.is_better
    assert found.improvement == 1.0
    assert found.mission is tuner.mission
    assert "not better than the mission's own on 30 other flights, so that is kept" in found.message


def test_an_interrupt_keeps_what_has_been_found() -> None:
    calls = list[tuple[int, int]]()

    def interrupt(done: int, total: int) -> None:
        calls.append((done, total))
        if done > total / 2:
            raise KeyboardInterrupt

    tuner = Tuner(Mission.from_values(NOISY), 2, 40, machine="casadi")
    tuner.run(interrupt)
    assert tuner.is_interrupted
    assert 1 < len(tuner.tried) < 41
    found = tuner.tuned()
    assert f"interrupted after {len(tuner.tried) - 1} tunings" in found.message
    done, totals = zip(*calls, strict=True)
    assert list(done) == sorted(done)
    assert set(totals) == {2 * 41 + 2 * 20}


def test_an_interrupt_before_the_first_flights_is_one() -> None:
    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Tuner(Mission.from_values(NOISY), 2, 40, machine="casadi").run(interrupt)


def test_lists_of_a_campaign_are_flown_by_their_own_missions() -> None:
    """Flights 0 and 2 are on the first path, 1 and 3 on the second; their columns are in the order of their numbers."""
    vary = [{"quantity": "path.position", "kind": "grid", "choices": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]}]
    mission = Mission.from_values(PLAIN | {"campaign": {"vary": vary}})
    (columns,) = Trials(mission, range(4), 0, "casadi").fly([module.Candidate.of(mission.law())])
    assert columns["max_distance_m"] == pytest.approx([HEIGHT, HEIGHT + 0.5] * 2)


def test_candidates_meet_the_noise_speed_and_latency_of_every_flight() -> None:
    """Two candidates of one tuning fly as the campaign does."""
    vary = [
        {"quantity": "truth.noise_scale", "kind": "uniform", "low": 0.0, "high": 5.0},
        {"quantity": "reference.speed", "kind": "uniform", "low": -1.0, "high": 1.0},
        {"quantity": "truth.latency", "kind": "grid", "choices": [0.0, 0.015]},
    ]
    mission = Mission.from_values(NOISY | {"campaign": {"vary": vary}})
    trials = Trials(mission, range(4), 3, "casadi")
    expected = rows(Setting(mission, 3), range(4), "casadi").to_pydict()
    for columns in trials.fly([module.Candidate.of(mission.law())] * 2):
        for name in ("final_distance_m", "peak_speed_m_s"):
            assert columns[name] == pytest.approx(expected[name], rel=1e-9)


def test_a_cost_that_vanishes_is_infinitely_less() -> None:
    """The slow poles that the mission has do not settle in time, faster ones do."""
    flight = {"flight": {"duration": 3.0, "step": 1e-2, "settled_within": 0.05}}
    found = tuned(PLAIN | flight | {"controller": {"poles": -1.5}}, cost={"unsettled": 1.0}, evaluations=20)
    assert found.is_better
    assert found.improvement == np.inf
    assert found.message.endswith("costs 0 on the mission's only flight, where the mission's own costs 1")


@pytest.mark.parametrize(
    ("changes", "given", "said"),
    [
        ({}, {"flights": 0}, "flights must be at least 1"),
        ({}, {"flights": 10**7}, "flights must be at most 1,000,000"),
        ({}, {"evaluations": 0}, "evaluations must be at least 1"),
        ({}, {"evaluations": -3}, "evaluations must be at least 1"),
        ({}, {"only": "transverse"}, "only must be a list"),
        ({}, {"only": ["transversal"]}, "what is tuned must be one of"),
        ({}, {"cost": {"time": 1.0}}, "a term of a cost"),
        ({"controller.interface": "c"}, {}, "many flights must fly the law itself"),
        ({"integral.pole": 0.5}, {}, "put \\[observer\\] in place of \\[integral\\]"),
        (
            {"campaign.vary": [{"quantity": "controller.poles", "kind": "list", "choices": [-2.0, -3.0]}]},
            {},
            "got contr",
        ),
    ],
)
def test_what_cannot_be_tuned_is_refused_in_a_sentence(
    changes: dict[str, Any], given: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        gs.tune(Mission.from_values(PLAIN).with_values(changes), **given)


def test_a_name_is_no_mission() -> None:
    with pytest.raises(InputError, match="mission must be a Mission"):
        gs.tune("upright")  # type: ignore[arg-type]


def test_a_limit_of_the_own_tuning_holds() -> None:
    """The lower thrust is sought that settles as fast as the mission does."""
    found = Tuner(
        Mission.from_values(PLAIN), 1, 30, Cost({"max_thrust_N": 1.0}, {"settling_time_s": None}), machine="casadi"
    )
    found.run()
    result = found.tuned()
    assert result.is_better
    own, best = result.unseen
    assert best["settling_time_s"] <= own["settling_time_s"]
    assert best["max_thrust_N"] < own["max_thrust_N"]

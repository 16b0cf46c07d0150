"""A study tells what stands in the rows: counted by hand, by Wilson's own formula, and by NumPy."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import duckdb
import numpy as np
import pytest
from scipy.stats import binomtest

from campaign.rows import stored, write
from gammastar.campaign.manifest import Manifest
from gammastar.campaign.rate import percent, wilson
from gammastar.campaign.store import Store
from gammastar.campaign.study import Study
from gammastar.errors import CampaignError, InputError
from gammastar.mission.load import parse

COUNT = 5_000


@pytest.fixture(scope="module")
def data() -> dict[str, np.ndarray]:
    generator = np.random.default_rng(0)
    mass, tilt = generator.uniform(0.8, 1.2, COUNT), generator.uniform(0, 180, COUNT)
    settled = generator.random(COUNT) < np.where(tilt < 90, 0.99, 0.4)
    status = np.where(settled | (mass > 1), "completed", "free_fall")
    return {
        "flight": np.arange(COUNT),
        "truth.mass_scale": mass,
        "start_tilt_deg": tilt,
        "path.radius": np.where(np.arange(COUNT) % 2, 1.0, 2.0),
        "settled": settled,
        "status": status,
        "settling_time_s": np.where(settled, tilt / 60, np.nan),
    }


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory, data: dict[str, np.ndarray]) -> Study:
    return Study(stored(tmp_path_factory.mktemp("study"), data))


@pytest.mark.parametrize(("successes", "flights"), [(0, 10), (10, 10), (3, 10), (999, 1000), (1, 1)])
def test_intervals_are_wilsons(successes: int, flights: int) -> None:
    expected = binomtest(successes, flights).proportion_ci(0.95, method="wilson")
    rate = wilson(successes, flights)
    assert (rate.low, rate.high) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_no_flights_say_nothing() -> None:
    assert wilson(0, 0)[2:] == (0.0, 1.0)
    assert np.isnan(wilson(0, 0).share)


def test_the_rate_is_counted(study: Study, data: dict[str, np.ndarray]) -> None:
    assert study.rate()[:2] == (COUNT, data["settled"].sum())


def test_all_questions_are_about_the_same_flights(data: dict[str, np.ndarray], tmp_path: Path) -> None:
    """A campaign goes on while it is studied: parts come, and short ones, where it has ended twice before, become longer."""
    store = stored(tmp_path, {name: values[:500] for name, values in data.items()}, part=1000)
    for flights, parts in ((2500, (2, 1)), (4000, (3,))):
        store = Store.opened(tmp_path, dataclasses.replace(store.manifest, flights=flights))
        write(store, data, parts)
    assert store.held() == {0: 500, 1: 1000, 2: 500, 3: 1000}
    study, dataset = Study(store), store.dataset()
    assert study.rate().flights == 3000
    for short in (0, 2):  # whose files may be replaced at any time, in the middle of a query too
        store.path(short).unlink()
    assert study.rate().flights == dataset.to_table().num_rows == 3000
    store = Store.opened(tmp_path, dataclasses.replace(store.manifest, flights=COUNT))
    write(store, data, store.missing())
    assert Study(store).rate().flights == COUNT
    assert study.rate().flights == sum(each.rate.flights for each in study.by("path.radius")) == 3000
    assert study.over("start_tilt_deg", "truth.mass_scale", (3, 4)).flights.sum() == 3000
    assert study.asked("SELECT max(flight) FROM flights") == [(3999,)]
    assert Study(Store(tmp_path, dataclasses.replace(store.manifest, flights=700))).rate().flights == 700


@pytest.mark.parametrize("name", ["a b", "ü%20'q\"", "x[1]", "x*y", "w?z", "#{a,b}"])
def test_a_folder_may_have_any_name(name: str, data: dict[str, np.ndarray], tmp_path: Path) -> None:
    """The database takes some letters of a file's name for others."""
    few = {key: values[:10] for key, values in data.items()}
    stored(tmp_path / "xzy", few, part=5)
    study = Study(stored(tmp_path / name, few, part=5))
    assert study.rate().flights == study.store.dataset().count_rows() == 10


def test_a_broken_part_is_told_and_a_wrong_question_is_the_databases(
    data: dict[str, np.ndarray], tmp_path: Path
) -> None:
    store = stored(tmp_path, data, part=1000)
    with pytest.raises(duckdb.BinderException):
        Study(store).asked("SELECT nothing FROM flights")
    content = bytearray(store.path(1).read_bytes())
    content[4:1000] = bytes(996)
    store.path(1).write_bytes(content)
    with pytest.raises(CampaignError, match="must hold rows that can be read"):
        Study(store).asked("SELECT sum(flight) FROM flights")


def test_numbers_too_large_for_bins_are_in_none(tmp_path: Path) -> None:
    rows = {"flight": np.arange(4), "status": np.full(4, "completed"), "settled": np.full(4, True)}
    study = Study(stored(tmp_path, rows | {"x.y": np.array([-1e308, 1e308, 1.0, 2.0])}))
    assert study.ends("x.y") == (1.0, 2.0)
    assert sum(each.rate.flights for each in study.by("x.y", 10)) == 2


def test_a_folder_may_be_named_from_where_one_stands(
    data: dict[str, np.ndarray], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    few = {key: values[:10] for key, values in data.items()}
    assert Study(stored(Path("~"), few, part=5)).rate().flights == 10


def test_causes_are_ranked(study: Study, data: dict[str, np.ndarray]) -> None:
    failed = ~data["settled"]
    expected = {
        "not settled": np.flatnonzero(failed & (data["status"] == "completed")),
        "free_fall": np.flatnonzero(data["status"] == "free_fall"),
    }
    found = {cause.status: cause for cause in study.causes()}
    assert found.keys() == expected.keys()
    for status, flights in expected.items():
        assert found[status].rate == wilson(len(flights), COUNT)
        assert found[status].first == flights[0]
    counts = [cause.rate.successes for cause in study.causes()]
    assert counts == sorted(counts, reverse=True)


def test_a_cause_tells_when_flights_end_and_what_the_first_says(tmp_path: Path) -> None:
    rows = {
        "flight": np.arange(5),
        "status": np.array(["completed", "refused", "free_fall", "free_fall", "refused"]),
        "settled": np.array([True, False, False, False, False]),
        "end_time_s": np.array([20.0, np.nan, 1.0, 4.0, np.nan]),
        "cause": np.array(["", "mass must be positive", "", "", "another"]),
    }
    falls, refused = Study(stored(tmp_path, rows)).causes()
    assert (falls.status, falls.rate.successes, falls.first, falls.end, falls.words) == ("free_fall", 2, 2, 2.5, "")
    assert (refused.status, refused.first, refused.words) == ("refused", 1, "mass must be positive")


def test_quantiles_are_those_of_the_numbers(study: Study, data: dict[str, np.ndarray]) -> None:
    times = data["settling_time_s"][data["settled"]]
    found = study.distribution("settling_time_s")
    assert found["flights"] == len(times)
    assert found["50%"] == pytest.approx(np.median(times))
    assert found["95%"] == pytest.approx(np.quantile(times, 0.95))
    assert found["100%"] == times.max()


@pytest.mark.parametrize("bins", [1, 7, 10])
def test_bins_hold_every_flight_once(study: Study, data: dict[str, np.ndarray], bins: int) -> None:
    found = study.by("start_tilt_deg", bins)
    edges = np.array([found[0].low, *(each.high for each in found)])
    assert [each.low for each in found[1:]] == [each.high for each in found[:-1]]
    counts, _ = np.histogram(data["start_tilt_deg"], edges)
    good, _ = np.histogram(data["start_tilt_deg"][data["settled"]], edges)
    assert [each.rate[:2] for each in found] == list(zip(counts, good, strict=True))
    assert counts.sum() == COUNT


def test_a_bin_tells_how_fast_its_flights_settle(study: Study, data: dict[str, np.ndarray]) -> None:
    each = study.by("start_tilt_deg", 6)[2]
    chosen = data["settled"] & (data["start_tilt_deg"] >= each.low) & (data["start_tilt_deg"] < each.high)
    assert (each.low, each.high) == (60, 90)
    assert each.settling == pytest.approx(np.quantile(data["settling_time_s"][chosen], [0.5, 0.95]))


def test_a_column_of_few_values_has_a_bin_for_each(study: Study) -> None:
    found = study.by("path.radius")
    assert [(each.low, each.high, each.rate.flights) for each in found] == [(1.0, 1.0, 2500), (2.0, 2.0, 2500)]


def test_a_map_over_two_columns_counts_as_numpy_does(study: Study, data: dict[str, np.ndarray]) -> None:
    first, second, flights, successes, _ = study.over("start_tilt_deg", "truth.mass_scale", (5, 4))
    counts, *_ = np.histogram2d(data["start_tilt_deg"], data["truth.mass_scale"], (first, second))
    np.testing.assert_array_equal(flights, counts)
    assert successes.sum() == data["settled"].sum()


def test_unknown_columns_are_refused(study: Study) -> None:
    with pytest.raises(InputError, match='did you mean "start_tilt_deg"'):
        study.by("start_tilt")
    with pytest.raises(InputError, match="column of numbers"):
        study.distribution("status")


@pytest.mark.parametrize("bins", [0, -1, 1.5, 10**9])
def test_bins_that_cannot_be_made_are_refused(study: Study, bins: int) -> None:
    with pytest.raises(InputError, match="bins must be"):
        study.by("start_tilt_deg", bins)


def test_an_empty_campaign_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must hold flights"):
        Study(Store.opened(tmp_path, Manifest("", 0, 10, 10, "native", "1"))).rate()


@pytest.fixture(scope="module")
def odd(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Columns that are constant, empty, infinite, or texts; the middle part is missing, one is broken and one half written."""
    count = 100
    rows = {
        "flight": np.arange(count),
        "status": np.full(count, "completed"),
        "settled": np.arange(count) % 2 == 0,
        "constant": np.full(count, 2.0),
        "nothing": np.full(count, np.nan),
        "wild": np.where(np.arange(count) < 10, np.inf, np.where(np.arange(count) < 15, np.nan, np.arange(count))),
        "text": np.array([f"kind {min(k % 40, 20)}" for k in range(count)]),
    }
    store = stored(tmp_path_factory.mktemp("odd"), rows, part=20, lost=2)
    store.path(3).write_bytes(store.path(3).read_bytes()[:-20])
    (store.path(0).parent / ".draft-x").write_bytes(b"half")
    return Study(store)


def test_what_is_there_is_read_while_the_rest_is_missing(odd: Study) -> None:
    assert odd.rate()[:2] == (60, 30)
    assert odd.asked("SELECT min(flight), max(flight) FROM flights") == [(0, 99)]


def test_a_constant_column_is_one_value(odd: Study) -> None:
    assert not odd.varies("constant")
    assert [(each.low, each.high, each.rate.flights) for each in odd.by("constant")] == [(2.0, 2.0, 60)]
    assert odd.over("constant", "flight" if "flight" in odd.numbers else "wild", (3, 3)).first.tolist() == [1.5, 2.5]


def test_a_column_without_numbers_has_no_bins(odd: Study) -> None:
    assert odd.by("nothing") == []
    assert odd.distribution("nothing") == {}
    assert odd.ends("nothing") is None
    with pytest.raises(InputError, match="finite number"):
        odd.over("nothing", "wild")


def test_numbers_that_are_not_finite_are_in_no_bin(odd: Study) -> None:
    found = odd.by("wild", 5)
    assert sum(each.rate.flights for each in found) == 45
    assert odd.ends("wild") == (15.0, 99.0)
    assert odd.over("wild", "constant", (4, 4)).flights.sum() == 45


def test_bins_without_a_flight_are_told(odd: Study) -> None:
    empty = [each for each in odd.by("wild", 20) if not each.rate.flights]
    assert [(each.low, each.high) for each in empty] == [
        (40, 45),
        (45, 50),
        (50, 55),
        (55, 60),
        (60, 65),
        (65, 70),
        (70, 75),
        (75, 80),
    ]


def test_of_many_texts_the_most_frequent_are_told(odd: Study) -> None:
    found = odd.by("text", 3)
    assert found[0].low == found[0].high == "kind 20"
    assert [each.rate.flights for each in found] == sorted((each.rate.flights for each in found), reverse=True)
    assert len(found) == 3


def test_rows_of_something_else_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="got none named settled"):
        Study(stored(tmp_path, {"flight": np.arange(5), "status": np.full(5, "completed")})).rate()


@pytest.mark.parametrize(
    ("share", "words"), [(1.0, "100.00 %"), (0.99999, "99.999 %"), (1e-6, "0.0001 %"), (0.0, "0.00 %")]
)
def test_most_is_not_all(share: float, words: str) -> None:
    assert percent(share) == words


@pytest.mark.parametrize("toml", ["", "title = 3", "future = [", "[vehicle]"])
def test_a_mission_that_cannot_be_read_leaves_the_rows(toml: str, tmp_path: Path) -> None:
    rows = {
        "flight": np.arange(4),
        "status": np.full(4, "completed"),
        "settled": np.full(4, True),
        "truth.mass_scale": np.ones(4),
    }
    study = Study(stored(tmp_path, rows, toml=toml))
    assert study.mission == ("", "ned", None)
    assert study.rate()[:2] == (4, 4)


def test_defaults_of_a_mission_are_known(tmp_path: Path) -> None:
    """A manifest may hold the mission as it was written, here without frame and settled_within."""
    source = """
title = "x"
vehicle = {mass = 1.0, inertia = [0.1, 0.1, 0.1]}
path = {name = "circle"}
start = {position = [3.0, 0.0, 0.0]}
reference = {kind = "speed", speed = 1.0}
flight = {duration = 1.0}
"""
    rows = {"flight": np.arange(4), "status": np.full(4, "completed"), "settled": np.full(4, True)}
    assert Study(stored(tmp_path, rows, toml=source)).mission == ("x", "ned", parse(source).file.flight.settled_within)

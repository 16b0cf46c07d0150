"""A study tells what stands in the rows: counted by hand, by Wilson's own formula, and by NumPy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from gammastar.campaign.store import Manifest, Store, arrow
from gammastar.campaign.study import Study, wilson
from gammastar.errors import InputError

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
    pyarrow, _ = arrow()
    manifest = Manifest("", 0, COUNT, 2000, "native", "1")
    store = Store.opened(tmp_path_factory.mktemp("study"), manifest)
    for part in range(manifest.parts):
        chosen = manifest.numbers(part)
        store.write(part, pyarrow.table({name: values[chosen.start : chosen.stop] for name, values in data.items()}))
    return Study(store)


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


def test_causes_are_ranked(study: Study, data: dict[str, np.ndarray]) -> None:
    failed = ~data["settled"]
    expected = {
        "not settled": int((failed & (data["status"] == "completed")).sum()),
        "free_fall": int((data["status"] == "free_fall").sum()),
    }
    assert study.causes() == expected
    assert list(study.causes().values()) == sorted(expected.values(), reverse=True)


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
    edges = np.linspace(data["start_tilt_deg"].min(), data["start_tilt_deg"].max(), bins + 1)
    counts, _ = np.histogram(data["start_tilt_deg"], edges)
    good, _ = np.histogram(data["start_tilt_deg"][data["settled"]], edges)
    assert [each.rate[:2] for each in found] == list(zip(counts, good, strict=True))


def test_a_column_of_few_values_has_a_bin_for_each(study: Study) -> None:
    found = study.by("path.radius")
    assert [(each.low, each.high, each.rate.flights) for each in found] == [(1.0, 1.0, 2500), (2.0, 2.0, 2500)]


def test_a_map_over_two_columns_counts_as_numpy_does(study: Study, data: dict[str, np.ndarray]) -> None:
    first, second, flights, successes = study.over("start_tilt_deg", "truth.mass_scale", (5, 4))
    counts, *_ = np.histogram2d(data["start_tilt_deg"], data["truth.mass_scale"], (first, second))
    np.testing.assert_array_equal(flights, counts)
    assert successes.sum() == data["settled"].sum()


def test_unknown_columns_are_refused(study: Study) -> None:
    with pytest.raises(InputError, match='did you mean "start_tilt_deg"'):
        study.by("start_tilt")
    with pytest.raises(InputError, match="bins must be at least 1"):
        study.by("start_tilt_deg", 0)


def test_an_empty_campaign_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must hold flights"):
        Study(Store.opened(tmp_path, Manifest("", 0, 10, 10, "native", "1"))).rate()

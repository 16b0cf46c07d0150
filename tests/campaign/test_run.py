"""Running a campaign: the same rows whoever flies them, after any interruption too, and bad campaigns leave nothing."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from gammastar.campaign import places
from gammastar.campaign.places import cluster_of
from gammastar.campaign.store import Store
from gammastar.errors import CampaignError, InputError, MissionError, SingularStartError, UnknownNameError
from gammastar.mission import Mission, load

FLIGHTS, PART = 20, 4
PATIENCE = 60.0  # [s], for machines that are busy
CHANGES: dict[str, Any] = {
    "flight.duration": 0.2,
    "flight.step": 5e-3,
    "flight.settled_within": 100.0,
    "controller": {"poles": -2.5, "feedback": "middle", "rate": 100.0},
    "noise": {"position": {"deviation": 0.01, "rate": 100.0}},
    "campaign": {
        "vary": [
            {"quantity": "start.attitude", "kind": "any"},
            {"quantity": "truth.mass_scale", "kind": "normal", "mean": 0.6, "deviation": 0.3},
        ]
    },
}
ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(gs.__file__).parents[1])}


@pytest.fixture(scope="module")
def mission() -> Mission:
    return load("upright").with_values(CHANGES)


def listed(quantity: str, *choices: Any) -> dict[str, Any]:
    vary = [{"quantity": quantity, "kind": "list", "choices": list(choices)}]
    return {"mission": load("upright").with_values({"campaign.vary": vary})}


def flown(mission: Mission, out: Path, machine: str = "casadi", **given: Any) -> gs.Campaign:
    return gs.campaign(mission, FLIGHTS, out, **{"part": PART, "machine": machine, "seed": 3} | given)


def told(campaign: gs.Campaign) -> str:
    """All rows; NaN counts as equal to itself."""
    return repr(campaign.dataset().to_table().to_pylist())


@pytest.fixture(scope="module")
def expected(mission: Mission, tmp_path_factory: pytest.TempPathFactory) -> gs.Campaign:
    return flown(mission, tmp_path_factory.mktemp("campaign") / "out")


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_every_flight_has_its_row(mission: Mission, expected: gs.Campaign) -> None:
    assert len(expected) == FLIGHTS
    assert expected.to_pandas()["flight"].tolist() == list(range(FLIGHTS))
    assert expected.to_polars().columns == expected.dataset().schema.names
    rate = expected.study().rate()
    assert rate.flights == FLIGHTS
    assert 0 < rate.successes < FLIGHTS  # a mass below zero is refused
    assert expected.tally.rows == FLIGHTS
    assert expected.tally.steps == 20 * rate.successes
    assert gs.Campaign.read(expected.store.folder).mission == mission


def test_progress_counts_flights(mission: Mission, tmp_path: Path) -> None:
    seen = list[tuple[int, int]]()
    gs.campaign(mission, 5, tmp_path, part=3, machine="casadi", progress=lambda *each: seen.append(each))
    assert seen[0] == (0, 5)
    assert seen[-1] == (5, 5)
    assert seen == sorted(seen)
    gs.campaign(mission, 8, tmp_path, progress=lambda *each: seen.append(each))
    assert (3, 8) in seen  # the last part has become longer


def test_parts_make_no_difference(mission: Mission, expected: gs.Campaign, tmp_path: Path) -> None:
    assert told(flown(mission, tmp_path, part=7)) == told(expected)


def test_workers_make_no_difference(mission: Mission, tmp_path: Path) -> None:
    pytest.importorskip("gammastar.engine.compiler").compiler()
    one, two = (flown(mission, tmp_path / str(k), "native", workers=k) for k in (1, 2))
    assert one.store.manifest.machine == "native"
    assert told(one) == told(two)


def test_an_interrupted_run_goes_on_to_the_same_rows(mission: Mission, expected: gs.Campaign, tmp_path: Path) -> None:
    """Ctrl-C in the middle of a part: those before it are kept, and only the others are flown."""

    def interrupt(done: int, total: int) -> None:
        if done > 2 * PART + 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        flown(mission, tmp_path, progress=interrupt)
    held = gs.Campaign.read(tmp_path)
    assert len(held) == 2 * PART
    assert held.store.missing() == [2, 3, 4]
    again = flown(mission, tmp_path, machine="auto")  # takes the machine that began
    assert again.tally.rows == FLIGHTS - 2 * PART
    assert told(again) == told(expected)


def test_a_killed_process_leaves_what_goes_on_to_the_same_rows(
    mission: Mission, expected: gs.Campaign, tmp_path: Path
) -> None:
    """SIGKILL, while the second part is in work; what it left half written is not read, and goes away.

    While it lives no other run writes there; its lock goes with it.
    """
    file, out = tmp_path / "mission.toml", tmp_path / "out"
    file.write_text(mission.source(), encoding="utf-8")
    code = f"""
import time, gammastar as gs
def wait(done, total):
    while done > {PART + 1}:
        time.sleep(1)
mission = gs.load_mission({str(file)!r})
gs.campaign(mission, {FLIGHTS}, {str(out)!r}, part={PART}, machine="casadi", seed=3, progress=wait)
"""
    process = subprocess.Popen([sys.executable, "-c", code], env=ENVIRONMENT)
    try:
        until(lambda: (out / "parts" / "00000000.parquet").exists())
        with pytest.raises(CampaignError, match="being written by another run"):
            flown(mission, out)
        assert gs.Campaign.read(out).study().rate().flights == PART
    finally:
        process.kill()
        process.wait()
    half = out / "parts" / ".draft-half"
    half.write_bytes(b"PAR1")
    assert told(flown(mission, out)) == told(expected)
    assert not half.exists()


def test_a_full_disk_leaves_what_goes_on(
    mission: Mission, expected: gs.Campaign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Store.write

    def full(self: Store, part: int, table: Any) -> None:
        if part == 2:
            (tmp_path / "parts").rename(tmp_path / "away")  # as a full disk: nothing can be written there
        try:
            write(self, part, table)
        finally:
            if part == 2:
                (tmp_path / "away").rename(tmp_path / "parts")

    monkeypatch.setattr(Store, "write", full)
    with pytest.raises(CampaignError, match="flights that are there are kept"):
        flown(mission, tmp_path)
    monkeypatch.setattr(Store, "write", write)
    assert sorted(each.name for each in (tmp_path / "parts").iterdir()) == ["00000000.parquet", "00000001.parquet"]
    assert told(flown(mission, tmp_path)) == told(expected)


@pytest.mark.parametrize(
    ("given", "kind", "said"),
    [
        ({"flights": 0}, InputError, "flights must be at least 1"),
        ({"flights": -3}, InputError, "flights must be at least 1"),
        ({"flights": 10**9 + 1}, InputError, "flights must be at most 1,000,000,000"),
        ({"flights": 2.5}, InputError, "flights must be a whole number"),
        ({"workers": 0}, InputError, "workers must be at least 1"),
        ({"part": 0}, InputError, "flights in a part must be at least 1"),
        ({"workers": -1}, InputError, "workers must be at least 1"),
        ({"seed": -1}, InputError, "seed must be at least 0"),
        ({"machine": "gpu"}, UnknownNameError, "machine must be one of"),
        ({"mission": "upright"}, InputError, "load one with"),
        ({"mission": load("upright")}, MissionError, "must have a mission with"),
        (listed("truth.mass_scale", True, 1.0), MissionError, r"mass_scale must be a number \(got true\)"),
        (listed("truth.mass_scale", float("nan"), 1.0), MissionError, "mass_scale must be finite"),
    ],
    ids=lambda each: "-".join(each) if isinstance(each, dict) else None,
)
def test_a_bad_campaign_leaves_nothing(
    mission: Mission, tmp_path: Path, given: dict[str, Any], kind: type[Exception], said: str
) -> None:
    out = tmp_path / "out"
    with pytest.raises(kind, match=said) as error:
        gs.campaign(**{"mission": mission, "flights": 4, "out": out, "machine": "casadi"} | given)
    assert "\n" not in str(error.value)
    assert not out.exists()


def test_what_no_flight_can_do_is_refused_before_anything_is_written(mission: Mission, tmp_path: Path) -> None:
    replaced = load("replanned").with_values({"campaign": CHANGES["campaign"]})
    with pytest.raises(MissionError, match="must have one path"):
        gs.campaign(replaced, 4, tmp_path / "out", machine="casadi")
    compiled = load("quadrotor").with_values({"campaign": CHANGES["campaign"], "controller.interface": "c"})
    with pytest.raises(MissionError, match="must fly the law itself"):
        gs.campaign(compiled, 4, tmp_path / "out", machine="casadi")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_another_campaign_or_that_is_none_is_refused(
    mission: Mission, expected: gs.Campaign, tmp_path: Path
) -> None:
    before = told(expected)
    with pytest.raises(CampaignError, match="seed 3"):
        flown(mission, expected.store.folder, seed=4)
    with pytest.raises(CampaignError, match="another mission"):
        flown(mission.with_values({"controller.rate": 50.0}), expected.store.folder)
    assert told(expected) == before
    file = tmp_path / "file"
    file.write_text("mine")
    with pytest.raises(CampaignError, match="must be a folder that can be written"):
        flown(mission, file)
    assert file.read_text() == "mine"


def test_a_flight_is_flown_again_to_the_last_bit(expected: gs.Campaign) -> None:
    rows = expected.to_pandas().set_index("flight")
    number = int(rows.index[rows["status"] == "completed"][0])
    again = expected.fly(number)
    assert again.same
    assert again.row["max_distance_m"] == rows["max_distance_m"][number]
    assert again.record.distance[-1] == pytest.approx(rows["final_distance_m"][number], rel=1e-12)
    assert again.record.truth.mass == pytest.approx(0.1 * rows["truth.mass_scale"][number])
    alone = again.mission.fly()  # a mission of its own, the same to rounding
    assert alone.distance[-1] == pytest.approx(rows["final_distance_m"][number], rel=1e-6)
    assert alone.start.vector(1.0) == pytest.approx(again.record.start.vector(1.0))


def test_a_flight_that_is_not_its_row_says_so(expected: gs.Campaign, tmp_path: Path) -> None:
    """As that of another processor: a last digit is another."""
    store = Store.opened(tmp_path, expected.store.manifest)
    table = expected.dataset().to_table().slice(0, PART)
    name, values = "max_distance_m", table["max_distance_m"].to_numpy()
    place = table.schema.get_field_index(name)
    store.write(0, table.set_column(place, name, [np.nextafter(values, np.inf)]))
    number = table["status"].to_pylist().index("completed")
    assert not gs.Campaign(store).fly(number).same


def test_what_cannot_be_flown_again_says_why(mission: Mission, expected: gs.Campaign, tmp_path: Path) -> None:
    rows = expected.to_pandas().set_index("flight")
    refused = int(rows.index[rows["status"] == "refused"][0])
    with pytest.raises(InputError, match=r"refused: \[truth\] mass_scale must be finite and positive"):
        expected.fly(refused)
    with pytest.raises(InputError, match="below the 20"):
        expected.fly(FLIGHTS)
    store = Store.opened(tmp_path, expected.store.manifest)
    with pytest.raises(InputError, match="no row of it yet"):
        gs.Campaign(store).fly(1)
    axis = {"quantity": "start.position", "kind": "list", "choices": [[0.0, 0.0, 5.0]]}
    focal = gs.campaign(mission.with_values({"campaign.vary": [axis]}), 1, tmp_path / "focal", machine="casadi")
    with pytest.raises((InputError, SingularStartError), match="must have started"):
        focal.fly(0)


@pytest.fixture(scope="module")
def scheduler() -> Iterator[Any]:
    """A scheduler in this process, without workers."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as cluster:
        yield cluster


def worker(address: str, **environment: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1"]
    return subprocess.Popen(
        [*command, "--no-dashboard", "--death-timeout", "30"],
        env=ENVIRONMENT | environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


@pytest.fixture
def workers(scheduler: Any) -> Iterator[list[subprocess.Popen[bytes]]]:
    started = [worker(scheduler.scheduler_address) for _ in range(2)]
    try:
        until(lambda: len(scheduler.scheduler.workers) == 2)
        yield started
    finally:
        for each in started:
            each.kill()
            each.wait()
        until(lambda: not scheduler.scheduler.workers)


def test_a_cluster_flies_the_same_rows_also_when_a_worker_is_killed(
    mission: Mission,
    expected: gs.Campaign,
    scheduler: Any,
    workers: list[subprocess.Popen[bytes]],
    tmp_path: Path,
) -> None:
    def kill(done: int, total: int) -> None:
        if done and workers[0].poll() is None:
            workers[0].send_signal(signal.SIGKILL)

    address = scheduler.scheduler_address
    assert told(flown(mission, tmp_path, cluster=address, progress=kill)) == told(expected)
    assert workers[0].wait() == -signal.SIGKILL


def test_a_cluster_that_does_not_answer_is_refused(
    mission: Mission, scheduler: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(places, "PATIENCE", 0.3)
    for address in ("tcp://127.0.0.1:1", "nowhere", "", scheduler.scheduler_address):
        with pytest.raises(CampaignError, match="must be a scheduler that answers and has workers") as error:
            flown(mission, tmp_path / "out", cluster=address)
        assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_workers_of_another_version_are_refused(scheduler: Any, tmp_path: Path) -> None:
    (tmp_path / "gammastar.py").write_text('__version__ = "0.0.9"\n')
    other = worker(scheduler.scheduler_address, PYTHONPATH=str(tmp_path))
    try:
        until(lambda: len(scheduler.scheduler.workers) == 1)
        with (
            pytest.raises(CampaignError, match=r"workers must have gammastar .* \(got 0.0.9\)"),
            cluster_of(scheduler.scheduler_address, None),
        ):
            raise AssertionError("not reached")
    finally:
        other.kill()
        other.wait()
        until(lambda: not scheduler.scheduler.workers)


def test_a_cluster_speaks_through_errors_alone() -> None:
    """Loggers of Dask, each of which has a level of its own, are silent meanwhile and as before afterwards."""
    logger = logging.getLogger("distributed.client")
    before = logger.level
    with places._silence():
        assert not logger.isEnabledFor(logging.ERROR)
    assert logger.level == before

"""The verb `campaign`, and `fly --from`: text for people, one object for programs, one line for what cannot be."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import gammastar as gs
from gammastar.cli import bars, main
from gammastar.mission import load

ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(gs.__file__).parents[1]), "COLUMNS": "200"}
SHORT = {
    "flight.duration": 0.1,
    "flight.settled_within": 100.0,
    "campaign.vary": [
        {"quantity": "start.attitude", "kind": "any"},
        {"quantity": "truth.mass_scale", "kind": "grid", "choices": [1.0, 1.1, -1.0]},
    ],
}


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("mission") / "mission.toml"
    place.write_text(load("upright").with_values(SHORT).source(), encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def folder(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("campaign") / "out"
    assert main(["campaign", str(file), "--flights", "6", "--out", str(out), "--machine", "casadi"]) == 0
    return out


def run(file: Path, out: Path, *more: str) -> int:
    return main(["campaign", str(file), "--flights", "3", "--out", str(out), "--machine", "casadi", *more])


def test_people_read_what_became_of_the_flights(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(file, tmp_path / "out") == 0
    printed, err = capsys.readouterr()
    lines = printed.splitlines()
    assert err == ""  # nobody looks at a bar in a pipe
    assert lines[0] == load("upright").title
    assert lines[2].startswith("3 flights, 2 settled: 66.67 %, and between 20.77 % and 93.85 % of all such flights do")
    assert lines[3] == "1 did not: refused"
    assert lines[4].startswith("flew 3 in ")
    assert lines[4].endswith(" by casadi")
    assert lines[5] == f"wrote {tmp_path / 'out'}; see gammastar study {tmp_path / 'out'}"


def test_programs_read_one_object_and_a_campaign_goes_on(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for written, flights in ((3, 3), (4, 4)):  # the one part has become longer
        given = [
            "campaign",
            str(file),
            "--flights",
            str(flights),
            "--out",
            str(tmp_path),
            "--machine",
            "casadi",
            "--json",
        ]
        assert main(given) == 0
        told = json.loads(capsys.readouterr().out)
        assert (told["flights"], told["rows_written"], told["parts"]) == (flights, written, 1)
        assert told["share"] == pytest.approx(told["successes"] / flights)
        assert told["interval"][0] < told["share"] < told["interval"][1]
        assert told["causes"] == [{"cause": "refused", "flights": 1, "first": 2}]
        assert (told["machine"], told["seed"], told["out"]) == ("casadi", 0, str(tmp_path))
        assert told["steps_per_s"] > 0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--flights", "0"], "flights must be at least 1"),
        (["--machine", "gpu"], "machine must be one of"),
        (["--workers", "0"], "workers must be at least 1"),
        (["--part", "0"], "flights in a part must be"),
        (["--part", "2", "--out", "{folder}"], "1000 flights in a part"),
        (["--seed", "-1"], "seed must be"),
        (["--set", "campaign.vary.0.kind=anyhow"], "kind must be one of about"),
        (["--set", "path.radius=2", "--out", "{folder}"], "another mission"),
        (["--out", "{file}"], "out must be a folder"),
        (["--out", ""], "out must be a folder"),
    ],
)
def test_what_cannot_be_run_is_one_line(
    file: Path, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    places = {"folder": str(folder), "file": str(file)}
    assert run(file, tmp_path / "out", *(each.format(**places) for each in more)) == 2
    printed, err = capsys.readouterr()
    assert printed == ""
    (line,) = err.splitlines()
    assert line.startswith("error: ")
    assert said in line
    assert not (tmp_path / "out").exists()


def test_a_link_that_leads_nowhere_is_no_place(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """To nowhere, and in a circle."""
    for name, target in (("lost", "nowhere"), ("loop", "loop")):
        (tmp_path / name).symlink_to(tmp_path / target)
        assert run(file, tmp_path / name / "out") == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{tmp_path / name} is a link that leads nowhere" in line


def test_a_library_of_the_end_is_missed_at_the_beginning(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "duckdb", None)
    assert run(file, tmp_path / "out") == 2
    assert "needs duckdb (not installed); run: pip install 'gammastar[campaign]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_mission_without_a_campaign_says_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campaign", "upright", "--flights", "3", "--out", str(tmp_path / "out")]) == 2
    assert "say in [[campaign.vary]] what varies" in capsys.readouterr().err


def test_an_interrupt_says_how_to_go_on(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C while flights are in the air: one line, and the command that it names goes on."""

    class Interrupting:
        def __enter__(self) -> Any:
            return lambda done, total: os.kill(os.getpid(), signal.SIGINT) if done else None

        def __exit__(self, *_: object) -> None:
            pass

    with monkeypatch.context() as patch:
        patch.setattr(bars, "flights", Interrupting)
        assert run(file, tmp_path) == 130
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"interrupted; start the same command again to go on: flights that are in {tmp_path} are kept"
    assert run(file, tmp_path) == 0


def test_a_terminal_shows_rate_and_remaining_time(file: Path, tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    code = """
import time
from gammastar.cli import bars
with bars.flights() as draw:
    draw(100, 1000)
    time.sleep(0.2)
    draw(200, 1000)
    time.sleep(0.3)
"""
    subprocess.run([sys.executable, "-c", code], stderr=theirs, env=ENVIRONMENT | {"TERM": "xterm"}, check=True)
    drawn = os.read(ours, 10000).decode()
    os.close(ours)
    os.close(theirs)
    assert "200 of 1000 flights, " in drawn
    assert "s left" in drawn


def test_remaining_time_has_a_unit_of_its_size() -> None:
    assert [bars.remaining(each) for each in (5.2, 90.0, 600.0, 9000.0)] == ["5 s", "90 s", "10.0 min", "2.5 h"]


def test_a_flight_of_a_campaign_is_flown_again_with_its_files(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = gs.Campaign.read(folder).to_pandas().set_index("flight")
    again = ["fly", "--from", str(folder), "--flight", "4", "--no-figures", "--json"]
    assert main([*again, "--out", str(tmp_path)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["same_as_row"] is True
    assert (told["flight"], told["campaign"]) == (4, str(folder))
    assert told["distance_m"]["final"] == pytest.approx(rows["final_distance_m"][4], rel=1e-12)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["flight.parquet", "mission.toml", "summary.json"]
    mission = load(tmp_path / "mission.toml")
    assert mission.file.campaign is None
    assert mission.file.truth.mass_scale == 1.1
    assert mission.fly().distance[-1] == pytest.approx(rows["final_distance_m"][4], rel=1e-6)


def test_another_computer_s_flight_is_told_from_the_row_s(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = gs.Campaign.read(folder).fly(1)
    other = type(found)(found.mission, found.record, found.row, same=False)
    monkeypatch.setattr("gammastar.campaign.run.flown_again", lambda *_: other)
    assert main(["fly", "--from", str(folder), "--flight", "1"]) == 0
    assert "not to the last bit" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--flight", "2"], "refused"),
        (["--flight", "6"], "below the 6 of the campaign"),
        (["--flight", "-1"], "number of a flight must be"),
        ([], "must be named by --from and --flight alone"),
        (["--flight", "1", "upright"], "must be named by --from and --flight alone"),
        (["--flight", "1", "--set", "path.radius=2"], "must be named by --from and --flight alone"),
    ],
)
def test_what_cannot_be_flown_again_is_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    assert main(["fly", "--from", str(folder), *more]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_fly_needs_something_to_fly(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fly"]) == 2
    assert "must have a MISSION" in capsys.readouterr().err
    assert main(["fly", "--from", str(tmp_path), "--flight", "1"]) == 2
    assert "must hold a campaign" in capsys.readouterr().err

"""The verb `tune`: what it prints and writes, what it refuses, and what an interrupt leaves."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from gammastar.campaign.trials import Trials
from gammastar.campaign.tune import Tuner
from gammastar.cli import main, process
from gammastar.mission import load

MISSION = """
title = "onto a line, in noise"

[vehicle]
mass = 0.5
inertia = [3e-3, 3e-3, 5e-3]

[path]
name = "line"

[controller]
poles = -2.5
feedback = "middle"
rate = 100.0

[reference]
kind = "speed"
speed = 0.5

[start]
position = [0.0, 0.5, -1.0]

[noise]
position = { deviation = 1e-2, rate = 100.0 }

[flight]
duration = 2.0
step = 1e-2
settled_within = 0.2
"""
SHORT = ("--machine", "casadi", "--flights", "2", "--evaluations", "8")


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    file = tmp_path / "line.toml"
    file.write_text(MISSION, encoding="utf-8")
    return file


def test_it_prints_what_it_found_and_writes_a_mission_that_flies(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "tuned.toml"
    given = (
        "tune",
        str(mission),
        *SHORT,
        "--cost",
        "settling_time_s",
        "--cost",
        "peak_rate_rad_s=0",
        "--out",
        str(out),
    )
    assert main(given) == 0
    printed = capsys.readouterr()
    assert not printed.err
    lines = printed.out.splitlines()
    assert lines[0] == "onto a line, in noise"
    assert lines[2] == "cost: 1 settling_time_s; means of 2 flights, a failed one counts 10 times"
    assert lines[3] == "8 tunings flown"
    assert any(line.startswith("transverse.frequency  2.5 ") for line in lines)
    assert any("none other surpasses" in line for line in lines)
    assert lines[-2].startswith("the tuning found costs ")
    assert lines[-1] == f"wrote {out}"
    assert out.read_text(encoding="utf-8").startswith("# The tuning found costs ")
    found = load(out)
    assert found.title == load(mission).title
    assert found.law().poles != load(mission).law().poles
    assert main(("fly", str(out), "--json")) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "completed"


def test_json_is_one_object_and_its_keys_of_a_tuning_can_be_set(
    mission: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limit = ("--limit", "max_thrust_N=9", "--limit", "failed")
    assert main(("tune", str(mission), *SHORT, *limit, "--only", "transverse", "--seed", "3", "--json")) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["cost"]["weights"] == {"settling_time_s": 1.0, "peak_rate_rad_s": 0.1}
    assert told["cost"]["limits"] == {"max_thrust_N": 9.0, "failed": 0.0}
    assert (told["evaluations"], told["flights"], told["other_flights"], told["seed"]) == (8, 2, 20, 3)
    low, high = told["saving_interval"]
    assert low < high
    assert [each["name"].split(".")[0] for each in told["tuned"]] == ["transverse"] * 4
    assert told["own"]["controller.poles"]["transverse"] == [-2.5] * 4
    assert told["file"] is None
    least = min(told["front"], key=lambda each: each["settling_time_s"])
    again = load(mission).with_values({"controller.poles": least["controller.poles"]})
    assert again.law().poles["yaw"] == (complex(-2.5),)
    assert set(told["found"]["other"]) == set(told["own"]["searched"])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--evaluations", "0"), "evaluations must be at least 1"),
        (("--flights", "0"), "flights must be at least 1"),
        (("--cost", "time=1"), "a term of a cost must be one of"),
        (("--cost", "settling_time_s=-1"), "weight of settling_time_s must be at least 0"),
        (("--cost", "settling_time_s=fast"), "--cost must have the form term=number"),
        (("--limit", "max_thrust_N=nan"), "limit of max_thrust_N must be finite"),
        (("--only", "pole"), "what is tuned must be one of"),
        (("--failure", "0"), "failure must be at least 1"),
        (("--seed", "-1"), "seed must be at least 0"),
        (("--out", "tuned"), "out must be a file that ends in .toml"),
        (("--out", "nowhere.toml/tuned.toml"), "out must be a folder"),
        (("--set", "integral.pole=0.5"), "put [observer] in place of [integral]"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(
    given: tuple[str, ...],
    said: str,
    mission: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(mission.parent)
    (mission.parent / "nowhere.toml").touch()
    assert main(("tune", str(mission), *given)) == 2
    printed = capsys.readouterr()
    assert not printed.out
    assert said in printed.err
    assert len(printed.err.splitlines()) == 1


def test_what_was_found_is_told_where_it_cannot_be_written(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a disk that has become full meanwhile."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("gammastar.report.place.written", full)
    assert main(("tune", str(mission), *SHORT, "--json", "--out", str(tmp_path / "tuned.toml"))) == 2
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert told["file"] is None
    assert told["evaluations"] == 8
    assert "No space left on device" in printed.err
    assert not (tmp_path / "tuned.toml").exists()


def test_the_mission_itself_is_not_overwritten(mission: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(("tune", str(mission), *SHORT, "--out", str(mission))) == 2
    assert "which holds the mission" in capsys.readouterr().err
    assert mission.read_text(encoding="utf-8") == MISSION


def test_an_interrupt_leaves_the_best_so_far(
    mission: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It comes after the first tunings; judging them takes longer than it takes for one that is not answered to come again."""
    fly, judge, flown = Trials.fly, Tuner.tuned, list[Any]()

    def interrupted(self: Trials, *arguments: Any) -> Any:
        flown.append(self)
        if len(flown) == 2:
            signal.raise_signal(signal.SIGINT)
        return fly(self, *arguments)

    def slow(self: Tuner, *arguments: Any) -> Any:
        time.sleep(0.2)
        return judge(self, *arguments)

    monkeypatch.setattr(process, "AGAIN", 0.1)
    monkeypatch.setattr(Trials, "fly", interrupted)
    monkeypatch.setattr(Tuner, "tuned", slow)
    out = tmp_path / "tuned.toml"
    assert main(("tune", str(mission), *SHORT[:-1], "60", "--out", str(out))) == process.INTERRUPTED
    printed = capsys.readouterr()
    assert "; interrupted after " in printed.out.splitlines()[-2]
    assert printed.err == "interrupted; no file was left half written\n"
    assert load(out).title == load(mission).title

"""The command line: what each verb prints, writes and returns."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

import gammastar
from gammastar.cli import main
from gammastar.mission import load, names, parse

SHORT = ["--set", "flight.duration=0.2"]
ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(gammastar.__file__).parents[1])}
COMMAND = [sys.executable, "-m", "gammastar"]


def run(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> str:
    """Return what a command prints on stdout; stderr must be empty unless it fails."""
    assert main(arguments) == code
    printed = capsys.readouterr()
    assert code or not printed.err
    return printed.out


def one_object(text: str) -> dict[str, Any]:
    """Return the only JSON object of a text; NaN and infinity are no JSON."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    value, end = json.JSONDecoder(parse_constant=refuse).raw_decode(text)
    assert text[end:] == "\n"
    assert isinstance(value, dict)
    return value


def test_no_verb_prints_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    printed = run(capsys)
    for verb in ("fly", "missions", "show", "reproduce", "claims"):
        assert verb in printed


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "--version") == f"gammastar {gammastar.__version__}\n"


def test_missions_lists_every_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert [line.split()[0] for line in run(capsys, "missions").splitlines()] == names()
    listed = one_object(run(capsys, "missions", "--json"))["missions"]
    assert listed == [{"name": name, "title": load(name).title} for name in names()]


def test_vehicles_lists_every_name_with_what_it_can_do(capsys: pytest.CaptureFixture[str]) -> None:
    names_of_vehicles = gammastar.vehicles.names()
    lines = run(capsys, "vehicles").splitlines()
    assert [line.split()[0] for line in lines] == ["name", *names_of_vehicles]
    listed = {row["name"]: row for row in one_object(run(capsys, "vehicles", "--json"))["vehicles"]}
    assert list(listed) == names_of_vehicles
    assert listed["crazyflie"]["thrust_to_weight"] == pytest.approx(1.95, abs=0.01)
    assert listed["cubesat"]["thrust_to_weight"] is None
    row = next(line for line in lines if line.startswith("hummingbird"))
    assert "10.2" in row
    assert row.endswith(listed["hummingbird"]["source"])


def test_one_vehicle_is_printed_with_the_sources_of_its_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "vehicles", "racer") == gammastar.vehicles.preset("racer").text
    assert one_object(run(capsys, "vehicles", "racer", "--json"))["rotors"] == 4
    assert main(["vehicles", "racr"]) == 2
    assert 'did you mean "racer"?' in capsys.readouterr().err


def test_show_prints_a_mission_that_can_be_flown_again(capsys: pytest.CaptureFixture[str]) -> None:
    printed = run(capsys, "show", "helix", "--set", "path.radius=2", "--set", "title=wide")
    again = parse(printed)
    assert again == load("helix").with_values({"path.radius": 2.0, "title": "wide"})
    assert one_object(run(capsys, "show", "helix", "--json")) == load("helix").values()


def test_fly_prints_numbers_and_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    printed = run(capsys, "fly", "upright", *SHORT)
    assert printed.startswith(load("upright").title)
    assert re.search(r"^oracle.max_position_error_m +\d", printed, re.MULTILINE)
    assert re.search(
        r"0.2 s: flew to the end, not settled: \d.* m from the path in the last quarter \(RMS\)\n$", printed
    )


def test_a_flight_that_its_rotors_cannot_follow_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    """Poles that are far too fast: the vehicle tumbles, though no singularity ends the flight."""
    printed = run(capsys, "fly", "hexarotor", "--set", "controller.poles=-40", "--set", "flight.duration=2")
    assert re.search(
        r"\(RMS\); rotors at their limits in \d+% of the flight: lower the speed, or slow the poles", printed
    )


def test_fly_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    flight = one_object(run(capsys, "fly", "upside-down", "--json"))
    assert flight["mission"] == load("upside-down").title
    assert flight["status"] == "completed"
    assert flight["message"] == "flew to the end"
    assert flight["settled"] is True
    assert flight["distance_m"]["max_after_settling"] <= 1e-3
    assert flight["so3_drift"] <= 1e-12
    assert flight["oracle"]["max_position_error_m"] <= 1e-8
    assert flight["thrust_N"]["min"] > 0
    assert 12 < flight["peak_rate_rad_s"] < 14  # the design's closed form: 13 rad/s for poles at -2.5
    assert 0 < flight["start_attitude_distance"] < 1e-4
    assert flight["versions"]["gammastar"] == gammastar.__version__


def test_numbers_that_do_not_exist_are_null(capsys: pytest.CaptureFixture[str]) -> None:
    flight = one_object(run(capsys, "fly", "upright", "--json", *SHORT))
    assert flight["settled"] is False
    assert flight["settling_time_s"]["predicted"] is None
    assert flight["distance_m"]["max_after_settling"] is None


def test_a_flight_that_ends_early_returns_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Level and 100 m straight above its point: the law asks for more downward acceleration than gravity gives."""
    changes = {
        "path": "{name = 'line'}",
        "reference": "{kind = 'point', coordinate = 0}",
        "start.position": "[0, 0, -100]",
    }
    arguments = ["fly", "helix", "--set", "frame=ned", "--out", str(tmp_path), "--no-figures"]
    for key, value in changes.items():
        arguments += ["--set", f"{key}={value}"]
    assert main([*arguments, "--json"]) == 1
    printed = capsys.readouterr()
    flight = one_object(printed.out)
    assert flight["status"] == "free_fall"
    assert 0 < flight["end_time_s"] < 1
    assert one_object((tmp_path / "summary.json").read_text())["status"] == "free_fall"
    assert len(printed.err.splitlines()) == 1
    assert flight["message"] in printed.err
    assert main(arguments) == 1
    printed = capsys.readouterr()
    assert "free_fall" in printed.out
    assert flight["message"] not in printed.out  # it stands on standard error, once
    assert flight["message"] in printed.err


def test_out_holds_the_flight(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "deep" / "out"
    printed = run(capsys, "fly", "helix", "--out", str(out), "--no-figures", *SHORT)
    assert "flight.parquet, mission.toml, summary.json" in printed
    assert sorted(file.name for file in out.iterdir()) == ["flight.parquet", "mission.toml", "summary.json"]
    table = parquet.read_table(out / "flight.parquet")
    record = load("helix").with_values({"flight.duration": 0.2}).fly()
    assert np.array_equal(table["time_s"], record.time)
    assert np.array_equal(table["position_z"], -record.position[:, 2])  # helix is a mission in enu
    assert table.schema.metadata[b"frame"] == b"enu"
    assert parse(table.schema.metadata[b"mission"].decode()) == load(out / "mission.toml")
    assert one_object((out / "summary.json").read_text())["frame"] == "enu"


def test_a_written_mission_flies_the_same_bytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Same mission, same seed, same files: a folder's mission.toml gives the folder again."""
    pytest.importorskip("pyarrow")
    run(capsys, "fly", "noisy", "--out", str(tmp_path / "one"), "--no-figures", "--set", "flight.seed=5")
    run(capsys, "fly", str(tmp_path / "one" / "mission.toml"), "--out", str(tmp_path / "two"), "--no-figures")
    run(capsys, "fly", "noisy", "--out", str(tmp_path / "three"), "--no-figures", "--set", "flight.seed=6")
    for file in (tmp_path / "one").iterdir():
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes()
        assert file.read_bytes() != (tmp_path / "three" / file.name).read_bytes()


def test_out_replaces_its_files_and_leaves_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pyarrow")
    (tmp_path / "mine.txt").write_text("kept")
    (tmp_path / "summary.json").write_text("old")
    files = one_object(run(capsys, "fly", "upright", "--out", str(tmp_path), "--no-figures", "--json", *SHORT))["files"]
    assert sorted(files) == sorted(str(file) for file in tmp_path.iterdir() if file.name != "mine.txt")
    assert (tmp_path / "mine.txt").read_text() == "kept"
    assert one_object((tmp_path / "summary.json").read_text())["status"] == "completed"


def test_out_holds_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    run(capsys, "fly", "upright", "--out", str(tmp_path), *SHORT)
    drawn = {file.name for file in tmp_path.iterdir()} - {"flight.parquet", "mission.toml", "summary.json"}
    assert drawn == {
        f"{name}.{kind}"
        for name in ("path", "states", "velocities", "rates", "inputs", "margins")
        for kind in ("png", "svg")
    }
    assert (tmp_path / "path.png").read_bytes().startswith(b"\x89PNG")


def test_a_folder_that_cannot_be_completed_is_not_begun(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full while the last file is written: none of them appears, and what was there stays."""
    from gammastar.report import folder

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device", "flight.parquet")

    monkeypatch.setattr(folder, "_write_rows", fail)
    (tmp_path / "summary.json").write_text("old")
    assert main(["fly", "upright", "--out", str(tmp_path), "--no-figures", *SHORT]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert [file.name for file in tmp_path.iterdir()] == ["summary.json"]
    assert (tmp_path / "summary.json").read_text() == "old"


def test_a_missing_library_names_its_extra_before_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setattr("gammastar.mission.Mission.fly", lambda *_: pytest.fail("flew first"))
    assert main(["fly", "upright", "--out", str(tmp_path / "out")]) == 2
    assert "gammastar[data]" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_reproduce_draws_into_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it draws is tested where it is drawn; here that the verb hands over the folder and prints page, verdicts, numbers."""
    from gammastar.report import reproduce

    figures = [{"verdict": verdict} for verdict in ("holds", "holds in part", "holds")]
    monkeypatch.setattr(
        reproduce, "reproduce", lambda out, progress: {"figures": figures, "worst": float("nan"), "out": out.name}
    )
    printed = run(capsys, "reproduce", "--out", str(tmp_path))
    assert "3 figures" in printed
    assert "2 holds, 1 holds in part" in printed
    assert str(tmp_path / "index.html") in printed
    numbers = one_object(run(capsys, "reproduce", "--out", str(tmp_path), "--json"))
    assert numbers == {"figures": figures, "worst": None, "out": tmp_path.name}
    (tmp_path / "file").touch()
    assert main(["reproduce", "--out", str(tmp_path / "file")]) == 2
    assert "out must be a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("trouble", "code", "words"),
    [
        (MemoryError(), 2, "memory"),
        (OSError(5, "Input/output error"), 2, "input/output error"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_trouble_on_the_way_is_one_line(
    trouble: BaseException, code: int, words: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise trouble

    monkeypatch.setattr("gammastar.mission.Mission.fly", fail)
    assert main(["fly", "upright"]) == code
    printed = capsys.readouterr()
    (line,) = printed.err.splitlines()
    assert words in line.lower()
    assert printed.out == ""


def test_claims_fail_when_one_does(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from gammastar import claims

    def claim(verdict: claims.Verdict) -> claims.Claim:
        correction = "the other sign" if verdict is claims.Verdict.FALSE else ""
        finding = claims.Finding(verdict, claims.Method.EXACT, f"seen [{verdict}]", correction)
        return claims.Claim(f"({verdict})", "VI-Z", f"1 = {len(verdict)}", lambda: finding)

    good, wrong, broken = map(claim, (claims.Verdict.HOLDS, claims.Verdict.FALSE, claims.Verdict.FAILED))
    monkeypatch.setattr(claims, "all_claims", lambda: (good, wrong))
    printed = run(capsys, "claims")
    assert "1 holds, 1 false" in printed
    assert "1 = 5" in printed
    assert "VI-Z" in printed
    assert "seen [holds]" in printed
    assert "the other sign" in printed
    listed = one_object(run(capsys, "claims", "--json"))
    assert [each["verdict"] for each in listed["claims"]] == ["holds", "false"]
    monkeypatch.setattr(claims, "all_claims", lambda: (good, broken))
    assert one_object(run(capsys, "claims", "--json", code=1))["verdicts"]["failed"] == 1


def started(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *arguments], capture_output=True, text=True, env=ENVIRONMENT, timeout=120, check=False, **options
    )


def test_a_cold_start_flies_the_recovery_quickly() -> None:
    """How quickly is printed by benchmarks/start_up.py; here, that it loads nothing it does not need."""
    answer = started("fly", "upside-down", "--json")
    assert answer.returncode == 0
    assert answer.stderr == ""
    assert one_object(answer.stdout)["settled"]


def test_a_terminal_shows_progress_and_a_pipe_does_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from gammastar.cli import bars

    with bars.progress("flying") as draw:
        assert draw is None
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with bars.progress("flying") as draw:
        assert draw is not None
        draw(1, 2)
    with bars.counter("checking", 2) as count:
        assert count is not None
        count("a result")
    assert capsys.readouterr().out == ""


def test_no_help_has_words_in_brackets_which_would_be_taken_for_markup() -> None:
    from gammastar.cli.verbs import app

    verbs = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    assert {"fly", "campaign", "study", "tune", "export"} <= set(verbs)
    for name, verb in verbs.items():
        for text in [verb.help, *(parameter.help for parameter in verb.params if hasattr(parameter, "help"))]:
            assert not re.search(r"\[[a-z]", text or ""), (name, text)

"""Bad missions and bad command lines: exit code 2, and one sentence on stderr that names the key and says what to do."""

import os
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import tomli_w

import gammastar
from gammastar.cli import main

NAN, INF = float("nan"), float("inf")
IDENTITY = np.eye(3)
GOOD: dict[str, Any] = {
    "title": "good",
    "frame": "ned",
    "vehicle": {"mass": 0.5, "inertia": [0.004, 0.004, 0.007]},
    "path": {"name": "circle", "kind": "implicit"},
    "controller": {"feedback": "middle", "rate": 100},
    "reference": {"kind": "speed", "speed": 1},
    "start": {"position": [1.5, 0, 0.2]},
    "truth": {"mass_scale": 1.01},
    "noise": {"position": {"deviation": 0.01, "rate": 5}},
    "flight": {"duration": 0.05},
}


class Missing:
    """Stands for a key that is left out."""


class Bad(NamedTuple):
    changes: dict[str, Any]  # of GOOD, by dotted key
    words: tuple[str, ...]  # that the sentence has


MISSIONS = {
    # types
    "text for a number": Bad({"vehicle.mass": "heavy"}, ("[vehicle] mass", "without quotes")),
    "quoted number": Bad({"path.radius": "2"}, ("[path] radius", '"2"', "without quotes")),
    "boolean for a number": Bad({"vehicle.gravity": True}, ("[vehicle] gravity", "got true")),
    "boolean in a list": Bad({"start.position": [1, True, 0]}, ("[start] position", "got true")),
    "text for a list": Bad({"start.position": "here"}, ("[start] position", '"here"')),
    "number for text": Bad({"title": 3}, ("title", "text", "quotes")),
    "number for a name": Bad({"frame": 3}, ("frame", "ned")),
    "list for a number": Bad({"reference.speed": [1, 2]}, ("[reference] speed", "number")),
    "number for a list": Bad({"start.velocity": 1.0}, ("[start] velocity", "(3,)")),
    "fraction for a seed": Bad({"flight.seed": 1.5}, ("[flight] seed", "whole number")),
    "negative seed": Bad({"flight.seed": -1}, ("[flight] seed", "whole number")),
    "boolean for laps": Bad(
        {"reference": {"kind": "stop", "speed": 1, "coordinate": 1, "braking_time": 1, "laps": True}},
        ("[reference] laps", "whole number"),
    ),
    "number for a section": Bad({"vehicle": 3}, ("[vehicle]", "table")),
    "list for a section": Bad({"controller": [1]}, ("[controller]", "table")),
    "text for a path": Bad({"path": "circle"}, ("[path]", '"name"')),
    "list of rows too deep": Bad({"vehicle.inertia": [[[1]]]}, ("[vehicle] inertia", "numbers")),
    "integer beyond floats": Bad({"vehicle.mass": 10**400}, ("[vehicle] mass", "range of floats")),
    "two numbers for three": Bad({"start.position": [1, 2]}, ("[start] position", "(3,)")),
    # unknown keys, one in each section
    "unknown section": Bad({"contoller.rate": 1}, ('"contoller"', 'did you mean "controller"')),
    "unknown top key": Bad({"titel": "x"}, ('"titel"', 'did you mean "title"')),
    "unknown in vehicle": Bad({"vehicle.inertias": 1}, ("[vehicle]", 'did you mean "inertia"')),
    "unknown in path": Bad({"path.radus": 1}, ("[path]", 'did you mean "radius"')),
    "argument of another path": Bad({"path.pitch": 1}, ("[path]", '"pitch"', "known are", "radius")),
    "unknown in controller": Bad({"controller.pole": -1}, ("[controller]", 'did you mean "poles"')),
    "unknown chain": Bad({"controller.poles": {"transvers": -1}}, ("[controller.poles]", 'did you mean "transverse"')),
    "unknown in reference": Bad({"reference.sped": 1}, ("[reference]", 'did you mean "speed"')),
    "unknown in start": Bad({"start.postion": 1}, ("[start]", 'did you mean "position"')),
    "unknown in truth": Bad({"truth.mass": 1}, ("[truth]", '"mass"', "known are", "mass_scale")),
    "unknown in noise": Bad({"noise.speed.rate": 1}, ("[noise]", '"speed"', "velocity")),
    "unknown in a channel": Bad({"noise.position.std": 1}, ("[noise.position]", '"std"', "deviation")),
    "unknown in flight": Bad({"flight.duraton": 1}, ("[flight]", 'did you mean "duration"')),
    # missing keys
    "no vehicle": Bad({"vehicle": Missing}, ("[vehicle]", "add it")),
    "no mass": Bad({"vehicle.mass": Missing}, ("[vehicle]", '"mass"', "add it")),
    "no path name": Bad({"path.name": Missing}, ("[path]", '"name"', "circle", "add it")),
    "no reference kind": Bad({"reference.kind": Missing}, ("[reference]", '"kind"', "speed", "add it")),
    "no speed": Bad({"reference.speed": Missing}, ("[reference]", '"speed"', "add it")),
    "no position": Bad({"start.position": Missing}, ("[start]", '"position"', "add it")),
    # unknown names
    "unknown frame": Bad({"frame": "neu"}, ("frame", "ned", "enu")),
    "unknown path": Bad({"path.name": "cirle"}, ("[path] name", 'did you mean "circle"')),
    "unknown kind of path": Bad({"path.kind": "explicit"}, ("[path] kind", "implicit")),
    "unknown reference": Bad({"reference.kind": "sped"}, ("[reference] kind", 'did you mean "speed"')),
    "unknown integrator": Bad({"flight.integrator": "rkmk"}, ("[flight] integrator", "rkmk4")),
    "unknown feedback": Bad({"controller.feedback": "midle"}, ("[controller] feedback", 'did you mean "middle"')),
    "unknown yaw output": Bad({"controller.yaw_output": "cosh"}, ("[controller] yaw_output", "sinh")),
    # numbers
    "NaN": Bad({"vehicle.mass": NAN}, ("[vehicle] mass", "finite")),
    "infinity": Bad({"flight.duration": INF}, ("[flight] duration", "finite")),
    "NaN in a list": Bad({"start.position": [0, NAN, 0]}, ("[start] position", "finite")),
    "negative mass": Bad({"vehicle.mass": -0.1}, ("[vehicle] mass", "greater than 0", "raise it")),
    "zero mass": Bad({"vehicle.mass": 0}, ("[vehicle] mass", "greater than 0")),
    "negative gravity": Bad({"vehicle.gravity": -9.8}, ("[vehicle] gravity", "at least 0")),
    "asymmetric inertia": Bad(
        {"vehicle.inertia": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, ("[vehicle] inertia", "symmetric")
    ),
    "indefinite inertia": Bad({"vehicle.inertia": [1, 1, -1]}, ("[vehicle] inertia", "positive definite")),
    "impossible inertia": Bad({"vehicle.inertia": [1, 1, 3]}, ("[vehicle] inertia", "triangle inequality")),
    "inertia of two moments": Bad({"vehicle.inertia": [1, 1]}, ("[vehicle] inertia", "3 moments")),
    "zero radius": Bad({"path.radius": 0}, ("[path] radius", "greater than 0")),
    "no normal": Bad({"path.normal": [0, 0, 0]}, ("[path] normal", "zero")),
    "zero pitch": Bad({"path": {"name": "helix", "pitch": 0}}, ("[path] pitch", "greater than 0")),
    "no direction": Bad({"path": {"name": "line", "along": [0, 0, 0]}}, ("[path] along", "zero")),
    "flat ellipse": Bad({"path": {"name": "ellipse", "semi_axes": [1, 0]}}, ("[path] semi-axis", "greater than 0")),
    "zero duration": Bad({"flight.duration": 0}, ("[flight] duration", "greater than 0")),
    "negative step": Bad({"flight.step": -1e-3}, ("[flight] step", "greater than 0")),
    "zero tolerance": Bad({"flight.settled_within": 0}, ("[flight] settled_within", "greater than 0")),
    "zero mass scale": Bad({"truth.mass_scale": 0}, ("[truth] mass_scale", "greater than 0")),
    "negative inertia scale": Bad({"truth.inertia_scale": [1, -1, 1]}, ("[truth] inertia_scale", "positive")),
    "impossible true inertia": Bad({"truth.inertia_scale": [1, 1, 9]}, ("[truth] inertia", "triangle inequality")),
    # poles
    "unstable poles": Bad({"controller.poles": [1, -2, -3, -4]}, ("[controller] poles", "negative real parts")),
    "poles at zero": Bad({"controller.poles": 0}, ("[controller] poles", "negative real parts")),
    "unpaired complex pole": Bad(
        {"controller.poles": [[-2, 1], -2, -3, -4]}, ("[controller] complex poles", "conjugate")
    ),
    "too few poles": Bad({"controller.poles": [-1, -2, -3]}, ("[controller] transverse poles", "4")),
    "too many yaw poles": Bad({"controller.poles": {"yaw": [-1, -2]}}, ("[controller] yaw poles", "1")),
    "pole of three numbers": Bad({"controller.poles": [[-1, 1, 1], -2, -3, -4]}, ("[controller]", "[re, im]")),
    "poles as text": Bad({"controller.poles": "-2+1j"}, ("[controller] poles", "numbers")),
    "infinite pole": Bad({"controller.poles": -INF}, ("[controller] poles", "finite")),
    "second chain on a curve": Bad(
        {"path.kind": "curve", "controller.poles": {"transverse_2": -2}}, ("[controller] transverse_2", "implicit")
    ),
    # attitude
    "reflected attitude": Bad(
        {"start.attitude": (IDENTITY * [1, 1, -1]).tolist()}, ("[start] attitude", "reflects", "determinant +1")
    ),
    "scaled attitude": Bad({"start.attitude": (1.1 * IDENTITY).tolist()}, ("[start] attitude", "orthonormal")),
    "attitude of zeros": Bad({"start.attitude": (0 * IDENTITY).tolist()}, ("[start] attitude", "orthonormal")),
    "attitude of two rows": Bad({"start.attitude": IDENTITY[:2].tolist()}, ("[start] attitude", "(3, 3)")),
    "ragged attitude": Bad({"start.attitude": [[1, 0, 0], [0, 1], [0, 0, 1]]}, ("[start] attitude", "(3, 3)")),
    "two attitudes": Bad(
        {"start.attitude": IDENTITY.tolist(), "start.roll": 1}, ("[start]", "attitude", "roll", "once")
    ),
    "quaternion and angle": Bad({"start.quaternion": [1, 0, 0, 0], "start.yaw": 1}, ("[start]", "quaternion", "yaw")),
    "zero quaternion": Bad({"start.quaternion": [0, 0, 0, 0]}, ("[start]", "quaternion", "normalise")),
    "quaternion of three": Bad({"start.quaternion": [1, 0, 0]}, ("[start] quaternion", "(4,)")),
    # where the law is singular
    "start on the axis": Bad({"start.position": [0, 0, 1]}, ("[start]", "nearest point", "move it")),
    "start at the centre of a curve": Bad(
        {"path.kind": "curve", "start.position": [0, 0, 0]}, ("[start]", "nearest point", "move it")
    ),
    "no thrust": Bad({"start.thrust": 0}, ("[start] thrust", "positive", "start with thrust")),
    "negative thrust": Bad({"start.thrust": -1}, ("[start] thrust", "positive")),
    "no gravity and no thrust": Bad({"vehicle.gravity": 0}, ("[start] thrust", "positive")),
    # together
    "rate of continuous feedback": Bad(
        {"controller.feedback": "continuous", "noise": Missing}, ("[controller]", "no control rate")
    ),
    "no rate for sampled feedback": Bad(
        {"controller.rate": Missing, "noise": Missing}, ("[controller]", "control rate", "give one")
    ),
    "noise without control rate": Bad(
        {"controller.feedback": "continuous", "controller.rate": Missing}, ("[noise]", "[controller]", "rate")
    ),
    "noise without sensor rate": Bad({"noise.position.rate": Missing}, ("[noise.position]", '"rate"', "add it")),
    "noise at zero rate": Bad({"noise.position.rate": [5, 0, 5]}, ("[noise.position]", "rate", "greater than 0")),
    "negative noise": Bad({"noise.position.deviation": -1}, ("[noise.position]", "deviation", "at least 0")),
    "steps far shorter than an interval": Bad({"flight.step": 1e-9}, ("[controller]", "steps", "raise the step")),
    "stop behind the start": Bad(
        {
            "path": {"name": "line"},
            "reference": {"kind": "stop", "speed": 1, "coordinate": -5, "braking_time": 1},
        },
        ("[reference]", "ahead", "move it"),
    ),
    "stop without speed": Bad(
        {"reference": {"kind": "stop", "speed": 0, "coordinate": 1, "braking_time": 1}}, ("[reference]", "not be zero")
    ),
}
FILES: dict[str, tuple[bytes, tuple[str, ...]]] = {
    "empty file": (b"", ("[vehicle]", "add it")),
    "broken TOML": (b"[vehicle\nmass = 1\n", ("TOML", "line 1", "correct")),
    "key twice": (b"title = 'a'\ntitle = 'b'\n", ("TOML", "line 2", "correct")),
    "JSON": (b'{"vehicle": {"mass": 1}}', ("TOML", "line 1")),
    "binary junk": (bytes(range(256)), ("UTF-8", "save it")),
    "zeros": (b"\0" * 1000, ("TOML", "correct")),
    "UTF-16": ("title = 'a'".encode("utf-16"), ("UTF-8", "save it")),
    "deep nesting": (b"a = " + b"[" * 100_000, ("TOML", "nested too deeply")),
    "endless number": (b"a = " + b"1" * 10_000, ("TOML", "correct")),
    "far too long": (b"#" * 11_000_000, ("bytes", "right file")),
}
COMMANDS = {
    "unknown mission": (["fly", "upside-dwn"], ("upside-dwn", 'did you mean "upside-down"')),
    "unknown mission to show": (["show", "nothing"], ("nothing", "upright")),
    "no file of that name": (["fly", "nothing.toml"], ("nothing.toml", "no such file", "give the path")),
    "a folder": (["fly", "."], ("a directory", "give the path")),
    "set without a value": (["fly", "upright", "--set", "path.radius"], ("--set", "key=value", "path.radius")),
    "set without a key": (["fly", "upright", "--set", "=3"], ("--set", "key=value")),
    "set an unknown key": (["fly", "upright", "--set", "path.radus=3"], ("[path]", 'did you mean "radius"')),
    "set an unknown section": (["fly", "upright", "--set", "pth.radius=3"], ('"pth"', 'did you mean "path"')),
    "set inside a number": (["fly", "upright", "--set", "path.radius.x=3"], ("path.radius", "table", "as a whole")),
    "set a wrong value": (["show", "upright", "--set", "path.radius=wide"], ("[path] radius", '"wide"')),
    "set a key without end": (["fly", "upright", "--set", f"path{200_000 * '.'}=1"], ("--set", "levels")),
    "set a key of long words": (["fly", "upright", "--set", f"path.{200_000 * 'a'}=1"], ("unknown key", "[path]")),
    "set words without end": (["fly", "upright", "--set", 200_000 * "a"], ("--set", "key=value")),
    "a name without end": (["fly", 200_000 * "a"], ("aaa",)),
    "letters of a terminal": (["fly", "\x1b[31mred.toml"], ("x1b[31mred.toml",)),
    "a device": (["fly", os.devnull], ("a pipe or device", "give the path")),
    "out without a name": (["fly", "upright", "--out", ""], ("out must be a folder", '""')),
    "figures without a name": (["reproduce", "--out", ""], ("out must be a folder", '""')),
    "set a date": (["show", "upright", "--set", "flight.duration=2026-01-01"], ("[flight] duration", "number")),
    "unknown verb": (["fyl"], ("fyl", "--help")),
    "unknown option": (["fly", "upright", "--loud"], ("--loud", "--help")),
    "no mission": (["fly"], ("MISSION", "gammastar missions")),
    "huge duration": (["fly", "upright", "--set", "flight.duration=1e12"], ("rows", "shorten")),
    "two missions": (["fly", "upright", "loop"], ("loop", "--help")),
    "option without a value": (["fly", "upright", "--out"], ("--out", "--help")),
}


def refusal(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one sentence with which a command line is refused."""
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    (sentence,) = printed.err.splitlines()
    check_sentence(sentence)
    return sentence


def check_sentence(sentence: str) -> None:
    assert sentence.startswith("error: ")
    assert len(sentence) < 1000
    assert sentence.isprintable()
    assert "Traceback" not in sentence
    assert "validation error" not in sentence
    assert ";" in sentence or "must be one of" in sentence  # what to do


def bad_mission(changes: dict[str, Any]) -> str:
    """Return GOOD with some values changed, as TOML."""
    values = {key: dict(value) if isinstance(value, dict) else value for key, value in GOOD.items()}
    values["noise"] = {name: dict(channel) for name, channel in GOOD["noise"].items()}
    for key, value in changes.items():
        *sections, name = key.split(".")
        table = values
        for section in sections:
            table = table.setdefault(section, {})
        if value is Missing:
            del table[name]
        else:
            table[name] = value
    return tomli_w.dumps(values)


def test_there_are_enough_bad_missions() -> None:
    assert len(MISSIONS) + len(FILES) + len(COMMANDS) >= 40


def test_what_they_are_made_from_is_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "good.toml"
    file.write_text(bad_mission({}))
    assert main(["fly", str(file)]) == 0
    assert "flew to the end" in capsys.readouterr().out


@pytest.mark.parametrize("case", MISSIONS)
def test_a_bad_mission_is_refused_in_one_sentence(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Flown or only shown: a mission is checked before anything is done with it."""
    file = tmp_path / "bad.toml"
    file.write_text(bad_mission(MISSIONS[case].changes))
    for verb in ("fly", "show"):
        sentence = refusal([verb, str(file)], capsys)
        assert [word for word in MISSIONS[case].words if word not in sentence] == [], sentence
        assert "bad.toml" in sentence


@pytest.mark.parametrize("case", FILES)
def test_a_bad_file_is_refused_in_one_sentence(case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, words = FILES[case]
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    sentence = refusal(["fly", str(file)], capsys)
    assert [word for word in words if word not in sentence] == [], sentence
    assert "bad.toml" in sentence


@pytest.mark.parametrize("case", COMMANDS)
def test_a_bad_command_is_refused_in_one_sentence(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments, words = COMMANDS[case]
    sentence = refusal(arguments, capsys)
    assert [word for word in words if word not in sentence] == [], sentence


def test_several_mistakes_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(bad_mission({"vehicle.mass": "a", "flight.step": "b", "path.radius": "c"}))
    sentence = refusal(["fly", str(file)], capsys)
    assert "[vehicle] mass" in sentence
    assert "2 more" in sentence


def test_a_file_where_the_folder_should_be_is_refused_before_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gammastar.mission.Mission.fly", lambda *_: pytest.fail("flew first"))
    (tmp_path / "file").write_text("mine")
    for out in ("file", "file/below"):
        sentence = refusal(["fly", "upright", "--out", str(tmp_path / out)], capsys)
        assert "out must be a folder" in sentence
    assert (tmp_path / "file").read_text() == "mine"


def test_a_pipe_is_refused_before_anyone_waits_for_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    assert "a pipe or device" in refusal(["fly", str(tmp_path / "pipe.toml")], capsys)


@pytest.mark.parametrize("name", ["path.svg", "mission.toml"])
def test_a_folder_where_a_file_should_be_is_refused_before_the_flight(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gammastar.mission.Mission.fly", lambda *_: pytest.fail("flew first"))
    (tmp_path / name).mkdir()
    sentence = refusal(["fly", "upright", "--out", str(tmp_path)], capsys)
    assert f"{name} must be a file" in sentence
    assert [file.name for file in tmp_path.iterdir()] == [name]
    (tmp_path / "index.html").mkdir()
    assert "index.html must be a file" in refusal(["reproduce", "--out", str(tmp_path)], capsys)


@pytest.mark.parametrize("name", ["mission.toml", "summary.json"])
def test_the_mission_to_fly_is_never_replaced(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).write_text(bad_mission({}))
    sentence = refusal(["fly", str(tmp_path / name), "--out", str(tmp_path)], capsys)
    assert "holds the mission to fly" in sentence
    assert (tmp_path / name).read_text() == bad_mission({})


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="this user may write anywhere")
def test_a_closed_folder_is_refused_before_the_flight(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    assert "can be written" in refusal(["fly", "upright", "--out", str(tmp_path / "out")], capsys)


@pytest.mark.parametrize("case", ["broken TOML", "binary junk"])
def test_the_installed_command_refuses_likewise(case: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(FILES[case][0])
    answer = subprocess.run(
        [sys.executable, "-m", "gammastar", "fly", "bad.toml"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(Path(gammastar.__file__).parents[1])},
        check=False,
    )
    assert answer.returncode == 2
    assert answer.stdout == ""
    (sentence,) = answer.stderr.splitlines()
    check_sentence(sentence)

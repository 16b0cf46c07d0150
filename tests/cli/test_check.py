"""The verb `check`, and the certificate that `fly` asks for first."""

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from gammastar.cli import main
from gammastar.mission import load, names

FALLING = ["loop", "--set", "reference.speed=2.2143"]  # sqrt(g / r): weightless at the top


def answered(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Return exit code, stdout and stderr of a command."""
    code = main(arguments)
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def answered_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    code, out, _ = answered(capsys, *arguments, "--json")
    return code, json.loads(out)


@pytest.mark.parametrize("name", names())
def test_every_built_in_mission_is_flyable(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = answered(capsys, "check", name)
    assert (code, err) == (0, "")
    assert out.startswith(load(name).title)
    assert "\nflyable at" in out


def test_the_table_shows_values_limits_and_places(capsys: pytest.CaptureFixture[str]) -> None:
    """The loop of 2 m at 2.2 rad/s: thrust nearly vanishes at the top, half of its length along, 6 m above the origin."""
    code, out, _ = answered(capsys, "check", "loop", "--set", "reference.speed=2.2")
    assert code == 1
    rows = {line[:18].strip(): line.split() for line in out.splitlines()}
    for row in ("regular", "smooth", "length", "self-distance", "curvature", "tube radius", "largest speed"):
        assert row in rows
    assert "FAILS" in rows["specific thrust"]
    assert rows["specific thrust"][-5:] == ["3.142", "6.283", "0,", "0,", "-6"]
    assert rows["most thrust"][-3:] == ["0,", "0,", "-2"]
    assert "not flyable at 2.2 parameter/s (4.4 m/s):" in out
    assert "fly at most 2.15" in out


def test_json_is_the_certificate(capsys: pytest.CaptureFixture[str]) -> None:
    code, data = answered_json(capsys, "check", "loop")
    assert code == 0
    expected = load("loop").certify().as_dict()
    assert {key: data[key] for key in expected} == expected
    assert (data["mission"], data["frame"], data["files"]) == (load("loop").title, "ned", [])


@pytest.mark.parametrize(("frame", "top"), [("ned", -6), ("enu", 12)])
def test_points_are_in_the_frame_that_is_named(frame: str, top: float, capsys: pytest.CaptureFixture[str]) -> None:
    """The loop's centre is at z = -4 in `ned`; in `enu` it is put at 10; its top is 2 m above either."""
    center = ["--set", "path.center=[0,0,10]", "--set", "start.position=[0,0.3,6]"] if frame == "enu" else []
    arguments = [*FALLING, "--set", f"frame={frame}", *center]
    code, data = answered_json(capsys, "check", *arguments)
    assert (code, data["frame"]) == (1, frame)
    (place,) = (row["place"] for row in data["checks"] if row["name"] == "specific thrust")
    assert place["point_m"] == pytest.approx([0, 0, top], abs=1e-6)
    code, out, _ = answered(capsys, "check", *arguments)
    assert f"point [m], {frame}" in out
    assert f"point 0, 0, {top} m" in out
    code, _, err = answered(capsys, "fly", *arguments)
    assert (code, f"point 0, 0, {top} m" in err) == (2, True)


def test_what_a_speed_takes_is_said_with_the_speed_that_would_do(capsys: pytest.CaptureFixture[str]) -> None:
    code, data = answered_json(capsys, "check", *FALLING)
    assert code == 1
    assert not data["flyable"]
    assert data["free_fall_stretches"]
    assert "fly at most" in data["reasons"][0]
    slower = str(data["largest_speed_per_s"] * 0.999)
    assert answered(capsys, "check", "loop", "--set", f"reference.speed={slower}")[0] == 0


def test_limits_count(capsys: pytest.CaptureFixture[str]) -> None:
    code, data = answered_json(capsys, "check", "loop", "--set", "limits.thrust=5")
    assert code == 1
    assert "thrust must stay within 5 N" in data["reasons"][0]


def test_a_path_that_cannot_be_made_is_not_flyable(capsys: pytest.CaptureFixture[str]) -> None:
    """It is refused before there is anything to certify: the sentence is the whole answer."""
    changes = [
        "--set",
        "path={name = 'waypoints', points = [[0,0,0],[1,0,0],[1,0,0],[2,1,0]]}",
        "--set",
        "start.position=[0,0,0]",
    ]
    code, out, err = answered(capsys, "check", "helix", *changes)
    assert (code, err) == (1, "")
    assert out.startswith("not flyable: [path]")
    code, data = answered_json(capsys, "check", "helix", *changes)
    assert code == 1
    assert (data["flyable"], len(data["reasons"]), data["files"]) == (False, 1, [])


@pytest.mark.parametrize("arguments", [["nothing"], ["loop", "--set", "path.radius=-1"], ["loop", "--out", ""]])
def test_input_that_cannot_be_used_is_no_verdict(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = answered(capsys, "check", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")


def test_out_is_a_picture_or_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, folder = tmp_path / "new" / "loop.v1.svg", tmp_path / "folder"
    assert answered_json(capsys, "check", "loop", "--out", str(file))[1]["files"] == [str(file)]
    assert [each.name for each in file.parent.iterdir()] == ["loop.v1.svg"]
    ElementTree.parse(file)
    _, out, _ = answered(capsys, "check", "loop", "--out", str(folder))
    assert str(folder / "certificate.png") in out
    assert {each.name for each in folder.iterdir()} == {"certificate.png", "certificate.svg", "certificate.json"}
    assert json.loads((folder / "certificate.json").read_text())["flyable"]


@pytest.mark.parametrize("out", ["picture.jpg", "taken.png", "file/below.png", "file/below"])
def test_an_out_that_cannot_be_written_is_refused(out: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken.png").mkdir()
    (tmp_path / "file").touch()
    code, printed, err = answered(capsys, "check", "loop", "--out", str(tmp_path / out))
    assert (code, printed) == (2, "")
    assert " must " in err


def test_fly_refuses_what_its_certificate_refuses(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gammastar.mission.Mission.fly", lambda *_: pytest.fail("flew first"))
    code, out, err = answered(capsys, "fly", *FALLING)
    assert (code, out) == (2, "")
    (sentence,) = err.splitlines()
    assert "specific thrust must stay above" in sentence
    assert "--force" in sentence


def test_the_paths_of_replacements_count(capsys: pytest.CaptureFixture[str]) -> None:
    """The second path alone is too fast: both tables are there, and the sentence names its section."""
    falling = ["replanned", "--set", "replacements.0.path={name = 'loop', radius = 2}"]
    falling += ["--set", "replacements.0.reference.speed=2.2143"]
    code, out, _ = answered(capsys, "check", *falling)
    assert code == 1
    assert "\n\n[replacements.0.path] loop, 12.57 m" in out
    code, data = answered_json(capsys, "check", *falling)
    assert code == 1
    assert (data["flyable"], [each["flyable"] for each in data["replacements"]]) == (False, [False])
    assert data["reasons"][0].startswith("[replacements.0.path] specific thrust must stay above")
    code, _, err = answered(capsys, "fly", *falling)
    assert code == 2
    assert err.startswith("error: [replacements.0.path] specific thrust")
    assert answered_json(capsys, "check", "replanned")[1]["replacements"][0]["path"] == "waypoints"


def test_fly_flies_anything_by_force_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = answered(capsys, "fly", *FALLING, "--force", "--set", "flight.duration=0.1", "--json")
    assert code == 0
    certificate = json.loads(out)["certificate"]
    assert certificate["flyable"] is False
    assert err.startswith("flown all the same: specific thrust")
    assert len(err.splitlines()) == 1


def test_a_flight_carries_its_certificate_in_brief(capsys: pytest.CaptureFixture[str]) -> None:
    code, flight = answered_json(capsys, "fly", "loop", "--set", "flight.duration=0.1")
    assert code == 0
    whole = load("loop").certify().as_dict()
    assert flight["certificate"] == {
        key: whole[key] for key in ("flyable", "reasons", "speed_per_s", "largest_speed_per_s")
    }
    assert flight["certificate"]["flyable"]

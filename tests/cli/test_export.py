"""`gammastar export`: what it writes, prints and refuses."""

import json
import shutil
from pathlib import Path

import pytest

from gammastar.cli import main
from gammastar.export import folder as place

MISSION = ["upright", "--set", "flight.duration=0.05"]


def exported(capsys: pytest.CaptureFixture[str], out: Path, *more: str, code: int = 0) -> str:
    """Return what the verb prints: on stdout, or on stderr where it refuses."""
    assert main(["export", *MISSION, "--out", str(out), *more]) == code
    printed = capsys.readouterr()
    return printed.err if code else printed.out


def test_it_prints_one_object_with_units_in_its_keys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    facts = json.loads(exported(capsys, tmp_path / "a/b", "--real", "float64", "--json"))
    assert (facts["name"], facts["target"], facts["real"], facts["rate_Hz"]) == ("upright", "c99", "float64", 500.0)
    assert facts["state_bytes"] > 14 * 8
    assert sorted(facts["files"]) == sorted(str(file) for file in (tmp_path / "a/b").iterdir())
    kept = json.loads((tmp_path / "a/b" / place.FACTS).read_text())
    assert kept["operations"] == facts["operations"] > 500


def test_an_earlier_export_is_replaced_and_nothing_of_it_stays(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    exported(capsys, out, "--set", "reference.speed=0.5")
    (out / "upright.o").write_text("built")
    before = (out / "upright.c").read_text()
    (out / "upright.c").rename(out / "selftest")  # whatever a build calls so
    exported(capsys, out)
    assert sorted(file.name for file in out.iterdir()) == sorted(json.loads((out / place.FACTS).read_text())["files"])
    assert (out / "upright.c").read_text() != before


def test_the_current_folder_stays_the_current_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        exported(capsys, Path("."))
        assert Path("upright.c").exists()


def test_what_is_not_an_export_is_left_alone(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "mine.c").write_text("int x;")
    assert "which holds mine.c" in exported(capsys, tmp_path, code=2)
    (tmp_path / "export.json").write_text("[]")
    assert "which holds export.json" in exported(capsys, tmp_path, code=2)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["export.json", "mine.c"]
    assert "is a file" in exported(capsys, tmp_path / "mine.c", code=2)
    assert "is a file" in exported(capsys, tmp_path / "mine.c" / "below", code=2)
    assert 'got ""' in exported(capsys, Path("/"), "--out", "", code=2)


@pytest.mark.parametrize("name", ["upright.h", "upright.c", place.FACTS])
def test_a_folder_that_cannot_be_written_whole_is_not_written(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    exported(capsys, out)
    before = {file.name: file.read_bytes() for file in out.iterdir()}
    replace = place.os.replace

    def fails(source: Path, target: Path) -> None:
        if (Path(source).parent.name, Path(source).name) == ("made", name):
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(place.os, "replace", fails)
    assert "No space left" in exported(capsys, out, "--real", "float64", code=2)
    assert {file.name: file.read_bytes() for file in out.iterdir()} == before
    assert [file.name for file in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("moves", [0, 3, 9])
def test_an_export_that_was_killed_is_replaced(
    moves: int, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After any number of its files were moved; what it left under another name goes too, and what is not an export's stays."""
    out, replace, made = tmp_path / "out", place.os.replace, []

    def killed(source: Path, target: Path) -> None:
        made.append(target)
        if len(made) <= moves:
            replace(source, target)
        elif len(made) == moves + 1:
            shutil.copytree(out, tmp_path / "left")  # as the folder would be found

    exported(capsys, out)
    monkeypatch.setattr(place.os, "replace", killed)
    exported(capsys, out)
    monkeypatch.undo()
    left = tmp_path / "left"
    assert any(file.name.startswith(place.WORKBENCH) for file in left.iterdir())
    exported(capsys, left)
    assert sorted(file.name for file in left.iterdir()) == sorted(json.loads((left / place.FACTS).read_text())["files"])


def test_a_folder_with_folders_is_written_over_unless_it_holds_something_else(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    for _ in range(2):
        facts = json.loads(exported(capsys, out, "--target", "crazyflie", "--json"))
        assert (facts["frame"], facts["command"][0]) == ("enu", "force [N]")
        (out / "build").mkdir()
        (out / "build" / "firmware.bin").write_text("")
    (out / "src" / "mine.c").write_text("")
    assert f"which holds {Path('src', 'mine.c')}" in exported(capsys, out, "--target", "crazyflie", code=2)
    assert (out / "src" / "mine.c").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--target", "arm"], "target must be one of"),
        (["--real", "float16"], "real must be one of float32, float64"),
        (["--set", "path.radius=-1"], "radius"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(
    more: list[str], words: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    sentence = exported(capsys, tmp_path / "out", *more, code=2)
    assert words in sentence
    assert sentence.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_line_without_a_folder_names_the_help_of_the_verb(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "quadrotor"]) == 2
    assert capsys.readouterr().err == "error: Missing option '--out'; see gammastar export --help\n"


def test_a_mission_of_several_paths_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["export", "replanned", "--out", str(tmp_path / "out")]) == 2
    assert "an autopilot must have one path" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("2 Wild.Circles.toml", "mission_2_wild_circles"),
        ("selftest.toml", "mission_selftest"),
        ("crazyflie.toml", "mission_crazyflie"),  # whose own C is called so
    ],
)
def test_a_file_gives_its_name_to_what_is_exported(
    file: str, name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["show", "upright"]) == 0
    mission = tmp_path / file
    mission.write_text(capsys.readouterr().out.replace("duration = 20.0", "duration = 0.05"))
    assert main(["export", str(mission), "--out", str(tmp_path / "out")]) == 0
    assert {"selftest.c", f"{name}.c", f"{name}.h"} < {each.name for each in (tmp_path / "out").iterdir()}

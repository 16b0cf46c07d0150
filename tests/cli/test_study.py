"""The verb `study`: text for people, one object for programs, a folder that is whole or not there."""

import json
from pathlib import Path

import pytest

from campaign.rows import COUNT, hummingbird, known, stored
from gammastar.campaign.manifest import Manifest
from gammastar.campaign.store import MANIFEST, Store
from gammastar.cli import main
from gammastar.figures.save import save

NAMES = ("flight", "status", "settled", "settling_time_s", "truth.mass_scale", "start_tilt_deg")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a small campaign whose middle part is missing."""
    rows = {name: known()[name] for name in NAMES}
    return stored(tmp_path_factory.mktemp("campaign"), rows, part=1000, toml=hummingbird().toml(), lost=1).folder


def test_people_read_the_rate_and_what_is_missing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(folder)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.startswith(hummingbird().title)
    assert f"{COUNT - 1000:,} flights of the seed 0; 1,000 are still to be flown" in out
    assert "what success depends on" in out
    assert main(["study", str(folder), "--by", "truth.mass_scale", "--bins", "5"]) == 0
    out = capsys.readouterr().out
    assert "by truth.mass_scale" in out
    assert "what success depends on" not in out


def test_programs_read_one_object(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(folder), "--by", "start.attitude", "--bins", "6", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert list(data["by"]) == ["start_tilt_deg"]
    assert [each["low"] for each in data["by"]["start_tilt_deg"]["bins"]] == [0, 30, 60, 90, 120, 150]
    assert sum(each["flights"] for each in data["by"]["start_tilt_deg"]["bins"]) == data["flights"] == COUNT - 1000
    assert (data["flights_missing"], data["files"]) == (1000, [])


def test_a_folder_holds_the_page_its_numbers_and_its_figures(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "study"
    assert main(["study", str(folder), "--by", "truth.mass_scale", "--out", str(out), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    names = ["index.html", "study.json", "tolerance-truth.mass_scale.png", "tolerance-truth.mass_scale.svg"]
    assert sorted(file.name for file in out.iterdir()) == names
    assert data.pop("files") == [str(out / name) for name in names]
    assert json.loads((out / "study.json").read_text()) == data
    assert 'src="tolerance-truth.mass_scale.png"' in (out / "index.html").read_text()


def test_a_figure_that_fails_leaves_nothing(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import gammastar.figures

    def fail(*given: object) -> None:
        save(*given)  # type: ignore[arg-type]
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(gammastar.figures, "save", fail)
    assert main(["study", str(folder), "--by", "truth.mass_scale", "--out", str(tmp_path / "out")]) == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--by", "truth.mass"], 'did you mean "truth.mass_scale"'),
        (["--bins", "0"], "bins must be at least 1"),
        (["--out", ""], "out must be a folder"),
    ],
)
def test_what_cannot_be_asked_is_refused(
    arguments: list[str], said: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", str(folder), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ")
    assert said in err
    assert err.count("\n") == 1


def test_a_folder_without_flights_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing there, a folder without a campaign, a campaign that has not begun, and a file."""
    (tmp_path / "empty").mkdir()
    Store.opened(tmp_path / "begun", Manifest("", 0, 10, 10, "native", "1"))
    for name, said in {
        "nowhere": f"no {MANIFEST} in it",
        "empty": f"no {MANIFEST} in it",
        "begun": f"must hold flights of the campaign in its {MANIFEST} (got none yet)",
        f"begun/{MANIFEST}": "must be one that a campaign wrote",
    }.items():
        assert main(["study", str(tmp_path / name), "--out", str(tmp_path / "out")]) == 2
        err = capsys.readouterr().err
        assert said in err
        assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()

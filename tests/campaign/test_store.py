"""The folder of a campaign: parts are whole or not there, another campaign is refused, and one that was interrupted goes on."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
from pathlib import Path

import pytest

from gammastar.campaign.lock import LOCK
from gammastar.campaign.manifest import Manifest
from gammastar.campaign.store import MANIFEST, Store, arrow
from gammastar.errors import CampaignError

pyarrow, parquet = arrow()
GIVEN = Manifest(mission="title = 'x'\n", seed=1, flights=25, part=10, machine="native", version="1.0")


def rows(store: Store, part: int) -> object:
    numbers = list(store.manifest.numbers(part))
    return pyarrow.table({"flight": numbers, "value": [0.5 * k for k in numbers]})


def filled(folder: Path, parts: list[int], manifest: Manifest = GIVEN) -> Store:
    store = Store.opened(folder, manifest)
    for part in parts:
        store.write(part, rows(store, part))
    return store


def test_what_is_missing_is_found_and_what_is_there_is_kept(tmp_path: Path) -> None:
    store = filled(tmp_path / "out", [0, 2])
    again = Store.opened(tmp_path / "out", GIVEN)
    assert again.missing() == [1]
    before = store.path(0).stat().st_mtime_ns
    again.write(1, rows(again, 1))
    assert again.missing() == []
    assert store.path(0).stat().st_mtime_ns == before
    assert again.dataset().to_table()["flight"].to_pylist() == list(range(25))


def test_more_flights_go_on_from_those_that_are_there(tmp_path: Path) -> None:
    filled(tmp_path, [0, 1, 2])
    more = Store.opened(tmp_path, dataclasses.replace(GIVEN, flights=45))
    assert more.missing() == [2, 3, 4]
    with pytest.raises(CampaignError, match="at least its 45 flights"):
        Store.opened(tmp_path, GIVEN)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"mission": "title = 'y'\n"}, "another mission"),
        ({"seed": 2}, "seed 1"),
        ({"machine": "casadi"}, "machine 'native'"),
        ({"part": 5}, "10 flights in a part"),
        ({"version": "2.0"}, "gammastar 1.0"),
    ],
)
def test_another_campaign_is_refused(tmp_path: Path, change: dict[str, object], said: str) -> None:
    filled(tmp_path, [0])
    with pytest.raises(CampaignError, match=said):
        Store.opened(tmp_path, dataclasses.replace(GIVEN, **change))  # type: ignore[arg-type]


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(CampaignError, match="other files"):
        Store.opened(tmp_path, GIVEN)
    with pytest.raises(CampaignError, match=f"no {MANIFEST}"):
        Store.read(tmp_path)


BROKEN = ["", "{", "[]", '{"format": 1}', '{"format": 1, "seed": 3}', "\x00", "null", "[" * 100_000]
CHANGES = {
    "flights": [0, -1, "6", 2.5, None, True, 1e300, 10**30],
    "part": [0, "x", None],
    "seed": [-1, None],
    "mission": [None, 3],
    "machine": [None],
    "more": [1],
}
EDITED = [json.dumps(dataclasses.asdict(GIVEN) | {name: value}) for name, values in CHANGES.items() for value in values]


@pytest.mark.parametrize("text", BROKEN + EDITED, ids=range(len(BROKEN + EDITED)))
def test_a_broken_manifest_is_refused_in_one_sentence(tmp_path: Path, text: str) -> None:
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(CampaignError, match="must be one that a campaign wrote") as error:
        Store.read(tmp_path)
    assert str(error.value).count(";") == 1


def test_a_later_format_names_the_version_that_reads_it(tmp_path: Path) -> None:
    (tmp_path / MANIFEST).write_text(json.dumps({"format": 7, "version": "9.1"}))
    with pytest.raises(CampaignError, match=r"format 1 \(got 7\); read it with gammastar 9.1"):
        Store.read(tmp_path)


def test_a_part_that_cannot_be_read_is_flown_again(tmp_path: Path) -> None:
    store = filled(tmp_path, [0, 1, 2])
    store.path(1).write_bytes(store.path(1).read_bytes()[:-9])
    assert store.missing() == [1]


def test_a_part_of_another_campaign_or_place_counts_as_missing(tmp_path: Path) -> None:
    """Copied there by hand: from another place, from another seed, and a table that no campaign wrote."""
    store = filled(tmp_path / "out", [0, 1, 2])
    other = filled(tmp_path / "other", [2], dataclasses.replace(GIVEN, seed=2))
    store.path(1).write_bytes(store.path(0).read_bytes())
    assert store.missing() == [1]
    store.path(2).write_bytes(other.path(2).read_bytes())
    assert store.missing() == [1, 2]
    parquet.write_table(rows(store, 0), store.path(0))
    assert store.missing() == [0, 1, 2]
    with pytest.raises(CampaignError, match="must hold flights"):
        store.dataset()


def test_a_manifest_that_was_edited_has_no_flights(tmp_path: Path) -> None:
    filled(tmp_path, [0, 1, 2])
    (tmp_path / MANIFEST).write_text(dataclasses.replace(GIVEN, mission="title = 'y'\n").text())
    store = Store.read(tmp_path)
    assert store.held() == {}
    assert store.row(3) is None
    (tmp_path / MANIFEST).write_text(dataclasses.replace(GIVEN, flights=12).text())
    assert Store.read(tmp_path).held() == {0: 10, 1: 2}


def test_a_row_is_found_and_a_broken_part_told(tmp_path: Path) -> None:
    store = filled(tmp_path, [0, 2])
    row = store.row(24)
    assert row is not None
    assert row["value"] == 12.0
    assert store.row(13) is None
    assert store.row(25) is None
    content = bytearray(store.path(0).read_bytes())
    content[4:40] = bytes(36)
    store.path(0).write_bytes(content)
    assert store.count(0) == 10
    with pytest.raises(
        CampaignError, match=r"00000000.parquet must hold rows that can be read .* it flies that once more"
    ):
        store.row(3)


def test_other_files_beside_the_parts_are_left_alone(tmp_path: Path) -> None:
    store = filled(tmp_path, [0, 1, 2])
    for name in ("notes.txt", "mine.parquet", "00000009.parquet", "\N{SUPERSCRIPT TWO}.parquet"):
        (tmp_path / "parts" / name).write_text("mine")
    assert list(store.held()) == [0, 1, 2]
    Store.opened(tmp_path, GIVEN)
    assert len(list((tmp_path / "parts").iterdir())) == 7


def test_a_run_that_was_killed_before_its_manifest_goes_on(tmp_path: Path) -> None:
    (tmp_path / LOCK).touch()
    (tmp_path / ".draft-manifest.json").write_text("{")
    with Store.writing(tmp_path, GIVEN) as store:
        assert store.missing() == [0, 1, 2]


def test_one_run_writes_at_a_time_and_others_read(tmp_path: Path) -> None:
    place = tmp_path / "out"
    with Store.writing(place, GIVEN) as store:
        store.write(0, rows(store, 0))
        (place / "parts" / ".draft-00000001.parquet").write_text("half")
        with pytest.raises(CampaignError, match="being written by another run"), Store.writing(place, GIVEN):
            raise AssertionError("not reached")
        assert (place / "parts" / ".draft-00000001.parquet").read_text() == "half"
        assert Store.read(place).dataset().count_rows() == 10
    with Store.writing(place, GIVEN) as store:
        assert store.missing() == [1, 2]
    with (
        pytest.raises(CampaignError, match="another mission"),
        Store.writing(place, dataclasses.replace(GIVEN, mission="")),
    ):
        raise AssertionError("not reached")


def test_a_place_that_is_refused_is_left_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(CampaignError, match="other files"), Store.writing(tmp_path, GIVEN):
        raise AssertionError("not reached")
    assert [each.name for each in tmp_path.iterdir()] == ["notes.txt"]


def test_a_write_that_fails_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = filled(tmp_path, [0])

    def fail(table: object, draft: Path, **_: object) -> None:
        Path(draft).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(parquet, "write_table", fail)
    with pytest.raises(CampaignError, match=r"No space left on device.*flights that are there are kept"):
        store.write(1, rows(store, 1))
    assert [file.name for file in (tmp_path / "parts").iterdir()] == ["00000000.parquet"]
    assert store.missing() == [1, 2]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="mounting a small disk needs root")
def test_a_full_disk_is_told_and_what_fits_is_kept(tmp_path: Path) -> None:
    place = tmp_path / "small"
    place.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=48k", "tmpfs", place], capture_output=True, check=False
    ).returncode:
        pytest.skip("mounting is not allowed here")
    try:
        store = Store.opened(place / "out", dataclasses.replace(GIVEN, flights=10**6, part=10**5))
        table = pyarrow.table({"value": [k * 0.7391 % 1 for k in range(10**5)]})
        with pytest.raises(CampaignError, match="folder that can be written"):
            store.write(0, table)
        assert list((place / "out" / "parts").iterdir()) == []
    finally:
        subprocess.run(["umount", place], check=True)


def test_the_same_rows_are_the_same_bytes(tmp_path: Path) -> None:
    first, second = (filled(tmp_path / name, [1]) for name in ("a", "b"))
    assert first.path(1).read_bytes() == second.path(1).read_bytes()

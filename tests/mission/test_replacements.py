"""Paths that are replaced in flight, in a mission: read, turned, certified, written and flown as in Python."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from gammastar.errors import GammastarError, MissionError
from gammastar.mission import Mission, load, parse

AWAY = [[0, 0, -2], [4, 1, -3], [6, 5, -1.5]]
SHORT: dict[str, Any] = {
    "vehicle": {"mass": 0.5, "inertia": [0.004, 0.004, 0.007]},
    "path": {"name": "circle"},
    "reference": {"kind": "speed", "speed": 0.5},
    "start": {"position": [1.0, 0, 0.1]},
    "flight": {"duration": 0.4, "step": 5e-3},
    "replacements": [
        {"time": 0.1, "path": {"name": "waypoints", "points": AWAY}},
        {
            "time": 0.2,
            "path": {"name": "ellipse", "progress": "metres"},
            "reference": {"kind": "legs", "legs": [{"speed": 1, "to": 2}]},
        },
    ],
}


def changed(**changes: Any) -> Mission:
    """Return the mission with the first replacement's keys changed, dots written as double underscores."""
    keys = {f"replacements.0.{key.replace('__', '.')}": value for key, value in changes.items()}
    return Mission.from_values(SHORT).with_values(keys)


def test_a_mission_flies_what_python_flies() -> None:
    record = Mission.from_values(SHORT).fly()
    vehicle = gs.Vehicle(mass=0.5, inertia=(0.004, 0.004, 0.007))
    expected = gs.fly(
        gs.design(vehicle, gs.paths.circle()),
        gs.State((1, 0, 0.1)),
        speed=0.5,
        duration=0.4,
        step=5e-3,
        replacements=[
            gs.Replacement(0.1, gs.waypoints(AWAY)),
            gs.Replacement(0.2, gs.by_length(gs.paths.ellipse()), reference=gs.Legs((gs.Leg(1, to=2),))),
        ],
    )
    assert record.state.tobytes() == expected.state.tobytes()
    assert [phase.row for phase in record.phases] == [0, 20, 40]


def test_a_mission_with_replacements_survives_writing_and_pickling() -> None:
    first = Mission.from_values(SHORT)
    for again in (parse(first.toml()), pickle.loads(pickle.dumps(first)), Mission.from_values(first.values())):
        assert again == first
        assert again.fly().state.tobytes() == first.fly().state.tobytes()
    assert first != changed(time=0.15)
    assert "replacements" not in load("stop").toml()


def test_every_frame_flies_the_same_course() -> None:
    """A mission of enu whose numbers are those of ned turned by S is the same flight."""
    turned = SHORT | {"frame": "enu", "start": {"position": [1, 0, -0.1]}}
    turned["path"] = {"name": "circle", "normal": [0, 0, -1]}
    points = (np.array(AWAY) * [1, -1, -1]).tolist()
    turned["replacements"] = [{"time": 0.1, "path": {"name": "waypoints", "points": points}}]
    plain = SHORT | {"replacements": SHORT["replacements"][:1]}
    assert Mission.from_values(turned).fly().state == pytest.approx(Mission.from_values(plain).fly().state, abs=1e-9)


def test_a_file_of_points_is_found_beside_the_mission(tmp_path: Path) -> None:
    (tmp_path / "away.csv").write_text("x,y,z\n" + "\n".join(",".join(map(str, row)) for row in AWAY))
    text = Mission.from_values(SHORT | {"replacements": []}).toml()
    text += '\n[[replacements]]\ntime = 0.1\n[replacements.path]\nname = "csv"\nfile = "away.csv"\n'
    (tmp_path / "mission.toml").write_text(text)
    mission = load(tmp_path / "mission.toml")
    assert mission.values()["replacements"][0]["path"]["points"] == AWAY
    (tmp_path / "away.csv").unlink()
    assert parse(mission.toml()).fly().completed


def test_every_path_is_certified_at_its_own_speed() -> None:
    found = Mission.from_values(SHORT).certificates()
    assert {section: each.speed for section, each in found.items()} == {
        "path": 0.5,
        "replacements.0.path": 0.5,
        "replacements.1.path": 1.0,
    }


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "no time": ({"time": -1}, r"\[replacements.0\] time must be greater than 0"),
    "unknown key": ({"tim": 1}, r'unknown key "tim" in \[replacements.0\]; did you mean "time"'),
    "no path": ({"path": {}}, r'\[replacements.0.path\] must have the key "name"'),
    "bad path": ({"path": {"name": "circle", "radius": -1}}, r"\[replacements.0.path\] radius"),
    "bad key of a path": ({"path": {"name": "circle", "radios": 1}}, r'"radios" in \[replacements.0.path\]'),
    "bad reference": ({"reference": {"kind": "speed"}}, r'\[replacements.0.reference\] must have the key "speed"'),
    "no leg": ({"reference": {"kind": "legs", "legs": []}}, r"\[replacements.0.reference\] a schedule needs"),
    "too late": ({"time": 3}, r"\[\[replacements\]\] a replacement must come before the end"),
    "not in order": ({"time": 0.3}, r"\[\[replacements\]\] replacements must come one after the other"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_bad_replacement_is_refused_in_one_sentence(case: str) -> None:
    changes, message = REFUSED[case]
    with pytest.raises(GammastarError, match=message) as caught:
        changed(**changes)
    assert "\n" not in str(caught.value)


def test_what_is_no_list_of_tables_is_refused() -> None:
    for wrong in ({"time": 1}, True, [3]):
        with pytest.raises(MissionError, match="replacements"):
            Mission.from_values(SHORT | {"replacements": wrong})
    with pytest.raises(MissionError, match=r"\[reference\] legs must be a list of tables \(got 3\)"):
        Mission.from_values(SHORT | {"reference": {"kind": "legs", "legs": 3}})


def test_a_number_in_a_key_counts_tables_from_zero() -> None:
    mission = Mission.from_values(SHORT).with_values({"replacements.1.reference.legs.0.to": 1.0})
    assert mission.values()["replacements"][1]["reference"]["legs"][0]["to"] == 1
    for wrong in ("replacements.2.time", "replacements.first.time", "start.position.0"):
        with pytest.raises(MissionError, match="must lie in a table"):
            Mission.from_values(SHORT).with_values({wrong: 1.0})

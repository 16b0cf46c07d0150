"""Numbers of the path that vary: each flight is that of the mission with its own path, and all are flown by one program."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from engine import steps
from gammastar.campaign.flown import rows
from gammastar.campaign.setting import Setting
from gammastar.campaign.space import Candidate
from gammastar.campaign.trials import Trials
from gammastar.errors import InputError, MissionError
from gammastar.mission import Mission, load

RADIUS = {"quantity": "path.radius", "kind": "uniform", "low": 0.5, "high": 2.0}
ALONG = {"quantity": "start.position", "kind": "along", "radius": 0.1}
FORMULA = {"name": "formula", "x": "cos(l)", "y": "sin(l)", "z": "a*sin(2*l)", "parameter": "l", "period": "2*pi"}
COURSE = {"name": "waypoints", "points": [[0, 0, 0], [3, 0, 1], [5, 2, 0]]}
CASES: dict[str, tuple[dict[str, Any], list[dict[str, Any]]]] = {
    "circle": (
        {"name": "circle"},
        [RADIUS, {"quantity": "path.center", "kind": "ball", "radius": 0.5}, ALONG],
    ),
    "formula": (
        FORMULA | {"constants": {"a": 0.2}},
        [
            {"quantity": "path.constants.a", "kind": "grid", "low": 0.0, "high": 1.0, "count": 3},
            {"quantity": "controller.poles", "kind": "uniform", "low": -4.0, "high": -2.0},
        ],
    ),
    "course": (
        COURSE,
        [
            {"quantity": "path.position", "kind": "normal", "mean": [0, 0, 0], "deviation": [0.1, 0.1, 0.1]},
            {"quantity": "path.rotation.yaw", "kind": "uniform", "low": -20.0, "high": 20.0},
            {"quantity": "path.scale", "kind": "list", "choices": [1.0, 2.0]},
        ],
    ),
    "metres": ({"name": "circle", "progress": "metres"}, [RADIUS, ALONG]),
}


def flying(path: dict[str, Any], *vary: dict[str, Any], **changes: Any) -> Mission:
    """Return a mission in `enu`, of a law by itself, whose path varies."""
    given = {
        "frame": "enu",
        "path": path,
        "start": {"position": [1.1, 0.2, 0.3]},
        "controller": {"poles": -3.0, "feedback": "start", "rate": 100.0},
        "flight": {"duration": 0.2, "step": 0.01, "settled_within": 0.05},
    }
    campaign = {"campaign": {"vary": list(vary)}} if vary else {}
    return load("upright").with_values(given | campaign | changes)


def listed(setting: Setting, numbers: Any, machine: str = "casadi") -> list[dict[str, Any]]:
    return list(rows(setting, numbers, machine).to_pylist())


@pytest.mark.parametrize("name", CASES)
def test_each_flight_is_that_of_the_mission_with_its_own_path(name: str) -> None:
    """Flown by itself, with the numbers that the row tells; and a row depends on its number alone."""
    path, vary = CASES[name]
    setting = Setting(flying(path, *vary), seed=3)
    table, drawn = listed(setting, [1, 2]), setting.sample(np.array([1, 2]))
    assert [row["status"] for row in table] == ["completed"] * 2
    for k, (number, row) in enumerate(zip((1, 2), table, strict=True)):
        values = {key: each[k].tolist() for key, each in drawn.items() if key.split(".")[0] != "start"}
        for key, value in values.items():
            told = [row[key]] if np.ndim(value) == 0 else [row[f"{key}.{axis}"] for axis in "xyz"]
            assert told == np.atleast_1d(value).tolist()
        start = [row[f"start_position_{axis}_m"] for axis in "xyz"]
        alone = flying(path).with_values(values | {"start.position": start, "flight.seed": 3, "flight.number": number})
        told = alone.fly().summary()
        assert row["final_distance_m"] == pytest.approx(told["distance_m"]["final"], abs=1e-9)
        assert row["max_distance_m"] == pytest.approx(told["distance_m"]["max"], abs=1e-9)
        assert row["peak_rate_rad_s"] == pytest.approx(told["peak_rate_rad_s"], rel=1e-9)
        if ALONG in vary:
            assert row["final_distance_m"] < 0.3
        (case,) = setting.cases(np.array([number]), setting.sample(np.array([number])))
        assert case.alone().values()["path"] == alone.values()["path"]
    assert repr(listed(setting, [2])) == repr(table[1:])
    built = gs.engine.compilations()
    listed(setting, range(3, 6))
    assert gs.engine.compilations() == built


def test_a_path_that_cannot_be_is_a_row() -> None:
    """The others are what they are without it."""
    radii = {"quantity": "path.radius", "kind": "grid", "choices": [-1.0, 1.0, 0.0, 2.0]}
    table = listed(Setting(flying({"name": "circle"}, radii, ALONG), seed=0), range(4))
    assert [row["status"] for row in table] == ["refused", "completed", "refused", "completed"]
    assert table[0]["cause"] == "[path] radius [m] must be greater than 0 (got -1); raise it"
    scales = {"quantity": "path.scale", "kind": "normal", "mean": 0.0, "deviation": 1.0}
    setting = Setting(flying({"name": "circle"}, scales), seed=0)
    for row in listed(setting, range(6)):
        assert row["status"] == ("completed" if row["path.scale"] > 0 else "refused")
        if row["status"] == "refused":
            assert row["cause"] == f"[path] scale must be greater than 0 (got {row['path.scale']:g}); raise it"
    knots = {"quantity": "path.phases", "kind": "list", "choices": [[90.0, 90.0, 0.0], [90.0, 0.0, 0.0]]}
    setting = Setting(flying({"name": "lissajous"}, knots), seed=0)
    (crossed,) = [row for row in listed(setting, range(6)) if row["path.phases.y"] == 0.0][:1]
    assert "the curve would meet itself" in crossed["cause"]


def test_numbers_that_make_another_formula_take_programs_of_their_own() -> None:
    """As exponents do that are whole; and rows are in their order all the same."""
    path = {
        "name": "formula",
        "x": "lambda",
        "y": "a*lambda**n",
        "z": "0",
        "ends": [-1, 1],
        "constants": {"a": 1.0, "n": 2},
    }
    powers = {"quantity": "path.constants.n", "kind": "grid", "choices": [2, 3]}
    setting = Setting(flying(path, powers, RADIUS | {"quantity": "path.constants.a"}), seed=0)
    table = listed(setting, range(4))
    assert [row["path.constants.n"] for row in table] == [2, 3, 2, 3]
    first, second = setting.cases(np.arange(4), setting.sample(np.arange(4)))
    assert (first.places.tolist(), second.places.tolist()) == ([0, 2], [1, 3])
    assert [row["status"] for row in table] == ["completed"] * 4
    assert repr(listed(setting, [1])) == repr(table[1:2])


def test_counts_vary_as_lists() -> None:
    """Windings of a knot are whole, and each choice is a program of its own; other numbers may be drawn beside."""
    counts, tubes = {"quantity": "path.q", "kind": "grid", "choices": [3, 5]}, RADIUS | {"quantity": "path.tube"}
    mission = flying({"name": "torus_knot", "radius": 4.0}, counts, tubes)
    assert not {"path.p", "path.q"} & set(mission.quantities)
    first, second = listed(Setting(mission, seed=0), range(2))
    assert [first["path.q"], second["path.q"]] == [3, 5]
    assert (first["status"], second["status"]) == ("completed", "completed")


def test_a_place_at_the_origin_is_one_like_any_other() -> None:
    """Where the mission says nothing of it, too: what is compiled when a campaign begins is what its flights take."""
    places = {"quantity": "path.position", "kind": "grid", "choices": [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]]}
    setting = Setting(flying({"name": "circle"}, places), seed=0)
    (case,) = setting.cases(np.arange(2), setting.sample(np.arange(2)))
    laws = [*setting.nominal(1)["laws"], *(case.laws or ())]
    assert len({law.path.graph_key for law in laws}) == 1
    (own,) = Setting(flying({"name": "circle"}, RADIUS), seed=0).nominal(1)["laws"]
    assert own.path.graph_key == gs.paths.circle().with_data().graph_key


def test_a_list_over_an_implicit_path_is_flown_by_a_program_for_each() -> None:
    """Also where it is another list that makes the path implicit."""
    radii = {"quantity": "path.radius", "kind": "grid", "choices": [1.0, 2.0]}
    kinds = {"quantity": "path.kind", "kind": "grid", "choices": ["implicit", "curve"]}
    table = listed(Setting(flying({"name": "circle"}, kinds, radii), seed=0), range(4))
    for row in table:
        alone = flying({"name": "circle", "kind": row["path.kind"], "radius": row["path.radius"]}).fly()
        assert row["final_distance_m"] == pytest.approx(alone.distance[-1], abs=1e-9)
    assert [row["path.radius"] for row in table] == [1.0, 2.0] * 2
    setting = Setting(flying({"name": "circle", "kind": "implicit"}, radii), seed=0)
    for row, other in zip(listed(setting, range(2)), table, strict=False):
        assert row["final_distance_m"] == pytest.approx(other["final_distance_m"], abs=1e-9)


@pytest.mark.parametrize(
    ("path", "vary", "words"),
    [
        (
            {"name": "circle"},
            RADIUS | {"quantity": "path.radiu"},
            r'quantity that is no list and no grid must be one of .*did you mean "path.radius"',
        ),
        ({"name": "circle"}, RADIUS | {"quantity": "path.kind"}, "no list and no grid must be one of"),
        ({"name": "line"}, RADIUS, "no list and no grid must be one of"),
        (
            FORMULA | {"constants": {"a": "pi/4"}},
            RADIUS | {"quantity": "path.constants.a"},
            "no list and no grid must be one of",
        ),
        ({"name": "circle"}, RADIUS | {"quantity": "path.center"}, r"must vary over vectors \(got numbers\)"),
    ],
    ids=["slip", "text", "of another path", "formula", "vector"],
)
def test_what_is_no_number_of_the_path_is_refused(path: dict[str, Any], vary: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        flying(path, vary)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"path": {"name": "circle", "kind": "implicit"}}, "path.radius must be that of a curve.*got an implicit path"),
        (
            {"reference": {"kind": "feasible", "speed": 1.0}},
            r"path.radius must be that of a curve, at a speed that is not made for it \(got a feasible one\)",
        ),
    ],
    ids=["implicit", "feasible"],
)
def test_what_takes_a_program_for_each_flight_is_refused_at_the_beginning(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(MissionError, match=words):
        Setting(flying({"name": "circle"}, RADIUS).with_values(changes), seed=0)


def test_a_flight_is_flown_again_along_its_own_path(tmp_path: Path) -> None:
    """To the last bit, also alone; its mission has the path's own numbers."""
    mission = flying(
        {"name": "circle"}, RADIUS, ALONG, {"quantity": "truth.mass_scale", "kind": "uniform", "low": 0.9, "high": 1.1}
    )
    campaign = gs.campaign(mission, 4, tmp_path / "rows", part=3, machine="casadi")
    row = campaign.to_pandas().iloc[2]
    again = campaign.fly(2)
    assert again.same
    assert again.mission.file.path.radius == row["path.radius"]  # type: ignore[attr-defined]
    assert again.record.law.path.length() == pytest.approx(2 * np.pi * row["path.radius"])
    assert again.record.distance[-1] == pytest.approx(row["final_distance_m"], abs=1e-12)
    np.testing.assert_allclose(again.mission.fly().position, again.record.position, atol=1e-9)


def test_a_tuning_is_tried_along_the_path_of_each_flight() -> None:
    mission = flying({"name": "circle"}, RADIUS)
    (columns,) = Trials(mission, range(2), seed=3, machine="casadi").fly([Candidate.of(mission.law())])
    for name in ("final_distance_m", "max_distance_m"):
        assert columns[name] == pytest.approx([row[name] for row in listed(Setting(mission, 3), range(2))], abs=1e-9)


@steps.needs_compiler
def test_workers_make_no_difference() -> None:
    setting = Setting(flying({"name": "circle"}, RADIUS), seed=1)
    one, two = (rows(setting, range(20), "native", workers).to_pylist() for workers in (1, 2))
    assert repr(one) == repr(two)
    assert repr(rows(setting, [7], "native").to_pylist()) == repr(one[7:8])
    for row, other in zip(one[:3], listed(setting, range(3)), strict=True):
        assert row["final_distance_m"] == pytest.approx(other["final_distance_m"], abs=1e-9)

"""Every form of a path in a mission: what it is in the mission's axes, in both frames, and where its placement puts it."""

import pickle
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from gammastar import paths, so3
from gammastar.errors import GammastarError, InputError, MissionError, PathError, RotationError
from gammastar.mission import Mission, load, parse
from gammastar.mission.paths import CATALOGUE
from gammastar.path import ImplicitPath
from gammastar.path.waypoints import WaypointPath, waypoints

QUICK: dict[str, Any] = {
    "vehicle": {"mass": 0.5, "inertia": [0.004, 0.004, 0.007]},
    "reference": {"kind": "speed", "speed": 0.5},
    "start": {"position": [1.5, 0.2, 0.2]},
    "flight": {"duration": 0.02},
}
GATES = [[0.0, 0.0, 0.0], [3.0, 0.0, -1.0], [3.0, 3.0, 0.0], [0.0, 3.0, 1.0]]
PLACE: dict[str, Any] = {"position": [1.0, 2.0, -3.0], "rotation": {"roll": 30, "pitch": -20, "yaw": 70}, "scale": 1.5}
TURN = so3.yaw(70) @ so3.pitch(-20) @ so3.roll(30)

# Every form, with arguments that no symmetry hides.
FORMS: dict[str, dict[str, Any]] = {
    "circle": {"name": "circle", "radius": 2, "center": [1, 2, 3], "normal": [0.2, 0.3, 1]},
    "implicit circle": {"name": "circle", "kind": "implicit", "center": [1, 2, 3], "normal": [0.2, 0.3, 1]},
    "ellipse": {"name": "ellipse", "semi_axes": [3, 1], "center": [1, 2, 3], "normal": [0.2, 0.3, -1]},
    "helix": {"name": "helix", "pitch": 0.7, "center": [1, 2, 3], "axis": [0.2, 0.1, 1]},
    "lemniscate": {"name": "lemniscate"},
    "line": {"name": "line", "point": [1, 2, 3], "along": [1, 2, -3]},
    "lissajous": {"name": "lissajous", "phases": [10, 50, 0]},
    "nonplanar_circle": {"name": "nonplanar_circle"},
    "polynomial": {"name": "polynomial", "coefficients": [[0, 1], [0, 0, 1], [1, 0.5, 0, 0.2]], "domain": [0, 2]},
    "sine": {"name": "sine"},
    "torus_knot": {"name": "torus_knot"},
    "trefoil": {"name": "trefoil"},
    "viviani": {"name": "viviani"},
    "waypoints": {"name": "waypoints", "points": GATES},
    "closed waypoints": {"name": "waypoints", "points": GATES, "closed": True, "spacing": "centripetal"},
    "extended waypoints": {"name": "waypoints", "points": GATES, "before": 2, "after": 3, "blend": 1},
    "formula": {"name": "formula", "x": "t", "y": "a*t**2", "z": "sin(t)", "parameter": "t", "constants": {"a": "1/3"}},
    "formula that ends": {"name": "formula", "x": "t", "y": "t**2/5", "z": "1", "parameter": "t", "ends": [-1, "2*pi"]},
    "closed formula": {"name": "formula", "x": "cos(λ)", "y": "sin(λ)", "z": "0.2*sin(2*lambda)", "period": "2*pi"},
    "implicit formula": {
        "name": "formula",
        "s1": "(x/2)**2 + y**2 - 1",
        "s2": "z - r*x*y",
        "pi": "atan2(y, x/2)",
        "seed": [2, 0, 0],
        "period": "2*pi",
        "constants": {"r": 0.3},
    },
}
# What says up or down; by hand, where the second form is the one with the third axis turned.
UPRIGHT: dict[str, dict[str, Any]] = {
    "loop": {"name": "loop", "radius": 2, "heading": 30},
    "spiral": {"name": "spiral", "rise": 0.5},
    "rising lemniscate": {"name": "lemniscate", "kind": "rising"},
}
PARAMETERS = np.linspace(0.1, 1.9, 12)


def mission(path: dict[str, Any], frame: str = "ned", **changes: Any) -> Mission:
    return Mission.from_values(QUICK | {"path": path, "frame": frame} | changes)


def points(path: dict[str, Any], frame: str) -> np.ndarray:
    """Return points (12, 3) [m] in the mission's axes."""
    found = mission(path, frame).law().path.points(PARAMETERS)
    return found if frame == "ned" else found * [1, -1, -1]


def test_every_path_of_the_catalogue_is_here() -> None:
    assert {form["name"] for form in [*FORMS.values(), *UPRIGHT.values()]} >= set(CATALOGUE)


@pytest.mark.parametrize("name", FORMS)
def test_a_path_has_the_same_coordinates_in_the_axes_of_either_frame(name: str) -> None:
    assert np.allclose(points(FORMS[name], "enu"), points(FORMS[name], "ned"), atol=1e-9)


@pytest.mark.parametrize("name", UPRIGHT)
def test_up_is_up_in_either_frame(name: str) -> None:
    assert np.allclose(points(UPRIGHT[name], "enu"), points(UPRIGHT[name], "ned") * [1, 1, -1], atol=1e-12)


def test_what_rises_rises_in_either_frame() -> None:
    for path in (UPRIGHT["spiral"], UPRIGHT["rising lemniscate"]):
        assert (np.diff(points(path, "ned")[:, 2]) < 0).all()
        assert (np.diff(points(path, "enu")[:, 2]) > 0).all()


@pytest.mark.parametrize("frame", ["ned", "enu"])
@pytest.mark.parametrize("name", [name for name in FORMS | UPRIGHT if name != "extended waypoints"])
def test_every_form_is_placed_by_the_same_keys(name: str, frame: str) -> None:
    """X -> position + scale R x in the mission's axes; the parameter of waypoints counts metres as flown, so it is scaled."""
    form = (FORMS | UPRIGHT)[name]
    expected = PLACE["position"] + PLACE["scale"] * points(form, frame) @ TURN.T
    path = mission(form | PLACE, frame).law().path
    found = path.points(PARAMETERS * PLACE["scale"] if "waypoints" in name else PARAMETERS)
    assert np.allclose(found if frame == "ned" else found * [1, -1, -1], expected, atol=1e-9)


@pytest.mark.parametrize("rotation", [TURN.tolist(), [0.8, 0.0, -0.6, 0.0], {"yaw": 40.0}])
def test_a_rotation_has_three_forms(rotation: Any) -> None:
    """And each of them is kept as it was written."""
    placed = mission({"name": "ellipse", "rotation": rotation})
    assert parse(placed.toml()).file.path.rotation == placed.file.path.rotation
    turn = {
        list: lambda r: so3.from_quaternion(r) if len(r) == 4 else np.array(r),
        dict: lambda r: so3.yaw(r["yaw"]),
    }[type(rotation)](rotation)
    assert np.allclose(placed.law().path.points(PARAMETERS), paths.ellipse().points(PARAMETERS) @ turn.T, atol=1e-12)


def test_one_angle_of_a_placement_can_be_changed() -> None:
    turned = mission({"name": "ellipse"}).with_values({"path.rotation.roll": 90, "path.position": [0, 0, -1]})
    assert turned.values()["path"]["rotation"] == {"roll": 90, "pitch": 0, "yaw": 0}
    assert np.allclose(turned.law().path.points(np.array([np.pi / 2])), [[0, 0, 0]], atol=1e-12)


def test_waypoints_are_those_of_the_library() -> None:
    path = mission(FORMS["closed waypoints"]).law().path
    assert isinstance(path, WaypointPath)
    expected = waypoints(GATES, closed=True, spacing="centripetal")
    assert np.array_equal(path.spline.coefficients, expected.spline.coefficients)


def test_open_waypoints_run_on_beyond_their_ends() -> None:
    path, bare = (mission(FORMS[name]).law().path for name in ("extended waypoints", "waypoints"))
    assert np.allclose(np.subtract(path.domain, bare.domain), [-2, 3], atol=1e-12)
    assert np.allclose(path.points(PARAMETERS), bare.points(PARAMETERS), atol=1e-12)


@pytest.mark.parametrize("name", ["waypoints", "formula that ends"])
def test_an_open_path_is_flown_to_its_end_and_no_farther(name: str) -> None:
    """Also when it is turned and scaled."""
    flown = mission(
        FORMS[name] | PLACE, reference={"kind": "speed", "speed": 2.0}, flight={"duration": 20, "step": 0.01}
    )
    start = flown.law().path.points(np.array([0.5]))[0]
    record = flown.with_values({"start.position": start}).fly()
    end = flown.law().path.points(np.array([flown.law().path.domain[1]]))[0]
    assert np.linalg.norm(record.position[-1] - end) < 1e-3
    assert np.linalg.norm(record.velocity[-1]) < 1e-3


def test_a_formula_of_position_makes_an_implicit_path() -> None:
    path = mission(FORMS["implicit formula"]).law().path
    assert isinstance(path, ImplicitPath)
    assert path.period == pytest.approx(2 * np.pi)


def write_points(file: Path) -> None:
    rows = "\n".join(f"{x}, {y}, {z}" for x, y, z in GATES)
    file.write_text(f"x, y, z\n{rows}\n", encoding="utf-8")


def test_a_table_lies_beside_its_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_points(tmp_path / "gates.csv")
    text = mission(FORMS["waypoints"]).toml()
    start = text.index("points = ")
    end = text.index("\n", start)
    text = text[:start] + 'file = "gates.csv"' + text[end:]
    (tmp_path / "mine.toml").write_text(text.replace('"waypoints"', '"csv"'), encoding="utf-8")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    for name in (tmp_path / "mine.toml", "../mine.toml"):
        assert load(name) == mission(FORMS["waypoints"])


def test_a_table_is_written_out_as_waypoints(tmp_path: Path) -> None:
    """So the mission is the same wherever it goes and whatever becomes of the file."""
    file = tmp_path / "gates.csv"
    write_points(file)
    first = mission({"name": "csv", "file": str(file), "closed": True, "position": [0, 0, 1]})
    changed = first.with_values({"path.closed": False})
    assert changed.law().path.period is None
    text, frozen = first.toml(), pickle.dumps(first)
    file.unlink()
    for again in (parse(text), pickle.loads(frozen)):
        assert again.values()["path"]["points"] == GATES
        assert again == first
        assert again.fly().state.tobytes() == first.fly().state.tobytes()


@pytest.mark.parametrize("name", FORMS | UPRIGHT)
def test_every_form_survives_being_written(name: str) -> None:
    first = mission((FORMS | UPRIGHT)[name] | PLACE, "enu")
    again = parse(first.toml())
    assert again == first
    assert again.toml() == first.toml()
    assert again.fly().state.tobytes() == first.fly().state.tobytes()


def test_many_points_stand_a_row_on_a_line() -> None:
    many = mission({"name": "waypoints", "points": [[k, k**2 / 7, 0.1] for k in range(30)]})
    assert "\npoints = [\n    [0.0, 0.0, 0.1],\n    [1.0, 0.14285714285714285, 0.1],\n" in many.toml()


def test_text_in_a_list_keeps_its_blanks() -> None:
    spaced = mission(FORMS["formula"] | {"domain": ["- 1 * pi", "2 * pi"]})
    assert 'domain = ["- 1 * pi", "2 * pi"]' in spaced.toml()


WAYPOINTS, FORMULA = {"name": "waypoints", "points": GATES}, FORMS["closed formula"]
BAD: dict[str, tuple[dict[str, Any], type[GammastarError], str]] = {
    "no points": ({"name": "waypoints"}, MissionError, r'\[path\] must have the key "points"'),
    "one number": ({"name": "waypoints", "points": 3}, MissionError, r"points must be a list of points \(got 3\)"),
    "a short row": ({"name": "waypoints", "points": [[0, 0, 0], [1, 1]]}, MissionError, r"points\[1\] must be three"),
    "text in a row": (
        {"name": "waypoints", "points": [[0, 0, 0], [1, 1, "2"]]},
        MissionError,
        r'numbers only \(got "2"\)',
    ),
    "one point": ({"name": "waypoints", "points": [[0, 0, 0]]}, InputError, r"\[path\] waypoints must be at least 2"),
    "equal points": ({"name": "waypoints", "points": [[0, 0, 0]] * 2}, PathError, r"\[path\] neighbouring waypoints"),
    "closed by a number": (WAYPOINTS | {"closed": 1}, MissionError, r"closed must be true or false \(got 1\)"),
    "extension of a ring": (WAYPOINTS | {"closed": True, "after": 1}, InputError, r"\[path\] only an open path"),
    "backwards": (WAYPOINTS | {"before": -1}, InputError, r"\[path\] before \[m\] must be at least 0"),
    "no file": ({"name": "csv"}, MissionError, r'\[path\] must have the key "file"'),
    "missing file": ({"name": "csv", "file": "gone.csv"}, InputError, r"\[path\] points must come from .*gone.csv"),
    "number for a file": ({"name": "csv", "file": 3}, MissionError, r"file must be text \(got 3\)"),
    "half a formula": ({"name": "formula", "x": "1"}, MissionError, r'\[path\] must have the key "y"'),
    "both formulas": (FORMULA | {"s1": "x"}, MissionError, r'unknown key "x" in \[path\]'),
    "no seed": (
        {"name": "formula", "s1": "y", "s2": "z", "pi": "x"},
        MissionError,
        r'\[path\] must have the key "seed"',
    ),
    "code": (FORMULA | {"x": "__import__('os')"}, GammastarError, r"\[path\] .*x of formula"),
    "unknown name": (FORMULA | {"z": "2*t"}, GammastarError, r"\[path\] .*z of formula .*'t'"),
    "flag for a formula": (
        FORMULA | {"x": True},
        MissionError,
        r"x must be a formula in quotes, or a number \(got true\)",
    ),
    "text for a domain": (FORMULA | {"domain": "0, 1"}, MissionError, r'domain must be a list .*\(got "0, 1"\)'),
    "text for constants": (FORMULA | {"constants": "a = 1"}, MissionError, r"constants must be a table of names"),
    "flag for a constant": (FORMULA | {"constants": {"a": False}}, MissionError, r"constants .*\(got false\)"),
    "gap": (FORMULA | {"period": 6}, PathError, r"\[path\] formula must close"),
    "unknown angle": (
        {"name": "circle", "rotation": {"rol": 1}},
        MissionError,
        r'"rol" in \[path.rotation\]; did you mean "roll"',
    ),
    "three numbers": ({"name": "circle", "rotation": [1, 0, 0]}, MissionError, r"rotation must be three rows"),
    "reflection": (
        {"name": "circle", "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]},
        RotationError,
        r"\[path\] rotation",
    ),
    "no quaternion": ({"name": "circle", "rotation": [0, 0, 0, 0]}, GammastarError, r"\[path\]"),
    "no size": ({"name": "circle", "scale": 0}, MissionError, r"\[path\] scale must be greater than 0"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_path_is_refused_in_one_sentence(name: str) -> None:
    path, kind, message = BAD[name]
    with pytest.raises(kind, match=message) as caught:
        mission(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).count("[path") == 1


def test_an_open_path_by_name_may_be_given_ends() -> None:
    """With them it can be measured, stops where it says, and survives being written."""
    ending = mission({"name": "helix", "ends": [0, 6.0]})
    assert ending.law().path.ends == (0, 6)
    assert parse(ending.toml()) == ending
    measured = mission({"name": "helix", "ends": [0, 6.0], "progress": "metres"}).law().path
    assert measured.ends == pytest.approx((0, ending.law().path.length()))
    with pytest.raises(GammastarError, match=r"\[path\] circle must be closed or end"):
        mission({"name": "circle", "ends": [0, 1]})
    with pytest.raises(GammastarError, match=r"\[path\] ends need a curve"):
        mission({"name": "circle", "kind": "implicit", "ends": [0, 1]})
    for wrong in ([0], [2, 1], 3, [0, 1, 2]):
        with pytest.raises(GammastarError, match=r"\[path\] "):
            mission({"name": "helix", "ends": wrong})


def test_the_paths_of_the_page_fly(tmp_path: Path) -> None:
    """Each [path] block of the reference, with what else it shows, is a mission and survives being written."""
    page = (Path(__file__).parents[2] / "docs" / "reference" / "missions.md").read_text(encoding="utf-8")
    for name, text in re.findall(r"^```csv\n# (\S+)\n(.*?)^```$", page, re.MULTILINE | re.DOTALL):
        (tmp_path / name).write_text(text, encoding="utf-8")
    blocks = re.findall(r"^```toml\n(\[.*?)^```$", page, re.MULTILINE | re.DOTALL)
    names = set()
    for block in blocks:
        values = QUICK | {"path": {"name": "circle"}} | tomllib.loads(block)
        for replacement in values.get("replacements", []):
            replacement["time"] = 0.01  # while it flies
        (tmp_path / "mine.toml").write_text(tomli_w.dumps(values))
        shown = load(tmp_path / "mine.toml")
        names.add(tomllib.loads(block).get("path", {}).get("name"))
        assert parse(shown.toml()) == shown
        assert shown.fly().completed
        assert shown.certify().flyable
    assert names >= {"waypoints", "csv", "formula"}
    for name in CATALOGUE:
        assert f"`{name}`" in page

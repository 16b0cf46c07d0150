"""A mission: read, resolved, changed, written and flown again."""

import copy
import inspect
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gammastar import law as laws
from gammastar import so3
from gammastar.errors import GammastarError, MissionError, RotationError, SingularStartError, UnknownNameError
from gammastar.flight import SensorNoise
from gammastar.flight.sensors import CHANNELS
from gammastar.law.design import CHAINS, DEFAULT_POLES
from gammastar.mission import Mission, load, names, parse, value
from gammastar.mission.parts import Parts
from gammastar.mission.paths import CATALOGUE
from gammastar.mission.references import REFERENCES
from gammastar.mission.sections import YAW_OUTPUTS
from gammastar.mission.truth import NoiseSection
from gammastar.path import Path as AnyPath
from gammastar.path import catalogue
from gammastar.vehicle import Vehicle
from strategies import UPSIDE_DOWN

SHORT: dict[str, Any] = {
    "vehicle": {"mass": 0.5, "inertia": [0.004, 0.004, 0.007]},
    "path": {"name": "circle"},
    "reference": {"kind": "speed", "speed": 1},
    "start": {"position": [1.5, 0, 0.2]},
    "flight": {"duration": 0.05},
}


def mission(**changes: Any) -> Mission:
    """Return a short mission with values changed by key, dots written as double underscores."""
    return Mission.from_values(SHORT).with_values({key.replace("__", "."): value for key, value in changes.items()})


def test_paths_have_the_names_of_their_factories() -> None:
    assert {name: section.factory() for name, section in CATALOGUE.items()} == {
        name: getattr(catalogue, name) for name in catalogue.__all__
    }


def test_every_reference_can_be_named() -> None:
    assert list(REFERENCES) == ["speed", "ramp", "point", "stop", "profile", "legs", "feasible"]


def test_noise_has_the_channels_of_the_sensors() -> None:
    assert tuple(NoiseSection.model_fields) == CHANNELS


@pytest.mark.parametrize("name", YAW_OUTPUTS)
def test_yaw_outputs_are_odd(name: str) -> None:
    """Held because another frame turns r round: only for an odd beta that is a change of sign."""
    import casadi as ca

    rates = ca.DM([0.3, 1.7])
    assert np.array_equal(np.array(YAW_OUTPUTS[name](-rates)), -np.array(YAW_OUTPUTS[name](rates)))


def test_values_left_out_take_the_defaults_of_the_functions_they_go_to() -> None:
    values = mission().values()
    assert values["vehicle"]["gravity"] == inspect.signature(Vehicle).parameters["gravity"].default
    assert values["path"]["kind"] == "curve"
    assert values["controller"]["poles"]["transverse"] == list(DEFAULT_POLES)
    assert values["start"]["thrust"] == mission().law().vehicle.weight
    assert [values["start"][angle] for angle in ("roll", "pitch", "yaw")] == [0, 0, 0]


def test_a_resolved_mission_lists_the_chains_its_path_has() -> None:
    curve, implicit = mission(), mission(path__kind="implicit")
    assert list(implicit.values()["controller"]["poles"]) == list(CHAINS)
    assert list(curve.values()["controller"]["poles"]) == [chain for chain in CHAINS if chain != "transverse_2"]


CHANGES: dict[str, dict[str, Any]] = {
    "as it is": {},
    "every section": {
        "title": 'quotes " and \\ and = [ é',
        "frame": "enu",
        "vehicle.inertia": [[0.004, 1e-4, 0], [1e-4, 0.004, 0], [0, 0, 0.007]],
        "vehicle.bias_torque": 1e-3,
        "controller.poles": {"transverse": [[-2, 1], [-2, -1], -3, -4], "speed": -3, "yaw": [-2.5]},
        "controller.yaw_output": "sinh",
        "controller.feedback": "middle",
        "controller.rate": 100,
        "truth.mass_scale": 1.1,
        "truth.inertia_scale": [1.1, 1, 0.9],
        "noise.position": {"deviation": 0.01, "rate": [5, 5, 100]},
        "flight.seed": 7,
        "flight.integrator": "cf4",
    },
    "angles": {"start.roll": 170.0, "start.yaw": -20.0},
    "quaternion": {"start.quaternion": [0.7071, 0.7071, 0, 0]},
    "implicit": {"path.kind": "implicit", "controller.poles": {"transverse_2": [-3, -3.1, -3.2, -3.3]}},
    "stop": {"reference": {"kind": "stop", "speed": -1, "coordinate": 2, "braking_time": 1, "laps": 1}},
    "point": {"reference": {"kind": "point", "coordinate": 1}},
    "approach": {"approach": {}},
    "approach with a floor": {"approach": {"speed": 1, "thrust_floor": 0.5, "leave": 0.2, "enter": 0.5}},
    "along": {"heading": {"kind": "along", "gain": 3}},
    "azimuth": {"heading": {"kind": "azimuth"}, "frame": "enu"},
    "towards": {"heading": {"kind": "towards", "point": [1, 2, 3]}, "frame": "enu"},
    "legs": {"reference": {"kind": "legs", "legs": [{"speed": 1, "to": 2, "hold": 1}, {"speed": -1}]}},
    "third": {"vehicle.mass": 1 / 3, "start.thrust": 2 / 3},
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_resolved_mission_is_equal_and_flies_the_same_bytes(case: str) -> None:
    first = Mission.from_values(SHORT).with_values(CHANGES[case])
    again = parse(first.toml())
    assert again == first
    assert hash(again) == hash(first)
    assert again.toml() == first.toml()
    one, two = first.fly(), again.fly()
    assert one.state.tobytes() == two.state.tobytes()
    assert one.input.tobytes() == two.input.tobytes()
    assert str(one.summary()) == str(two.summary())


def test_an_approach_is_on_when_its_section_is_there() -> None:
    assert mission().law().approach is None
    assert mission(approach={}).law().approach == laws.Approach()
    assert mission(approach__speed=1).law().approach == laws.Approach(speed=1)
    assert mission(start__position=[0, 0, 0], approach={}).fly().waiting[0]


def test_a_written_approach_has_its_thrust_floor() -> None:
    """5 % of the weight, as the thrust of the start is the weight; it follows a changed mass."""
    assert mission(approach={}).values()["approach"]["thrust_floor"] == pytest.approx(0.05 * 0.5 * 9.80665)
    heavier = mission(approach={}).with_values({"vehicle.mass": 1})
    assert heavier.values()["approach"]["thrust_floor"] == pytest.approx(0.05 * 9.80665)


@pytest.mark.parametrize(
    ("section", "expected"),
    [
        ({"kind": "along", "gain": 3}, laws.Along(gain=3)),
        ({"kind": "azimuth"}, laws.Azimuth()),
        ({"kind": "towards", "point": [1, 2, 3]}, laws.Towards(point=(1, 2, 3))),
    ],
)
def test_a_heading_is_that_of_the_library(section: dict[str, Any], expected: Any) -> None:
    flown = mission(heading=section).fly()
    assert type(flown.yaw_reference) is type(expected)
    assert all(np.array_equal(value, getattr(expected, key)) for key, value in vars(flown.yaw_reference).items())


def test_a_heading_and_a_yaw_reference_exclude_each_other() -> None:
    assert mission(heading={"kind": "along"}, controller__yaw_reference=0).fly().completed
    with pytest.raises(MissionError, match=r"\[heading\] must stand alone \(got yaw_reference = 0.2") as caught:
        mission(heading={"kind": "along"}, controller__yaw_reference=0.2)
    assert caught.value.where == "controller.yaw_reference"


NOT_FLOWN: dict[str, tuple[dict[str, Any], str]] = {
    "unknown heading": ({"heading": {"kind": "alon"}}, r'\[heading\] kind must be one of .*did you mean "along"'),
    "flag for a heading": ({"heading": {"kind": True}}, r"\[heading\] kind must be one of .*\(got true\)"),
    "no kind": ({"heading": {}}, r'\[heading\] must have the key "kind"'),
    "no gain": ({"heading": {"kind": "along", "gain": 0}}, r"\[heading\] heading gain .* greater than 0"),
    "no direction": ({"heading": {"kind": "azimuth", "direction": [0, 0, 0]}}, r"\[heading\] heading direction"),
    "no point": ({"heading": {"kind": "towards"}}, r'\[heading\] must have the key "point"'),
    "other heading's key": ({"heading": {"kind": "along", "point": [0, 0, 0]}}, r'unknown key "point" in \[heading\]'),
    "no speed": ({"approach": {"speed": 0}}, r"\[approach\] approach speed"),
    "margins crossed": ({"approach": {"leave": 0.9}}, r"\[approach\] margins"),
    "flag for an approach": ({"approach": True}, r"\[approach\] must be a table of keys \(got true\)"),
    "implicit path": (
        {"approach": {}, "path.kind": "implicit"},
        r"\[approach\] an approach from anywhere needs a curve",
    ),
    "no weight": ({"approach": {}, "vehicle.gravity": 0, "start.thrust": 1}, r"\[approach\] .*thrust floor"),
}


@pytest.mark.parametrize("case", NOT_FLOWN)
def test_a_bad_section_is_refused_in_one_sentence(case: str) -> None:
    changes, message = NOT_FLOWN[case]
    with pytest.raises(GammastarError, match=message) as caught:
        Mission.from_values(SHORT).with_values(changes)
    assert "\n" not in str(caught.value)


def test_missions_that_differ_are_not_equal() -> None:
    assert mission() != mission(flight__seed=1)
    assert mission() != "a mission"


def test_a_mission_survives_pickling() -> None:
    first = mission(start__roll=10.0)
    again = pickle.loads(pickle.dumps(first))
    assert again == first
    assert np.array_equal(again.fly().state, first.fly().state)


def test_changed_values_leave_open_what_was_open() -> None:
    """The thrust of the start follows the mass, unless it was given."""
    assert mission(vehicle__mass=2).start().thrust is None
    assert mission(vehicle__mass=2).values()["start"]["thrust"] == 2 * mission().law().vehicle.gravity
    assert mission(start__thrust=3).with_values({"vehicle.mass": 2}).start().thrust == 3


def test_a_change_does_not_touch_the_mission_it_came_from() -> None:
    first = mission()
    before = copy.deepcopy(first.values())
    assert first.with_values({"path.radius": 2.0}).values()["path"]["radius"] == 2
    assert first.values() == before


def test_arrays_of_numpy_are_values() -> None:
    turned = mission(start__attitude=so3.roll(179), flight__duration=np.float64(0.02))
    assert np.allclose(turned.start().attitude, so3.roll(179), atol=1e-15)


def test_a_change_inside_a_value_is_refused() -> None:
    with pytest.raises(MissionError, match=r"path.radius.small must lie in a table .*path.radius = 1"):
        mission(path__radius=1).with_values({"path.radius.small": 1})


@pytest.mark.parametrize(
    ("poles", "others"), [(-3.0, (-3.0,) * 4), ([-1.0, -2.0, -3.0, -4.0], (-1.0, -2.0, -3.0, -4.0))]
)
def test_one_chain_can_be_changed_of_poles_that_are_given_for_all(poles: Any, others: tuple[float, ...]) -> None:
    """The others keep what the number or the list says of them."""
    own = mission(controller__poles=poles).law().poles
    changed = mission(controller__poles=poles).with_values({"controller.poles.yaw": -1.5}).law().poles
    assert changed == own | {"yaw": (-1.5,)}
    assert changed["transverse"] == others


def test_noise_is_scaled_in_truth_and_not_in_what_the_filter_believes() -> None:
    """Standard deviations are, and biases are not; where nothing is noisy there is nothing to scale."""
    noisy = load("quadrotor").with_values({"sensors.position": {"deviation": 0.01, "bias": 0.2}, "filter": {}})
    scaled = noisy.with_values({"truth.noise_scale": 3.0})
    sensors, law = Parts(scaled.file).sensors, scaled.law()
    assert sensors is not None
    assert np.asarray(sensors.position.deviation) == pytest.approx([0.03] * 3)
    assert np.asarray(sensors.position.bias).tolist() == np.asarray(Parts(noisy.file).sensors.position.bias).tolist()  # type: ignore[union-attr]
    assert law.estimator == noisy.law().estimator
    plain = mission(
        controller__feedback="start", controller__rate=100, noise__position={"deviation": 0.01, "rate": 100}
    )
    noise = Parts(plain.with_values({"truth.noise_scale": 3.0}).file).noise
    assert noise is not None
    assert noise.deviations()[:3] == pytest.approx([0.03] * 3)
    with pytest.raises(MissionError, match=r"^\[truth\] noise_scale needs noise"):
        mission(truth__noise_scale=2.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2", 2),
        ("2.5", 2.5),
        ("[1, 2]", [1, 2]),
        ("true", True),
        ("enu", "enu"),
        ('"enu"', "enu"),
        ("onto a circle", "onto a circle"),
        ("{yaw = -1}", {"yaw": -1}),
        ("1\nframe = 2", "1\nframe = 2"),
        ("", ""),
    ],
)
def test_a_value_is_toml_or_else_text(text: str, expected: object) -> None:
    assert value(text) == expected


def test_the_three_forms_of_an_attitude_agree() -> None:
    """R = Rz(yaw) Ry(pitch) Rx(roll), body to world."""
    yaw, pitch, roll = np.radians([30, -20, 170])
    expected = (
        np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        @ np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
        @ np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    )
    half = np.array([roll, pitch, yaw]) / 2
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    quaternion = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
    for form in (
        {"start__yaw": 30, "start__pitch": -20, "start__roll": 170},
        {"start__quaternion": quaternion},
        {"start__attitude": expected},
    ):
        assert np.allclose(mission(**form).start().attitude, expected, atol=1e-15)


def test_an_attitude_of_few_digits_is_projected_and_its_distance_reported() -> None:
    turned = mission(start__attitude=UPSIDE_DOWN)
    assert so3.drift(turned.start().attitude) < 1e-15
    # singular values of the printed block are both hypot(.9998, .0175)
    assert turned.start_attitude_distance == pytest.approx(np.sqrt(2) * abs(np.hypot(0.9998, 0.0175) - 1), rel=1e-6)
    assert mission(start__quaternion=[1.001, 0, 0, 0]).start_attitude_distance == pytest.approx(1e-3)
    with pytest.raises(RotationError, match=r"\[start\]"):
        mission(start__attitude=np.diag([1, 1, -1]))


def test_the_believed_vehicle_itself_flies_when_nothing_differs() -> None:
    """So the flight is nominal and is compared with its closed form."""
    assert mission().fly().nominal
    assert "oracle" in mission().fly().summary()
    assert not mission(truth__mass_scale=1.01).fly().nominal


def test_truth_scales_mass_and_moments() -> None:
    truth = mission(truth__mass_scale=1.1, truth__inertia_scale=[1.2, 0.9, 1.05]).fly().truth
    assert truth.mass == 0.5 * 1.1
    assert np.allclose(truth.inertia, np.diag([0.0048, 0.0036, 0.00735]), rtol=1e-15)


def test_scaled_inertia_with_products_stays_an_inertia() -> None:
    """D J D is positive definite whatever the scales; one scale for all axes multiplies every entry."""
    full = [[0.004, 1e-3, 0], [1e-3, 0.004, 0], [0, 0, 0.007]]
    truth = mission(vehicle__inertia=full, truth__inertia_scale=1.21).fly().truth
    assert np.allclose(truth.inertia, 1.21 * np.array(full), rtol=1e-15)


def test_noise_keeps_its_density_at_the_control_rate() -> None:
    """s^2 / f is kept: 0.02 at 4 Hz is 0.1 at 100 Hz."""
    noisy = mission(
        controller__feedback="start", controller__rate=100, noise__position={"deviation": 0.02, "rate": [4, 25, 100]}
    )
    noise = Parts(noisy.file).noise
    assert noise is not None
    assert np.allclose(noise.position, [0.1, 0.04, 0.02], rtol=1e-15)
    assert np.array_equal(noise.attitude, SensorNoise().attitude)


def test_the_seed_decides_the_noise() -> None:
    changes = {
        "controller.feedback": "start",
        "controller.rate": 100,
        "noise.position": {"deviation": 0.01, "rate": 10},
        "flight.duration": 0.2,
    }
    first = mission().with_values(changes)
    same, other = first.with_values({}), first.with_values({"flight.seed": 1})
    assert first.fly().state.tobytes() == same.fly().state.tobytes()
    assert first.fly().state.tobytes() != other.fly().state.tobytes()


def test_a_mission_that_cannot_start_is_none() -> None:
    with pytest.raises(SingularStartError, match=r"\[start\].*focal") as caught:
        mission(start__position=[0, 0, 0.3])
    assert caught.value.margins["focal_margin"] < 1e-6


def test_a_file_is_named_in_its_complaints(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(mission().toml().replace("radius", "radus"))
    with pytest.raises(
        MissionError, match=r'mine.toml: unknown key "radus" in \[path\]; did you mean "radius"'
    ) as caught:
        load(file)
    assert caught.value.where == "path.radus"


def test_a_file_is_read_whatever_its_line_ends_and_mark(tmp_path: Path) -> None:
    file = tmp_path / "mine"
    file.write_bytes(b"\xef\xbb\xbf" + mission().toml().replace("\n", "\r\n").encode())
    assert load(str(file)) == load(file) == mission()


def test_a_built_in_name_wins_over_a_folder_of_that_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "loop").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load("loop").title.startswith("multiple flips")
    with pytest.raises(MissionError, match="a directory"):
        load("./loop")


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match='did you mean "upright"') as caught:
        load("uprigth")
    assert caught.value.known == names()


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_path_is_flown_with_its_defaults(name: str) -> None:
    """Guards that a signature alone is enough to read, build and write a section."""
    more = {"coefficients": [[0, 1], [0, 0, 1], [1]]} if name == "polynomial" else {}
    flown = mission(path={"name": name, **more}, start__position=[1.2, 0.1, 0.2])
    assert isinstance(flown.law().path, AnyPath)
    assert flown.fly().completed


ARGUMENTS: dict[str, dict[str, Any]] = {
    "speed": {"speed": 1},
    "ramp": {"speed": 1},
    "point": {"coordinate": 1},
    "stop": {"speed": 1, "coordinate": 30, "braking_time": 1},
    "profile": {"points": [[0, 1], [2, 0.5]], "over": "progress"},
    "legs": {"legs": [{"speed": 1, "to": 2, "hold": 1}, {"speed": -1}]},
    "feasible": {"speed": 1},
}


@pytest.mark.parametrize("kind", REFERENCES)
def test_every_reference_is_flown(kind: str) -> None:
    assert mission(reference={"kind": kind, **ARGUMENTS[kind]}).fly().completed


def test_errors_of_a_mission_are_ours() -> None:
    for bad in ({}, {"vehicle": 3}, SHORT | {"path": {"name": "circle", "radius": -1}}, SHORT | {"frame": "neu"}):
        with pytest.raises(GammastarError):
            Mission.from_values(bad)


def test_progress_in_metres_is_a_key_of_the_path() -> None:
    """An ellipse at 0.5 m/s: the vehicle's own speed is that of the reference, and the places of a schedule are metres."""
    flown = mission(path={"name": "ellipse", "progress": "metres"}, start__position=[2.0, 0.1, 0.2])
    record = flown.with_values({"reference.speed": 0.5, "flight.duration": 12.0}).fly()
    assert np.linalg.norm(record.velocity[-1]) == pytest.approx(0.5, rel=1e-3)
    assert Mission.from_values(flown.values()) == flown
    with pytest.raises(GammastarError, match=r"\[path\].*implicit"):
        mission(path={"name": "circle", "kind": "implicit", "progress": "metres"})

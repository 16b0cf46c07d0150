"""Frames: the same physical mission in `ned` and in `enu`, and records that obey physics in both."""

import dataclasses
import inspect
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from gammastar import so3
from gammastar.flight import FlightRecord
from gammastar.frames import REVERSAL
from gammastar.mission import Mission, load
from gammastar.mission.paths import CATALOGUE as SECTIONS
from gammastar.mission.turn import VECTORS, record_columns

ATTITUDE = so3.yaw(50) @ so3.pitch(-30) @ so3.roll(20)
INERTIA = np.array([[3.65e-3, 1e-4, 2e-4], [1e-4, 3.68e-3, -1e-4], [2e-4, -1e-4, 7.03e-3]])
NED: dict[str, Any] = {
    "vehicle": {
        "mass": 0.5,
        "inertia": INERTIA,
        "gravity": 9.81,
        "bias_acceleration": [0.1, 0.2, -0.3],
        "bias_torque": [1e-3, 2e-3, -3e-3],
    },
    "controller": {"yaw_output": "sinh", "yaw_reference": 0.3},
    "reference": {"kind": "speed", "speed": 1},
    "start": {
        "position": [2.5, 0.6, -0.4],
        "velocity": [0.1, 0.2, 0.3],
        "attitude": ATTITUDE,
        "angular_velocity": [0.1, -0.2, 0.3],
    },
    "flight": {"duration": 4},
}
PATHS: dict[str, dict[str, Any]] = {
    "circle": {"name": "circle", "normal": [0.2, 0.3, 1.0], "center": [0.1, 0.2, 0.3]},
    "circle about the first axis": {"name": "circle", "normal": [1.0, 0.05, 0.1], "center": [0.1, 0.2, 0.3]},
    "implicit circle": {"name": "circle", "kind": "implicit", "normal": [0.2, 0.3, 1.0], "center": [0.1, 0.2, 0.3]},
    "ellipse": {"name": "ellipse", "normal": [0.2, 0.3, -1.0], "center": [0.1, 0.2, 0.3], "semi_axes": [2.0, 1.5]},
    "line": {"name": "line", "point": [1.0, 2.0, 3.0], "along": [1.0, 2.0, -3.0]},
    "helix": {"name": "helix", "axis": [0.2, 0.1, 1.0], "center": [0.1, 0.2, 0.3], "pitch": 0.7},
    "left-handed helix about the first axis": {
        "name": "helix",
        "axis": [1.0, 0.1, 0.1],
        "center": [0.1, 0.2, 0.3],
        "pitch": -0.7,
    },
    "loop": {"name": "loop", "radius": 2.0, "center": [0.0, 0.0, -0.5], "heading": 30.0},
}


NO_VECTORS = ("semi_axes", "amplitudes", "frequencies", "phases", "coefficients", "domain")


def test_every_argument_of_a_path_is_judged() -> None:
    """An argument of several numbers either turns with the frame or is known not to be a vector of space."""
    for name, section in SECTIONS.items():
        parameters = inspect.signature(section.factory(), eval_str=True).parameters
        lists = {key for key, parameter in parameters.items() if parameter.annotation == ArrayLike}
        assert lists <= {*VECTORS, *NO_VECTORS}, name


def reverse(vector: Any) -> list[float]:
    x, y, z = vector
    return [x, -y, -z]


def in_enu(values: dict[str, Any]) -> dict[str, Any]:
    """Return the same physical mission in enu, converted by hand."""
    vehicle, start, path = dict(values["vehicle"]), dict(values["start"]), dict(values["path"])
    vehicle["inertia"] = REVERSAL @ vehicle["inertia"] @ REVERSAL
    for name in ("bias_acceleration", "bias_torque"):
        vehicle[name] = reverse(vehicle[name])
    for name in ("position", "velocity", "angular_velocity"):
        start[name] = reverse(start[name])
    start["attitude"] = REVERSAL @ start["attitude"] @ REVERSAL
    for name in VECTORS:
        if name in path:
            path[name] = reverse(path[name])
    if "heading" in path:  # from the first axis towards the second, which points the other way
        path["heading"] *= -1
    controller = values["controller"] | {"yaw_reference": -values["controller"]["yaw_reference"]}
    changed = {"frame": "enu", "vehicle": vehicle, "start": start, "path": path, "controller": controller}
    if "heading" in values:
        changed["heading"] = {key: reverse(item) if key in VECTORS else item for key, item in values["heading"].items()}
    return values | changed


HEADINGS: dict[str, dict[str, Any]] = {
    "along": {"kind": "along"},
    "azimuth": {"kind": "azimuth", "direction": [1.0, 2.0, 0.5]},
    "towards": {"kind": "towards", "point": [0.5, 1.0, -1.0]},
}
SECTIONS_BESIDE: dict[str, dict[str, Any]] = {
    **{name: {"path": path} for name, path in PATHS.items()},
    **{name: {"heading": heading, "controller": {"yaw_reference": 0.0}} for name, heading in HEADINGS.items()},
    "approach": {"approach": {"speed": 0.5}},
}


@pytest.mark.parametrize("name", SECTIONS_BESIDE)
def test_the_same_physical_mission_flies_the_same_in_both_frames(name: str) -> None:
    values = NED | {"path": PATHS["circle"]} | SECTIONS_BESIDE[name]
    down, up = Mission.from_values(values).fly(), Mission.from_values(in_enu(values)).fly()
    assert down.completed
    assert np.abs(up.state - down.state).max() < 1e-9
    one, two = record_columns(down, "ned"), record_columns(up, "enu")
    for axis, sign in zip("xyz", (1, -1, -1), strict=True):
        for quantity in ("position", "velocity", "angular_velocity", "torque"):
            assert np.abs(two[f"{quantity}_{axis}"] - sign * one[f"{quantity}_{axis}"]).max() < 1e-9
    for number in ("time_s", "thrust", "xi_11", "xi_24", "eta_11", "eta_14", "distance_m", "focal_margin"):
        assert np.abs(two[number] - one[number]).max() < 1e-9
    assert np.abs(two["eta_21"] + one["eta_21"]).max() < 1e-9


def vectors(columns: dict[str, np.ndarray], name: str) -> np.ndarray:
    return np.column_stack([columns[f"{name}_{axis}"] for axis in "xyz"])


@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_written_rows_obey_the_equations_of_motion_in_their_frame(frame: str) -> None:
    """Differences of the rows against Newton and Euler, with the third axis down or up; every sign of the frame takes part.

    Central differences over 1 ms are good to 1e-6 times the third derivatives, here below 1e-3 of each quantity.
    """
    values = NED | {"path": PATHS["loop"], "frame": frame}
    columns = record_columns(Mission.from_values(values).fly(), frame)
    up = 1.0 if frame == "enu" else -1.0
    attitude = np.array([[columns[f"r{i}{j}"] for j in (1, 2, 3)] for i in (1, 2, 3)]).transpose(2, 0, 1)
    rates, thrust = vectors(columns, "angular_velocity"), columns["thrust"][:, None]
    inertia, bias_torque, bias = INERTIA, NED["vehicle"]["bias_torque"], NED["vehicle"]["bias_acceleration"]

    def slope(quantity: np.ndarray) -> np.ndarray:
        return (quantity[2:] - quantity[:-2]) / 2e-3

    inside = slice(1, -1)
    gravity = np.array([0, 0, -up * 9.81])
    acceleration = gravity + up * thrust / 0.5 * attitude[:, :, 2] - bias  # thrust pushes towards the body's own up
    assert np.abs(slope(vectors(columns, "position")) - vectors(columns, "velocity")[inside]).max() < 1e-4
    assert np.abs(slope(vectors(columns, "velocity")) - acceleration[inside]).max() < 1e-2
    turning = np.array([R @ so3.hat(w) for R, w in zip(attitude[inside], rates[inside], strict=True)])
    assert np.abs(slope(attitude) - turning).max() < 1e-3
    torque = slope(rates) @ inertia + np.cross(rates, rates @ inertia)[inside] + bias_torque
    assert np.abs(torque - vectors(columns, "torque")[inside]).max() < 1e-2 * np.abs(torque).max()
    assert np.abs(columns["eta_21"] - np.sinh(rates[:, 2])).max() < 1e-12


def test_angles_of_a_start_are_about_the_axes_of_its_frame() -> None:
    """In enu a positive yaw turns the first body axis towards the second world axis, a positive pitch the first one down."""
    base = NED | {"path": PATHS["circle"], "frame": "enu"}
    without = {key: value for key, value in base["start"].items() if key != "attitude"}

    def first_axis(**angles: float) -> np.ndarray:
        start = Mission.from_values(base | {"start": without | angles}).start()
        return REVERSAL @ np.asarray(start.attitude)[:, 0]

    assert np.allclose(first_axis(yaw=90.0), [0, 1, 0], atol=1e-15)
    assert np.allclose(first_axis(pitch=90.0), [0, 0, -1], atol=1e-15)


def test_defaults_are_read_in_the_mission_s_frame() -> None:
    """The default circle runs right-handed about the third axis of its frame: anticlockwise seen from above in enu."""
    for frame, side in (("ned", 1), ("enu", -1)):
        path = Mission.from_values(NED | {"path": {"name": "circle"}, "frame": frame}).law().path
        assert np.allclose(path.points(np.array([np.pi / 2])), [[0, side, 0]], atol=1e-15)


def test_a_loop_starts_at_its_lowest_point_in_both_frames() -> None:
    for frame, second in (("ned", 1), ("enu", -1)):
        path = Mission.from_values(NED | {"path": PATHS["loop"], "frame": frame}).law().path
        center = np.array(PATHS["loop"]["center"]) * [1, 1, second]
        forward = np.array([np.cos(np.pi / 6), second * np.sin(np.pi / 6), 0])
        lowest, ahead, top = path.points(np.array([0, np.pi / 2, np.pi])) - center
        assert np.allclose(lowest, [0, 0, 2], atol=1e-15)
        assert np.allclose(ahead, 2 * forward, atol=1e-15)
        assert np.allclose(top, [0, 0, -2], atol=1e-15)


def test_a_formula_is_read_in_the_mission_s_frame() -> None:
    """The circle of varying height is written in axes: its height is depth in ned and height in enu."""
    angles = np.linspace(0, 6, 50)
    down, up = (
        Mission.from_values(NED | {"path": {"name": "nonplanar_circle"}, "frame": frame}).law().path.points(angles)
        for frame in ("ned", "enu")
    )
    assert np.allclose(up, down * [1, -1, -1], atol=1e-15)


def test_a_record_in_ned_is_written_as_it_is() -> None:
    record: FlightRecord = load("upright").with_values({"flight.duration": 0.01}).fly()
    columns, written = record.columns(), record_columns(record, "ned")
    assert list(columns) == list(written)
    assert all(np.array_equal(columns[name], written[name]) for name in columns)
    assert dataclasses.is_dataclass(record)

"""The missions that come with gammastar: each flies, settles, and does what its first lines say."""

import functools
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from gammastar import design, paths
from gammastar.errors import SingularStartError
from gammastar.flight import FlightRecord
from gammastar.law.design import DEFAULT_POLES
from gammastar.mission import load, names
from gammastar.path import ImplicitPath, ParametricPath
from strategies import PAPER_POSITION, PAPER_VEHICLE, UPRIGHT, UPSIDE_DOWN

FLIGHTS = 100
APPROACHING = (
    "anywhere",
    "waypoints",
)  # from so far away that the law is bent, so there is no closed form of the whole flight


REAL = (
    "any-attitude",
    "crazyflie",
    "hexarotor",
    "quadrotor",
    "tail-sitter",
    "underwater",
)  # through rotors, with an autopilot


@functools.cache
def flown(name: str) -> FlightRecord:
    return load(name).fly()


def test_the_names_are_these() -> None:
    assert names() == [
        "any-attitude",
        "anywhere",
        "crazyflie",
        "helix",
        "hexarotor",
        "knot",
        "loop",
        "noisy",
        "quadrotor",
        "replanned",
        "satellite",
        "stop",
        "tail-sitter",
        "underwater",
        "upright",
        "upside-down",
        "waypoints",
    ]


def test_the_reference_lists_every_mission() -> None:
    page = (Path(__file__).parents[2] / "docs" / "reference" / "missions.md").read_text(encoding="utf-8")
    listed = re.findall(
        r"`([\w-]+)`", " ".join(re.findall(r"^\| (`[^|]*) \|", page.split("## Built in")[1].split("## Paths")[0], re.M))
    )
    assert sorted(listed) == names()


@pytest.mark.parametrize("name", names())
def test_every_mission_explains_itself(name: str) -> None:
    text = (resources.files("gammastar") / "missions" / f"{name}.toml").read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert 10 < len(load(name).title) < 90


@pytest.mark.parametrize("name", names())
def test_every_mission_settles(name: str) -> None:
    summary = flown(name).summary()
    assert summary["status"] == "completed"
    assert summary["settled"]
    assert summary["thrust_N"]["min"] > 0
    assert summary["so3_drift"] <= 1e-12


@pytest.mark.parametrize("name", [name for name in names() if name not in {"noisy", "replanned", *APPROACHING, *REAL}])
def test_every_nominal_mission_flies_its_closed_form(name: str) -> None:
    summary = flown(name).summary()
    assert summary["distance_m"]["max_after_settling"] <= 1e-3
    assert summary["oracle"]["max_position_error_m"] <= 1e-8


@pytest.mark.parametrize("name", APPROACHING)
def test_an_approach_bends_the_law_and_then_leaves_it_alone(name: str) -> None:
    record = flown(name)
    assert record.constrained.any()
    assert not record.constrained[record.time > 6].any()
    summary = record.summary()
    assert summary["distance_m"]["max_after_settling"] <= 1e-3
    assert summary["distance_m"]["max_last_quarter"] <= 1e-9
    assert summary["settling_time_s"]["measured"] < 10


@pytest.mark.parametrize(("name", "most"), list(zip(REAL, (1e-2, 5e-3, 1e-3, 1e-2, 1e-5, 1e-3), strict=True)))
def test_real_vehicles_keep_to_their_paths_within_their_rotors(name: str, most: float) -> None:
    """What is unknown leaves millimetres, gusts and noise up to 1 cm; the tail-sitter's lift is known, and leaves micrometres."""
    record = flown(name)
    summary = record.summary()
    assert summary["distance_m"]["max_last_quarter"] < most
    rotors, speeds = record.truth.rotors, record.autopilot.rotor_speeds
    assert speeds.min() >= rotors.slowest
    assert speeds.max() <= rotors.fastest
    assert not record.autopilot.given_up[record.time > 0.75 * record.time[-1]].any()


def test_lift_carries_the_tail_sitter() -> None:
    """In fast flight its thrust is below a third of its weight."""
    record = flown("tail-sitter")
    assert record.thrust[-1] < record.truth.weight / 3
    assert np.linalg.norm(record.velocity[-1]) == pytest.approx(8.0, abs=1e-3)


def test_the_satellite_keeps_within_its_thruster_and_wheels() -> None:
    record = flown("satellite")
    assert record.truth.gravity == 0
    assert record.thrust.max() <= 0.475
    assert np.abs(record.torque).max() <= 2e-4
    assert record.thrust[-1] == pytest.approx(5.0 * 2.0 * 0.15**2, rel=1e-3)  # centripetal


@pytest.mark.parametrize("name", [name for name in names() if name != "noisy"])
def test_every_mission_settles_also_by_body_rates(name: str) -> None:
    """Thrust and body rates through an inner loop of 20 rad/s: within 5 mm, in gusts or with noisy sensors 1 cm."""
    within = 1e-2 if name in ("any-attitude", "quadrotor") else 5e-3
    summary = load(name).with_values({"controller.interface": "rates", "flight.settled_within": within}).fly().summary()
    assert summary["settled"]
    assert summary["distance_m"]["max_last_quarter"] < within


def test_the_start_on_the_axis_is_a_focal_point() -> None:
    record = flown("anywhere")
    assert record.focal_margin[0] == 0
    assert record.waiting[0]
    with pytest.raises(SingularStartError):
        design(record.law.vehicle, record.law.path).start_vector(record.start)


def off_nose(record: FlightRecord, wanted: np.ndarray, after: float) -> float:
    """Return the largest angle [deg] about the third body axis from the nose to directions (n, 3), late in a flight."""
    late = record.time > after
    side, front = (np.einsum("ni,ni->n", record.attitude[late, :, k], wanted[late]) for k in (1, 0))
    return float(np.abs(np.degrees(np.arctan2(side, front))).max())


@pytest.mark.parametrize(("name", "angle"), [("anywhere", 1e-6), ("waypoints", 8.0)])
def test_the_nose_is_along_the_path(name: str, angle: float) -> None:
    """It is there on a circle, and lags a little where the turning of the tangent changes."""
    record = flown(name)
    assert isinstance(record.law.path, ParametricPath)
    assert off_nose(record, record.law.path.tangents(record.tangential_state[:, 0]), 15) < angle


def test_the_nose_is_towards_the_middle_of_the_knot() -> None:
    record = flown("knot")
    assert off_nose(record, [0, 0, -3] - record.position, 15) < 4


def test_the_track_goes_through_its_waypoints() -> None:
    mission, record = load("waypoints"), flown("waypoints")
    for point in mission.values()["path"]["points"]:
        gaps = np.linalg.norm(record.position[record.time > 15] - np.multiply(point, [1, -1, -1]), axis=1)
        assert gaps.min() < 3e-3  # rows are 4 mm apart


def test_the_replanned_flight_ends_at_the_end_of_its_new_path() -> None:
    """It is on the track when the path is replaced, on the new one before its end, and holds there."""
    record = flown("replanned")
    row = record.phases[1].row
    assert record.time[row] == pytest.approx(12)
    assert record.distance[row - 1] < 1e-6
    assert record.distance[row] > 1
    assert record.position[-1] == pytest.approx([2, -4, -1], abs=1e-7)
    assert np.abs(record.velocity[record.time > 29]).max() < 1e-6
    on_the_way = (record.distance < 1e-3) & (record.time > 12) & (np.linalg.norm(record.velocity, axis=1) > 0.5)
    assert on_the_way.any()


def test_the_knot_is_the_trefoil_of_the_catalogue() -> None:
    knot, angles = load("knot").with_values({"path.rotation": {}}).law().path, np.linspace(0, 6, 40)
    expected = paths.trefoil(radius=3.0, height=-1.0).points(angles) * [1, -1, -1] - [0, 0, 3]
    assert np.allclose(knot.points(angles), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "attitude"), [("upright", UPRIGHT), ("upside-down", UPSIDE_DOWN), ("noisy", UPSIDE_DOWN)]
)
def test_the_paper_s_scenarios_are_the_paper_s(name: str, attitude: tuple[tuple[float, ...], ...]) -> None:
    mission = load(name)
    law, values = mission.law(), mission.values()
    assert law.vehicle.mass == PAPER_VEHICLE.mass
    assert law.vehicle.gravity == PAPER_VEHICLE.gravity
    assert np.array_equal(law.vehicle.inertia, PAPER_VEHICLE.inertia)
    assert isinstance(law.path, ImplicitPath)
    assert values["path"]["coordinates"] == "quadratic"
    assert values["path"]["center"] == [0, 0, 10]
    assert values["start"]["position"] == list(PAPER_POSITION)
    assert np.array_equal(values["start"]["attitude"], attitude)
    assert values["reference"] == {"kind": "speed", "speed": 1}
    if name != "noisy":
        assert law.poles["transverse"] == DEFAULT_POLES
        assert (values["flight"]["duration"], values["flight"]["step"]) == (20, 1e-3)


def test_the_loop_flips_once_a_lap_for_five_laps() -> None:
    record = flown("loop")
    laps = (record.tangential_state[-1, 0] - record.tangential_state[0, 0]) / (2 * np.pi)
    assert laps > 5
    assert record.flips() == int(laps + 0.5)  # one for every time it was at the top
    radius, gravity = 2.0, record.truth.gravity
    assert record.tangential_state[-1, 1] * radius > 1.2 * np.sqrt(gravity * radius)
    top = record.attitude[np.cos(record.tangential_state[:, 0]) < -0.999, 2, 2]
    assert (top < -0.9).all()  # upside down whenever it passes the top


def test_the_helix_climbs_and_does_not_close() -> None:
    record = flown("helix")
    assert record.law.path.period is None
    settled = record.time > 10
    height, turns = -record.position[settled, 2], record.tangential_state[settled, 0] / (2 * np.pi)
    assert np.abs(height - 1.0 * turns).max() < 1e-3
    assert height[-1] - height[0] > 1.5
    turn = np.cross(record.velocity[settled][:-1], np.diff(record.velocity[settled], axis=0))
    assert (turn[:, 2] < 0).all()  # third axis down: to the left


def test_the_stop_holds_its_point() -> None:
    record = flown("stop")
    held = record.time > 17
    assert np.abs(record.position[held] - [-2, 0, -2]).max() < 1e-6
    assert np.abs(record.velocity[held]).max() < 1e-6
    assert record.tangential_state[-1, 0] - record.tangential_state[0, 0] > 2 * np.pi  # after a whole lap


def test_a_hundred_flights_of_the_noisy_mission_settle() -> None:
    """The RMS distances stand in the mission's first lines; their spread over flights is a tenth of their size."""
    mission = load("noisy")
    flights = mission.fly_many([mission.start()] * FLIGHTS)
    assert set(flights["status"]) == {"completed"}
    assert np.isfinite(flights["settling_time_s"]).all()
    distances = flights["rms_distance_last_quarter_m"]
    print(f"RMS distance of {FLIGHTS} flights: {np.sqrt(np.mean(distances**2)):.4f} m, at most {distances.max():.4f} m")
    assert distances.max() < 0.06

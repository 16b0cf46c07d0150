"""The missions that come with gammastar: each flies, settles, and does what its first lines say."""

import functools
from importlib import resources

import numpy as np
import pytest

from gammastar.flight import FlightRecord
from gammastar.law.design import DEFAULT_POLES
from gammastar.mission import load, names
from gammastar.path import ImplicitPath
from strategies import PAPER_POSITION, PAPER_VEHICLE, UPRIGHT, UPSIDE_DOWN

SEEDS = 100


@functools.cache
def flown(name: str) -> FlightRecord:
    return load(name).fly()


def test_the_names_are_these() -> None:
    assert names() == ["helix", "loop", "noisy", "stop", "upright", "upside-down"]


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


@pytest.mark.parametrize("name", [name for name in names() if name != "noisy"])
def test_every_nominal_mission_flies_its_closed_form(name: str) -> None:
    summary = flown(name).summary()
    assert summary["distance_m"]["max_after_settling"] <= 1e-3
    assert summary["oracle"]["max_position_error_m"] <= 1e-8


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


def test_a_hundred_seeds_of_the_noisy_mission_settle() -> None:
    """The RMS distances stand in the mission's first lines; their spread over seeds is a tenth of their size."""
    distances = []
    for seed in range(SEEDS):
        summary = load("noisy").with_values({"flight.seed": seed}).fly().summary()
        assert summary["settled"], seed
        distances.append(summary["distance_m"]["rms_after_settling"])
    print(
        f"RMS distance over {SEEDS} seeds: {np.sqrt(np.mean(np.square(distances))):.4f} m, at most {max(distances):.4f} m"
    )
    assert max(distances) < 0.06

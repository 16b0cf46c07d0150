"""The rows of a campaign: what is drawn is what is flown, row k is the flight k whoever flies it, and what is refused is a row."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gammastar as gs
from gammastar.campaign.flown import rows
from gammastar.campaign.setting import Setting
from gammastar.errors import InputError, MissionError
from gammastar.mission import Mission, load
from gammastar.vehicle import Scales, scaled

SHORT = {"flight.duration": 0.1}
EVERYTHING: list[dict[str, Any]] = [
    {"quantity": "start.attitude", "kind": "any"},
    {"quantity": "start.position", "kind": "ball", "radius": 0.5, "center": [1.0, 0.2, 2.5]},
    {"quantity": "start.velocity", "kind": "box", "low": [-1, -1, -1], "high": [1, 1, 1]},
    {"quantity": "start.angular_velocity", "kind": "normal", "mean": [0, 0, 0], "deviation": [1, 1, 1]},
    {"quantity": "truth.mass_scale", "kind": "uniform", "low": 0.9, "high": 1.2},
    {"quantity": "truth.inertia_scale", "kind": "list", "choices": [[0.95, 1.0, 1.0], [1.0, 1.0, 0.9]]},
    {"quantity": "truth.thrust_scale", "kind": "grid", "choices": [0.95, 1.05]},
    {"quantity": "truth.force_scale", "kind": "log-uniform", "low": 0.5, "high": 2.0},
    {"quantity": "wind.mean", "kind": "box", "low": [-2, -2, 0], "high": [2, 2, 1]},
]


def varied(mission: Mission, *vary: dict[str, Any], changes: dict[str, Any] = SHORT, **campaign: Any) -> Mission:
    return mission.with_values(changes | {"campaign": {"vary": list(vary), **campaign}})


@pytest.fixture(scope="module")
def quadrotor() -> Mission:
    """In `enu`, with rotors, forces, mass_scale 1.1 and wind of its own, all of which flights replace."""
    return load("quadrotor")


@pytest.fixture(scope="module")
def circle() -> Mission:
    """In `ned`, the law by itself."""
    return load("upright").with_values({"flight.step": 5e-3, "flight.duration": 0.1})


def listed(setting: Setting, numbers: Any) -> list[dict[str, Any]]:
    return list(rows(setting, numbers, "casadi").to_pylist())


def test_what_is_drawn_is_what_is_flown(quadrotor: Mission) -> None:
    """Every row is the flight of a mission that has the row's own values, flown by itself, in the mission's frame `enu`."""
    setting = Setting(varied(quadrotor, *EVERYTHING), seed=5)
    numbers = np.array([2, 7])
    values = setting.sample(numbers)
    for k, row in enumerate(rows(setting, numbers, "casadi").to_pylist()):
        drawn = {name: each[k].tolist() for name, each in values.items()}
        alone = quadrotor.with_values(
            {**SHORT, "flight.seed": 5, "flight.number": int(numbers[k])}
            | {"start": {name.removeprefix("start."): drawn.pop(name) for name in list(drawn) if "start" in name}}
            | drawn
        )
        told = alone.fly().summary()
        assert row["max_distance_m"] == pytest.approx(told["distance_m"]["max"], rel=1e-9)
        assert row["peak_rate_rad_s"] == pytest.approx(told["peak_rate_rad_s"], rel=1e-9)
        assert row["max_thrust_N"] == pytest.approx(told["thrust_N"]["max"], rel=1e-9)
        assert row["truth.mass_scale"] == drawn["truth.mass_scale"]
        assert [row[f"wind.mean.{axis}"] for axis in "xyz"] == drawn["wind.mean"]
        assert row["truth.thrust_scale"] == (0.95, 1.05)[numbers[k] % 2]
        assert [row[f"truth.inertia_scale.{axis}"] for axis in "xyz"] == drawn["truth.inertia_scale"]


def test_a_row_depends_on_its_number_alone(quadrotor: Mission) -> None:
    setting = Setting(varied(quadrotor, *EVERYTHING[:5]), seed=5)
    together = listed(setting, range(5))
    assert repr(listed(setting, [4, 1])) == repr([together[4], together[1]])
    assert [row["flight"] for row in together] == list(range(5))
    assert repr(listed(Setting(setting.mission, seed=6), [1])) != repr([together[1]])


@pytest.mark.parametrize(("frame", "upright"), [("ned", -1.0), ("enu", 1.0)])
def test_starts_are_told_in_the_mission_s_frame(
    circle: Mission, quadrotor: Mission, frame: str, upright: float
) -> None:
    """Attitude and position of a row are those drawn; the tilt counts from upright, and directions are azimuths."""
    mission = circle if frame == "ned" else quadrotor
    setting = Setting(varied(mission, EVERYTHING[0], EVERYTHING[1] | {"center": [1.5, 0.0, 3.0]}), seed=1)
    values = setting.sample(np.arange(4))
    for row, turned, place in zip(
        listed(setting, range(4)), values["start.attitude"], values["start.position"], strict=True
    ):
        assert [row[f"start_position_{axis}_m"] for axis in "xyz"] == pytest.approx(place)
        top = upright * turned[:, 2]
        assert np.cos(np.radians(row["start_tilt_deg"])) == pytest.approx(upright * top[2])
        azimuth, level = np.radians(row["start_tilt_direction_deg"]), np.sin(np.radians(row["start_tilt_deg"]))
        assert level * np.array([np.cos(azimuth), np.sin(azimuth)]) == pytest.approx(top[:2])
        assert np.radians(row["start_heading_deg"]) == pytest.approx(np.arctan2(turned[1, 0], turned[0, 0]))


def test_a_start_along_the_path_is_on_it(circle: Mission) -> None:
    vary = {"quantity": "start.position", "kind": "along", "low": 0.25, "high": 0.5}
    table = rows(Setting(varied(circle, vary), seed=1), range(3), "casadi")
    x, y, z = (table[f"start_position_{axis}_m"].to_numpy() for axis in "xyz")
    np.testing.assert_allclose(np.hypot(x, y), 1.0, atol=1e-9)
    np.testing.assert_allclose(z, 10.0, atol=1e-9)
    assert np.all((x <= 0) & (y >= 0))


def test_a_start_beside_the_path_is_in_a_ball_about_it(quadrotor: Mission) -> None:
    """In the mission's frame `enu`; in a ball of radius r the mean square distance from the middle is 3/5 r^2."""
    vary = {"quantity": "start.position", "kind": "along", "radius": 0.1}
    setting = Setting(varied(quadrotor, vary), seed=1)
    numbers = np.arange(1000)
    (case,) = setting.cases(numbers, setting.sample(numbers))
    x, y, z = case.starts().position.T
    distances = np.hypot(np.hypot(x, y) - 1.0, z - 2.0)  # across the circle: two of three coordinates
    assert distances.max() < 0.1
    assert np.mean(distances**2) == pytest.approx(2 / 3 * 0.6 * 0.01, rel=0.1)


def test_flights_of_changed_missions_have_their_own_values_too(circle: Mission) -> None:
    """A mass that is drawn stands in place of the mission's own in every mission of a list."""
    mass = {"quantity": "truth.mass_scale", "kind": "uniform", "low": 0.9, "high": 1.1}
    methods = {"quantity": "flight.integrator", "kind": "list", "choices": ["rkmk4", "cf4"]}
    own = circle.with_values({"truth.mass_scale": 1.5})
    (row,) = listed(Setting(varied(own, mass, methods), seed=0), [3])
    values = {name: row[name] for name in ("truth.mass_scale", "flight.integrator")}
    alone = own.with_values(values).fly().summary()
    assert row["max_thrust_N"] == pytest.approx(alone["thrust_N"]["max"], rel=1e-9)
    assert row["min_free_fall_margin_m_s2"] == pytest.approx(alone["margin_min"]["free_fall_m_s2"], rel=1e-9)


def test_lists_and_grids_are_for_any_key(circle: Mission) -> None:
    """What is not in the reach of one mission is flown by several; the row tells a number, a text, or the place in the list."""
    vary = [
        {"quantity": "flight.integrator", "kind": "grid", "choices": ["rkmk4", "cf4"]},
        {"quantity": "controller.poles", "kind": "grid", "choices": [-2.0, -3.0]},
        {"quantity": "path.center", "kind": "list", "choices": [[0.0, 0.0, 9.0], [0.0, 0.0, 11.0]]},
    ]
    setting = Setting(varied(circle, *vary), seed=0)
    for row in listed(setting, range(4)):
        poles, integrator = (-2.0, -3.0)[row["flight"] % 2], ("rkmk4", "cf4")[row["flight"] // 2]
        assert (row["controller.poles"], row["flight.integrator"]) == (poles, integrator)
        center = [0.0, 0.0, (9.0, 11.0)[row["path.center"]]]
        changes = {"controller.poles": poles, "flight.integrator": integrator, "path.center": center}
        alone = circle.with_values(changes).fly()
        assert row["max_thrust_N"] == pytest.approx(alone.thrust.max(), rel=1e-9)
        assert row["max_distance_m"] == pytest.approx(alone.distance.max(), rel=1e-9)


def test_what_is_refused_is_a_row_with_its_cause(circle: Mission) -> None:
    """A mass below zero, a path that is none, and a start on the axis of the circle: the other flights are what they are without."""
    mass = {"quantity": "truth.mass_scale", "kind": "grid", "choices": [1.0, -1.0, 1.1]}
    radius = {"quantity": "path.radius", "kind": "grid", "choices": [1.0, -1.0]}
    place = {"quantity": "start.position", "kind": "grid", "choices": [[3.0, 0.0, 5.0], [0.0, 0.0, 5.0]]}
    table = listed(Setting(varied(circle, mass, radius, place), seed=0), range(12))
    for k, row in enumerate(table):
        m, r, p = np.unravel_index(k, (3, 2, 2))
        if r == 1:
            assert row["status"] == "refused"
            assert "radius [m] must be greater than 0" in row["cause"]
        elif m == 1:
            assert row["status"] == "refused"
            assert "mass_scale must be finite and positive" in row["cause"]
        elif p == 1:
            assert row["status"] == "singular_start"
            assert row["cause"] == gs.Status.SINGULAR_START.value
        else:
            assert (row["status"], row["cause"]) == ("completed", "")
        assert np.isnan(row["max_distance_m"]) == (row["status"] != "completed")
        assert not row["settled"]


def test_those_that_a_look_refuses_leave_the_others_in_one_batch(
    circle: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By a mass, a place beyond all range, or poles; halves and halves of a batch would take many."""
    batches = list[int]()
    fly = Mission.fly_many

    def counted(self: Mission, starts: Any, *given: Any, **named: Any) -> Any:
        batches.append(len(starts))
        return fly(self, starts, *given, **named)

    monkeypatch.setattr(Mission, "fly_many", counted)
    mass = {"quantity": "truth.mass_scale", "kind": "grid", "choices": [1.0, -1.0, 1.1]}
    place = {"quantity": "start.position", "kind": "grid", "choices": [[3.0, 0.0, 5.0], [1e60, 0.0, 5.0]]}
    poles = {"quantity": "controller.poles", "kind": "grid", "choices": [-2.0, 2.0]}
    table = listed(Setting(varied(circle, mass, place, poles), seed=0), range(12))
    assert [row["flight"] for row in table if row["status"] != "refused"] == [0, 8]
    assert batches == [2]


def test_a_body_that_cannot_be_is_refused(quadrotor: Mission) -> None:
    """No body has a moment of inertia larger than the sum of the other two."""
    scales = {"quantity": "truth.inertia_scale", "kind": "grid", "choices": [[0.8, 1.0, 1.2], [1.0, 1.0, 1.0]]}
    first, second = listed(Setting(varied(quadrotor, scales), seed=0), range(2))
    assert first["status"] == "refused"
    assert first["cause"].startswith("[truth] inertia [kg m^2] must satisfy the triangle inequality")
    assert second["status"] == "completed"


def test_a_flight_that_settled_says_so(circle: Mission) -> None:
    within = {"flight.settled_within": 100.0, **SHORT}
    vary = {"quantity": "truth.mass_scale", "kind": "uniform", "low": 0.99, "high": 1.01}
    assert [row["settled"] for row in listed(Setting(varied(circle, vary, changes=within), seed=0), range(2))] == [
        True
    ] * 2


@pytest.mark.parametrize(
    ("vary", "said"),
    [
        ({"quantity": "truth.thrust_scale", "kind": "uniform", "low": 0.9, "high": 1.1}, "a vehicle with rotors"),
        ({"quantity": "truth.force_scale", "kind": "uniform", "low": 0.9, "high": 1.1}, "a vehicle with forces"),
        (
            {"quantity": "wind.mean", "kind": "box", "low": [0, 0, 0], "high": [1, 1, 1]},
            "wind needs a vehicle that feels it",
        ),
        ({"quantity": "controler.poles", "kind": "list", "choices": [-1.0]}, "controller"),
        ({"quantity": "controller.poles", "kind": "list", "choices": ["fast"]}, "poles must hold numbers only"),
        (
            {"quantity": "truth.mass_scale", "kind": "list", "choices": [1.0, True]},
            r"mass_scale must be a number \(got true\)",
        ),
    ],
)
def test_what_makes_no_difference_or_no_mission_is_refused_at_once(
    circle: Mission, vary: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        Setting(varied(circle, vary), seed=0)


def test_a_mission_without_a_campaign_is_refused(circle: Mission) -> None:
    with pytest.raises(MissionError, match=r"must have a mission with \[campaign\]"):
        Setting(circle, seed=0)


def test_forces_are_scaled_in_a_mission_too(quadrotor: Mission) -> None:
    """All but buoyancy, of the believed ones or of those in [truth]."""
    truth = quadrotor.with_values({"truth.force_scale": 2.0}).truth()
    assert truth.signature == scaled(quadrotor.truth(), Scales(force=2.0)).signature

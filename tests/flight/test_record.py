"""The record of a flight: what its arrays mean, how flips are counted, what the summary says."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from gammastar import so3
from gammastar.flight import FlightRecord, Status, fly
from gammastar.law import Along, design
from gammastar.path import catalogue as paths
from gammastar.vehicle import State, Vehicle, split
from gammastar.vehicle.state import NAMES
from strategies import PAPER_VEHICLE, PATHS, VEHICLES, numbers, rotations


def flown() -> FlightRecord:
    law = design(VEHICLES["loaded"], PATHS["circle"], poles=-3)
    return fly(
        law,
        State((1.3, 0.1, 9.9), attitude=so3.roll(40), angular_velocity=(0, 0, 0.5)),
        speed=1.0,
        duration=8.0,
        step=4e-3,
    )


RECORD = flown()


def with_attitudes(attitudes: np.ndarray) -> FlightRecord:
    """Return a record whose attitudes (n, 3, 3) are these and whose other numbers do not matter."""
    state = np.zeros((len(attitudes), 20))
    state[:, 6:15] = attitudes.swapaxes(1, 2).reshape(-1, 9)
    return dataclasses.replace(RECORD, state=state)


def test_the_parts_of_a_record_are_those_of_its_states() -> None:
    for row in (0, 700, -1):
        parts = split(RECORD.state[row])
        assert np.array_equal(RECORD.position[row], parts.position)
        assert np.array_equal(RECORD.velocity[row], parts.velocity)
        assert np.array_equal(RECORD.attitude[row], so3.unstack(RECORD.state[row, 6:15]))
        assert np.array_equal(RECORD.angular_velocity[row], parts.angular_velocity)
        assert RECORD.thrust[row] == parts.thrust
        assert np.array_equal(RECORD.internal_state[row], [*RECORD.state[row, 6:12], parts.thrust])
    assert np.array_equal(RECORD.torque, RECORD.input[:, 1:])


def test_attitude_moves_with_the_body_rates() -> None:
    """R' = R hat(Omega): the record's own rotation between two rows, in body axes, over the time between them."""
    for row in (0, 500, 1500):
        moved = so3.log(RECORD.attitude[row].T @ RECORD.attitude[row + 1]) / 4e-3
        middle = (RECORD.angular_velocity[row] + RECORD.angular_velocity[row + 1]) / 2
        assert moved == pytest.approx(middle, abs=1e-3)


def test_the_recorded_input_drives_the_recorded_motion() -> None:
    """zeta2' = u_d and J Omega' = tau - Omega x J Omega - K_r, by central differences."""
    step, rows = 2 * 4e-3, slice(1, -1)
    ddot = (RECORD.state[2:, 19] - RECORD.state[:-2, 19]) / step
    assert ddot == pytest.approx(RECORD.input[rows, 0], abs=2e-2 * np.abs(RECORD.input[:, 0]).max())
    omega, J = RECORD.angular_velocity, RECORD.truth.inertia
    spin = (omega[2:] - omega[:-2]) / step
    torque = spin @ J + np.cross(omega[rows], omega[rows] @ J) + RECORD.truth.bias_torque
    assert torque == pytest.approx(RECORD.torque[rows], abs=2e-2 * np.abs(RECORD.torque).max())


def test_columns_name_every_number_once() -> None:
    columns = RECORD.columns()
    assert list(columns)[:21] == ["time_s", *NAMES]
    assert all(values.shape == RECORD.time.shape for values in columns.values())
    assert np.array_equal(columns["r32"], RECORD.attitude[:, 2, 1])
    assert np.array_equal(columns["xi_24"], RECORD.transverse_state[:, 1, 3])
    assert np.array_equal(columns["eta_13"], RECORD.tangential_state[:, 2])
    assert np.array_equal(columns["torque_z"], RECORD.torque[:, 2])


def test_columns_tell_the_mode_of_tracking() -> None:
    """Where the vehicle waits and where the approach bends the law, as true and false."""
    waiting = np.arange(len(RECORD.time)) < 5
    columns = dataclasses.replace(RECORD, waiting=waiting, constrained=~waiting).columns()
    assert columns["waiting"].dtype == columns["constrained"].dtype == bool
    assert np.array_equal(columns["waiting"], waiting)
    assert np.array_equal(columns["constrained"], ~waiting)


# --- flips -----------------------------------------------------------------------------------------------------------


def about(axis: str, degrees: np.ndarray) -> np.ndarray:
    """Return rotations (n, 3, 3) about one body axis."""
    return Rotation.from_rotvec(np.outer(np.radians(degrees), np.eye(3)["xyz".index(axis)])).as_matrix()


def tumble(turns: float, rows: int = 400) -> np.ndarray:
    """Return attitudes of a steady roll through a number of turns."""
    return about("x", np.linspace(0, 360 * turns, rows))


@pytest.mark.parametrize(
    ("turns", "flips"), [(0.0, 0), (0.4, 0), (0.7, 0), (0.8, 1), (1.0, 1), (2.0, 2), (7.0, 7), (-3.0, 3)]
)
def test_a_whole_roll_is_a_flip(turns: float, flips: int) -> None:
    """Counted when it is upright again: past three quarters of the turn."""
    assert with_attitudes(tumble(turns)).flips() == flips


@given(numbers(0, 360), numbers(-5, 5))
def test_flips_do_not_depend_on_heading_or_on_spin_about_the_thrust_axis(heading: float, spin: float) -> None:
    turned = so3.yaw(heading) @ tumble(3.0, 150)
    spinning = about("z", np.linspace(0, 360 * spin, 150))
    assert with_attitudes(turned @ spinning).flips() == 3


@given(rotations(), numbers(-5, 5))
def test_spin_about_the_thrust_axis_is_no_flip(R: np.ndarray, spin: float) -> None:
    spinning = about("z", np.linspace(0, 360 * spin, 100))
    assert with_attitudes(R @ spinning).flips() == 0


@pytest.mark.parametrize("deepest", [60, 100, 150, 179])
def test_a_tumble_that_comes_back_the_way_it_went_is_no_flip(deepest: float) -> None:
    there = np.concatenate([np.linspace(0, deepest, 100), np.linspace(deepest, 0, 100)])
    assert with_attitudes(about("x", there)).flips() == 0


def test_laps_of_an_ordinary_circle_are_no_flips() -> None:
    """The thrust axis goes round a cone once a lap, but never over."""
    heading = np.linspace(0, 3600, 2000)
    cone = about("z", heading) @ so3.roll(40) @ about("z", -heading)
    assert with_attitudes(cone).flips() == 0
    assert RECORD.flips() == 0


def test_sliding_round_just_below_the_horizon_is_no_flip() -> None:
    """Over one side, 20 degrees below the horizontal half way round, and up on the other side: never upside down."""
    down, up = np.linspace(0, 110, 100), np.linspace(110, 0, 100)
    round_ = about("z", np.linspace(0, 180, 200)) @ so3.roll(110)
    slide = np.concatenate([about("x", down), round_, so3.yaw(180) @ about("x", up)])
    assert with_attitudes(slide).flips() == 0
    assert with_attitudes(np.concatenate([about("x", down), about("x", np.linspace(110, 360, 200))])).flips() == 1


def test_pitching_over_is_a_flip_as_well() -> None:
    assert with_attitudes(about("y", np.linspace(0, 720, 300))).flips() == 2


# --- summary ---------------------------------------------------------------------------------------------------------


def test_the_summary_holds_plain_numbers_of_the_record() -> None:
    summary = RECORD.summary()
    assert json.loads(json.dumps(summary)) == summary
    assert summary["status"] == "completed"
    assert summary["message"] == Status.COMPLETED.value
    assert summary["end_time_s"] == RECORD.time[-1]
    assert summary["settled"] is True
    assert summary["distance_m"]["start"] == pytest.approx(np.hypot(np.hypot(1.3, 0.1) - 1, 0.1), abs=1e-9)
    assert summary["distance_m"]["max"] == RECORD.distance.max()
    assert summary["distance_m"]["final"] == RECORD.distance[-1]
    assert summary["thrust_N"] == {"min": RECORD.thrust.min(), "max": RECORD.thrust.max()}
    assert summary["thrust_to_weight"]["max"] == pytest.approx(RECORD.thrust.max() / VEHICLES["loaded"].weight)
    assert summary["peak_rate_rad_s"] == np.linalg.norm(RECORD.angular_velocity, axis=1).max()
    assert summary["margin_min"]["focal"] == RECORD.focal_margin.min()
    assert summary["so3_drift"] == so3.drift(RECORD.attitude)
    assert summary["oracle"]["max_position_error_m"] < 1e-6


def test_the_measured_settling_time_is_the_last_crossing() -> None:
    time = RECORD.summary()["settling_time_s"]["measured"]
    assert np.all(RECORD.distance[RECORD.time >= time] <= 1e-3)
    assert RECORD.distance[RECORD.time < time][-1] > 1e-3


def test_the_summary_prints_a_line_a_number() -> None:
    lines = str(RECORD.summary()).splitlines()
    assert any(line.startswith("distance_m.max_after_settling ") for line in lines)
    assert len(lines) == sum(len(v) if isinstance(v, dict) else 1 for v in RECORD.summary().values())


def test_a_flight_that_does_not_settle_says_so() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-2)
    summary = fly(law, State((3.2, 5, 0)), speed=1.0, duration=1.0).summary()
    assert summary["settled"] is False
    assert summary["settling_time_s"] == {"predicted": None, "measured": None}
    assert summary["distance_m"]["max_after_settling"] is None


@pytest.mark.parametrize(
    ("path", "start"),
    [
        (paths.line(), State((0, 0, -1), attitude=so3.roll(180))),
        (PATHS["circle"], State((1.4, 0, 10), velocity=(-2, 0, 0))),
        (PATHS["quadratic circle"], State((1.4, 0, 10), velocity=(-2, 0, 0))),
        (PATHS["circle"], State((1.4, 0, 10), angular_velocity=(0, 0, 2000))),
    ],
    ids=["free fall", "focal point", "focal point of an implicit path", "unresolved"],
)
def test_a_flight_that_ended_early_has_a_summary_of_what_there_is(path, start: State) -> None:
    record = fly(design(PAPER_VEHICLE, path, poles=-1.5), start, speed=0.0, duration=3.0)
    assert not record.completed
    summary = record.summary()
    assert summary["settled"] is False
    assert summary["end_time_s"] == record.status_time
    assert summary["message"] == record.status.value
    assert json.dumps(summary, allow_nan=False)


def test_a_satellite_has_no_weight_to_compare_with() -> None:
    law = design(Vehicle(5.0, (0.05, 0.05, 0.05), gravity=0.0), paths.circle(5.0), poles=-1)
    summary = fly(law, State((5.2, 0, 0), thrust=0.5), speed=0.1, duration=0.5).summary()
    assert "thrust_to_weight" not in summary


@pytest.mark.parametrize(
    "wanted", [{"speed": 1e300}, {"speed": 1.0, "heading": Along(1e300)}], ids=["speed", "heading"]
)
def test_the_summary_of_a_flight_that_ran_away_warns_of_nothing(wanted: dict[str, object]) -> None:
    """Its squares overflow: the peaks are infinite, as numbers, and no warning of NumPy stands between the lines."""
    law = design(PAPER_VEHICLE, PATHS["circle"])
    record = fly(law, State((1.2, 0, 0)), duration=0.05, **wanted)
    assert record.status is Status.NOT_FINITE
    assert record.summary()["status"] == "not_finite"
    assert len(record.prediction.thrust) == len(record.time)

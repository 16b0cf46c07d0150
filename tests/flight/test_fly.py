"""Flights that end early, wrong beliefs, noise, and the door of `fly`: what comes back is finite, repeatable and says how it ended."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from gammastar import so3
from gammastar.errors import FlightError, GammastarError, InputError, SingularStartError, UnknownNameError
from gammastar.flight import INTEGRATORS, FlightRecord, SensorNoise, Status, fly
from gammastar.flight.watch import LARGEST_TURN, RESOLVED_SHARE, is_resolved
from gammastar.law import Azimuth, Point, Ramp, Speed, design
from gammastar.law.gains import companion, gains_from_poles
from gammastar.path import catalogue as paths
from gammastar.vehicle import State, Vehicle
from strategies import PAPER_VEHICLE, PATHS, VEHICLES


def is_finite(record: FlightRecord) -> bool:
    arrays = [value for value in vars(record).values() if isinstance(value, np.ndarray)]
    return all(np.isfinite(array).all() for array in arrays) and len({len(array) for array in arrays}) == 1


# --- free fall -------------------------------------------------------------------------------------------------------


def inverted_above_a_line(**options: object) -> FlightRecord:
    """Fly the one start from which thrust must vanish: exactly upside down, straight above the path, at rest."""
    law = design(PAPER_VEHICLE, paths.line(), poles=-2)
    return fly(law, State((0, 0, -1), attitude=so3.roll(180)), speed=0.0, duration=2.0, **options)


def fall_time(pole: float) -> float:
    """Return when m (g - z'') passes zero on the line's vertical chain with four equal poles -p, from z = -1, z'' = 2 g."""
    start = [-1.0, 0.0, 2 * 9.8, 0.0]  # position, velocity, acceleration (thrust pushes down), jerk
    matrix = companion(gains_from_poles([-pole] * 4))
    return float(scipy.optimize.brentq(lambda t: 9.8 - (scipy.linalg.expm(matrix * t) @ start)[2], 0, 1))


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_flight_into_free_fall_ends_there(name: str) -> None:
    """The exact solution passes zero thrust at a known time; the flight ends within two steps before it and says why."""
    record = inverted_above_a_line(integrator=name)
    assert record.status is Status.FREE_FALL
    assert record.status_time == pytest.approx(fall_time(2.0), abs=2.5e-3)
    assert record.status_time == record.time[-1] < fall_time(2.0)
    assert record.status_margin == record.free_fall_margin[-1]
    assert 0 < record.status_margin < 0.3
    assert is_finite(record)
    assert not record.completed


@pytest.mark.parametrize("feedback", ["start", "middle"])
def test_sampled_feedback_ends_in_free_fall_too(feedback: str) -> None:
    record = inverted_above_a_line(feedback=feedback, rate=200)
    assert record.status is Status.FREE_FALL
    assert record.status_time == pytest.approx(fall_time(2.0), abs=0.02)
    assert is_finite(record)


def test_an_early_end_can_be_an_exception_that_holds_the_flight() -> None:
    with pytest.raises(FlightError, match="thrust fell to zero") as caught:
        inverted_above_a_line(throw=True)
    assert isinstance(caught.value.record, FlightRecord)
    assert caught.value.record.status is Status.FREE_FALL
    assert caught.value.record.time[-1] == pytest.approx(fall_time(2.0), abs=2.5e-3)


def test_a_hair_from_free_fall_the_flight_goes_on() -> None:
    """Two degrees off the exactly inverted start, the thrust turns over without vanishing."""
    law = design(PAPER_VEHICLE, paths.line(), poles=-2)
    record = fly(law, State((0, 0, -1), attitude=so3.roll(178)), speed=0.0, duration=6.0)
    assert record.completed
    assert 0 < record.free_fall_margin.min() < 1
    assert record.distance[-1] < 0.05 * record.distance[0]


# --- focal points ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["circle", "implicit circle", "quadratic circle"])
def test_a_flight_onto_the_axis_of_a_circle_ends_there(path: str) -> None:
    """Thrown inwards along a radius; the margin is the radius (to a power, for an implicit path) and was going to zero."""
    law = design(PAPER_VEHICLE, PATHS[path], poles=-1.5)
    record = fly(law, State((1.4, 0, 10), velocity=(-2, 0, 0)), speed=1.0, duration=3.0)
    assert record.status is Status.FOCAL_POINT
    assert np.hypot(*record.position[-1, :2]) < 0.1
    assert record.status_margin == record.focal_margin[-1]
    assert 0 < record.status_margin < 0.1
    assert is_finite(record)


def test_the_focal_margin_of_a_circle_is_its_share_of_the_radius() -> None:
    record = fly(design(PAPER_VEHICLE, PATHS["circle"], poles=-2), State((1.6, 0.3, 9.9)), speed=1.0, duration=2.0)
    assert record.focal_margin == pytest.approx(np.hypot(*record.position[:, :2].T), abs=1e-9)
    assert record.free_fall_margin == pytest.approx(record.thrust / 0.1, rel=1e-12)


@pytest.mark.parametrize(
    ("start", "margin"),
    [
        (State((0, 0, 5)), "focal_margin"),
        (State((1, 0, 5), thrust=0.0), "thrust_N"),
        (State((1, 0, 5), thrust=-1.0), "thrust_N"),
    ],
)
def test_a_singular_start_is_refused(start: State, margin: str) -> None:
    with pytest.raises(SingularStartError) as caught:
        fly(design(PAPER_VEHICLE, PATHS["circle"]), start, speed=1.0)
    assert margin in caught.value.margins


# --- too fast for the step -------------------------------------------------------------------------------------------


def test_a_motion_too_fast_for_its_step_is_called_unresolved() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-2)
    record = fly(law, State((1.4, 0, 10), angular_velocity=(0, 0, 30)), speed=1.0, duration=5.0, step=0.05)
    assert record.status is Status.UNRESOLVED
    assert len(record.time) == 1
    assert is_finite(record)


@pytest.mark.parametrize(
    "case",
    [
        {"start": State((1e8, 0, 10))},
        {"start": State((1.4, 0, 10), (1e9, 0, 0))},
        {"start": State((1.4, 0, 10), angular_velocity=(12, 10, 0)), "step": 0.1},
        {"start": State((1.1, 0, 10)), "poles": -5000},
        {"start": State((1.0, 0, 10)), "speed": 1e5},
        {"start": State((1.4, 0, 10), thrust=1e-12)},
        {"start": State((1.4, 0, 10), thrust=1e12)},
    ],
    ids=["far", "fast", "spinning", "stiff", "racing", "almost no thrust", "much thrust"],
)
def test_whatever_happens_no_array_holds_nan(case: dict) -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=case.get("poles", -2))
    record = fly(law, case["start"], speed=case.get("speed", 1.0), duration=1.0, step=case.get("step", 1e-3))
    assert is_finite(record)
    assert record.status in Status
    assert len(record.status.value.split()) > 3
    assert record.time[-1] == record.status_time


def test_an_unstable_loop_ends_a_flight() -> None:
    """Poles of -5000 at a step of 1 ms: no explicit method is stable there, and no singularity is near."""
    record = fly(design(PAPER_VEHICLE, PATHS["circle"], poles=-5000), State((1.1, 0, 10)), speed=1.0, duration=1.0)
    assert record.status is Status.UNRESOLVED
    assert is_finite(record)


def test_numbers_that_leave_the_finite_range_end_a_flight() -> None:
    record = fly(design(PAPER_VEHICLE, PATHS["circle"], poles=-2), State((1.0, 0, 10)), speed=1e60, duration=1.0)
    assert record.status is Status.NOT_FINITE
    assert is_finite(record)


@pytest.mark.parametrize(("rate", "step"), [(800.0, 1e-3), (100.0, 2.9e-3), (20.0, 1e-3)])
def test_a_rotation_that_the_step_does_not_resolve_is_not_called_settled(rate: float, step: float) -> None:
    """The flight is compared with its closed form over its whole length, along the path as across it."""
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-2.5)
    record = fly(law, State((3.2, 5, 0), angular_velocity=(rate, 0, 0)), speed=1.0, step=step)
    error = np.linalg.norm(record.position - record.prediction.position, axis=1).max()
    resolved = rate * step < LARGEST_TURN and error <= RESOLVED_SHARE * record.distance.max() + record.settled_within
    assert record.completed is bool(resolved)
    assert record.summary()["settled"] is record.completed


def test_a_start_far_out_does_not_end_at_a_focal_point() -> None:
    """100,000 km from a circle of 1 m the focal margin is 1e8, the opposite of singular."""
    record = fly(design(PAPER_VEHICLE, PATHS["circle"], poles=-2), State((1e8, 0, 10)), speed=1.0, duration=1.0)
    assert record.status is not Status.FOCAL_POINT


# --- wrong beliefs ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_a_wrong_mass_shifts_the_hover_by_the_ratio_of_two_gains(share: float) -> None:
    """Exact: at rest the believed acceleration is g (1 - m_true / m), and -k_1 e - k_3 a = 0 leaves e = k_3 g (m_true / m - 1) / k_1."""
    law = design(PAPER_VEHICLE, paths.line(), poles=-3)
    truth = Vehicle(0.1 * share, (0.0177, 0.0177, 0.0344), 9.8)
    record = fly(law, State((0, 0, 0)), reference=Point(0.0), duration=12.0, step=2e-3, truth=truth)
    gains = law.gains["transverse"]
    assert record.position[-1] == pytest.approx([0, 0, gains[2] / gains[0] * 9.8 * (share - 1)], abs=1e-7)
    assert record.thrust[-1] == pytest.approx(truth.weight, rel=1e-7)
    assert not record.nominal
    assert "oracle" not in record.summary()
    assert record.free_fall_margin[-1] == pytest.approx(9.8, rel=1e-7)


def test_a_wrong_inertia_leaves_the_hover_alone() -> None:
    law = design(PAPER_VEHICLE, paths.line(), poles=-3)
    truth = Vehicle(0.1, (0.0195, 0.016, 0.031), 9.8)
    record = fly(law, State((0, 0.5, 0.3)), reference=Point(0.0), duration=12.0, step=2e-3, truth=truth)
    assert record.position[-1] == pytest.approx(np.zeros(3), abs=1e-8)


def test_the_transformed_states_of_a_record_are_those_of_the_true_vehicle() -> None:
    """Acceleration in xi is the one that the true mass feels: it is the derivative of the velocity in xi."""
    law = design(PAPER_VEHICLE, paths.line(), poles=-3)
    record = fly(law, State((0, 0.5, 0.3)), speed=0.5, duration=1.0, truth=Vehicle(0.12, (0.02, 0.02, 0.03), 9.8))
    velocity, acceleration = record.transverse_state[:, :, 1], record.transverse_state[:, :, 2]
    slope = (velocity[2:] - velocity[:-2]) / (record.time[2:] - record.time[:-2])[:, None]
    assert slope == pytest.approx(acceleration[1:-1], abs=1e-4)


def test_a_true_vehicle_like_the_believed_one_changes_nothing() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"])
    twin = Vehicle(0.1, (0.0177, 0.0177, 0.0344), 9.8)
    start = State((1.3, 0.1, 9.9))
    records = [fly(law, start, speed=1.0, duration=0.5, truth=truth) for truth in (None, twin)]
    assert np.array_equal(records[0].state, records[1].state)


# --- noise -----------------------------------------------------------------------------------------------------------

NOISE = SensorNoise((1e-3,) * 3, (1e-3,) * 3, (1e-3,) * 3, (1e-2,) * 3)


def noisy(seed: int, duration: float = 1.0, noise: SensorNoise | None = NOISE, feedback: str = "start") -> FlightRecord:
    law = design(PAPER_VEHICLE, PATHS["circle"])
    return fly(
        law,
        State((1.3, 0.1, 9.9)),
        speed=1.0,
        duration=duration,
        feedback=feedback,
        rate=200,
        step=5e-3,
        noise=noise,
        seed=seed,
    )


def test_the_same_seed_gives_the_same_bytes() -> None:
    first, second, other = noisy(1), noisy(1), noisy(2)
    for name, column in first.columns().items():
        assert column.tobytes() == second.columns()[name].tobytes(), name
    assert not np.array_equal(first.state[1:], other.state[1:])


@pytest.mark.parametrize("feedback", ["start", "middle"])
def test_a_longer_flight_begins_with_the_shorter_one(feedback: str) -> None:
    """Also across the chunks in which a flight is computed (500 steps)."""
    short, long = noisy(5, 0.9, feedback=feedback), noisy(5, 4.1, feedback=feedback)
    rows = len(short.time)
    assert np.array_equal(short.time, long.time[:rows])
    assert np.array_equal(short.state, long.state[:rows])
    assert np.array_equal(short.input, long.input[:rows])


def test_a_shorter_continuous_flight_is_a_prefix_too() -> None:
    law, start = design(VEHICLES["loaded"], PATHS["helix"]), State((1.6, 0.6, 0.9))
    short, long = (fly(law, start, speed=0.5, duration=duration) for duration in (0.3, 1.1))
    assert np.array_equal(short.state, long.state[: len(short.time)])


def test_noise_of_zero_is_no_noise() -> None:
    assert noisy(1, noise=SensorNoise()).state == pytest.approx(noisy(1, noise=None).state, abs=1e-12)


def test_noise_moves_the_vehicle_in_proportion() -> None:
    """Small noise passes through the loop linearly: ten times the noise, ten times the departure."""
    quiet = noisy(3, noise=None).position
    small, large = (
        noisy(3, noise=SensorNoise((s,) * 3, (s,) * 3, (s,) * 3, (s,) * 3)).position - quiet for s in (1e-6, 1e-5)
    )
    assert large == pytest.approx(10 * small, abs=1e-3 * np.abs(large).max())


# --- the door --------------------------------------------------------------------------------------------------------

BAD = {
    "nowhere to go": ({}, InputError, "exactly one"),
    "two ways to go": ({"speed": 1.0, "reference": Ramp(1.0)}, InputError, "exactly one"),
    "no duration": ({"speed": 1.0, "duration": 0.0}, InputError, "duration"),
    "duration of NaN": ({"speed": 1.0, "duration": np.nan}, InputError, "duration"),
    "backwards": ({"speed": 1.0, "duration": -1.0}, InputError, "duration"),
    "no step": ({"speed": 1.0, "step": 0.0}, InputError, "step"),
    "too many steps": ({"speed": 1.0, "duration": 1e6}, InputError, "rows"),
    "unknown feedback": ({"speed": 1.0, "feedback": "midle"}, UnknownNameError, "did you mean"),
    "unknown integrator": ({"speed": 1.0, "integrator": "euler"}, UnknownNameError, "integrator"),
    "list of integrators": ({"speed": 1.0, "integrator": []}, UnknownNameError, "integrator"),
    "a rate for nothing": ({"speed": 1.0, "rate": 100.0}, InputError, "no control rate"),
    "no rate": ({"speed": 1.0, "feedback": "start"}, InputError, "needs a control rate"),
    "rate of zero": ({"speed": 1.0, "feedback": "start", "rate": 0.0}, InputError, "rate"),
    "continuous noise": ({"speed": 1.0, "noise": SensorNoise()}, InputError, "sampled feedback"),
    "speed of NaN": ({"speed": np.nan}, InputError, "speed"),
    "yaw of NaN": ({"speed": 1.0, "yaw_reference": np.nan}, InputError, "yaw reference"),
    "settled nowhere": ({"speed": 1.0, "settled_within": 0.0}, InputError, "settled_within"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_flown_is_refused(case: str) -> None:
    options, error, reason = BAD[case]
    with pytest.raises(error, match=reason) as caught:
        fly(design(PAPER_VEHICLE, PATHS["circle"]), State((1.3, 0.1, 9.9)), **options)
    assert isinstance(caught.value, GammastarError)


def test_a_flight_takes_a_law_and_a_state() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"])
    with pytest.raises(InputError, match="law must be"):
        fly(PATHS["circle"], State((1, 0, 10)), speed=1.0)
    with pytest.raises(InputError, match="start must be"):
        fly(law, (1, 0, 10), speed=1.0)


def test_a_speed_is_short_for_its_reference() -> None:
    law, start = design(PAPER_VEHICLE, PATHS["circle"]), State((1.3, 0.1, 9.9))
    records = [fly(law, start, duration=0.2, **how) for how in ({"speed": 0.5}, {"reference": Speed(0.5)})]
    assert np.array_equal(records[0].state, records[1].state)
    assert records[0].reference == Speed(0.5)


def test_progress_is_told_up_to_the_last_step() -> None:
    told: list[tuple[int, int]] = []
    law = design(PAPER_VEHICLE, PATHS["circle"])
    record = fly(law, State((1.3, 0.1, 9.9)), speed=1.0, duration=1.2, progress=lambda *done: told.append(done))
    assert told[-1] == (1200, 1200)
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert len(record.time) == 1201


@pytest.mark.parametrize("duration", [1e-4, 1e-3, 0.5, 0.501])
def test_a_flight_has_a_row_for_every_step_and_its_start(duration: float) -> None:
    """500 steps are one chunk of the machine."""
    record = fly(design(PAPER_VEHICLE, PATHS["circle"]), State((1.3, 0.1, 9.9)), speed=1.0, duration=duration)
    steps = max(1, round(duration / 1e-3))
    assert record.time == pytest.approx(np.arange(steps + 1) * min(1e-3, duration), abs=1e-15)
    assert record.completed
    assert record.status_time == record.time[-1]
    assert record.state[0] == pytest.approx(State((1.3, 0.1, 9.9)).vector(PAPER_VEHICLE.weight), abs=0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": 1e308}, "at most 2000000 rows"),
        ({"step": 5e-324}, "at most 2000000 rows"),
        ({"feedback": "start", "rate": 1e-308}, "at most 1000 integration steps"),
        ({"feedback": "start", "rate": 1e300, "step": 1.0}, "at most 2000000 rows"),
        ({"truth": "heavy"}, "truth must be a Vehicle"),
        ({"noise": 0.1, "feedback": "start", "rate": 100.0}, "noise must be a SensorNoise"),
        ({"heading": 3}, "heading must be a Heading"),
        ({"heading": Azimuth(), "yaw_reference": 1.0}, "a heading or a yaw reference"),
        ({"seed": 1.5}, "seed must be a whole number"),
        ({"speed": "1.0"}, "must be a number"),
    ],
)
def test_what_cannot_be_flown_is_said_in_one_sentence(arguments: dict, message: str) -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"])
    with pytest.raises(InputError, match=message):
        fly(law, State((1.4, 0, 10)), **{"speed": 1.0, **arguments})


@pytest.mark.parametrize(("duration", "step"), [(1.0, 0.3e-2), (0.0105, 1e-3)])
def test_a_flight_lasts_as_long_as_asked_with_steps_no_longer_than_asked(duration: float, step: float) -> None:
    record = fly(
        design(PAPER_VEHICLE, PATHS["circle"]), State((1.3, 0.1, 9.9)), speed=1.0, duration=duration, step=step
    )
    assert record.time[-1] == pytest.approx(duration, rel=1e-14)
    assert np.diff(record.time).max() <= step * (1 + 1e-9)


def test_a_start_whose_predicted_middle_is_not_finite_is_refused() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"])
    with pytest.raises(SingularStartError, match="finite input at the start"):
        fly(law, State((3.2, 5, 0), velocity=(1e100, 1e100, 1e100)), speed=1.0, feedback="middle", rate=100.0)


def test_a_flight_beside_its_closed_form_along_the_path_is_not_resolved() -> None:
    record = fly(design(PAPER_VEHICLE, PATHS["circle"]), State((1.3, 0.1, 9.9)), speed=1.0, duration=1.0)
    assert is_resolved(record)
    for name, column in (("tangential_state", (slice(None), 0)), ("transverse_state", (slice(None), 0, 0))):
        moved = getattr(record, name).copy()
        moved[column] += 0.1
        assert not is_resolved(dataclasses.replace(record, **{name: moved}))

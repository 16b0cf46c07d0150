"""An autopilot around a plant: it keeps the law's promise on vehicles as they are."""

import dataclasses

import numpy as np
import pytest

from gammastar import (
    Approach,
    Channel,
    FlightRecord,
    Gusts,
    LinearDrag,
    Observer,
    QuadraticDrag,
    Replacement,
    Rotors,
    SensorNoise,
    Sensors,
    Speed,
    State,
    Status,
    Vehicle,
    Wind,
    certify,
    design,
    errors,
    fly,
    load_mission,
    paths,
    so3,
)
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance

G = 9.81
IDEAL = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), gravity=G)
ROTORS = Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500.0, lag=0.005, first_angle=45)
QUADROTOR = dataclasses.replace(IDEAL, rotors=ROTORS)
WEAK = dataclasses.replace(
    IDEAL, rotors=dataclasses.replace(ROTORS, fastest=float(np.sqrt(2 * 0.5 * G / 4 / 5.57e-6)))
)  # thrust-to-weight 2
DRAGGED = dataclasses.replace(QUADROTOR, forces=[LinearDrag(0.1)])
CIRCLE = paths.circle(radius=1.0)
START = State((1.5, 0, -0.5))


def flown(vehicle: Vehicle, *, poles: float = -6, observer: Observer | None = None, **given: object) -> FlightRecord:
    law = design(vehicle, CIRCLE, poles, rejection=observer, approach=given.pop("approach", None))
    arguments = {"speed": 1.2566, "duration": 6.0, "start": START, "settled_within": 1e-2} | given
    return fly(law, arguments.pop("start"), **arguments)


def steady(record: FlightRecord) -> float:
    """Return the RMS distance [m] over the last quarter."""
    assert record.completed
    return float(np.sqrt(np.mean(record.distance[-len(record.distance) // 4 :] ** 2)))


def test_an_exact_model_is_flown_to_the_closed_form_at_second_order() -> None:
    """Sampled, with prediction to when the command is felt and staggered thrust states: half the interval, a quarter of the distance."""
    gaps = []
    for rate in (100.0, 200.0, 400.0):
        record = flown(dataclasses.replace(IDEAL, latency=1e-9), poles=-3, duration=4.0, rate=rate)
        gaps.append(np.linalg.norm(record.position - record.prediction.position, axis=1).max())
    assert gaps[-1] < 1e-4
    assert np.log2(gaps[:-1]) - np.log2(gaps[1:]) == pytest.approx([2, 2], abs=0.05)


@pytest.mark.parametrize("vehicle", [QUADROTOR, dataclasses.replace(QUADROTOR, latency=0.02)], ids=["lag", "latency"])
def test_a_path_is_kept_at_second_order_through_rotors(vehicle: Vehicle) -> None:
    """Of a path along which everything changes; the lag is made up for within an interval, the latency by prediction."""
    path, worst = paths.nonplanar_circle(), []
    for rate in (50.0, 100.0, 200.0):
        start = State(path.points(np.zeros(1))[0] + 0.01)
        record = fly(design(vehicle, path, -3), start, speed=0.6, duration=10.0, rate=rate)
        worst.append(record.distance[-len(record.distance) // 4 :].max())
    assert worst[-1] < 1e-5
    assert np.all(np.log2(worst[:-1]) - np.log2(worst[1:]) > 1.6)


def test_body_rates_keep_a_path_at_second_order_whatever_the_inner_loop() -> None:
    """The lead makes the inner loop's bandwidth disappear: 20 and 60 rad/s give the same flight to the accuracy of sampling."""
    path, worst = paths.nonplanar_circle(), {}
    for bandwidth in (20.0, 60.0):
        for rate in (100.0, 200.0):
            vehicle = dataclasses.replace(IDEAL, rate_bandwidth=bandwidth)
            start = State(path.points(np.zeros(1))[0] + 0.01)
            record = fly(design(vehicle, path, -3, interface="rates"), start, speed=0.6, duration=10.0, rate=rate)
            worst[bandwidth, rate] = record.distance[-len(record.distance) // 4 :].max()
    for bandwidth in (20.0, 60.0):
        assert worst[bandwidth, 200.0] < 1e-4
        assert np.log2(worst[bandwidth, 100.0] / worst[bandwidth, 200.0]) > 1.6


def test_body_rates_recover_from_upside_down_and_reject_what_is_unknown() -> None:
    law = design(IDEAL, CIRCLE, -3, interface="rates", rejection=Observer(), approach=Approach())
    truth = dataclasses.replace(IDEAL, mass=0.6, rate_bandwidth=15.0)
    start = State((1.5, 0, -0.5), attitude=so3.roll(178))
    record = fly(law, start, speed=1.0, duration=12.0, truth=truth)
    assert steady(record) < 1e-4


def test_rotors_without_lag_and_limits_in_reach_are_the_wrench_itself() -> None:
    rotors = dataclasses.replace(QUADROTOR, rotors=dataclasses.replace(ROTORS, lag=0.0, fastest=5000.0))
    near = State((1.02, 0, -0.02))
    one, other = (
        flown(each, start=near, duration=2.0, poles=-3, rate=500.0)
        for each in (rotors, dataclasses.replace(IDEAL, latency=1e-9))
    )
    assert not one.autopilot.given_up.any()
    assert one.position == pytest.approx(other.position, abs=1e-10)


UNKNOWN = {
    "constant force": {"bias_acceleration": (1.0, 0.5, 0.3)},
    "constant torque": {"bias_torque": (0.004, -0.003, 0.001)},
    "heavier": {"mass": 0.65},
    "lighter": {"mass": 0.38},
    "other inertia": {"inertia": (4.5e-3, 3e-3, 7.2e-3)},
    "weaker rotors": {"rotors": dataclasses.replace(ROTORS, thrust_coefficient=5e-6)},
    "centre of mass": {"rotors": dataclasses.replace(ROTORS, positions=np.add(ROTORS.positions, (0.004, 0, 0)))},
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_steady_unknowns_leave_next_to_no_steady_distance_with_observers(name: str) -> None:
    """Without observers centimetres are left, with them what the turning of the unknown seen from the path leaves."""
    truth = dataclasses.replace(QUADROTOR, **UNKNOWN[name])
    with_observers = steady(flown(QUADROTOR, observer=Observer(), truth=truth))
    without = steady(flown(QUADROTOR, truth=truth))
    assert with_observers < 1e-4
    if name != "other inertia":  # gains alone leave little of that
        assert without > 30 * with_observers


@pytest.mark.parametrize("drag", [LinearDrag(0.15), QuadraticDrag(0.02)], ids=["linear", "quadratic"])
def test_drag_is_known_or_observed(drag: LinearDrag | QuadraticDrag) -> None:
    truth, wind = dataclasses.replace(QUADROTOR, forces=[drag]), Wind((3, 0, 0))
    assert steady(flown(truth)) < 1e-6
    observed = steady(flown(QUADROTOR, observer=Observer(), truth=truth, wind=wind))
    assert observed < 2e-3
    assert steady(flown(QUADROTOR, truth=truth, wind=wind)) > 20 * observed


def test_the_second_derivative_of_the_force_and_the_torque_are_needed() -> None:
    """Design 3.9: leaving out the torque observer leaves more than having both."""
    truth = dataclasses.replace(QUADROTOR, forces=[LinearDrag(0.15)], bias_torque=(0.004, -0.003, 0.001))
    both, force_only = (
        steady(flown(QUADROTOR, observer=each, truth=truth)) for each in (Observer(), Observer(40, None))
    )
    assert force_only > 20 * both


def test_a_known_latency_is_made_up_for() -> None:
    late = dataclasses.replace(QUADROTOR, latency=0.03)
    assert steady(flown(late, observer=Observer())) < 1e-5
    unaware = flown(QUADROTOR, observer=Observer(), truth=late)
    assert not unaware.completed or unaware.distance[-500:].max() > 1e-2


def test_commands_and_thrust_states_stay_within_the_limits_from_upside_down() -> None:
    """At a thrust-to-weight ratio of 2 the rotors are asked for no more than they have, and the law comes back."""
    record = flown(
        WEAK,
        poles=-4,
        start=State((1.5, 0, -0.5), attitude=so3.roll(178)),
        observer=Observer(),
        approach=Approach(),
        duration=8.0,
    )
    speeds = record.autopilot.rotor_speeds
    assert speeds.min() >= 0
    assert speeds.max() <= WEAK.rotors.fastest * (1 + 1e-12)
    assert set(np.unique(record.autopilot.given_up)) <= {0, 1, 2, 3, 4}
    assert record.autopilot.given_up.max() >= 2  # limits were met
    assert steady(record) < 1e-4


def test_a_speed_above_what_the_rotors_can_fly_costs_speed_and_not_the_path() -> None:
    """Design: give up speed along the path first.  15 % above the largest constant speed the vehicle is slower, and on the path."""
    largest = certify(WEAK, CIRCLE, 1.0).allowed_speeds[0][1]
    record = flown(WEAK, poles=-5, speed=1.15 * largest, start=State((1.0, 0, 0)), approach=Approach(), duration=15.0)
    late = record.time > 7.5
    assert record.distance[late].max() < 1e-2
    assert record.tangential_state[late, 1].max() < 1.05 * largest
    slower = flown(WEAK, poles=-5, speed=0.97 * largest, start=State((1.0, 0, 0)), approach=Approach(), duration=15.0)
    assert slower.tangential_state[late, 1] == pytest.approx(0.97 * largest, rel=0.02)


def test_a_vehicle_that_turns_over_keeps_its_speed_along_the_path() -> None:
    """Being short of thrust while it turns over is not the fault of the speed: the reference is not slowed for that."""
    record = flown(WEAK, poles=-4, speed=0.5, start=State((1.5, 0, -0.5), attitude=so3.roll(178)), duration=8.0)
    assert record.autopilot.given_up.max() >= 3
    assert record.tangential_state[record.time > 6, 1] == pytest.approx(0.5, rel=1e-3)


def test_the_observer_tells_the_unknown_acceleration() -> None:
    unknown = np.array([1.0, 0.5, 0.3])
    record = flown(QUADROTOR, observer=Observer(), truth=dataclasses.replace(QUADROTOR, bias_acceleration=unknown))
    assert record.autopilot.unknown[-1, :3] == pytest.approx(-unknown, abs=1e-4)


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not() -> None:
    sensors, wind = Sensors(position=Channel(0.01, rate=50, dropout=0.1)), Wind((1, 0, 0), Gusts(0.5, 1.0))
    first, again, other = (
        flown(DRAGGED, poles=-3, duration=1.0, sensors=sensors, wind=wind, seed=seed).state for seed in (1, 1, 2)
    )
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


def test_what_a_flight_has_flown_does_not_depend_on_how_long_it_goes_on() -> None:
    sensors, wind = Sensors(position=Channel(0.01, rate=50, dropout=0.1)), Wind((1, 0, 0), Gusts(0.5, 1.0))
    short, long = (
        flown(DRAGGED, poles=-3, duration=duration, sensors=sensors, wind=wind, seed=3).state for duration in (1.0, 2.0)
    )
    assert short.tobytes() == long[: len(short)].tobytes()


def test_a_path_is_replaced_in_flight() -> None:
    other = paths.circle(radius=1.5, center=(0.3, 0, 0))
    record = flown(QUADROTOR, observer=Observer(), duration=10.0, replacements=[Replacement(4.0, other)])
    assert len(record.phases) == 2
    assert steady(record) < 1e-4
    jumps = np.abs(np.diff(record.autopilot.rotor_speeds, axis=0)).max()
    assert np.abs(np.diff(record.position, axis=0)).max() < 0.02
    assert jumps < 1500


def test_an_autopilot_needs_samples_and_says_so() -> None:
    with pytest.raises(errors.InputError, match="a vehicle with rotors needs sampled feedback"):
        flown(QUADROTOR, feedback="continuous")
    with pytest.raises(errors.InputError, match="must take the commands"):
        flown(QUADROTOR, truth=IDEAL)
    with pytest.raises(errors.InputError, match="noise or sensors"):
        flown(QUADROTOR, noise=SensorNoise(), sensors=Sensors())
    with pytest.raises(errors.InputError, match="latency must be at most 100 control intervals"):
        flown(dataclasses.replace(QUADROTOR, latency=10.0))
    with pytest.raises(errors.InputError, match="rate bandwidth must be at most 500 rad/s"):
        fly(design(dataclasses.replace(IDEAL, rate_bandwidth=1e9), CIRCLE, -3, interface="rates"), START, speed=1.0)
    slow = dataclasses.replace(QUADROTOR, rotors=dataclasses.replace(ROTORS, fastest=450.0))
    with pytest.raises(errors.InputError, match="rotors must be able to carry the vehicle"):
        flown(slow)
    with pytest.raises(errors.InputError, match="wind needs a vehicle that feels it"):
        flown(QUADROTOR, wind=Wind((3, 0, 0)))
    with pytest.raises(errors.InputError, match="wind must be a Wind"):
        flown(QUADROTOR, wind=(3, 0, 0))


def test_an_autopilot_runs_by_itself() -> None:
    """Its function takes the measurement of one interval and gives the command: hovering on the path asks for hover speeds."""
    law = design(QUADROTOR, CIRCLE, -4)
    guidance = Guidance(law, Speed(0.0).resolved(CIRCLE, 0.0), 0.0)
    pilot = Autopilot(guidance, 0.002)
    state = pilot.start(State((1, 0, 0)).vector(QUADROTOR.weight), 0.0)
    measurement = np.concatenate([[1, 0, 0], np.zeros(3), np.eye(3).ravel(), np.zeros(3), np.ones(4)])
    reference = guidance.reference.pieces.data(np.zeros(1))[:, 0]
    step = pilot.function()
    for k in range(5):
        state, command, telemetry = (value.full().ravel() for value in step(state, measurement, 0.002 * k, reference))
    assert command == pytest.approx(np.full(4, np.sqrt(0.5 * G / 4 / 5.57e-6)), rel=1e-9)
    assert telemetry[6] == 0


@pytest.mark.parametrize("interface", ["wrench", "rates"])
def test_an_observer_learns_nothing_from_a_start_that_is_as_modelled(interface: str) -> None:
    """Begun with the exact motion of circling, thrust m (g e3 - a) along b3 and Omega = b3 x b3', nothing unknown is found.

    The first step must not take the acceleration at the start for a disturbance.
    """
    rate = 0.4 * np.pi
    pull = IDEAL.mass * np.array([rate**2, 0.0, G])
    axis = pull / np.linalg.norm(pull)
    lean = so3.pitch(np.degrees(np.arctan2(axis[0], axis[2])))
    turning = lean.T @ np.cross(axis, np.cross([0.0, 0.0, rate], axis))
    start = State((1.0, 0.0, 0.0), (0.0, rate, 0.0), lean, turning, float(np.linalg.norm(pull)))
    law = design(IDEAL, CIRCLE, -6, rejection=Observer(), interface=interface)
    record = fly(law, start, speed=rate, duration=1.0)
    assert record.distance.max() < 1e-6
    assert np.abs(record.autopilot.unknown[:, :3]).max() < 1e-5


def test_a_flight_with_an_approach_that_ran_away_warns_of_nothing() -> None:
    """Drag that no step resolves throws it so far that squares of distances overflow; they are infinite, as numbers."""
    mission = load_mission("quadrotor")
    drag = [{"kind": "linear_drag", "coefficients": 1e4}]
    record = mission.with_values({"truth.forces": drag, "flight.duration": 0.3}).fly()
    assert record.status is Status.NOT_FINITE
    assert not np.isnan(record.distance).any()

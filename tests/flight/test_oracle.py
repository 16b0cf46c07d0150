"""The closed loop against its exact solution: one comparison covers vehicle, path, law and integrator together.

With an exact model and continuous feedback the transformed states obey linear equations, so position, thrust, rates and torques are
known in closed form (`Law.predict`); a simulated flight must meet them, to the accuracy of its integrator and at its order.
"""

from __future__ import annotations

import functools

import casadi as ca
import numpy as np
import pytest

from gammastar import so3
from gammastar.flight import INTEGRATORS, FlightRecord, fly
from gammastar.law import Point, Ramp, Speed, Stop, design
from gammastar.path import catalogue as paths
from gammastar.vehicle import State, Vehicle
from strategies import PAPER_POSITION, PAPER_VEHICLE, PATHS, UPRIGHT, UPSIDE_DOWN, VEHICLES, state_of_motion

# name: body, path, reference, start.  Bodies with full inertia, K_t and K_r; starts rolled over, moving, upside down.
FLIGHTS = {
    "circle, speed": ("full inertia", "circle", Speed(1.0), State((1.6, 0.4, 9.5), attitude=so3.roll(100))),
    "implicit circle, ramp": (
        "loaded",
        "implicit circle",
        Ramp(-0.8),
        State((1.6, 0.4, 9.5), (0.3, 0.2, 0), so3.pitch(-60)),
    ),
    "quadratic circle, stop": (
        "paper",
        "quadratic circle",
        Stop(1.0, 3.0, 2.0),
        State((1.6, 0.4, 9.5), attitude=so3.roll(170)),
    ),
    "tilted circle, ramp": ("loaded", "tilted circle", Ramp(0.6), State((2.5, -2.5, 3.5), angular_velocity=(1, -1, 0))),
    "line, stop": ("full inertia", "line", Stop(0.7, 4.0, 2.0), State((0.5, 2.0, 2.0), attitude=so3.roll(150))),
    "helix, speed": ("loaded", "helix", Speed(0.7), State((1.9, 1.1, 1.0), attitude=so3.pitch(80))),
    "ellipse, point": ("paper", "ellipse", Point(2.0), State((3.3, 0.8, 2.2), (0.5, 0, 0), so3.yaw(70))),
    "loop, ramp": ("full inertia", "loop", Ramp(3.0), State((0.3, 0.4, -2.5), (4.0, 2.0, 0.0))),
    "nonplanar circle, speed": (
        "loaded",
        "nonplanar circle",
        Speed(0.45),
        State((1.7, 0.3, 1.3), attitude=so3.roll(-70)),
    ),
    "twisted, point": ("full inertia", "twisted", Point(0.8), State((-0.2, 0.2, 0.1), attitude=so3.roll(45))),
    "uneven circle, ramp": ("paper", "uneven circle", Ramp(0.9), State((1.4, -0.5, 10.3), attitude=so3.pitch(130))),
    "parabola, stop": ("loaded", "parabola", Stop(0.3, 1.0, 1.5), State((0.2, 0.1, 0.1), attitude=so3.roll(20))),
}


@functools.cache
def flight(name: str) -> FlightRecord:
    body, path, reference, start = FLIGHTS[name]
    law = design(VEHICLES[body], PATHS[path], poles=(-2.2, -2.4, -2.6 + 0.5j, -2.6 - 0.5j))
    return fly(law, start, reference=reference, duration=5.0, step=1e-3)


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_simulated_flight_is_its_closed_form(name: str) -> None:
    """Position to 1e-8 m at 1 ms, for every kind of path and reference; the rest to the same relative accuracy."""
    record, exact = flight(name), flight(name).prediction
    assert record.completed
    assert np.linalg.norm(record.position - exact.position, axis=1).max() <= 1e-8
    assert np.linalg.norm(record.velocity - exact.velocity, axis=1).max() <= 1e-7
    assert np.abs(record.thrust - exact.thrust).max() <= 1e-8 * record.truth.mass * 10
    assert np.linalg.norm(record.attitude[:, :, 2] - exact.thrust_direction, axis=1).max() <= 1e-7
    tilt_rate = np.linalg.norm(record.angular_velocity[:, :2], axis=1)
    assert np.abs(tilt_rate - exact.tilt_rate).max() <= 1e-6 * (1 + exact.tilt_rate.max())
    assert np.abs(record.transverse_state - exact.transverse_state).max() <= 1e-6 * (
        1 + np.abs(exact.transverse_state).max()
    )
    assert np.abs(record.tangential_state - exact.tangential_state).max() <= 1e-6 * (
        1 + np.abs(exact.tangential_state).max()
    )
    assert np.abs(record.yaw_output - exact.yaw_output).max() <= 1e-9
    assert np.abs(record.distance - exact.distance).max() <= 1e-8


@pytest.mark.parametrize("name", [name for name in FLIGHTS if FLIGHTS[name][3].angular_velocity[2] == 0])
def test_the_torque_of_a_simulated_flight_is_its_closed_form(name: str) -> None:
    """With r = 0 the tilt acceleration |(p', q')| is known whatever the heading; Euler's equation turns the torque into it."""
    record, exact = flight(name), flight(name).prediction
    omega, J = record.angular_velocity, record.truth.inertia
    gyroscopic = np.cross(omega, omega @ J)
    acceleration = np.linalg.solve(J, (record.torque - gyroscopic - record.truth.bias_torque).T).T
    assert np.abs(acceleration[:, 2]).max() <= 1e-9
    tilting = np.linalg.norm(acceleration[:, :2], axis=1)
    assert np.abs(tilting - exact.tilt_acceleration).max() <= 1e-6 * (1 + exact.tilt_acceleration.max())


@pytest.mark.parametrize(
    ("pole", "start"),
    [(1.5, UPSIDE_DOWN), (2.5, UPRIGHT), (2.5, UPSIDE_DOWN), (4.0, UPRIGHT)],
    ids=["1.5 upside down", "2.5 upright", "2.5 upside down", "4 upright"],
)
def test_the_paper_scenarios_are_flown_as_predicted(pole: float, start: object) -> None:
    """The acceptance of the first flight: 1e-8 m, drift 1e-12, thrust positive, 1 mm after settling; peaks as predicted.

    For Jx = Jy and r = 0 the torque is Jx |(p', q')|: the simulated peak is the one of the closed form.
    """
    law = design(PAPER_VEHICLE, PATHS["quadratic circle"], poles=-pole)
    step = (
        5e-4 if pole == 1.5 else 1e-3
    )  # the slow poles turn it over at 28 rad/s; the error goes with the fourth power
    record = fly(law, State(PAPER_POSITION, attitude=start), speed=1.0, duration=20.0, step=step)
    summary, exact = record.summary(), record.prediction
    assert summary["status"] == "completed"
    assert summary["settled"]
    assert summary["distance_m"]["max_after_settling"] <= 1e-3
    assert summary["so3_drift"] <= 1e-12
    assert summary["oracle"]["max_position_error_m"] <= 1e-8
    assert summary["oracle"]["max_thrust_error_N"] <= 1e-8
    assert summary["thrust_N"]["min"] > 0
    assert summary["peak_rate_rad_s"] == pytest.approx(exact.tilt_rate.max(), rel=1e-6)
    assert summary["peak_torque_N_m"] == pytest.approx(0.0177 * exact.tilt_acceleration.max(), rel=1e-5)


# --- order -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_the_order_on_the_closed_loop_is_the_declared_one(method) -> None:
    """Halving the step divides the distance to the closed form by 2^order: full inertia, nonplanar path, rolled start."""
    law = design(VEHICLES["full inertia"], PATHS["nonplanar circle"], poles=-2.5)
    start = State((1.9, 0.3, 1.4), attitude=so3.roll(50), angular_velocity=(0.5, -0.3, 0.8))
    errors = []
    for step in (8e-3, 4e-3, 2e-3) if method.order == 1 else (16e-3, 8e-3, 4e-3):
        record = fly(law, start, reference=Ramp(0.5), duration=2.4, step=step, integrator=method.name)
        errors.append(np.linalg.norm(record.position - record.prediction.position, axis=1).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(np.full(2, method.order), abs=0.15)


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_group_methods_keep_the_closed_loop_on_the_group(method) -> None:
    """60 s at 2 ms: rounding, against the drift of plain RK4 on nine entries."""
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-2.5)
    start = State((1.3, 0.2, 9.8), attitude=so3.roll(170))
    record = fly(law, start, speed=1.0, duration=60.0, step=2e-3, integrator=method.name)
    assert record.time[-1] == 60.0
    drift = so3.drift(record.attitude)
    assert (drift <= 1e-12) is method.keeps_group
    assert drift <= 1e-6


# --- what the closed form promises -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PATHS)
def test_a_flight_that_starts_on_the_manifold_stays_on_it(name: str) -> None:
    """G2: output invariance.  Rounding and the integrator's error alone, from a start that flatness puts on Gamma*."""
    path, vehicle = PATHS[name], VEHICLES["loaded"]
    parameter = float(np.mean(path.domain)) - 0.4
    jets = path.jets(np.array([parameter]))[0]
    speed = 0.5
    start = state_of_motion(vehicle, tuple(jets[k] * speed**k for k in range(4)), heading=1.0)
    record = fly(design(vehicle, path, poles=-3), start, speed=speed, duration=1.5)
    assert record.completed
    assert record.distance.max() <= 1e-11
    assert np.abs(record.transverse_state[:, :, 0]).max() <= 1e-11
    assert record.tangential_state[:, 1] == pytest.approx(np.full(len(record.time), speed), abs=1e-9)


def test_transverse_states_do_not_depend_on_the_parameterisation() -> None:
    """The same circle in two parameters, different speeds along it: the way to the path is the same."""
    start = State((1.6, 0.4, 9.5), attitude=so3.roll(60))
    plain = fly(design(PAPER_VEHICLE, PATHS["circle"], poles=-2), start, speed=1.0, duration=4.0)
    uneven = fly(design(PAPER_VEHICLE, PATHS["uneven circle"], poles=-2), start, speed=0.3, duration=4.0)
    assert plain.distance == pytest.approx(uneven.distance, abs=1e-8)
    lengths = [np.linalg.norm(record.transverse_state, axis=1) for record in (plain, uneven)]
    assert lengths[0] == pytest.approx(lengths[1], abs=1e-6)


def test_both_kinds_of_circle_fly_the_same_flight() -> None:
    start = State((1.6, 0.4, 9.5), attitude=so3.roll(60))
    records = [
        fly(design(VEHICLES["loaded"], PATHS[name], poles=-2), start, reference=Ramp(0.7), duration=3.0)
        for name in ("circle", "implicit circle")
    ]
    assert records[0].state == pytest.approx(records[1].state, abs=1e-9)
    assert records[0].input == pytest.approx(records[1].input, abs=1e-8)


def test_each_chain_of_an_implicit_path_has_its_own_poles() -> None:
    law = design(PAPER_VEHICLE, PATHS["implicit circle"], {"transverse": -1.5, "transverse_2": -4, "tangential": -2})
    record = fly(law, State((1.6, 0.4, 9.5)), speed=1.0, duration=4.0)
    first, second = np.abs(record.transverse_state[-1, :, 0])
    assert second < 1e-2 * first
    assert np.abs(record.transverse_state - record.prediction.transverse_state).max() <= 1e-7


@pytest.mark.parametrize(
    ("beta", "reference"), [(lambda r: ca.sinh(r / 2), 0.4), (lambda r: -3 * r, -1.0)], ids=["sinh", "mirrored"]
)
def test_a_general_yaw_output_decays_at_its_pole(beta, reference: float) -> None:
    """beta(r) - reference = e^(-k t) times its start, with the corrected sign of Eq. (26)."""
    law = design(VEHICLES["full inertia"], PATHS["circle"], {"yaw": -1.8}, yaw_output=beta)
    start = State((1.4, 0.3, 9.7), attitude=so3.roll(-40), angular_velocity=(0.5, 0.4, -2.0))
    record = fly(law, start, speed=1.0, duration=4.0, yaw_reference=reference)
    first = float(ca.DM(beta(ca.DM(-2.0))))
    assert record.yaw_output == pytest.approx(reference + (first - reference) * np.exp(-1.8 * record.time), abs=1e-10)
    assert record.yaw_output == pytest.approx(record.prediction.yaw_output, abs=1e-10)
    rates = np.array([float(ca.DM(beta(ca.DM(r)))) for r in record.angular_velocity[::500, 2]])
    assert rates == pytest.approx(record.yaw_output[::500], abs=1e-13)


@pytest.mark.parametrize(
    "reference",
    [Point(-2.0), Stop(0.8, 3.5, 1.5), Stop(-1.0, 1.0, 1.0, laps=1)],
    ids=["point", "stop", "stop backwards"],
)
def test_the_vehicle_holds_where_it_is_told_to(reference: Point | Stop) -> None:
    """Point stabilisation, G3: at the end it hovers at the coordinate, modulo a turn."""
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-4)
    record = fly(law, State((1.3, 0.3, 9.8)), reference=reference, duration=20.0, step=2e-3)
    turns = (record.tangential_state[-1, 0] - reference.coordinate) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert record.position[-1] == pytest.approx(PATHS["circle"].points(np.array([reference.coordinate]))[0], abs=1e-8)
    assert np.linalg.norm(record.velocity[-1]) < 1e-8
    assert record.thrust[-1] == pytest.approx(PAPER_VEHICLE.weight, rel=1e-8)
    if isinstance(reference, Stop):
        swept = record.tangential_state[-1, 0] - record.tangential_state[0, 0]
        assert np.sign(swept) == np.sign(reference.speed)
        assert abs(swept) >= reference.laps * 2 * np.pi


def test_the_internal_state_stays_bounded() -> None:
    """G4 by design 3.5: mu is two columns of a rotation and a thrust that is a function of (xi, eta)."""
    for name in ("circle, speed", "quadratic circle, stop", "loop, ramp"):
        record = flight(name)
        assert np.abs(record.internal_state[:, :6]).max() <= 1 + 1e-12
        assert record.internal_state[:, 6] == pytest.approx(record.prediction.thrust, abs=1e-7)


# --- flips -----------------------------------------------------------------------------------------------------------


def test_a_fast_vertical_loop_is_one_flip_a_lap() -> None:
    """Faster than sqrt(g / r) the thrust points inwards all the way round; at the top v^2/r - g of it is left."""
    speed, laps = 4.2, 6
    law = design(PAPER_VEHICLE, paths.loop(1.0, (0, 0, -5)), poles=-4)
    record = fly(law, State((0, 0.1, -3.9)), speed=speed, duration=laps * 2 * np.pi / speed + 2.0)
    settled = record.time >= record.prediction.settling_time(1e-3)
    assert record.distance[settled].max() <= 1e-3
    flown = (record.tangential_state[-1, 0] - record.tangential_state[0, 0]) / (2 * np.pi)
    assert record.flips() in {int(flown), int(flown) + 1}
    assert record.flips() >= 5
    late = record.time > 4
    assert record.thrust[late].min() == pytest.approx(0.1 * (speed**2 - 9.8), rel=1e-3)
    assert record.thrust[late].max() == pytest.approx(0.1 * (speed**2 + 9.8), rel=1e-3)


def test_a_vehicle_without_gravity_flies_a_circle_with_its_thrust_inwards() -> None:
    satellite = Vehicle(5.0, (8.05e-3, 5.158e-2, 5.124e-2), gravity=0.0)
    law = design(satellite, paths.circle(10.0), poles=-0.5)
    jets = law.path.jets(np.array([0.0]))[0]
    start = state_of_motion(satellite, tuple(jets[k] * 0.1**k for k in range(4)))
    record = fly(law, start, speed=0.1, duration=60.0, step=1e-2)
    assert record.completed
    assert record.distance.max() < 1e-9
    assert record.thrust == pytest.approx(np.full(len(record.time), 5.0 * 0.1**2 * 10), rel=1e-8)
    assert "thrust_to_weight" not in record.summary()

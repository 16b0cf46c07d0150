"""Motions under forces: attitude, thrust and torque against closed forms, and against the vehicle's own forward model."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import root

import gammastar as gs
from gammastar.certificate.motion import demands
from gammastar.law import flatness
from gammastar.law.flatness import _closed, _solved, flat, headings, hover
from gammastar.law.thrust_axis import is_bare
from gammastar.vehicle import Buoyancy, CustomForce, LinearDrag, QuadraticDrag, RotorDrag, Vehicle
from strategies import PAPER_VEHICLE, VEHICLES

MOTIONS = np.random.default_rng(0).normal(size=(40, 5, 3)) * np.array([5, 2, 3, 3, 5])[:, None]
INERTIA = ((0.03, 0.004, -0.002), (0.004, 0.035, 0.005), (-0.002, 0.005, 0.05))


def with_forces(*forces: gs.vehicle.Force, **more: float) -> Vehicle:
    return Vehicle(1.3, INERTIA, 9.81, (0.1, 0.2, -0.1), (0.01, 0, 0.02), forces=forces, **more)


@pytest.mark.parametrize("name", VEHICLES)
def test_the_iteration_agrees_with_the_closed_form_without_forces(name: str) -> None:
    for closed, solved in zip(_closed(VEHICLES[name], MOTIONS), _solved(VEHICLES[name], MOTIONS, 0.0), strict=True):
        np.testing.assert_allclose(solved, closed, rtol=0, atol=1e-11 * np.abs(closed).max())


def test_isotropic_drag_added_mass_and_buoyancy_have_a_closed_form() -> None:
    """F = m c + buoyancy - M (chi'' + K_t) - C chi' and its derivatives give thrust, tilt rate and tilt acceleration."""
    vehicle = with_forces(LinearDrag(0.4), Buoyancy(3e-4), added_mass=0.2)
    _, v, a, j, s = np.moveaxis(MOTIONS, 1, 0)
    lift = 3e-4 * 1000 * 9.80665
    force = [0, 0, 1.3 * 9.81 - lift] - 1.5 * np.add(a, (0.1, 0.2, -0.1)) - 0.4 * v
    first, second = -1.5 * j - 0.4 * a, -1.5 * s - 0.4 * j
    size = np.linalg.norm(force, axis=1)
    third = force / size[:, None]
    size_rate = np.sum(third * first, axis=1)
    turning = (first - third * size_rate[:, None]) / size[:, None]
    bending = second - third * np.sum(third * second, axis=1)[:, None] - 2 * size_rate[:, None] * turning
    found = flat(vehicle, MOTIONS)
    assert len(found.thrust) == 8
    for row in range(8):
        np.testing.assert_allclose(found.thrust[row], size, rtol=1e-11)
        np.testing.assert_allclose(found.tilt_rate[row], np.linalg.norm(turning, axis=1), rtol=1e-9)
        tilting = np.linalg.norm(bending / size[:, None], axis=1)
        np.testing.assert_allclose(found.tilt_acceleration[row], tilting, rtol=1e-8)


def test_level_flight_with_drag_that_differs_along_the_thrust_is_the_root_of_two_equations() -> None:
    """A tilt angle and a thrust balance weight and drag in the plane of the motion."""
    vehicle, speed = Vehicle(1.0, (0.01, 0.01, 0.02), 9.81, forces=[LinearDrag((0.3, 0.3, 0.9))]), 6.0

    def balance(unknown: np.ndarray) -> list[float]:
        angle, thrust = unknown
        along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        velocity = np.array([speed, 0.0])  # axes forward and down
        drag = -0.3 * along * (along @ velocity) - 0.9 * normal * (normal @ velocity)
        return (np.array([0, 9.81]) - thrust * normal + drag).tolist()

    angle, thrust = root(balance, [0.0, 9.81], tol=1e-13).x
    motion = np.zeros((1, 5, 3))
    motion[0, 1, 0] = speed
    found = flat(vehicle, motion)
    assert found.thrust == pytest.approx(np.full((8, 1), thrust), rel=1e-10)
    assert abs(angle) > 0.1
    assert found.tilt_rate.max() < 1e-12
    assert np.abs(found.torque).max() < 1e-12


FORCES = {
    "rotor drag": (RotorDrag((0.2, 0.2, 0.3)),),
    "uneven drag": (LinearDrag((0.3, 0.5, 0.2)), QuadraticDrag((0.05, 0.02, 0.1), each_axis=True)),
    "wing": (QuadraticDrag((0.2, 0.01, 0.01)),),
    "current": (CustomForce(lambda s, w: ca.vertcat(0.3 * s.attitude[0, 0] * s.velocity[1], 0.1 * s.position[0], 0)),),
}


@pytest.mark.parametrize("name", FORCES)
def test_the_solution_gives_the_motion_by_the_forward_model(name: str) -> None:
    """Thrust, attitude, rates and torque put into acceleration, jerk and snap return the derivatives they came from."""
    vehicle, slow = with_forces(*FORCES[name]), MOTIONS * np.array([1, 0.7, 0.5, 0.5, 0.5])[:, None]
    functions, states = flatness._functions(vehicle), []
    original = functions.rest

    class Spy:
        def map(self, count: int):
            def call(*columns: np.ndarray):
                states.append(columns)
                return original.map(count)(*columns)

            return call

    watched = functions._replace(rest=Spy())
    flatness_of = flatness._functions
    flatness._functions = lambda _: watched
    try:
        thrust, axis, rates, accelerations = _solved(vehicle, slow, 0.4)
    finally:
        flatness._functions = flatness_of
    assert np.all(thrust > 0)
    attitudes = states[0][0].reshape(3, len(slow), 3).swapaxes(0, 1)
    np.testing.assert_array_equal(axis, attitudes[:, :, 2])
    for k, (R, motion) in enumerate(zip(attitudes, slow, strict=True)):
        symbols = [ca.SX.sym("zeta2"), ca.SX.sym("ddot")]
        state = gs.vehicle.StateGraph(
            *(ca.SX(ca.DM(value)) for value in (motion[0], motion[1], R, rates[k], thrust[k])), symbols[0]
        )
        turning = ca.SX(ca.DM(accelerations[k]))
        model = ca.Function(
            "model",
            symbols,
            [vehicle.acceleration(state), vehicle.jerk(state), vehicle.snap(state, symbols[1], turning)],
        )
        third = R[:, 2]  # zeta2 and u_d are found by the least squares that the rest has to make zero
        base, lifted = model(0, 0), model(1, 0)
        slope = (lifted[1] - base[1]).full()[:, 0]
        zeta2 = slope @ (motion[3] - base[1].full()[:, 0]) / (slope @ slope)
        base, lifted = model(zeta2, 0), model(zeta2, 1)
        slope = (lifted[2] - base[2]).full()[:, 0]
        ddot = slope @ (motion[4] - base[2].full()[:, 0]) / (slope @ slope)
        found = [value.full()[:, 0] for value in model(zeta2, ddot)]
        assert np.linalg.norm(third) == pytest.approx(1, abs=1e-12)
        for value, wanted in zip(found, motion[2:], strict=True):
            np.testing.assert_allclose(value, wanted, rtol=0, atol=1e-7 * (1 + np.abs(motion).max()))


@pytest.mark.parametrize(
    ("forces", "different", "count"),
    [
        ((LinearDrag(0.3),), 1, 8),
        ((RotorDrag((0.3, 0.3, 0.1)), QuadraticDrag((1.0, 1.0, 2.0))), 1, 8),
        ((LinearDrag((0.3, 0.2, 0.1)),), 2, 4),
        ((CustomForce(lambda s, w: s.attitude[:, 0]),), 4, 4),
    ],
)
def test_headings_are_as_many_as_the_forces_distinguish(forces: tuple, different: int, count: int) -> None:
    vehicle = with_forces(*forces)
    assert (flatness._functions(vehicle).different, headings(vehicle)) == (different, count)
    assert flat(vehicle, MOTIONS).torque.shape == (count, len(MOTIONS), 3)


def test_half_a_turn_of_even_drag_turns_the_torque_with_it() -> None:
    vehicle = Vehicle(1.3, (0.03, 0.04, 0.05), forces=[LinearDrag((0.3, 0.2, 0.1))])
    torque = flat(vehicle, MOTIONS * 0.5).torque
    for one, other in ((0, 1), (2, 3)):
        np.testing.assert_allclose(torque[other][:, :2], -torque[one][:, :2], rtol=1e-9, atol=1e-12)


def test_without_a_force_to_push_against_there_is_no_attitude() -> None:
    weightless = Vehicle(1.0, (0.01, 0.01, 0.02), gravity=0, forces=[LinearDrag(0.1)])
    found = flat(weightless, np.zeros((1, 5, 3)))
    assert found.thrust.max() == 0
    assert np.all(np.isinf(found.tilt_rate))
    assert demands(weightless, np.zeros((1, 5, 3)), 1.0).specific_thrust == 0


def test_hover_counts_buoyancy_and_is_untouched_for_bare_vehicles() -> None:
    assert np.array_equal(hover(PAPER_VEHICLE), [0, 0, PAPER_VEHICLE.gravity])
    auv = gs.vehicles.load("sphere-auv")
    assert is_bare(PAPER_VEHICLE)
    assert not is_bare(auv)
    assert np.linalg.norm(hover(auv)) == pytest.approx(auv.weight / auv.mass)


@pytest.mark.parametrize("force", [LinearDrag((0.2, 0.2, 0.4)), RotorDrag(0.1), QuadraticDrag(0.05)])
def test_a_flight_with_drag_has_the_thrust_that_was_predicted(force: gs.vehicle.Force) -> None:
    """The whole closed form holds with forces in the model: position by the chains, thrust by the motion."""
    vehicle = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), forces=[force], added_mass=0.05)
    law = gs.design(vehicle, gs.paths.circle(2.0))
    oracle = gs.fly(law, gs.State(position=(2.4, 0, 0.1)), speed=1.0, duration=4).summary()["oracle"]
    assert oracle["max_position_error_m"] < 1e-9
    assert oracle["max_thrust_error_N"] < 1e-8


def test_a_thrust_that_depends_on_the_heading_is_not_predicted() -> None:
    vehicle = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), forces=[LinearDrag((0.2, 0.3, 0.4))])
    law = gs.design(vehicle, gs.paths.circle(2.0))
    found = law.predict(gs.State(position=(2.4, 0, 0.1)), gs.Speed(1.0), np.linspace(0, 2, 5))
    assert np.isnan(found.thrust).all()
    assert np.isfinite(found.position).all()

"""The vehicle class C_V: Newton and Euler, the derivatives of its acceleration, and the input that gives a snap."""

from __future__ import annotations

import dataclasses
import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar import so3
from gammastar.errors import GammastarError, InputError, ShapeError
from gammastar.vehicle import Vehicle, split
from strategies import (
    PAPER_VEHICLE,
    VEHICLES,
    directions,
    flow,
    inertias,
    numbers,
    rotations,
    states,
    vectors,
    vehicles,
)

inputs = st.builds(lambda ddot, torque: np.array([ddot, *torque]), numbers(-50, 50), vectors(5.0))


@functools.cache
def motion(name: str) -> ca.Function:
    """Return (state, input) -> acceleration, jerk, snap, and the derivatives of the first two along the flow (AD)."""
    vehicle = VEHICLES[name]
    state, control, rate = flow(vehicle)
    parts = split(state)
    angular_acceleration = vehicle.rates(parts, control[0], control[1:]).angular_velocity
    acceleration, jerk = vehicle.acceleration(parts), vehicle.jerk(parts)
    results = [
        rate,
        acceleration,
        jerk,
        vehicle.snap(parts, control[0], angular_acceleration),
        ca.jtimes(acceleration, state, rate),
        ca.jtimes(jerk, state, rate),
        vehicle.input_for(parts, vehicle.snap(parts, control[0], angular_acceleration), angular_acceleration[2]),
    ]
    return ca.Function("motion", [state, control], results)


def numbers_of(name: str, x: np.ndarray, u: np.ndarray) -> list[np.ndarray]:
    return [np.array(value).ravel() for value in motion(name)(x, u)]


# --- the motion is Newton's and Euler's ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_momentum_changes_by_the_force(name: str, x: np.ndarray, u: np.ndarray) -> None:
    """Newton in the world frame: m v' = m g e3 - zeta1 R e3 - m K_t, Eq. (1)."""
    vehicle = VEHICLES[name]
    rate = numbers_of(name, x, u)[0]
    R = x[6:15].reshape(3, 3).T
    force = vehicle.mass * (np.array([0, 0, vehicle.gravity]) - vehicle.bias_acceleration) - x[18] * R @ [0, 0, 1]
    assert vehicle.mass * rate[3:6] == pytest.approx(force, abs=1e-13 * (1 + x[18]))
    assert np.array_equal(rate[0:3], x[3:6])
    assert rate[18:].tolist() == [x[19], u[0]]


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_angular_momentum_changes_by_the_torque(name: str, x: np.ndarray, u: np.ndarray) -> None:
    """Euler in the world frame: d/dt (R J Omega) = R (tau - K_r), which is Eq. (3) without its cross product."""
    vehicle = VEHICLES[name]
    rate = numbers_of(name, x, u)[0]
    R, R_rate, omega = x[6:15].reshape(3, 3).T, rate[6:15].reshape(3, 3).T, x[15:18]
    change = R_rate @ vehicle.inertia @ omega + R @ vehicle.inertia @ rate[15:18]
    assert change == pytest.approx(R @ (u[1:] - vehicle.bias_torque), abs=1e-13 * (1 + omega @ omega + np.abs(u).max()))


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_attitude_stays_on_the_group_to_first_order(name: str, x: np.ndarray, u: np.ndarray) -> None:
    """R^T R' is skew and equals hat(Omega), Eqs. (2), (6)."""
    rate = numbers_of(name, x, u)[0]
    R, R_rate = x[6:15].reshape(3, 3).T, rate[6:15].reshape(3, 3).T
    assert R.T @ R_rate == pytest.approx(so3.hat(x[15:18]), abs=1e-13)


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_energy_changes_by_the_power_of_thrust_and_torque(name: str, x: np.ndarray, u: np.ndarray) -> None:
    """d/dt (m v^2/2 - m g z + Omega.J Omega/2) = -zeta1 v.R e3 - m v.K_t + Omega.(tau - K_r)."""
    vehicle = VEHICLES[name]
    rate = numbers_of(name, x, u)[0]
    v, omega, third = x[3:6], x[15:18], x[12:15]
    change = vehicle.mass * (v @ rate[3:6] - vehicle.gravity * v[2]) + omega @ vehicle.inertia @ rate[15:18]
    power = -x[18] * v @ third - vehicle.mass * v @ vehicle.bias_acceleration + omega @ (u[1:] - vehicle.bias_torque)
    assert change == pytest.approx(power, abs=1e-12 * (10 + x[18]) * (1 + v @ v + omega @ omega))


def test_hover_is_an_equilibrium() -> None:
    x = np.array([1, 2, 3, 0, 0, 0, *so3.stack(so3.yaw(30)), 0, 0, 0, PAPER_VEHICLE.weight, 0])
    assert numbers_of("paper", x, np.zeros(4))[0] == pytest.approx(np.zeros(20), abs=1e-15)
    assert PAPER_VEHICLE.weight == pytest.approx(0.98)


# --- acceleration, jerk and snap are derivatives of each other -------------------------------------------------------


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_jerk_is_the_derivative_of_acceleration_along_the_flow(name: str, x: np.ndarray, u: np.ndarray) -> None:
    rate, acceleration, jerk, _, derivative, _, _ = numbers_of(name, x, u)
    assert np.array_equal(acceleration, rate[3:6])
    assert jerk == pytest.approx(derivative, abs=1e-13 * (1 + np.abs(x[18:]).max() * 10))


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_snap_is_the_derivative_of_jerk_along_the_flow(name: str, x: np.ndarray, u: np.ndarray) -> None:
    _, _, _, snap, _, derivative, _ = numbers_of(name, x, u)
    size = np.abs(u).max() * 100 + np.abs(x[15:]).max() ** 3  # an inertia of 0.02 turns torques of 5 into 250 rad/s^2
    assert snap == pytest.approx(derivative, abs=1e-13 * (1 + size))


def test_acceleration_and_jerk_do_not_feel_the_input() -> None:
    """Relative degree four, Eq. (16): the input first enters the snap, and r' never does."""
    state, control, rate = flow(VEHICLES["loaded"])
    parts = split(state)
    for quantity in (parts.position, parts.velocity, VEHICLES["loaded"].acceleration(parts)):
        assert ca.jacobian(ca.simplify(ca.jtimes(quantity, state, rate)), control).nnz() == 0
    spin = ca.SX.sym("spin", 3)
    assert ca.jacobian(VEHICLES["loaded"].snap(parts, control[0], spin), spin[2]).nnz() == 0


@pytest.mark.parametrize("name", VEHICLES)
@settings(max_examples=50)
@given(states(weight=5.0), inputs)
def test_input_for_inverts_the_snap(name: str, x: np.ndarray, u: np.ndarray) -> None:
    """Any input is recovered from the snap and the r' that it causes, for full inertia and constant loads."""
    found = numbers_of(name, x, u)[-1]
    assert found == pytest.approx(u, abs=1e-12 * (1 + np.abs(u).max() + np.abs(x[15:]).max() ** 2 / min(1, x[18])))


@given(vehicles(), states(), vectors(100.0), numbers(-50, 50))
def test_snap_of_the_input_for_it_is_the_snap(vehicle: Vehicle, x: np.ndarray, wanted: np.ndarray, spin: float) -> None:
    """The other way round, with plain numbers in place of graphs: every vehicle, every attitude, any snap."""
    x[18:] *= vehicle.mass * 9.8
    parts = split(ca.DM(x))
    u = vehicle.input_for(parts, ca.DM(wanted), spin)
    turning = vehicle.rates(parts, u[0], u[1:]).angular_velocity
    assert float(turning[2]) == pytest.approx(spin, abs=1e-8)
    # the torque is J Omega'; J may have condition 1000, Omega' is at most m snap / thrust = 100 rad/s^2 and 50 of gyration
    assert np.array(vehicle.snap(parts, u[0], turning)).ravel() == pytest.approx(wanted, abs=1e-8)


@given(states(weight=1.0), directions(), numbers(0, 300))
def test_for_diagonal_inertia_the_input_is_the_one_of_the_design(x: np.ndarray, way: np.ndarray, size: float) -> None:
    """At rest rates: u_d = -m w3, tau_p = (m Jx/zeta1) w2, tau_q = -(m Jy/zeta1) w1 with w = R^T snap."""
    x[15:18], x[19] = 0, 0
    w = x[6:15].reshape(3, 3) @ (size * way)  # rows of the reshaped entries are the columns of R
    m, J, thrust = PAPER_VEHICLE.mass, PAPER_VEHICLE.inertia, x[18]
    expected = [-m * w[2], m * J[0, 0] / thrust * w[1], -m * J[1, 1] / thrust * w[0], 0]
    found = PAPER_VEHICLE.input_for(split(ca.DM(x)), ca.DM(size * way), 0)
    assert np.array(found).ravel() == pytest.approx(expected, abs=1e-12)


# --- what a vehicle can be -------------------------------------------------------------------------------------------


@given(inertias())
def test_every_mass_distribution_is_accepted(inertia: np.ndarray) -> None:
    assert np.allclose(Vehicle(1.0, inertia).inertia, inertia, rtol=0, atol=1e-15)


def test_a_flat_plate_is_on_the_edge_of_the_triangle_inequality_and_accepted() -> None:
    assert np.array_equal(Vehicle(1.0, (0.1, 0.2, 0.3)).inertia, np.diag([0.1, 0.2, 0.3]))


@given(rotations())
def test_three_moments_are_the_diagonal_of_a_matrix(R: np.ndarray) -> None:
    moments = np.array([0.02, 0.03, 0.04])
    assert np.array_equal(Vehicle(1.0, moments).inertia, Vehicle(1.0, np.diag(moments)).inertia)
    turned = Vehicle(1.0, R @ np.diag(moments) @ R.T).inertia
    assert np.linalg.eigvalsh(turned) == pytest.approx(moments, abs=1e-16)
    assert np.array_equal(turned, turned.T)


def test_one_load_for_three_axes_as_in_the_paper() -> None:
    """K_t = col(k_t, k_t, k_t), K_r = col(k_r, k_r, k_r)."""
    vehicle = Vehicle(1.0, (0.1, 0.1, 0.1), bias_acceleration=0.5, bias_torque=-0.2)
    assert vehicle.bias_acceleration.tolist() == [0.5] * 3
    assert vehicle.bias_torque.tolist() == [-0.2] * 3


BAD = {
    "zero mass": ({"mass": 0}, InputError, "mass"),
    "negative mass": ({"mass": -1}, InputError, "mass"),
    "NaN mass": ({"mass": np.nan}, InputError, "mass"),
    "no mass": ({"mass": None}, InputError, "mass"),
    "upward gravity": ({"gravity": -9.8}, InputError, "gravity"),
    "infinite gravity": ({"gravity": np.inf}, InputError, "gravity"),
    "one moment": ({"inertia": 0.1}, ShapeError, "inertia"),
    "two moments": ({"inertia": (0.1, 0.1)}, ShapeError, "inertia"),
    "NaN moment": ({"inertia": (0.1, np.nan, 0.1)}, ShapeError, "inertia"),
    "zero moment": ({"inertia": (0.1, 0.1, 0)}, InputError, "positive definite"),
    "negative moment": ({"inertia": (-0.1, 0.1, 0.1)}, InputError, "positive definite"),
    "indefinite": ({"inertia": [[1, 2, 0], [2, 1, 0], [0, 0, 3]]}, InputError, "positive definite"),
    "lopsided": ({"inertia": [[1, 0.1, 0], [-0.1, 1, 0], [0, 0, 1]]}, InputError, "symmetric"),
    "triangle": ({"inertia": (0.1, 0.1, 0.3)}, InputError, "triangle"),
    "turned triangle": ({"inertia": [[0.2, 0.1, 0], [0.1, 0.2, 0], [0, 0, 0.05]]}, InputError, "triangle"),
    "two loads": ({"bias_acceleration": (1, 2)}, ShapeError, "bias_acceleration"),
    "uneven rows": ({"inertia": [[0.1, 0], [0.1]]}, ShapeError, "inertia .* rows of different lengths"),
    "uneven loads": ({"bias_torque": [[0.1, 0], 0.1]}, ShapeError, "bias_torque"),
    "NaN load": ({"bias_torque": np.nan}, ShapeError, "bias_torque"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_no_body_has_is_refused(case: str) -> None:
    parts, error, reason = BAD[case]
    with pytest.raises(error, match=reason) as caught:
        Vehicle(**{"mass": 1.0, "inertia": (0.1, 0.1, 0.1), **parts})
    assert isinstance(caught.value, GammastarError)


def test_a_vehicle_cannot_be_changed() -> None:
    moments = np.array([0.1, 0.1, 0.1])
    vehicle = Vehicle(1.0, moments)
    moments[0] = 5
    assert vehicle.inertia[0, 0] == 0.1
    with pytest.raises(dataclasses.FrozenInstanceError):
        vehicle.mass = 2.0
    for name in ("inertia", "bias_acceleration", "bias_torque"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(vehicle, name)[0] = 1

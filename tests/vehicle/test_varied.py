"""A vehicle with graphs for numbers moves as the vehicle does that is built with these numbers."""

from __future__ import annotations

import dataclasses

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar.vehicle import Scales, Vehicle, varied
from gammastar.vehicle.state import symbols

DRAG = (gs.LinearDrag((0.3, 0.2, 0.1)), gs.QuadraticDrag(0.05))
SKEW = np.array([[0.03, 0.003, 0.0], [0.003, 0.035, 0.001], [0.0, 0.001, 0.04]])
VEHICLES = {
    "plain": Vehicle(0.5, (0.02, 0.022, 0.025)),
    "with drag": Vehicle(0.5, SKEW, forces=DRAG, bias_torque=0.01, bias_acceleration=(0.1, 0.0, 0.2)),
    "afloat": Vehicle(5.0, 20 * SKEW, added_mass=2.0, forces=(gs.Buoyancy(0.004), gs.LinearDrag(4.0))),
}


def motion(vehicle: Vehicle, *known: ca.SX) -> ca.Function:
    """Return the function (state, input, wind, known) -> rates, jerk and snap."""
    state, control, wind = symbols(), ca.SX.sym("control", 4), ca.SX.sym("wind", 3)
    rates = vehicle.rates(state, control[0], control[1:], wind=wind)
    turning = rates.angular_velocity
    derivatives = vehicle.jerk(state, wind=wind), vehicle.snap(state, control[0], turning, wind=wind)
    return ca.Function("motion", [ca.veccat(*state), control, wind, *known], [ca.vertcat(*rates, *derivatives)])


@pytest.mark.parametrize("name", VEHICLES)
def test_scales_given_as_graphs_act_as_numbers_do(name: str) -> None:
    vehicle, generator = VEHICLES[name], np.random.default_rng(0)
    scales = Scales(ca.SX.sym("mass"), ca.SX.sym("inertia", 3), ca.SX.sym("force"))
    by_graph = motion(varied(vehicle, scales), ca.vertcat(*scales))
    given = np.array([1.2, 0.9, 1.1, 1.3, 0.7])
    root = np.sqrt(given[1:4])
    drag = tuple(
        force
        if isinstance(force, gs.Buoyancy)
        else dataclasses.replace(force, coefficients=given[4] * force.coefficients)
        for force in vehicle.forces
    )
    built = dataclasses.replace(
        vehicle, mass=given[0] * vehicle.mass, inertia=np.asarray(vehicle.inertia) * np.outer(root, root), forces=drag
    )
    by_numbers = motion(built)
    for _ in range(20):
        rotation = gs.so3.exp(generator.normal(size=3))
        state = np.concatenate([generator.normal(size=6), rotation.T.ravel(), generator.normal(size=3), [5.0, 0.4]])
        control, wind = generator.normal(size=4), generator.normal(size=3)
        expected = by_numbers(state, control, wind).full()
        np.testing.assert_allclose(by_graph(state, control, wind, given).full(), expected, rtol=1e-11, atol=1e-11)


def test_scales_of_one_change_nothing() -> None:
    vehicle = VEHICLES["with drag"]
    state, control, wind = np.arange(1.0, 21.0) / 7, np.arange(4.0), np.ones(3)
    same = motion(varied(vehicle, Scales()))(state, control, wind).full()
    np.testing.assert_array_equal(same, motion(vehicle)(state, control, wind).full())


def test_the_vehicle_itself_stays_as_it_was() -> None:
    vehicle = VEHICLES["plain"]
    before = vehicle.signature
    varied(vehicle, Scales(mass=ca.SX.sym("mass")))
    assert vehicle.signature == before
    assert isinstance(vehicle.mass, float)

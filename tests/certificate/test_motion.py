"""Demands of exact following, against the law's closed form, the vehicle's own inverse, and closed forms."""

import casadi as ca
import numpy as np
import pytest

from certificate.curves import QUAD, TURN, closed, lissajous, trefoil, uneven
from gammastar.certificate.motion import Progress, demands, torque_is_exact, unit_derivatives
from gammastar.law import Speed, design
from gammastar.path import catalogue as paths
from gammastar.vehicle import Vehicle, split
from strategies import VEHICLES, state_of_motion


def test_derivatives_by_arc_length_forget_the_parameterisation() -> None:
    angles = np.linspace(0, TURN, 7)
    even = unit_derivatives(closed(trefoil).jets(angles + 0.3 * np.sin(angles)), Progress.METRES)
    odd = unit_derivatives(closed(lambda t: trefoil(uneven(t))).jets(angles), Progress.METRES)
    assert odd == pytest.approx(even, abs=1e-9)
    assert np.linalg.norm(even[:, 1], axis=1) == pytest.approx(1, abs=1e-14)
    assert np.sum(even[:, 1] * even[:, 2], axis=1) == pytest.approx(0, abs=1e-14)


def test_derivatives_by_arc_length_of_a_circle() -> None:
    """sigma^(k) by arc length has size 1 / r^(k-1)."""
    sizes = np.linalg.norm(unit_derivatives(paths.circle(2.0).jets(np.array([1.0])), Progress.METRES)[0, 1:], axis=1)
    assert sizes == pytest.approx([1, 1 / 2, 1 / 4, 1 / 8])


def test_demands_agree_with_the_closed_form_of_the_law() -> None:
    """A start on the path with all its derivatives: the predicted flight stays on it and demands the same."""
    path, speed = closed(lissajous), 0.35
    derivatives = unit_derivatives(path.jets(np.array([0.7])), Progress.PARAMETER)[0]
    start = state_of_motion(QUAD, tuple(speed**k * derivatives[k] for k in range(4)))
    times = np.linspace(0, 6, 50)
    flight = design(QUAD, path).predict(start, Speed(speed), times)
    assert flight.distance.max() < 1e-9
    found = demands(QUAD, unit_derivatives(path.jets(flight.tangential_state[:, 0]), Progress.PARAMETER), speed)
    assert found.thrust == pytest.approx(flight.thrust, rel=1e-8)
    assert found.tilt_rate == pytest.approx(flight.tilt_rate, abs=1e-7)
    assert found.tilt_acceleration == pytest.approx(flight.tilt_acceleration, abs=1e-6)


def torques(vehicle: Vehicle, derivatives: np.ndarray, speed: float) -> np.ndarray:
    """Return |torque| (72,) over headings for r = r' = 0, from the vehicle's own inverse."""
    symbol, snap = ca.SX.sym("state", 20), ca.SX.sym("snap", 3)
    inverse = ca.Function("inverse", [symbol, snap], [vehicle.input_for(split(symbol), snap, 0)])
    motion = tuple(speed**k * derivatives[k] for k in range(5))
    sizes = []
    for heading in np.linspace(0, TURN, 72, endpoint=False):
        state = state_of_motion(vehicle, motion[:4], heading).vector(vehicle.weight)
        sizes.append(np.linalg.norm(np.array(inverse(state, motion[4])).ravel()[1:]))
    return np.array(sizes)


@pytest.mark.parametrize("name", VEHICLES)
def test_no_heading_needs_more_torque_than_the_bound(name: str) -> None:
    vehicle, path, speed = VEHICLES[name], closed(trefoil), 0.9
    for angle in (0.3, 2.0, 4.4):
        derivatives = unit_derivatives(path.jets(np.array([angle])), Progress.PARAMETER)
        (bound,) = demands(vehicle, derivatives, speed).torque
        needed = torques(vehicle, derivatives[0], speed)
        assert needed.max() <= bound * (1 + 1e-12)
        assert bound <= 1.5 * needed.max()
        if torque_is_exact(vehicle):
            assert needed == pytest.approx(bound, rel=1e-10)


def test_the_bound_says_when_it_is_the_torque() -> None:
    assert torque_is_exact(QUAD)
    assert not torque_is_exact(Vehicle(1.0, (1.0, 1.1, 1.2)))
    assert not torque_is_exact(Vehicle(1.0, (1.0, 1.0, 1.2), bias_torque=(0, 0, 0.1)))
    assert not torque_is_exact(Vehicle(1.0, ((1, 0, 0.1), (0, 1, 0), (0.1, 0, 1.2))))


def test_free_fall_demands_without_bound() -> None:
    derivatives = unit_derivatives(paths.line().jets(np.zeros(1)), Progress.METRES)
    found = demands(Vehicle(1.0, (1, 1, 1), gravity=0), derivatives, 2.0)
    assert found.thrust == 0
    assert np.isinf([found.tilt_rate, found.tilt_acceleration, found.torque]).all()

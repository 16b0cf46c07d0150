"""Certificates of vehicles with rotors and forces: what the rotors can give, where they cannot, how fast, and free fall."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from scipy.optimize import linprog

import gammastar as gs
from certificate.curves import QUAD
from gammastar.certificate import Limits, Verdict, certify
from gammastar.certificate.motion import demands, rotor_share, unit_derivatives
from gammastar.law.flatness import Flat
from gammastar.path.sampling import sample
from gammastar.vehicle import LinearDrag, Rotors

ROTORS = Rotors.ring(4, 0.2, 1e-5, 2e-7, 900, slowest=100, first_angle=45)
WITH_ROTORS = dataclasses.replace(QUAD, rotors=ROTORS)
ELLIPSE = gs.paths.ellipse((4.0, 2.0))


def share_by_programme(rotors: Rotors, wrench: np.ndarray) -> float:
    """Return the least t for which rotor thrusts within t times their range about its middle give a wrench."""
    middle, half = (rotors.most_thrusts + rotors.least_thrusts) / 2, (rotors.most_thrusts - rotors.least_thrusts) / 2
    n, scale = rotors.count, rotors.units[:, None]
    equal = np.hstack([rotors.mixer * half / scale, np.zeros((4, 1))])
    inside = np.vstack([np.hstack([sign * np.eye(n), -np.ones((n, 1))]) for sign in (1, -1)])
    right = (wrench - rotors.mixer @ middle) / rotors.units
    answer = linprog([0] * n + [1], inside, np.zeros(2 * n), equal, right, [(None, None)] * (n + 1), method="highs")
    return float(answer.fun)


@pytest.mark.parametrize("rotors", [ROTORS, Rotors.ring(6, 0.3, 1e-5, 2e-7, 800), Rotors.ring(8, 0.3, 1e-5, 2e-7, 800)])
def test_the_rotor_share_is_that_of_a_linear_programme(rotors: Rotors) -> None:
    rng = np.random.default_rng(0)
    wrenches = rng.normal(size=(3, 20, 4)) * rotors.units * 5 + [10, 0, 0, 0]
    rates = np.zeros((3, 20))
    found = rotor_share(rotors, Flat(wrenches[..., 0], rates, rates, rates, wrenches[..., 1:]))
    for k in range(20):
        assert found[k] == pytest.approx(max(share_by_programme(rotors, wrenches[h, k]) for h in range(3)), rel=1e-6)


def test_a_vehicle_without_rotors_and_forces_has_the_rows_it_had() -> None:
    names = [check.name for check in certify(QUAD, ELLIPSE, 0.5).checks]
    assert "rotor share" not in names
    assert [check.name for check in certify(WITH_ROTORS, ELLIPSE, 0.5).checks] == [
        *names[:-1],
        *("rotor share", "rotors' least thrust", "rotors' most thrust", "hover throttle"),
        names[-1],
    ]


def test_rotors_change_no_demand_and_no_floor() -> None:
    bare, found = certify(QUAD, ELLIPSE, 0.8), certify(WITH_ROTORS, ELLIPSE, 0.8)
    for check in bare.checks[:-1]:
        assert found.check(check.name).as_dict() == check.as_dict()
    assert found.largest_speed < bare.largest_speed


def test_what_rotors_can_do_is_stated() -> None:
    found, hover = certify(WITH_ROTORS, ELLIPSE, 0.5), ROTORS.hover(QUAD.weight)
    assert found.check("hover throttle").value == pytest.approx(hover.throttle)
    assert found.check("rotors' most thrust").value == pytest.approx(4 * 1e-5 * 900**2)
    assert found.check("rotors' least thrust").value == pytest.approx(4 * 1e-5 * 100**2)
    assert found.check("rotor share").note == "largest of 8 headings"


@pytest.mark.parametrize("vehicle", [WITH_ROTORS, dataclasses.replace(WITH_ROTORS, forces=[LinearDrag(0.2)])])
def test_at_the_largest_speed_the_rotors_give_all_they_have(vehicle: gs.Vehicle) -> None:
    largest = certify(vehicle, ELLIPSE, 0.5).largest_speed
    samples = sample(ELLIPSE)
    share = demands(vehicle, unit_derivatives(samples.jets, gs.certificate.Progress.PARAMETER), largest).rotor_share
    assert share.max() == pytest.approx(1, abs=1e-4)
    assert certify(vehicle, ELLIPSE, 0.999 * largest).flyable
    assert not certify(vehicle, ELLIPSE, 1.001 * largest).flyable


def test_saturated_stretches_are_named_with_their_places() -> None:
    """An ellipse asks for most at the ends of its long axis."""
    largest = certify(WITH_ROTORS, ELLIPSE, 0.5).largest_speed
    found = certify(WITH_ROTORS, ELLIPSE, 1.05 * largest)
    assert found.check("rotor share").verdict is Verdict.FAILS
    assert len(found.saturated) == 2
    middles = sorted((first.parameter + last.parameter) / 2 % (2 * np.pi) for first, last in found.saturated)
    assert np.abs(np.cos(middles)) == pytest.approx([1, 1], abs=0.02)
    assert found.stretches == ()
    (reason,) = found.reasons
    assert reason.startswith("rotors must be able to give the thrust and torque (got 1.")
    assert "beyond it from parameter" in reason
    assert "fly at most" in reason
    data = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert len(data["saturated_stretches"]) == 2


def test_rotors_that_cannot_carry_the_vehicle_fly_nothing() -> None:
    weak = dataclasses.replace(QUAD, rotors=Rotors.ring(4, 0.2, 1e-6, 2e-8, 500))
    found = certify(weak, gs.paths.circle(), 0.5)
    assert not found.flyable
    assert found.allowed_speeds == ()
    assert found.check("hover throttle").value > 1


def test_no_drag_is_the_limit_of_little() -> None:
    """The scan with forces finds the speeds that the closed form gives without: a loop has two intervals."""
    loop, limits = gs.paths.loop(2.0), Limits(thrust=60.0)
    closed = certify(QUAD, loop, 3.3, limits=limits)
    scanned = certify(dataclasses.replace(QUAD, forces=[LinearDrag(0.0)]), loop, 3.3, limits=limits)
    np.testing.assert_allclose(scanned.allowed_speeds, closed.allowed_speeds, rtol=1e-5, atol=1e-9)
    for name in ("specific thrust", "least thrust", "most thrust", "tilt rate", "tilt acceleration"):
        assert scanned.check(name).value == pytest.approx(closed.check(name).value, rel=1e-9)


def test_drag_along_a_straight_line_is_paid_by_thrust() -> None:
    """Level at a constant speed: |(C v, m g)|."""
    vehicle = dataclasses.replace(QUAD, forces=[LinearDrag(0.5)])
    found = certify(vehicle, gs.paths.line(), 4.0)
    thrust = np.hypot(0.5 * 4.0, QUAD.weight)
    assert found.check("most thrust").value == pytest.approx(thrust, rel=1e-12)
    assert found.check("tilt rate").value == pytest.approx(0, abs=1e-12)


def test_a_satellite_on_a_straight_line_falls_freely_and_is_told_so() -> None:
    preset = gs.vehicles.preset("cubesat")
    limits = Limits(**preset.limits)
    found = certify(preset.vehicle, gs.paths.line(), 0.1, limits=limits)
    assert not found.flyable
    assert "got free fall at parameter -10" in found.reasons[0]
    assert "a straight stretch at constant speed needs no thrust, which is free fall; bend the path" in found.reasons[0]
    assert found.allowed_speeds == ()
    curved = certify(preset.vehicle, gs.paths.circle(), 0.2, limits=limits)
    assert curved.flyable
    assert curved.largest_speed == pytest.approx(np.sqrt(0.475 / 5), rel=1e-9)


def test_drag_lets_a_weightless_vehicle_fly_straight_but_not_slowly() -> None:
    """Balanced by buoyancy the drag alone is pushed against: thrust C v, which has to reach the floor."""
    vehicle = gs.Vehicle(5.0, (0.1, 0.1, 0.1), gravity=0, forces=[LinearDrag(2.0)])
    found = certify(vehicle, gs.paths.line(), 1.0, limits=Limits(thrust=6.0))
    ((low, high),) = found.allowed_speeds
    assert high == pytest.approx(3.0, rel=1e-6)
    assert low == pytest.approx(5.0 * 1e-3 / 2.0, rel=1e-6)

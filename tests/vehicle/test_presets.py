"""Vehicles by name: their numbers are those of their sources, and each can be what it says it is."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import gammastar as gs
from gammastar.certificate import Limits
from gammastar.errors import UnknownNameError
from gammastar.vehicle import Buoyancy, QuadraticDrag, RotorDrag, Vehicle, presets

REVOLUTION = 2 * np.pi / 60  # [rad/s] of one a minute
each_preset = pytest.mark.parametrize("name", presets.names())


@each_preset
def test_every_file_is_a_vehicle_with_a_title_and_a_source(name: str) -> None:
    preset = presets.preset(name)
    assert isinstance(gs.vehicles.load(name), Vehicle)
    assert all(len(line.strip()) > 3 and line.isprintable() for line in (preset.title, preset.source))
    assert set(tomllib.loads(preset.text)) <= {"title", "source", "note", "vehicle", "limits"}
    assert Limits(**preset.limits)


@each_preset
def test_every_number_has_its_source_beside_it(name: str) -> None:
    """Each line that sets a number has a comment; a list of rows has one before it or at a row."""
    body = presets.preset(name).text.split("\n\n", 1)[1]
    entries = body.replace("[\n", "[").replace(",\n", ", ").splitlines()
    for entry in entries:
        if "=" in entry and not entry.startswith(("kind", "#")):
            assert "#" in entry or "positions" in entry, entry
    assert "positions = [\n" not in body or "m, chosen" in body or "# m, source" in body


@each_preset
def test_every_vehicle_with_rotors_hovers(name: str) -> None:
    vehicle = presets.load(name)
    if vehicle.rotors is not None:
        hover = vehicle.rotors.hover(vehicle.weight)
        assert 1.4 < hover.thrust_to_weight < 15
        assert vehicle.rotors.slowest / vehicle.rotors.fastest < hover.throttle < 1
        assert vehicle.rotors.wrench_at(hover.speeds) == pytest.approx([vehicle.weight, 0, 0, 0], abs=1e-12)


def test_the_hummingbird_is_the_one_of_rotorpy() -> None:
    """Mixer and drag against the formulae of RotorPy's Multirotor, written for its axes: z up, y to the left."""
    vehicle, k_eta, k_m, d = presets.load("hummingbird"), 5.57e-6, 1.36e-7, 0.17
    places = d * np.sqrt(0.5) * np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])  # rotor_pos
    torques = np.cross(places, [0, 0, 1]).T + np.array([[0], [0], [1]]) * k_m / k_eta * np.array([1, -1, 1, -1])
    turned = np.diag([1, -1, -1]) @ torques
    assert vehicle.rotors.mixer == pytest.approx(np.vstack([np.ones(4), turned]), abs=1e-8)
    assert vehicle.rotors.most_thrusts == pytest.approx(np.full(4, k_eta * 1500**2))
    frame, rotors = vehicle.forces
    assert isinstance(frame, QuadraticDrag)
    assert frame.coefficients.tolist() == [0.005, 0.005, 0.01]
    assert isinstance(rotors, RotorDrag)
    # four rotors that share a thrust T turn at sqrt(T / (4 k_eta)); each drags with its speed times k_d
    speed = np.sqrt(2.0 / (4 * k_eta))
    drag = 4 * speed * np.array([1.19e-4, 1.19e-4, 2.32e-4])
    assert rotors.coefficients * np.sqrt(2.0) == pytest.approx(drag, rel=1e-6)


def test_the_crazyflie_is_the_one_of_rotorpy() -> None:
    vehicle = presets.load("crazyflie")
    assert vehicle.rotors.hover(vehicle.weight).thrust_to_weight == pytest.approx(1.954, abs=1e-3)  # design.md: 1.95
    drag = 4 * np.array([10.2506e-7, 10.2506e-7, 7.553e-7]) / np.sqrt(4 * 2.3e-8)
    assert vehicle.forces[0].coefficients == pytest.approx(drag, rel=1e-6)
    assert vehicle.rotors.positions[0] == pytest.approx([0.043 * np.sqrt(0.5), -0.043 * np.sqrt(0.5), 0])


def test_coefficients_given_by_revolutions_a_minute_are_converted() -> None:
    l250, f550 = presets.load("crazyflie-l250").rotors, presets.load("f550").rotors
    assert l250.thrust_coefficient == pytest.approx(np.full(4, 3.16e-10 / REVOLUTION**2), rel=1e-5)
    assert l250.torque_coefficient == pytest.approx(np.full(4, 7.94e-12 / REVOLUTION**2), rel=1e-5)
    assert np.append(l250.least_thrusts, l250.most_thrusts) == pytest.approx([0.0128] * 4 + [0.12] * 4, rel=1e-4)
    assert np.abs(l250.positions[:, :2]) == pytest.approx(np.full((4, 2), 0.03253), rel=1e-3)
    assert f550.thrust_coefficient == pytest.approx(np.full(6, 1.2216e-7 / REVOLUTION**2), rel=1e-5)
    assert [f550.slowest, f550.fastest] == pytest.approx([906 * REVOLUTION, 9068 * REVOLUTION], rel=1e-5)


def test_the_racer_has_its_arms_where_its_inertia_has_them() -> None:
    vehicle = presets.load("racer")
    x, y, _ = np.abs(vehicle.rotors.positions).T
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(np.full(4, 56.0), abs=1e-4)
    assert np.hypot(x, y) == pytest.approx(np.full(4, 0.14), abs=1e-6)
    assert vehicle.rotors.most_thrusts == pytest.approx(np.full(4, 8.5), rel=1e-5)
    assert vehicle.inertia[0, 0] > vehicle.inertia[1, 1]  # mass far to the sides weighs on roll


def test_the_sphere_has_the_mass_of_potential_flow() -> None:
    """Added mass is half the displaced mass; the inertia is that of a solid sphere, and water turns with none of it."""
    vehicle, radius = presets.load("sphere-auv"), 0.15
    volume = 4 / 3 * np.pi * radius**3
    assert vehicle.added_mass == pytest.approx(0.5 * 1000 * volume, rel=1e-6)
    assert vehicle.inertia == pytest.approx(np.eye(3) * 0.4 * vehicle.mass * radius**2)
    assert vehicle.weight == pytest.approx((vehicle.mass - 1000 * volume) * 9.80665, rel=1e-5)
    drag = next(each for each in vehicle.forces if isinstance(each, QuadraticDrag))
    assert drag.coefficients == pytest.approx(np.full(3, 0.5 * 1000 * np.pi * radius**2 * 0.47), rel=1e-4)


def test_the_underwater_vehicle_takes_the_mean_of_what_leaves_the_class() -> None:
    vehicle = presets.load("bluerov2-heavy")
    assert vehicle.added_mass == pytest.approx(np.mean([6.3567, 7.1206, 18.6863]))
    assert np.diag(vehicle.inertia) == pytest.approx(np.add([0.26, 0.23, 0.37], [0.1858, 0.1348, 0.2215]))
    assert isinstance(vehicle.forces[0], Buoyancy)
    assert vehicle.weight == pytest.approx((13.5 - 0.0134 * 999.7025) * 9.81)


def test_the_satellite_has_no_weight_and_the_thrust_of_its_thruster() -> None:
    preset = presets.preset("cubesat")
    assert preset.vehicle.weight == 0
    assert dict(preset.limits) == {"thrust": 0.475, "torque": 2e-4}
    assert preset.as_dict()["thrust_to_weight"] is None
    assert preset.most_thrust == 0.475


@pytest.mark.parametrize("name", ["humingbird", "", 3, None])
def test_an_unknown_vehicle_is_refused_with_the_known_ones(name: str) -> None:
    with pytest.raises(UnknownNameError, match="a vehicle must be one of bluerov2-heavy, crazyflie"):
        gs.vehicles.load(name)

"""Headings: the nose goes where it should by yaw alone, and the path does not notice."""

from __future__ import annotations

import numpy as np
import pytest

import gammastar as gs

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
PATH = gs.paths.nonplanar_circle()
START = gs.State(position=(1.8, 0.1, 1.2), attitude=gs.so3.roll(60) @ gs.so3.yaw(150))
POINT = np.array([0.0, 0.0, 1.0])


def wanted_direction(heading: object, flight: gs.FlightRecord) -> np.ndarray:
    """Return the direction (n, 3) in the world that the nose should point to, from the flight alone."""
    if isinstance(heading, gs.Along):
        return PATH.tangents(flight.tangential_state[:, 0])
    if isinstance(heading, gs.Azimuth):
        return np.broadcast_to([0.0, 1.0, 0.0], flight.position.shape)
    return POINT - flight.position


def miss(heading: object, flight: gs.FlightRecord) -> np.ndarray:
    """Return the angle (n,) [deg] between the nose and the part of the direction that yaw can reach."""
    third, wanted = flight.attitude[:, :, 2], wanted_direction(heading, flight)
    reachable = wanted - third * np.sum(third * wanted, axis=1, keepdims=True)
    reachable = reachable / np.linalg.norm(reachable, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.clip(np.sum(reachable * flight.attitude[:, :, 0], axis=1), -1, 1)))


@pytest.mark.parametrize("heading", [gs.Along(), gs.Azimuth((0, 1, 0)), gs.Towards(POINT)])
def test_the_nose_turns_in_and_the_path_does_not_notice(heading: object) -> None:
    law = gs.design(VEHICLE, PATH, poles=-3)
    flight = gs.fly(law, START, speed=0.6, heading=heading, duration=20)
    assert miss(heading, flight)[flight.time > 12].max() < 1.0
    assert flight.summary()["oracle"]["max_position_error_m"] < 1e-8
    assert flight.prediction.yaw_output is None


def test_upside_down_the_nose_turns_in_as_well() -> None:
    """A fast vertical loop is flown inverted at the top; an azimuth across its plane stays reachable and is kept."""
    law = gs.design(VEHICLE, gs.paths.loop(radius=2.0), poles=-3)
    flight = gs.fly(law, gs.State(position=(0, 0.1, 2.2)), speed=3.3, heading=gs.Azimuth((0, 1, 0)), duration=15)
    settled = flight.time > 8
    assert flight.attitude[settled, 2, 2].min() < -0.9
    assert miss(gs.Azimuth((0, 1, 0)), flight)[settled].max() < 1.0


def test_a_direction_along_the_thrust_axis_leaves_the_nose_free_and_everything_finite() -> None:
    law = gs.design(VEHICLE, gs.paths.line(), poles=-3)
    flight = gs.fly(law, gs.State(position=(0, 0.5, 0)), speed=0.0, heading=gs.Azimuth((0, 0, 1)), duration=10)
    assert flight.completed
    assert np.abs(flight.angular_velocity[-1]).max() < 1e-6


@pytest.mark.parametrize("wrong", [lambda: gs.Azimuth((0, 0, 0)), lambda: gs.Along(gain=0), lambda: gs.Towards((1, 2))])
def test_what_is_no_heading_is_refused(wrong) -> None:
    with pytest.raises(gs.errors.InputError):
        wrong()

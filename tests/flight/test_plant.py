"""The plant: rotors that follow, commands that arrive late, air that moves."""

import dataclasses

import casadi as ca
import numpy as np
import pytest

from gammastar import LinearDrag, Rotors, State, Vehicle, so3
from gammastar.flight import integrator
from gammastar.flight.plant import MOTION, Plant

ROTORS = Rotors.ring(4, 0.17, 5.57e-6, 1.36e-7, 1500.0, lag=(0.02, 0.04), first_angle=45)
BODY = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
INTERVAL = 0.004


def plant(vehicle: Vehicle, substeps: int = 4, interface: str = "wrench") -> Plant:
    return Plant(vehicle, INTERVAL, substeps, integrator("rkmk4"), interface)


def stepped(of: Plant) -> ca.Function:
    state, command, wind = ca.SX.sym("state", of.size), ca.SX.sym("command", of.command_size), ca.SX.sym("wind", 3)
    return ca.Function("step", [state, command, wind], [of.step(state, command, wind)])


def moving(thrust: float = 5.0) -> np.ndarray:
    generator = np.random.default_rng(2)
    velocity, rates = generator.normal(size=(2, 3))
    return State((1, 2, 3), velocity, so3.random(generator), rates, thrust).vector(thrust)


def started(of: Plant, state: np.ndarray) -> np.ndarray:
    return of.start(ca.DM(state)).full()[:, 0]


def test_rotors_follow_a_command_exponentially_up_and_down() -> None:
    """w(t) = c + (w0 - c) exp(-t/lag) with the lag of the direction."""
    of = plant(dataclasses.replace(BODY, rotors=ROTORS))
    start = started(of, moving())
    first, command = start[MOTION:], np.add(start[MOTION:], (100, -100, 50, -20))
    after = stepped(of)(start, command, np.zeros(3)).full().ravel()[MOTION:]
    lags = np.where(command > first, 0.02, 0.04)
    assert after == pytest.approx(command + (first - command) * np.exp(-INTERVAL / lags), abs=1e-6)


def test_rotors_without_lag_are_what_is_commanded() -> None:
    of = plant(dataclasses.replace(BODY, rotors=dataclasses.replace(ROTORS, lag=0.0)))
    command = np.array([700.0, 720.0, 740.0, 1e9])
    after = stepped(of)(started(of, moving()), command, np.zeros(3)).full().ravel()[MOTION:]
    assert after == pytest.approx([700, 720, 740, 1500])  # within the limits, whatever is commanded


def test_rotors_and_the_wrench_they_give_move_a_body_alike() -> None:
    """Rotors without lag that give a wrench and the wrench itself are the same plant."""
    rotors = dataclasses.replace(ROTORS, lag=0.0)
    with_rotors, bare = plant(dataclasses.replace(BODY, rotors=rotors)), plant(BODY)
    speeds = np.array([600.0, 650.0, 700.0, 640.0])
    wrench = np.asarray(rotors.mixer) @ (5.57e-6 * speeds**2)
    one = stepped(with_rotors)(started(with_rotors, moving()), speeds, np.zeros(3)).full().ravel()
    other = stepped(bare)(started(bare, moving()), wrench, np.zeros(3)).full().ravel()
    assert one[:MOTION] == pytest.approx(other[:MOTION], abs=1e-14)


def test_a_command_acts_after_the_latency_rounded_up_to_intervals() -> None:
    of = plant(dataclasses.replace(BODY, latency=1.5 * INTERVAL))
    assert of.pending == 2
    step, state = stepped(of), started(of, moving(5.0))
    free = stepped(plant(BODY))
    expected = moving(5.0)[:MOTION]
    commands = [np.array([7.0 + k, 0.01 * k, -0.02, 0.003]) for k in range(4)]
    acting = [np.array([5.0, 0, 0, 0])] * 2 + commands
    for command, acts in zip(commands, acting, strict=False):
        state = step(state, command, np.zeros(3)).full().ravel()
        expected = free(expected, acts, np.zeros(3)).full().ravel()
        assert state[:MOTION] == pytest.approx(expected, abs=1e-14)


def test_steady_wind_is_a_moving_frame() -> None:
    """Drag knows the air alone: in wind w the motion is that in calm air, carried along by w (Galilei)."""
    of, wind = plant(dataclasses.replace(BODY, forces=[LinearDrag((0.2, 0.3, 0.4))])), np.array([3.0, -1.0, 0.5])
    step, start, wrench = stepped(of), started(of, moving()), np.array([5.5, 0.01, -0.02, 0.003])
    in_wind = step(start, wrench, wind).full().ravel()
    carried = start.copy()
    carried[3:6] -= wind
    in_calm = step(carried, wrench, np.zeros(3)).full().ravel()
    in_calm[:3] += INTERVAL * wind
    in_calm[3:6] += wind
    assert in_wind == pytest.approx(in_calm, abs=1e-13)


def test_an_inner_loop_follows_commanded_rates_exponentially() -> None:
    of = plant(dataclasses.replace(BODY, rate_bandwidth=30.0), interface="rates")
    start, command = started(of, moving()), np.array([5.0, 1.0, -2.0, 0.5])
    after = stepped(of)(start, command, np.zeros(3)).full().ravel()[15:18]
    assert after == pytest.approx(command[1:] + (start[15:18] - command[1:]) * np.exp(-30 * INTERVAL), abs=1e-8)


def test_more_integration_steps_change_next_to_nothing() -> None:
    """The integrator is of fourth order also with the speeds of rotors among its states."""
    vehicle = dataclasses.replace(BODY, rotors=ROTORS)
    results = []
    for substeps in (1, 2, 4, 64):
        of = plant(vehicle, substeps)
        results.append(stepped(of)(started(of, moving()), np.array([900.0, 500, 800, 600]), np.zeros(3)).full().ravel())
    errors = [np.abs(result - results[-1])[:MOTION].max() for result in results[:-1]]
    assert errors[0] / errors[1] > 12
    assert errors[1] / errors[2] > 12


def test_a_lag_shorter_than_any_step_is_no_lag() -> None:
    """The speeds are known exactly, so nothing becomes stiff: from a lag of a nanosecond to none nothing changes."""
    results = []
    for lag in (1e-9, 0.0):
        of = plant(dataclasses.replace(BODY, rotors=dataclasses.replace(ROTORS, lag=lag)), substeps=1)
        command = np.array([700.0, 720.0, 740.0, 730.0])
        start = started(of, moving())
        start[MOTION:] = command
        results.append(stepped(of)(start, command, np.zeros(3)).full().ravel())
    assert results[0] == pytest.approx(results[1], abs=1e-12)

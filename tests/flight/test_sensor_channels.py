"""Sensors with rates, biases, delays and lost samples: each is measured on what the graph tells, against what was asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from gammastar import so3
from gammastar.errors import InputError
from gammastar.flight import PATH_FLYER, Channel, Sensors
from gammastar.law.measurement import AXES, CHANNELS, SIZE
from gammastar.vehicle import State, split
from strategies import states

RATE = 100.0  # [Hz] of control
PARTS = {"position": slice(0, 3), "velocity": slice(3, 6), "attitude": slice(6, 15), "angular_velocity": slice(15, 18)}


def told(sensors: Sensors, truth: np.ndarray, seed: int = 0, rate: float = RATE) -> np.ndarray:
    """Return measurements (n, 22) of true states (n, 20), one a control interval."""
    n, size = len(truth), sensors.size(rate)
    memory, state, outside = ca.SX.sym("memory", size), ca.SX.sym("state", 20), ca.SX.sym("outside", 24)
    step = ca.Function("step", [memory, state, outside], list(sensors.measured(memory, split(state), outside, rate)))
    start = sensors.start(ca.DM(truth[0]), rate).full()[:, 0]
    assert start.shape == (size,)
    columns = np.vstack([truth.T, sensors.exogenous(seed, n, rate)])
    symbol = ca.MX.sym("columns", 44)
    whole = ca.Function(
        "whole", [memory_ := ca.MX.sym("memory", size), symbol], step(memory_, symbol[:20], symbol[20:])
    )
    _, measurements = whole.mapaccum("all", n)(start, columns)
    return np.asarray(measurements.full().T)


def still(n: int) -> np.ndarray:
    """Return a vehicle (n, 20) that stays turned and moving as it is, away from zero."""
    state = State((1, 2, 3), (0.4, -0.5, 0.6), so3.exp([0.3, -1.2, 0.8]), (0.1, 0.2, -0.3))
    return np.tile(state.vector(1.0), (n, 1))


def moving(n: int) -> np.ndarray:
    """Return a vehicle (n, 20) of which every number differs from interval to interval."""
    rng = np.random.default_rng(5)
    truth = rng.standard_normal((n, 20))
    truth[:, 6:15] = [so3.stack(so3.random(rng)) for _ in range(n)]
    return truth


def errors(measurements: np.ndarray, truth: np.ndarray, channel: str) -> np.ndarray:
    """Return (n, 3) what a channel adds: a difference, or the rotation vector of R^T R_measured."""
    seen, true = measurements[:, PARTS[channel]], truth[:, PARTS[channel]]
    if channel != "attitude":
        return seen - true
    return np.array([so3.log(so3.unstack(t).T @ so3.unstack(s)) for s, t in zip(seen, true, strict=True)])


@given(st.lists(states(), min_size=2, max_size=4))
def test_ideal_sensors_tell_the_truth(rows: Sequence[np.ndarray]) -> None:
    truth = np.array(rows)
    measurements = told(Sensors(), truth)
    assert np.array_equal(measurements[:, :18], truth[:, :18])
    assert np.all(measurements[:, 18:] == 1)


@pytest.mark.parametrize("channel", CHANNELS)
def test_errors_are_white_with_deviation_and_bias_as_asked(channel: str) -> None:
    """5,000 samples: the mean within 4 deviations of itself (4 s / sqrt(n)), the deviation within 4 percent (4 / sqrt(2 n))."""
    deviation, bias = np.array([0.01, 0.02, 0.03]), np.array([0.05, -0.02, 0.0])
    truth = still(5000)
    found = errors(told(Sensors(**{channel: Channel(deviation, bias=bias)}), truth, seed=1), truth, channel)
    assert found.mean(axis=0) == pytest.approx(bias, abs=4 * 0.03 / np.sqrt(5000))
    assert found.std(axis=0) == pytest.approx(deviation, rel=0.04)
    scaled = (found - bias) / deviation
    assert np.mean(scaled[1:] * scaled[:-1], axis=0) == pytest.approx(np.zeros(3), abs=4 / np.sqrt(5000))
    assert np.corrcoef(scaled.T) == pytest.approx(np.eye(3), abs=4 / np.sqrt(5000))
    assert min(scipy.stats.kstest(axis, "norm").pvalue for axis in scaled.T) > 1e-3


def test_a_measured_attitude_is_a_rotation() -> None:
    measurements = told(Sensors(attitude=Channel(0.3, bias=0.5, delay=0.02)), moving(50))
    assert so3.drift(measurements[:, 6:15].reshape(-1, 3, 3)) < 1e-14


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("rate", [100.0, 50.0, 33.0, 7.0, 0.5, 1000.0])
def test_a_channel_samples_at_its_rate_and_holds_in_between(channel: str, rate: float) -> None:
    """Of n intervals the k-th holds a new sample where floor(k f / F) grows: the mean rate is f, no gap differs by more than one."""
    truth = moving(1001)
    measurements = told(Sensors(**{channel: Channel(rate=rate)}), truth)
    flags = measurements[:, 18 + CHANNELS.index(channel)]
    assert set(flags) <= {0.0, 1.0}
    taken = np.flatnonzero(flags)
    assert taken[0] == 0
    assert len(taken) == pytest.approx(1 + 1000 * min(1.0, rate / RATE), abs=1)
    assert np.ptp(np.diff(taken)) <= 1
    last = np.searchsorted(taken, np.arange(1001), side="right") - 1
    assert np.array_equal(measurements[:, PARTS[channel]], truth[taken[last]][:, PARTS[channel]])


def test_axes_may_have_rates_of_their_own() -> None:
    truth = moving(101)
    measurements = told(PATH_FLYER, truth)
    flags = measurements[:, 18]
    assert flags[0] == 1
    assert flags[20] == 1  # 5 Hz is every twentieth interval
    assert np.all(np.delete(flags, [0, 20, 40, 60, 80, 100]) == AXES[2])
    assert np.array_equal(measurements[1:20, :2], np.tile(measurements[0, :2], (19, 1)))
    assert np.unique(measurements[:, 2]).size == 101
    assert np.all(measurements[:, 20:] == 1)


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize(("delay", "late"), [(0.0, 0), (0.01, 1), (0.03, 3), (0.0301, 4), (0.001, 1), (0.07, 7)])
def test_a_delay_is_rounded_up_to_control_intervals(channel: str, delay: float, late: int) -> None:
    """What is told at k is the truth at k - d; before the first instant the vehicle was where it started."""
    truth = moving(30)
    found = told(Sensors(**{channel: Channel(delay=delay)}), truth)[:, PARTS[channel]]
    wanted = truth[np.maximum(np.arange(30) - late, 0), PARTS[channel]]
    assert found == pytest.approx(wanted, abs=1e-15)


def test_delays_of_the_channels_do_not_disturb_each_other() -> None:
    truth = moving(40)
    sensors = Sensors(Channel(delay=0.02), Channel(delay=0.05), Channel(delay=0.01), Channel(delay=0.03))
    found = told(sensors, truth)
    for late, part in zip((2, 5, 1, 3), PARTS.values(), strict=True):
        assert found[10:, part] == pytest.approx(truth[10 - late : 40 - late, part], abs=1e-15)


@pytest.mark.parametrize("dropout", [0.0, 0.1, 0.7])
def test_the_share_of_lost_samples_is_the_dropout(dropout: float) -> None:
    """4,000 independent losses: the share within 4 sqrt(p (1 - p) / n), and no run of losses longer than independence explains."""
    flags = told(Sensors(velocity=Channel(dropout=dropout)), still(4000))[:, 19]
    spread = 4 * np.sqrt(dropout * (1 - dropout) / 4000)
    assert 1 - flags.mean() == pytest.approx(dropout, abs=spread + 1e-12)
    both = (1 - flags[1:]) * (1 - flags[:-1])
    assert both.mean() == pytest.approx(dropout**2, abs=2 * spread + 1e-12)


def test_a_lost_sample_is_held_over() -> None:
    truth = moving(200)
    found = told(Sensors(position=Channel(dropout=0.5)), truth)
    for k in range(1, 200):
        assert np.array_equal(found[k, :3], truth[k, :3] if found[k, 18] else found[k - 1, :3])


@given(st.integers(0, 2**32), st.integers(1, 60), st.integers(0, 60))
def test_the_beginning_of_a_flight_does_not_depend_on_its_length(seed: int, n: int, more: int) -> None:
    sensors = Sensors(
        Channel(0.1, 30, dropout=0.3), Channel(0.2), Channel(0.3, 7, dropout=0.1), Channel(0.4, (5, 9, 200))
    )
    short, long = sensors.exogenous(seed, n, RATE), sensors.exogenous(seed, n + more, RATE)
    assert short.shape == (24, n)
    assert np.array_equal(short, long[:, :n])
    assert np.array_equal(short, sensors.exogenous(seed, n, RATE))
    assert not np.array_equal(short, sensors.exogenous(seed + 1, n, RATE))


def test_a_channel_does_not_feel_the_others() -> None:
    one = Sensors(velocity=Channel(0.2, dropout=0.2)).exogenous(4, 50, RATE)
    other = Sensors(Channel(0.1, 3), Channel(0.2, dropout=0.2), Channel(0.3, dropout=0.5)).exogenous(4, 50, RATE)
    assert np.array_equal(one[6:12], other[6:12])
    both = Sensors(Channel(1.0, dropout=0.5), Channel(1.0, dropout=0.5)).exogenous(4, 50, RATE)
    assert not np.array_equal(both[0:3], both[6:9])  # and no two channels share their noise or their losses
    assert not np.array_equal(both[3:6], both[9:12])


def test_deviations_go_by_channel() -> None:
    deviations = Sensors(Channel(0.1), Channel((0.1, 0.2, 0.3)), angular_velocity=Channel(0.4)).deviations()
    assert [(name, values.tolist()) for name, values in deviations.items()] == [
        ("position", [0.1] * 3),
        ("velocity", [0.1, 0.2, 0.3]),
        ("attitude", [0] * 3),
        ("angular_velocity", [0.4] * 3),
    ]


def test_before_the_first_sample_the_start_is_held_with_its_bias() -> None:
    """Where even the first sample is lost, the sensor tells the start, off by its bias."""
    sensors = Sensors(*(Channel(bias=(0.1, 0.2, 0.3), dropout=0.999) for _ in CHANNELS))
    truth = still(3)
    found = told(sensors, truth)
    assert np.all(found[:, 18:] == 0)
    for channel in CHANNELS:
        assert errors(found, truth, channel) == pytest.approx(np.tile([0.1, 0.2, 0.3], (3, 1)))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"deviation": -0.1}, "deviation of a sensor"),
        ({"deviation": (0.1, 0.2)}, "deviation of a sensor"),
        ({"deviation": np.nan}, "deviation of a sensor"),
        ({"deviation": 1e100}, "deviation of a sensor"),
        ({"bias": 1e300}, "bias of a sensor"),
        ({"bias": "no"}, "bias of a sensor"),
        ({"rate": 0}, "rate of a sensor"),
        ({"rate": (5, 5, -1)}, "rate of a sensor"),
        ({"delay": -1e-3}, "delay of a sensor"),
        ({"delay": np.inf}, "delay of a sensor"),
        ({"dropout": 1.0}, "dropout of a sensor"),
        ({"dropout": -0.1}, "dropout of a sensor"),
    ],
    ids=str,
)
def test_what_no_sensor_can_be_is_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=f"^{words}.* must .*; "):
        Channel(**arguments)


def test_what_no_vehicle_can_carry_is_refused() -> None:
    with pytest.raises(InputError, match="attitude"):
        Sensors(attitude=Channel(rate=(1, 2, 3)))
    with pytest.raises(InputError, match=r"gs\.Channel"):
        Sensors(position=0.1)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="at most 500 control intervals"):
        Sensors(position=Channel(delay=6.0)).size(RATE)
    assert Sensors().size(RATE) == SIZE - 4

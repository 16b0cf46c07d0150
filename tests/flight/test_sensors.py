"""Sensor noise: what it is, that it repeats with its seed, and how it is converted between rates."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from gammastar import so3
from gammastar.errors import InputError
from gammastar.flight import SensorNoise
from gammastar.flight.noise import SIZE, density_preserving, measured
from gammastar.law.measurement import CHANNELS
from gammastar.vehicle import join, split
from strategies import numbers, states, vectors

NOISE = SensorNoise((0.1, 0.2, 0.3), (0.01, 0.02, 0.03), (1e-3, 2e-3, 3e-3), (0.5, 0.6, 0.7))


def measuring() -> ca.Function:
    state, noise = ca.SX.sym("state", 20), ca.SX.sym("noise", SIZE)
    return ca.Function("measured", [state, noise], [ca.densify(join(measured(split(state), noise)))])


MEASURED = measuring()


@given(states(), vectors(0.3, SIZE))
def test_noise_is_added_and_turns_the_attitude_in_body_axes(x: np.ndarray, noise: np.ndarray) -> None:
    """Position, velocity, rates plus noise; measured R = R exp(noise), still a rotation; the thrust states are exact."""
    found = np.array(MEASURED(x, noise)).ravel()
    assert found[:6] == pytest.approx(x[:6] + noise[:6], abs=0)
    R, turned = so3.unstack(x[6:15]), so3.unstack(found[6:15])
    assert so3.log(R.T @ turned) == pytest.approx(noise[6:9], abs=1e-13)
    assert so3.drift(turned) < 1e-14
    assert found[15:18] == pytest.approx(x[15:18] + noise[9:], abs=0)
    assert found[18:].tolist() == x[18:].tolist()


@given(states())
def test_no_noise_measures_the_state_itself(x: np.ndarray) -> None:
    assert np.array_equal(np.array(MEASURED(x, np.zeros(SIZE))).ravel(), x)


@given(st.integers(0, 2**32), st.integers(1, 50), st.integers(0, 50))
def test_a_sample_depends_on_its_seed_and_its_number_alone(seed: int, steps: int, more: int) -> None:
    short, long = NOISE.samples(seed, steps), NOISE.samples(seed, steps + more)
    assert short.shape == (SIZE, steps)
    assert np.array_equal(short, long[:, :steps])
    assert not np.array_equal(short, NOISE.samples(seed + 1, steps))


def test_samples_are_white_and_gaussian_with_the_given_deviations() -> None:
    samples = NOISE.samples(3, 20_000)
    scaled = samples / NOISE.deviations()[:, None]
    for row in scaled:
        assert scipy.stats.kstest(row, "norm").pvalue > 1e-3
    assert np.corrcoef(scaled) == pytest.approx(np.eye(SIZE), abs=0.03)  # 1 / sqrt(20000) = 0.007
    assert np.mean(scaled[:, 1:] * scaled[:, :-1], axis=1) == pytest.approx(np.zeros(SIZE), abs=0.03)


def test_deviations_are_in_the_order_of_the_channels() -> None:
    assert NOISE.deviations().tolist() == [0.1, 0.2, 0.3, 0.01, 0.02, 0.03, 1e-3, 2e-3, 3e-3, 0.5, 0.6, 0.7]
    assert len(CHANNELS) * 3 == SIZE
    assert SensorNoise().deviations().tolist() == [0] * SIZE


@given(numbers(0, 10), numbers(1, 1000), numbers(1, 1000), numbers(0.1, 10))
def test_converting_a_rate_keeps_the_mean_over_any_time(
    deviation: float, sensor: float, control: float, time: float
) -> None:
    """The mean of f T white samples has variance s^2 / (f T): the same at both rates when s^2 / f is kept."""
    converted = density_preserving(deviation, sensor, control)
    assert converted**2 / (control * time) == pytest.approx(deviation**2 / (sensor * time), rel=1e-12)
    assert density_preserving(deviation, sensor, sensor) == deviation


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("value", [(-0.1, 0, 0), (0, np.nan, 0), (0, 0), 0.1], ids=str)
def test_deviations_are_three_numbers_from_zero_up(channel: str, value: object) -> None:
    with pytest.raises(InputError, match=f"noise of {channel}"):
        SensorNoise(**{channel: value})


@pytest.mark.parametrize("rates", [(0.1, 0.0, 100.0), (0.1, 100.0, -1.0), (-0.1, 100.0, 100.0), (0.1, np.nan, 1.0)])
def test_rates_are_positive(rates: tuple[float, float, float]) -> None:
    with pytest.raises(InputError):
        density_preserving(*rates)

"""Wind: gusts have the stated variance, correlation and spectrum at every control rate, and the stated direction."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.integrate
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from gammastar import engine
from gammastar.errors import InputError
from gammastar.flight.draws import Draws
from gammastar.flight.wind import SIZE, STATIONARY, Gusts, Wind
from strategies import numbers, vectors

GUSTS = Gusts((1.0, 0.8, 0.5), (0.5, 0.4, 0.2))


def test_the_spectra_hold_the_variance() -> None:
    """The integral of a one-sided density over all frequencies is s^2."""
    for axis in range(3):
        total, _ = scipy.integrate.quad(lambda f, axis=axis: GUSTS.density([f])[axis, 0], 0, np.inf, limit=500)
        assert total == pytest.approx(np.asarray(GUSTS.deviation)[axis] ** 2, rel=1e-6)


@pytest.mark.parametrize("rate", [20.0, 100.0, 500.0])
def test_variance_and_correlation_do_not_depend_on_the_control_rate(rate: float) -> None:
    """Over 4,000 correlation times the deviation is known within some 3 percent, a correlation within some 0.04.

    Correlation at a lag t: exp(-t/T) along, (1 - t/(2 T)) exp(-t/T) across and below.
    """
    gusts = Gusts((1.0, 0.8, 0.5), 0.25)
    n = int(1000 * rate)
    samples = gusts.samples(2, n, rate)
    assert samples.std(axis=1) == pytest.approx(np.asarray(gusts.deviation), rel=0.05)
    scaled = samples / np.asarray(gusts.deviation)[:, None]
    assert np.corrcoef(scaled) == pytest.approx(np.eye(3), abs=0.08)
    for lag in (0.05, 0.25, 0.5):
        shift, t = round(lag * rate), lag / 0.25
        found = np.mean(scaled[:, shift:] * scaled[:, : n - shift], axis=1)
        lateral = (1 - t / 2) * np.exp(-t)
        assert found == pytest.approx([np.exp(-t), lateral, lateral], abs=0.06)


def test_the_spectrum_is_drydens() -> None:
    """Welch's estimate in bands that average 100 or more frequencies, well below the sampling frequency: within 8 percent."""
    rate = 200.0
    samples = GUSTS.samples(1, 400_000, rate)
    frequency, found = scipy.signal.welch(samples, rate, nperseg=16_384)
    for low, high in [(0.02, 0.1), (0.1, 0.3), (0.3, 1.0), (1.0, 3.0), (3.0, 10.0)]:
        band = (frequency > low) & (frequency <= high)
        ratio = found[:, band].mean(axis=1) / GUSTS.density(frequency[band]).mean(axis=1)
        assert ratio == pytest.approx(np.ones(3), abs=0.25 if high < 0.2 else 0.1)


def blown(wind: Wind, state: np.ndarray) -> np.ndarray:
    """Return the velocity (3,) of the air in a state of the wind."""
    symbol = ca.SX.sym("state", wind.size)
    return np.asarray(ca.Function("air", [symbol], [ca.densify(wind.velocity(symbol))])(state).full().ravel())


@pytest.mark.parametrize("time", [0.01, 1.0, 300.0, 1e5])
def test_the_first_sample_is_as_likely_as_any_other(time: float) -> None:
    """Stationary from the start: over 4,000 flights the first and the third state of each axis have covariance [1/2 1/4; 1/4 1/4]."""
    gusts, flights = Gusts(1.0, time), np.arange(4000)
    state, uniforms = ca.SX.sym("state", SIZE), ca.SX.sym("uniforms", 6)
    step = ca.Function("step", [state, uniforms], [gusts.advanced(state, Draws(gusts.pairs, uniforms), 1.0)])
    states = gusts.start(3, flights)
    for k in range(3):
        for axis in range(3):
            covariance = np.cov(states[2 * axis : 2 * axis + 2])
            assert covariance == pytest.approx(STATIONARY, abs=0.04)
        states = step(states, engine.uniforms(3, flights, [k], gusts.pairs)[:, 0]).full()


@given(st.integers(0, 2**32), st.integers(1, 60), st.integers(0, 60))
def test_the_beginning_of_a_flight_does_not_depend_on_its_length(seed: int, n: int, more: int) -> None:
    short, long = GUSTS.samples(seed, n, 100.0), GUSTS.samples(seed, n + more, 100.0)
    assert short.shape == (3, n)
    assert np.array_equal(short, long[:, :n])
    assert not np.array_equal(short, GUSTS.samples(seed + 1, n, 100.0))
    assert not np.array_equal(short, GUSTS.samples(seed, n, 100.0, flight=1))


def test_an_axis_does_not_feel_the_others() -> None:
    one, all_three = (
        Gusts((0.0, 1.0, 0.0), 0.5).samples(7, 40, 100.0),
        Gusts((2.0, 1.0, 3.0), 0.5).samples(7, 40, 100.0),
    )
    assert np.array_equal(one[1], all_three[1])
    assert not one[[0, 2]].any()
    assert Gusts(1.0, 0.5).start(7, [0, 4])[:, 1].tolist() == Gusts(1.0, 0.5).start(7, 4).tolist()


@given(vectors(20.0))
def test_gusts_blow_along_across_and_below_the_mean_wind(mean: np.ndarray) -> None:
    axes = Wind(mean).axes
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[:, 2].tolist() == [0, 0, 1]
    assert axes[:, 0] @ mean == pytest.approx(np.linalg.norm(mean[:2]), abs=1e-12)
    wind = Wind(mean, Gusts((1.0, 0.0, 0.0), 1.0))
    along = blown(wind, wind.start(0)) - mean
    assert np.linalg.norm(along) > 0
    assert np.cross(along, axes[:, 0]) == pytest.approx(np.zeros(3), abs=1e-12)


def test_wind_without_gusts_is_its_mean() -> None:
    assert blown(Wind((1, 2, 3)), np.empty(0)).tolist() == [1, 2, 3]


def test_low_altitude_gusts_are_the_specifications() -> None:
    """By hand at 50 feet and 15 knots: 0.177 + 0.04115 = 0.21815; L = 50/0.21815^1.2 = 310.7 ft; s = 1.5/0.21815^0.4 = 2.757 kn."""
    gusts = Gusts.dryden(50 * 0.3048, 15 * 0.514444)
    assert np.asarray(gusts.deviation) == pytest.approx(np.array([2.757, 2.757, 1.5]) * 0.514444, rel=1e-3)
    speed = 15 * 0.514444
    assert np.asarray(gusts.time) == pytest.approx(np.array([310.7, 310.7, 50]) * 0.3048 / speed, rel=1e-3)
    faster = Gusts.dryden(50 * 0.3048, 15 * 0.514444, airspeed=2 * speed)
    assert np.asarray(faster.time) == pytest.approx(np.asarray(gusts.time) / 2)


@given(numbers(3.1, 304.0))
def test_low_altitude_gusts_become_alike_in_all_directions_upwards(height: float) -> None:
    """At 1000 feet 0.177 + 0.823 = 1: one scale length and one deviation."""
    gusts, top = Gusts.dryden(height, 10.0), Gusts.dryden(304.8, 10.0)
    assert np.all(np.asarray(gusts.deviation)[:2] >= np.asarray(gusts.deviation)[2])
    assert np.asarray(top.deviation) == pytest.approx(np.ones(3))
    assert np.asarray(top.time) == pytest.approx(np.full(3, 30.48))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gusts(-1.0, 1.0), "deviation of gusts"),
        (lambda: Gusts(1.0, (1.0, 0.0, 1.0)), "time of gusts"),
        (lambda: Gusts(1.0, 1e-300), "time of gusts"),
        (lambda: Gusts(np.nan, 1.0), "deviation of gusts"),
        (lambda: Gusts(1e60, 1.0), "deviation of gusts"),
        (lambda: Wind((1, 2)), "mean wind"),
        (lambda: Wind((1, 2, np.inf)), "mean wind"),
        (lambda: Wind(gusts=3.0), "gusts"),  # type: ignore[arg-type]
        (lambda: Gusts.dryden(1.0, 5.0), "height of low-altitude gusts"),
        (lambda: Gusts.dryden(400.0, 5.0), "height of low-altitude gusts"),
        (lambda: Gusts.dryden(50.0, 0.0), "wind at 6 m"),
        (lambda: Gusts.dryden(50.0, 5.0, -1.0), "airspeed"),
    ],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_wind_that_cannot_blow_is_refused(make: Any, words: str) -> None:
    with pytest.raises(InputError, match=f"^{words}.* must .*; "):
        make()


def test_gusts_turn_with_a_mean_that_varies() -> None:
    """A mean that a flight adds counts as the wind's own: gusts blow along and across the sum of both."""
    state = np.arange(1.0, 7.0)
    symbol, more = ca.SX.sym("state", 6), ca.SX.sym("more", 3)
    gusts = Gusts((0.5, 0.7, 0.2), 1.0)
    air = ca.Function("air", [symbol, more], [Wind((1.0, 0.0, 0.0), gusts).velocity(symbol, more)])
    for added in ([0.0, 2.0, 0.5], [-1.0, 0.0, 0.0]):
        whole = Wind(np.array([1.0, 0.0, 0.0]) + added, gusts)
        expected = ca.Function("air", [symbol], [whole.velocity(symbol)])(state).full()
        np.testing.assert_allclose(air(state, added).full(), expected, atol=1e-15)

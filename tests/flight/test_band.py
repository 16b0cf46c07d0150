"""The noise band: a linear chain by hand, flights over seeds, and the geometry of distances."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import scipy.linalg

import gammastar as gs
from gammastar.errors import InputError
from gammastar.flight import PATH_FLYER, noise_band
from gammastar.flight.band import _radius
from gammastar.law import KalmanFilter, Observer
from gammastar.law.gains import gains_from_poles
from gammastar.vehicle import presets

HUMMINGBIRD = presets.load("hummingbird")
CIRCLE = gs.paths.circle(1.0)
START = gs.State((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
POLES = (-4.0, -4.5, -5.0, -5.5)


def chain(time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return transition and input of position, velocity, acceleration and jerk under a snap held for a time."""
    block = scipy.linalg.expm(np.diag(np.ones(4), 1) * time)
    return block[:4, :4], block[:4, 4]


@pytest.mark.parametrize("channel", ["position", "velocity"])
def test_on_a_line_it_is_the_lyapunov_equation_of_one_chain(channel: str) -> None:
    """Along a line the axes across are chains of four integrators; the law feeds back the state predicted for the middle.

    x+ = F(T) x + G(T) u, u = -k (F(T/2) (x + n) + G(T/2) u_before): with z = (x, u_before) one discrete Lyapunov equation.
    """
    vehicle = gs.Vehicle(mass=0.5, inertia=(3e-3, 3e-3, 6e-3))
    law = gs.design(vehicle, gs.paths.line((0, 0, 0), (1, 0, 0)), poles=POLES)
    rate, deviation = 100.0, 1e-3
    sensors = gs.Sensors(**{channel: gs.Channel(deviation)})
    start = gs.State((0, 0, 0), (0.3, 0, 0))
    band = noise_band(law, start, sensors=sensors, speed=0.3, duration=5.0, after=0.0, rate=rate, step=5e-3)
    k = gains_from_poles(POLES)
    F, G = chain(1 / rate)
    half, given = chain(0.5 / rate)
    feedback = -np.concatenate([k @ half, [k @ given]])
    A = np.vstack([np.column_stack([F, np.zeros(4)]) + np.outer(G, feedback), feedback])
    noise = np.append(G, 1.0) * feedback[("position", "velocity").index(channel)] * deviation
    P = scipy.linalg.solve_discrete_lyapunov(A, np.outer(noise, noise))
    assert band.nominal.max() < 1e-9
    assert band.deviations[-1, 1:] == pytest.approx(
        np.sqrt(P[0, 0]) * np.ones(2), rel=0.01
    )  # second order in the interval
    assert band.variances[-1] == pytest.approx(band.deviations[-1, 1:] ** 2, rel=0.01)


@functools.cache
def law_with(kind: str) -> gs.Law:
    rejection = Observer(10.0, 60.0)
    sensors = scaled(0.02)
    estimator = KalmanFilter(**sensors.deviations()) if kind == "filter" else None
    return gs.design(HUMMINGBIRD, CIRCLE, poles=-5.0, rejection=rejection, estimator=estimator)


def scaled(size: float) -> gs.Sensors:
    """Return the noise of the Path-Flyer times a factor, at half the control rate: small enough for linear theory."""
    return gs.Sensors(*(gs.Channel(size * d, rate=100) for d in PATH_FLYER.deviations().values()))


@pytest.mark.parametrize("kind", ["raw", "filter"])
def test_flights_stay_in_the_predicted_band(kind: str) -> None:
    """16 flights, three seconds of each, some 150 independent distances: RMS within 15 percent, 99.7 percent inside."""
    law, sensors = law_with(kind), scaled(0.02)
    arguments = {"speed": 1.0, "duration": 5.0, "rate": 200.0, "step": 5e-3}
    band = noise_band(law, START, sensors=sensors, after=1.0, **arguments)
    without = gs.fly(law, START, sensors=gs.Sensors(*(gs.Channel(rate=100) for _ in range(4))), **arguments)
    late = without.time >= 2.0
    radial, height, inside, distances, speeds = [], [], [], [], []
    rows = band.time >= 2.0
    for seed in range(16):
        record = gs.fly(law, START, sensors=sensors, seed=seed, **arguments)
        away = (record.position - without.position)[late]
        across = np.einsum("nij,nj->ni", band.across[rows], away)
        radial.append(across)
        height.append(away[:, 2])
        inside.append(np.linalg.norm(across, axis=1) < band.bound()[rows])
        distances.append(record.distance[late])
        speeds.append((record.autopilot.rotor_speeds - without.autopilot.rotor_speeds)[late])
    predicted = np.sqrt(band.variances[rows].sum(axis=1).mean())
    assert np.sqrt(np.mean(np.sum(np.square(radial), axis=2))) == pytest.approx(predicted, rel=0.15)
    assert np.std(height) == pytest.approx(np.sqrt(np.mean(band.deviations[rows, 2] ** 2)), rel=0.15)
    assert np.sqrt(np.mean(np.square(distances))) == pytest.approx(band.over(2.0), rel=0.15)
    assert np.mean(inside) > 0.99
    assert band.is_linear
    room = np.mean(without.autopilot.rotor_speeds[late])  # the nearer limit is standstill
    spread = np.sqrt(np.mean((room / band.saturation[rows]) ** 2))
    assert spread == pytest.approx(np.std(speeds), rel=0.2)


def test_the_band_is_as_wide_as_the_noise() -> None:
    arguments = {"speed": 1.0, "duration": 1.0, "after": 0.5, "rate": 200.0, "step": 5e-3}
    one, three = (noise_band(law_with("raw"), START, sensors=scaled(size), **arguments) for size in (0.01, 0.03))
    assert three.deviations == pytest.approx(3 * one.deviations, rel=1e-6)
    assert np.all(one.deviations[0] == 0)
    assert one.time[0] == pytest.approx(0.5)
    quiet = noise_band(law_with("raw"), START, sensors=gs.Sensors(), **arguments)
    assert quiet.variances.max() == 0
    assert np.array_equal(quiet.root_mean_square, quiet.nominal)
    assert np.all(quiet.bound() == 0)


def test_noise_that_drives_rotors_to_their_limits_is_told() -> None:
    arguments = {"speed": 1.0, "duration": 1.0, "after": 0.5, "rate": 200.0, "step": 5e-3}
    assert noise_band(law_with("raw"), START, sensors=scaled(0.02), **arguments).is_linear
    loud = noise_band(law_with("raw"), START, sensors=scaled(20.0), **arguments)
    assert not loud.is_linear
    assert loud.saturation[-1] < 5
    free = gs.design(gs.Vehicle(0.5, (3e-3, 3e-3, 6e-3)), CIRCLE, poles=-5.0)
    assert np.all(np.isinf(noise_band(free, START, sensors=scaled(20.0), **arguments).saturation))


@pytest.mark.parametrize("kind", ["raw", "filter"])
def test_reusing_derivatives_changes_nothing_that_matters(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also not for a filter whose position is fresh ten times a second only, and whose gains change in between."""
    sensors = gs.Sensors(
        *(gs.Channel(size, rate=rate) for size, rate in ((1e-3, 10), (1e-3, 10), (1e-4, 50), (1e-3, 50)))
    )
    arguments = {"speed": 1.0, "duration": 1.5, "after": 0.5, "rate": 100.0, "step": 1e-2, "sensors": sensors}
    reused = noise_band(law_with(kind), START, **arguments)
    monkeypatch.setattr("gammastar.flight.band.REUSED", 0.0)
    anew = noise_band(law_with(kind), START, **arguments)
    assert reused.root_mean_square == pytest.approx(anew.root_mean_square, rel=0.01)


@pytest.mark.parametrize("size", [1e-3, 1.0, 10.0])
def test_the_radius_of_a_round_band_is_rayleighs(size: float) -> None:
    """P(|e| < r) = 1 - exp(-r^2 / (2 s^2)); on a line three deviations hold 0.9973."""
    variance = np.array([size**2, 0.0])
    assert _radius(variance, variance, 0.9) == pytest.approx([size * np.sqrt(-2 * np.log(0.1)), 0.0])
    assert _radius(variance[:1], variance[1:], 0.9973)[0] == pytest.approx(3 * size, rel=1e-4)


@pytest.mark.parametrize("ratio", [0.01, 0.3, 0.8])
def test_the_radius_of_a_band_holds_the_share_asked_for(ratio: float) -> None:
    """Of 400,000 drawn points 95 percent within four of their deviations, sqrt(p (1 - p) / n)."""
    drawn = np.linalg.norm(np.random.default_rng(0).standard_normal((400_000, 2)) * [2.0, 2.0 * ratio], axis=1)
    radius = _radius(np.array([4.0]), np.array([4.0 * ratio**2]), 0.95)
    assert np.mean(drawn < radius) == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 400_000))


def test_what_has_no_band_is_refused() -> None:
    implicit = gs.design(HUMMINGBIRD, gs.paths.circle(kind="implicit"))
    with pytest.raises(InputError, match="needs a curve"):
        noise_band(implicit, START, sensors=gs.Sensors(), speed=1.0)
    with pytest.raises(InputError, match="exactly one of speed and reference"):
        noise_band(law_with("raw"), START, sensors=gs.Sensors())
    with pytest.raises(InputError, match=r"gs\.Sensors"):
        noise_band(law_with("raw"), START, sensors=None, speed=1.0)  # type: ignore[arg-type]

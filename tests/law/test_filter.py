"""The filter: a textbook Kalman filter where the problem is linear, and consistent with its own covariance where it is not."""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from gammastar import so3
from gammastar.errors import InputError
from gammastar.law.filter import ERRORS, SIZE, UPPER, KalmanFilter, Motion
from gammastar.law.measurement import AXES, split_measurement
from strategies import rotations, vectors

T = 0.01  # [s] control interval
FILTER = KalmanFilter((0.02, 0.03, 0.01), 0.05, (0.01, 0.02, 0.03), 0.1, gravity=9.8)
FREE = KalmanFilter((0.02, 0.03, 0.01), 0.05, (0.01, 0.02, 0.03), 0.1)


def stepping(kalman: KalmanFilter, interval: float = T) -> ca.Function:
    """Return the function (estimate, measurement, specific force in body axes, angular acceleration) -> estimate, innovations."""
    estimate, measured = ca.SX.sym("estimate", SIZE), ca.SX.sym("measured", 22)
    force, turning = ca.SX.sym("force", 3), ca.SX.sym("turning", 3)
    told = split_measurement(measured)
    acceleration = ca.vertcat(0, 0, 9.8) + ca.mtimes(kalman.estimate(estimate).attitude, force)
    motion, covariance = kalman.predicted(estimate, acceleration, turning, interval)
    after = kalman.advanced(estimate, told, acceleration, turning, interval)
    innovation = (told.position - motion.position) / ca.sqrt(
        ca.diag(covariance)[:3] + ca.DM(np.asarray(kalman.position) ** 2)
    )
    return ca.Function("step", [estimate, measured, force, turning], ca.cse([after, innovation]))


@functools.cache
def step_of(interval: float = T, free: bool = False) -> ca.Function:
    return stepping(FREE if free else FILTER, interval)


def covariance_of(estimate: np.ndarray) -> np.ndarray:
    P = np.zeros((ERRORS, ERRORS))
    P[UPPER] = np.ravel(estimate)[18:]
    return P + np.triu(P, 1).T


def error_of(truth: list[np.ndarray], estimate: np.ndarray) -> np.ndarray:
    """Return the error (12,) of an estimate; truth is position, velocity, attitude and angular velocity."""
    position, velocity, R, rate = truth
    x = np.ravel(estimate)
    turn = so3.log(so3.unstack(x[6:15]).T @ R)
    return np.concatenate([position - x[:3], velocity - x[3:6], turn, rate - x[15:18]])


def chain(density: float, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return transition and noise of x'' = white noise by Van Loan's exponential, another derivation than the closed form."""
    A = np.array([[0.0, 1.0], [0.0, 0.0]])
    block = np.block([[-A, np.diag([0.0, density])], [np.zeros((2, 2)), A.T]]) * interval
    exponential = scipy.linalg.expm(block)
    F = exponential[2:, 2:].T
    return F, F @ exponential[:2, 2:]


@given(st.lists(st.tuples(vectors(3.0), vectors(0.5, 6), st.integers(0, 63)), min_size=1, max_size=12))
def test_in_translation_it_is_the_textbook_filter(steps: list[tuple[np.ndarray, np.ndarray, int]]) -> None:
    """The state is x = F x + (T^2/2, T) a, P = F P F^T + Q; K = P H^T (H P H^T + R)^-1, P = (I - K H) P, for the axes that are fresh.

    (I - K H) P loses the digits that the start's variance has beside the sample's: 4 over 1e-4.
    """
    step = step_of(free=True)
    estimate = FREE.start((1, 2, 3), (0.1, 0.2, 0.3), np.eye(3), np.zeros(3), np.linspace(0.5, 2.0, 12))
    x, P = np.array([1, 2, 3, 0.1, 0.2, 0.3]), np.diag(np.linspace(0.5, 2.0, 12)[:6] ** 2)
    one, noise = chain(FREE.acceleration_density, T)
    F, Q = np.kron(one, np.eye(3)), np.kron(noise, np.eye(3))
    R = np.diag([*np.asarray(FREE.position) ** 2, *np.asarray(FREE.velocity) ** 2])
    for acceleration, offset, mask in steps:
        axes = np.array([(mask >> k) & 1 for k in range(6)], dtype=bool)
        x = F @ x + np.concatenate([T**2 / 2 * acceleration, T * acceleration])
        P = F @ P @ F.T + Q
        z = x + offset
        H = np.eye(6)[axes]
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + H @ R @ H.T)
        x, P = x + K @ (z[axes] - H @ x), (np.eye(6) - K @ H) @ P
        shares = np.array(AXES)
        told = np.concatenate([z, np.eye(3).ravel(), np.zeros(3), [shares @ axes[:3], shares @ axes[3:], 1, 1]])
        estimate, _ = step(estimate, told, acceleration - [0, 0, 9.8], np.zeros(3))
        assert estimate.full().ravel()[:6] == pytest.approx(x, rel=1e-10, abs=1e-10)
        assert covariance_of(estimate.full())[:6, :6] == pytest.approx(P, rel=1e-10, abs=1e-10)


@given(rotations(), vectors(4.0), vectors(8.0), vectors(10.0), vectors(1.0, ERRORS))
def test_the_error_is_propagated_by_the_derivative_of_the_motion(
    R: np.ndarray, rate: np.ndarray, force: np.ndarray, turning: np.ndarray, direction: np.ndarray
) -> None:
    """Of two motions a small error apart, the errors after an interval are F e; F shows in P+ = F e e^T F^T + Q.

    The linearisation is exact in the error and of second order in the interval for the axes in which the rate's error adds up.
    """
    size, interval = 1e-5, 1e-3
    e = size * direction
    step = step_of(interval)
    held = np.concatenate([np.zeros(6), np.eye(3).ravel(), np.zeros(3), np.zeros(4)])
    motion = [np.array([1.0, 2, 3]), np.array([0.3, 0, -1]), R, rate]
    other = [motion[0] + e[:3], motion[1] + e[3:6], R @ so3.exp(e[6:9]), rate + e[9:]]
    moved = [step(FILTER.start(*each, np.zeros(12)), held, force, turning)[0].full() for each in (motion, other)]
    x = moved[1].ravel()
    after = error_of([x[:3], x[3:6], so3.unstack(x[6:15]), x[15:18]], moved[0])
    given = FILTER.start(*motion, np.zeros(12))
    given[18:] = np.outer(direction, direction)[UPPER]
    spread = covariance_of(step(given, held, force, turning)[0].full()) - covariance_of(moved[0])
    assert spread == pytest.approx(np.outer(after, after) / size**2, abs=2e-4)


@given(vectors().filter(lambda v: np.linalg.norm(v) > 0.1), st.sampled_from([30.0, 120.0, 179.0, 180.0]))
def test_it_converges_from_a_wrong_attitude(axis: np.ndarray, degrees: float) -> None:
    """From any error, half a turn included: the first sample takes nearly all of it when the start is known to be uncertain."""
    wrong = so3.exp(np.radians(degrees) * axis / np.linalg.norm(axis))
    estimate = FREE.start(np.zeros(3), np.zeros(3), wrong, np.zeros(3), [*np.full(6, 0.1), 2, 2, 2, 1, 1, 1])
    told = np.concatenate([np.zeros(6), np.eye(3).ravel(), np.zeros(3), np.ones(4)])
    found = []
    for _ in range(40):
        estimate = step_of(free=True)(estimate, told, [0, 0, -9.8], np.zeros(3))[0]
        found.append(np.linalg.norm(so3.log(so3.unstack(estimate.full().ravel()[6:15]))))
    assert found[0] < 0.05
    assert found[-1] < 1e-3


def test_it_converges_even_when_it_is_sure_of_a_wrong_attitude() -> None:
    """With the deviations of one sample instead, the same within a second."""
    estimate = FREE.start(np.zeros(3), np.zeros(3), so3.roll(179), np.zeros(3))
    told = np.concatenate([np.zeros(6), np.eye(3).ravel(), np.zeros(3), np.ones(4)])
    for _ in range(300):
        estimate = step_of(free=True)(estimate, told, [0, 0, -9.8], np.zeros(3))[0]
    assert np.linalg.norm(so3.log(so3.unstack(estimate.full().ravel()[6:15]))) < 0.02


RUNS, STEPS = 60, 1200
DEVIATIONS = np.concatenate(
    [np.asarray(x) for x in (FILTER.position, FILTER.velocity, FILTER.attitude, FILTER.angular_velocity)]
)


def flying() -> ca.Function:
    """Return the function (truth (18,) and estimate, draws (24,), freshness (4,), time) -> the two after an interval, innovation."""
    state, draws, fresh, time = ca.SX.sym("state", 18), ca.SX.sym("draws", 24), ca.SX.sym("fresh", 4), ca.SX.sym("t")
    position, velocity, R, rate = state[0:3], state[3:6], ca.reshape(state[6:15], 3, 3), state[15:18]
    force, turning = ca.DM([0.3, -0.2, -9.0]), 3 * ca.sin(5 * time + ca.DM([0, 1, 2])) - rate
    densities = (FILTER.acceleration_density, FILTER.angular_density)
    roots = [ca.DM(np.kron(np.linalg.cholesky(chain(density, T)[1]), np.eye(3))) for density in densities]
    unknown = ca.vertcat(roots[0] @ draws[0:6], roots[1] @ draws[6:12])
    acceleration, turn = R @ force + ca.DM([0, 0, 9.8]), T * (rate + T / 2 * turning)
    position = position + T * velocity + T**2 / 2 * acceleration + unknown[0:3]
    velocity, R = velocity + T * acceleration + unknown[3:6], R @ so3.exp(turn) @ so3.exp(unknown[6:9])
    rate = rate + T * turning + unknown[9:12]
    noise = ca.DM(DEVIATIONS) * draws[12:]
    seen = (position + noise[0:3], velocity + noise[3:6], ca.vec(R @ so3.exp(noise[6:9])), rate + noise[9:12])
    told = ca.Function("told", [state, draws, fresh, time], [ca.vertcat(*seen, fresh), force, turning])
    after = ca.Function("after", [state, draws, time], [ca.vertcat(position, velocity, ca.vec(R), rate)])
    both, column = ca.MX.sym("both", 18 + SIZE), ca.MX.sym("column", 29)
    draws, fresh, time = ca.vertsplit(column, [0, 24, 28, 29])
    estimate, innovation = step_of()(both[18:], *told(both[:18], draws, fresh, time))
    return ca.Function("fly", [both, column], [ca.vertcat(after(both[:18], draws, time), estimate), innovation])


@functools.cache
def flights() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return errors and deviations (RUNS, n, 12), innovations (RUNS, m, 3) in deviations, and NEES (RUNS, n), of tumbling vehicles.

    The truth moves as the filter believes: accelerations known up to white noise, which is drawn here from Van Loan's covariance.
    Position comes every tenth interval, velocity every fifth, attitude every second, rates always; every twentieth is looked at.
    """
    rng = np.random.default_rng(11)
    step = flying().mapaccum(STEPS)
    k = np.arange(STEPS)
    fresh = np.array([k % 10 == 0, k % 5 == 0, k % 2 == 0, k >= 0])
    errors, spreads, innovations, nees = [], [], [], []
    for _ in range(RUNS):
        R, rate, e = so3.random(rng), rng.standard_normal(3), DEVIATIONS * rng.standard_normal(12)
        start = FILTER.start(-e[:3], -e[3:6], R @ so3.exp(e[6:9]).T, rate - e[9:])
        truth = np.concatenate([np.zeros(6), so3.stack(R), rate])
        columns = np.vstack([rng.standard_normal((24, STEPS)), fresh, T * k])
        states, innovation = (x.full().T for x in step(np.concatenate([truth, start]), columns))
        innovations.append(innovation[fresh[0]])
        for row in states[::20]:
            P = covariance_of(row[18:])
            errors.append(error_of([row[:3], row[3:6], so3.unstack(row[6:15]), row[15:18]], row[18:]))
            spreads.append(np.sqrt(np.diag(P)))
            nees.append(errors[-1] @ np.linalg.solve(P, errors[-1]))
    shape = (RUNS, STEPS // 20)
    flat = (np.array(errors).reshape(*shape, 12), np.array(spreads).reshape(*shape, 12))
    return *flat, np.array(innovations), np.array(nees).reshape(shape)


def test_errors_stay_within_three_deviations_in_997_of_1000() -> None:
    """43,200 errors of twelve states, correlated over a few samples: 99.73 percent within some 0.1 percent."""
    errors, spreads, _, _ = flights()
    assert np.mean(np.abs(errors) < 3 * spreads) == pytest.approx(0.9973, abs=0.0015)
    scaled = (errors / spreads).std(axis=(0, 1))
    assert scaled == pytest.approx(np.ones(12), abs=0.1)


def test_the_normalised_squared_error_is_that_of_twelve_numbers() -> None:
    """NEES = e^T P^-1 e has mean 12; over 3,600 values, about 1,000 of them independent: within 4 sqrt(24 / 1000)."""
    _, _, _, nees = flights()
    assert nees[:, 5:].mean() == pytest.approx(12, abs=4 * np.sqrt(24 / 1000))


def test_innovations_are_white_with_their_predicted_deviation() -> None:
    innovations = flights()[2][:, 5:]
    count = innovations[:, :, 0].size
    assert innovations.std(axis=(0, 1)) == pytest.approx(np.ones(3), abs=4 / np.sqrt(2 * count) + 0.01)
    for lag in range(1, 6):
        correlation = np.mean(innovations[:, lag:] * innovations[:, :-lag], axis=(0, 1))
        assert correlation == pytest.approx(np.zeros(3), abs=4 / np.sqrt(count - RUNS * lag))


def test_the_attitude_stays_a_rotation() -> None:
    """20,000 predictions and corrections: rounding adds up like a random walk, 1e-16 times some 300."""
    rng = np.random.default_rng(7)
    n = 20_000
    attitudes = [so3.stack(so3.exp(0.1 * rng.standard_normal(3))) for _ in range(200)] * (n // 200)
    told = np.vstack([rng.standard_normal((6, n)), np.array(attitudes).T, rng.standard_normal((3, n)), np.ones((4, n))])
    start = FREE.start(np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3))
    estimate, columns = ca.MX.sym("estimate", SIZE), ca.MX.sym("columns", 22)
    after = step_of(free=True)(estimate, columns, np.zeros(3), np.array([3.0, -2.0, 1.0]))[0]
    last = ca.Function("all", [estimate, columns], [after]).mapaccum(n)(start, told)[:, -1].full().ravel()
    assert so3.drift(so3.unstack(last[6:15])) < 1e-12
    assert np.linalg.eigvalsh(covariance_of(last)).min() > 0


@pytest.mark.parametrize("time", [0.5, 3.0])
def test_what_is_not_measured_grows_as_a_double_integral_of_white_noise(time: float) -> None:
    """Without samples for a time t: var p = s_p^2 + s_v^2 t^2 + q t^3/3, var v = s_v^2 + q t, whatever the number of intervals."""
    estimate: Any = FREE.start(np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3), np.full(12, 0.2))
    step = step_of(time / 20, free=True)
    held = np.concatenate([np.full(6, 1e3), np.eye(3).ravel(), np.zeros(3), np.zeros(4)])
    for _ in range(20):
        estimate = step(estimate, held, [0, 0, -9.8], np.zeros(3))[0]
    deviations = np.sqrt(np.diag(covariance_of(estimate.full())))
    q, w = FREE.acceleration_density, FREE.angular_density
    assert deviations[:3] ** 2 == pytest.approx(np.full(3, 0.04 * (1 + time**2) + q * time**3 / 3))
    assert deviations[3:6] ** 2 == pytest.approx(np.full(3, 0.04 + q * time))
    assert deviations[6:9] ** 2 == pytest.approx(np.full(3, 0.04 * (1 + time**2) + w * time**3 / 3))
    assert deviations[9:] ** 2 == pytest.approx(np.full(3, 0.04 + w * time))
    assert estimate.full().ravel()[:6].tolist() == [0] * 6  # held samples of a kilometre off are not believed


@given(st.lists(st.integers(0, 4095), min_size=30, max_size=30), st.sampled_from([1e-6, 1e-3, 1.0, 1e3]))
def test_the_covariance_stays_positive(masks: list[int], deviation: float) -> None:
    """Whatever is fresh when, and however much better the samples are than the start."""
    estimate: Any = FREE.start(np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3), np.full(12, deviation))
    for mask in masks:
        axes = np.array([(mask >> k) & 1 for k in range(12)]).reshape(4, 3)
        told = np.concatenate([np.zeros(6), np.eye(3).ravel(), np.zeros(3), axes @ AXES])
        estimate = step_of(free=True)(estimate, told, [0, 0, -9.8], np.ones(3))[0]
        P = covariance_of(estimate.full())
        scale = 1 / np.sqrt(np.diag(P))
        assert np.linalg.eigvalsh(scale[:, None] * P * scale).min() > 0


def test_filters_of_one_kind_are_one() -> None:
    """A law's graph is compiled once for all equal filters."""
    made = [KalmanFilter(np.array([0.02, 0.03, 0.01]), 0.05, (0.01, 0.02, 0.03), 0.1) for _ in range(2)]
    assert made[0] == made[1] == FREE
    assert hash(made[0]) == hash(made[1])
    assert made[0] != FILTER


def test_the_parts_of_an_estimate_are_named() -> None:
    R = so3.exp([0.1, -0.4, 0.9])
    start = FILTER.start((1, 2, 3), (4, 5, 6), R, (7, 8, 9), np.arange(1.0, 13.0))
    assert start.shape == (FILTER.size,)
    motion = FILTER.estimate(ca.SX(start))
    assert isinstance(motion, Motion)
    assert [ca.evalf(part).full().ravel("F").tolist() for part in motion] == [
        [1, 2, 3],
        [4, 5, 6],
        so3.stack(R).tolist(),
        [7, 8, 9],
    ]
    assert ca.evalf(FILTER.deviations(ca.SX(start))).full().ravel() == pytest.approx(np.arange(1.0, 13.0))
    default = FILTER.deviations(ca.SX(FILTER.start(np.zeros(3), np.zeros(3), R, np.zeros(3))))
    assert ca.evalf(default).full().ravel()[:3] == pytest.approx(np.asarray(FILTER.position))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"position": 0.0}, "deviation of position"),
        ({"velocity": (0.1, -0.1, 0.1)}, "deviation of velocity"),
        ({"attitude": np.nan}, "deviation of attitude"),
        ({"angular_velocity": (1, 2)}, "deviation of angular_velocity"),
        ({"position": 1e300}, "deviation of position"),
        ({"position": 1e-300}, "deviation of position"),
        ({"acceleration_density": 0.0}, "acceleration_density"),
        ({"angular_density": -1.0}, "angular_density"),
        ({"gravity": np.inf}, "gravity"),
    ],
    ids=str,
)
def test_a_filter_without_noise_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=f"^{words}.* must .*; "):
        KalmanFilter(**({"position": 0.1, "velocity": 0.1, "attitude": 0.1, "angular_velocity": 0.1} | change))

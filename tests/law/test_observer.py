"""The unknown, estimated: at the promised rate, without error where none is promised, with the predicted noise; and integrated away."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from gammastar.errors import GammastarError, InputError, PoleError
from gammastar.law.gains import gains_from_poles
from gammastar.law.measurement import AXES
from gammastar.law.observer import IntegralAction, Observer, Rejection, observer_gains
from gammastar.vehicle import Unknown
from strategies import numbers, vectors

INTERVAL = 2e-3
FORCE, TORQUE = Observer(force=40.0, torque=None), Observer(force=None, torque=120.0)
REJECTIONS: list[Rejection] = [Observer(), FORCE, TORQUE, Observer(None, None), IntegralAction(0.4, -2.5)]


def columns_of(unknown: Unknown) -> Any:
    """Graph: return the four vectors as SX (3, 4)."""
    return ca.horzcat(*(ca.SX(ca.vertcat(*part)) if isinstance(part, tuple) else part for part in unknown))


def stepping(rejection: Rejection, interval: float = INTERVAL) -> ca.Function:
    """Return the function (estimate, four vectors, error, freshness) -> next estimate and the unknown."""
    estimate, vectors_, error = ca.SX.sym("estimate", rejection.size), ca.SX.sym("v", 3, 4), ca.SX.sym("e", 3)
    fresh = ca.SX.sym("fresh", 2)
    after = rejection.advanced(estimate, *ca.horzsplit(vectors_), interval, error, (fresh[0], fresh[1]))
    return ca.Function("step", [estimate, vectors_, error, fresh], [after, columns_of(rejection.unknown(after))])


def run(rejection: Rejection, columns: np.ndarray, fresh: np.ndarray | None = None, interval: float = INTERVAL) -> Any:
    """Return estimates (n, size) and unknowns (n, 3, 4) for vectors (n, 3, 4): v, Omega and the two mean accelerations."""
    step, n = stepping(rejection, interval), len(columns)
    flags = np.ones((n, 2)) if fresh is None else fresh
    estimate, found = rejection.start(ca.DM.zeros(3), ca.DM.zeros(3)), []
    for k in range(n):
        estimate, unknown = (x.full() for x in step(estimate, columns[k], np.zeros(3), flags[k]))
        found.append((estimate.ravel(), unknown))
    return np.array([f[0] for f in found]), np.array([f[1] for f in found])


def moved_by(coefficients: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity change (n, 3) and d with two derivatives (n, 3, 3) of d = c0 + c1 t + c2 t^2/2, coefficients (3, 3)."""
    c0, c1, c2 = coefficients
    t = times[:, None]
    d = np.stack([c0 + c1 * t + c2 * t**2 / 2, c1 + c2 * t, c2 + 0 * t], axis=2)
    return c0 * t + c1 * t**2 / 2 + c2 * t**3 / 6, d


@given(vectors(3.0, 9).map(lambda v: v.reshape(3, 3)), vectors(5.0))
def test_constant_ramp_and_parabola_forces_are_found_without_error(c: np.ndarray, model: np.ndarray) -> None:
    """After 40 time constants what the start knew is gone (40^3 exp(-40)), and rounding of v is what a third difference leaves of it."""
    times = INTERVAL * np.arange(1, 501)
    velocity, d = moved_by(c, times)
    columns = np.zeros((500, 3, 4))
    columns[:, :, 0] = velocity + model * times[:, None]
    columns[:, :, 2] = model
    _, unknown = run(FORCE, columns)
    assert unknown[-1, :, 0] == pytest.approx(d[-1, :, 0], abs=1e-9)
    assert unknown[-1, :, 1] == pytest.approx(d[-1, :, 1], abs=1e-7)
    assert unknown[-1, :, 2] == pytest.approx(d[-1, :, 2], abs=1e-5)
    assert np.all(unknown[:, :, 3] == 0)


@given(vectors(20.0), vectors(5.0))
def test_a_constant_torque_is_found_without_error(torque: np.ndarray, model: np.ndarray) -> None:
    times = INTERVAL * np.arange(1, 251)[:, None]
    columns = np.zeros((250, 3, 4))
    columns[:, :, 1] = (torque + model) * times
    columns[:, :, 3] = model
    _, unknown = run(TORQUE, columns)
    assert unknown[-1, :, 3] == pytest.approx(torque, abs=1e-10)
    assert np.all(unknown[:, :, :3] == 0)


@pytest.mark.parametrize(("observer", "bandwidth", "count", "channel"), [(FORCE, 40, 4, 0), (TORQUE, 120, 2, 3)])
def test_the_error_decays_at_the_promised_rate(observer: Observer, bandwidth: float, count: int, channel: int) -> None:
    """A repeated pole leaves e = polynomial of degree count - 1 times exp(-w t); w is the slope of log(e / t^(count - 1)).

    The polynomial's lower terms bend the slope by (count - 1) c / t with c the time constant; fitted late, 2 percent are left.
    """
    n = int(24 / bandwidth / INTERVAL)
    times = INTERVAL * np.arange(1, n + 1)
    columns = np.zeros((n, 3, 4))
    columns[:, :, channel // 3] = np.outer(times, [1.0, -2.0, 0.5])
    _, unknown = run(observer, columns)
    error = np.abs(unknown[:, :, channel] - [1.0, -2.0, 0.5])
    late = slice(n // 2, n)
    reduced = np.log(error[late] / times[late, None] ** (count - 1))
    slopes = np.polyfit(times[late], reduced, 1)[0]
    assert slopes == pytest.approx(-bandwidth * np.ones(3), rel=0.07)


@given(numbers(0.1, 500.0), numbers(1e-4, 0.2), st.sampled_from([2, 4]))
def test_the_gains_are_ackermanns(bandwidth: float, age: float, count: int) -> None:
    """L = (F - p I)^n O^-1 e_n for the pair (F, C F), in units of the interval, where it is well conditioned."""
    F = scipy.linalg.expm(np.diag(np.ones(count - 1), 1))
    p = np.exp(-bandwidth * age)
    observability = np.array([np.linalg.matrix_power(F, k + 1)[0] for k in range(count)])
    wanted = np.linalg.matrix_power(F - p * np.eye(count), count) @ np.linalg.solve(observability, np.eye(count)[-1])
    found = np.array([float(g) for g in observer_gains(count, bandwidth, ca.DM(age))]) * age ** np.arange(count)
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-13)


def error_matrix(observer: Observer, interval: float, every: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return the map of one axis' error over `every` intervals with one measurement at their end, and the gain of that measurement."""
    first, measured = ca.SX.sym("estimate", observer.size), ca.SX.sym("measured", 3)
    estimate, none = first, ca.SX.zeros(3)
    for k in range(every):
        fresh = (float(k == every - 1),) * 2
        estimate = observer.advanced(estimate, measured, measured, none, none, interval, none, fresh)
    index = slice(0, observer.size - 3, 3)
    maps = [ca.jacobian(estimate, first)[index, index], ca.jacobian(estimate, measured)[index, 0]]
    M, gain = ca.Function("maps", [first, measured], maps)(np.zeros(observer.size), np.zeros(3))
    return M.full(), gain.full().ravel()


@pytest.mark.parametrize("every", [1, 2, 7])
@pytest.mark.parametrize(("observer", "bandwidth"), [(FORCE, 40.0), (TORQUE, 120.0)])
def test_all_poles_of_the_error_are_at_the_bandwidth_at_any_sensor_rate(
    observer: Observer, bandwidth: float, every: int
) -> None:
    """Cayley-Hamilton: (M - p I)^n = 0 with p = exp(-w T), T the time between measurements; in units of the interval."""
    M, _ = error_matrix(observer, INTERVAL, every)
    scale = np.diag((every * INTERVAL) ** np.arange(len(M)))
    scaled = scale @ M @ np.linalg.inv(scale)
    p = np.exp(-bandwidth * every * INTERVAL)
    assert np.abs(np.linalg.matrix_power(scaled - p * np.eye(len(M)), len(M))).max() < 1e-12


@pytest.mark.parametrize(("observer", "channel"), [(FORCE, 0), (TORQUE, 1)])
def test_noise_reaches_the_estimate_as_the_lyapunov_equation_says(observer: Observer, channel: int) -> None:
    """X = M X M^T + s^2 L L^T; three axes times 20,000 samples, correlated over some 20, give the deviation within 5 percent."""
    M, gain = error_matrix(observer, INTERVAL)
    deviation, scale = 0.01, 40.0 ** -np.arange(len(M))  # in time constants of 1/40 s the equation is well conditioned
    scaled = scale[:, None] * M / scale, deviation**2 * np.outer(scale * gain, scale * gain)
    predicted = np.sqrt(np.diag(scipy.linalg.solve_discrete_lyapunov(*scaled))) / scale
    columns = np.zeros((20_000, 3, 4))
    columns[:, :, channel] = deviation * np.random.default_rng(1).standard_normal((20_000, 3))
    estimates, _ = run(observer, columns)
    found = estimates[1000:, :-3].reshape(19_000, len(M), 3).std(axis=(0, 2))
    assert found == pytest.approx(predicted, rel=0.05)


@pytest.mark.parametrize("observer", [Observer(), FORCE, TORQUE])
def test_without_a_measurement_the_estimate_is_predicted_by_the_model(observer: Observer) -> None:
    """The velocity becomes v + a T + d T + d' T^2/2 + d'' T^3/6 and so on, whatever is offered as the old sample."""
    rng = np.random.default_rng(2)
    before, columns = rng.standard_normal(observer.size), rng.standard_normal((3, 4))
    step, T = stepping(observer, 0.1), 0.1
    found = step(before, columns, np.zeros(3), [0, 0])[0].full().ravel()
    wanted = []
    if observer.force is not None:
        v, d, d1, d2 = before[:12].reshape(4, 3)
        wanted += [*(v + columns[:, 2] * T + d * T + d1 * T**2 / 2 + d2 * T**3 / 6), *(d + d1 * T + d2 * T**2 / 2)]
        wanted += [*(d1 + d2 * T), *d2, *(before[12:15] + T)]
    if observer.torque is not None:
        rate, torque = before[-9:-3].reshape(2, 3)
        wanted += [*(rate + (columns[:, 3] + torque) * T), *torque, *(before[-3:] + T)]
    assert found == pytest.approx(np.array(wanted), abs=1e-14)


def test_a_fresh_measurement_begins_a_new_age() -> None:
    estimates, _ = run(Observer(), np.zeros((4, 3, 4)), np.array([[0, 1], [0, 0], [1, 0], [1, 1]]))
    assert estimates[:, 12] == pytest.approx([INTERVAL, 2 * INTERVAL, 0, 0])
    assert estimates[:, 21] == pytest.approx([0, INTERVAL, 2 * INTERVAL, 0])


def test_axes_of_one_channel_may_have_rates_of_their_own() -> None:
    """Where the third velocity alone is fresh, its chain is corrected and the two others are predicted."""
    step = stepping(FORCE)
    after = step(
        np.zeros(15), np.eye(3, 4) @ np.diag([1, 0, 0, 0]) + np.array([[0], [2.0], [3.0]]), np.zeros(3), [AXES[2], 0]
    )
    estimate = after[0].full().ravel().reshape(5, 3)
    assert np.all(estimate[1:4, :2] == 0)
    assert np.all(estimate[:4, 2] != 0)
    assert estimate[4] == pytest.approx([INTERVAL, INTERVAL, 0])


@pytest.mark.parametrize("rejection", REJECTIONS, ids=str)
def test_every_rejection_has_the_same_methods_and_knows_nothing_at_the_start(rejection: Rejection) -> None:
    start = np.array(ca.DM(rejection.start(ca.DM([1.0, 2.0, 3.0]), ca.DM([4.0, 5.0, 6.0])))).ravel()
    assert start.shape == (rejection.size,)
    assert np.all(ca.evalf(columns_of(rejection.unknown(ca.SX(start)))).full() == 0)
    columns = np.column_stack([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], np.zeros(3), np.zeros(3)])
    after = stepping(rejection)(start, columns, np.zeros(3), [1, 1])[0].full().ravel()
    ages = [k for k, x in enumerate(after) if x != start[k]]
    assert ages == []  # motion as the model says: nothing is learned


def driven(action: IntegralAction, disturbance: float, interval: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return error (n,) and integral (n,) of the exact chain e'' = a + d, a'' = snap, under the law with integral action, sampled."""
    gains = gains_from_poles(action.chain)
    A = np.zeros((6, 6))  # e, e', modelled acceleration, its rate; snap and disturbance held
    A[0, 1] = A[1, 2] = A[2, 3] = A[3, 4] = A[1, 5] = 1
    F = scipy.linalg.expm(A * interval)
    step, memory, x, rows = stepping(action, interval), action.start(ca.DM.zeros(3), ca.DM.zeros(3)), np.zeros(4), []
    for _ in range(steps):
        memory, unknown = (v.full() for v in step(memory, np.zeros((3, 4)), [x[0], 0, 0], [1, 1]))
        snap = -gains @ x - unknown[0, 2]
        x = F[:4] @ np.append(x, [snap, disturbance])
        rows.append((x[0], memory[0, 0]))
    return np.array(rows).T[0], np.array(rows).T[1]


def test_integral_action_takes_the_error_of_a_constant_force_to_zero_at_its_pole() -> None:
    """Without it the error ends at -d k_3 / k_1 (some 0.9 m here); with it the slowest root of the chain is the pole."""
    action = IntegralAction(0.4, -2.5)
    error, integral = driven(action, 1.5, 0.01, 6000)
    assert np.abs(error).max() > 0.3
    assert abs(error[-1]) < 1e-8  # exp(-0.4 * 60) = 4e-11
    assert integral[-1] == pytest.approx(gains_from_poles(action.chain)[2] * 1.5, rel=1e-6)
    late = np.arange(2000, 4000)
    assert np.polyfit(late * 0.01, np.log(np.abs(error[late])), 1)[0] == pytest.approx(-0.4, rel=0.01)


def test_integral_action_does_not_wind_up() -> None:
    """An error that stays for long leaves the integral at what balances the largest acceleration, in the error's direction."""
    action = IntegralAction(0.4, -2.5, largest=2.0)
    step, memory = stepping(action, 0.1), action.start(ca.DM.zeros(3), ca.DM.zeros(3))
    for _ in range(100):
        memory, _ = step(memory, np.zeros((3, 4)), [30.0, -40.0, 0.0], [1, 1])
    most = gains_from_poles(action.chain)[2] * 2.0
    assert memory.full().ravel() == pytest.approx(most * np.array([0.6, -0.8, 0.0]))


@given(numbers(0.05, 1.0), numbers(0.5, 3.0))
def test_the_pole_of_integral_action_is_the_slowest_or_refused(pole: float, law: float) -> None:
    chain = [-law, -1.3 * law, -1.5 * law + 1j, -1.5 * law - 1j]
    gain = pole * float(np.prod(pole + np.array(chain)).real)
    slowest = np.roots([1.0, *gains_from_poles(chain)[::-1], gain]).real.max()
    if slowest > -0.99 * pole:
        with pytest.raises(PoleError, match="slowest"):
            IntegralAction(pole, chain)
    else:
        assert IntegralAction(pole, chain).gain == pytest.approx(gain)
        assert slowest == pytest.approx(-pole, rel=2e-3)


@pytest.mark.parametrize("value", [0.0, -40.0, np.nan, np.inf, 1e60, "40", True])
@pytest.mark.parametrize("part", ["force", "torque"])
def test_a_bandwidth_is_a_finite_positive_number(part: str, value: Any) -> None:
    with pytest.raises(
        InputError, match=f"^bandwidth of the {part} observer .rad/s. must be .* \\(got .*\\); "
    ) as caught:
        Observer(**{part: value})
    assert str(caught.value).count("\n") == 0


@pytest.mark.parametrize(
    "arguments",
    [(0.0, -2.5), (-0.4, -2.5), (np.nan, -2.5), (0.51, -2.5), (0.4, 2.5), (0.4, [-1, -2]), (0.4, -2.5, 0.0)],
    ids=str,
)
def test_integral_action_refuses_what_is_not_stable(arguments: Any) -> None:
    with pytest.raises(GammastarError, match="must"):
        IntegralAction(*arguments)

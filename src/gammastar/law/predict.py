"""The oracle: the closed loop has an exact solution, so a nominal flight is known before it is flown.

With an exact model and continuous feedback (xi, eta - reference) obey y' = A y, so y(t) = exp(A t) y(0) by the matrix
exponential.  The inverse of the output map then gives position and its derivatives, and these give the thrust vector
F = m (g e3 - K_t - chi'') = zeta1 R e3, hence thrust, tilt and tilt rates.  Nothing here integrates the vehicle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.errors import InputError, PredictionError
from gammastar.law.flatness import flat, turns_with_heading
from gammastar.law.gains import companion
from gammastar.law.reference import Reference
from gammastar.law.thrust_axis import is_bare, thrust_axis
from gammastar.path import Path
from gammastar.vehicle import Vehicle

LARGEST_MISS = (
    1e-6  # relative error of the outputs at a solved position; Newton steps leave rounding, or did not converge
)


LEAST_STEP = 0.02  # [s] that a speed over progress may always be integrated in
NEWTON_GAP = 0.01  # [s] between two positions of an implicit path, each the guess for the next
MOST_BETWEEN = 1_000_000  # of them in one gap
ROUNDING = 1e-6  # of the gap, by which one may be longer without being split


@dataclass(frozen=True, eq=False)
class Prediction:
    """A flight in closed form; arrays over n times, world frame with third axis down."""

    time: np.ndarray  # (n,) [s]
    transverse_state: np.ndarray  # (n, 2, 4) components of xi
    tangential_state: np.ndarray  # (n, 4) eta_1 ... eta_4 in the path's parameter
    yaw_output: np.ndarray | None  # (n,) beta(r); None with a heading
    position: np.ndarray  # (n, 3) [m]
    velocity: np.ndarray  # (n, 3) [m/s]
    acceleration: np.ndarray  # (n, 3) [m/s^2]
    jerk: np.ndarray  # (n, 3) [m/s^3]
    snap: np.ndarray  # (n, 3) [m/s^4]
    thrust: np.ndarray  # (n,) [N], zeta1 = |F|; NaN, as what follows, where forces make it depend on the heading
    thrust_direction: np.ndarray  # (n, 3), R e3: the body's third axis
    tilt_rate: np.ndarray  # (n,) [rad/s], sqrt(p^2 + q^2), whatever the heading
    tilt_acceleration: np.ndarray  # (n,) [rad/s^2], |(p', q')| for r = 0, whatever the heading
    distance: np.ndarray  # (n,) [m] to the path

    def settling_time(self, tolerance: float) -> float:
        """Return the time [s] after which the distance stays within a tolerance [m]; infinity if it does not by the last time."""
        outside = np.flatnonzero(self.distance > tolerance)
        if not outside.size:
            return float(self.time[0])
        return float("inf") if outside[-1] == len(self.time) - 1 else float(self.time[outside[-1] + 1])


@dataclass(frozen=True, eq=False)
class Initial:
    """Where the chains start: everything the closed form needs to know about the start of a flight."""

    position: np.ndarray  # (3,) [m]
    parameter: float  # of the nearest point
    transverse: np.ndarray  # (n, 4) columns xi_1 ... xi_4 as in `PathOutputs`
    tangential: np.ndarray  # (4,) eta_1 ... eta_4
    yaw_output: float  # beta(r)


def predict(
    vehicle: Vehicle,
    path: Path,
    gains: Mapping[str, np.ndarray],
    initial: Initial,
    reference: Reference,
    yaw_reference: float | None,
    times: np.ndarray,
) -> Prediction:
    """Return the closed-form flight from where the chains start; `Law.predict` is the door to it.

    Args:
        vehicle: Mass and constant loads enter; the inertia does not.
        path: Curve or implicit path.
        gains: k_1 ... k_4 of 'transverse', 'transverse_2' and 'tangential', k_1 of 'yaw'.
        initial: The chains at time zero.
        reference: Along the path.
        yaw_reference: Constant reference of beta(r); None for a heading, whose yaw output has no closed form.
        times: (n,) [s], increasing from zero or later.

    Raises:
        InputError: Times not increasing or negative.
        PredictionError: The transformed state leaves the image of the output map.
    """
    times = np.asarray(times, dtype=float)
    if (
        times.ndim != 1
        or not times.size
        or times[0] < 0
        or np.any(np.diff(times) <= 0)
        or not np.all(np.isfinite(times))
    ):
        raise InputError("times must be a growing list of seconds from 0 (got another order or shape); sort them")
    fine, kept = (times, slice(None)) if path.components == 3 else _refined(times)
    transverse = transverse_chains(path, gains, initial, fine)
    tangential = tangential_chain(gains["tangential"], initial, reference, fine)
    yaw = None
    if yaw_reference is not None:
        yaw = yaw_reference + (initial.yaw_output - yaw_reference) * np.exp(-gains["yaw"][0] * times)
    position, velocity, acceleration, jerk, snap = (
        values[kept] for values in _positions(path, transverse, tangential, initial)
    )
    derivatives = (position, velocity, acceleration, jerk, snap)
    transverse, tangential = transverse[kept], tangential[kept]
    lost = ~np.isfinite(np.hstack(derivatives)).all(axis=1)
    if lost.any():
        time = float(times[lost.argmax()])
        raise PredictionError(
            f"the closed form must have a position at every time (got none from t = {time:.4g} s on); "
            "the nominal flight meets a focal point of the path: start elsewhere or change the poles",
            time,
        )
    thrust, direction, tilt_rate, tilt_acceleration = _thrust(vehicle, derivatives)
    return Prediction(
        times,
        transverse[:, :, :4],
        tangential[:, :4],
        yaw,
        *derivatives,
        thrust,
        direction,
        tilt_rate,
        tilt_acceleration,
        path.distances(derivatives[0], tangential[:, 0]),
    )


def _refined(times: np.ndarray) -> tuple[np.ndarray, Any]:
    """Return times close enough for Newton steps from each to the next, and where the given ones are among them."""
    gaps = np.diff(times, prepend=0.0)
    parts = np.maximum(1, np.ceil(np.minimum(gaps / NEWTON_GAP - ROUNDING, MOST_BETWEEN))).astype(int)
    ends = np.cumsum(parts)
    step = np.repeat(gaps / parts, parts)
    fine = np.repeat(times - gaps, parts) + step * (np.arange(ends[-1]) - np.repeat(ends - parts, parts) + 1)
    return fine, ends - 1


def transverse_chains(path: Path, gains: Mapping[str, np.ndarray], initial: Initial, times: np.ndarray) -> np.ndarray:
    """Return (n, 2, 5): the components of the transverse output and four derivatives at times (n,)."""
    xi = path.normal_components(np.array([initial.parameter]), initial.transverse[None])[0]
    return chains_from(gains, xi, times)


def chains_from(gains: Mapping[str, np.ndarray], xi: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return (n, 2, 5): transverse chains that start at components (2, 4), and their fourth derivatives, at times (n,)."""
    chains = [_chain(gains[name], xi[i], times) for i, name in enumerate(("transverse", "transverse_2"))]
    return np.stack(chains, axis=1)


def tangential_chain(gains: np.ndarray, initial: Initial, reference: Reference, times: np.ndarray) -> np.ndarray:
    """Return (n, 5): the coordinate along the path and four derivatives at times (n,)."""
    now = reference.jets(np.zeros(1), initial.tangential[None])[0]
    error = _chain(gains, initial.tangential - now[:4], times)
    if not reference.over_progress:
        return np.asarray(reference.jets(times, error[:, :4]) + error)
    rates = np.zeros((len(times), 5))
    rates[:, 0] = _progress(gains, initial, reference, times)
    for k in range(1, 5):  # the derivative k of w(eta_1(t)) needs eta_1 ... eta_k
        rates[:, k] = reference.jets(times, rates[:, :4])[:, k] + error[:, k]
    return rates


def _progress(gains: np.ndarray, initial: Initial, reference: Reference, times: np.ndarray) -> np.ndarray:
    """Return the coordinate (n,) that moves at the speed of its place plus what is left of the speed's error at the start.

    The one quantity without a closed form, eta_1' = w(eta_1) + e(t), integrated to 12 digits with e known exactly.
    """
    from scipy.integrate import solve_ivp

    matrix = companion(gains)
    error = initial.tangential - reference.jets(np.zeros(1), initial.tangential[None])[0, :4]
    error[0] = 0.0

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([reference.pieces.values(state[:1]) + state[2], matrix @ state[1:]])

    start = np.concatenate([initial.tangential[:1], error])
    widest = np.diff(reference.pieces.begins).min(initial=np.inf) / np.abs(reference.pieces.coefficients[:, 0]).max()
    solution = solve_ivp(
        rate, (0.0, times[-1] + 1e-9), start, "DOP853", times, rtol=1e-12, atol=1e-12, max_step=max(widest, LEAST_STEP)
    )
    return np.asarray(solution.y[0])


def _chain(gains: np.ndarray, start: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return (n, 5): the chain of as many states as gains, from its start, and its higher derivatives up to the fourth, at times (n,)."""
    from scipy.linalg import expm

    matrix, start = companion(gains), start[: len(gains)]
    uniform = len(times) > 2 and np.allclose(np.diff(times), times[1] - times[0], rtol=1e-9, atol=0)
    if uniform:  # powers by squaring keep the error at rounding and cost log2(n) products
        values = _powers(expm(matrix * (times[1] - times[0])), len(times)) @ (expm(matrix * times[0]) @ start)
    else:
        values = expm(matrix * times[:, None, None]) @ start
    highest = matrix[-1]
    while values.shape[1] < 5:
        values, highest = np.column_stack([values, values[:, : len(gains)] @ highest]), highest @ matrix
    return np.asarray(values)


def _powers(matrix: np.ndarray, count: int) -> np.ndarray:
    """Return (count, n, n): the powers 0 ... count - 1 of a matrix."""
    powers = np.eye(len(matrix))[None]
    step = matrix
    while len(powers) < count:
        powers = np.concatenate([powers, powers @ step])
        step = step @ step
    return powers[:count]


def _positions(
    path: Path, transverse: np.ndarray, tangential: np.ndarray, initial: Initial
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return position to snap, (n, 3) each, from components (n, 2, 5) and (n, 5), solved one time after the other.

    A position is NaN where none has these outputs, or where it lies beyond a focal point.
    """
    vectors = path.normal_vectors(tangential[:, 0], transverse, initial.parameter)
    exogenous = np.vstack(
        [vectors.transpose(2, 1, 0).reshape(5 * path.components, -1), tangential.T, path.data(tangential[:, 0])]
    )
    step = engine.compiled(("position", path.graph_key), lambda: _position_step(path))
    _, observations = engine.scan(step, initial.position, lambda a, b: exogenous[:, a:b], len(tangential))
    position, velocity, acceleration, jerk, snap, checks = (observations[:, k::6].T for k in range(6))
    position[~((checks[:, 0] < LARGEST_MISS) & (checks[:, 1] > 0))] = np.nan
    return position, velocity, acceleration, jerk, snap


def _position_step(path: Path) -> Any:
    """Return the function (guess, outputs with the path's data) -> position, and its derivatives with two checks."""
    rows = path.components
    xi, eta, guess = ca.SX.sym("xi", rows, 5), ca.SX.sym("eta", 5), ca.SX.sym("guess", 3)
    data = ca.SX.sym("data", path.data_size)
    series = path.position_series(xi, eta, guess, data)
    reached = path.outputs(series, ca.vertcat(eta[0], data))
    miss = ca.norm_2(reached.transverse[:, 0] - xi[:, 0]) / (1 + ca.norm_2(xi[:, 0]))
    results = [series.coefficients[0], ca.horzcat(*series.derivatives(), ca.vertcat(miss, reached.focal_margin, 0))]
    return ca.Function("position", [guess, ca.vertcat(ca.vec(xi), eta, data)], ca.cse(results))


@np.errstate(over="ignore")  # a speed beyond all bounds demands infinite rates
def _thrust(
    vehicle: Vehicle, derivatives: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return thrust, thrust direction, tilt rate and tilt acceleration from position derivatives.

    NaN where forces make them depend on the heading, which has no closed form.
    """
    if is_bare(vehicle):
        thrust, direction, turning, tilting = thrust_axis(vehicle, derivatives)
        return thrust, direction, np.linalg.norm(turning, axis=1), np.linalg.norm(tilting, axis=1)
    if turns_with_heading(vehicle):
        unknown = np.full(len(derivatives[0]), np.nan)
        return unknown, np.tile(unknown[:, None], 3), unknown, unknown
    found = flat(vehicle, np.stack(derivatives, axis=1))
    return found.thrust[0], found.axis[0], found.tilt_rate[0], found.tilt_acceleration[0]

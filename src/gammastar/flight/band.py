"""How far sensor noise takes a flight from its path: the closed loop, linearised along the flight without noise, and its covariance.

With x the loop's whole state (vehicle, rotors, sensors, autopilot, observer, filter) and w the errors of the samples, the flight without
noise obeys x_{k+1} = f(x_k, 0), and a deviation from it d_{k+1} = A_k d_k + B_k w_k with A, B the derivatives of f there.  Its covariance
follows the discrete Lyapunov recursion P_{k+1} = A_k P_k A_k^T + B_k S B_k^T, S the variances of the samples.  Nothing is modelled a second
time: f is the loop that flies.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.checks import instance, number
from gammastar.errors import InputError
from gammastar.flight.autopiloted import AutopilotLoop
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.flight.sensors import Sensors
from gammastar.flight.wind import Wind
from gammastar.law import AnyReference, Law, Speed
from gammastar.law.filter import MOTION
from gammastar.path import ParametricPath
from gammastar.vehicle import State, Vehicle

STEP = 1e-7  # relative, of forward differences: their error, and that of rounding, is of this size
REUSED = 0.05  # [s] for which derivatives serve again where the same axes are fresh: hardly a turn, nor a change of a filter's gains
NODES = 100  # of the quadrature over one axis across the path
LONGEST, HALVINGS = 16.0, 45  # deviations within which a bound is sought, and how often the interval is halved
LINEAR = 5.0  # deviations of a rotor's speed: some rotor at some instant of many seconds is four off, and every saturation costs
COVERED = 0.9973  # share of a normal variable within three standard deviations


@dataclass(frozen=True, eq=False)
class Band:
    """What noise does to the position, row by row of a flight; n rows, a control interval apart."""

    time: np.ndarray  # (n,) [s]
    nominal: np.ndarray  # (n,) [m], distance to the path without noise
    covariance: np.ndarray  # (n, 3, 3) [m^2] of the position, world
    across: np.ndarray  # (n, 3, 3), projector onto the plane across the path
    saturation: (
        np.ndarray
    )  # (n,): deviations of its speed by which the nearest rotor is off a limit; infinite without rotors

    @property
    def deviations(self) -> np.ndarray:
        """Return the standard deviations (n, 3) [m] of the position in world axes."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2)))

    @functools.cached_property
    def variances(self) -> np.ndarray:
        """Return the principal variances (n, 2) [m^2] across the path, the larger one first."""
        flat = self.across @ self.covariance @ self.across
        return np.asarray(np.maximum(np.linalg.eigvalsh(flat)[:, :0:-1], 0))

    @property
    def is_linear(self) -> bool:
        """Return whether the band is to be believed: every rotor stays five deviations off its limits, all the time."""
        return bool(np.all(self.saturation >= LINEAR))

    @property
    def root_mean_square(self) -> np.ndarray:
        """Return the root mean square distance (n,) [m] to the path: that without noise and that of noise, squared and added."""
        return np.asarray(np.sqrt(self.nominal**2 + self.variances.sum(axis=1)))

    def bound(self, share: float = COVERED) -> np.ndarray:
        """Return the distance (n,) [m] that a share of flights keeps from the one without noise: three sigma, in two axes."""
        return _radius(self.variances[:, 0], self.variances[:, 1], share)

    def over(self, first: float) -> float:
        """Return the root mean square distance [m] over the rows from a time [s] on."""
        return float(np.sqrt(np.mean(self.root_mean_square[self.time >= first] ** 2)))


def noise_band(
    law: Law,
    start: State,
    *,
    sensors: Sensors,
    speed: float | None = None,
    reference: AnyReference | None = None,
    duration: float = 20.0,
    after: float | None = None,
    step: float = 1e-3,
    rate: float | None = None,
    truth: Vehicle | None = None,
    wind: Wind | None = None,
    yaw_reference: float = 0.0,
) -> Band:
    """Return the band in which noise keeps a flight about the one without noise; arguments as of `fly`.

    Linear theory: valid while noise is small beside what makes the loop nonlinear.  Limits of rotors come first, and `is_linear` tells
    whether noise reaches them.  No sample counts as lost; biases belong to the flight without noise.

    Args:
        sensors: Whose noise it is.
        after: Time [s] from which the noise acts and rows are returned; half the duration when left out.  The band has grown to its
            full width some slow time constants of the law later.

    Raises:
        InputError: The path is not a curve, or the flight without noise does not last.
    """
    if not isinstance(law.path, ParametricPath):
        raise InputError("a noise band needs a curve (got an implicit path); give a curve")
    instance(sensors, Sensors, "sensors", "make them with gs.Sensors()")
    if (speed is None) == (reference is None):
        raise InputError("a flight needs exactly one of speed and reference (got both or none); give one of them")
    wanted: AnyReference = Speed(speed) if speed is not None else reference  # type: ignore[assignment]
    conditions = Conditions(duration, step, None, rate, truth=truth, sensors=sensors, wind=wind)
    loop, first, steps = prepared(law, start, wanted, yaw_reference, conditions)
    assert isinstance(loop, AutopilotLoop)
    begin = int(np.ceil((duration / 2 if after is None else number(after, "after [s]", at_least=0)) / loop.interval))
    quiet = dataclasses.replace(loop, sensors=_quiet(sensors))
    states, observations = engine.trace(quiet.step(), first, steps + 1, machine="casadi")
    rows = loop.rows(states, observations)
    if not np.all(np.isfinite(states)):
        raise InputError(
            "the flight without noise must last (got NaN or infinity on the way); fly it without sensors first"
        )
    states = states[: sum(loop.sizes[:4]), : steps + 1]
    times = np.arange(steps + 1) * loop.interval
    errors = quiet.sensors.exogenous(0, steps + 1, 1 / loop.interval)
    outside = np.vstack([times, rows["wind"].T, errors, _looked_up(loop, states, times)])
    position, rotor_speeds = _covariances(loop, states, outside, begin)
    tangents = law.path.jets(states[loop.plant.size, begin:])[:, 1]
    tangents = tangents / np.linalg.norm(tangents, axis=1)[:, None]
    across = np.eye(3) - tangents[:, :, None] * tangents[:, None, :]
    saturation = _saturation(loop, states[:, begin:], rotor_speeds)
    return Band(times[begin:], rows["distance"][begin:], position, across, saturation)


def _quiet(sensors: Sensors) -> Sensors:
    """Return sensors without noise: every sample arrives, with no error but the bias."""
    return Sensors(*(dataclasses.replace(channel, deviation=0.0, dropout=0.0) for channel in sensors.channels))


def _looked_up(loop: AutopilotLoop, states: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return what a step looks up (w, n) at states (m, n) and times (n,): the reference's numbers, then the path's."""
    parameters, reference = states[loop.parameter], loop.reference
    keys = parameters if reference.over_progress else times
    return np.vstack([reference.pieces.data(keys), loop.law.path.data(parameters)])


def _saturation(loop: AutopilotLoop, states: np.ndarray, variances: np.ndarray) -> np.ndarray:
    """Return by how many deviations (n,) the speed of the nearest rotor is off its limits, from states (m, n) and variances (n, rotors)."""
    rotors = loop.plant.rotors
    if rotors is None:
        return np.full(len(variances), np.inf)
    speeds = states[MOTION : MOTION + rotors.count].T
    room = np.minimum(speeds - rotors.slowest, rotors.fastest - speeds)
    return np.asarray(np.min(room / np.sqrt(np.maximum(variances, np.finfo(float).tiny)), axis=1))


def _covariances(
    loop: AutopilotLoop, states: np.ndarray, outside: np.ndarray, begin: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariances (n, 3, 3) of the position and variances (n, rotors) of speeds from row `begin` on, where noise sets in."""
    from scipy.sparse import csr_array

    step, kept = _stacked(loop), _kept(loop)
    errors = [4 + 6 * channel + axis for channel in range(4) for axis in range(3)]  # rows of what comes from outside
    flags = [row + 3 for row in errors]
    deviations = np.concatenate([np.asarray(channel.deviation) for channel in loop.sensors.channels])
    known: dict[bytes, tuple[int, Any, np.ndarray]] = {}
    P = np.zeros((len(kept), len(kept)))
    rotors = slice(MOTION, MOTION + loop.plant.rotor_count)
    found, speeds = [P[:3, :3]], [np.diag(P)[rotors]]
    for k in range(begin, states.shape[1] - 1):
        fresh = outside[flags, k]
        taken, A, B = known.get(fresh.tobytes(), (-1, P, P))
        if taken < 0 or (k - taken) * loop.interval > REUSED:
            at = states[:, k], outside[:, k]
            A = csr_array(_derivative(step, at, kept, 0)[kept])
            used = [row for row, new, deviation in zip(errors, fresh, deviations, strict=True) if new * deviation > 0]
            B = _derivative(step, at, np.array(used, dtype=int), 1)[kept]
            B = B * deviations[[errors.index(row) for row in used]]
            known[fresh.tobytes()] = (k, A, B)
        P = A @ (A @ P).T + B @ B.T  # P is symmetric
        found.append(P[:3, :3])
        speeds.append(np.diag(P)[rotors])
    return np.array(found), np.array(speeds)


def _stacked(loop: AutopilotLoop) -> Any:
    """Return an interval without chance as the function (loop state without wind, what comes from outside) -> next state."""
    given = loop.given()
    sizes = [given.size1_in(k) for k in range(given.n_in())]
    state, outside = ca.SX.sym("state", sizes[0]), ca.SX.sym("outside", sum(sizes[1:]))
    parts = ca.vertsplit(outside, np.cumsum([0, *sizes[1:]]).tolist())
    return ca.Function("given", [state, outside], [given(state, *parts)[0]])


def _kept(loop: AutopilotLoop) -> np.ndarray:
    """Return the entries of the loop's state that matter: all but a filter's covariance, which acts through what noise alone brings."""
    size = sum(loop.sizes[:4])
    estimate = 0 if loop.law.estimator is None else loop.law.estimator.size - MOTION
    return np.arange(size - estimate)


def _derivative(step: Any, at: tuple[np.ndarray, np.ndarray], entries: np.ndarray, which: int) -> np.ndarray:
    """Return the derivative (size, n) of the next state by entries (n,) of the state (0) or of what comes from outside (1)."""
    if not len(entries):
        return np.empty((len(at[0]), 0))
    steps = STEP * np.maximum(1.0, np.abs(at[which][entries]))
    columns = [np.tile(each[:, None], 1 + len(entries)) for each in at]
    columns[which][entries, np.arange(len(entries))] += steps
    after = step(*columns).full()
    return np.asarray((after[:, :-1] - after[:, -1:]) / steps)


def _radius(first: np.ndarray, second: np.ndarray, share: float) -> np.ndarray:
    """Return the r (n,) with P(|e| < r) = share for normal e in the plane with principal variances first >= second, (n,) each.

    With z = e_1 / sqrt(first) the probability is the mean over |z| < r / sqrt(first) of that of |e_2| < sqrt(r^2 - e_1^2); z = R sin u.
    """
    from scipy.special import erf

    tiny = np.finfo(float).tiny
    narrow = np.sqrt(2 * np.maximum(second / np.maximum(first, tiny), tiny))[:, None]
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    sine, cosine = np.sin(nodes * np.pi / 2), np.cos(nodes * np.pi / 2)
    low, high = np.zeros((len(first), 1)), np.full((len(first), 1), LONGEST)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        inside = np.exp(-((middle * sine) ** 2) / 2) * erf(middle * cosine / narrow) * cosine
        enough = (inside @ weights)[:, None] * middle * np.sqrt(np.pi / 8) > share
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return np.asarray(np.sqrt(first) * high[:, 0])

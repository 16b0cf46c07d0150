"""The rotation group SO(3) and its nine-number coordinates.

Most functions are one formula that serves both sides of the house: given an `SX` they build a graph and return `SX`;
given numbers they return a NumPy array.  Attitudes map body to world.  Angles are radians unless a name says degrees.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, cast

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import number
from gammastar.errors import RotationError, ShapeError

SMALL_ANGLE = 0.1  # [rad] below it the exponential uses its series; the first neglected term is 0.1**10 / 11! < 3e-18
SMALL_TURN = (
    1e-4  # [rad] below it the logarithm uses its series; the first neglected term is of the order of its fourth power
)
PROJECTION_LIMIT = 1e-2  # Frobenius distance beyond which a matrix is a mistake, not a rotation given to few digits


def _graph_or_numbers(formula: Callable[..., Any]) -> Callable[..., Any]:
    """Let a CasADi formula accept graphs and numbers alike: SX in, SX out; anything array-like in, ndarray out."""

    @functools.wraps(formula)
    def wrapper(*arguments: Any) -> Any:
        if any(isinstance(argument, (ca.SX, ca.MX)) for argument in arguments):
            return formula(*arguments)
        value = np.array(formula(*(ca.DM(np.asarray(argument, dtype=float)) for argument in arguments)))
        return value[:, 0] if value.shape[1] == 1 else value

    return wrapper


@_graph_or_numbers
def hat(vector: Any) -> Any:
    """Return the skew matrix of a 3-vector: hat(a) b = a x b (paper, section I-B)."""
    x, y, z = ca.vertsplit(vector)
    zero = type(vector)(1, 1)
    return ca.vertcat(ca.horzcat(zero, -z, y), ca.horzcat(z, zero, -x), ca.horzcat(-y, x, zero))


@_graph_or_numbers
def vee(matrix: Any) -> Any:
    """Return the 3-vector of a skew matrix, the inverse of `hat`; any symmetric part is ignored."""
    return ca.vertcat(matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]) / 2


@_graph_or_numbers
def exp(rotation_vector: Any) -> Any:
    """Return the rotation matrix of a rotation vector [rad] (Rodrigues), smooth through zero.

    Below `SMALL_ANGLE` the coefficients sin(a)/a and (1 - cos(a))/a^2 come from their series, so derivatives of the
    graph exist at zero as well.
    """
    return type(rotation_vector).eye(3) + exp_increment(rotation_vector)


@_graph_or_numbers
def exp_increment(rotation_vector: Any) -> Any:
    """Return exp(w) - I, precise for short w: R + R (exp(w) - I) loses no digits of w to the ones of the identity."""
    skew = hat(rotation_vector)
    square = ca.dot(rotation_vector, rotation_vector)
    is_small = square < SMALL_ANGLE**2
    angle = ca.sqrt(ca.if_else(is_small, 1, square))
    series_first = 1 - square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72)))
    series_second = (1 - square / 12 * (1 - square / 30 * (1 - square / 56 * (1 - square / 90)))) / 2
    first = ca.if_else(is_small, series_first, ca.sin(angle) / angle)
    second = ca.if_else(is_small, series_second, 2 * (ca.sin(angle / 2) / angle) ** 2)
    return first * skew + second * (skew @ skew)


@_graph_or_numbers
def cayley(vector: Any) -> Any:
    """Return cay(w) = I + 2/(1 + h.h) (H + H^2) with h = w/2 and H = hat(h): a rotation without trigonometry.

    It rotates about w by 2 atan(|w|/2) and agrees with `exp` to second order.
    """
    return type(vector).eye(3) + cayley_increment(vector)


@_graph_or_numbers
def cayley_increment(vector: Any) -> Any:
    """Return cay(w) - I, precise for short w, as `exp_increment`."""
    half = vector / 2
    skew = hat(half)
    return 2 / (1 + ca.dot(half, half)) * (skew + skew @ skew)


@_graph_or_numbers
def cayley_rate(vector: Any, angular_velocity: Any) -> Any:
    """Return w' such that R cay(w) has the body rate Omega: Omega + w x Omega / 2 + w (w.Omega) / 4."""
    return angular_velocity + ca.cross(vector, angular_velocity) / 2 + vector * (ca.dot(vector, angular_velocity) / 4)


@_graph_or_numbers
def stack(attitude: Any) -> Any:
    """Return the nine entries of a 3x3 matrix, column by column: the map (diamond) of the paper's Proposition 1."""
    return ca.vec(attitude)


@_graph_or_numbers
def unstack(entries: Any) -> Any:
    """Return the 3x3 matrix of nine entries, the inverse of `stack`."""
    return ca.reshape(entries, 3, 3)


@_graph_or_numbers
def product(first: Any, second: Any) -> Any:
    """Return stack(R R') from stack(R) and stack(R'), (9,) each: the group product of Eq. (5)."""
    return ca.vec(ca.reshape(first, 3, 3) @ ca.reshape(second, 3, 3))


def log(attitude: Any) -> Any:
    """Return the rotation vector (3,) [rad], of length at most pi, of a rotation matrix; accurate near zero and near pi.

    At exactly pi the two opposite vectors are both right and one of them is returned.
    """
    return _log(attitude if isinstance(attitude, (ca.SX, ca.MX)) else as_matrix(attitude))


@_graph_or_numbers
def _log(attitude: Any) -> Any:
    """Return the rotation vector from the skew part, which is short near pi, or there from the symmetric part."""
    skew, cosine = vee(attitude), (ca.trace(attitude) - 1) / 2
    square = ca.dot(skew, skew)
    sine = ca.sqrt(ca.if_else(square > 0, square, 1)) * (square > 0)  # smooth where it is used
    angle = ca.atan2(sine, cosine)
    is_small, is_wide = ca.logic_and(angle < SMALL_TURN, cosine > 0), cosine <= 0
    scale = ca.if_else(is_small, 1 + square / 6, angle / ca.if_else(sine > 0, sine, 1))
    outer = (attitude + attitude.T) / 2 - cosine * type(attitude).eye(3)  # (1 - cos a) times axis axis^T
    first, second, third = (outer[k, k] for k in range(3))
    column = ca.if_else(second > third, outer[:, 1], outer[:, 2])
    column = ca.if_else(ca.logic_and(first > second, first > third), outer[:, 0], column)
    column = ca.if_else(is_wide, column, type(attitude).ones(3, 1))
    sign = ca.if_else(ca.dot(column, skew) >= 0, 1, -1)
    return ca.if_else(is_wide, sign * angle / ca.norm_2(column) * column, scale * skew)


def roll(degrees: float) -> np.ndarray:
    """Return the rotation by an angle [deg] about the body's first axis; 180 is upside down."""
    return cast(np.ndarray, exp([np.radians(number(degrees, "roll [deg]")), 0.0, 0.0]))


def pitch(degrees: float) -> np.ndarray:
    """Return the rotation by an angle [deg] about the body's second axis."""
    return cast(np.ndarray, exp([0.0, np.radians(number(degrees, "pitch [deg]")), 0.0]))


def yaw(degrees: float) -> np.ndarray:
    """Return the rotation by an angle [deg] about the body's third axis."""
    return cast(np.ndarray, exp([0.0, 0.0, np.radians(number(degrees, "yaw [deg]"))]))


def from_quaternion(quaternion: ArrayLike) -> np.ndarray:
    """Return the rotation of a unit quaternion in the order (w, x, y, z); it is normalised, and zero is refused."""
    q = np.asarray(quaternion, dtype=float)
    if q.shape != (4,) or not np.all(np.isfinite(q)):
        raise ShapeError(f"a quaternion must be four finite numbers (w, x, y, z) (got {quaternion!r}); give all four")
    norm = float(np.linalg.norm(q))
    if abs(norm - 1) > PROJECTION_LIMIT:
        raise RotationError(
            f"a quaternion must have length one within {PROJECTION_LIMIT:g} (got {norm:.6g}); normalise it",
            abs(norm - 1),
        )
    w, v = q[0] / norm, q[1:] / norm
    skew = hat(v)
    return cast(np.ndarray, np.eye(3) + 2 * w * skew + 2 * skew @ skew)


def random(generator: np.random.Generator) -> np.ndarray:
    """Return a rotation drawn uniformly (Haar measure) from SO(3)."""
    q = generator.standard_normal(4)
    return from_quaternion(q / np.linalg.norm(q))


def project(matrix: ArrayLike, limit: float = PROJECTION_LIMIT) -> tuple[np.ndarray, float]:
    """Return the rotation nearest to a 3x3 matrix in the Frobenius norm, and the distance to it.

    A rotation printed to a few digits is meant, not exact (the paper's R(0) is one); anything farther than `limit` is
    refused.

    Raises:
        ShapeError: Not 3x3 or not finite.
        RotationError: Farther from SO(3) than `limit`: scaled, reflected or sheared.
    """
    M = as_matrix(matrix)
    left, _, right = np.linalg.svd(M)
    sign = np.sign(np.linalg.det(left @ right))
    rotation = left @ np.diag([1.0, 1.0, sign]) @ right
    size = max(1.0, float(np.abs(M).max()))  # keeps the squares of huge entries finite
    distance = size * float(np.linalg.norm((M - rotation) / size))
    if distance > limit:
        cause = "it reflects" if np.linalg.det(M / size) < 0 else "its columns are not orthonormal"
        raise RotationError(
            f"attitude must be a rotation matrix within {limit:g} of SO(3) (got distance {distance:.3g}: {cause}); "
            "give orthonormal columns with determinant +1",
            distance,
        )
    return rotation, distance


def drift(attitude: ArrayLike) -> float:
    """Return the largest entry of |R^T R - I| over (3, 3) or (n, 3, 3): how far rounding has left the group."""
    R = np.asarray(attitude, dtype=float)
    return float(np.max(np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)), initial=0.0))


def as_matrix(matrix: ArrayLike) -> np.ndarray:
    """Return a finite float array of shape (3, 3), or raise `ShapeError`."""
    try:
        M = np.asarray(matrix, dtype=float)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"a matrix must be 3 rows of 3 numbers (got {matrix!r}); give numbers only") from error
    if M.shape != (3, 3):
        raise ShapeError(f"a matrix must have shape (3, 3) (got {M.shape}); give three rows of three numbers")
    if not np.all(np.isfinite(M)):
        raise ShapeError("a matrix must have finite entries (got NaN or infinity); replace them")
    return M

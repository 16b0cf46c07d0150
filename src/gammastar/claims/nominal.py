"""The paper's flight of section VI in closed form, without the package: chains, then the circle, then the thrust vector.

With repeated poles -p a chain of n integrators moves as exp(A t) y0 = exp(-p t) sum_k (t^k/k!) (A + p I)^k y0, a finite sum since
A + p I is nilpotent.  alpha1 = r^2 - 1, alpha2 = x3 - 10 and the speed along the path follow such chains; the attitude enters at
the start only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MASS, GRAVITY, TRANSVERSE_INERTIA = 0.1, 9.8, 0.0177  # [kg], [m/s^2], [kg m^2]; section VI
START = (3.2, 5.0, 0.0)  # [m]; section VI-A
HEIGHT = 10.0  # [m], x3 of the circle of radius 1
PRINTED_UPRIGHT = ((0.9980, -0.0517, 0.0358), (0.0523, 0.9985, -0.0156), (-0.0349, 0.0174, 0.9992))  # section VI-A
PRINTED_INVERTED = ((1.0, 0.0, 0.0), (0.0, -0.9998, -0.0175), (0.0, 0.0175, -0.9998))  # section VI-B


@dataclass(frozen=True, eq=False)
class NominalFlight:
    """A flight in closed form from rest at `START` with thrust m g, no yaw rate; arrays over n times."""

    time: np.ndarray  # (n,) [s]
    position: np.ndarray  # (n, 3) [m]
    thrust: np.ndarray  # (n,) [N]
    rate: np.ndarray  # (n,) [rad/s], |Omega| for r = 0
    torque: np.ndarray  # (n,) [N m], |tau| for r = 0 and Jx = Jy, whatever the heading


def fly_nominal(pole: float, attitude: np.ndarray, times: np.ndarray, speed: float = 1.0) -> NominalFlight:
    """Return the flight of section VI with every pole at -pole [1/s], the angle on the path itself left free.

    Args:
        pole: [1/s], positive.
        attitude: (3, 3), a rotation, body to world, at the start.
        times: (n,) [s].
        speed: Reference of eta_12 [rad/s].
    """
    acceleration = np.array([0.0, 0.0, GRAVITY]) - GRAVITY * attitude[:, 2]
    r, angle = math.hypot(START[0], START[1]), math.atan2(START[1], START[0])
    outward, around = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    squared = chain(pole, [r * r - 1, 0, 2 * r * (outward @ acceleration[:2]), 0], times)  # alpha1 and four derivatives
    height = chain(pole, [START[2] - HEIGHT, 0, acceleration[2], 0], times)
    turning = chain(pole, [-speed, around @ acceleration[:2] / r, 0], times)  # theta' - speed and three derivatives
    squared[:, 0] += 1
    radius = _square_root(squared)
    angles = np.column_stack([_integral(pole, turning, angle, times) + speed * times, turning])
    angles[:, 1] += speed
    plane = _polar(radius, angles)
    jets = np.stack([plane.real, plane.imag, height], axis=-1)  # (n, 5, 3)
    jets[:, 0, 2] += HEIGHT
    return NominalFlight(times, jets[:, 0], *_from_force(jets))


def chain(pole: float, start: Sequence[Any], times: np.ndarray) -> np.ndarray:
    """Return (times, n + 1): a chain with n equal poles and its highest derivative, from its start (n,)."""
    n = len(start)
    matrix = np.diag(np.ones(n - 1), 1)
    matrix[-1] = [-math.comb(n, k) * pole ** (n - k) for k in range(n)]
    nilpotent, term, total = matrix + pole * np.eye(n), np.array(start, dtype=float), np.zeros((len(times), n))
    for k in range(n):
        total += np.outer(times**k / math.factorial(k), term)
        term = nilpotent @ term
    total *= np.exp(-pole * times)[:, None]
    return np.column_stack([total, total @ matrix[-1]])


def _integral(pole: float, values: np.ndarray, start: float, times: np.ndarray) -> np.ndarray:
    """Return start plus the time integral of a chain's first state, from its own differential equation.

    y''' + 3 p y'' + 3 p^2 y' + p^3 y = 0 integrates to p^3 (integral of y) = -[y'' + 3 p y' + 3 p^2 y] between 0 and t.
    """
    primitive = values[:, 2] + 3 * pole * values[:, 1] + 3 * pole**2 * values[:, 0]
    return np.asarray(start - (primitive - primitive[0]) / pole**3)


def _square_root(squares: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, 5) of a root from those of its square, by Leibniz."""
    roots = np.zeros_like(squares)
    roots[:, 0] = np.sqrt(squares[:, 0])
    for k in range(1, squares.shape[1]):
        inner = sum(math.comb(k, i) * roots[:, i] * roots[:, k - i] for i in range(1, k))
        roots[:, k] = (squares[:, k] - inner) / (2 * roots[:, 0])
    return roots


def _polar(radius: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, 5) of radius exp(i angle) from those of both, by Leibniz."""
    turn = np.zeros(angle.shape, dtype=complex)
    turn[:, 0] = np.exp(1j * angle[:, 0])
    for k in range(1, angle.shape[1]):
        turn[:, k] = sum(math.comb(k - 1, i) * 1j * angle[:, i + 1] * turn[:, k - 1 - i] for i in range(k))
    return np.column_stack(
        [sum(math.comb(k, i) * radius[:, i] * turn[:, k - i] for i in range(k + 1)) for k in range(5)]
    )


def _from_force(jets: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return thrust, rate and torque from position derivatives (n, 5, 3): F = T b = m (g e3 - chi'').

    With r = 0 the rate is |b'|, and the angular acceleration is b x b'': only the part of b'' across b is due to torque, the part
    -|b'|^2 b along it is centripetal.
    """
    force, force_rate, force_ddot = (
        MASS * np.array([0, 0, GRAVITY]) - MASS * jets[:, 2],
        -MASS * jets[:, 3],
        -MASS * jets[:, 4],
    )
    thrust = np.linalg.norm(force, axis=1)
    b = force / thrust[:, None]
    thrust_rate = np.sum(b * force_rate, axis=1)
    b_rate = (force_rate - thrust_rate[:, None] * b) / thrust[:, None]
    b_ddot = (force_ddot - 2 * thrust_rate[:, None] * b_rate) / thrust[:, None]
    rate = np.linalg.norm(b_rate, axis=1)
    return thrust, rate, TRANSVERSE_INERTIA * np.linalg.norm(np.cross(b, b_ddot), axis=1)

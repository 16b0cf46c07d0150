"""The paper's extended system (7) in SymPy, written independently of the package's graphs.

Everything is exact: expressions stay polynomials or rational functions of the state, rotations come from the Cayley map of
rational vectors, and substituting a rational state gives rational numbers.  SymPy is loaded on first use.
"""

from __future__ import annotations

import functools
import random
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from gammastar.errors import MissingExtraError


def load_sympy() -> Any:
    """Return the SymPy module, or raise `MissingExtraError` naming the extra `claims`."""
    try:
        import sympy
    except ImportError as error:
        raise MissingExtraError("sympy", "claims", "checking the paper's claims") from error
    return sympy


@dataclass(frozen=True, eq=False)
class ExtendedSystem:
    """Symbols and vector fields of Eq. (7): x' = drift + inputs u with u = (u_d, tau_p, tau_q, tau_r), diagonal inertia."""

    position: Any  # (3, 1)
    velocity: Any  # (3, 1)
    attitude: Any  # (3, 3), nine free entries: orthogonality is a property of states, not of the algebra
    angular_velocity: Any  # (3, 1), body
    thrust: Any  # zeta1
    thrust_rate: Any  # zeta2
    mass: Any
    gravity: Any
    inertia: Any  # (3, 1), principal moments
    bias_acceleration: Any  # k_t, scalar
    bias_torque: Any  # k_r, scalar
    state: Any  # (20, 1)
    drift: Any  # (20, 1)
    inputs: Any  # (20, 4)

    def lie(self, scalar: Any) -> Any:
        """Return L_f of a scalar expression of the state."""
        return sum(scalar.diff(x) * rate for x, rate in zip(self.state, self.drift, strict=True) if rate != 0)

    def tower(self, output: Any, height: int) -> list[Any]:
        """Return the output and its Lie derivatives along the drift, L_f^0 ... L_f^height."""
        levels = [output]
        for _ in range(height):
            levels.append(self.lie(levels[-1]))
        return levels

    def lie_inputs(self, scalar: Any) -> Any:
        """Return the row (1, 4) of the L_{g_i} of a scalar expression of the state."""
        sp = load_sympy()
        return sp.Matrix([scalar]).jacobian(self.state) * self.inputs


@functools.cache
def extended_system() -> ExtendedSystem:
    """Return Eq. (7) with free symbols for the state and every parameter."""
    sp = load_sympy()
    chi, v = (sp.Matrix(sp.symbols(f"{name}1:4", real=True)) for name in ("x", "v"))
    R = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"r{i + 1}{j + 1}", real=True))
    omega = sp.Matrix(sp.symbols("p q r", real=True))
    zeta1, zeta2 = sp.symbols("zeta1 zeta2", real=True)
    m, g, k_t, k_r = sp.symbols("m g k_t k_r", positive=True)
    moments = sp.Matrix(sp.symbols("J_x J_y J_z", positive=True))
    J, e3, ones = sp.diag(*moments), sp.Matrix([0, 0, 1]), sp.ones(3, 1)
    acceleration = g * e3 - zeta1 / m * R * e3 - k_t * ones
    torque_free = J.inv() * (-omega.cross(J * omega) - k_r * ones)
    state = sp.Matrix([chi, v, R.vec(), omega, [zeta1], [zeta2]])
    drift = sp.Matrix([v, acceleration, (R * hat(omega)).vec(), torque_free, [zeta2], [0]])
    inputs = sp.zeros(20, 4)
    inputs[19, 0] = 1
    inputs[15:18, 1:4] = J.inv()
    return ExtendedSystem(chi, v, R, omega, zeta1, zeta2, m, g, moments, k_t, k_r, state, drift, inputs)


def hat(vector: Any) -> Any:
    """Return the skew matrix of a SymPy 3-vector: hat(a) b = a x b."""
    x, y, z = vector
    return load_sympy().Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def cayley(vector: Any) -> Any:
    """Return the rotation cay(w) = (I - W/2)^-1 (I + W/2), W = hat(w): rational wherever w is."""
    sp = load_sympy()
    half = hat(vector) / 2
    return ((sp.eye(3) - half).inv() * (sp.eye(3) + half)).applyfunc(sp.cancel)


def circle_outputs(system: ExtendedSystem) -> tuple[Any, Any, Any]:
    """Return (alpha1, alpha2, pi) of the paper's section VI: x1^2 + x2^2 - 1, x3 - 10 and the angle atan2(x2, x1)."""
    x1, x2, x3 = system.position
    return x1**2 + x2**2 - 1, x3 - 10, load_sympy().atan2(x2, x1)


@functools.cache
def circle_towers(height: int = 4) -> tuple[tuple[Any, ...], ...]:
    """Return L_f^0 ... L_f^height of alpha1, alpha2 and pi of the paper's circle, as expressions of the state."""
    system = extended_system()
    return tuple(tuple(system.tower(output, height)) for output in circle_outputs(system))


@functools.cache
def generic_towers(height: int = 3) -> tuple[tuple[Any, ...], ...]:
    """Return the towers of three *undefined* functions of position: what is shown for them holds for every path."""
    sp, system = load_sympy(), extended_system()
    names = ("alpha1", "alpha2", "pi")
    return tuple(tuple(system.tower(sp.Function(name)(*system.position), height)) for name in names)


def random_values(seed: int, position: Sequence[Any] | None = None) -> dict[Any, Any]:
    """Return rational values for every symbol of the system: attitude a rotation, thrust and parameters positive.

    The three moments differ and both biases are non-zero, so that no mix-up can hide behind a symmetry.
    """
    sp, system = load_sympy(), extended_system()
    draw = random.Random(seed)

    def rational(low: int = -9, high: int = 9) -> Any:
        return sp.Rational(draw.randint(low, high), draw.randint(2, 7))

    R = cayley([rational() for _ in range(3)])
    values = {symbol: rational() for symbol in (*system.position, *system.velocity, *system.angular_velocity)}
    values |= dict(zip(system.attitude, R, strict=True))
    values |= {system.thrust: rational(4, 12), system.thrust_rate: rational()}
    values |= {system.mass: sp.Rational(draw.randint(2, 9), 4), system.gravity: sp.Rational(49, 5)}
    values |= dict(zip(system.inertia, (sp.Rational(2, 5), sp.Rational(3, 7), sp.Rational(1, 2)), strict=True))
    values |= {system.bias_acceleration: sp.Rational(2, 9), system.bias_torque: sp.Rational(1, 11)}
    if position is not None:
        values |= dict(zip(system.position, (sp.sympify(x) for x in position), strict=True))
    return values


def output_derivatives(output: Any, jets: Sequence[Any]) -> list[Any]:
    """Return the time derivatives 0 ... 4 of an output of position along a position jet, without any Lie derivative.

    The output is composed with the polynomial chi + v t + a t^2/2 + ... and differentiated at t = 0; `jets` holds position,
    velocity, acceleration, jerk and snap as numbers, each (3, 1).
    """
    sp, system = load_sympy(), extended_system()
    t = sp.Symbol("t")
    motion = sum((jet * t**k / sp.factorial(k) for k, jet in enumerate(jets)), sp.zeros(3, 1))
    composed = output.subs(dict(zip(system.position, motion, strict=True)), simultaneous=True)
    return [sp.diff(composed, t, k).subs(t, 0) for k in range(len(jets))]


def position_jets(values: dict[Any, Any], inputs: Any) -> list[Any]:
    """Return position and its derivatives to the snap at a state, from products of R and hat(Omega) only.

    With b = R e3: b' = R (Omega x e3) and b'' = R (Omega x (Omega x e3) + Omega' x e3); the specific thrust -zeta1 b / m is
    differentiated by the product rule.  No Lie derivative of Eq. (7) is used, so the two derivations can disagree.
    """
    sp, system = load_sympy(), extended_system()
    here = {
        name: getattr(system, name).xreplace(values)
        for name in ("position", "velocity", "attitude", "angular_velocity")
    }
    R, omega, e3 = here["attitude"], here["angular_velocity"], sp.Matrix([0, 0, 1])
    zeta1, zeta2, m = (values[symbol] for symbol in (system.thrust, system.thrust_rate, system.mass))
    J = sp.diag(*(values[moment] for moment in system.inertia))
    omega_rate = J.inv() * (inputs[1:4, 0] - omega.cross(J * omega) - values[system.bias_torque] * sp.ones(3, 1))
    b, b_rate = R * e3, R * omega.cross(e3)
    b_accel = R * (omega.cross(omega.cross(e3)) + omega_rate.cross(e3))
    acceleration = values[system.gravity] * e3 - zeta1 * b / m - values[system.bias_acceleration] * sp.ones(3, 1)
    jerk = -(zeta2 * b + zeta1 * b_rate) / m
    snap = -(inputs[0] * b + 2 * zeta2 * b_rate + zeta1 * b_accel) / m
    return [here["position"], here["velocity"], acceleration, jerk, snap]


def size(matrix: Any) -> Fraction:
    """Return the largest absolute entry of a matrix or scalar of rational numbers; anything else is refused by SymPy."""
    sp = load_sympy()
    entries = (sp.Rational(entry) for entry in sp.Matrix([matrix]))
    return max((abs(Fraction(int(entry.p), int(entry.q))) for entry in entries), default=Fraction(0))


def is_zero(expression: Any) -> bool:
    """Return whether a matrix or scalar expression vanishes identically, by bringing it over one denominator and expanding."""
    sp = load_sympy()
    return all(sp.expand(sp.numer(sp.together(entry))) == 0 for entry in sp.Matrix([expression]))

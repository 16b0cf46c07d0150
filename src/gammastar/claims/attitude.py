"""Claims on the attitude and its nine coordinates: (2), the map (diamond), Proposition 1, the group product (5), and (6)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gammastar import so3
from gammastar.claims import witness
from gammastar.claims.claim import Claim, Finding, Method, Verdict, misprint, require
from gammastar.claims.symbols import cayley, extended_system, hat, is_zero, load_sympy, random_values, size


def check_attitude_rate() -> Finding:
    """Eq. (2): with w' = Omega + w x Omega / 2 + w (w.Omega) / 4, d/dt cay(w) = cay(w) hat(Omega), identically in w and Omega."""
    sp = load_sympy()
    w, omega = sp.Matrix(sp.symbols("w1:4", real=True)), extended_system().angular_velocity
    w_rate = omega + w.cross(omega) / 2 + w * w.dot(omega) / 4
    R = cayley(w)
    rate = sum((R.diff(symbol) * speed for symbol, speed in zip(w, w_rate, strict=True)), sp.zeros(3, 3))
    require(is_zero(R.T * R - sp.eye(3)) and is_zero(R.det() - 1), "cay(w) is not a rotation")
    require(is_zero(rate - R * hat(omega)), "R' = R hat(Omega) does not hold for body rates")
    require(not is_zero(rate - hat(omega) * R), "the world-rate equation R' = hat(Omega) R holds as well")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "every body rate moves cay(w) along SO(3) exactly as printed, for all w and Omega; hat(Omega) R, in the other order, does not",
    )


def stack(matrix: Any) -> Any:
    """Return the column of a matrix's columns, the map (diamond), as printed for n = 3 above (6)."""
    return load_sympy().Matrix([matrix[i, j] for j in range(matrix.cols) for i in range(matrix.rows)])


def unstack(column: Any) -> Any:
    """Return the 3x3 matrix of nine stacked entries."""
    return load_sympy().Matrix(3, 3, lambda i, j: column[3 * j + i])


def check_stacking() -> Finding:
    """The map (diamond): stacking columns turns A X B into (B^T kron A) applied to the stack; stacking rows does not."""
    sp = load_sympy()
    A, X, B = (sp.Matrix(3, 3, lambda i, j, name=name: sp.Symbol(f"{name}{i}{j}")) for name in "abx")
    kron = sp.kronecker_product(B.T, A)
    require(is_zero(stack(A * X * B) - kron * stack(X)), "the printed order of entries is not that of stacked columns")
    require(not is_zero(stack((A * X * B).T) - kron * stack(X.T)), "stacking rows satisfies the column identity")
    require(list(stack(X)) == list(X.vec()), "the stacking order differs from SymPy's column stacking")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "the order col(r11, r21, r31, r12, ...) satisfies stack(AXB) = (B^T kron A) stack(X), which stacked rows do not; "
        "the printed listing steps from a_n1 to a_1n, the columns between are understood",
    )


def check_diffeomorphism() -> Finding:
    """Proposition 1: invertible linear map, immersion of SO(3), and a homomorphism for the transported product."""
    sp, system = load_sympy(), extended_system()
    linear = stack(system.attitude).jacobian(list(system.attitude))
    require(linear.det() in {1, -1}, "the map is not an invertible linear map")
    require(unstack(stack(system.attitude)) == system.attitude, "the inverse does not undo the map")
    ranks = set()
    for seed in range(3):
        first, second = (_rotation(seed + shift) for shift in (10, 20))
        joined = _bilinear_product(stack(first), stack(second))
        require(joined == stack(first * second), "stack(R R') differs from the product of the stacks")
        require(
            _bilinear_product(stack(first.T), stack(first)) == stack(sp.eye(3)), "stack(R^T) is not the inverse element"
        )
        ranks.add(sp.Matrix.hstack(*(stack(first * hat(axis)) for axis in sp.eye(3).columnspace())).rank())
    require(ranks == {3}, f"the tangent map has rank {ranks}, not 3")
    return Finding(
        Verdict.HOLDS,
        Method.EXACT,
        "linear with determinant 1 or -1, tangent map of rank 3, and stack(RR') = stack(R) * stack(R') at 3 random pairs "
        "with * the bilinear map of nine entries",
    )


def _rotation(seed: int) -> Any:
    """Return a random exact rotation."""
    return extended_system().attitude.xreplace(random_values(seed))


def _bilinear_product(a: Any, b: Any) -> Any:
    """Return the product on stacked entries without forming a matrix: (a * b)_{3j+i} = sum_k a_{3k+i} b_{3j+k}."""
    return load_sympy().Matrix([sum(a[3 * k + i] * b[3 * j + k] for k in range(3)) for j in range(3) for i in range(3)])


def check_product() -> Finding:
    """Eq. (5): the printed right side is a 3x3 matrix; a product on the image must return nine stacked entries."""

    def printed(a: Any, b: Any) -> Any:
        return unstack(a) * unstack(b)

    def corrected(a: Any, b: Any) -> Any:
        return stack(unstack(a) * unstack(b))

    first, second = _rotation(31), _rotation(32)

    def error_of(product: Callable[[Any, Any], Any]) -> Any:
        value = product(stack(first), stack(second))
        if value.shape != (9, 1):
            return abs(value.rows - 9)  # rows short of nine
        return size(value - stack(first * second))

    theirs = so3.product(np.array(stack(first), dtype=float), np.array(stack(second), dtype=float))
    require(
        witness.difference(stack(first * second), theirs) < witness.TOLERANCE, "the package's product is another one"
    )
    return misprint(
        error_of,
        printed=printed,
        corrected=corrected,
        method=Method.EXACT,
        evidence="as printed the product of two stacks is a 3x3 matrix, {printed} rows short of a stack, so * does not stay in its "
        "set; with the outer stack the error is {corrected}",
        correction="a * b := stack(unstack(a) unstack(b)): the outer (diamond) is missing",
    )


def check_stacked_rate() -> Finding:
    """Eq. (6): stack(R hat(Omega)) = (hat(Omega)^T kron I) Xi, linear in the nine coordinates."""
    sp, system = load_sympy(), extended_system()
    kron = sp.kronecker_product(hat(system.angular_velocity).T, sp.eye(3))
    require(is_zero(system.drift[6:15, 0] - kron * stack(system.attitude)), "Xi' is not (hat(Omega)^T kron I) Xi")
    require(is_zero(kron + kron.T), "the nine coordinates do not keep their length")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "Xi' = (hat(Omega)^T kron I) Xi with a skew 9x9 matrix, so |Xi|^2 = 3 is kept; linear in Xi, as 'simple' promises",
    )


CLAIMS = (
    Claim("(2)", "II", "R' = R hat(Omega)", check_attitude_rate),
    Claim("stacking", "II", "the map (diamond) stacks the columns of a matrix", check_stacking),
    Claim(
        "Proposition 1", "II", "(diamond) restricted to SO(3) is a diffeomorphism onto its image", check_diffeomorphism
    ),
    Claim("(5)", "II", "stack(R) * stack(R') := [unstack(stack(R))] [unstack(stack(R'))]", check_product),
    Claim("(6)", "II", "Xi' = stack(R hat(Omega))", check_stacked_rate),
)

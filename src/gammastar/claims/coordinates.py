"""Claims on the path and its lift to the state space: Assumption 1, Gamma and Gamma*, (10), (11), Lemmas 2 and 3."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gammastar.claims.claim import Claim, Finding, Method, Verdict, misprint, require
from gammastar.claims.symbols import (
    cayley,
    circle_outputs,
    circle_towers,
    extended_system,
    is_zero,
    load_sympy,
    random_values,
    size,
)


def circle_point() -> tuple[Any, Any]:
    """Return (t, point): all of the paper's circle but one point, as rational functions of t."""
    sp = load_sympy()
    t = sp.Symbol("t", real=True)
    return t, sp.Matrix([(1 - t**2) / (1 + t**2), 2 * t / (1 + t**2), 10])


def on_circle(expression: Any) -> Any:
    """Return an expression of position evaluated all along the paper's circle, as a rational function of t."""
    _, point = circle_point()
    values = dict(zip(extended_system().position, point, strict=True))
    return expression.subs(values, simultaneous=True).applyfunc(load_sympy().cancel)


def check_assumption() -> Finding:
    """Assumption 1: rank ds = 2 all along the paper's circle, by the Gram determinant; a figure of eight is excluded."""
    sp, system = load_sympy(), extended_system()
    gradients = sp.Matrix(circle_outputs(system)[:2]).jacobian(system.position)
    gram = on_circle(sp.Matrix([(gradients * gradients.T).det()]))[0]
    require(gram == 4, f"the Gram determinant of ds on the circle is {gram}, not 4")
    x1, x2, x3 = system.position
    eight = sp.Matrix([x2**2 - x1**2 * (1 - x1**2), x3]).jacobian(system.position)
    rank = eight.xreplace({x1: 0, x2: 0, x3: 0}).rank()
    require(rank == 1, f"ds of the figure of eight has rank {rank} at its crossing, not 1")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "for the path of section VI det(ds ds^T) = 4 all along the circle; it does exclude curves that cross themselves "
        "(rank 1 at the crossing of x2^2 = x1^2 (1 - x1^2))",
    )


def check_lifted_path() -> Finding:
    """Gamma: on it, ds1/dt is fixed by the velocity alone, so no input keeps a vehicle there that moves across the path."""
    sp, system = load_sympy(), extended_system()
    alpha, speed = circle_towers()[0][:2]
    moving_out = random_values(1, position=(1, 0, 10)) | dict(zip(system.velocity, (1, 0, 0), strict=True))
    require(alpha.xreplace(moving_out) == 0, "the state is not on Gamma")
    by_input = size(system.lie_inputs(alpha))

    def error_of(claimed_rate: Any) -> Any:
        return abs(speed.xreplace(moving_out) - claimed_rate) + by_input

    return misprint(
        error_of,
        printed=sp.Integer(0),
        corrected=2 * moving_out[system.velocity[0]],
        method=Method.EXACT,
        evidence="at (1, 0, 10) with v = (1, 0, 0), s1 leaves zero at {printed} per second whatever the input: from Gamma one can leave",
        correction="Gamma is not control invariant, i.e., a system on Gamma *can* leave it",
    )


def check_transverse_output() -> Finding:
    """Eq. (10): alpha depends on position alone, and another s with the same zero set has the same lift Gamma*."""
    sp, system = load_sympy(), extended_system()
    x1, x2, _ = system.position
    quadratic, distance = x1**2 + x2**2 - 1, sp.sqrt(x1**2 + x2**2) - 1
    require(is_zero(sp.expand((distance + 1) ** 2 - 1 - quadratic)), "the two functions have different zero sets")
    gradients = sp.Matrix([quadratic, distance]).jacobian(system.position)
    require(is_zero(gradients[0, :] - 2 * (distance + 1) * gradients[1, :]), "the gradients are not in the ratio 2 r")
    towers = system.tower(distance, 3)
    state = circular_motion()
    lifted = [size(level.xreplace(state)) for level in towers]
    require(max(lifted) == 0, f"a motion along the path has xi = {lifted} in distance coordinates")
    return Finding(
        Verdict.DEFINITION,
        Method.EXACT,
        "s1 = r^2 - 1 and s1 = r - 1 have gradients in the ratio 2 r, and both vanish with three derivatives along an exact "
        "circular motion: the choice of s changes xi off the path, not Gamma*",
    )


def circular_motion() -> dict[Any, Any]:
    """Return an exact state of a vehicle flying the paper's circle at 2 rad/s under g = 9.6 m/s^2, without biases.

    These two numbers make the thrust rational: |F|/m = sqrt(4^2 + 9.6^2) = 10.4.  From F = m (g e3 - chi''): R e3 = (5, 0, 12)/13
    after the heading (any), and from the jerk the rates p, q and zeta2; the yaw rate is free.
    """
    sp, system = load_sympy(), extended_system()
    omega, g = sp.Integer(2), sp.Rational(48, 5)
    values = random_values(5, position=(1, 0, 10)) | {
        system.gravity: g,
        system.bias_acceleration: 0,
        system.bias_torque: 0,
    }
    values |= dict(zip(system.velocity, (0, omega, 0), strict=True))
    m, zeta1 = values[system.mass], sp.Rational(52, 5) * values[system.mass]
    tilt = sp.Rational(1, 13) * sp.Matrix([[12, 0, 5], [0, 13, 0], [-5, 0, 12]])
    R = tilt * cayley([0, 0, sp.Rational(2, 3)])
    jerk = sp.Matrix([0, -(omega**3), 0])
    w = -m * R.T * jerk  # = (zeta1 q, -zeta1 p, zeta2)
    values |= dict(zip(system.attitude, R, strict=True))
    values |= {system.thrust: zeta1, system.thrust_rate: w[2]}
    return values | dict(zip(system.angular_velocity, (-w[1] / zeta1, w[0] / zeta1, sp.Rational(1, 2)), strict=True))


def check_path_following_manifold() -> Finding:
    """Eq. (11): a vehicle that flies along the circle must belong to Gamma*; with i = 4 in the list it does not."""
    system, state = extended_system(), circular_motion()
    towers = [[level.xreplace(state) for level in tower] for tower in circle_towers()[:2]]

    def error_of(orders: Sequence[int]) -> Any:
        return max(abs(tower[i]) for tower in towers for i in orders)

    finding = misprint(
        error_of,
        printed=range(5),
        corrected=range(4),
        method=Method.EXACT,
        evidence="on an exact flight along the circle L_f^i alpha = {corrected} for i = 0..3 but L_f^4 alpha = {printed}: the input, "
        "not the state, cancels it, so i = 4 throws motions along the path out of Gamma*",
        correction="i = 0, 1, 2, 3",
    )
    sp = load_sympy()
    rows = sp.Matrix.vstack(*(system.lie_inputs(tower[3]).xreplace(state) for tower in circle_towers()[:2]))
    require(rows.rank() == 2, "no input keeps L_f^3 alpha at zero, so Gamma* with i = 0..3 is not invariant")
    return finding


def check_triple_product() -> Finding:
    """Lemma 2: <v1, v2 x v3> is the determinant of the three vectors, and its square their Gram determinant."""
    sp = load_sympy()
    vectors = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"v{i + 1}{j + 1}", real=True))
    a, b, c = (vectors[i, :].T for i in range(3))
    triple = a.dot(b.cross(c))
    require(is_zero(triple - vectors.det()), "the triple product is not the determinant")
    require(is_zero(triple**2 - (vectors * vectors.T).det()), "its square is not the Gram determinant")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "<v1, v2 x v3> = det(v1, v2, v3) and its square is the Gram determinant, which vanishes for dependent vectors only",
    )


def check_span() -> Finding:
    """Lemma 3: alpha(sigma) = 0 gives <d alpha_i, sigma'> = 0, and then the Gram determinant splits into two nonzero factors."""
    sp, system = load_sympy(), extended_system()
    vectors = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"v{i + 1}{j + 1}", real=True))
    gram = vectors * vectors.T
    split = gram[:2, :2].det() * gram[2, 2]
    mixed = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"g{min(i, j)}{max(i, j)}"))
    orthogonal = {mixed[0, 2]: 0, mixed[1, 2]: 0}
    require(
        is_zero(mixed.xreplace(orthogonal).det() - mixed[:2, :2].det() * mixed[2, 2]),
        "the Gram determinant does not split",
    )
    require(not is_zero(gram.det() - split), "it splits without orthogonality, so the test sees nothing")
    t, point = circle_point()
    s = sp.Matrix(circle_outputs(system)[:2])
    require(is_zero(on_circle(s)), "the functions of section VI do not vanish on their circle")
    require(
        is_zero(on_circle(s.jacobian(system.position)) * point.diff(t)),
        "the gradients are not orthogonal to the tangent",
    )
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "s(sigma) = 0 makes sigma' orthogonal to both gradients, and then triple^2 = det(ds ds^T) |sigma'|^2, the product of the "
        "ranks assumed; both identities checked, the first on the circle of section VI",
    )


CLAIMS = (
    Claim("Assumption 1", "III", "gamma = s^-1(0) with rank ds = 2", check_assumption),
    Claim("Gamma", "IV", "Gamma is not control invariant, i.e., the system cannot leave the set", check_lifted_path),
    Claim("(10)", "IV", "alpha = s o h", check_transverse_output),
    Claim("(11)", "IV", "Gamma* = {L_f^i alpha = 0, i = 0, 1, 2, 3, 4}", check_path_following_manifold),
    Claim("Lemma 2", "IV", "<v1, v2 x v3> is nonzero for independent vectors", check_triple_product),
    Claim("Lemma 3", "IV", "d alpha1, d alpha2, sigma' span R^3 on the path", check_span),
)

"""Claims on the vector relative degree: (16), (17), the determinant (18), Lemma 4 and Remark 5."""

from __future__ import annotations

import functools
from typing import Any

from gammastar.claims import witness
from gammastar.claims.claim import Claim, Finding, Method, Verdict, misprint, require
from gammastar.claims.coordinates import circular_motion
from gammastar.claims.symbols import (
    circle_outputs,
    circle_towers,
    extended_system,
    generic_towers,
    is_zero,
    load_sympy,
    random_values,
    size,
)


def gradients(outputs: Any) -> Any:
    """Return the 3x3 matrix whose rows are the gradients of three functions of position."""
    return load_sympy().Matrix(list(outputs)).jacobian(extended_system().position)


def snap_inputs() -> Any:
    """Return B (3, 3): how (u_d, tau_p, tau_q) enter the snap, -(1/m) [R e3, -(zeta1/Jx) R e2, (zeta1/Jy) R e1]."""
    sp, system = load_sympy(), extended_system()
    R, (J_x, J_y, _) = system.attitude, system.inertia
    return -sp.Matrix.hstack(R[:, 2], -system.thrust / J_x * R[:, 1], system.thrust / J_y * R[:, 0]) / system.mass


@functools.cache
def circle_decoupling() -> Any:
    """Return D, Eq. (17), for the circle of section VI and beta = r, by Lie derivatives."""
    sp, system = load_sympy(), extended_system()
    rows = [system.lie_inputs(tower[3]) for tower in circle_towers()]
    return sp.Matrix.vstack(*rows, system.lie_inputs(system.angular_velocity[2]))


def check_relative_degree() -> Finding:
    """Eq. (16): L_{g_i} L_f^j vanishes identically for j = 0, 1, 2 for any function of position."""
    system = extended_system()
    for tower in generic_towers():
        for j in range(3):
            require(is_zero(system.lie_inputs(tower[j])), f"an input reaches derivative {j + 1} of an output")
        require(not is_zero(system.lie_inputs(tower[3])), "no input reaches the fourth derivative")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "L_g L_f^j = 0 for j = 0, 1, 2 and all four inputs, for three undefined functions of position and a free 3x3 matrix R, "
        "so everywhere and not only near x*; L_g L_f^3 does not vanish",
    )


def check_decoupling_matrix() -> Finding:
    """Eq. (17): for any path and beta, D = (gradients B, 0; 0, beta'/Jz); the package's D agrees for the paper's circle."""
    sp, system = load_sympy(), extended_system()
    by_lie = sp.Matrix.vstack(*(system.lie_inputs(tower[3]) for tower in generic_towers()))
    rows = gradients(tower[0] for tower in generic_towers())
    require(is_zero(by_lie - (rows * snap_inputs()).row_join(sp.zeros(3, 1))), "D is not gradients times B")
    worst = 0.0
    for seed in range(3):
        values = random_values(seed)
        worst = max(worst, witness.difference(circle_decoupling().xreplace(values), witness.decoupling(values)))
    require(worst < witness.TOLERANCE, f"the package's decoupling matrix differs by {worst:.2g} relative")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "D = (grad(alpha1, alpha2, pi) B, 0; 0, beta'/Jz) for every path, with B the snap's input matrix; the package's D for the "
        f"paper's circle agrees to {worst:.1e} (relative) at 3 random states",
        residual=worst,
    )


def determinant(along: Any, transverse: Any) -> Any:
    """Return the right side of (18), with `along` (3, 1) in the place of sigma' and beta = r."""
    system = extended_system()
    J_x, J_y, J_z = system.inertia
    first, second = (transverse[i, :].T for i in range(2))
    factor = system.thrust**2 / (J_x * J_y * J_z * system.mass**3) * system.attitude.det()
    return factor * (-first).dot(second.cross(along))


def check_determinant() -> Finding:
    """Eq. (18): identity for symbolic gradients with grad pi; with sigma' it is off by the ratio of the two."""
    sp, system = load_sympy(), extended_system()
    free = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"d{i + 1}{j + 1}", real=True))
    slope = sp.Symbol("beta_slope", real=True)
    D = sp.diag(free * snap_inputs(), slope / system.inertia[2])
    require(is_zero(D.det() - slope * determinant(free[2, :].T, free)), "(18) with grad pi fails for free gradients")

    here = random_values(8, position=(sp.Rational(6, 5), sp.Rational(8, 5), 9))  # two metres from the axis
    rows = gradients(circle_outputs(system))
    x1, x2, _ = system.position
    tangent = sp.Matrix([-x2, x1, 0]) / sp.sqrt(x1**2 + x2**2)  # sigma' at the nearest point of the unit circle
    D_here = circle_decoupling().xreplace(here).det()

    def error_of(along: Any) -> Any:
        return abs(determinant(along, rows).xreplace(here) / D_here - 1)

    finding = misprint(
        error_of,
        printed=tangent,
        corrected=rows[2, :].T,
        method=Method.SYMBOLIC,
        evidence="with grad pi an identity for free gradients, free R and general beta, sign included; with sigma', 2 m from the "
        "axis of the unit circle, off by {printed} relative",
        correction="grad pi in place of sigma', and beta'(r) for d beta/dx; on the path sigma' = |sigma'|^2 grad pi when "
        "pi is the parameter and |sigma'| grad pi when it is the arc length, so the two agree there for unit speed",
    )
    rho = sp.Symbol("rho", positive=True)
    on_path = {x1: rho * sp.Rational(3, 5), x2: rho * sp.Rational(4, 5)}
    ratio = (rho * tangent - rho**2 * rows[2, :].T).xreplace(on_path)
    require(is_zero(ratio), "on a circle of radius rho, sigma' is not |sigma'|^2 grad pi")
    return finding


def check_lemma_4() -> Finding:
    """Lemma 4: D has rank 4 on Gamma*, at exact motions along the circle; with (16) the relative degree is {4, 4, 4, 1}."""
    system, state = extended_system(), circular_motion()
    on_manifold = [size(level.xreplace(state)) for tower in circle_towers()[:2] for level in tower[:4]]
    require(max(on_manifold) == 0, "the state is not on Gamma*")
    D = circle_decoupling().xreplace(state)
    require(D.rank() == 4, "D loses rank on Gamma*")
    without_thrust = circle_decoupling().xreplace(state | {system.thrust: 0})
    require(without_thrust.rank() == 2, f"without thrust D has rank {without_thrust.rank()}, not 2")
    return Finding(
        Verdict.HOLDS,
        Method.EXACT,
        f"at an exact motion along the circle det D = {float(D.det()):.4g} with all conditions of (16) met; the assumption zeta1 > 0 "
        "is needed: at zeta1 = 0 the rank drops to 2",
    )


def check_remark_5() -> Finding:
    """Remark 5: D can lose rank off the path, so the guarantee is local; but it need not: on a helix it never does."""
    sp, system = load_sympy(), extended_system()
    x1, x2, x3 = system.position
    line = gradients((x2 + x2**2, x3, x1))  # zero set near the first axis: that axis
    require(line.xreplace({x2: 0}).det() != 0, "the gradients are dependent on the path itself")
    require(line.xreplace({x2: -sp.Rational(1, 2)}).det() == 0, "no rank is lost off the path")
    helix = gradients((x1 - sp.cos(x3), x2 - sp.sin(x3), x3)).det()
    require(sp.simplify(helix) == 1, "the helix has another triple product")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "local it is: for s1 = x2 + x2^2 the triple product vanishes half a metre off the path; 'only on Gamma*' is too modest, "
        "for s = (x1 - cos x3, x2 - sin x3), pi = x3 it is 1 everywhere",
    )


CLAIMS = (
    Claim("Lemma 4", "IV", "vector relative degree {4, 4, 4, 1} on Gamma*", check_lemma_4),
    Claim("(16)", "IV", "L_{g_i} L_f^j pi = L_{g_i} L_f^j alpha_k = 0 for j = 0, 1, 2", check_relative_degree),
    Claim("(17)", "IV", "decoupling matrix D of L_{g_i} L_f^3 and L_{g_i} beta", check_decoupling_matrix),
    Claim(
        "(18)",
        "IV",
        "det D = zeta1^2/(Jx Jy Jz m^3) (d beta/dx) det R <-d alpha1, d alpha2 x sigma'>",
        check_determinant,
    ),
    Claim("Remark 5", "IV", "Lemma 4 is local and valid only on Gamma*", check_remark_5),
)

"""Claims of section V: the internal dynamics, (27)-(29), Lemmas 8 and 9, and what takes the place of Lemma 8."""

from __future__ import annotations

from gammastar.claims.claim import Claim, Finding, Method, Verdict, require
from gammastar.claims.coordinates import circular_motion
from gammastar.claims.symbols import (
    cayley,
    extended_system,
    generic_towers,
    is_zero,
    load_sympy,
    random_values,
    size,
)
from gammastar.claims.transformation import circle_jacobian, internal_state, tangent_space


def check_internal_rates() -> Finding:
    """Eq. (27): L_f mu equals the printed right-hand sides."""
    sp, system = load_sympy(), extended_system()
    p, q, r = system.angular_velocity
    R = system.attitude
    first = [r * R[i, 1] - q * R[i, 2] for i in range(3)]
    second = [p * R[i, 2] - r * R[i, 0] for i in range(3)]
    exact = sp.Matrix([system.lie(function) for function in internal_state()])
    require(is_zero(exact - sp.Matrix([*first, *second, system.thrust_rate])), "a row of (27) is not L_f mu")
    return Finding(Verdict.HOLDS, Method.SYMBOLIC, "L_f mu gives all seven rows as printed, for a free 3x3 matrix R")


def check_one_angle() -> Finding:
    """Section V: on M the chains leave one angle, the heading about the thrust axis; (xi, eta) do not see it, zeta1 they fix.

    A turn by R -> R C, Omega -> C^T Omega with C about e3 changes neither L_f^i of any output of position (i = 0..3) nor r; the
    gradients of (xi, eta) have rank 13 on the 14 dimensions of M; and zeta1^2 = m^2 |g e3 - K_t - chi''|^2.
    """
    sp, system = load_sympy(), extended_system()
    turn = cayley([0, 0, sp.Symbol("w3", real=True)])
    turned = dict(zip(system.attitude, system.attitude * turn, strict=True))
    turned |= dict(zip(system.angular_velocity, turn.T * system.angular_velocity, strict=True))
    for tower in generic_towers():
        seen = sp.Matrix([level.subs(turned, simultaneous=True) - level for level in tower])
        require(is_zero(seen), "a turn about the thrust axis is seen by (xi, eta)")
    require(
        is_zero((turn.T * system.angular_velocity)[2] - system.angular_velocity[2]),
        "a turn about the thrust axis changes r",
    )
    states = [random_values(seed) for seed in range(2)] + [circular_motion()]
    chains = circle_jacobian()[:13, :] * tangent_space()
    ranks = {chains.xreplace(values).rank() for values in states}
    require(ranks == {13}, f"(xi, eta) have ranks {ranks} on M, not 13")
    acceleration = system.drift[3:6, 0]
    force = sp.Matrix([0, 0, system.gravity]) - system.bias_acceleration * sp.ones(3, 1) - acceleration
    excess = [size((system.mass**2 * force.dot(force) - system.thrust**2).xreplace(values)) for values in states]
    require(max(excess) == 0, "zeta1 is not |F|")
    return Finding(
        Verdict.HOLDS,
        Method.EXACT,
        "(xi, eta) have rank 13 of 14 on M at 3 exact states and are blind to a turn about R e3 (symbolic, any path): the internal "
        "dynamics is one angle on a circle, compact, and zeta1 = m |g e3 - K_t - chi''| is a function of (xi, eta)",
    )


def check_euler() -> Finding:
    """Eq. (28): without torque it keeps the energy and |J Omega|; it is (3) without K_r."""
    sp, system = load_sympy(), extended_system()
    omega, J = system.angular_velocity, sp.diag(*system.inertia)
    tau = sp.Matrix(sp.symbols("tau_p tau_q tau_r", real=True))
    momentum_rate = tau - omega.cross(J * omega)
    plant_rate = (J * (system.drift + system.inputs * sp.Matrix([0, *tau]))[15:18, 0]).xreplace({system.bias_torque: 0})
    require(is_zero(plant_rate - momentum_rate), "(28) is not (3) with K_r = 0")
    free = dict.fromkeys(tau, 0)
    require(is_zero(omega.dot(momentum_rate) - omega.dot(tau)), "the power is not Omega . tau")
    require(is_zero((J * omega).dot(momentum_rate).xreplace(free)), "|J Omega| is not kept without torque")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "it is (3) with K_r = 0; the energy changes by Omega . tau alone and without torque |J Omega| is constant: nothing decays",
    )


def check_lemma_8() -> Finding:
    """Lemma 8: a constant torque about a principal axis spins the body up without bound, and without torque no spin decays."""
    sp, system = load_sympy(), extended_system()
    t, torque = sp.symbols("t tau", positive=True)
    J = sp.diag(*system.inertia)
    spin = sp.Matrix([0, 0, torque * t / system.inertia[2]])
    balance = J * spin.diff(t) - sp.Matrix([0, 0, torque]) + spin.cross(J * spin)
    require(is_zero(balance), "the spin-up does not solve (28)")
    require(
        sp.limit(spin[2].xreplace({system.inertia[2]: sp.Rational(1, 50)}), t, sp.oo) == sp.oo, "the spin-up is bounded"
    )
    forever = sp.Matrix([0, 0, sp.Symbol("r0", positive=True)])
    require(is_zero(forever.cross(J * forever)), "a spin about a principal axis is no rest point of (28)")
    damping = sp.symbols("c1:4", positive=True)
    omega, tau = system.angular_velocity, sp.Matrix(sp.symbols("tau_p tau_q tau_r", real=True))
    damped = tau - omega.cross(J * omega) - sp.diag(*damping) * omega
    dissipated = sum(c * w**2 for c, w in zip(damping, omega, strict=True))
    require(is_zero(omega.dot(damped) - omega.dot(tau) + dissipated), "damping does not dissipate")
    return Finding(
        Verdict.FALSE,
        Method.SYMBOLIC,
        "Omega = (0, 0, tau t/Jz) solves (28) under the constant torque (0, 0, tau) and grows without bound; with tau = 0 any spin "
        "about a principal axis stays for ever",
        "input-to-state stable only with damping, where d(energy)/dt = Omega . tau - Omega^T C Omega; G4 does not need the lemma: "
        "the internal dynamics is one angle on a circle, see 'internal dynamics'",
    )


def check_lemma_9() -> Finding:
    """Lemma 9: the spin-up of Lemma 8 has bounded torque and unbounded mu_1'; what (xi, eta) bound is checked in its place."""
    sp, system = load_sympy(), extended_system()
    t = sp.Symbol("t", positive=True)
    yaw = t**2 / 2  # torque tau_r = Jz for all time
    R = sp.Matrix([[sp.cos(yaw), -sp.sin(yaw), 0], [sp.sin(yaw), sp.cos(yaw), 0], [0, 0, 1]])
    printed_rate = yaw.diff(t) * R[0, 1]  # (27) with q = 0
    require(sp.simplify(R[0, 0].diff(t) - printed_rate) == 0, "the spin-up does not obey (27)")
    grown = [abs(printed_rate.subs(t, sp.sqrt((4 * turns + 1) * sp.pi))) for turns in (0, 100, 10000)]
    require(grown[1] > 10 * grown[0] and grown[2] > 9 * grown[1], "mu_1' does not grow along the spin-up")
    r = system.angular_velocity[2]
    jerk = sp.Matrix([system.lie(rate) for rate in system.drift[3:6, 0]])
    for seed in range(3):
        values = random_values(seed)
        require(
            size((system.thrust_rate + system.mass * jerk.dot(system.attitude[:, 2])).xreplace(values)) == 0, "zeta2"
        )
        rates = [system.lie(function).xreplace(values) ** 2 for function in internal_state()[:6, 0]]
        tilt = (system.mass**2 * jerk.dot(jerk) / system.thrust**2).xreplace(values)
        require(max(rates) <= 2 * (tilt + values[r] ** 2), "the replacement bound on mu' fails")
    return Finding(
        Verdict.FALSE,
        Method.EXACT,
        f"under the constant torque (0, 0, Jz), |mu_1'| reaches {float(grown[2]):.0f} rad/s after 10,000 turns and has no "
        "bound; nor does a bounded zeta1 bound its rate zeta2, as the proof has it",
        "|mu_i| <= 1 for i = 1..6 holds with no hypothesis; with (xi, eta) bounded and zeta1 bounded away from zero, zeta1 = |F|, "
        "zeta2 = -m <R e3, jerk> and |mu_i'|^2 <= 2 (m^2 |jerk|^2/zeta1^2 + r^2) are bounded as well",
    )


def check_bound() -> Finding:
    """Eq. (29): the triangle inequality, in all sign cases, and |r_ij| <= 1 from the unit length of a row or column."""
    sp, system = load_sympy(), extended_system()
    a, b = sp.symbols("a b", positive=True)  # |r r12| and |q r13|
    gaps = {sp.expand((a + b) ** 2 - (sign_a * a - sign_b * b) ** 2) for sign_a in (1, -1) for sign_b in (1, -1)}
    require(gaps == {sp.Integer(0), 4 * a * b}, f"the gaps are {gaps}")
    mu_rate = system.lie(system.attitude[0, 0])
    _, q, r = system.angular_velocity
    require(
        is_zero(mu_rate - r * system.attitude[0, 1] + q * system.attitude[0, 2]), "mu_1' is another sum of products"
    )
    R = cayley(sp.Matrix(sp.symbols("w1:4", real=True)))
    require(is_zero(R[0, :].dot(R[0, :]) - 1), "a row of R has another length than one")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "(|r r12| + |q r13|)^2 - mu_1'^2 is 0 or 4 |r r12 q r13| in the four sign cases, never negative; rows of R have length one, "
        "so |r_ij| <= 1",
    )


CLAIMS = (
    Claim("(27)", "V", "mu_i' = r r_i2 - q r_i3, mu_{i+3}' = p r_i3 - r r_i1, mu_7' = zeta2", check_internal_rates),
    Claim("internal dynamics", "V", "the internal states mu in R^7 are bounded", check_one_angle),
    Claim("(28)", "V", "J Omega' = tau - Omega x J Omega", check_euler),
    Claim("Lemma 8", "V", "the system (28) is input-to-state stable", check_lemma_8),
    Claim("Lemma 9", "V", "bounded tau gives bounded mu_i' and mu_i, i = 1..7", check_lemma_9),
    Claim("(29)", "V", "|mu_1'| <= |r| |r12| + |q| |r13|", check_bound),
)

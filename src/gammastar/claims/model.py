"""Claims on the vehicle, its extension by two integrators and its output: (1), (3), (4), (7), (8), (9)."""

from __future__ import annotations

from typing import Any

from gammastar.claims import witness
from gammastar.claims.claim import Claim, Finding, Method, Verdict, misprint, require
from gammastar.claims.symbols import extended_system, hat, is_zero, load_sympy, random_values, size


def check_translation() -> Finding:
    """Eq. (1): the term K_t tested against what 'drag' and 'a constant' each predict."""
    sp, system = load_sympy(), extended_system()
    thrust_and_weight = sp.Matrix([0, 0, system.gravity]) - system.thrust / system.mass * system.attitude[:, 2]
    bias = system.drift[3:6, 0] - thrust_and_weight
    finding = misprint(
        lambda reading: reading(bias, system.velocity, system.bias_acceleration),
        printed=_drag_defect,
        corrected=_variation_with_motion,
        method=Method.SYMBOLIC,
        evidence="at v = -(1,1,1) m/s -K_t feeds in {printed} k_t W/kg, which no drag can; "
        "it varies with velocity by {corrected}, so jerk and snap are free of it",
        correction="K_t is a constant acceleration (it is not divided by m); drag is a separate force model",
    )
    jerk = sp.Matrix([system.lie(rate) for rate in system.drift[3:6, 0]])
    require(is_zero(jerk.diff(system.bias_acceleration)), "K_t enters the jerk although it is constant")
    return finding


def _drag_defect(bias: Any, motion: Any, size_symbol: Any) -> Any:
    """Return how much a load fails to be drag: the power it feeds into a motion against (1,1,1); a drag's is never positive."""
    power = (bias.T * motion)[0].xreplace(dict.fromkeys(motion, -1))
    return max(power / size_symbol, 0)


def _variation_with_motion(bias: Any, motion: Any, size_symbol: Any) -> Any:
    """Return how much a load changes with the motion: zero for a constant."""
    return sum(abs(entry) for entry in bias.jacobian(motion)) / size_symbol


def check_rotation() -> Finding:
    """Eq. (3): with (2), the world angular momentum R J Omega changes by R (tau - K_r), whatever the state."""
    sp, system = load_sympy(), extended_system()
    tau = sp.Matrix(sp.symbols("tau_p tau_q tau_r", real=True))
    J = sp.diag(*system.inertia)
    moves = system.drift + system.inputs * sp.Matrix([0, *tau])
    momentum = system.attitude * J * system.angular_velocity
    rate = sum((momentum.diff(x) * moves[i] for i, x in enumerate(system.state)), sp.zeros(3, 1))
    torque = tau - system.bias_torque * sp.ones(3, 1)
    require(is_zero(rate - system.attitude * torque), "the world angular momentum does not change by the torque")
    return Finding(
        Verdict.HOLDS,
        Method.SYMBOLIC,
        "d(R J Omega)/dt = R (tau - K_r) for all 12 entries of R and Omega; K_r is a constant torque here, see (4)",
    )


def check_extension() -> Finding:
    """Eq. (4): K_r tested like K_t, and the two integrators: snap has an invertible input matrix, acceleration has not."""
    sp, system = load_sympy(), extended_system()
    bias = system.drift[15:18, 0].multiply_elementwise(system.inertia)
    bias = bias + system.angular_velocity.cross(system.inertia.multiply_elementwise(system.angular_velocity))
    finding = misprint(
        lambda reading: reading(bias.applyfunc(sp.expand), system.angular_velocity, system.bias_torque),
        printed=_drag_defect,
        corrected=_variation_with_motion,
        method=Method.SYMBOLIC,
        evidence="at Omega = -(1,1,1) rad/s -K_r feeds in {printed} k_r W, which no drag can; it varies with the "
        "rates by {corrected}; the extension itself is right: snap has an input matrix of determinant -zeta1^2/(m^3 Jx Jy) on SO(3)",
        correction="K_t is a constant acceleration and K_r a constant torque; drag is a separate model",
    )
    undelayed = system.drift[3:6, 0].jacobian([system.thrust, *system.angular_velocity])
    require(
        undelayed.rank() == 1, "without the extension the inputs already reach acceleration in more than one direction"
    )
    snap_inputs = sp.Matrix.vstack(*(system.lie_inputs(system.lie(rate)) for rate in system.drift[3:6, 0]))
    R_det, (J_x, J_y, _) = system.attitude.det(), system.inertia
    expected = -(system.thrust**2) * R_det / (system.mass**3 * J_x * J_y)
    require(is_zero(snap_inputs[:, 0:3].det() - expected), "the snap's input matrix has another determinant")
    require(is_zero(snap_inputs[:, 3]), "the yaw torque reaches the snap")
    return finding


def check_full_dynamics() -> Finding:
    """Eq. (7): tangent to R^T R = I at exact rotations, and equal to the right-hand side the package flies."""
    sp, system = load_sympy(), extended_system()
    u = sp.Matrix([sp.Rational(3, 2), sp.Rational(-1, 5), sp.Rational(2, 7), sp.Rational(1, 3)])
    moves = system.drift + system.inputs * u
    gram = system.attitude.T * system.attitude
    gram_rate = sum((gram.diff(x) * rate for x, rate in zip(system.state, moves, strict=True)), sp.zeros(3, 3))
    worst = 0.0
    for seed in range(4):
        values = random_values(seed)
        require(size(gram_rate.xreplace(values)) == 0, "the flow of (7) leaves R^T R = I")
        theirs = witness.rates(values, [float(entry) for entry in u])
        worst = max(worst, witness.difference(moves.xreplace(values), theirs))
    require(worst < witness.TOLERANCE, f"the package's right-hand side differs from (7) by {worst:.2g} relative")
    return Finding(
        Verdict.HOLDS,
        Method.EXACT,
        f"tangent to SO(3) at 4 exact random states; the package's right-hand side agrees to {worst:.1e} (relative)",
        residual=worst,
    )


def check_output() -> Finding:
    """Eq. (8): with h = position, the output and three derivatives have rank 12, all of the state but the yaw motion."""
    sp, system = load_sympy(), extended_system()
    towers = [system.tower(x, 3) for x in system.position]
    jacobian = sp.Matrix([level for tower in towers for level in tower]).jacobian(system.state)
    ranks = {jacobian.xreplace(random_values(seed)).rank() for seed in range(3)}
    require(ranks == {12}, f"position and three derivatives have rank {ranks}, not 12")
    return Finding(
        Verdict.DEFINITION,
        Method.EXACT,
        "h(x) = chi has rank 3, and with its three Lie derivatives rank 12 at 3 random exact states: enough outputs for three "
        "chains of length 4",
    )


def check_controller_form() -> Finding:
    """Eq. (9): plant (1)-(3) closed with zeta' = A + B u, (u_t, tau) = C + D u gives exactly the extended system (7)."""
    sp, system = load_sympy(), extended_system()
    u = sp.Matrix(sp.symbols("u_d tau_p tau_q tau_r", real=True))
    A, B = sp.Matrix([system.thrust_rate, 0]), sp.Matrix([[0, 0, 0, 0], [1, 0, 0, 0]])
    C, D = sp.Matrix([system.thrust, 0, 0, 0]), sp.diag(0, 1, 1, 1)
    zeta_rate, wrench = A + B * u, C + D * u
    R, omega, J = system.attitude, system.angular_velocity, sp.diag(*system.inertia)
    e3, ones = sp.Matrix([0, 0, 1]), sp.ones(3, 1)
    plant = sp.Matrix(
        [
            system.velocity,
            system.gravity * e3 - wrench[0] / system.mass * R * e3 - system.bias_acceleration * ones,
            (R * hat(omega)).vec(),
            J.LUsolve(wrench[1:4, 0] - omega.cross(J * omega) - system.bias_torque * ones),
            zeta_rate,
        ]
    )
    require(is_zero(plant - system.drift - system.inputs * u), "(9) closed around (1)-(3) is not (7)")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "A = (zeta2, 0), B = (0; e1^T), C = (zeta1, 0), D = diag(0, 1, 1, 1) closed around (1)-(3) gives (7) in all 20 rows",
    )


CLAIMS = (
    Claim("(1)", "II", "v' = g e3 - (u_t/m) R e3 - K_t with K_t translational drag", check_translation),
    Claim("(3)", "II", "J Omega' = tau - Omega x J Omega - K_r", check_rotation),
    Claim("(4)", "II", "extended system with zeta1 = u_t, zeta2, u_d; K_t and K_r drag constants", check_extension),
    Claim("(7)", "II", "full dynamics in 20 coordinates on Q", check_full_dynamics),
    Claim("(8)", "II", "output y = h(x), the position of the centre of gravity", check_output),
    Claim("(9)", "III", "dynamic feedback zeta' = A + B u, (u_t, tau) = C + D u", check_controller_form),
)

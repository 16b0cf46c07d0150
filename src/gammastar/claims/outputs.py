"""Claims on the outputs along the path and about the thrust axis: the projection (12), (13), the yaw output (14), and (15)."""

from __future__ import annotations

import functools
import itertools
from typing import Any

from gammastar.claims import witness
from gammastar.claims.claim import Claim, Finding, Method, Verdict, misprint, require
from gammastar.claims.coordinates import on_circle
from gammastar.claims.symbols import (
    circle_outputs,
    extended_system,
    generic_towers,
    is_zero,
    load_sympy,
    random_values,
    size,
)

HIGHEST = 7  # curve derivatives that the test allows to enter; two more than are found to


@functools.cache
def curve_jet() -> tuple[Any, ...]:
    """Return symbols for (sigma, sigma', ..., sigma^(7)) at the nearest parameter, (3, 1) each."""
    sp = load_sympy()
    return tuple(sp.Matrix(sp.symbols(f"s{k}_1:4", real=True)) for k in range(HIGHEST + 1))


@functools.cache
def nearest_parameter(orders: int = 4) -> tuple[Any, ...]:
    """Return the time derivatives 1 ... orders of lambda(t) that solves <chi(t) - sigma(lambda), sigma'(lambda)> = 0.

    The equation is differentiated in time, each time solved for the newest derivative: an implicit differentiation that uses no
    series.  Position and its derivatives are x1.., v1.., a1.., j1.., k1.. .
    """
    sp, jet = load_sympy(), curve_jet()
    motion = motion_symbols()
    speeds = sp.symbols(f"l1:{orders + 2}", real=True)
    equation = (motion[0] - jet[0]).dot(jet[1])
    solved: list[Any] = []
    for order in range(orders):
        equation = _time_derivative(equation, motion, jet, speeds)
        slope = equation.diff(speeds[order])
        newest = -equation.xreplace({speeds[order]: sp.Integer(0)}) / slope
        require(is_zero(slope.diff(speeds[order])), "the newest derivative does not enter linearly")
        solved.append(newest)
    return tuple(solved)


@functools.cache
def motion_symbols() -> tuple[Any, ...]:
    """Return symbols for position to snap, (3, 1) each."""
    sp = load_sympy()
    return tuple(sp.Matrix(sp.symbols(f"{name}1:4", real=True)) for name in ("x", "v", "a", "j", "k"))


def _time_derivative(expression: Any, motion: tuple[Any, ...], jet: tuple[Any, ...], speeds: tuple[Any, ...]) -> Any:
    """Return the total time derivative: chi^(k) -> chi^(k+1), sigma^(k) -> sigma^(k+1) lambda', lambda^(k) -> lambda^(k+1)."""
    total = 0
    for now, then in itertools.pairwise(motion):
        total += sum(expression.diff(x) * rate for x, rate in zip(now, then, strict=True))
    for now, then in itertools.pairwise(jet):
        total += speeds[0] * sum(expression.diff(x) * rate for x, rate in zip(now, then, strict=True))
    return total + sum(expression.diff(x) * rate for x, rate in itertools.pairwise(speeds))


def check_projection() -> Finding:
    """Eq. (12): lambda' = <v, sigma'>/(|sigma'|^2 - <e, sigma''>), and on the circle the slope vanishes on the axis."""
    sp, jet, motion = load_sympy(), curve_jet(), motion_symbols()
    slope = jet[1].dot(jet[1]) - (motion[0] - jet[0]).dot(jet[2])
    require(is_zero(nearest_parameter(1)[0] - motion[1].dot(jet[1]) / slope), "the gradient of varpi is another one")
    angle, radius, distance = sp.symbols("theta rho d", positive=True)
    sigma = radius * sp.Matrix([sp.cos(angle), sp.sin(angle), 0])
    here = sigma.diff(angle).dot(sigma.diff(angle)) - (sigma * (distance / radius) - sigma).dot(sigma.diff(angle, 2))
    require(
        sp.simplify(here - radius * distance) == 0, "the slope on a circle is not radius times distance from the axis"
    )
    worst = _package_difference()
    require(worst < witness.TOLERANCE, f"the package's nearest parameter differs by {worst:.2g} relative")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "grad varpi = sigma'/(|sigma'|^2 - <e, sigma''>) for every curve; on a circle of radius rho at distance d from the axis "
        "the divisor is rho d, so uniqueness ends on the axis and nowhere else; the package's first four derivatives of the "
        f"nearest parameter agree to {worst:.1e} (relative) on a general jet",
        residual=worst,
    )


def _package_difference() -> float:
    """Return how far the package's derivatives of the nearest parameter are from the exact ones on a jet without symmetry."""
    sp, jet, motion = load_sympy(), curve_jet(), motion_symbols()
    values: dict[Any, Any] = dict(_sample())
    numbers = (sp.Rational(2 * k + 1, 3 + k % 4) * (-1) ** (k // 2) for k in range(99))
    values |= {symbol: next(numbers) for vector in (motion[0], jet[4], jet[5]) for symbol in vector}
    values |= dict.fromkeys(motion[4], sp.Integer(0))
    exact = []
    for speed, expression in zip(sp.symbols("l1:5", real=True), nearest_parameter(4), strict=True):
        values[speed] = expression.xreplace(values)
        exact.append(values[speed])
    numbers_of = [[[values[symbol] for symbol in vector] for vector in vectors] for vectors in (jet[:6], motion[:4])]
    return witness.difference(exact, witness.nearest_parameter(*numbers_of))


def check_smoothness() -> Finding:
    """After (12): which derivatives of the curve enter lambda'''' and hence the input."""
    sp, jet = load_sympy(), curve_jet()
    fourth = _fourth_at_sample()
    entering = {k: any(fourth.has(symbol) for symbol in jet[k]) for k in range(4, HIGHEST + 1)}
    error = motion_symbols()[0] - jet[0].xreplace(_sample())
    factors = [sp.cancel(fourth.diff(symbol)) for symbol in jet[5]]
    crossed = sp.Matrix(factors).cross(error)
    require(is_zero(crossed), "the factor of sigma^(5) is not along e")
    on_path = fourth.xreplace(dict(zip(motion_symbols()[0], jet[0].xreplace(_sample()), strict=True)))
    enters_on_path = [any(sp.cancel(on_path.diff(symbol)) != 0 for symbol in jet[k]) for k in (4, 5)]
    require(enters_on_path == [True, False], f"on the path sigma^(4), sigma^(5) enter: {enters_on_path}")

    def error_of(smoothness: int) -> int:
        return max((k - smoothness for k, enters in entering.items() if enters and k > smoothness), default=0)

    return misprint(
        error_of,
        printed=3,
        corrected=5,
        method=Method.EXACT,
        evidence="the fourth derivative of the path coordinate, which the law cancels, contains sigma^(4), and off the path "
        "sigma^(5) with the factor <e, sigma^(5)>: {printed} derivatives more than C^3 provides",
        correction="sigma of class C^5 (C^4 on the path alone): varpi is one class less smooth than sigma, and four of its "
        "derivatives are used",
    )


@functools.cache
def _sample() -> dict[Any, Any]:
    """Return rational values for the jet up to sigma''' and for the motion but its position, chosen by us without symmetry."""
    sp, jet, motion = load_sympy(), curve_jet(), motion_symbols()
    numbers = iter(sp.Rational(3 * k * k + 7 * k + 1, 2 + k % 5) * (-1) ** k for k in range(99))
    return {symbol: next(numbers) for vector in (*jet[:4], *motion[1:]) for symbol in vector}


@functools.cache
def _fourth_at_sample() -> Any:
    """Return lambda'''' with numbers for all but position and the curve's derivatives from the fourth on."""
    sp = load_sympy()
    speeds = sp.symbols("l1:5", real=True)
    values: dict[Any, Any] = dict(_sample())
    for speed, expression in zip(speeds, nearest_parameter(4), strict=True):
        values[speed] = expression.xreplace(values)
    return values[speeds[3]]


def check_path_output() -> Finding:
    """Eq. (13): on a curve, varpi(sigma(lambda)) advances with lambda, its gradient there being sigma'/|sigma'|^2."""
    sp, jet, motion = load_sympy(), curve_jet(), motion_symbols()
    along = dict(zip(motion[1], jet[1], strict=True))
    on_path = dict(zip(motion[0], jet[0], strict=True))
    rate = nearest_parameter(1)[0].subs({**on_path, **along}, simultaneous=True)
    require(is_zero(rate - 1), "moving with sigma' does not advance varpi at unit rate")
    x1, x2, _ = extended_system().position
    angle = sp.Matrix([sp.atan2(x2, x1)]).jacobian(extended_system().position)
    expected = sp.Matrix([[-x2, x1, 0]]) / (x1**2 + x2**2)
    require(is_zero(angle - expected), "the gradient of the angle is not tangent/distance")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "<grad pi, sigma'> = 1 on every regular curve, and for the circle grad pi = t/d at distance d from the axis",
    )


def check_heading_output() -> Finding:
    """Eq. (14): for a general beta(r) only the yaw torque reaches beta', with gain beta'(r)/Jz."""
    sp, system = load_sympy(), extended_system()
    r = system.angular_velocity[2]
    beta = sp.Function("beta")(r)
    row = system.lie_inputs(beta)
    require(is_zero(row - sp.Matrix([[0, 0, 0, beta.diff(r) / system.inertia[2]]])), "another input reaches beta'")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "L_g beta = (0, 0, 0, beta'(r)/Jz) for any smooth beta: relative degree 1 where beta' does not vanish; what the paper "
        "writes as d beta/dx is the scalar beta'(r)",
    )


def check_free_rates() -> Finding:
    """After (14): with v = R^T jerk, p = m v2/zeta1 and q = -m v1/zeta1, so the transverse and tangential chains fix p^2 + q^2."""
    sp, system = load_sympy(), extended_system()
    jerk = sp.Matrix([system.lie(rate) for rate in system.drift[3:6, 0]])
    p, q, _ = system.angular_velocity
    tilt = system.mass**2 * (jerk.dot(jerk) - jerk.dot(system.attitude[:, 2]) ** 2) / system.thrust**2
    rank_lost = set()
    for seed in range(3):
        values = random_values(seed)
        require(size((tilt - p**2 - q**2).xreplace(values)) == 0, "p^2 + q^2 is not the jerk across the thrust axis")
        rows = jerk.jacobian([p, q, system.thrust_rate]).xreplace(values)
        rank_lost.add(3 - rows.rank())
    require(rank_lost == {0}, "the jerk does not determine p, q and zeta2")
    third = sp.Matrix([tower[3] for tower in generic_towers()])
    require(not is_zero(third.jacobian([p, q])), "L_f^3 of the outputs is free of p and q")
    return Finding(
        Verdict.FALSE,
        Method.EXACT,
        "p^2 + q^2 = m^2 |jerk across R e3|^2 / zeta1^2 at 3 exact random states, and the jerk is a function of (xi, eta): at "
        "given heading both rates are prescribed by the path and the speed",
        correction="p and q are not free: (xi, eta) and the heading determine them; only the heading about the thrust axis is left over",
    )


def check_virtual_output() -> Finding:
    """Eq. (15): four outputs for four inputs, with independent gradients on the path."""
    sp, system = load_sympy(), extended_system()
    outputs = sp.Matrix([*circle_outputs(system), system.angular_velocity[2]])
    gradient = outputs.jacobian(system.state)
    gram = on_circle(sp.Matrix([(gradient * gradient.T).det()]))[0]
    require(gram == 4, f"the Gram determinant of the virtual output on the circle is {gram}, not 4")
    return Finding(
        Verdict.DEFINITION,
        Method.SYMBOLIC,
        "as many outputs as inputs, and their Gram determinant is 4 all along the circle of section VI: rank 4",
    )


CLAIMS = (
    Claim("(12)", "IV", "varpi(y) = arg inf |y - sigma(lambda)|", check_projection),
    Claim("smoothness", "IV", "varpi is as smooth as sigma, at least C^3", check_smoothness),
    Claim("(13)", "IV", "pi = varpi o h", check_path_output),
    Claim("(14)", "IV", "beta(r), smooth with d beta of rank 1", check_heading_output),
    Claim("free rates", "IV", "the body rates p and q are left to evolve freely", check_free_rates),
    Claim("(15)", "IV", "virtual output (alpha1, alpha2, pi, beta)", check_virtual_output),
)

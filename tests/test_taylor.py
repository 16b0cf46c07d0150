"""Truncated Taylor series: every rule against repeated automatic differentiation, and the laws that series obey."""

from __future__ import annotations

import functools
import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gammastar import taylor
from gammastar.errors import PathError
from gammastar.taylor import Series
from strategies import numbers, vectors

ORDER = 5
FORMULAS = {  # name: formula of x and y, both drawn from (0.2, 0.8), on which all of them are smooth
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y,
    "invert": lambda x, y: 1 / (x + y),
    "negate": lambda x, y: -(x * y),
    "twice": lambda x, y: 2 * (x - y),
    "square": lambda x, y: (x + y) ** 2,
    "square root": lambda x, y: ca.sqrt(x + y),
    "exponential": lambda x, y: ca.exp(x - 2 * y),
    "logarithm": lambda x, y: ca.log(x * y),
    "sine": lambda x, y: ca.sin(3 * x + y),
    "cosine": lambda x, y: ca.cos(3 * x + y),
    "tangent": lambda x, y: ca.tan(x + y / 2),
    "hyperbolic sine": lambda x, y: ca.sinh(x - y),
    "hyperbolic cosine": lambda x, y: ca.cosh(x + y),
    "hyperbolic tangent": lambda x, y: ca.tanh(x * y),
    "arc sine": lambda x, y: ca.asin(x * y),
    "arc cosine": lambda x, y: ca.acos(x * y),
    "arc tangent": lambda x, y: ca.atan(x / y),
    "arc tangent of two": lambda x, y: ca.atan2(y - 1, x - 1),
    "whole power": lambda x, y: (x + y) ** 7,
    "no power": lambda x, y: x**0 + y**1,
    "negative power": lambda x, y: x**-3 + y,
    "real power": lambda x, y: (x + y) ** 2.5,
    "power of both": lambda x, y: x**y,
    "power of a constant": lambda x, y: ca.SX(1.7) ** (x * y),
    "absolute value": lambda x, y: ca.fabs(x) + ca.fabs(y - 1),
    "smaller": lambda x, y: ca.fmin(x * x, y),
    "larger": lambda x, y: ca.fmax(x, y * y),
    "if less": lambda x, y: ca.if_else(x < y, x**3, ca.sin(y)),
    "if at most": lambda x, y: ca.if_else(x <= y, x * y, ca.cos(y)),
    "if equal": lambda x, y: ca.if_else(x == x * 1.0, ca.if_else(x == y, 0, x * y), 0),
    "if different": lambda x, y: ca.if_else(x != y, ca.exp(x * y), y),
    "if not": lambda x, y: ca.if_else(ca.logic_not(x < y), x * y, y * y * y),
    "if both": lambda x, y: ca.if_else(ca.logic_and(x < 0.5, y < 0.5), x * y, x + y * y),
    "if either": lambda x, y: ca.if_else(ca.logic_or(x < 0.4, y < 0.4), x * y, x + y * y),
    "nested": lambda x, y: ca.sin(ca.exp(x * y) / ca.sqrt(1 + ca.atan2(y, x) ** 2)) ** 3,
}


@functools.cache
def both_ways(name: str) -> tuple[ca.Function, ca.Function]:
    """Return series coefficients (2, 6) -> derivatives (6,): by the rules, and by differentiating again and again."""
    x, y, time = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("time")
    function = ca.Function("formula", [x, y], [FORMULAS[name](x, y)])
    coefficients = ca.SX.sym("coefficients", 2, ORDER + 1)
    series = [Series(tuple(ca.horzsplit(coefficients[i, :]))) for i in range(2)]
    by_rules = ca.vertcat(*taylor.through(function, series)[0].derivatives())
    arguments = [sum(coefficients[i, k] * time**k for k in range(ORDER + 1)) for i in range(2)]
    derivatives = [function(*arguments)]
    for _ in range(ORDER):
        derivatives.append(ca.jacobian(derivatives[-1], time))
    again = ca.substitute(ca.vertcat(*derivatives), time, ca.SX(0))
    return ca.Function("rules", [coefficients], [by_rules]), ca.Function("again", [coefficients], [again])


@pytest.mark.parametrize("name", FORMULAS)
@settings(max_examples=40)
@given(numbers(0.2, 0.8), numbers(0.2, 0.8), vectors(0.5, ORDER), vectors(0.5, ORDER))
def test_every_rule_is_repeated_differentiation(name: str, x: float, y: float, dx: np.ndarray, dy: np.ndarray) -> None:
    ties = (
        x - y,
        x - y * y,
        x * x - y,
        x - 0.5,
        y - 0.5,
        x - 0.4,
        y - 0.4,
    )  # where branches meet there is no derivative
    assume(min(abs(tie) for tie in ties) > 1e-6)
    by_rules, again = both_ways(name)
    coefficients = np.array([[x, *dx], [y, *dy]])
    expected = np.array(again(coefficients)).ravel()
    found = np.array(by_rules(coefficients)).ravel()
    # both lose some digits to cancellation between terms as large as the k-th derivative's natural size k! / 0.2^k
    scale = [math.factorial(k) / 0.2**k for k in range(ORDER + 1)]
    assert np.all(np.abs(found - expected) <= 1e-12 * np.maximum(np.abs(expected), scale))


def test_the_formulas_above_use_every_rule() -> None:
    used = set()
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    for formula in FORMULAS.values():
        function = ca.Function("formula", [x, y], [formula(x, y)])
        used |= {function.instruction_id(k) for k in range(function.n_instructions())}
    rules = set(taylor._UNARY) | set(taylor._BINARY) | taylor._SWITCHES | {ca.OP_IF_ELSE_ZERO, ca.OP_CONST}
    assert rules - used <= {ca.OP_ASSIGN}  # a copy, which CasADi leaves out of the graphs that it builds itself


@pytest.mark.parametrize("exponent", [0, 1, 2, 3, 6, 101])
def test_whole_powers_are_exact_at_base_zero(exponent: int) -> None:
    """(2 t)^p has the single coefficient 2^p at t^p; the recurrence for real powers would divide by zero."""
    x = ca.SX.sym("x")
    power = ca.Function("power", [x], [ca.power(x, exponent)])
    line = Series((ca.SX(0), ca.SX(2), *(ca.SX(0) for _ in range(5))))
    found = [float(c) for c in taylor.through(power, [line])[0].coefficients]
    assert found == [2.0**exponent if k == exponent else 0.0 for k in range(7)]


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        ("floor", ca.floor),
        ("ceil", ca.ceil),
        ("sign", ca.sign),
        ("erf", ca.erf),
        ("asinh", ca.asinh),
        ("fmod", lambda x: ca.fmod(x, 2)),
        ("copysign", lambda x: ca.copysign(x, -1)),
    ],
)
def test_an_operation_without_a_rule_is_refused_by_name(name, formula) -> None:
    x = ca.SX.sym("x")
    with pytest.raises(PathError, match=rf"differentiable operations \(got {name}\)"):
        taylor.through(ca.Function("formula", [x], [formula(x)]), [Series.constant(0.3, 2)])


def test_several_outputs_keep_their_order_and_untouched_ones_are_constant() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    function = ca.Function("several", [x, y], [x + y, ca.SX(3), y, x * y, ca.SX(0)])
    series = [Series((ca.SX(2), ca.SX(1), ca.SX(0))), Series((ca.SX(5), ca.SX(0), ca.SX(1)))]
    found = [[float(c) for c in output.coefficients] for output in taylor.through(function, series)]
    assert found == [[7, 1, 1], [3, 0, 0], [5, 0, 1], [10, 5, 2], [0, 0, 0]]


# --- laws of the series themselves -----------------------------------------------------------------------------------

coefficient_lists = st.lists(numbers(-2, 2), min_size=5, max_size=5)
positive_lists = coefficient_lists.map(lambda c: [0.5 + abs(c[0]), *c[1:]])


def series_of(values: list[float]) -> Series:
    return Series(tuple(ca.SX(value) for value in values))


def values_of(series: Series) -> np.ndarray:
    return np.array([float(value) for value in series.coefficients])


@given(coefficient_lists, coefficient_lists)
def test_products_and_sums_are_those_of_polynomials(a: list[float], b: list[float]) -> None:
    expected = np.convolve(a, b)[:5]
    assert values_of(series_of(a) * series_of(b)) == pytest.approx(expected, abs=1e-13)
    assert values_of(series_of(a) + series_of(b)) == pytest.approx(np.add(a, b), abs=0)
    assert values_of(series_of(a) - series_of(b)) == pytest.approx(np.subtract(a, b), abs=0)
    assert values_of(-series_of(a)) == pytest.approx(-np.array(a), abs=0)


@given(coefficient_lists, positive_lists)
def test_division_undoes_multiplication(a: list[float], b: list[float]) -> None:
    """The coefficients of 1/b grow as (4/0.5)^4 at most; rounding grows with them."""
    assert values_of(series_of(a) / series_of(b) * series_of(b)) == pytest.approx(a, abs=1e-11)


@given(positive_lists)
def test_inverse_functions_undo_each_other(a: list[float]) -> None:
    x = series_of(a)
    for undone in (x.sqrt().square(), x.log().exp(), x.exp().log(), x.power(1.7).power(1 / 1.7)):
        assert values_of(undone) == pytest.approx(a, abs=1e-10)


@given(coefficient_lists)
def test_sine_and_cosine_stay_on_their_conics(a: list[float]) -> None:
    sine, cosine = series_of(a).sin_cos()
    assert values_of(sine.square() + cosine.square()) == pytest.approx([1, 0, 0, 0, 0], abs=1e-11)
    sine, cosine = series_of(a).sin_cos(hyperbolic=True)
    assert values_of(cosine.square() - sine.square()) == pytest.approx([1, 0, 0, 0, 0], abs=1e-9)


@given(coefficient_lists)
def test_integration_undoes_differentiation(a: list[float]) -> None:
    x = series_of(a)
    assert values_of(x.rate().integrated_from(ca.SX(a[0]))) == pytest.approx(a, abs=1e-15)
    assert x.rate().order == x.order - 1


@given(coefficient_lists)
def test_coefficients_are_derivatives_over_factorials(a: list[float]) -> None:
    x = series_of(a)
    derivatives = [float(value) for value in x.derivatives()]
    assert derivatives == pytest.approx([c * math.factorial(k) for k, c in enumerate(a)], abs=0)
    assert values_of(Series.from_derivatives(x.derivatives())) == pytest.approx(a, abs=1e-15)


@given(vectors(2.0, 9), vectors(2.0, 9))
def test_the_inner_product_is_the_sum_of_products(a: np.ndarray, b: np.ndarray) -> None:
    first, second = (Series(tuple(ca.SX(c) for c in rows.reshape(3, 3))) for rows in (a, b))
    expected = sum(np.convolve(x, y)[:3] for x, y in zip(a.reshape(3, 3).T, b.reshape(3, 3).T, strict=True))
    assert values_of(first.dot(second)) == pytest.approx(expected, abs=1e-13)


def test_a_series_is_cut_after_the_lower_order_of_two() -> None:
    long, short = series_of([1, 2, 3, 4]), series_of([5, 6])
    for result in (long + short, long - short, long * short, long / short, short / long):
        assert result.order == 1
    assert values_of(long.truncated(2)).tolist() == [1, 2, 3]
    assert values_of(Series.constant(4.0, 2)).tolist() == [4, 0, 0]

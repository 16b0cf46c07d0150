"""Truncated Taylor series of graphs: how a function of position becomes a function of position, velocity, ..., snap.

A `Series` holds c_0 ... c_n with x(t) = sum c_k t^k; coefficients are `SX` of one shape (scalar or column).  `through`
pushes series through any scalar `SX` function by walking its instructions, so user formulas need no rewriting and no
repeated differentiation: the cost is quadratic in the order, not exponential.
Source of the recurrences: Griewank and Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, section 13.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from gammastar.errors import PathError


@dataclass(frozen=True, eq=False)
class Series:
    """Graph: a Taylor polynomial in time with `SX` coefficients (normalised: c_k is the k-th derivative over k!)."""

    coefficients: tuple[Any, ...]  # SX, all of one shape

    @property
    def order(self) -> int:
        """Return the highest power kept."""
        return len(self.coefficients) - 1

    @classmethod
    def from_derivatives(cls, derivatives: Sequence[Any]) -> Series:
        """Return the series of a function with these derivatives (value first) at zero."""
        return cls(tuple(value / math.factorial(k) for k, value in enumerate(derivatives)))

    @classmethod
    def constant(cls, value: Any, order: int) -> Series:
        """Return the series of a constant."""
        value = ca.SX(value)
        return cls((value, *(ca.SX(*value.shape) for _ in range(order))))

    def derivatives(self) -> tuple[Any, ...]:
        """Return value and derivatives at zero."""
        return tuple(value * math.factorial(k) for k, value in enumerate(self.coefficients))

    def rate(self) -> Series:
        """Return the series of the time derivative, one order lower."""
        return Series(tuple((k + 1) * value for k, value in enumerate(self.coefficients[1:])))

    def truncated(self, order: int) -> Series:
        """Return the series cut after a power."""
        return Series(self.coefficients[: order + 1])

    def __add__(self, other: Series) -> Series:
        return Series(tuple(a + b for a, b in zip(self.coefficients, other.coefficients, strict=False)))

    def __sub__(self, other: Series) -> Series:
        return Series(tuple(a - b for a, b in zip(self.coefficients, other.coefficients, strict=False)))

    def __neg__(self) -> Series:
        return Series(tuple(-a for a in self.coefficients))

    def __mul__(self, other: Series) -> Series:
        return self._convolved(other, lambda a, b: a * b)

    def __truediv__(self, other: Series) -> Series:
        a, b = self.coefficients, other.coefficients
        quotient: list[Any] = []
        for k in range(min(len(a), len(b))):
            quotient.append((a[k] - sum(quotient[i] * b[k - i] for i in range(k))) / b[0])
        return Series(tuple(quotient))

    def dot(self, other: Series) -> Series:
        """Return the series of the inner product of two column series."""
        return self._convolved(other, ca.dot)

    def _convolved(self, other: Series, multiply: Callable[[Any, Any], Any]) -> Series:
        a, b = self.coefficients, other.coefficients
        orders = range(min(len(a), len(b)))
        if self is other:  # every product of two different coefficients comes twice
            pairs = [[2 * multiply(a[i], a[k - i]) for i in range((k + 1) // 2)] for k in orders]
            squares = [[multiply(a[k // 2], a[k // 2])] * (k % 2 == 0) for k in orders]
            return Series(tuple(_total([*pairs[k], *squares[k]]) for k in orders))
        return Series(tuple(_total([multiply(a[i], b[k - i]) for i in range(k + 1)]) for k in orders))

    def square(self) -> Series:
        """Return the series of x^2."""
        return self * self

    def sqrt(self) -> Series:
        """Return the series of the square root; singular where the value is zero."""
        a = self.coefficients
        root = [ca.sqrt(a[0])]
        for k in range(1, len(a)):
            root.append((a[k] - sum(root[i] * root[k - i] for i in range(1, k))) / (2 * root[0]))
        return Series(tuple(root))

    def integrated_from(self, value: Any) -> Series:
        """Return the series whose rate is this one and whose value is given, one order higher."""
        return Series((value, *(c / (k + 1) for k, c in enumerate(self.coefficients))))

    def exp(self) -> Series:
        """Return the series of the exponential, from y' = y x'."""
        return self._by_rate(ca.exp(self.coefficients[0]), lambda y, x_rate: y * x_rate)

    def log(self) -> Series:
        """Return the series of the natural logarithm."""
        return (self.rate() / self).integrated_from(ca.log(self.coefficients[0]))

    def power(self, exponent: Any) -> Series:
        """Return the series of x^p for a constant p, from x y' = p y x'."""
        a = self.coefficients
        y = [ca.power(a[0], exponent)]
        for k in range(1, len(a)):
            y.append(sum((exponent * i - (k - i)) * a[i] * y[k - i] for i in range(1, k + 1)) / (k * a[0]))
        return Series(tuple(y))

    def sin_cos(self, hyperbolic: bool = False) -> tuple[Series, Series]:
        """Return the series of sine and cosine (or sinh and cosh), which need each other."""
        a = self.coefficients
        sine, cosine, sign = [ca.sin(a[0])], [ca.cos(a[0])], -1
        if hyperbolic:
            sine, cosine, sign = [ca.sinh(a[0])], [ca.cosh(a[0])], 1
        for k in range(1, len(a)):
            sine.append(sum(i * a[i] * cosine[k - i] for i in range(1, k + 1)) / k)
            cosine.append(sign * sum(i * a[i] * sine[k - i] for i in range(1, k + 1)) / k)
        return Series(tuple(sine)), Series(tuple(cosine))

    def tanh(self) -> Series:
        """Return the series of the hyperbolic tangent, from y' = (1 - y^2) x'; it stays finite where sinh and cosh do not."""
        return self._by_rate(ca.tanh(self.coefficients[0]), lambda y, x_rate: (_one(y) - y.square()) * x_rate)

    def _by_rate(self, value: Any, rate: Callable[[Series, Series], Series]) -> Series:
        """Return y with y(0) = value and y' = rate(y, x'), order by order."""
        y = Series((value,))
        for _ in range(self.order):
            y = rate(y, self.rate().truncated(y.order)).integrated_from(value)
        return y


def _total(terms: list[Any]) -> Any:
    result = terms[0]
    for term in terms[1:]:
        result = result + term
    return result


def _select(first: Series, second: Series, takes_first: Any) -> Series:
    pairs = zip(first.coefficients, second.coefficients, strict=True)
    return Series(tuple(ca.if_else(takes_first, a, b) for a, b in pairs))


def _power(base: Series, exponent: Series) -> Series:
    if not all(c.is_zero() for c in exponent.coefficients[1:]):
        return (exponent * base.log()).exp()
    p = exponent.coefficients[0]
    if not (p.is_constant() and float(p) >= 0 and float(p).is_integer()):
        return base.power(p)
    result, left = _one(base), int(float(p))  # by squaring: exact at base zero, where x^p has finite derivatives
    while left:
        result, base, left = (result * base if left % 2 else result), base * base, left // 2
    return result


def _atan2(y: Series, x: Series) -> Series:
    radius = x.square() + y.square()
    rate = (x * y.rate() - y * x.rate()) / radius
    return rate.integrated_from(ca.atan2(y.coefficients[0], x.coefficients[0]))


def _inverse(x: Series, value: Callable[[Any], Any], derivative: Callable[[Series], Series]) -> Series:
    """Return the series of a function given by its value and by its derivative as a series of x."""
    return (derivative(x) * x.rate()).integrated_from(value(x.coefficients[0]))


def _one(x: Series) -> Series:
    return Series.constant(1.0, x.order)


_UNARY: dict[int, Callable[[Series], Series]] = {
    ca.OP_ASSIGN: lambda x: x,
    ca.OP_NEG: lambda x: -x,
    ca.OP_EXP: Series.exp,
    ca.OP_LOG: Series.log,
    ca.OP_SQRT: Series.sqrt,
    ca.OP_SQ: Series.square,
    ca.OP_TWICE: lambda x: x + x,
    ca.OP_INV: lambda x: _one(x) / x,
    ca.OP_SIN: lambda x: x.sin_cos()[0],
    ca.OP_COS: lambda x: x.sin_cos()[1],
    ca.OP_TAN: lambda x: x.sin_cos()[0] / x.sin_cos()[1],
    ca.OP_SINH: lambda x: x.sin_cos(hyperbolic=True)[0],
    ca.OP_COSH: lambda x: x.sin_cos(hyperbolic=True)[1],
    ca.OP_TANH: Series.tanh,
    ca.OP_ATAN: lambda x: _inverse(x, ca.atan, lambda s: _one(s) / (_one(s) + s.square())),
    ca.OP_ASIN: lambda x: _inverse(x, ca.asin, lambda s: _one(s) / (_one(s) - s.square()).sqrt()),
    ca.OP_ACOS: lambda x: _inverse(x, ca.acos, lambda s: -(_one(s) / (_one(s) - s.square()).sqrt())),
    ca.OP_FABS: lambda x: _select(x, -x, x.coefficients[0] >= 0),
}

_BINARY: dict[int, Callable[[Series, Series], Series]] = {
    ca.OP_ADD: lambda x, y: x + y,
    ca.OP_SUB: lambda x, y: x - y,
    ca.OP_MUL: lambda x, y: x * y,
    ca.OP_DIV: lambda x, y: x / y,
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_ATAN2: _atan2,
    ca.OP_FMIN: lambda x, y: _select(x, y, x.coefficients[0] <= y.coefficients[0]),
    ca.OP_FMAX: lambda x, y: _select(x, y, x.coefficients[0] >= y.coefficients[0]),
}

_NAMES: dict[int, str] = {
    value: name.removeprefix("OP_").lower() for name, value in vars(ca).items() if name.startswith("OP_")
}

_SWITCHES = {ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR}


def through(function: Any, arguments: Sequence[Series]) -> tuple[Series, ...]:
    """Push scalar series through an `SX` function of scalar inputs and scalar outputs; return one series an output.

    Raises:
        PathError: The function uses an operation that has no Taylor rule here, such as floor or an external call.
    """
    order = arguments[0].order
    registers: dict[int, Series] = {}
    outputs = [Series.constant(0.0, order) for _ in range(function.n_out())]
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        reads, writes = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_INPUT:
            registers[writes[0]] = arguments[reads[0]]
        elif operation == ca.OP_OUTPUT:
            outputs[writes[0]] = registers[reads[0]]
        elif operation == ca.OP_CONST:
            registers[writes[0]] = Series.constant(function.instruction_constant(k), order)
        elif operation in _UNARY:
            registers[writes[0]] = _UNARY[operation](registers[reads[0]])
        elif operation in _BINARY:
            registers[writes[0]] = _BINARY[operation](registers[reads[0]], registers[reads[1]])
        elif operation in _SWITCHES:
            registers[writes[0]] = _switch(operation, [registers[r] for r in reads])
        elif operation == ca.OP_IF_ELSE_ZERO:
            condition, value = registers[reads[0]], registers[reads[1]]
            registers[writes[0]] = _select(value, Series.constant(0.0, order), condition.coefficients[0])
        else:
            raise PathError(
                f"a path formula must be built from differentiable operations (got {_NAMES[operation]}); "
                "use +, -, *, /, powers, sqrt, exp, log, trigonometry, hyperbolic functions, abs, min, max, if_else"
            )
    return tuple(outputs)


def _switch(operation: int, operands: list[Series]) -> Series:
    """Return a logical value as a piecewise constant series."""
    values = [operand.coefficients[0] for operand in operands]
    compare: dict[int, Callable[..., Any]] = {
        ca.OP_LT: lambda a, b: a < b,
        ca.OP_LE: lambda a, b: a <= b,
        ca.OP_EQ: lambda a, b: a == b,
        ca.OP_NE: lambda a, b: a != b,
        ca.OP_NOT: ca.logic_not,
        ca.OP_AND: ca.logic_and,
        ca.OP_OR: ca.logic_or,
    }
    return Series.constant(compare[operation](*values), operands[0].order)

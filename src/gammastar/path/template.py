"""A curve whose numbers are data: curves of one formula, such as circles of several radii, then share one graph.

The formula is read as it was written, with nothing simplified: zero, one and two are numbers like any others there, and a circle of
radius one about the origin has the template of every other.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import taylor
from gammastar.lookup import Lookup, Table, the_key
from gammastar.path.base import JET_ORDER
from gammastar.path.jet import Jet
from gammastar.path.parametric import ParametricPath
from gammastar.path.smoothness import may_bend
from gammastar.taylor import Series

POWERS = (ca.OP_POW, ca.OP_CONSTPOW)
MOST_KEPT = 64  # templates whose smoothness is known

_one_reader = threading.RLock()  # CasADi has one switch for all threads; a formula may make a curve of its own

Operand = int | float | None
"""What an instruction takes: a value by its number, an exponent, or None for the next number of the curve."""


class Template(NamedTuple):
    """A formula without its numbers; each use of a number is one of its own.  Value 0 is the parameter, instruction k makes value k."""

    instructions: tuple[tuple[int, tuple[Operand, ...]], ...]  # CasADi's operation, and what it takes
    results: tuple[Operand, ...]  # x, y, z
    size: int  # how many numbers

    def jet(self, place: Any, order: int) -> Jet:
        """Graph: return (sigma, sigma', ..., sigma^(order)), SX (3,) each, at a place: the parameter, then the numbers."""
        place = ca.SX(place)
        series = Series((place[0], ca.SX(1), *(ca.SX(0) for _ in range(order - 1))))
        numbers = [Series.constant(place[1 + k], order) for k in range(self.size)]
        coordinates = taylor.through(self.function(), [series, *numbers])
        return tuple(ca.vertcat(*rows) for rows in zip(*(each.derivatives() for each in coordinates), strict=True))

    @property
    def may_bend(self) -> bool:
        """Return whether a curve of this formula may be less than smooth somewhere."""
        return _may_bend(self)

    def function(self) -> Any:
        """Return the function (parameter, each of the numbers) -> x, y, z."""
        inputs = [ca.SX.sym("parameter"), *(ca.SX.sym("number") for _ in range(self.size))]
        values, numbers = inputs[:1], iter(inputs[1:])

        def given(operand: Operand) -> Any:
            if operand is None:
                return next(numbers)
            return ca.SX(operand) if isinstance(operand, float) else values[operand]

        for operation, operands in self.instructions:
            apply = ca.SX.unary if len(operands) == 1 else ca.SX.binary
            values.append(apply(operation, *map(given, operands)))
        return ca.Function("point", inputs, [given(result) for result in self.results])


def read(formula: Callable[[], Any]) -> tuple[Template, np.ndarray]:
    """Return the template and the numbers (n,) of what builds the function parameter -> x, y, z.

    Exponents that are whole or half stay in the template: such a power is a product or a root, with derivatives where others have none.
    """
    with _one_reader, _unsimplified():
        function = formula()
    held = dict[int, int | float]()  # in each of CasADi's slots: a value by its number, or a constant
    instructions, numbers = list[tuple[int, tuple[Operand, ...]]](), list[float]()
    results: list[int | float] = [0.0] * function.n_out()

    def lifted(operand: int | float) -> Operand:
        if isinstance(operand, int):
            return operand
        numbers.append(operand)
        return None

    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        reads, writes = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_INPUT:
            held[writes[0]] = 0
        elif operation == ca.OP_CONST:
            held[writes[0]] = float(function.instruction_constant(k))
        elif operation == ca.OP_OUTPUT:
            results[writes[0]] = held[reads[0]]
        else:
            first, *rest = (held[slot] for slot in reads)
            stays = operation in POWERS and isinstance(rest[0], float) and (2 * rest[0]).is_integer()
            instructions.append((operation, (lifted(first), *(rest if stays else map(lifted, rest)))))
            held[writes[0]] = len(instructions)
    ends = tuple(lifted(result) for result in results)
    return Template(tuple(instructions), ends, len(numbers)), np.array(numbers)


@contextmanager
def _unsimplified() -> Iterator[None]:
    """Let CasADi keep 0 + x and 1 x as they are: what it makes of a formula then depends on none of its numbers."""
    was = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(was)


@functools.lru_cache(MOST_KEPT)
def _may_bend(template: Template) -> bool:
    return may_bend(template.function())


@dataclass(frozen=True, eq=False)
class TemplateCurve(ParametricPath):
    """A curve with the numbers of its formula as data; made by `Curve.with_data`, which has checked it."""

    template: Template
    numbers: np.ndarray  # (n,)
    name: str
    period: float | None
    plane_normal: tuple[float, float, float] | None
    domain: tuple[float, float]
    ends: tuple[float, float] | None

    @property
    def graph_key(self) -> Hashable:
        """Return what names the path's graph: the template."""
        return self.template

    @functools.cached_property
    def lookups(self) -> tuple[Lookup, ...]:
        """Return the numbers, which are the same at every parameter."""
        return (Lookup(Table(np.zeros(1), self.numbers[None]), the_key),) if self.numbers.size else ()

    def jet(self, place: Any, order: int = JET_ORDER) -> Jet:
        """Graph: return (sigma, sigma', ..., sigma^(order)), SX (3,) each, at a place: the parameter, then the numbers."""
        return self.template.jet(place, order)

    def jets(self, parameters: np.ndarray, order: int = JET_ORDER) -> np.ndarray:
        """Return (n, order + 1, 3): point and derivatives with respect to the parameter, at parameters (n,)."""
        return self._sampled(np.atleast_1d(np.asarray(parameters, dtype=float)), order)

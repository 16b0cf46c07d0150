"""Mathematics as text: read by Python's own parser, checked node by node against a short list, and built as a graph.

Nothing is ever executed: a text becomes a tree, and whatever in it is not a number, a known name, an operator or a
known function is refused with its place.
"""

from __future__ import annotations

import ast
import functools
import math
import re
import sys
import unicodedata
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import casadi as ca

from gammastar.checks import number, shortened
from gammastar.errors import InputError, UnknownNameError

LONGEST = 2000  # characters of a text
DEEPEST = 100  # operations within each other; a sum of a hundred terms is that deep
LARGEST_POWER = 100  # as an exponent: higher ones are slips, and their derivatives take as many products
SHOWN = 40  # characters of a text that a message repeats, and of a name, which it lists
LAMBDA = "λ"  # `lambda` is a reserved word of the parser, and is read as this

CONSTANTS = {"pi": math.pi, "e": math.e, "tau": math.tau}
_ONE: dict[str, Callable[[Any], Any]] = {
    "abs": ca.fabs,
    "acos": ca.acos,
    "asin": ca.asin,
    "atan": ca.atan,
    "cos": ca.cos,
    "cosh": ca.cosh,
    "exp": ca.exp,
    "log": ca.log,
    "sin": ca.sin,
    "sinh": ca.sinh,
    "sqrt": ca.sqrt,
    "tan": ca.tan,
    "tanh": ca.tanh,
}
_TWO: dict[str, Callable[[Any, Any], Any]] = {"atan2": ca.atan2}
_MANY: dict[str, Callable[[Any, Any], Any]] = {"max": ca.fmax, "min": ca.fmin}
FUNCTIONS = sorted({**_ONE, **_TWO, **_MANY})
_OPERATORS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}


@dataclass(frozen=True, eq=False)
class Expression:
    """A formula in named variables: numbers, + - * / **, parentheses, pi, e, tau, and the functions of `FUNCTIONS`.

    log is the natural logarithm, angles are in radians, and `lambda` is the same name as λ.  abs, min and max bend
    where they switch: a path that switches there is not smooth.

    Raises:
        InputError: The text is no formula, has no finite value, or holds something that is not mathematics; with the
            piece and its column.
        UnknownNameError: A name or function is not among the known ones; likewise.
    """

    text: str
    variables: tuple[str, ...] = ()
    constants: Mapping[str, float] = field(default_factory=dict)  # further names with their values
    name: str = "the formula"  # how messages call it

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise InputError(f"{self.name} must be text (got {shortened(self.text)}); put the formula in quotes")
        object.__setattr__(self, "text", self.text.strip())
        self(*(ca.SX.sym(variable) for variable in self.variables))

    def __call__(self, *values: Any) -> Any:
        """Graph: return the formula at one SX for each variable."""
        return self._graph(self._tree, self._named(values), 0)

    def _named(self, values: tuple[Any, ...]) -> dict[str, Any]:
        """Return every name that stands for a value."""
        named: dict[str, Any] = dict(CONSTANTS)
        own = [(name, number(value, f"constant {shortened(name)}")) for name, value in self.constants.items()]
        for word, value in [*own, *zip(self.variables, values, strict=True)]:
            name = LAMBDA if word == "lambda" else unicodedata.normalize("NFKC", str(word))  # as the parser does
            if not name.isidentifier() or len(name) > SHOWN or name in named or name in FUNCTIONS:
                raise InputError(
                    f"a name of {self.name} must be a word of at most {SHOWN} letters that is not in use (got {shortened(word)}); "
                    "choose another"
                )
            named[name] = value
        return named

    def _graph(self, node: ast.expr, named: dict[str, Any], depth: int) -> Any:
        """Graph: return a node of the tree as SX; what holds no variable is a number at once, and must be finite."""
        if depth > DEEPEST:
            self._refuse(node, f"nest at most {DEEPEST} operations")

        def graph(part: ast.expr) -> Any:
            return self._graph(part, named, depth + 1)

        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                result = ca.SX(float(value) if value <= sys.float_info.max else math.inf)
            case ast.Name(id=name):
                result = self._value(node, name, named)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                result = graph(operand)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                result = -graph(operand)
            case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _OPERATORS:
                first, second = graph(left), graph(right)
                if isinstance(sign, ast.Pow) and second.is_constant() and abs(float(second)) > LARGEST_POWER:
                    self._refuse(node, f"keep exponents between -{LARGEST_POWER} and {LARGEST_POWER}")
                if isinstance(sign, ast.Div) and second.is_zero():
                    self._refuse(node, "divide by something other than zero")
                result = _OPERATORS[type(sign)](first, second)
            case ast.BinOp(op=ast.BitXor()):
                self._refuse(node, "write ** for a power")
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                self._check_function(node, name, named)
                result = self._called(node, name, [graph(argument) for argument in arguments])
            case ast.Call():
                self._refuse(node, "call functions by their name alone, and write * for a product")
            case _:
                self._refuse(node, "remove it")
        if result.is_constant() and not math.isfinite(float(result)):
            self._refuse(node, "it has no finite value, change its numbers")
        return result

    def _value(self, node: ast.Name, name: str, named: dict[str, Any]) -> Any:
        if name in FUNCTIONS:
            self._refuse(node, f"{name} is a function, write {name}(...)")
        if name not in named:
            known = ("lambda" if known == LAMBDA else known for known in named)
            raise UnknownNameError(f"the name at column {self._column(node)} of {self.name}", self._piece(node), known)
        return ca.SX(named[name])

    def _check_function(self, node: ast.Call, name: str, named: dict[str, Any]) -> None:
        if name in named:
            self._refuse(node, f"{self._piece(node.func)} is no function, write * for a product")
        if name not in FUNCTIONS:
            what = f"the function at column {self._column(node)} of {self.name}"
            raise UnknownNameError(what, self._piece(node.func), FUNCTIONS)

    def _called(self, node: ast.Call, name: str, arguments: list[Any]) -> Any:
        match len(arguments):
            case 1 if name in _ONE:
                return _ONE[name](*arguments)
            case 2 if name in _TWO:
                return _TWO[name](*arguments)
            case count if name in _MANY and count >= 2:
                return functools.reduce(_MANY[name], arguments)
        wanted = "one number" if name in _ONE else "two numbers" if name in _TWO else "two numbers or more"
        self._refuse(node, f"give {name} {wanted}")

    @functools.cached_property
    def _source(self) -> str:
        """The text as the parser reads it: of the same length, so that columns are those of the text."""
        if not 0 < len(self.text) <= LONGEST:
            raise InputError(
                f"{self.name} must be a formula of 1 to {LONGEST} characters (got {len(self.text)}); "
                f"{'shorten it' if self.text else 'write one'}"
            )
        return re.sub(r"\blambda\b", LAMBDA.ljust(len("lambda")), re.sub(r"\s", " ", self.text))

    @functools.cached_property
    def _tree(self) -> ast.expr:
        source = self._source
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about spellings that are refused below
                tree = ast.parse(source, mode="eval").body
        except SyntaxError as error:
            column = min(max(error.offset or 1, 1), len(source))
            raise InputError(
                f"{self.name} must be a formula (got {_shortened(self.text)!r}, unreadable at column {column}); "
                "check signs and parentheses, and write * for a product"
            ) from error
        except (ValueError, RecursionError, MemoryError) as error:
            raise InputError(
                f"{self.name} must be a formula (got {_shortened(self.text)!r}, too deep to be read, or binary); simplify it"
            ) from error
        if "#" in source:  # all that follows would be a remark, and silently lost
            raise InputError(
                f"{self.name} must be a formula (got '#' at column {source.index('#') + 1}); write remarks elsewhere"
            )
        return tree

    def _refuse(self, node: ast.expr, remedy: str) -> NoReturn:
        raise InputError(
            f"{self.name} must be made of numbers, known names and functions, + - * / ** and parentheses "
            f"(got {self._piece(node)!r} at column {self._column(node)}); {remedy}"
        )

    def _column(self, node: ast.expr) -> int:
        return self._index(node.col_offset) + 1

    def _piece(self, node: ast.expr) -> str:
        """Return the piece of the text that a node was read from."""
        first, last = self._index(node.col_offset), self._index(node.end_col_offset or 0)
        if self._source[last - 1] == LAMBDA != self.text[last - 1]:
            last += len("lambda") - 1  # the parser saw one letter and five blanks
        return _shortened(self.text[first:last])

    def _index(self, offset: int) -> int:
        """Return the index of a character whose offset the parser counts in bytes."""
        return len(self._source.encode()[:offset].decode())


def value_of(value: float | str, name: str, constants: Mapping[str, float] | None = None) -> float:
    """Return a finite number that may be written as a formula without variables, such as '2*pi'."""
    if isinstance(value, str):
        return float(Expression(value, constants=constants or {}, name=name)())
    return number(value, name)


def _shortened(text: str) -> str:
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."

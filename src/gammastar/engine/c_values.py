"""A value of a tape as a C expression, a number or a truth, with what it is made of named v and its number."""

from __future__ import annotations

import collections
import math
import re
from collections.abc import Mapping

from gammastar.engine.branches import Branch, Choice, Item
from gammastar.engine.tape import CONSTANT, INPUT, Tape

INDENT = "    "
SMALLEST_FLOAT, LARGEST_FLOAT = 1.1754944e-38, 3.4028234e38  # normal ones

# How a value is written, of operands as numbers (x, y) or as truths (s, t).
OPERATORS = {
    "add": "{x} + {y}",
    "sub": "{x} - {y}",
    "mul": "{x} * {y}",
    "div": "{x} / {y}",
    "neg": "-{x}",
    "sq": "{x} * {x}",
    "twice": "{x} + {x}",
    "inv": "{one} / {x}",
}
COMPARISONS = {"lt": "{x} < {y}", "le": "{x} <= {y}", "eq": "{x} == {y}", "ne": "{x} != {y}"}
PATTERNS = OPERATORS | COMPARISONS
CONNECTIVES = {"not": "negated({s})", "and": "both({s}, {t})", "or": "either({s}, {t})"}
TRUTHS = {*COMPARISONS, *CONNECTIVES}
ONE_COMPARISON = {"fmin": "lesser", "fmax": "greater"}  # what writes them where one operand is never NaN
KEEPING = ("neg", "fabs", "sq", "twice", "sign", "floor", "ceil")  # never NaN of what never is


def _is_inverted(divisor: float) -> bool:
    """Return whether a constant divisor is worth its inverse: compilers multiply by that of a power of two by themselves."""
    return 1e-290 < abs(divisor) < 1e290 and abs(math.frexp(divisor)[0]) != 0.5


def _never_nan(tape: Tape, choices: Mapping[int, Choice]) -> set[int]:
    """Return values that are not NaN whatever the arguments are."""
    found = set[int]()
    for k, (name, inputs, constant) in enumerate(tape.instructions):
        if name == CONSTANT:
            known = not math.isnan(constant)
        elif (choice := choices.get(k)) is not None:
            known = found.issuperset(side for side in (choice.first, choice.second) if side is not None)
        elif name in ONE_COMPARISON:
            known = not found.isdisjoint(inputs)
        else:
            known = name in TRUTHS or (name in KEEPING and inputs[-1] in found)
        if known:
            found.add(k)
    return found


class Writer:
    """Writes the values of one tape as C expressions."""

    def __init__(self, tape: Tape, real: str, lanes: int, choices: dict[int, Choice]) -> None:
        self.instructions, self.suffix, self.choices = tape.instructions, "f" if real == "float" else "", choices
        uses = collections.Counter(each.inputs[1] for each in tape.instructions if each.operation == "div")
        several = {value for value, count in uses.items() if count > 1 and value not in tape.constants}
        self.numbers = _never_nan(tape, choices) if lanes == 1 else set[int]()
        self.divisors = several | {v for v in uses if _is_inverted(tape.constants.get(v, 0.0))} if lanes > 1 else set()

    def line(self, value: int) -> str:
        """Return the statement that computes a value."""
        return f"const {self.kind(value)} v{value} = {self.expression(value)};"

    def branch(self, branch: Branch, outside: frozenset[int] = frozenset()) -> list[str]:
        """Return the statements of a branch: what outlives it is declared before it, if not farther outside already."""
        lines = [f"{self.kind(each)} v{each} = 0;" for each in branch.outlives if each not in outside]
        declared = outside.union(branch.outlives)
        blocks = tuple(self._block(items, declared) for items in branch.sides)
        for k in branch.choices:
            choice, is_or = self.choices[k], self.instructions[k].operation == "or"
            start = "" if choice.first is not None and choice.second is not None else f" = {int(is_or)}"
            if start or k not in outside:
                lines.append(f"{'' if k in outside else self.kind(k) + ' '}v{k}{start};")
            for block, side in zip(blocks, (choice.first, choice.second), strict=True):
                if side is not None:
                    block.append(f"v{k} = {self.truth(side) if self.is_truth(k) else self.number(side)};")
        truth, (first, second) = self.truth(branch.condition), blocks
        lines.append(f"if ({truth if first else f'negated({truth})'}) {{")
        lines.extend(INDENT + line for line in first or second)
        if first and second:
            lines.extend(["} else {", *(INDENT + line for line in second)])
        return [*lines, "}"]

    def _block(self, items: list[Item], declared: frozenset[int]) -> list[str]:
        """Return the statements of one side of a branch."""
        lines = list[str]()
        for item in items:
            if isinstance(item, Branch):
                lines.extend(self.branch(item, declared))
            else:
                lines.append(self.line(item) if item not in declared else f"v{item} = {self.expression(item)};")
        return lines

    def kind(self, value: int) -> str:
        """Return the type of a value."""
        return "truth" if self.is_truth(value) else "real"

    def by_inverse(self, value: int) -> bool:
        """Return whether a value is a quotient whose divisor's inverse is at hand: a vector division takes as long as twenty products."""
        name, inputs, _ = self.instructions[value]
        return name == "div" and inputs[1] in self.divisors

    def inverse(self, divisor: int) -> str:
        """Return the inverse of a divisor as C: a name, or the number itself."""
        each = self.instructions[divisor]
        return f"spread({self.literal(1 / each.constant)})" if each.operation == CONSTANT else f"r{divisor}"

    def is_truth(self, value: int) -> bool:
        """Return whether a value is a comparison or a connective."""
        return self.instructions[value].operation in TRUTHS

    def literal(self, value: float) -> str:
        """Return a constant that reads back as the same number."""
        if math.isnan(value):
            return "NAN"
        if self.suffix and value and math.isfinite(value):  # a guard against zero stays one
            value = math.copysign(min(max(abs(value), SMALLEST_FLOAT), LARGEST_FLOAT), value)
        text = "INFINITY" if math.isinf(value) else re.sub(r"e([+-])0", r"e\1", repr(abs(value))) + self.suffix
        return f"({'-'}{text})" if math.copysign(1.0, value) < 0 else text

    def operand(self, value: int) -> str:
        """Return a value as a number; a constant as its bare literal, which stands beside an operator only."""
        each = self.instructions[value]
        if each.operation == CONSTANT:
            return self.literal(each.constant)
        if each.operation == INPUT:
            return f"x{each.inputs[0]}[{each.inputs[1]}]"
        return f"number(v{value})" if self.is_truth(value) else f"v{value}"

    def number(self, value: int) -> str:
        """Return a value as a number of the type `real`."""
        text = self.operand(value)
        return f"spread({text})" if self.instructions[value].operation == CONSTANT else text

    def truth(self, value: int) -> str:
        """Return a value as a condition; NaN is true."""
        return f"v{value}" if self.is_truth(value) else f"is_true({self.number(value)})"

    def expression(self, value: int) -> str:
        """Return what computes a value."""
        name, inputs, _ = self.instructions[value]
        name = "pow" if name == "constpow" else name
        if self.by_inverse(value):
            return f"quotient({self.number(inputs[0])}, {self.number(inputs[1])}, {self.inverse(inputs[1])})"
        if (choice := self.choices.get(value)) is not None:
            sides = (
                self.literal(0.0) if side is None else self.operand(side) for side in (choice.first, choice.second)
            )
            return f"{self.truth(choice.condition)} ? {next(sides)} : {next(sides)}"
        if name in CONNECTIVES:
            return CONNECTIVES[name].format(**dict(zip("st", map(self.truth, inputs), strict=False)))
        if pattern := PATTERNS.get(name):
            texts = [self.operand(each) for each in inputs]
            if all(self.instructions[each].operation == CONSTANT for each in inputs):
                texts[0] = self.number(inputs[0])
            return pattern.format(**dict(zip("xy", texts, strict=False)), one=self.literal(1.0))
        if name == "if_else_zero":
            return f"real_if_else_zero({self.truth(inputs[0])}, {self.number(inputs[1])})"
        if name in ONE_COMPARISON and (known := self.numbers.intersection(inputs)):
            other, number = sorted(inputs, key=lambda each: each in known)
            return f"{ONE_COMPARISON[name]}({self.number(other)}, {self.number(number)})"
        return f"real_{name}({', '.join(self.number(each) for each in inputs)})"

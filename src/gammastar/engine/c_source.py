"""A tape as readable C: one function, one line a value; a value is a number, or a vector of numbers that lie in lanes side by side.

The lines are the same for both; what `real` and the functions are stands in a header before them, `c/scalar.h` or `c/lanes.h`.
"""

from __future__ import annotations

import functools
import importlib.resources
import re
from collections.abc import Iterable, Mapping, Sequence

from gammastar.engine.branches import Branch, Plan, branched
from gammastar.engine.c_values import INDENT, Writer
from gammastar.engine.tape import CONSTANT, INPUT, Tape
from gammastar.errors import InputError

REALS = ("double", "float")

OWN = ("if_else_zero", "fmin", "fmax", "sign")  # written by us for one lane too
IN_LANES = (
    *(*OWN, "fabs", "copysign", "sqrt", "floor", "ceil"),
    *("sin", "cos", "exp", "expm1", "log", "atan", "atan2"),
)
LIBRARY = (
    *("fabs", "copysign", "sqrt", "floor", "ceil", "fmod", "sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
    *("exp", "expm1", "log", "log1p", "pow", "hypot", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
)
OWN_LINE = re.compile(r"(?:static inline \w+|#define|typedef int) (\w+)")
CIRCULAR = {"sin", "cos"}  # in float written by us
OF_TWO = ("copysign", "fmod", "atan2", "pow", "hypot")


@functools.cache
def part(name: str) -> str:
    """Return the text of a file of `c/`."""
    return (importlib.resources.files("gammastar.engine") / "c" / name).read_text(encoding="utf-8")


def c_source(tape: Tape, name: str = "step", real: str = "double", lanes: int = 1) -> str:
    """Return a C file whose one function `name(x0, x1, ..., y0, ...)` computes the results of a tape from its arguments.

    Args:
        tape: From `tape_of`.
        name: Of the function.
        real: 'double', or 'float' for one lane.
        lanes: Numbers in a value.  Several take the vector extensions of gcc and clang; one is plain C99.
    """
    return c_file({name: tape}, real, lanes)


def c_file(
    tapes: Mapping[str, Tape],
    real: str = "double",
    lanes: int = 1,
    rest: str = "",
    of_rest: Sequence[str] = (),
    storage: str = "",
) -> str:
    """Return a C file of several functions by name, as `c_source` writes one, with what they take before them and a rest behind them.

    Args:
        tapes: Name -> tape.
        real: 'double', or 'float' for one lane.
        lanes: Numbers in a value.
        rest: C that goes with the functions.
        of_rest: Operations that the rest takes, as `real_floor` takes 'floor'.
        storage: Before each function, such as 'static '.
    """
    if real not in REALS or (real == "float" and lanes > 1) or lanes < 1:
        raise InputError(f"C is written in double, or in float for one lane (got {real}, {lanes} lanes); choose double")
    body = "".join(storage + _function(tape, name, real, lanes) for name, tape in tapes.items()) + rest
    operations = {each.operation for tape in tapes.values() for each in tape.instructions}
    return _head(operations.union(of_rest), real, lanes, body) + body


@functools.lru_cache(maxsize=64)
def _function(tape: Tape, name: str, real: str, lanes: int) -> str:
    """Return one function; a tape of thousands of values takes a tenth of a second to write."""
    arguments = [f"const real *restrict x{k}" for k in range(len(tape.sizes))]
    results = [f"real *restrict y{k}" for k in range(len(tape.outputs))]
    head = f"void {name}({', '.join(arguments + results)}) {{"
    read = {each.inputs[0] for each in tape.instructions if each.operation == INPUT}
    unused = [f"    (void)x{k};" for k in range(len(tape.sizes)) if k not in read]
    unused += [f"    (void)y{k};" for k, values in enumerate(tape.outputs) if not values]
    return "\n".join([head, *unused, *_lines(tape, real, lanes), "}", ""])


def _head(operations: Iterable[str], real: str, lanes: int, body: str) -> str:
    """Return what stands before the functions: the type, and what they take, for one lane no others."""
    names = sorted({"pow" if each == "constpow" else each for each in operations})
    if lanes == 1:
        suffix = "f" if real == "float" else ""
        circular = real == "float" and not CIRCULAR.isdisjoint(names)
        library = [name for name in names if name in LIBRARY and not (circular and name in CIRCULAR)]
        taken = [f"#define real_{name} {name}{suffix}" for name in library]
        own = _taken(part("scalar.h"), body) + _taken(part("circular.h"), body) * circular
        return "\n".join([f"typedef {real} real;", own + "\n".join([*taken, "", ""])])
    head = [f"#define LANES {lanes}", "typedef double real __attribute__((vector_size(8 * LANES)));", part("lanes.h")]
    missing = [name for name in names if name in LIBRARY and name not in IN_LANES]
    taken = [f"BY_LANE{'_OF_TWO' if name in OF_TWO else ''}({name})" for name in missing]
    return "\n".join([*head, *taken, ""])


def _taken(text: str, body: str) -> str:
    """Return a header without the lines whose names neither a body nor the lines kept behind them have, and without their comments."""
    kept = list[str]()
    for line in reversed(text.splitlines()):
        found = OWN_LINE.match(line)
        is_taken = not found or re.search(rf"\b{found[1]}\b", "\n".join([body, *kept]))
        is_of_nothing = line.startswith("/*") and kept[-1:] in ([], [""])
        is_second_gap = not line and kept[-1:] in ([], [""])
        if is_taken and not is_of_nothing and not is_second_gap:
            kept.append(line)
    return "\n".join([*reversed(kept), ""])


def _lines(tape: Tape, real: str, lanes: int) -> list[str]:
    """Return the statements, with each result stored as soon as it is known; with branches for one lane."""
    wanted = dict[int, list[str]]()
    for result, values in enumerate(tape.outputs):
        for entry, value in enumerate(values):
            wanted.setdefault(value, []).append(f"y{result}[{entry}]")
    items, choices = branched(tape) if lanes == 1 else Plan(list(range(len(tape.instructions))), {})
    lines, write, inverted = list[str](), Writer(tape, real, lanes, choices), set[int]()
    for item in items:
        made = item.choices if isinstance(item, Branch) else [item]
        if isinstance(item, Branch):
            lines.extend(write.branch(item))
        elif tape.instructions[item].operation not in (CONSTANT, INPUT):
            divisor = tape.instructions[item].inputs[-1]
            if write.by_inverse(item) and divisor not in inverted | tape.constants.keys():
                inverted.add(divisor)
                lines.append(f"const real {write.inverse(divisor)} = 1.0 / {write.operand(divisor)};")
            lines.append(write.line(item))
        lines.extend(f"{place} = {write.number(k)};" for k in made for place in wanted.pop(k, ()))
    lines.extend(f"{place} = {write.number(k)};" for k, places in wanted.items() for place in places)
    return [INDENT + line for line in lines]

"""A tape as readable Python: one function of arrays, one line a value, without branches, so that NumPy and JAX both run it."""

from __future__ import annotations

from gammastar.engine.c_values import PATTERNS, TRUTHS
from gammastar.engine.tape import CONSTANT, INPUT, OPERATIONS, Tape

CONNECTIVES = {"not": "xp.logical_not({s})", "and": "xp.logical_and({s}, {t})", "or": "xp.logical_or({s}, {t})"}


def python_source(tape: Tape, name: str = "step") -> str:
    """Return the text of a function `name(xp, x0, x1, ...)`, results (size, ...) of arguments (size, ...); `xp` is NumPy or `jax.numpy`.

    A name v is taken again as soon as its value has been used for the last time, so that many flights at once take little memory.
    """
    arguments = [f"x{k}" for k in range(len(tape.sizes))]
    lines = [f"def {name}({', '.join(['xp', *arguments])}):"]
    lines.append(f"    shape = xp.broadcast_shapes({', '.join(f'{each}.shape[1:]' for each in arguments)})")
    wanted = dict[int, list[str]]()
    for result, values in enumerate(tape.outputs):
        for entry, value in enumerate(values):
            wanted.setdefault(value, []).append(f"y{result}_{entry}")
    for value, each in enumerate(tape.instructions):
        if each.operation not in (CONSTANT, INPUT):
            lines.append(f"    v{tape.slots[value]} = {_expression(tape, value)}")
        lines.extend(f"    {place} = {_number(tape, value)}" for place in wanted.get(value, ()))
    for result, values in enumerate(tape.outputs):
        entries = ", ".join(f"xp.broadcast_to(y{result}_{entry}, shape)" for entry in range(len(values)))
        lines.append(f"    y{result} = {f'xp.stack([{entries}])' if values else 'xp.empty((0, *shape))'}")
    lines.append(f"    return {', '.join(f'y{result}' for result in range(len(tape.outputs)))},")
    return "\n".join([*lines, ""])


def _expression(tape: Tape, value: int) -> str:
    name, inputs, _ = tape.instructions[value]
    if name in CONNECTIVES:
        return CONNECTIVES[name].format(**dict(zip("st", (_truth(tape, each) for each in inputs), strict=False)))
    numbers = [_number(tape, each) for each in inputs]
    if name in PATTERNS:
        return PATTERNS[name].format(**dict(zip("xy", numbers, strict=False)), one="1.0")
    if name == "if_else_zero":
        return f"xp.where({_truth(tape, inputs[0])}, {numbers[1]}, 0.0)"
    return f"xp.{OPERATIONS[name].__name__}({', '.join(numbers)})"


def _number(tape: Tape, value: int) -> str:
    each = tape.instructions[value]
    if each.operation == CONSTANT:
        return repr(each.constant) if each.constant - each.constant == 0 else f"float('{each.constant}')"
    if each.operation == INPUT:
        return f"x{each.inputs[0]}[{each.inputs[1]}]"
    text = f"v{tape.slots[value]}"
    return f"xp.where({text}, 1.0, 0.0)" if each.operation in TRUTHS else text


def _truth(tape: Tape, value: int) -> str:
    """Return a value as a condition; NaN is true."""
    if tape.instructions[value].operation in TRUTHS:
        return f"v{tape.slots[value]}"
    return f"({_number(tape, value)} != 0)"

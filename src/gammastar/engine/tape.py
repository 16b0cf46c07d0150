"""A graph as a list of scalar instructions: what every back end but CasADi's own is emitted from, and NumPy's reading of it as a check.

Instruction k makes value k from earlier values, once; nothing is overwritten.  Where a value is kept while it is needed is told beside
the list: a slot is taken again as soon as its value has been used for the last time.
"""

from __future__ import annotations

import functools
import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.errors import InputError


def _truth(operation: Callable[..., Any]) -> Callable[..., Any]:
    """Return a comparison or a connective with one and zero for its answers."""
    return lambda *values: np.asarray(operation(*values), dtype=float)


# What CasADi's machine does with NaN: it is true as a condition, unlike everything, and passed over by fmin and fmax.
OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "sq": np.square,
    "twice": lambda x: x + x,
    "inv": lambda x: 1.0 / x,
    "sqrt": np.sqrt,
    "fabs": np.abs,
    "sign": np.sign,
    "copysign": np.copysign,
    "floor": np.floor,
    "ceil": np.ceil,
    "fmod": np.fmod,
    "fmin": np.fmin,
    "fmax": np.fmax,
    "lt": _truth(np.less),
    "le": _truth(np.less_equal),
    "eq": _truth(np.equal),
    "ne": _truth(np.not_equal),
    "not": _truth(np.logical_not),
    "and": _truth(np.logical_and),
    "or": _truth(np.logical_or),
    "if_else_zero": lambda condition, value: np.where(condition != 0, value, 0.0),
    "exp": np.exp,
    "expm1": np.expm1,
    "log": np.log,
    "log1p": np.log1p,
    "pow": np.power,
    "constpow": np.power,
    "hypot": np.hypot,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "asinh": np.arcsinh,
    "acosh": np.arccosh,
    "atanh": np.arctanh,
}
CONSTANT, INPUT = "constant", "input"


@functools.cache
def _names() -> dict[int, str]:
    """Return CasADi's name of every operation by its number: 1 -> 'add'."""
    names = (name for name in dir(ca) if name.startswith("OP_"))
    return {getattr(ca, name): name.removeprefix("OP_").lower() for name in names}


class Instruction(NamedTuple):
    """One scalar operation; its result is the value of the instruction's own number."""

    operation: str  # 'constant', 'input', or a name of `OPERATIONS`
    inputs: tuple[int, ...] = ()  # values that it takes; of an input, the argument and the entry of it
    constant: float = 0.0


@dataclass(frozen=True)
class Tape:
    """A function of dense arguments as scalar instructions; matrices are stacked column by column."""

    instructions: tuple[Instruction, ...]
    sizes: tuple[int, ...]  # numbers in each argument
    outputs: tuple[tuple[int, ...], ...]  # values that each result consists of
    slots: tuple[int, ...]  # where each value is kept; -1 for constants and inputs, which need no place

    @property
    def work(self) -> int:
        """Return the number of slots."""
        return max(self.slots, default=-1) + 1

    @property
    def operations(self) -> int:
        """Return the number of scalar operations, loads not counted."""
        return sum(slot >= 0 for slot in self.slots)

    @property
    def constants(self) -> dict[int, float]:
        """Return the values that are constants."""
        return {k: each.constant for k, each in enumerate(self.instructions) if each.operation == CONSTANT}

    def evaluate(self, *arguments: np.ndarray) -> list[np.ndarray]:
        """Return the results (size, ...) in plain NumPy, of arguments (size,) or (size, lanes); slow, and written to be checked against."""
        given = [np.asarray(each, dtype=float) for each in arguments]
        if [each.shape[0] for each in given] != list(self.sizes):
            raise InputError(
                f"the arguments must have {list(self.sizes)} rows (got {[each.shape[0] for each in given]}); "
                "stack matrices column by column"
            )
        lanes = np.broadcast_shapes(*(each.shape[1:] for each in given))
        results = [np.empty((len(values), *lanes)) for values in self.outputs]
        wanted = dict[int, list[tuple[int, int]]]()
        for result, values in enumerate(self.outputs):
            for entry, value in enumerate(values):
                wanted.setdefault(value, []).append((result, entry))
        work, constants = [np.empty(0)] * self.work, self.constants

        def value_of(number: int) -> Any:
            each = self.instructions[number]
            if each.operation == INPUT:
                return given[each.inputs[0]][each.inputs[1]]
            return constants[number] if each.operation == CONSTANT else work[self.slots[number]]

        with np.errstate(all="ignore"):
            for k, each in enumerate(self.instructions):
                if each.operation in OPERATIONS:
                    work[self.slots[k]] = OPERATIONS[each.operation](*map(value_of, each.inputs))
                for result, entry in wanted.get(k, ()):
                    results[result][entry] = value_of(k)
        return results


def tape_of(function: Any, outputs: tuple[int, ...] | None = None) -> Tape:
    """Return the instructions of a CasADi function, of the given outputs alone or of all of them.

    Functions that it calls are expanded first; what no output needs is left out.

    Raises:
        InputError: Something in the function is not a scalar operation known here.
    """
    symbols = [ca.SX.sym(f"x{k}", *function.size_in(k)) for k in range(function.n_in())]
    try:
        results = function.call(symbols, True, False)
    except RuntimeError as error:
        raise InputError(
            f"the graph must consist of scalar operations (got one that cannot be expanded, in {function.name()!r}); "
            "evaluate tables outside and pass what they hold in"
        ) from error
    chosen = range(len(results)) if outputs is None else outputs
    graph = ca.Function("tape", symbols, [ca.densify(results[k]) for k in chosen])
    ends = tuple([-1] * graph.numel_out(k) for k in range(graph.n_out()))
    held, instructions = [0] * graph.sz_w(), list[Instruction]()
    for each, inputs, places in _listed(graph):
        if each.operation == "output":
            ends[places[0]][places[1]] = held[inputs[0]]
            continue
        if each.operation not in (CONSTANT, INPUT):
            if each.operation not in OPERATIONS:
                raise InputError(
                    f"the graph must consist of {', '.join(OPERATIONS)} (got {each.operation!r}); write it with these"
                )
            each = each._replace(inputs=tuple(held[slot] for slot in inputs))
        held[places[0]] = len(instructions)
        instructions.append(each)
    outputs_of = tuple(map(tuple, ends))
    sizes = tuple(graph.numel_in(k) for k in range(graph.n_in()))
    return Tape(tuple(instructions), sizes, outputs_of, _slots(instructions))


def _listed(graph: Any) -> Iterator[tuple[Instruction, list[int], list[int]]]:
    """Yield an instruction with CasADi's own slots or places that it reads and writes."""
    for k in range(graph.n_instructions()):
        number = graph.instruction_id(k)
        name, inputs = _names().get(number, f"operation {number}"), graph.instruction_input(k)
        constant = graph.instruction_constant(k) if number == ca.OP_CONST else 0.0
        operation = CONSTANT if number == ca.OP_CONST else name
        taken = tuple(inputs) if operation == INPUT else ()
        yield Instruction(operation, taken, constant), inputs, graph.instruction_output(k)


def _slots(instructions: list[Instruction]) -> tuple[int, ...]:
    """Return the slot of each value: the lowest one whose value is not needed any more; results are copied out when they are made."""
    computed = [each.operation in OPERATIONS for each in instructions]
    last = {value: k for k, each in enumerate(instructions) if computed[k] for value in each.inputs}
    slots, free, count = [-1] * len(instructions), list[int](), 0
    for k, each in enumerate(instructions):
        if not computed[k]:
            continue
        for value in set(each.inputs):
            if computed[value] and last[value] == k:
                heapq.heappush(free, slots[value])
        if not free:
            heapq.heappush(free, count)
            count += 1
        slots[k] = heapq.heappop(free)
        if k not in last:  # a result only
            heapq.heappush(free, slots[k])
    return tuple(slots)

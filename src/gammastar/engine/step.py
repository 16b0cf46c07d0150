"""What an engine runs: one interval of a closed loop as a graph, with the numbers that it looks up and the random ones that it takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from gammastar.lookup import Lookup, graph_at


class Inputs(NamedTuple):
    """What a step is given; graphs."""

    state: Any  # (n,)
    parameters: Any  # (p,), constant over a flight
    column: Any  # (1 + 2 c,): the number of the step, and two uniform random numbers in (0, 1) for each channel


@dataclass(frozen=True, eq=False)
class Step:
    """One interval of a closed loop: (state, parameters, column) -> (next state, observation).

    Every machine runs it in its own way: the tables are looked up first, each at a variable that the inputs and the tables before it give,
    then the core is evaluated with their rows.
    """

    core: Any  # SX function (state (n,), parameters (p,), column (1 + 2 c,), rows (w,)) -> (next state (n,), observation (k,))
    lookups: tuple[Lookup, ...] = ()  # their keys are `Inputs`
    channels: tuple[int, ...] = ()  # numbers of the pairs of random numbers, c of them
    status: int | None = None  # entry of the state that is zero while the flight goes on

    @property
    def size(self) -> int:
        """Return how many numbers the state has."""
        return int(self.core.numel_in(0))

    def graph(self) -> Any:
        """Return the function (state, parameters, column) -> (next state, observation) with its tables bound."""
        if not self.lookups:
            symbols = [ca.SX.sym(name, self.core.size1_in(k)) for k, name in enumerate(Inputs._fields)]
            return ca.Function("step", symbols, list(self.core(*symbols, ca.SX(0, 1))))
        inputs = Inputs(*(ca.MX.sym(name, self.core.size1_in(k)) for k, name in enumerate(Inputs._fields)))
        return ca.Function("step", list(inputs), list(self.core(*inputs, graph_at(self.lookups, inputs))))

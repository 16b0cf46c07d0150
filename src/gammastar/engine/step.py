"""What an engine runs: one interval of a closed loop as a graph, with the numbers that it looks up and the random ones that it takes."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from gammastar.lookup import Lookup, Table, graph_at


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

    @property
    def widths(self) -> tuple[int, ...]:
        """Return how many numbers are looked up in each table."""
        return tuple(tables_of(lookup)[0].width for lookup in self.lookups)

    @property
    def is_shared(self) -> bool:
        """Return whether one set of tables serves all flights."""
        return all(isinstance(lookup.table, Table) for lookup in self.lookups)

    def of(self, flight: int) -> Step:
        """Return the step of one flight, where each flight has tables of its own."""
        if self.is_shared:
            return self
        own = [tables_of(lookup) for lookup in self.lookups]
        chosen = [tables[flight if len(tables) > 1 else 0] for tables in own]
        lookups = [lookup._replace(table=table) for lookup, table in zip(self.lookups, chosen, strict=True)]
        return dataclasses.replace(self, lookups=tuple(lookups))

    def without_observation(self) -> Step:
        """Return the same step with an empty observation, which then costs nothing."""
        symbols = [ca.SX.sym(name, self.core.size1_in(k)) for k, name in enumerate((*Inputs._fields, "rows"))]
        core = ca.Function("core", symbols, [self.core(*symbols)[0], ca.SX(0, 1)])
        return dataclasses.replace(self, core=core)

    def variables(self) -> Iterator[Any]:
        """Yield for each table the SX function (state, parameters, column, rows of the tables before) -> where to look."""
        inputs = Inputs(*(ca.SX.sym(name, self.core.size1_in(k)) for k, name in enumerate(Inputs._fields)))
        rows = ca.SX(0, 1)
        for lookup, width in zip(self.lookups, self.widths, strict=True):
            yield ca.Function("variable", [*inputs, rows], [ca.SX(lookup.variable(inputs, rows))])
            rows = ca.vertcat(rows, ca.SX.sym("rows", width))


def tables_of(lookup: Lookup) -> tuple[Table, ...]:
    """Return the tables of a lookup: one, or one for each flight."""
    return (lookup.table,) if isinstance(lookup.table, Table) else tuple(lookup.table)

"""What many flights leave behind: a column a number, the counts and quantiles of all, and the whole record of any."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gammastar.checks import whole
from gammastar.errors import InputError, SingularStartError, UnknownColumnError
from gammastar.flight.autopiloted import AutopilotLoop
from gammastar.flight.fly import Family, recorded
from gammastar.flight.loop import ClosedLoop
from gammastar.flight.phases import Phase
from gammastar.flight.record import FlightRecord
from gammastar.flight.reductions import columns_of
from gammastar.flight.summary import Summary
from gammastar.flight.task import Chance, Task
from gammastar.flight.variation import sizes_of
from gammastar.law import AnyReference, Law
from gammastar.vehicle import Scales, State, scaled

QUANTILES = {"min": 0.0, "5%": 0.05, "median": 0.5, "95%": 0.95, "max": 1.0}


@dataclass(frozen=True, eq=False, repr=False)
class Flights(Mapping[str, np.ndarray]):
    """Columns (n,) by name, in the order of the starts; NaN where there is nothing to tell.  Made by `fly_many`."""

    task: Task
    laws: tuple[Law, ...]  # one a flight, as they were given
    starts: tuple[State, ...]
    loops: tuple[ClosedLoop | AutopilotLoop | None, ...]  # None where a flight could not start
    numbers: np.ndarray  # (n,) of the flights, with which their noise goes
    seed: int
    steps: int
    flown: np.ndarray  # places of those that started
    firsts: np.ndarray  # (m, flown) states of the loop at their starts
    final: np.ndarray  # (1 + k, n) numbers of the statuses, and the measures at the end
    machine: str
    varied: tuple[str, ...] = ()  # names of what differs beside the starts
    parameters: np.ndarray = field(
        default_factory=lambda: np.empty((0, 0))
    )  # and its numbers (p, n), one below the other
    references: tuple[AnyReference, ...] = ()  # of every flight where each has its own
    records: dict[int, FlightRecord] = field(default_factory=dict)  # those asked for, by place

    @functools.cached_property
    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns (n,) by name, with units."""
        columns = {"flight": self.numbers}
        if not self.flown.size:
            return columns | columns_of(self.final, np.nan, np.nan, False)
        loop = self.loops[self.flown[0]]
        assert loop is not None
        scales: Any = 1.0
        if "mass_scale" in self.varied:
            scales = self._of("mass_scale")[0]
        return columns | columns_of(self.final, loop.truth.mass * scales, loop.interval, loop.is_ideal)

    def __repr__(self) -> str:
        """Return how many flights ended how; their numbers and loops fill pages."""
        names, counts = np.unique(self["status"], return_counts=True)
        told = ", ".join(f"{count} {name}" for name, count in zip(names, counts, strict=True))
        return f"<{len(self.starts)} flights: {told or 'none'}; columns {', '.join(self)}>"

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a column (n,).

        Raises:
            UnknownColumnError: There is none of this name.
        """
        if name not in self.columns:
            raise UnknownColumnError("column", name, self.columns)
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        """Go over the names of the columns."""
        return iter(self.columns)

    def __len__(self) -> int:
        """Return how many columns there are."""
        return len(self.columns)

    def summary(self) -> Summary:
        """Return how many flights ended how, and the quantiles of every number over the flights that tell it."""
        names, counts = np.unique(self["status"], return_counts=True)
        settled = int(np.isfinite(self["settling_time_s"][self["status"] == "completed"]).sum())
        values: dict[str, Any] = {
            "flights": len(self.starts),
            "status": dict(zip(names.tolist(), counts.tolist(), strict=True)),
            "settled": settled,
        }
        for name, column in self.columns.items():
            told = column[np.isfinite(column)] if column.dtype.kind == "f" else np.empty(0)
            if told.size:
                found = np.quantile(told, list(QUANTILES.values())).tolist()
                values[name] = dict(zip(QUANTILES, found, strict=True))
        return Summary(values)

    def record(self, place: int) -> FlightRecord:
        """Return the whole record of a flight by its place: it is flown again alone, on the same machine, with the same numbers.

        Raises:
            InputError: There is no such flight.
            SingularStartError: It could not start.
        """
        place = whole(place, "place of a flight")
        if place >= len(self.starts):
            raise InputError(
                f"place of a flight must be below their number {len(self.starts)} (got {place}); count from zero"
            )
        if place in self.records:
            return self.records[place]
        loop = self.loops[place]
        if loop is None:
            raise SingularStartError(
                f"a flight that is recorded must have started (got place {place}, whose law has no finite input at the start); "
                "take another one",
                {},
            )
        first = self.firsts[:, np.searchsorted(self.flown, place)]
        law, reference = self.laws[place], self.references[place] if self.references else self.task.reference
        phases = [Phase(0, law, reference)]
        chance = Chance(self.seed, int(self.numbers[place]))
        shown = self._alone(loop, place) if self.varied else loop
        task = dataclasses.replace(self.task, law=law, reference=reference)
        given = task, self.starts[place], shown, first, self.steps, phases, chance
        return recorded(*given, machine=self.machine, family=Family(loop.step(), self.parameters[:, place]))

    def _alone(self, loop: ClosedLoop | AutopilotLoop, place: int) -> ClosedLoop | AutopilotLoop:
        """Return the loop of a flight around the vehicle that really flew, to tell of it: it was flown as one of a family."""
        scales = {
            name: self._of(f"{name}_scale")[:, place] for name in Scales._fields if f"{name}_scale" in self.varied
        }
        numbers = {name: value if name == "inertia" else float(value[0]) for name, value in scales.items()}
        others = {"thrust_scale": "thrust", "lag_scale": "lag", "rate_bandwidth": "rate_bandwidth"}
        given = {to: float(self._of(name)[0, place]) for name, to in others.items() if name in self.varied}
        return loop.of(scaled(loop.truth, Scales(**numbers), **given))

    def _of(self, name: str) -> np.ndarray:
        """Return the numbers (k, n) of one of the things that differ."""
        loop = self.loops[self.flown[0]]
        assert loop is not None
        sizes = sizes_of(self.varied, loop.law)
        first = sum(size for other, size in list(sizes.items())[: self.varied.index(name)])
        return self.parameters[first : first + sizes[name]]

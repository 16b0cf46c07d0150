"""Flights of a campaign that are flown together: of one mission, and of one program."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.campaign.starts import PARTS, Starts
from gammastar.errors import GammastarError, InputError
from gammastar.flight.variation import given_quantities
from gammastar.frames import convert_vector
from gammastar.law import Law
from gammastar.law.latency import whole_intervals
from gammastar.mission import Mission
from gammastar.mission.campaign import Way, quantity
from gammastar.mission.complaint import within
from gammastar.vehicle import State

PROMPT = 1e-12  # [s], a latency that asks for an autopilot and takes no control interval


@dataclass(frozen=True, eq=False)
class Case:
    """Flights of one mission and of one program."""

    mission: Mission | GammastarError  # or why there is none
    places: np.ndarray  # (m,) of the flights among those asked for
    numbers: np.ndarray  # (m,) of the flights
    values: Mapping[str, np.ndarray]  # (m, ...) by quantity, of what varies within the program, in the mission's frame
    known: list[Law | InputError] | None = None  # their laws, where these have been made

    def starts(self) -> Starts:
        """Return where the flights begin."""
        assert isinstance(self.mission, Mission)
        given = {name: self.values[f"start.{name}"] for name in PARTS if f"start.{name}" in self.values}
        own, laws = self.mission.law(), self.laws or []
        paths = [(own if isinstance(law, InputError) else law).path for law in laws] or [own.path] * len(self.numbers)
        return Starts.of(self.mission, paths, **given)

    def given(self, chosen: np.ndarray) -> dict[str, Any]:
        """Return what `Mission.fly_many` takes of some of the flights beside starts, numbers and laws, in `ned`."""
        assert isinstance(self.mission, Mission)
        varied = {quantity(name).parameter: each[chosen] for name, each in self._by(Way.TRUTH).items()}
        if "wind" in varied:
            varied["wind"] = convert_vector(varied["wind"], self.mission.frame)
        speeds = [each[chosen] for each in self._by(Way.SPEED).values()]
        return {"varied": varied} | ({"speed": speeds[0]} if speeds else {})

    @functools.cached_property
    def laws(self) -> list[Law | InputError] | None:
        """Return the law of every flight, or why there is none; None where all have that of the mission.  Equal values share one."""
        assert isinstance(self.mission, Mission)
        if self.known is not None:
            return self.known
        tuning, made = self._by(Way.LAW), dict[str, Law | InputError]()
        rows = [
            dict(zip(tuning, row, strict=True))
            for row in zip(*(each.tolist() for each in tuning.values()), strict=True)
        ]
        for row in rows:
            if repr(row) not in made:
                made[repr(row)] = _law(self.mission, row)
        return [made[repr(row)] for row in rows] if tuning else None

    def by_program(self) -> Iterator[Case]:
        """Yield the flights by the programs that their paths take; those without a law are with the first."""
        laws = self.laws or []
        keys = [None if isinstance(law, InputError) else (law.path.graph_key, law.path.ends is None) for law in laws]
        first, of = next(filter(None, keys), None), dict[Any, list[int]]()
        for k, key in enumerate(keys):
            of.setdefault(key or first, []).append(k)
        if len(of) <= 1:
            yield self
            return
        for own in of.values():
            values = {name: each[own] for name, each in self.values.items()}
            yield Case(self.mission, self.places[own], self.numbers[own], values, [laws[k] for k in own])

    def begun(self, places: Starts) -> list[State | InputError]:
        """Return the state in which each flight begins, or why a look at its law, its numbers and its start refuses it."""
        every, states = np.arange(len(self.numbers)), list[State | InputError]()
        try:
            self.require_possible(every)
            states += places.states(every)
        except InputError:
            states = [self._begun(places, every[k : k + 1]) for k in every]
        laws = self.laws or states
        return [law if isinstance(law, InputError) else state for law, state in zip(laws, states, strict=True)]

    def _begun(self, places: Starts, one: np.ndarray) -> State | InputError:
        try:
            self.require_possible(one)
            return places.states(one)[0]
        except InputError as error:
            return error

    def require_possible(self, chosen: np.ndarray) -> None:
        """Raise `InputError` where numbers of what really flies in some flights cannot be."""
        assert isinstance(self.mission, Mission)
        with within("[truth]"):
            self.mission.require_possible(given_quantities(self.given(chosen)["varied"], len(chosen)))

    def alone(self) -> Mission:
        """Return the only flight as a mission of its own: the same to rounding, since no number in it is one of many."""
        assert isinstance(self.mission, Mission)
        changes = {name: each.tolist()[0] for name, each in self.values.items() if quantity(name).way is not Way.START}
        return self.mission.with_values(
            {"start": self.starts().section(0), **changes, "flight.number": int(self.numbers[0])}
        )

    def _by(self, way: Way) -> dict[str, np.ndarray]:
        return {name: each for name, each in self.values.items() if quantity(name).way is way}


def parted(kinds: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the distinct rows of an array (n, k), each with the places in which it is."""
    found, of = np.unique(kinds, axis=0, return_inverse=True)
    for k, kind in enumerate(found):
        yield kind, np.flatnonzero(of.ravel() == k)


def programs(values: Mapping[str, np.ndarray], interval: float, count: int) -> np.ndarray:
    """Return what tells apart the programs of flights with values (n,), (n, k): first a latency [s] that stands for theirs.

    Latencies are rounded up to whole control intervals [s], and what is below all of them is prompt; those that cannot be stay.
    """
    latency = np.full(count, PROMPT)
    if "truth.latency" in values:
        given = values["truth.latency"].astype(float)
        latency = np.where(given > 0, np.maximum(whole_intervals(given, interval) * interval, PROMPT), given)
    zeros = [each == 0 for name, each in values.items() if quantity(name).zero_is_apart]
    return np.stack([latency, *zeros], axis=1).astype(float)


def _law(mission: Mission, values: Mapping[str, Any]) -> Law | InputError:
    """Return the law of a mission with other values of its tuning, or why there is none."""
    try:
        return mission.retuned(values)
    except InputError as error:
        return error

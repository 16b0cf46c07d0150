"""Flights in which tunings are tried: the same ones for every candidate, all candidates at once."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gammastar.campaign.setting import Setting
from gammastar.campaign.space import Candidate
from gammastar.errors import GammastarError, MissionError
from gammastar.law import Law
from gammastar.mission import Mission
from gammastar.mission.choices import Grid
from gammastar.vehicle import State

OTHERS = 10  # times the flights of a search judge what it has found: they are flown for two tunings alone
TUNED = ("controller", "observer", "integral", "approach")  # sections of a mission that must not vary beside the tuning


class Batch(NamedTuple):
    """Flights of one mission."""

    mission: Mission
    places: np.ndarray  # (m,) of the flights among all
    numbers: np.ndarray  # (m,) of the flights
    starts: list[State]
    laws: list[Law]
    given: Mapping[str, Any]  # what `Mission.fly_many` takes beside, `varied` and `speed`


@dataclass(frozen=True, eq=False)
class Trials:
    """The flights of some numbers of a mission's campaign, to be flown by laws of many tunings.

    Raises:
        GammastarError: A flight cannot be built, or the campaign varies what is tuned.
    """

    mission: Mission
    numbers: range
    seed: int
    machine: str = "auto"
    workers: int | None = None

    def __post_init__(self) -> None:
        campaign = self.mission.file.campaign
        for name in () if campaign is None else campaign.distributions(self.mission.quantities):
            if name.split(".")[0] in TUNED:
                raise MissionError(
                    f"a mission that is tuned must vary what surrounds its law (got {name}); leave it out of [campaign]",
                    name,
                )

    def fly(
        self, candidates: Sequence[Candidate], progress: Callable[[float], None] | None = None
    ) -> list[dict[str, np.ndarray]]:
        """Return the columns (n,) of the flights of every candidate; progress is called with the share that is done.

        Chance goes with the number of a flight, so every candidate meets the same.
        """
        tried, count = len(candidates), len(self.numbers)
        columns, done = dict[str, np.ndarray](), 0
        for batch in self._batches:
            size = len(batch.numbers)

            def told(steps: int, total: int, done: int = done, size: int = size) -> None:
                assert progress is not None
                progress((done + size * steps / total) / count)

            flown = batch.mission.fly_many(
                batch.starts * tried,
                [law for candidate in candidates for law in _tuned(candidate, batch.laws)],
                **_tiled(batch.given, tried),
                flights=np.tile(batch.numbers, tried).tolist(),
                seed=self.seed,
                machine=self.machine,
                workers=self.workers,
                progress=None if progress is None else told,
            )
            for name, column in flown.columns.items():
                whole = columns.setdefault(name, np.empty((tried, count), dtype=column.dtype))
                if column.dtype.itemsize > whole.dtype.itemsize:  # of texts, whose longest is not known before
                    whole = columns[name] = whole.astype(column.dtype)
                whole[:, batch.places] = column.reshape(tried, size)
            done += size
        return [{name: column[k] for name, column in columns.items()} for k in range(tried)]

    @functools.cached_property
    def _batches(self) -> list[Batch]:
        numbers = np.array(self.numbers)
        if self.mission.file.campaign is None:
            given = [self.mission.start()] * len(numbers), [self.mission.law()] * len(numbers), dict[str, Any]()
            return [Batch(self.mission, np.arange(len(numbers)), numbers, *given)]
        setting = Setting(self.mission, self.seed)
        batches = list[Batch]()
        for case in setting.cases(numbers, setting.sample(numbers)):
            if isinstance(case.mission, GammastarError):
                raise case.mission
            every = np.arange(len(case.numbers))
            case.require_possible(every)
            laws = list[Law]()
            for law in case.laws or [case.mission.law()] * len(every):
                if isinstance(law, GammastarError):
                    raise law
                laws.append(law)
            starts = case.starts().states(every)
            batches.append(Batch(case.mission, case.places, case.numbers, starts, laws, case.given(every)))
        return batches


def _tuned(candidate: Candidate, laws: list[Law]) -> list[Law]:
    """Return the laws of flights with a tuning."""
    found = {id(law): candidate.law(law) for law in {id(law): law for law in laws}.values()}
    return [found[id(law)] for law in laws]


def _tiled(given: Mapping[str, Any], times: int) -> dict[str, Any]:
    """Return values (m, ...) of flights, by name, one after the other for so many candidates."""
    return {
        name: _tiled(each, times) if isinstance(each, Mapping) else np.concatenate([each] * times)
        for name, each in given.items()
    }


def flights_of(mission: Mission, count: int) -> tuple[range, range | None]:
    """Return the numbers of the flights to search with, and of `OTHERS` times as many to judge by; fewer or none where there are no more.

    Without chance a mission has one flight, and one whose campaign goes through grids alone has those of all combinations: then they recur.
    """
    file, most = mission.file, (1 + OTHERS) * count
    has_gusts = file.wind is not None and file.wind.gusts is not None
    varied = () if file.campaign is None else file.campaign.distributions(mission.quantities).values()
    counts = [len(each.choices) for each in varied if isinstance(each, Grid)]
    if file.noise is None and file.sensors is None and not has_gusts and len(counts) == len(varied):
        most = min(most, math.prod(counts))
    seen = min(count, most)
    return range(seen), range(seen, most) or None

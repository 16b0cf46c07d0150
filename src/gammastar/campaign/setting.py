"""What the flights of a campaign are: for each its mission, its start, and what really flies, from the seed and its number alone."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from operator import getitem
from typing import Any

import numpy as np

from gammastar.campaign.case import PROMPT, Case, parted, programs
from gammastar.campaign.effect import require_effect, serves
from gammastar.campaign.sample import sampled
from gammastar.campaign.starts import AXES, PARTS
from gammastar.checks import LARGEST
from gammastar.errors import GammastarError, MissionError
from gammastar.law import Law
from gammastar.mission import Mission
from gammastar.mission.campaign import ALONG, Way, quantity
from gammastar.mission.changes import PATH, changed
from gammastar.mission.choices import Choice, Grid
from gammastar.mission.distributions import Distribution
from gammastar.mission.mission import read

MOST_MISSIONS = 128  # kept at a time
SHAPING = (PATH, "reference", "integral")  # sections that say what can be data


@dataclass(frozen=True, eq=False)
class Setting:
    """A mission with [campaign], and a seed.

    Raises:
        MissionError: The mission has no [campaign], or one whose lists and grids do not fit it.
        InputError: Something varies that makes no difference.
    """

    mission: Mission
    seed: int

    def __post_init__(self) -> None:
        if self.mission.file.campaign is None:
            raise MissionError(
                "a campaign must have a mission with [campaign] (got one without); say in [[campaign.vary]] what varies",
                "campaign",
            )
        for name, choices in self._lists.items():
            for choice in choices:  # what cannot be read is refused now; what cannot be flown is told in its row
                read(self._values({name: choice}))
        require_effect(self.base, self.data)

    @functools.cached_property
    def base(self) -> Mission:
        """Return the mission with neutral values where flights have their own."""
        mission = _built(self, (), PROMPT)  # the very one that flies, so that its graphs are built once
        if isinstance(mission, GammastarError):
            raise mission
        return mission

    @functools.cached_property
    def varied(self) -> Mapping[str, Distribution]:
        """Return the distributions of all that varies, by quantity."""
        assert self.mission.file.campaign is not None
        return self.mission.file.campaign.distributions(self.mission.quantities)

    @functools.cached_property
    def data(self) -> list[str]:
        """Return the quantities that are data for one program, of those that vary."""
        return [name for name in self.varied if name in self.mission.quantities and name not in self._changes]

    @functools.cached_property
    def _serving(self) -> frozenset[str]:
        """The quantities that can be data for the program of the mission, and of each that choices for its path or reference make of it."""
        files, known = [self.mission.file], self.mission.quantities
        for name, each in self.varied.items():
            if isinstance(each, Choice | Grid) and name not in known and name.split(".")[0] in SHAPING:
                files += [read(self._values({name: choice})) for choice in each.choices]
        return frozenset(name for name in self.varied if name in known and all(serves(file, name) for file in files))

    @functools.cached_property
    def _numbers(self) -> Mapping[str, np.ndarray]:
        """The choices (k, ...) of lists and grids that are numbers of one shape for a quantity that is data."""
        found, known = dict[str, np.ndarray](), self.mission.quantities
        for name, distribution in self.varied.items():
            if isinstance(distribution, Choice | Grid) and name in self._serving:
                choices = _as_array(distribution.choices)
                if choices is not None and choices.shape[1:] in set(known[name].shapes) - {ALONG}:
                    found[name] = choices
        return found

    @functools.cached_property
    def _lists(self) -> Mapping[str, Any]:
        """The choices of all other lists and grids."""
        lists = {name: each for name, each in self.varied.items() if isinstance(each, Choice | Grid)}
        return {name: each.choices for name, each in lists.items() if name not in self._numbers}

    @functools.cached_property
    def _changes(self) -> Mapping[str, Any]:
        """Those choices of which each makes another mission, since they are not tunings of one law."""
        return {
            name: choices
            for name, choices in self._lists.items()
            if name not in self._serving or quantity(name).way is not Way.LAW
        }

    def sample(self, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values of all that varies, (n, ...) by quantity, in the mission's frame; of what makes another mission, places."""
        assert self.mission.file.campaign is not None
        found = sampled(self.varied, numbers, self.seed, self.mission.file.campaign.sampling)
        return {name: self._numbers[name][each] if name in self._numbers else each for name, each in found.items()}

    def cases(self, numbers: np.ndarray, values: Mapping[str, np.ndarray]) -> Iterator[Case]:
        """Yield flights with sampled values by the missions and programs that they need."""
        within = {name: self._objects(name)[each] if name in self._lists else each for name, each in values.items()}
        kinds = np.stack([np.zeros(len(numbers), dtype=int), *(values[name] for name in self._changes)], axis=1)
        for kind, chosen in parted(kinds):
            changes = tuple(int(place) for place in kind[1:])
            mission, own = _built(self, changes, PROMPT), {name: within[name][chosen] for name in self.data}
            if isinstance(mission, GammastarError):
                yield Case(mission, chosen, numbers[chosen], own)
                continue
            for (latency, *_), part in parted(programs(own, mission.interval, len(chosen))):
                places, values = chosen[part], {name: each[part] for name, each in own.items()}
                case = Case(_built(self, changes, float(latency)), places, numbers[places], values)
                yield from [case] if isinstance(case.mission, GammastarError) else case.by_program()

    def nominal(self, count: int) -> dict[str, Any]:
        """Return what `Mission.fly_many` takes of some flights of the mission itself, flown by the program of those that vary."""
        mission, ways = self.base, {quantity(name).way for name in self.data}
        own = {"truth.rate_bandwidth": mission.truth().rate_bandwidth}
        if Way.SPEED in ways:
            own["reference.speed"] = mission.values()["reference"]["speed"]
        neutral = {name: quantity(name).neutral or own.get(name) for name in self.data}
        values = {name: np.array([value] * count) for name, value in neutral.items() if value is not None}
        every = np.arange(count)
        laws = {"laws": [self._nominal_law()] * count} if Way.LAW in ways else {}
        return {**Case(mission, every, every, values).given(every), **laws}

    def _nominal_law(self) -> Law:
        """Return the law of the mission, along its path by numbers that are data if they are of those that vary."""
        given: Any = {PATH: self.base.file.path.model_dump()}
        names = [name for name in self.data if name.startswith(f"{PATH}.")]
        return self.base.retuned({name: functools.reduce(getitem, name.split("."), given) for name in names})

    def columns(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the columns (n,) that tell what varies beside the start: numbers, coordinates, texts, or places in a list."""
        columns = dict[str, np.ndarray]()
        for name, each in values.items():
            if name in self._lists:
                columns[name] = _shown(self._lists[name])[each]
            elif name.removeprefix("start.") not in PARTS:
                columns |= {name: each} if each.ndim == 1 else _coordinates(name, each)
        return columns

    def changed(self, places: tuple[int, ...], latency: float) -> Mission:
        """Return the mission with some of the changes, by their places, and neutral values where flights have their own.

        Its latency [s] stands for all that take one program with it, if latencies are drawn.
        """
        changes = dict[str, Any]()
        if places:
            changes = {
                name: choices[place] for (name, choices), place in zip(self._changes.items(), places, strict=True)
            }
        neutral = {name: quantity(name).neutral for name in self.data}
        held = {"truth.latency": latency} if "truth.latency" in self.data else {}
        return Mission.from_values(self._values({k: v for k, v in neutral.items() if v is not None} | held | changes))

    def _objects(self, name: str) -> np.ndarray:
        """Return the choices (k,) of a list, whatever they are."""
        objects = np.empty(len(self._lists[name]), dtype=object)
        objects[:] = list(self._lists[name])
        return objects

    def _values(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mission's values with some changed, without [campaign] and with the seed."""
        values: dict[str, Any] = self.mission.given()
        del values["campaign"]
        return changed(values, {**changes, "flight.seed": self.seed})  # last: a list may give all of [flight]


@functools.lru_cache(MOST_MISSIONS)
def _built(setting: Setting, places: tuple[int, ...], latency: float) -> Mission | GammastarError:
    """Return a changed mission of a setting, or why there is none or why its flights cannot vary."""
    try:
        mission = setting.changed(places, latency)
        if places:
            require_effect(mission, setting.data)
        return mission
    except GammastarError as error:
        return error


def _as_array(choices: Any) -> np.ndarray | None:
    """Return choices as an array of numbers, or None where they are none of one shape, or not finite, as a mission may not be."""
    try:
        found, kinds = np.array(choices), {type(each) for each in np.array(choices, dtype=object).ravel()}
    except ValueError:
        return None
    return found.astype(float) if kinds <= {int, float} and (np.abs(found) <= LARGEST).all() else None


def _shown(choices: Any) -> np.ndarray:
    """Return what tells choices apart (k,): themselves if they are numbers or texts, else their places in the list."""
    kinds = {type(each) for each in choices}
    if kinds <= {int, float}:
        return np.array(choices, dtype=float)
    return np.array(choices) if kinds == {str} else np.arange(len(choices))


def _coordinates(name: str, vectors: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}.{axis}": vectors[:, k] for k, axis in enumerate(AXES)}

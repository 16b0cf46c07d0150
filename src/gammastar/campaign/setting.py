"""What the flights of a campaign are: for each its mission, its start, and what really flies, from the seed and its number alone."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gammastar.campaign.sample import sampled
from gammastar.campaign.starts import AXES, PARTS, Starts
from gammastar.errors import GammastarError, InputError, MissionError
from gammastar.frames import convert_vector
from gammastar.mission import Mission
from gammastar.mission.campaign import ALONG, QUANTITIES
from gammastar.mission.distributions import Choice, Distribution, Grid
from gammastar.mission.mission import read
from gammastar.mission.tables import plain, put
from gammastar.vehicle import Scales, scaled

NEUTRAL: dict[str, Any] = {  # where the flights' own values stand in place of the mission's
    "truth.mass_scale": 1.0,
    "truth.inertia_scale": 1.0,
    "truth.thrust_scale": 1.0,
    "truth.force_scale": 1.0,
    "wind.mean": [0.0, 0.0, 0.0],
}
MOST_MISSIONS = 16  # kept at a time


class Case(NamedTuple):
    """Flights of one mission."""

    mission: Mission | GammastarError  # or why there is none
    places: np.ndarray  # (m,) of the flights among those asked for
    numbers: np.ndarray  # (m,) of the flights
    values: Mapping[str, np.ndarray]  # (m, ...) by quantity, of what varies within the mission, in its frame

    def starts(self) -> Starts:
        """Return where the flights begin."""
        assert isinstance(self.mission, Mission)
        given = {name: self.values[f"start.{name}"] for name in PARTS if f"start.{name}" in self.values}
        return Starts.of(self.mission, len(self.numbers), **given)

    def varied(self) -> dict[str, np.ndarray]:
        """Return what differs from flight to flight in what really flies, (m, ...) by name as `fly_many` takes it, in `ned`."""
        assert isinstance(self.mission, Mission)
        given = {name.removeprefix("truth."): self.values[name] for name in NEUTRAL if name in self.values}
        if "wind.mean" in given:
            given["wind"] = convert_vector(given.pop("wind.mean"), self.mission.frame)
        return given

    def require_bodies(self, chosen: np.ndarray) -> None:
        """Raise `InputError` where some flights' scales of inertia, one for each axis, make a body that cannot be."""
        assert isinstance(self.mission, Mission)
        scales = self.values.get("truth.inertia_scale", np.empty(0))
        for each in scales[chosen] if scales.ndim == 2 else ():
            scaled(self.mission.truth(), Scales(inertia=each))

    def alone(self) -> Mission:
        """Return the only flight as a mission of its own: the same to rounding, since no number in it is one of many."""
        assert isinstance(self.mission, Mission)
        changes = {name: self.values[name][0].tolist() for name in NEUTRAL if name in self.values}
        return self.mission.with_values(
            {"start": self.starts().section(0), **changes, "flight.number": int(self.numbers[0])}
        )


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
        for name, choices in self._changes.items():
            for choice in choices:  # what cannot be read is refused now; what cannot be flown is told in its row
                read(self._values({name: choice}))
        truth = self.base.truth()
        for name, there, what in (
            ("truth.thrust_scale", truth.rotors is not None, "a vehicle with rotors"),
            ("truth.force_scale", bool(truth.forces), "a vehicle with forces"),
        ):
            if name in self.varied and not there:
                raise InputError(f"{name} must vary of {what} (got one without); leave it out of [campaign]")

    @functools.cached_property
    def base(self) -> Mission:
        """Return the mission with neutral values where flights have their own."""
        return Mission.from_values(self._values({name: NEUTRAL[name] for name in NEUTRAL if name in self.varied}))

    @functools.cached_property
    def varied(self) -> Mapping[str, Distribution]:
        """Return the distributions of all that varies, by quantity."""
        assert self.mission.file.campaign is not None
        return self.mission.file.campaign.distributions()

    @functools.cached_property
    def _numbers(self) -> Mapping[str, np.ndarray]:
        """The choices (k, ...) of lists and grids that are numbers of one shape for a quantity that varies within a mission."""
        found = dict[str, np.ndarray]()
        for name, distribution in self.varied.items():
            if isinstance(distribution, Choice | Grid) and name in QUANTITIES:
                choices = _as_array(distribution.choices)
                if choices is not None and choices.shape[1:] in set(QUANTITIES[name]) - {ALONG}:
                    found[name] = choices
        return found

    @functools.cached_property
    def _changes(self) -> Mapping[str, Any]:
        """The choices of all other lists and grids: each makes another mission."""
        lists = {name: each for name, each in self.varied.items() if isinstance(each, Choice | Grid)}
        return {name: each.choices for name, each in lists.items() if name not in self._numbers}

    def sample(self, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values of all that varies, (n, ...) by quantity, in the mission's frame; of what makes another mission, places."""
        assert self.mission.file.campaign is not None
        found = sampled(self.varied, numbers, self.seed, self.mission.file.campaign.sampling)
        return {name: self._numbers[name][each] if name in self._numbers else each for name, each in found.items()}

    def cases(self, numbers: np.ndarray, values: Mapping[str, np.ndarray]) -> Iterator[Case]:
        """Yield flights with sampled values by the missions they need."""
        within = {name: each for name, each in values.items() if name not in self._changes}
        kinds = np.stack([np.zeros(len(numbers), dtype=int), *(values[name] for name in self._changes)], axis=1)
        found, of = np.unique(kinds, axis=0, return_inverse=True)
        for k, kind in enumerate(found.tolist()):
            chosen = np.flatnonzero(of.ravel() == k)
            mission = _built(self, tuple(kind[1:]))
            yield Case(mission, chosen, numbers[chosen], {name: each[chosen] for name, each in within.items()})

    def columns(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the columns (n,) that tell what varies beside the start: numbers, coordinates, texts, or places in a list."""
        columns = dict[str, np.ndarray]()
        for name, each in values.items():
            if name in self._changes:
                columns[name] = _shown(self._changes[name])[each]
            elif name.removeprefix("start.") not in PARTS:
                columns |= {name: each} if each.ndim == 1 else _coordinates(name, each)
        return columns

    def _changed(self, kind: tuple[int, ...]) -> Mission:
        """Return the mission with some of the changes, by their places, and neutral values where flights have their own."""
        changes = {name: choices[place] for (name, choices), place in zip(self._changes.items(), kind, strict=True)}
        neutral = {name: value for name, value in NEUTRAL.items() if name in self.varied and name not in changes}
        return Mission.from_values(self._values(neutral | changes))

    def _values(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mission's values with some changed, without [campaign] and with the seed."""
        values: dict[str, Any] = plain(self.mission.given())
        del values["campaign"]
        for key, value in ({"flight.seed": self.seed} | dict(changes)).items():
            put(values, key, value)
        return values


@functools.lru_cache(MOST_MISSIONS)
def _built(setting: Setting, kind: tuple[int, ...]) -> Mission | GammastarError:
    """Return a changed mission of a setting, or why there is none."""
    try:
        return setting._changed(kind) if kind else setting.base
    except GammastarError as error:
        return error


def _as_array(choices: Any) -> np.ndarray | None:
    """Return choices as an array of numbers, or None where they are none of one shape."""
    try:
        found = np.array(choices)
    except ValueError:
        return None
    return found.astype(float) if found.dtype.kind in "if" else None


def _shown(choices: Any) -> np.ndarray:
    """Return what tells choices apart (k,): themselves if they are numbers or texts, else their places in the list."""
    kinds = {type(each) for each in choices}
    if kinds <= {int, float}:
        return np.array(choices, dtype=float)
    return np.array(choices) if kinds == {str} else np.arange(len(choices))


def _coordinates(name: str, vectors: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}.{axis}": vectors[:, k] for k, axis in enumerate(AXES)}

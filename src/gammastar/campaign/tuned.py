"""What a search for a tuning has found: the tuning, what it is worth on flights that it has not seen, and what else was possible."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.campaign.cost import Judge, front
from gammastar.campaign.space import Candidate, Space, numbers_from
from gammastar.mission import Mission

Means = Mapping[str, float]  # of every term over flights


@dataclass(frozen=True, eq=False)
class Tuned:
    """The outcome of `tune`."""

    own: Mission  # with the tuning that the search began with
    space: Space
    judge: Judge
    tried: tuple[tuple[Candidate, Means], ...]  # over the flights of the search; the mission's own first
    best: int  # place of the best of them on these flights
    unseen: tuple[Means, Means]  # of the mission's own and of the best, over flights not searched with
    costs: (
        tuple[np.ndarray, np.ndarray] | None
    )  # (m,) of these flights; None if there are no others than those of the search
    seed: int
    flights: int  # of each candidate
    is_interrupted: bool

    @property
    def is_better(self) -> bool:
        """Return whether the tuning found is better than the mission's own on flights that the search has not seen."""
        own, best = self.unseen
        return self.judge.merit(best) < self.judge.merit(own)

    @property
    def candidate(self) -> Candidate:
        """Return the tuning found, or the mission's own where it is not surpassed."""
        return self.tried[self.best if self.is_better else 0][0]

    @functools.cached_property
    def mission(self) -> Mission:
        """Return the mission with the tuning found, or as it was where its own is not surpassed."""
        return self.own.with_values(self.candidate.values(self.own.law())) if self.is_better else self.own

    @property
    def improvement(self) -> float:
        """Return the cost of the mission's own tuning over that of the one that is kept, on flights that the search has not seen.

        Below one where the one that is kept costs more and keeps limits that the mission's own does not.
        """
        own, best = self._costs
        if not self.is_better:
            return 1.0
        return own / best if best else math.inf

    @property
    def other_flights(self) -> int:
        """Return how many flights have judged that were not searched with; none where the mission has no others."""
        return 0 if self.costs is None else len(self.costs[0])

    @functools.cached_property
    def saving_interval(self) -> tuple[float, float] | None:
        """Return the interval that holds, with a confidence of 95 %, by how much the tuning found costs less than the mission's own.

        By Student's t of the differences, flight by flight, of those that judged; None of fewer than two.
        """
        if self.costs is None or len(self.costs[0]) < 2:
            return None
        from scipy.stats import t

        saved = self.costs[0] - self.costs[1]
        reach = float(t.ppf(0.975, len(saved) - 1) * saved.std(ddof=1) / np.sqrt(len(saved)))
        return float(saved.mean()) - reach, float(saved.mean()) + reach

    @property
    def message(self) -> str:
        """Return one sentence that says what came out."""
        others, count = self.other_flights, self.flights
        every = "the mission's only flight" if count == 1 else f"all {count} flights of the mission"
        flights = f"{others} other flight{'s' if others > 1 else ''}" if others else every
        if self.best == 0:
            words = "no tuning costs less than the mission's own, which is kept"
        elif self.is_better:
            own, best = self._costs
            factor = f", {self.improvement:.3g} times less" if best else ""
            rest = f"{factor}{self._chance}" if best < own else ", but is farther above its limits"
            words = f"the tuning found costs {best:.4g} on {flights}, where the mission's own costs {own:.4g}{rest}"
        else:
            words = f"the tuning found is not better than the mission's own on {flights}, so that is kept"
        return words + (f"; interrupted after {len(self.tried) - 1} tunings" if self.is_interrupted else "")

    def toml(self) -> str:
        """Return the mission with the tuning that is kept as TOML, with a first line that says what it is worth."""
        return f"# {self.message[0].upper()}{self.message[1:]}.\n{self.mission.toml()}"

    def front(self) -> list[dict[str, Any]]:
        """Return the tunings that none other surpasses in all terms of the cost, by the first of them, with the values of a mission."""
        terms = self.judge.cost.terms
        points = np.array([[means[name] for name in terms] for _, means in self.tried])
        law = self.own.law()
        return [
            {name: means[name] for name in terms} | {"cost": self.judge.cost.of(means)} | candidate.values(law)
            for candidate, means in (self.tried[place] for place in front(points))
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data for JSON, units in the keys."""
        law, cost = self.own.law(), self.judge.cost
        own, best = self.tried[0], self.tried[self.best]
        return {
            "mission": self.own.title,
            "message": self.message,
            "is_better": self.is_better,
            "improvement": self.improvement,
            "saving_interval": self.saving_interval,
            "cost": {"weights": dict(cost.weights), "limits": dict(cost.limits), "failure": cost.failure},
            "evaluations": len(self.tried) - 1,
            "flights": self.flights,
            "other_flights": self.other_flights,
            "interrupted": self.is_interrupted,
            "seed": self.seed,
            "tuned": [{"name": name, "unit": unit, "own": a, "found": b} for name, unit, a, b in self.numbers()],
            "own": {"searched": self._told(own[1]), "other": self._told(self.unseen[0]), **own[0].values(law)},
            "found": {"searched": self._told(best[1]), "other": self._told(self.unseen[1]), **best[0].values(law)},
            "front": self.front(),
        }

    def numbers(self) -> list[tuple[str, str, float, float]]:
        """Return name, unit, own and found value of everything that was tuned."""
        found = _numbers(self.tried[self.best][0], self.space.chains)
        return [(each.name, each.unit, each.own, found[each.name]) for each in self.space.variables]

    @property
    def _chance(self) -> str:
        """How sure it is, as the end of a sentence."""
        if self.saving_interval is None:
            return ""
        low, high = self.saving_interval
        sure = f" (with a confidence of 95 %, between {low:.3g} and {high:.3g} less)"
        return sure if low > 0 else f"{sure}, which may be chance: raise flights"

    @property
    def _costs(self) -> tuple[float, float]:
        """The costs of the mission's own tuning and of the best one, over flights that the search has not seen."""
        own, best = (self.judge.cost.of(means) for means in self.unseen)
        return own, best

    def _told(self, means: Means) -> dict[str, float]:
        return {"cost": self.judge.cost.of(means), **means}


def _numbers(candidate: Candidate, chains: tuple[str, ...]) -> dict[str, float]:
    """Return the numbers of a tuning by the names of the coordinates."""
    result = {
        f"{chain}.{name}": value for chain in chains for name, value in numbers_from(candidate.poles[chain]).items()
    }
    result |= {f"observer.{name}": value for name, value in candidate.observers.items()}
    return result if candidate.speed is None else result | {"approach.speed": candidate.speed}

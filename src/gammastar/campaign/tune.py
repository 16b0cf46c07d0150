"""Tuning: the poles, bandwidths and approach speed that cost least over the flights of a mission's campaign.

Every candidate flies the same flights, so what differs between two candidates is what they do.  What is found is judged on other flights,
which the search has not seen, and the mission's own tuning stays if it is not surpassed there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gammastar.campaign.cost import FAILURE, Cost, Judge
from gammastar.campaign.effect import acting_chains
from gammastar.campaign.search import library, search
from gammastar.campaign.space import Candidate, Space, tunable
from gammastar.campaign.trials import Trials, flights_of
from gammastar.campaign.tuned import Means, Tuned
from gammastar.checks import instance, shortened, whole
from gammastar.errors import InputError
from gammastar.mission import Mission

Progress = Callable[[int, int], None]
FLIGHTS, EVALUATIONS = 24, 400  # unless others are asked for
MOST = 10**6  # of either: days


def tune(
    mission: Mission,
    *,
    flights: int = FLIGHTS,
    evaluations: int = EVALUATIONS,
    cost: Mapping[str, float] | None = None,
    limits: Mapping[str, float | None] | None = None,
    failure: float = FAILURE,
    only: Sequence[str] = (),
    seed: int | None = None,
    machine: str = "auto",
    workers: int | None = None,
    progress: Progress | None = None,
) -> Tuned:
    """Return the tuning of a mission that costs least over the flights of its campaign, or of itself where it has none.

    An interrupt ends the search; what had been found by then is judged and returned.

    Args:
        mission: As it is; its own tuning is where the search begins.
        flights: How many each candidate flies; ten times as many others judge the one that is found.  Fewer where the mission has no
            more: one without chance and [campaign] has one, a grid without chance as many as it has points.
        evaluations: How many candidates are flown.
        cost: Weight of each term of `gammastar.campaign.cost.TERMS`; `DEFAULT_WEIGHTS` there when left out.
        limits: Largest mean of terms over the flights; None is what the mission's own tuning has.
        failure: What a flight that ends early counts in every term, in means of the mission's own tuning.
        only: Names of what is tuned, or of chains; everything when left out.
        seed: Of the campaign, the flights and the search; that of the mission when left out.
        machine: As for `gs.fly_many`.
        workers: As for `gs.fly_many`.
        progress: Called with (flights done, flights in all).

    Raises:
        InputError: An argument does not fit, or the mission has nothing to tune.
        MissingExtraError: The library of the search is not installed.
    """
    weights = {} if cost is None else {"weights": cost}
    judged = Cost(**weights, limits=limits or {}, failure=failure)
    tuner = Tuner(mission, flights, evaluations, judged, only, seed, machine, workers)
    tuner.run(progress)
    return tuner.tuned(progress)


class Tuner:
    """A search that remembers whatever it has flown, so that it can be interrupted."""

    def __init__(
        self,
        mission: Mission,
        flights: int = FLIGHTS,
        evaluations: int = EVALUATIONS,
        cost: Cost | None = None,
        only: Sequence[str] = (),
        seed: int | None = None,
        machine: str = "auto",
        workers: int | None = None,
    ) -> None:
        instance(mission, Mission, "mission", "load one with gs.load_mission(name)")
        library()
        count, self.evaluations = (
            whole(value, name, 1, MOST) for value, name in ((flights, "flights"), (evaluations, "evaluations"))
        )
        if isinstance(only, str):
            raise InputError(f"only must be a list of names (got {shortened(only)}); put it in brackets")
        self.mission, self.cost = mission, cost or Cost()
        self.seed = mission.file.flight.seed if seed is None else whole(seed, "seed")
        tunable(mission.law())
        pilot, _, _ = mission.autopilot()
        self.space = Space(mission.law(), pilot.interval, acting_chains(mission), tuple(only))
        seen, unseen = flights_of(mission, count)
        self.seen = Trials(mission, seen, self.seed, machine, workers)
        self.unseen = None if unseen is None else dataclasses.replace(self.seen, numbers=unseen)
        self.judge: Judge | None = None  # once the mission's own tuning has been flown
        self.tried: list[tuple[Candidate, Means]] = []  # the mission's own tuning first
        self.is_interrupted = False

    def run(self, progress: Progress | None = None) -> None:
        """Search, until an interrupt at the latest: it is raised only if the mission's own tuning has not been flown yet."""

        def evaluate(points: np.ndarray) -> np.ndarray:
            candidates = [self.space.candidate(point) for point in points]
            if self.judge is None:
                candidates = [Candidate.of(self.mission.law()), *candidates]
            flown = self._flown(self.seen, candidates, progress, self.evaluations + 1)
            if self.judge is None:
                self.judge = Judge.of(self.cost, self.mission.file.flight.duration, flown[0])
            judged = [self.judge.means(columns) for columns in flown]
            self.tried += zip(candidates, judged, strict=True)
            return np.array([self.judge.merit(means) for means in judged[-len(points) :]])

        try:
            search(evaluate, *self.space.bounds(), self.evaluations, self.seed)
        except KeyboardInterrupt:
            if self.judge is None:
                raise
            self.is_interrupted = True

    def tuned(self, progress: Progress | None = None) -> Tuned:
        """Return what has been found, judged on flights that the search has not seen."""
        assert self.judge is not None
        judge, own = self.judge, self.tried[0]
        best = min(self.tried, key=lambda each: judge.merit(each[1]))
        unseen, costs = (own[1], best[1]), None
        if self.unseen is not None:
            flown = self._flown(self.unseen, [own[0], best[0]], progress, len(self.tried))
            unseen = judge.means(flown[0]), judge.means(flown[1])
            costs = judge.costs(flown[0]), judge.costs(flown[1])
        return Tuned(
            self.mission,
            self.space,
            judge,
            tuple(self.tried),
            self.tried.index(best),
            unseen,
            costs,
            self.seed,
            len(self.seen.numbers),
            self.is_interrupted,
        )

    def _flown(
        self, trials: Trials, candidates: list[Candidate], progress: Progress | None, tried: int
    ) -> list[dict[str, np.ndarray]]:
        """Return the columns of the flights of candidates; what is tried, and then two of them on the other flights, are all."""
        count, done = len(self.seen.numbers), len(self.tried) * len(self.seen.numbers)
        others = 2 * len(self.unseen.numbers) if self.unseen is not None else 0

        def told(share: float) -> None:
            assert progress is not None
            progress(round(done + share * len(candidates) * len(trials.numbers)), tried * count + others)

        return trials.fly(candidates, None if progress is None else told)

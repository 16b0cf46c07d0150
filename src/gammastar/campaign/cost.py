"""What a tuning costs: weighted means of what flights tell, with what flights count that fail."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gammastar.checks import magnitude, shortened
from gammastar.errors import InputError, UnknownNameError

TERMS: dict[str, str] = {
    "settling_time_s": "time from which the flight stays on its path; one that never does counts twice its duration",
    "max_distance_m": "largest distance to the path",
    "max_distance_last_quarter_m": "largest distance to the path in the last quarter",
    "rms_distance_last_quarter_m": "root mean square distance to the path in the last quarter",
    "peak_rate_rad_s": "largest body rate",
    "peak_torque_N_m": "largest torque",
    "peak_speed_m_s": "largest speed",
    "max_thrust_N": "largest thrust",
    "waiting_time_s": "time that a target on the path waited",
    "given_up": "the most important thing that limits took, 0 to 4",
    "failed": "1 where a flight ended early, so the share of them",
    "unsettled": "1 where a flight did not settle, so the share of them",
}
SHARES = ("failed", "unsettled")  # they count 1 where a flight fails
DEFAULT_WEIGHTS = {"settling_time_s": 1.0, "peak_rate_rad_s": 0.1}
"""A second of settling counts as much as 10 rad/s; chosen by us because both are some seconds and some tens of rad/s in most missions."""
FAILURE = 10.0  # what a flight that fails counts, unless another number is asked for
UNSETTLED = 2.0  # durations that a flight which never settles counts as its settling time
STEEPNESS = 100.0  # what an excess over a limit of the whole limit costs, in costs of the mission's own tuning


@dataclass(frozen=True)
class Cost:
    """Weights and limits of terms, on their means over flights.

    A flight that ends early counts, in every term but the shares, `failure` times the mean of the flights of the mission's own tuning that
    were completed.

    Raises:
        InputError: A term is unknown, a weight or a limit negative, or all weights are zero.
    """

    weights: Mapping[str, float] = field(default_factory=lambda: DEFAULT_WEIGHTS)
    limits: Mapping[str, float | None] = field(default_factory=dict)  # largest means; None: of the mission's own
    failure: float = FAILURE

    def __post_init__(self) -> None:
        for kind, given in (("weight", self.weights), ("limit", self.limits)):
            if not isinstance(given, Mapping):
                raise InputError(
                    f"{kind}s must be given by term (got {shortened(given)}); write {{'settling_time_s': 1.0}}"
                )
            for name in given:
                if name not in TERMS:
                    raise UnknownNameError("a term of a cost", name, TERMS)
            checked = {name: _weight(value, f"{kind} of {name}", kind == "limit") for name, value in given.items()}
            object.__setattr__(self, f"{kind}s", checked)
        if not any(self.weights.values()):
            raise InputError(f"a cost must have a positive weight (got {shortened(dict(self.weights))}); give one")
        object.__setattr__(self, "failure", magnitude(self.failure, "failure", at_least=1))

    @functools.cached_property
    def terms(self) -> tuple[str, ...]:
        """Return the terms that have a weight, if only zero, or a limit."""
        return tuple(name for name in TERMS if name in self.weights or name in self.limits)

    def of(self, means: Mapping[str, float]) -> float:
        """Return the cost of means over flights."""
        return sum(weight * means[name] for name, weight in self.weights.items())

    def excess(self, means: Mapping[str, float]) -> float:
        """Return by how much means are above their limits, in parts of these; zero where all are kept."""
        limits = {name: limit for name, limit in self.limits.items() if limit is not None}
        return sum(max(0.0, means[name] - limit) / (limit or 1.0) for name, limit in limits.items())


@dataclass(frozen=True)
class Judge:
    """A cost with what flights count in it that fail; made from flights of the mission's own tuning."""

    cost: Cost
    duration: float  # [s]
    own: Mapping[str, float]  # means over the completed flights of the mission's own tuning

    @classmethod
    def of(cls, cost: Cost, duration: float, columns: Mapping[str, np.ndarray]) -> Judge:
        """Return the judge of tunings beside flights of the mission's own.

        Raises:
            InputError: None of these is completed.
        """
        told, completed = _told(columns, duration), columns["status"] == "completed"
        if not completed.any():
            raise InputError(
                f"a mission that is tuned must complete a flight with its own poles (got none of {len(completed)}); begin with slower ones"
            )
        own = {name: float(values[completed].mean()) for name, values in told.items()}
        means = cls(cost, duration, own).means(columns)
        limits = {name: means[name] if limit is None else limit for name, limit in cost.limits.items()}
        return cls(dataclasses.replace(cost, limits=limits), duration, own)

    def means(self, columns: Mapping[str, np.ndarray]) -> dict[str, float]:
        """Return the mean of every term over flights."""
        return {name: float(values.mean()) for name, values in self._counted(columns).items()}

    def costs(self, columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the cost (n,) of every flight; their mean is the cost of the means."""
        counted = self._counted(columns)
        return np.asarray(sum(weight * counted[name] for name, weight in self.cost.weights.items()))

    def merit(self, means: Mapping[str, float]) -> float:
        """Return what is minimised: the cost, and steeply more of it above limits."""
        return self.cost.of(means) + STEEPNESS * self.cost.of(self.own) * self.cost.excess(means)

    def _counted(self, columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return what flights count (n,) in every term."""
        failed, told = columns["status"] != "completed", _told(columns, self.duration)
        return {name: np.where(failed, self._failing(name), values) for name, values in told.items()}

    def _failing(self, name: str) -> float:
        """Return what a flight that ends early counts in a term."""
        if name in SHARES:
            return 1.0
        least = UNSETTLED * self.duration if name == "settling_time_s" else 0.0
        return max(least, self.cost.failure * self.own[name])


def _weight(value: object, name: str, may_be_open: bool) -> float | None:
    return None if may_be_open and value is None else magnitude(value, name, at_least=0)


def _told(columns: Mapping[str, np.ndarray], duration: float) -> dict[str, np.ndarray]:
    """Return every term (n,) of flights, as if all had been completed."""
    settling, failed = columns["settling_time_s"], columns["status"] != "completed"
    unsettled = failed | np.isnan(settling)
    told = {name: columns[name].astype(float) for name in TERMS if name not in SHARES}
    told["settling_time_s"] = np.where(unsettled, UNSETTLED * duration, settling)
    return told | {"failed": failed.astype(float), "unsettled": unsettled.astype(float)}


def front(points: np.ndarray) -> np.ndarray:
    """Return the places of points (n, d) that none other surpasses: nowhere above, somewhere below; of equal ones the first.

    Sorted by the first coordinate, so that a point can only be surpassed by one before it.
    """
    order = np.lexsort(points.T[::-1])
    kept: list[int] = []
    for place in order:
        if not any(np.all(points[other] <= points[place]) for other in kept):
            kept.append(int(place))
    return np.array(kept, dtype=int)

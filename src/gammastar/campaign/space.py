"""What of a law is tuned, and in which coordinates: every point of them is a stable law.

The characteristic polynomial of a chain of n states is a product of n // 2 factors s^2 + 2 z w s + w^2, and of one s + w where n is odd.
Positive frequencies w and dampings z give every stable polynomial and no other, and complex poles meet real ones without a seam.  The
coordinates are logarithms: of the mean frequency of a chain, of the ratio of its two frequencies, of its dampings, of the bandwidths of
observers, and of the approach speed.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.errors import InputError, UnknownNameError
from gammastar.law import Law, Observer

FASTEST_POLE = 0.5  # over the control interval: a pole beyond it is not that of the sampled loop any more
FASTEST_OBSERVER = 1.0  # over the control interval
REACH = 4.0  # how far below and above the mission's own value a frequency, a bandwidth or a speed is sought
RATIOS, DAMPINGS = (1 / 4, 4.0), (0.4, 3.0)  # of frequencies, and dampings, that are sought beside the own
STEPS = {"frequency": 0.3, "ratio": 0.3, "damping": 0.2}  # of logarithms, with which the search begins
FREQUENCY, RATIO, DAMPING = "frequency", "ratio", "damping"


@dataclass(frozen=True)
class Variable:
    """One positive number that is sought."""

    name: str
    unit: str
    own: float  # the mission's own
    low: float
    high: float
    step: float  # of the logarithm


@dataclass(frozen=True)
class Candidate:
    """A tuning of a law: what takes the place of the law's own numbers."""

    poles: Mapping[str, tuple[complex, ...]]  # [1/s], of every chain of the law
    observers: Mapping[str, float]  # [rad/s] by 'force' and 'torque', of those that the law has
    speed: float | None  # [m/s] of the approach, if the law has one

    @classmethod
    def of(cls, law: Law) -> Candidate:
        """Return the tuning that a law has."""
        observer = law.rejection if isinstance(law.rejection, Observer) else Observer(None, None)
        observers = {name: value for name in ("force", "torque") if (value := getattr(observer, name)) is not None}
        return cls(dict(law.poles), observers, None if law.approach is None else law.approach.speed)

    def law(self, law: Law) -> Law:
        """Return a law with this tuning."""
        changed: dict[str, Any] = {"poles": dict(self.poles)}
        if self.observers:
            changed["rejection"] = dataclasses.replace(law.rejection, **self.observers)  # type: ignore[type-var]
        if self.speed is not None:
            changed["approach"] = dataclasses.replace(law.approach, speed=self.speed)  # type: ignore[type-var]
        return dataclasses.replace(law, **changed)

    def values(self, law: Law) -> dict[str, Any]:
        """Return the values of a mission, by dotted keys, that give a law this tuning."""
        chains = [chain for chain in self.poles if chain != "transverse_2" or law.path.components == 2]
        poles = {chain: [_written(pole) for pole in self.poles[chain]] for chain in chains}
        observers = {f"observer.{name}": value for name, value in self.observers.items()}
        approach = {} if self.speed is None else {"approach.speed": self.speed}
        return {"controller.poles": poles} | observers | approach


@dataclass(frozen=True)
class Space:
    """The coordinates around a law's own tuning."""

    law: Law
    interval: float  # [s] of the control, or of the integration where control is continuous
    chains: tuple[str, ...]  # those that act
    only: tuple[str, ...] = ()  # beginnings of the names of what is tuned; all of it when empty

    def __post_init__(self) -> None:
        known = [each.name for each in self._all]
        for name in self.only:
            if not any(_begins(each, name) for each in known):
                raise UnknownNameError("what is tuned", name, {*known, *(each.split(".")[0] for each in known)})

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Return what is sought."""
        return tuple(each for each in self._all if not self.only or any(_begins(each.name, name) for name in self.only))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends (d,) of the coordinates; the mission's own tuning is at zero, and the search begins with steps of one."""
        low = [math.log(each.low / each.own) / each.step for each in self.variables]
        high = [math.log(each.high / each.own) / each.step for each in self.variables]
        return np.array(low), np.array(high)

    def candidate(self, point: Sequence[float] | np.ndarray) -> Candidate:
        """Return the tuning at a point (d,)."""
        sought = {
            each.name: each.own * math.exp(each.step * float(x)) for each, x in zip(self.variables, point, strict=True)
        }
        return self.made({each.name: sought.get(each.name, each.own) for each in self._all}, sought)

    def made(self, values: Mapping[str, float], sought: Iterable[str]) -> Candidate:
        """Return the tuning of numbers by name; a chain of which nothing is sought keeps its poles as they are."""
        own, poles = Candidate.of(self.law), dict(self.law.poles)
        changed = {name.split(".")[0] for name in sought}
        for chain in self.chains:
            if chain in changed:
                numbers = {name.partition(".")[2]: values[name] for name in values if _begins(name, chain)}
                poles[chain] = _slowed(poles_from(numbers, len(poles[chain])), self._fastest(chain))
        if self.law.path.components == 3:
            poles["transverse_2"] = poles["transverse"]
        observers = {name: values[f"observer.{name}"] for name in own.observers}
        return Candidate(poles, observers, None if own.speed is None else values["approach.speed"])

    @property
    def _all(self) -> list[Variable]:
        result = []
        for chain in self.chains:
            for name, value in numbers_from(self.law.poles[chain]).items():
                kind = name.split("_")[0]
                low, high = {RATIO: RATIOS, DAMPING: DAMPINGS}.get(kind, (value / REACH, value * REACH))
                unit = "rad/s" if kind == FREQUENCY else ""
                result.append(Variable(f"{chain}.{name}", unit, value, min(low, value), max(high, value), STEPS[kind]))
        own = Candidate.of(self.law)
        for name, value in own.observers.items():
            high = max(value, min(value * REACH, FASTEST_OBSERVER / self.interval))
            result.append(Variable(f"observer.{name}", "rad/s", value, value / REACH, high, STEPS[FREQUENCY]))
        if own.speed is not None:
            speed = own.speed
            result.append(Variable("approach.speed", "m/s", speed, speed / REACH, speed * REACH, STEPS[FREQUENCY]))
        return result

    def _fastest(self, chain: str) -> float:
        """Return the largest modulus [1/s] that poles of a chain may have."""
        return max(FASTEST_POLE / self.interval, *(abs(pole) for pole in self.law.poles[chain]))


def tunable(law: Law) -> None:
    """Raise `InputError` where gains do not follow from poles alone."""
    if law.rejection is not None and not isinstance(law.rejection, Observer):
        raise InputError(
            "a law that is tuned must have an observer or nothing (got integral action, whose gain goes with the poles); "
            "put [observer] in place of [integral]"
        )


def numbers_from(poles: Sequence[complex]) -> dict[str, float]:
    """Return the numbers of a chain's factors by name: mean frequency, ratio of the second to the first frequency, dampings.

    Real poles pair up from outside: the slowest with the fastest.
    """
    pairs, single = _factors(poles)
    frequencies = [math.sqrt(abs(a * b)) for a, b in pairs] + [abs(each) for each in single]
    product = math.prod(abs(pole) for pole in poles)
    numbers = {FREQUENCY: product ** (1 / len(poles))}
    if len(frequencies) == 2:
        numbers[RATIO] = frequencies[1] / frequencies[0]
    for k, (a, b) in enumerate(pairs):
        numbers[_damping(k, pairs)] = -(a + b).real / (2 * frequencies[k])
    return numbers


def poles_from(numbers: Mapping[str, float], count: int) -> tuple[complex, ...]:
    """Return the poles [1/s] of a chain of up to four states from the numbers of its factors."""
    pairs, rest = divmod(count, 2)
    ratio = numbers.get(RATIO, 1.0)
    first = numbers[FREQUENCY] * ratio ** -((2 if rest == 0 else 1) / count if RATIO in numbers else 0.0)
    frequencies = [first, first * ratio]
    poles: list[complex] = []
    for k in range(pairs):
        w, z = frequencies[k], numbers[_damping(k, range(pairs))]
        if z < 1:
            along, across = w * z, w * math.sqrt(1 - z * z)
            poles += [complex(-along, across), complex(-along, -across)]
        else:
            far = w * (z + math.sqrt(z * z - 1))
            poles += [complex(-w * w / far), complex(-far)]
    return (*poles, *([complex(-frequencies[pairs])] if rest else []))


def _factors(poles: Sequence[complex]) -> tuple[list[tuple[complex, complex]], list[complex]]:
    """Return poles in pairs, conjugate or real, and the one that is left."""
    upper = sorted((pole for pole in poles if pole.imag > 0), key=abs)
    real = sorted((complex(pole.real) for pole in poles if pole.imag == 0), key=abs)
    middle = [real.pop(len(real) // 2)] if len(real) % 2 else []
    pairs = [(pole, pole.conjugate()) for pole in upper]
    pairs += [(real[k], real[-1 - k]) for k in range(len(real) // 2)]
    return pairs, middle


def _slowed(poles: tuple[complex, ...], fastest: float) -> tuple[complex, ...]:
    """Return poles, all of them slower in proportion where one has a modulus above the largest [1/s]."""
    share = min(1.0, fastest / max(abs(pole) for pole in poles))
    return tuple(share * pole for pole in poles)


def _damping(place: int, pairs: Any) -> str:
    return DAMPING if len(pairs) == 1 else f"{DAMPING}_{place + 1}"


def _begins(name: str, beginning: str) -> bool:
    return name == beginning or name.startswith(f"{beginning}.")


def _written(pole: complex) -> float | list[float]:
    return [pole.real, pole.imag] if pole.imag else pole.real

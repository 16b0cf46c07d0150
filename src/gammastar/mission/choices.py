"""What a campaign varies by values that are listed: by chance, or all of them in turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array, number, shortened
from gammastar.errors import InputError
from gammastar.mission.distributions import LogUniform, Uniform

MOST_SPACED = 100_000  # values of a grid between two ends


@dataclass(frozen=True, eq=False)
class Choice:
    """One of some values, each with its probability: numbers, or what a mission has in its place."""

    choices: Sequence[Any]
    probabilities: ArrayLike | None = None  # equal ones when left out

    def __post_init__(self) -> None:
        count = _counted(self.choices)
        if self.probabilities is None:
            object.__setattr__(self, "probabilities", np.full(count, 1 / count))
            return
        given = array(self.probabilities, "probabilities", (count,))
        if np.any(given < 0) or abs(given.sum() - 1) > 1e-9:
            raise InputError(
                f"probabilities must not be negative and must sum to one (got {given.tolist()}, sum {given.sum():.6g}); correct them"
            )
        object.__setattr__(self, "probabilities", given)

    size: ClassVar[int] = 1
    shape: ClassVar[tuple[int, ...]] = ()

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return places in the list (n,) for uniform numbers (n, 1)."""
        ends = np.cumsum(np.asarray(self.probabilities))
        return np.minimum(np.searchsorted(ends, uniforms[:, 0], side="right"), len(self.choices) - 1)


@dataclass(frozen=True, eq=False)
class Grid:
    """All of some values in turn; several grids of one campaign are gone through in all combinations, the last one fastest.

    Values are listed, or are numbers from one end to the other in equal steps, or in equal ratios.
    """

    choices: Any = None  # sequence; of what is between the ends when left out
    low: float | None = None
    high: float | None = None
    count: int | None = None
    spacing: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        ends = self.low, self.high, self.count
        if self.choices is None and None not in ends:
            object.__setattr__(self, "choices", self._spaced())
        elif any(each is not None for each in ends) or self.choices is None:
            raise InputError(
                "a grid must have choices, or low, high and count (got some of both, or too few); give the ones or the others"
            )
        _counted(self.choices)

    def _spaced(self) -> list[float]:
        """Return the numbers between the ends, both among them."""
        if not isinstance(self.count, int) or not 2 <= self.count <= MOST_SPACED:
            raise InputError(
                f"count must be a whole number from 2 to {MOST_SPACED} (got {shortened(self.count)}); correct it"
            )
        low, high = number(self.low, "low"), number(self.high, "high")
        kind, spaced = (LogUniform, np.geomspace) if self.spacing == "log" else (Uniform, np.linspace)
        assert kind(low, high)  # refuses ends that are none
        return [float(each) for each in spaced(low, high, self.count)]

    size: ClassVar[int] = 0
    shape: ClassVar[tuple[int, ...]] = ()

    def values(self, uniforms: np.ndarray) -> np.ndarray:
        """Return nothing: which value it is follows from the number of the flight."""
        raise AssertionError("a grid takes no random numbers")


def _counted(values: Any) -> int:
    if not isinstance(values, Sequence) or isinstance(values, str) or not len(values):
        raise InputError(f"choices must be a list with at least one (got {shortened(values)}); write [1, 2, 3]")
    return len(values)

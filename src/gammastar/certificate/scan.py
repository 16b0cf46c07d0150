"""Constant speeds that keep tilt rate, torque and rotors within limits: a scan over speed, its ends narrowed by exchange.

None of these limits has a closed form in the speed, and no demand needs to grow with it: near free fall a slower flight may
turn faster.  With forces the thrust has none either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gammastar.certificate.motion import Progress, demands, unit_derivatives
from gammastar.certificate.search import Search, brackets, narrowed
from gammastar.path.sampling import Samples
from gammastar.vehicle import Vehicle

Interval = tuple[float, float]

RATIO = 1.15  # between neighbouring speeds of the scan
FASTEST = 1e9  # over the slowest speed of interest: what fits there fits at any speed
BEYOND = 30.0  # the scan goes on by this factor behind the first speed that does not fit
BISECTIONS = 45
EXCHANGES = 12  # rounds in which the true peaks join the samples; each squares the error of the speed
RETREATS = 30  # steps of the scan that an end moves inward when peaks have been added
ROUNDING = 1e-10  # relative: a peak this much above the limit meets it


@dataclass(frozen=True, eq=False)
class Scan:
    """How much of its limits a vehicle uses along a path, those of its rotors included, as a function of the speed."""

    samples: Samples
    vehicle: Vehicle
    progress: Progress
    tilt_rate: float | None  # [rad/s] the most
    torque: float | None  # [N m] the most
    floor: float | None = None  # [m/s^2] the least specific thrust
    thrust: float | None = None  # [N] the most
    bisections: int = BISECTIONS  # of an end
    exchanges: int = EXCHANGES
    peaks: int | None = None  # local peaks that an exchange adds, or all that promise something
    also: tuple[float, ...] = ()  # speeds to look at besides, where something narrow may be forbidden

    def parts(self, interval: Interval) -> list[Interval]:
        """Return the parts of an interval of speeds that keep to the limits.

        Where the interval starts at standstill, everything slower than a speed that fits does.
        """
        derivatives = unit_derivatives(self.samples.jets, self.progress)
        low, high = interval
        if low == 0:
            if self.worst(derivatives, 0.0) > 1:  # a constant torque alone is too much
                return []
            low = high if np.isfinite(high) else 1.0
            while self.worst(derivatives, low) > 1:
                low /= 10
        if not np.isfinite(high):
            high = low
            while self.worst(derivatives, high) <= 1 and high < FASTEST * low:
                high *= 10
            high *= BEYOND
        speeds = np.geomspace(low, high, 2 + int(np.log(max(high / low, 1.0)) / np.log(RATIO)))
        speeds[0], speeds[-1] = low, high
        speeds = np.union1d(speeds, [speed for speed in self.also if low < speed < high])
        fits = np.array([self.worst(derivatives, speed) <= 1 for speed in speeds])
        for end in (0, -1):
            fits[end] &= self._peaks(self.samples, float(speeds[end]))[1] <= 1 + ROUNDING
        found = []
        for start, stop in runs(fits):
            first = interval[0] if start == 0 else self._edge(speeds[start], speeds[start - 1])
            last = interval[1] if stop == len(speeds) else self._edge(speeds[stop - 1], speeds[stop])
            if first <= last:
                found.append((float(first), float(last)))
        return found

    def _usage(self, derivatives: np.ndarray, speed: float) -> np.ndarray:
        """Return the largest used share (n,) of any limit; 1 is all."""
        found = demands(self.vehicle, derivatives, speed)
        shares = [found.rotor_share]
        if self.tilt_rate is not None:
            shares.append(found.tilt_rate / self.tilt_rate)
        if self.torque is not None:
            shares.append(found.torque / self.torque)
        if self.thrust is not None:
            shares.append(found.thrust / self.thrust)
        if self.floor is not None:
            with np.errstate(divide="ignore"):
                shares.append(self.floor / found.specific_thrust)
        return np.asarray(np.max(shares, axis=0))

    def worst(self, derivatives: np.ndarray, speed: float) -> float:
        """Return the largest used share of any limit along the path."""
        return float(self._usage(derivatives, speed).max())

    def _peaks(self, samples: Samples, speed: float) -> tuple[np.ndarray, float]:
        """Return the places (k,) of the largest shares between samples too, and the largest of them."""

        def usage(jets: np.ndarray) -> np.ndarray:
            return self._usage(unit_derivatives(jets, self.progress), speed)

        (found,) = narrowed(samples, [Search(usage, 1, brackets(samples, usage, 1)[: self.peaks])])
        return np.array([each.parameter for each in found]), max(each.value for each in found)

    def _edge(self, inside: float, outside: float) -> float:
        """Return the speed at which a limit is met, between one that fits at all samples and one that does not.

        The speed that the samples allow is too bold, because peaks lie between them; they are added until none is left.
        NaN when nothing fits once they are.
        """
        samples, inward = self.samples, inside / outside
        for _ in range(self.exchanges):
            derivatives = unit_derivatives(samples.jets, self.progress)
            for _ in range(RETREATS):
                if self.worst(derivatives, inside) <= 1:
                    break
                inside, outside = inside * inward, inside
            else:
                return float("nan")
            for _ in range(self.bisections):
                middle = (inside + outside) / 2
                if self.worst(derivatives, middle) <= 1:
                    inside = middle
                else:
                    outside = middle
            places, largest = self._peaks(samples, inside)
            if largest <= 1 + ROUNDING:
                break
            samples = samples.with_parameters(places)
        return inside


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """Return (start, stop) of each run of true entries."""
    changes = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(changes[::2], changes[1::2], strict=True)]

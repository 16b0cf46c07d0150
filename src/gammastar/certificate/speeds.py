"""Which constant speeds a path allows: outside free fall at every place, and inside the limits of the vehicle.

With u = v^2, w the second derivative at unit speed and c = g e3 - K_t, the specific thrust is |c - u w|.  At one place
it is below a bound between the two roots of a quadratic in u; along the path the union of these intervals is forbidden.
So a loop can be flown slowly, and again faster than sqrt(g r), but not in between.  With forces there is no such form: the whole
range of speeds is scanned.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from gammastar.certificate.motion import Progress, unit_derivatives
from gammastar.certificate.scan import Interval, Scan, runs
from gammastar.certificate.search import Quantity, Search, brackets, extremes, narrowed, neighbourhood
from gammastar.checks import number
from gammastar.law.flatness import hover
from gammastar.law.thrust_axis import is_bare
from gammastar.path.sampling import Samples
from gammastar.vehicle import Vehicle

FLOOR = (
    0.05  # of the specific thrust at rest: chosen by us, as the floor of the thrust above which random starts settled
)
LEAST_FLOOR = 1e-3  # [m/s^2] without gravity: chosen by us, a hundredth of what a small satellite has (0.475 N on 5 kg)
BISECTIONS, EXCHANGES = 22, 4  # of an end of such a scan: 1e-7 of the speed
COARSE = 200  # samples, besides the places of the sharpest derivatives, on which a scan with rotors or forces begins
SLOWEST, FASTEST = (
    1e-3,
    1e3,
)  # of a speed of its own scale, between which a path without a flyable standstill is scanned
SHARPEST = 8  # of these places for each derivative
AROUND = np.array([0.85, 0.9, 0.94, 0.97, 1.0, 1.03, 1.06, 1.1, 1.15])  # forces move the speeds of free fall a little
RUNAWAY = 1e8  # upper root of a quadratic over the least one: w passes through zero, where the root is infinite


@dataclass(frozen=True)
class Limits:
    """What the vehicle can do; what is left out does not count."""

    specific_thrust: float | None = None  # [m/s^2] the least; by default 5 % of that at rest, and no less than 0.001
    thrust: float | None = None  # [N] the most
    tilt_rate: float | None = None  # [rad/s] the most, of the thrust axis
    torque: float | None = None  # [N m] the most, magnitude

    def __post_init__(self) -> None:
        for each in fields(self):
            if getattr(self, each.name) is not None:
                number(getattr(self, each.name), f"limit of {each.name.replace('_', ' ')}", above=0)

    def floor(self, vehicle: Vehicle) -> float:
        """Return the least specific thrust [m/s^2]."""
        if self.specific_thrust is not None:
            return self.specific_thrust
        return max(FLOOR * float(np.linalg.norm(hover(vehicle))), LEAST_FLOOR)


def allowed_speeds(samples: Samples, vehicle: Vehicle, progress: Progress, limits: Limits) -> tuple[Interval, ...]:
    """Return the intervals of constant speed, slowest first, at which the whole path can be followed.

    Exact to rounding for the floor and the ceiling of the thrust without forces.  For all else each interval is scanned at
    speeds 15 % apart before its ends are narrowed: something forbidden within less is not seen.
    """
    floor = limits.floor(vehicle)
    if not is_bare(vehicle):
        most = limits.tilt_rate, limits.torque, floor, limits.thrust
        chosen = _coarse(samples, progress)
        also = _near_free_fall(unit_derivatives(chosen.jets, progress)[:, 2], hover(vehicle))
        return _scanned(Scan(chosen, vehicle, progress, *most, BISECTIONS, EXCHANGES, SHARPEST, also), floor)
    forbidden = _free_fall(samples, vehicle, progress, floor)
    allowed = _complement(forbidden)
    if limits.thrust is not None:
        within = _within_thrust(samples, vehicle, progress, limits.thrust / vehicle.mass)
        allowed = [(max(a, within[0]), min(b, within[1])) for a, b in allowed if max(a, within[0]) <= min(b, within[1])]
    speeds = [(float(np.sqrt(low)), float(np.sqrt(high))) for low, high in allowed]
    if limits.tilt_rate is None and limits.torque is None and vehicle.rotors is None:
        return tuple(speeds)
    scan = Scan(samples, vehicle, progress, limits.tilt_rate, limits.torque)
    if vehicle.rotors is not None:
        scan = replace(
            scan, samples=_coarse(samples, progress), bisections=BISECTIONS, exchanges=EXCHANGES, peaks=SHARPEST
        )
    return tuple(part for each in speeds for part in scan.parts(each))


def _scanned(scan: Scan, floor: float) -> tuple[Interval, ...]:
    """Return the intervals of speed that keep to the limits of a scan, from standstill or, where that does not, from very slow."""
    derivatives = unit_derivatives(scan.samples.jets, scan.progress)
    if scan.worst(derivatives, 0.0) <= 1:
        return tuple(scan.parts((0.0, np.inf)))
    bend = float(np.linalg.norm(derivatives[:, 2], axis=1).max())
    pace = float(np.linalg.norm(derivatives[:, 1], axis=1).mean())
    own = min(np.sqrt(floor / bend), 1 / pace) if bend > 0 else 1 / pace
    last = FASTEST * max(own, 1 / pace)
    found = scan.parts((SLOWEST * own, last))
    return tuple((low, np.inf if high == last else high) for low, high in found)


def _near_free_fall(second: np.ndarray, constant: np.ndarray) -> tuple[float, ...]:
    """Return speeds at and around which |c - v^2 w| is least, at the places where that is least of all."""
    size = np.sum(second**2, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        squares = second @ constant / size
        left = np.linalg.norm(constant - squares[:, None] * second, axis=1)
    good = np.flatnonzero(np.isfinite(left) & (squares > 0))
    chosen = good[np.argsort(left[good], kind="stable")[:SHARPEST]]
    return tuple(np.unique(np.outer(np.sqrt(squares[chosen]), AROUND)).tolist())


def _coarse(samples: Samples, progress: Progress) -> Samples:
    """Return fewer samples: some throughout the path, and those around the sharpest of its derivatives."""
    if len(samples.parameters) <= COARSE:
        return samples

    def size(order: int) -> Quantity:
        return lambda jets: np.asarray(np.linalg.norm(unit_derivatives(jets, progress)[:, order], axis=1))

    sharp = np.concatenate([brackets(samples, size(order), 1)[:SHARPEST].ravel() for order in (2, 3, 4)])
    even = np.linspace(0, len(samples.parameters) - 1, COARSE).astype(int)
    kept = np.union1d(even, np.searchsorted(samples.parameters, sharp))
    return Samples(samples.path, samples.parameters[kept], samples.jets[kept], samples.broken)


def roots(second: np.ndarray, constant: np.ndarray, bound: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (u_low, u_high), (n,) each, between which |c - u w| < bound for u >= 0; NaN where it never is.

    A u^2 - 2 B u + C < 0 with A = |w|^2, B = <c, w>, C = |c|^2 - bound^2, in forms without cancellation.
    """
    a, b, c = np.sum(second**2, axis=1), second @ constant, float(constant @ constant) - bound**2
    discriminant = b**2 - a * c
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.sqrt(discriminant)
        if c > 0:
            exists = (b > 0) & (discriminant > 0)
            low, high = c / (b + root), (b + root) / a
        else:
            exists = np.full(len(a), c < 0)
            low, high = np.zeros(len(a)), np.where(b > 0, (b + root) / a, -c / (root - b))
    return np.where(exists, low, np.nan), np.where(exists, high, np.nan)


def _free_fall(samples: Samples, vehicle: Vehicle, progress: Progress, floor: float) -> list[Interval]:
    """Return the forbidden intervals of u = v^2, merged and sorted.

    Over a stretch of the path where the quadratic has roots they move continuously, so the union over the stretch is
    one interval, from the least lower root to the greatest upper one.
    """
    constant = hover(vehicle)
    size = float(np.linalg.norm(constant))

    def low(jets: np.ndarray) -> np.ndarray:
        return roots(unit_derivatives(jets, progress)[:, 2], constant, floor)[0]

    def high(jets: np.ndarray) -> np.ndarray:
        return roots(unit_derivatives(jets, progress)[:, 2], constant, floor)[1]

    def alignment(jets: np.ndarray) -> np.ndarray:
        second = unit_derivatives(jets, progress)[:, 2]
        norm = np.linalg.norm(second, axis=1)
        return np.where(norm > 0, second @ constant / np.where(norm > 0, norm, 1.0), -size)

    def with_extremes(searches: list[Search]) -> Samples:
        found = narrowed(samples, searches)
        return samples.with_parameters(np.array([each.parameter for candidates in found for each in candidates]))

    if size > floor:  # a stretch may be narrower than a sample: it holds a place where w is best aligned with c
        samples = with_extremes([Search(alignment, 1, brackets(samples, alignment, 1))])
    stretches, lows, highs = _stretches(samples, low, high)
    if not stretches:
        return []
    first = np.array([start + int(np.argmin(lows[start:stop])) for start, stop in stretches])
    last = np.array([start + int(np.argmax(highs[start:stop])) for start, stop in stretches])
    lowest = np.concatenate([neighbourhood(samples, first), brackets(samples, low, -1)])
    highest = np.concatenate([neighbourhood(samples, last), brackets(samples, high, 1)])
    samples = with_extremes([Search(low, -1, lowest), Search(high, 1, highest)])
    stretches, lows, highs = _stretches(samples, low, high)
    highs[highs > RUNAWAY * np.nanmin(highs)] = np.inf
    merged: list[Interval] = []
    for start, end in sorted((float(lows[a:b].min()), float(highs[a:b].max())) for a, b in stretches):
        if merged and start <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(merged[-1][1], end))
        else:
            merged.append((start, end))
    return merged


def _stretches(samples: Samples, low: Quantity, high: Quantity) -> tuple[list[tuple[int, int]], np.ndarray, np.ndarray]:
    """Return (start, stop) of each run of samples where the quadratic has roots, and the roots (n,) each."""
    lows, highs = low(samples.jets), high(samples.jets)
    return runs(~np.isnan(lows)), lows, highs


def _within_thrust(samples: Samples, vehicle: Vehicle, progress: Progress, most: float) -> Interval:
    """Return the interval of u = v^2 in which the specific thrust stays below a bound everywhere; empty as (1, 0)."""
    constant = hover(vehicle)

    def edge(index: int, missing: float) -> Quantity:
        def quantity(jets: np.ndarray) -> np.ndarray:
            value = roots(unit_derivatives(jets, progress)[:, 2], constant, most)[index]
            return np.where(np.isnan(value), missing, value)

        return quantity

    found = extremes(samples, {"low": (edge(0, np.inf), 1), "high": (edge(1, 0.0), -1)})
    low, high = found["low"].value, found["high"].value
    return (low, high) if low <= high else (1.0, 0.0)


def _complement(forbidden: list[Interval]) -> list[Interval]:
    """Return what a sorted list of intervals leaves of [0, infinity)."""
    allowed, start = [], 0.0
    for low, high in forbidden:
        if low > start:
            allowed.append((start, low))
        start = high
    return [*allowed, (start, np.inf)] if np.isfinite(start) else allowed

"""A path in samples that resolve it: jets at parameters dense enough for every question asked of them.

The jet at one sample predicts, by its Taylor polynomial, the jet at the next; where the prediction is poor the interval
is halved.  What is narrower than an interval of the first grid *and* leaves no trace in the jets beside it is not seen:
sampling cannot exclude it.  On 10 km the first grid has a sample every 2.4 m: a smooth bump 2 cm wide between two of them that
vanishes at both goes unnoticed, and with it its curvature.  Knots are samples, so a path declares there what is that narrow.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.errors import PathError
from gammastar.path.arc_length import integrals, speed_jets
from gammastar.path.base import JET_ORDER, Path

INTERVALS = 4096  # of the first grid
MOST_SAMPLES = 100_000
PASSES = 16  # of halving
RESOLVED = 0.03  # relative error of a predicted derivative, up to the fourth, that the sampling accepts
TURN = 0.1  # [rad] of the tangent over an interval, at most
LONGEST = 2.0  # length of an interval over the mean of the first grid
FINEST = 1e-9  # of the domain: intervals are not made narrower
SMALL = 1e-3  # of the largest value along the path: a derivative below it counts as this large


@dataclass(frozen=True)
class Place:
    """Where on a path."""

    parameter: float
    arc_length: float  # [m] from the start of the path's domain
    point: tuple[float, float, float]  # [m], world

    def as_dict(self) -> dict[str, Any]:
        """Return plain data, units in the keys."""
        return {"parameter": self.parameter, "arc_length_m": self.arc_length, "point_m": list(self.point)}

    def __str__(self) -> str:
        point = ", ".join(f"{round(value, 9) + 0.0:.4g}" for value in self.point)
        return f"parameter {round(self.parameter, 9) + 0.0:.6g} ({self.arc_length:.4g} m along, point {point} m)"


@dataclass(frozen=True, eq=False)
class Samples:
    """A path with its jets at growing parameters over its whole domain, both ends included."""

    path: Path
    parameters: np.ndarray  # (n,)
    jets: np.ndarray  # (n, 6, 3): point and first five derivatives with respect to the parameter
    broken: np.ndarray  # (k,) parameters whose jets are not finite; they are left out above

    @functools.cached_property
    def unresolved(self) -> np.ndarray:
        """Return the starts (k,) of intervals over which some derivative up to the fourth is badly predicted."""
        return np.asarray(self.parameters[:-1][_poorly_predicted(self)])

    @property
    def low(self) -> float:
        """Return the start of the domain."""
        return float(self.parameters[0])

    @property
    def span(self) -> float:
        """Return the length of the domain in the parameter."""
        return float(self.parameters[-1] - self.parameters[0])

    @property
    def closed(self) -> bool:
        """Return whether the path ends where it starts."""
        return self.path.period is not None

    @functools.cached_property
    def speeds(self) -> np.ndarray:
        """Return |sigma'| (n,), metres per unit of the parameter."""
        return np.asarray(np.linalg.norm(self.jets[:, 1], axis=1))

    @functools.cached_property
    def scales(self) -> np.ndarray:
        """Return what counts as large for the point and each derivative (6,): the largest, or what the domain suggests."""
        chord = self.speeds.mean() * self.span
        largest = np.linalg.norm(self.jets, axis=2).max(axis=0)
        largest[0] = 0.0  # the place in the world is no scale of the curve
        return np.asarray(largest + chord / self.span ** np.arange(JET_ORDER + 1))

    def inside(self, parameters: np.ndarray) -> np.ndarray:
        """Return parameters brought into the domain: wrapped on a closed path, moved to the nearer end on an open one."""
        if self.closed:
            return np.asarray(self.low + np.mod(parameters - self.low, self.span))
        return np.asarray(np.clip(parameters, self.low, self.low + self.span))

    def jets_at(self, parameters: np.ndarray) -> np.ndarray:
        """Return the path's jets (n, 6, 3) at parameters (n,), which may leave the domain of a closed path."""
        return self.path.jets(self.inside(parameters))

    def with_parameters(self, parameters: np.ndarray) -> Samples:
        """Return samples with more parameters (k,) among them."""
        added = np.setdiff1d(self.inside(parameters), self.parameters)
        if not added.size:
            return self
        jets = self.path.jets(added)
        finite = np.isfinite(jets).all(axis=(1, 2))
        broken = np.concatenate([self.broken, added[~finite]])
        merged = np.concatenate([self.parameters, added[finite]])
        order = np.argsort(merged)
        return Samples(self.path, merged[order], np.concatenate([self.jets, jets[finite]])[order], broken)

    @functools.cached_property
    def arc_lengths(self) -> np.ndarray:
        """Return the arc length (n,) [m] at the samples."""
        return np.concatenate([[0.0], np.cumsum(_lengths(self.parameters, self.jets))])

    @property
    def length(self) -> float:
        """Return the length [m]."""
        return float(self.arc_lengths[-1])

    @property
    def length_error(self) -> float:
        """Return a cautious estimate [m] of the error of the length: the difference to every other sample's."""
        rough = np.union1d(np.arange(0, len(self.parameters), 2), [len(self.parameters) - 1])
        return abs(self.length - float(np.sum(_lengths(self.parameters[rough], self.jets[rough]))))

    def before(self, parameters: np.ndarray) -> np.ndarray:
        """Return the last sample (k,) that is not behind each parameter (k,)."""
        last = len(self.parameters) - 1
        return np.asarray(np.clip(np.searchsorted(self.parameters, parameters, side="right") - 1, 0, last))

    def places(self, parameters: np.ndarray) -> list[Place]:
        """Return places with arc length and point, parameters (k,) inside the domain or a period away from it."""
        if not len(parameters):
            return []
        wanted = self.inside(np.asarray(parameters, dtype=float))
        jets = self.path.jets(wanted)
        before, finite = (
            self.before(wanted),
            np.isfinite(jets).all(axis=(1, 2))[:, None, None],
        )  # else point and rates of the sample before
        jets = np.where(finite, jets, self.jets[before])
        arc_lengths = self.arc_lengths[before] + integrals(
            wanted - self.parameters[before], speed_jets(self.jets[before]), speed_jets(jets)
        )
        return [
            Place(float(parameter), float(arc_length), (float(x), float(y), float(z)))
            for parameter, arc_length, (x, y, z) in zip(wanted, arc_lengths, jets[:, 0], strict=True)
        ]


def sample(path: Path) -> Samples:
    """Return samples that resolve a path, its knots (if it declares any) among them.

    Raises:
        PathError: Hardly any jet of the path is finite.
    """
    (low, high), inner = path.domain, path.knots
    nodes = np.union1d(np.linspace(low, high, INTERVALS + 1), inner[(inner > low) & (inner < high)])
    jets = path.jets(nodes)
    finite = np.isfinite(jets).all(axis=(1, 2))
    if finite.sum() < 2:
        raise PathError(
            f"a path must have a point and five derivatives (got none at {np.sum(~finite)} of {len(nodes)} parameters); "
            "check its numbers"
        )
    samples = Samples(path, nodes[finite], jets[finite], nodes[~finite])
    for _ in range(PASSES):
        poor = _poorly_predicted(samples) | _long(samples)
        if not poor.any() or len(samples.parameters) + poor.sum() > MOST_SAMPLES:
            break
        samples = samples.with_parameters((samples.parameters[:-1] + samples.parameters[1:])[poor] / 2)
    return samples


def taylor_residuals(parameters: np.ndarray, jets: np.ndarray) -> np.ndarray:
    """Return, for neighbours along the last-but-two axis, each derivative minus what the jet before it predicts.

    For a smooth curve the residual of derivative k over a step h is sigma^(6) h^(6-k) / (6-k)!; where derivative k
    jumps it does not shrink with h.

    Args:
        parameters: (..., n).
        jets: (..., n, 6, 3).

    Returns:
        (..., n - 1, 6, 3).
    """
    step = np.diff(parameters, axis=-1)[..., None]
    before = jets[..., :-1, :, :]
    residuals = jets[..., 1:, :, :].copy()
    for k in range(JET_ORDER + 1):
        for j in range(k, JET_ORDER + 1):
            residuals[..., k, :] -= before[..., j, :] * step ** (j - k) / math.factorial(j - k)
    return residuals


def _poorly_predicted(samples: Samples) -> np.ndarray:
    """Return which intervals (n - 1,) are too wide: a derivative up to the fourth is badly predicted, or the tangent turns."""
    residuals = np.linalg.norm(taylor_residuals(samples.parameters, samples.jets), axis=2)[:, 1:5]
    sizes = np.linalg.norm(samples.jets, axis=2)[:, 1:5]
    sizes = np.maximum(np.maximum(sizes[:-1], sizes[1:]), SMALL * samples.scales[1:5])
    tangents = samples.jets[:, 1] / np.maximum(samples.speeds, 1e-300)[:, None]
    turning = np.linalg.norm(np.diff(tangents, axis=0), axis=1) > TURN
    poor = (residuals > RESOLVED * sizes).any(axis=1) | turning
    return np.asarray(poor & (np.diff(samples.parameters) > FINEST * samples.span))


def _long(samples: Samples) -> np.ndarray:
    """Return which intervals (n - 1,) are much longer than the mean interval of the first grid."""
    lengths = np.diff(samples.arc_lengths)
    return np.asarray(lengths > LONGEST / INTERVALS * samples.length)


def _lengths(parameters: np.ndarray, jets: np.ndarray) -> np.ndarray:
    """Return the arc lengths (n - 1,) [m] between neighbouring samples."""
    rates = speed_jets(jets)
    return integrals(np.diff(parameters), rates[:-1], rates[1:])

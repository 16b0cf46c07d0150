"""The course of an implicit path as numbers: its points by pi, whether pi is a coordinate of it, and distances to it."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar.errors import PathError
from gammastar.path.nearest import nearest
from gammastar.path.tracing import CONVERGED, NEWTON_STEPS, Trace, newton_step

CLOSED = 1e-9  # of the length of a closed path: a gap below this is rounding
HALVINGS = 60  # of the step over which pi starts again
ROW = 8  # places between two traced points, in the row that distances are searched in
MOST_PLACES = 200_000  # of that row, if the trace has fewer points
DOUBLINGS = 8  # of the stretch of an open path in which nearest points are searched, beyond the domain


@dataclass(frozen=True, eq=False)
class Course:
    """The points of an implicit path."""

    name: str
    domain: tuple[float, float]
    period: float | None
    seed: np.ndarray  # (3,) [m], on the path
    system: Any  # function position (3,) -> values (s1, s2, pi) (3,) and their gradients as rows (3, 3)
    sampler: Any  # function (pi, guess (3,)) -> point and two derivatives (3,) each with respect to pi

    def check(self) -> None:
        """Trace one period, or the domain, and refuse a pi that cannot be a coordinate of the path."""
        if self.period is None:
            self._trace.reach(*self.domain)
            return
        points = self._trace.table[1]
        length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        gap = float(np.linalg.norm(points[-1] - points[0]))
        if gap > CLOSED * length:
            raise PathError(
                f"{self.name} must close after its period (got a gap of {gap:.3g} m after {self.period:.6g}); correct the period"
            )

        parameters = self._trace.table[0]
        for k in np.flatnonzero(np.diff(self._turns(parameters, points))):
            low, high = parameters[k], parameters[k + 1]
            first, last = points[k : k + 1], points[k + 1 : k + 2]
            for _ in range(HALVINGS):
                middle = np.array([(low + high) / 2])
                found, _ = self._solved(middle)
                if self._turns(middle, found) == self._turns(np.array([low]), first):
                    low, first = middle[0], found
                else:
                    high, last = middle[0], found
            if not np.linalg.norm(last - first) <= CLOSED * length:
                before, after = (float(self.system(point[0])[0][2]) for point in (first, last))
                raise PathError(
                    f"pi of {self.name} must be continuous but for whole periods (got a jump from {before:.9g} to {after:.9g} at "
                    f"{(first[0].round(6) + 0.0).tolist()}, and a period of {self.period:.9g}); correct the period"
                )

    def _turns(self, parameters: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return how many periods parameters (n,) are ahead of pi at their points (n, 3)."""
        values = np.array(self.system.map(len(points))(points.T)[0])[2]
        return np.asarray(np.rint((parameters - values) / self.period))

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Return the points (n, 3) at parameters (n,): Newton steps from the trace.

        Raises:
            PathError: Pi does not get as far on the path.
        """
        if not parameters.size:
            return np.empty((0, 3))
        wanted = self._inside(parameters)
        if self.period is None:
            self._trace.reach(float(wanted.min()), float(wanted.max()))
        found, is_found = self._solved(wanted)
        if not is_found.all():
            raise PathError(
                f"{self.name} must have one point for every pi (got none at {wanted[is_found.argmin()]:.6g} that Newton steps find); "
                "choose smoother functions s1, s2 and pi"
            )
        return found

    def distances(self, positions: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the distances (n,) [m] to the nearest points of the path, whatever pi is.

        Of a closed path they are global.  An open one is searched over its domain, the parameters, and as far beyond as a
        doubling of that brings anything nearer, or to where pi ends or the trace does.

        Raises:
            PathError: A parameter is too far from the seed to be traced.
        """
        if self.period is not None:
            low, high = self._trace.start, self._trace.start + self.period
            return nearest(positions, *self._row(low, high), self._jets)[1]
        low, high = (float(f([*self.domain, *parameters[np.isfinite(parameters)]])) for f in (np.min, np.max))
        found, distances = nearest(positions, *self._row(low, high), self._jets)
        for _ in range(DOUBLINGS):
            known = self._trace.table[0]
            margin = (high - low) / 4
            grows = [
                (found < low + margin).any() and known[0] <= low,
                (found > high - margin).any() and known[-1] >= high,
            ]
            if not any(grows):
                break
            low, high = low - 2 * margin * grows[0], high + 2 * margin * grows[1]
            try:
                found, distances = nearest(positions, *self._row(low, high), self._jets)
            except PathError:  # too far to be traced
                break
        return distances

    def _row(self, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Return parameters (m,) and points (m, 3) that stand densely from low to high, or to where pi ends."""
        if self.period is None:
            self._trace.extend(-1, low)
            self._trace.extend(1, high)
        known = np.unique(np.clip(self._trace.table[0], low, high))
        each = max(1, min(ROW, MOST_PLACES // len(known)))
        places = np.interp(np.arange((len(known) - 1) * each + 1) / each, np.arange(len(known)), known)
        if self.period is not None:  # one place more on both sides of the seam
            places = np.concatenate([[places[-2] - self.period], places, [places[1] + self.period]])
        points, is_found = self._solved(self._inside(places))
        return places[is_found], points[is_found]

    def _solved(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (n, 3) at traced parameters (n,), and whether Newton steps found each (n,)."""
        points, left = self._point_solver.map(len(parameters))(parameters[None, :], self._trace.guesses(parameters).T)
        found = np.array(points).T
        return found, np.array(left).ravel() <= CONVERGED * (1 + np.linalg.norm(found, axis=1))

    def _jets(self, parameters: np.ndarray) -> np.ndarray:
        """Return point and two derivatives (n, 3, 3) at parameters (n,) that are traced."""
        inside = self._inside(parameters)
        rows = self.sampler.map(len(inside))(inside[None, :], self._trace.guesses(inside).T)
        return np.stack([np.array(row).T for row in rows], axis=1)

    @functools.cached_property
    def _trace(self) -> Trace:
        low, high = self.domain
        trace = Trace(self.name, self.system, self.period, self.seed, high - low)
        if self.period is not None:
            trace.reach(trace.start, trace.start + self.period)
        return trace

    def _inside(self, parameters: np.ndarray) -> np.ndarray:
        """Return parameters (n,) brought into the traced period of a closed path."""
        if self.period is None:
            return parameters
        return np.asarray(self._trace.start + np.mod(parameters - self._trace.start, self.period))

    @functools.cached_property
    def _point_solver(self) -> Any:
        parameter, guess = ca.SX.sym("parameter"), ca.SX.sym("guess", 3)
        point = guess
        for _ in range(NEWTON_STEPS):
            point = point + newton_step(self.system, point, parameter, self.period)
        left = newton_step(self.system, point, parameter, self.period)
        return ca.Function("point", [parameter, guess], [point, ca.norm_2(left)])

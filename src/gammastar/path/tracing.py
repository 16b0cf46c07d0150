"""The points of an implicit path in order of pi: followed from one of them in steps that adapt to its bends.

A step goes along the tangent and comes back by Newton steps on (s1, s2, pi); it counts when it comes back near where
the tangent had led, pointing the same way, so that it cannot end on another branch.  Where pi jumps, turns back or ends
no step counts, however short, and the trace ends there.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from gammastar.errors import PathError

CHUNK = 128  # steps that one call of the scan tries
MOST_STEPS = 200_000  # tried in one direction; about a second
NEWTON_STEPS = 4  # of one step of the trace, and from a place between two traced points
BENT = 0.15  # of a step: farther from its tangent it does not count; a bend of 0.3 rad
STRAIGHT = 0.05  # of a step: nearer to its tangent the next one is twice as long
SAME_WAY = 0.8  # least cosine between the tangents at both ends of a step
CONVERGED = 1e-9  # [m], and relative: size of the Newton step that is left
FIRST_STEPS = 64  # that the domain is worth, at least: what is shorter and leaves no trace beside it is not seen
FARTHER = 32  # beyond the domain steps may be as long as the distance to it over this
STALLED = 1e-12  # of a first step: a trace that is down to this has ended
AHEAD = 1e-6  # of the length of the path traced so far: from there its end is looked at
FAR = 10.0  # of the way to look ahead: the path is found no nearer than that beyond a gap
JUMP = 1e-3  # relative to the change of pi that its gradient foretells on this way


@dataclass
class Branch:
    """What is traced in one direction: the scan's state, and the points so far."""

    state: np.ndarray  # (5,) pi, point and the step that is tried next
    parameters: list[np.ndarray] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)
    tries: int = 0
    ended: bool = False  # no step counts any more

    @property
    def exhausted(self) -> bool:
        """Return whether the path may go on, but no more steps are tried."""
        return self.tries >= MOST_STEPS and not self.ended


@dataclass(eq=False)
class Trace:
    """An implicit path as a table that grows as far as it is asked for.

    Raises:
        PathError: Of `reach`, when pi does not get as far.
    """

    name: str
    system: Any  # function position (3,) -> values (s1, s2, pi) (3,) and their gradients as rows (3, 3)
    period: float | None
    seed: np.ndarray  # (3,) [m], on the path
    width: float  # of the domain in pi

    def __post_init__(self) -> None:
        self.start = float(self.system(self.seed)[0][2])
        first = self.width / FIRST_STEPS
        self._tiny = STALLED * first
        self._branches = {
            sense: Branch(
                np.array([self.start, *self.seed, sense * first]), [np.array([self.start])], [self.seed[None]]
            )
            for sense in (-1, 1)
        }

    def reach(self, low: float, high: float) -> None:
        """Trace the path from pi = low to high, or raise the error that says why not."""
        for sense, wanted in ((-1, low), (1, high)):
            if not self.extend(sense, wanted):
                raise PathError(self._ending(sense, wanted))

    def extend(self, sense: int, wanted: float) -> bool:
        """Trace the path in one direction as far as pi = wanted; return whether it gets there.

        Raises:
            PathError: It is too far; where the path ends is an answer.
        """
        branch = self._branches[sense]
        while sense * (wanted - branch.state[0]) > self._tiny and not branch.ended and not branch.exhausted:
            states = np.array(self._scan(branch.state, sense, wanted))
            moved = np.flatnonzero(np.diff(states[0], prepend=branch.state[0]))
            branch.parameters.append(states[0, moved])
            branch.points.append(states[1:4, moved].T)
            branch.state, branch.tries = states[:, -1], branch.tries + CHUNK
            branch.ended = bool(abs(branch.state[4]) < self._tiny)
            self.__dict__.pop("table", None)
        arrived = bool(sense * (wanted - branch.state[0]) <= self._tiny)
        if branch.exhausted and not arrived:
            raise PathError(
                f"{self.name} must be traced to pi = {wanted:.6g} in {MOST_STEPS} steps (got to {branch.state[0]:.6g} from "
                f"{self.start:.6g}); stay nearer to its seed, or move the seed"
            )
        return arrived

    @functools.cached_property
    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """The values of pi (n,), increasing, and the points (n, 3) traced so far."""
        back, ahead = self._branches[-1], self._branches[1]
        parameters = np.concatenate([np.concatenate(back.parameters)[:0:-1], np.concatenate(ahead.parameters)])
        return parameters, np.concatenate([np.concatenate(back.points)[:0:-1], np.concatenate(ahead.points)])

    def guesses(self, parameters: np.ndarray) -> np.ndarray:
        """Return points (n, 3) near the path at parameters (n,) inside the table: on its chords."""
        known, points = self.table
        return np.column_stack([np.interp(parameters, known, points[:, k]) for k in range(3)])

    def _ending(self, sense: int, wanted: float) -> str:
        """Return why pi does not reach a value: what it does a little farther along the path than the trace got."""
        parameters, points = self.table
        at, point = (parameters[0], points[0]) if sense < 0 else (parameters[-1], points[-1])
        place = (np.round(point, 6) + 0.0).tolist()
        length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum() + np.linalg.norm(point - self.seed)
        way = AHEAD * max(length, self.width * 1e-3)
        values, ahead = self._beyond(point, sense, way)
        expected = float(np.linalg.norm(ahead - point)) * self._slope(point)
        change = float(values[2]) - at
        if self.period is not None:
            change -= self.period * round(change / self.period)
        if np.isfinite(change) and abs(change) > JUMP * abs(self.width) + 1e3 * expected:
            remedy = (
                "write an angle with atan2 and give its period"
                if self.period is None
                else f"give the period of pi, it is no whole part of {self.period:.6g}"
            )
            return (
                f"pi of {self.name} must be continuous along the path (got a jump from {at:.6g} to {values[2]:.6g} at {place}); "
                f"{remedy}"
            )
        if np.linalg.norm(ahead - point) > FAR * way or self._turned(point, ahead):
            return (
                f"{self.name} must be smooth (got a corner or a gap at {place}, where pi is {at:.6g}); "
                "join s1 and s2 more smoothly, or end the domain before"
            )
        side = "below" if sense < 0 else "beyond"
        return (
            f"pi of {self.name} must grow along the path as far as {wanted:.6g} (got nothing {side} {at:.6g}, at {place}); "
            "choose another pi, or a domain that it runs over"
        )

    def _slope(self, point: np.ndarray) -> float:
        return float(np.linalg.norm(np.array(self.system(point)[1])[2]))

    def _turned(self, point: np.ndarray, ahead: np.ndarray) -> bool:
        """Return whether the path runs another way at two places near each other, as at a corner."""
        tangents = []
        for place in (point, ahead):
            rows = np.array(self.system(place)[1])
            across = np.cross(rows[0], rows[1])
            tangents.append(across / np.linalg.norm(across))
        return bool(abs(tangents[0] @ tangents[1]) < SAME_WAY)

    def _beyond(self, point: np.ndarray, sense: int, way: float) -> tuple[np.ndarray, np.ndarray]:
        """Return (s1, s2, pi) and the point of the path a little farther on, whatever pi does in between."""
        rows = np.array(self.system(point)[1])
        across = np.cross(rows[0], rows[1])
        ahead = point + sense * way * np.sign(across @ rows[2]) * across / np.linalg.norm(across)
        for _ in range(NEWTON_STEPS):
            values, rows = (np.array(value) for value in self.system(ahead))
            if not np.all(np.isfinite(rows)):
                break
            ahead = ahead - np.linalg.pinv(rows[:2]) @ values[:2, 0]
        return np.array(self.system(ahead)[0]).ravel(), ahead

    @functools.cached_property
    def _scan(self) -> Any:
        """The function (state (5,), sense, wanted) -> states (5, CHUNK) after each of a chunk of tries."""
        state, sense, wanted = ca.SX.sym("state", 5), ca.SX.sym("sense"), ca.SX.sym("wanted")
        parameter, point = state[0], state[1:4]
        first = self.width / FIRST_STEPS
        longest = ca.fmax(first, ca.fabs(parameter - self.start) / FARTHER if self.period is None else first)
        step = sense * ca.fmin(ca.fmin(ca.fabs(state[4]), longest), ca.fabs(wanted - parameter))
        tangent = _column(self.system(point)[1])
        predicted = point + step * tangent
        found = predicted
        for _ in range(NEWTON_STEPS):
            found = found + newton_step(self.system, found, parameter + step, self.period)
        size = ca.norm_2(found - point)
        off = ca.norm_2(found - predicted)
        after = _column(self.system(found)[1])
        left = ca.norm_2(newton_step(self.system, found, parameter + step, self.period))
        good = ca.logic_and(off < BENT * size, left < CONVERGED * (1 + ca.norm_2(found)))
        good = ca.logic_and(good, ca.dot(tangent, after) > SAME_WAY * ca.norm_2(tangent) * ca.norm_2(after))
        arrived = ca.fabs(wanted - parameter) <= self._tiny
        grown = ca.if_else(ca.fabs(step) < ca.fabs(state[4]), state[4], step * ca.if_else(off < STRAIGHT * size, 2, 1))
        tried = ca.if_else(good, ca.vertcat(parameter + step, found, grown), ca.vertcat(parameter, point, step / 4))
        following = ca.if_else(arrived, state, tried)
        return ca.Function("trace", [state, sense, wanted], [following]).mapaccum(CHUNK)


def newton_step(system: Any, position: Any, parameter: Any, period: float | None) -> Any:
    """Graph: return the Newton step SX (3,) from a position to where s1 = s2 = 0 and pi has a value."""
    values, rows = system(position)
    missing = parameter - values[2]
    if period is not None:
        missing = missing - period * ca.floor(missing / period + 0.5)
    return ca.mtimes(inverted(rows)[0], ca.vertcat(-values[:2], missing))


def inverted(matrix: Any) -> tuple[Any, Any]:
    """Graph: return the inverse of an SX (3, 3) by cross products of its rows, and its determinant."""
    first, second, third = (matrix[i, :].T for i in range(3))
    columns = ca.horzcat(ca.cross(second, third), ca.cross(third, first), ca.cross(first, second))
    determinant = ca.dot(first, columns[:, 0])
    return columns / determinant, determinant


def _column(rows: Any) -> Any:
    """Graph: return the derivative of the path's point with respect to pi, from the gradients."""
    return inverted(rows)[0][:, 2]

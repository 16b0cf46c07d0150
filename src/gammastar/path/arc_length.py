"""Metres along a path: arc length by parameter and back, from the path's jets.

The speed |sigma'| and its first two derivatives at both ends of a cell give the integral of a quintic, order 6; cells are halved
until that changes nothing.  Between the nodes the same rule holds from the node before.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gammastar.errors import PathError

CELLS = 64  # of the domain, and of every doubling beyond it
TOLERANCE = 1e-10  # of a cell's length: by how much halving it may change that; the halves are 64 times more exact
SMALL = 1e-6  # of the domain, or of the cells together: a cell is not held to its own length below that
MOST_NODES = 200_000
LEVELS = 48  # of halving
DOUBLINGS = 60  # of what is known of an open path
STEPS = 60  # of Newton towards a length, or halving where it leaves the cell
CONVERGED = 1e-14  # relative

Jets = Callable[[np.ndarray], np.ndarray]


class ArcLength:
    """Arc length [m] from the start of a path's domain, known as far as it has been asked for."""

    def __init__(self, name: str, jets: Jets, domain: tuple[float, float], is_closed: bool) -> None:
        self._name, self._jets, self._is_closed = name, jets, is_closed
        self._low, self._span = domain[0], domain[1] - domain[0]
        self.total = 0.0  # of the domain
        self._nodes, self._rates = self._resolved(*domain)
        self._lengths = np.concatenate(
            [[0.0], np.cumsum(integrals(np.diff(self._nodes), self._rates[:-1], self._rates[1:]))]
        )
        self.total = float(self._lengths[-1])

    def at(self, parameters: np.ndarray) -> np.ndarray:
        """Return the arc lengths (n,) [m] at parameters (n,), whole rounds included."""
        rounds = np.floor((parameters - self._low) / self._span) if self._is_closed else np.zeros(len(parameters))
        inside = parameters - rounds * self._span
        if not self._is_closed and inside.size:
            self._cover(float(inside.min()), float(inside.max()))
        before = np.clip(np.searchsorted(self._nodes, inside, side="right") - 1, 0, len(self._nodes) - 2)
        return np.asarray(rounds * self.total + self._after(before, inside)[0])

    def parameters(self, lengths: np.ndarray) -> np.ndarray:
        """Return the parameters (n,) at arc lengths (n,) [m], the inverse of `at`."""
        rounds = np.floor(lengths / self.total) if self._is_closed else np.zeros(len(lengths))
        wanted = lengths - rounds * self.total
        if not self._is_closed and wanted.size:
            self._reach(float(wanted.min()), float(wanted.max()))
        before = np.clip(np.searchsorted(self._lengths, wanted, side="right") - 1, 0, len(self._nodes) - 2)
        low, high = self._nodes[before], self._nodes[before + 1]
        share = (wanted - self._lengths[before]) / (self._lengths[before + 1] - self._lengths[before])
        found = low + share * (high - low)
        for _ in range(STEPS):
            length, speed = self._after(before, found)
            missing = wanted - length
            low, high = np.where(missing > 0, found, low), np.where(missing > 0, high, found)
            following = found + missing / speed
            following = np.where((following >= low) & (following <= high), following, (low + high) / 2)
            steps, found = np.abs(following - found), following
            if np.all(steps <= CONVERGED * (self._span + np.abs(found))):
                break
        return np.asarray(found + rounds * self._span)

    def _after(self, before: np.ndarray, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the arc lengths (n,) at parameters behind nodes (n,), and the speeds there."""
        rates = speed_jets(self._jets(parameters))
        steps = parameters - self._nodes[before]
        return self._lengths[before] + integrals(steps, self._rates[before], rates), rates[:, 0]

    def _cover(self, low: float, high: float) -> None:
        """Extend what is known of an open path to a stretch of the parameter, at least."""
        while low < self._nodes[0]:
            self._extend(-1, max(self._nodes[0] - low, self._nodes[-1] - self._nodes[0]))
        while high > self._nodes[-1]:
            self._extend(1, max(high - self._nodes[-1], self._nodes[-1] - self._nodes[0]))

    def _reach(self, low: float, high: float) -> None:
        """Extend what is known of an open path to a stretch of the arc length [m], at least."""
        for _ in range(DOUBLINGS):
            if low >= self._lengths[0] and high <= self._lengths[-1]:
                return
            side = -1 if low < self._lengths[0] else 1
            self._extend(side, self._nodes[-1] - self._nodes[0])
        raise PathError(
            f"{self._name} must be as long as is asked for (got {self._lengths[0]:.6g} to {self._lengths[-1]:.6g} m however far its "
            "parameter runs); ask for less"
        )

    def _extend(self, side: int, width: float) -> None:
        """Make one end of an open path known farther by a width of the parameter."""
        ends = (self._nodes[-1], self._nodes[-1] + width) if side > 0 else (self._nodes[0] - width, self._nodes[0])
        nodes, rates = self._resolved(*ends)
        lengths = np.concatenate([[0.0], np.cumsum(integrals(np.diff(nodes), rates[:-1], rates[1:]))])
        if side > 0:
            known = self._nodes, self._rates, self._lengths
            added = nodes[1:], rates[1:], self._lengths[-1] + lengths[1:]
        else:
            known = nodes[:-1], rates[:-1], self._lengths[0] + lengths[:-1] - lengths[-1]
            added = self._nodes, self._rates, self._lengths
        self._nodes, self._rates, self._lengths = (np.concatenate(pair) for pair in zip(known, added, strict=True))

    def _resolved(self, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Return nodes (n,) that resolve the length of a stretch, and the speed with two derivatives (n, 3) there."""
        nodes = np.linspace(low, high, CELLS + 1)
        rates = speed_jets(self._jets(nodes))
        is_open = np.ones(CELLS, dtype=bool)  # cells that are to be halved
        for _ in range(LEVELS):
            if not np.all(np.isfinite(rates)):
                bad = nodes[~np.isfinite(rates).all(axis=1)][0]
                raise PathError(
                    f"the length of {self._name} must be finite (got no speed at parameter {bad:.6g}); stay where it has one"
                )
            first, last = nodes[:-1][is_open], nodes[1:][is_open]
            middle = (first + last) / 2
            between = speed_jets(self._jets(middle))
            whole = integrals(last - first, rates[:-1][is_open], rates[1:][is_open])
            halves = integrals(middle - first, rates[:-1][is_open], between)
            halves += integrals(last - middle, between, rates[1:][is_open])
            poor = ~(
                np.abs(whole - halves) <= TOLERANCE * np.maximum(halves, SMALL * max(float(halves.sum()), self.total))
            )
            places = np.flatnonzero(is_open) + 1
            again = np.zeros(len(nodes) - 1, dtype=bool)
            again[places[poor] - 1] = True
            nodes, rates = np.insert(nodes, places, middle), np.insert(rates, places, between, axis=0)
            is_open = np.repeat(again, np.where(is_open, 2, 1))
            if not is_open.any() or len(nodes) > MOST_NODES:
                break
        return nodes, rates


def integrals(step: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return integrals (m,) over steps (m,) of the quintics with value and two derivatives (m, 3) given at both ends.

    Order 6: halving the step divides the error of the sum by 64.
    """
    mean, slope = (before + after) / 2, (before - after) / 10
    return np.asarray(step * mean[:, 0] + step**2 * slope[:, 1] + step**3 * mean[:, 2] / 60)


def speed_jets(jets: np.ndarray) -> np.ndarray:
    """Return |sigma'| and its first two derivatives (n, 3); at a cusp, where they do not exist, zeros."""
    first, second, third = jets[:, 1], jets[:, 2], jets[:, 3]
    speed = np.linalg.norm(first, axis=1)
    safe = np.where(speed > 0, speed, np.inf)
    with np.errstate(all="ignore"):
        rate = np.sum(first * second, axis=1) / safe
        bend = (np.sum(second * second + first * third, axis=1) - rate**2) / safe
    return np.column_stack([speed, rate, bend])

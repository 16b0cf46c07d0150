"""What chance does to a flight, as graphs of uniform random numbers: one pair of them for every purpose, axis and step.

`engine.uniforms` gives pair c of step k of a flight from the seed, the number of the flight, k and c alone.  So what one sensor draws
depends neither on what the others do nor on how long the flight is, and every back end draws the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine

ACROSS, UPRIGHT, LOST = range(3)  # pairs of a sensor: first two axes, third axis, whether the sample is lost
PER_SENSOR = 4
GUSTS, FIRST_GUSTS = 16, 20  # pairs of the first axis, and of the first gust along it, at step 0


@dataclass(frozen=True, eq=False)
class Draws:
    """Graph: the uniform numbers of one step."""

    pairs: tuple[int, ...]  # their numbers
    uniforms: Any  # SX (2 c,) in (0, 1), two for each pair

    def uniform(self, pair: int) -> Any:
        """Graph: return the two uniform numbers SX (2,) of a pair."""
        place = 2 * self.pairs.index(pair)
        return self.uniforms[place : place + 2]

    def normals(self, pair: int) -> Any:
        """Graph: return two independent standard normal numbers SX (2,): sqrt(-2 log u1) (cos 2 pi u2, sin 2 pi u2).

        Source: Box and Muller, "A note on the generation of random normal deviates", 1958.
        """
        first, second = ca.vertsplit(self.uniform(pair))
        angle = 2 * np.pi * second
        return ca.sqrt(-2 * ca.log(first)) * ca.vertcat(ca.cos(angle), ca.sin(angle))


def sensor_pairs(sensor: int, deviation: np.ndarray, dropout: float = 0.0) -> tuple[int, ...]:
    """Return the pairs that a sensor draws: those of the axes that have noise, and that of losses if there are any."""
    needed = {ACROSS: deviation[:2].any(), UPRIGHT: deviation[2] > 0, LOST: dropout > 0}
    return tuple(PER_SENSOR * sensor + part for part, is_needed in needed.items() if is_needed)


def sensor_errors(sensor: int, deviation: np.ndarray, draws: Draws) -> Any:
    """Graph: return the errors SX (3,) of a sample of a sensor with standard deviations (3,)."""
    parts = [ca.SX.zeros(2), ca.SX(0)]
    for part, axes in ((ACROSS, slice(0, 2)), (UPRIGHT, slice(2, 3))):
        if deviation[axes].any():
            drawn = draws.normals(PER_SENSOR * sensor + part)
            parts[part] = ca.DM(deviation[axes]) * drawn[: len(deviation[axes])]
    return ca.vertcat(*parts)


def gust_pairs(deviation: np.ndarray, first: int = GUSTS) -> tuple[int, ...]:
    """Return the pairs that gusts with standard deviations (3,) draw in a step, or at the start from `FIRST_GUSTS` on."""
    return tuple(first + axis for axis in range(3) if deviation[axis] > 0)


def evaluated(
    formula: Callable[[Any, Draws], Any], pairs: Sequence[int], seed: int, steps: np.ndarray, flight: int = 0
) -> np.ndarray:
    """Return a graph of the step and its draws as numbers (m, n) at steps (n,) of a flight."""
    step, uniforms = ca.SX.sym("step"), ca.SX.sym("uniforms", 2 * len(pairs))
    graph = ca.Function("drawn", [step, uniforms], [ca.densify(formula(step, Draws(tuple(pairs), uniforms)))])
    drawn = engine.uniforms(seed, flight, steps, pairs)
    return np.asarray(graph.map(len(steps))(np.asarray(steps, dtype=float)[None, :], drawn).full())

"""Where a curve is not of class C^5: the derivative that jumps, and the place.

Between two close parameters the jet of the first predicts the jet of the second.  Over a smooth stretch the residual of
every derivative shrinks with the step; where derivative k jumps it stays, however close the two come.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar.path.base import JET_ORDER
from gammastar.path.sampling import Place, Samples, taylor_residuals

JUMP = 1e-7  # relative to the largest value of the derivative; rounding of a long spline's fifth derivative stays below
LEFT = 1e-2  # part of the first residual that a jump keeps to the end; a derivative with infinite slope keeps less
CANDIDATES = 48  # intervals that are narrowed for each derivative
PIECES = 8  # into which a pass cuts each interval
PASSES = 16  # two pieces of 8 are kept: 4^16 = 4e9 in the place
SHOWN = 3  # places that are named; the others are counted
ORDERS = ("point", "first derivative", "second derivative", "third derivative", "fourth derivative", "fifth derivative")
SMOOTH = {  # operations of a graph that have all derivatives everywhere
    ca.OP_INPUT,
    ca.OP_CONST,
    ca.OP_ASSIGN,
    ca.OP_NEG,
    ca.OP_ADD,
    ca.OP_SUB,
    ca.OP_MUL,
    ca.OP_SQ,
    ca.OP_TWICE,
    ca.OP_SIN,
    ca.OP_COS,
    ca.OP_EXP,
    ca.OP_ATAN,
    ca.OP_SINH,
    ca.OP_COSH,
    ca.OP_TANH,
}
SWITCHES = {  # operations that take another formula beyond some place
    ca.OP_FABS,
    ca.OP_FMIN,
    ca.OP_FMAX,
    ca.OP_LT,
    ca.OP_LE,
    ca.OP_EQ,
    ca.OP_NE,
    ca.OP_IF_ELSE_ZERO,
}
SAME_PLACE = 1e-6  # of the domain: jumps closer than this are one


class Jump(NamedTuple):
    """A place where a curve is not smooth enough."""

    parameter: float
    order: int  # of the lowest derivative that jumps or has no value; 0 is the point itself
    size: float  # of the jump, in units of the derivative; not finite when the derivative has no value
    knot: int | None  # index of the knot declared there


def jumps(samples: Samples) -> list[Jump]:
    """Return every jump found in the point and its first five derivatives, by place, the lowest order at each."""
    found = [(float(p), _first_broken(samples.path.jets(np.array([p]))[0]), float("inf")) for p in samples.broken]
    return _merged(samples, found + _seam(samples) + _inside(samples))


def jump_at_seam(samples: Samples) -> list[Jump]:
    """Return the jump where a closed path comes back to its start, if there is one."""
    return _merged(samples, _seam(samples))


def jumping(name: str, jumps: list[Jump], places: list[Place]) -> str:
    """Return why a path that is not of class C^5 is refused."""
    parts = []
    for jump, place in list(zip(jumps, places, strict=True))[:SHOWN]:
        what = f"a jump of the {ORDERS[jump.order]}"
        if not math.isfinite(jump.size):
            what = f"no finite {ORDERS[jump.order]}"
        elif jump.order < 2:
            what = ("a gap", "a corner")[jump.order]
        parts.append(f"{what} at {place}" if jump.knot is None else f"{what} at knot {jump.knot}, {place}")
    left = len(jumps) - SHOWN
    more = f" and {left} more place{'s' if left > 1 else ''}" if left > 0 else ""
    return (
        f"{name} must be five times continuously differentiable (got {'; '.join(parts)}{more}); "
        "join the pieces more smoothly, or fly waypoints, which a smooth spline connects"
    )


def may_bend(function: Any) -> bool:
    """Return whether a graph of a parameter holds an operation that is not smooth everywhere, such as abs, a quotient or a root.

    Its other inputs, if there are any, are numbers that are given later.
    """
    constant: dict[int, float | None] = {}  # what each register holds, if it is a number; NaN where it is given later
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        reads, writes = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            continue
        if operation == ca.OP_INPUT:
            constant[writes[0]] = None if reads[0] == 0 else math.nan
            continue
        values = [constant.get(register) for register in reads]
        divisor = exponent = values[-1] if values else None
        is_smooth = operation in SMOOTH or (operation == ca.OP_DIV and divisor is not None)
        if operation in {ca.OP_POW, ca.OP_CONSTPOW} and exponent is not None:
            is_smooth = exponent >= 0 and exponent == int(exponent)
        if not is_smooth:
            return True
        constant[writes[0]] = function.instruction_constant(k) if operation == ca.OP_CONST else None
    return False


def has_switches(function: Any) -> bool:
    """Return whether a graph holds an operation that takes another formula beyond some place, such as abs or if_else."""
    return any(function.instruction_id(k) in SWITCHES for k in range(function.n_instructions()))


def _merged(samples: Samples, found: list[tuple[float, int, float]]) -> list[Jump]:
    """Return one jump for each place, of the lowest order found there, by place."""
    declared = samples.path.knots
    result: list[Jump] = []
    for parameter, order, size in sorted(found, key=lambda each: each[1]):
        if all(_separation(samples, parameter, other.parameter) > SAME_PLACE * samples.span for other in result):
            nearest = int(np.argmin(np.abs(declared - parameter))) if declared.size else None
            if nearest is not None and abs(declared[nearest] - parameter) > SAME_PLACE * samples.span:
                nearest = None
            result.append(Jump(parameter if nearest is None else float(declared[nearest]), order, size, nearest))
    return sorted(result)


def _first_broken(jet: np.ndarray) -> int:
    """Return the lowest derivative of a jet (6, 3) that is not finite."""
    return int(np.argmin(np.isfinite(jet).all(axis=1)))


def _separation(samples: Samples, first: float, second: float) -> float:
    gap = abs(first - second)
    return min(gap, samples.span - gap) if samples.closed else gap


def _seam(samples: Samples) -> list[tuple[float, int, float]]:
    """Return the jump where a closed path comes back to its start, if there is one."""
    if not samples.closed:
        return []
    gaps = np.linalg.norm(samples.jets[-1] - samples.jets[0], axis=1)
    orders = np.flatnonzero(gaps > JUMP * samples.scales)
    return [(samples.low, int(orders[0]), float(gaps[orders[0]]))] if orders.size else []


def _inside(samples: Samples) -> list[tuple[float, int, float]]:
    """Return the jumps between samples: suspicious intervals, cut again and again at their largest residual."""
    intervals, orders, residuals = _suspects(samples)
    lower, upper = samples.parameters[intervals], samples.parameters[intervals + 1]
    first, steps = residuals.copy(), np.arange(PIECES + 1) / PIECES
    for _ in range(PASSES):
        if not intervals.size:
            return []
        grid = lower[:, None] + (upper - lower)[:, None] * steps
        jets = samples.path.jets(grid.ravel()).reshape(len(grid), PIECES + 1, JET_ORDER + 1, 3)
        rows = np.arange(len(grid))
        with np.errstate(invalid="ignore", over="ignore"):
            pieces = np.linalg.norm(taylor_residuals(grid, jets)[rows, :, orders], axis=2)
        pieces = np.where(np.isnan(pieces), np.inf, pieces)  # a piece that ends on a value that does not exist
        pairs = pieces[:, 1:] + pieces[:, :-1]  # a value near a pole of a derivative spoils the next piece as well
        top = np.argmax(pairs, axis=1)
        lower, upper, residuals = grid[rows, top], grid[rows, top + 2], pieces.max(axis=1)
        kept = (residuals > JUMP * samples.scales[orders]) & (residuals > LEFT * first)
        intervals, orders, first = intervals[kept], orders[kept], first[kept]
        lower, upper, residuals = lower[kept], upper[kept], residuals[kept]
    return [
        (float(place), int(order), float(size))
        for place, order, size in zip((lower + upper) / 2, orders, residuals, strict=True)
    ]


def _suspects(samples: Samples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return intervals, orders and residuals (m,) to be narrowed: unlike their neighbours, or beside a declared knot."""
    step = np.diff(samples.parameters)
    residuals = taylor_residuals(samples.parameters, samples.jets)
    sizes = np.linalg.norm(residuals, axis=2)
    at_knots = np.searchsorted(samples.parameters, samples.path.knots)
    beside = np.unique(np.clip(np.concatenate([at_knots - 1, at_knots]), 0, len(step) - 1))
    intervals, orders = [], []
    for order in range(JET_ORDER + 1):
        growth = step[:, None] ** (JET_ORDER + 1 - order)
        smooth = np.pad(residuals[:, order] / growth, ((2, 2), (0, 0)), mode="edge")
        guesses = 2 * smooth[1:-3] - smooth[:-4], 2 * smooth[3:-1] - smooth[4:]  # from the two before, the two behind
        unlike = [np.linalg.norm(residuals[:, order] - growth * guess, axis=1) for guess in guesses]
        chosen = np.union1d(np.argsort(-np.minimum(*unlike))[:CANDIDATES], beside)
        chosen = chosen[sizes[chosen, order] > JUMP * samples.scales[order]]
        intervals.append(chosen)
        orders.append(np.full(len(chosen), order))
    rows, columns = np.concatenate(intervals), np.concatenate(orders)
    return rows, columns, sizes[rows, columns]

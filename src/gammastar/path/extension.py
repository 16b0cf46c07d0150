"""Straight on beyond the ends of an open spline: its bend fades out first, so that the whole stays C^6.

At its end a spline of least snap still turns: its second and third derivatives are not zero, and a straight line joined there
would be C^1 only.  The fade keeps all derivatives 0 ... 6 at the end and takes 2 ... 6 to zero in five pieces of
degree 7, as many as it has conditions.  What the second derivative at the end does to it falls to zero without a change of sign, and
what the third does rises and falls likewise: nothing swings.  The line beyond leaves in the direction that is reached then, turned from
the tangent at the end by about half the curvature times the length of the fade.  (To come back onto that tangent the fade would
have to bend both ways, with some six times the third derivative and fifteen times the fourth.)
"""

from __future__ import annotations

import math

import numpy as np

from gammastar.checks import magnitude, shortened
from gammastar.errors import InputError, PathError
from gammastar.path.interpolation import STANDSTILL
from gammastar.path.spline import DEGREE, SMOOTH, Spline, derivatives

PIECES = 5  # of a fade: each has one free seventh derivative, and five derivatives are to vanish
FADES = (1.0, 0.5, 0.25, 0.1)  # of two segments, tried in turn: a shorter fade is sharper but closer to the tangent
_FADING = range(2, SMOOTH + 1)


def extended(spline: Spline, before: float = 0.0, after: float = 0.0, blend: float | None = None) -> Spline:
    """Return an open spline that runs on straight beyond its ends, C^6; inside, nothing of it changes, its parameter neither.

    Args:
        spline: Open.
        before: How far the parameter runs ahead of the first knot; the length added is that times |sigma'| at the end. Zero
            leaves that end as it is.
        after: Likewise beyond the last knot.
        blend: How much of that the bend takes to fade out [m], below both; by default the longer of the end segment and the
            mean one, at most half of the extension.  A short fade is sharp: snap grows as its inverse square.

    Raises:
        InputError: The spline is closed, or a length is negative or no number, or the fade is not shorter than the extension.
        PathError: The curve would stand still in the fade; a shorter one helps.
    """
    if spline.closed:
        raise InputError("only an open path is extended (got a closed one); leave the extension out")
    before, after = (
        magnitude(before, "before [path parameter]", at_least=0),
        magnitude(after, "after [path parameter]", at_least=0),
    )
    if blend is not None and before == after == 0:
        raise InputError(
            f"blend needs an extension (got {shortened(blend)} m, and nothing before or after); give before or after"
        )
    knots, coefficients = [spline.knots], [spline.coefficients]
    if after > 0:
        steps, pieces = _continued(spline, after, blend, 1)
        knots.append(spline.knots[-1] + np.cumsum(steps))
        coefficients.append(pieces)
    if before > 0:
        steps, pieces = _continued(spline, before, blend, -1)
        knots.insert(0, spline.knots[0] - np.cumsum(steps)[::-1])
        coefficients.insert(0, _reversed(steps, pieces))
    result = Spline(np.concatenate(knots), np.concatenate(coefficients))
    parameter, speed = result.slowest()
    if speed <= STANDSTILL:
        raise PathError(
            f"the extension must not stand still (got zero speed at parameter {parameter:.4g} m); shorten its blend"
        )
    return result


def run_out(spline: Spline) -> Spline:
    """Return an open spline with a fade and a straight line at both ends, whose lines may be followed as far as one likes.

    Raises:
        PathError: The curve would stand still in every fade that was tried.
    """
    steps = spline.lengths
    before, after = (2 * max(float(length), float(steps.mean())) for length in (steps[0], steps[-1]))
    for shorter in FADES[:-1]:
        try:
            return extended(spline, before * shorter, after * shorter)
        except PathError:
            continue
    return extended(spline, before * FADES[-1], after * FADES[-1])


def _continued(spline: Spline, length: float, blend: float | None, sense: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps (6,) and coefficients (6, 3, 8) of a fade and a line that follow the last knot, or precede the first.

    Before the first knot (sense -1) both are those of the spline run backwards.
    """
    side = -1 if sense > 0 else 0
    if blend is None:
        blend = min(max(spline.lengths[side], spline.lengths.mean()), length / 2)
    elif magnitude(blend, "blend [m]", above=0) >= length:
        raise InputError(f"blend must be shorter than the extension (got {blend:g} m of {length:g} m); shorten it")
    jet = spline.evaluate(spline.knots[side], SMOOTH)[0].T
    fade = _fade(jet * (sense * float(blend)) ** np.arange(SMOOTH + 1)) / float(blend) ** np.arange(DEGREE + 1)
    steps = np.append(np.full(PIECES, blend / PIECES), length - blend)
    line = np.zeros((1, 3, DEGREE + 1))
    line[0, :, :2] = derivatives(fade[-1], np.array(blend / PIECES), 1)
    return steps, np.concatenate([fade, line])


def _fade(jet: np.ndarray) -> np.ndarray:
    """Return the pieces (5, 3, 8) of a curve on the unit interval with a jet (3, 7) at 0 and no derivatives 2 ... 6 at 1."""
    highest = -jet[:, 2:] @ _response().T  # (3, 5) seventh derivatives
    factorials = np.array([math.factorial(k) for k in range(SMOOTH + 1)])
    pieces = []
    for k in range(PIECES):
        piece = np.column_stack([jet / factorials, highest[:, k] / math.factorial(DEGREE)])
        pieces.append(piece)
        jet = derivatives(piece, np.array(1 / PIECES), SMOOTH)
    return np.stack(pieces)


def _response() -> np.ndarray:
    """Return the matrix (5, 5) from derivatives 2 ... 6 at 0 to minus the seventh derivatives that make them vanish at 1."""
    edges = 1 - np.arange(PIECES + 1) / PIECES
    forced = [(edges[:-1] ** (DEGREE - k) - edges[1:] ** (DEGREE - k)) / math.factorial(DEGREE - k) for k in _FADING]
    free = [[1 / math.factorial(j - k) if j >= k else 0.0 for j in _FADING] for k in _FADING]
    return np.linalg.solve(np.array(forced), np.array(free))


def _reversed(steps: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Return the coefficients of the same segments run backwards, the last one first."""
    jets = derivatives(coefficients, steps, DEGREE)
    signs = np.array([(-1) ** k / math.factorial(k) for k in range(DEGREE + 1)])
    return np.asarray((jets * signs)[::-1])

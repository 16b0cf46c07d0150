"""What a path and its certificate cannot use is refused in one sentence that names it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from gammastar.certificate import certify
from gammastar.errors import GammastarError
from gammastar.law import Point
from gammastar.path import catalogue as paths
from gammastar.path.formula import curve_from_formula
from gammastar.path.placement import placed
from strategies import PAPER_VEHICLE as VEHICLE

CIRCLE = paths.circle()
GATES = [(0, 0, 0), (1, 0, 0), (2, 1, 0)]

REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "certificate of no vehicle": (lambda: certify(3, CIRCLE), r"vehicle must be a Vehicle \(got int\)"),
    "certificate of no path": (lambda: certify(VEHICLE, 3), r"path must be a Path \(got int\)"),
    "no limits": (lambda: certify(VEHICLE, CIRCLE, limits=3), r"limits must be a Limits \(got int\)"),
    "nothing for limits": (lambda: certify(VEHICLE, CIRCLE, limits=0), r"limits must be a Limits \(got int\)"),
    "length from NaN": (lambda: CIRCLE.length(np.nan), r"first \[path parameter\] must be finite \(got nan\)"),
    "length to infinity": (lambda: CIRCLE.length(0, np.inf), r"last \[path parameter\] must be finite \(got inf\)"),
    "arc length at NaN": (lambda: CIRCLE.arc_length([0, np.nan]), r"parameters must be finite \(got \[0.0, nan\]\)"),
    "place at infinity": (lambda: CIRCLE.at_length([np.inf]), r"lengths \[m\] must be finite \(got \[inf\]\)"),
    "place at a text": (lambda: CIRCLE.at_length("far"), r"lengths \[m\] must be numbers .* \(got .*far"),
    "places in rows of rows": (
        lambda: CIRCLE.at_length([[1, 2]]),
        r"lengths \[m\] must have shape \(1,\) \(got \(1, 2\)\)",
    ),
    "closed in words": (lambda: gs.waypoints(GATES, closed="no"), r"closed must be True or False \(got 'no'\)"),
    "blend alone": (lambda: gs.waypoints(GATES, blend=0.1), r"blend needs an extension \(got 0.1 m, and nothing"),
    "endless start": (lambda: gs.waypoints(GATES, before=1e300), r"before must be at most 1e\+12 m \(got 1e\+300 m\)"),
    "endless end": (lambda: gs.waypoints(GATES, after=1e49), r"after must be at most 1e\+12 m \(got 1e\+49 m\)"),
    "three ends": (lambda: curve_from_formula("t", 0, 0, "t", ends=(0, 1, 2)), r"ends of formula must be a list of 2"),
    "ends turned round": (
        lambda: curve_from_formula("t", 0, 0, "t", ends=(1, 0)),
        r"the ends of formula must be an interval",
    ),
    "ends that are no numbers": (
        lambda: gs.Curve(lambda t: (t, 0, 0), ends=("a", 1)),
        r"ends of curve must be numbers",
    ),
    "domain and ends": (
        lambda: curve_from_formula("t", 0, 0, "t", domain=(0, 1), ends=(0, 2)),
        r"formula must have a domain or ends \(got \[0, 1\] and \[0, 2\]\); give one of them",
    ),
    "point too far to tell": (lambda: Point(1e17).resolved(CIRCLE, 0.0), r"a point must name a place .* \(got 1e\+17,"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_input_is_refused_in_one_sentence(name: str) -> None:
    """What was expected, what came, and what to do."""
    call, message = REFUSED[name]
    with pytest.raises(GammastarError, match=message) as raised:
        call()
    assert "; " in str(raised.value)
    assert "\n" not in str(raised.value)


def test_ends_may_be_placed_and_a_far_point_may_be_near_enough() -> None:
    """The other side of two refusals: a copy of a curve, placed or with other ends, and many laps that rounding stands."""
    ended = curve_from_formula("t", 0, 0, "t", ends=(0, 2))
    assert placed(ended, (1, 2, 3)).ends == (0, 2)
    assert dataclasses.replace(paths.lemniscate(kind="rising"), ends=(0, 3)).domain == (0, 3)
    assert Point(1e6).resolved(CIRCLE, 1e6 - 1).pieces is not None

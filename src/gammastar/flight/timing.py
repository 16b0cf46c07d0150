"""How a duration is cut into rows of a record and integration steps."""

from __future__ import annotations

import math

from gammastar.errors import InputError

MOST_ROWS = 2_000_000  # of a record, some 2 GB
ROUNDING = 1e-6  # of an interval, by which a duration may exceed whole intervals without another one
MOST_SUBSTEPS = 1000  # a control interval longer than this many integration steps is a slip, not a wish


def interval_of(feedback: str, step: float, rate: float | None) -> tuple[float, int]:
    """Return the interval [s] between rows and the integration steps in it, from a longest step [s] and a control rate [Hz].

    Raises:
        InputError: A rate with continuous feedback, none with sampled feedback, or far more steps than an interval can
            need.
    """
    if feedback == "continuous":
        if rate is not None:
            raise InputError(
                f"continuous feedback has no control rate (got {rate:g} Hz); leave it out, or choose feedback 'start' or 'middle'"
            )
        return step, 1
    if rate is None:
        raise InputError(f"feedback {feedback!r} needs a control rate [Hz] (got none); give one, such as 400")
    wanted = 1 / rate / step
    if not wanted <= MOST_SUBSTEPS + ROUNDING:
        raise InputError(
            f"a control interval must hold at most {MOST_SUBSTEPS} integration steps (got {wanted:.4g}); raise the step or the rate"
        )
    return 1 / rate, max(1, math.ceil(wanted - ROUNDING))


def timing(feedback: str, step: float, rate: float | None, duration: float) -> tuple[float, int, int]:
    """Return the interval [s] between rows, the integration steps in it, and the intervals that cover a duration [s].

    Continuous feedback divides the duration evenly into steps no longer than `step`; sampled feedback flies whole control
    intervals, the last of which may end after the duration.

    Raises:
        InputError: See `interval_of`; or the flight has too many rows.
    """
    interval, substeps = interval_of(feedback, step, rate)
    wanted = duration / interval
    if not wanted <= MOST_ROWS:
        raise InputError(
            f"a flight must have at most {MOST_ROWS} rows (got {wanted:.4g}, {duration:g} s at {interval:g} s); shorten it, or "
            "raise the step or lower the rate"
        )
    rows = max(1, math.ceil(wanted - ROUNDING))
    if feedback == "continuous" and abs(wanted - rows) > ROUNDING:
        interval = duration / rows
    return interval, substeps, rows

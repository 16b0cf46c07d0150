"""What is worth knowing of a flight, computed while it flies: a step around a loop's step that carries numbers along.

The state is the loop's, the number of the status, and one number a measure.  Memory does not grow with the length of a flight, and every
number is that of `FlightRecord.summary` where both tell it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.flight.autopiloted import AutopilotLoop
from gammastar.flight.loop import ClosedLoop
from gammastar.flight.record import Status
from gammastar.flight.watch import CODES, LARGEST, Breakdown, nearest_singularity, status_code, turns_too_far
from gammastar.law.piecewise import DATA_SIZE
from gammastar.vehicle import StateGraph

LATE = 0.75  # of a flight, from which its last quarter counts


class Parameters(NamedTuple):
    """What a flight is judged by, as graphs or numbers."""

    least_thrust: Any  # [N], below it the flight ends
    late: Any  # [s], from when the last quarter counts
    within: Any  # [m], which counts as on the path
    first_end: Any  # parameter at which the path begins, -inf where it does not
    last_end: Any  # parameter at which it ends


class Row(NamedTuple):
    """Graph: what the measures take from one row."""

    number: Any
    distance: Any  # [m]
    is_late: Any
    is_outside: Any
    state: StateGraph
    torque: Any
    waiting: Any
    given_up: Any
    focal: Any
    drift: Any


def _of_late(value: Callable[[Row], Any]) -> Callable[[Any, Row], Any]:
    return lambda old, row: old + row.is_late * value(row)


def _most(value: Callable[[Row], Any]) -> Callable[[Any, Row], Any]:
    return lambda old, row: ca.fmax(old, value(row))


def _least(value: Callable[[Row], Any]) -> Callable[[Any, Row], Any]:
    return lambda old, row: ca.fmin(old, value(row))


# First value, and the next one from the one before and a row.
MEASURES: dict[str, tuple[float, Callable[[Any, Row], Any]]] = {
    "rows": (0.0, lambda old, row: old + 1),
    "distance": (np.nan, lambda old, row: row.distance),
    "max_distance": (0.0, _most(lambda row: row.distance)),
    "settled_row": (0.0, lambda old, row: ca.if_else(row.is_outside, row.number + 1, old)),
    "max_settled": (0.0, lambda old, row: ca.if_else(row.is_outside, 0, ca.fmax(old, row.distance))),
    "late_rows": (0.0, _of_late(lambda row: 1)),
    "late_squares": (0.0, _of_late(lambda row: row.distance**2)),
    "max_late": (0.0, lambda old, row: ca.if_else(row.is_late, ca.fmax(old, row.distance), old)),
    "min_thrust": (np.inf, _least(lambda row: row.state.thrust)),
    "max_thrust": (-np.inf, _most(lambda row: row.state.thrust)),
    "thrust_sum": (0.0, lambda old, row: old + row.state.thrust),
    "thrust": (np.nan, lambda old, row: row.state.thrust),
    "thrust_rate": (np.nan, lambda old, row: row.state.thrust_rate),
    "max_rate": (0.0, _most(lambda row: ca.norm_2(row.state.angular_velocity))),
    "max_torque": (0.0, _most(lambda row: ca.norm_2(row.torque))),
    "max_speed": (0.0, _most(lambda row: ca.norm_2(row.state.velocity))),
    "drift": (0.0, _most(lambda row: row.drift)),
    "min_focal": (np.inf, _least(lambda row: row.focal)),
    "focal_sum": (0.0, lambda old, row: old + row.focal),
    "focal": (np.nan, lambda old, row: row.focal),
    "given_up": (0.0, _most(lambda row: row.given_up)),
    "waiting_rows": (0.0, lambda old, row: old + row.waiting),
}
BEFORE = "focal_before"  # the focal margin of the row before
NAMES = (*MEASURES, BEFORE)
FIRST = np.array([0.0, *(first for first, _ in MEASURES.values()), np.nan])  # status and measures before a flight
NEVER = np.array([CODES.index(Status.SINGULAR_START), *FIRST[1:]])  # and of one that could not start


def reduced(loop: ClosedLoop | AutopilotLoop) -> engine.Step:
    """Return the step of a loop that carries the measures along and ends with its status.

    Its parameters are those of the loop's step, and below them `Parameters`.
    """
    step = loop.step()
    key = ("reduced", loop.signature, loop.substeps)
    core = engine.compiled(key, lambda: _core(loop, step))
    return engine.Step(core, step.lookups, step.channels, step.size)


def _core(loop: ClosedLoop | AutopilotLoop, step: engine.Step) -> Any:
    """Return the core of the step around a loop's: a bad step is not taken, its row does not count, and afterwards nothing changes.

    The first row counts even if its step is bad, as long as it is finite: a record shows it too.
    """
    names = ("state", "parameters", "column", "rows")
    varying = step.core.size1_in(1)
    sizes = step.size + 1 + len(NAMES), varying + len(Parameters._fields), step.core.size1_in(2), step.core.size1_in(3)
    state, given, column, rows = (ca.SX.sym(name, size) for name, size in zip(names, sizes, strict=True))
    inner, status, kept = ca.vertsplit(state, [0, step.size, step.size + 1, sizes[0]])
    parameters, length = Parameters(*ca.vertsplit(given[varying:])), loop.interval / loop.substeps
    after, observed = step.core(inner, given[:varying], column, rows)
    is_first, is_seen = column[0] == 0, ca.fabs(ca.sum1(observed)) <= LARGEST
    code = status_code(after, observed, parameters.least_thrust, length, loop.is_ideal)
    code = ca.if_else(turns_too_far(inner, length), CODES.index(Status.UNRESOLVED), code)
    code = ca.if_else(ca.logic_and(is_first, ca.logic_not(is_seen)), CODES.index(Status.SINGULAR_START), code)
    goes, is_good = status == 0, code == 0
    counts = ca.logic_and(goes, ca.logic_or(is_good, ca.logic_and(is_first, is_seen)))
    measured = _measured(loop, inner, observed, rows[DATA_SIZE:], column[0], kept, parameters)
    results = [
        *_chosen(ca.logic_and(goes, is_good), after, inner),
        ca.if_else(goes, code, status),
        *_chosen(counts, measured, kept),
    ]
    return ca.Function("reduced", [state, given, column, rows], ca.cse([ca.vertcat(*results), ca.SX(0, 1)]))


def _measured(
    loop: ClosedLoop | AutopilotLoop, inner: Any, observed: Any, data: Any, number: Any, kept: Any, given: Parameters
) -> Any:
    """Graph: return the measures after a row, from those before it."""
    told, time = loop.row(inner, observed), number * loop.interval
    place = ca.vertcat(told.parameter, data)
    distance = loop.law.path.distance(told.state.position, place, (given.first_end, given.last_end))
    attitude = told.state.attitude
    drift = ca.mmax(ca.fabs(ca.vec(ca.mtimes(attitude.T, attitude) - ca.SX.eye(3))))
    judged = distance, time >= given.late, distance > given.within
    rest = told.state, told.torque, told.waiting, told.given_up, told.focal_margin, drift
    row, old = Row(number, *judged, *rest), dict(zip(NAMES, ca.vertsplit(kept), strict=True))
    new = [update(old[name], row) for name, (_, update) in MEASURES.items()]
    return ca.vertcat(*new, ca.if_else(old["rows"] > 0, old["focal"], row.focal))


def _chosen(condition: Any, first: Any, second: Any) -> list[Any]:
    """Graph: return the entries of one of two vectors; what is not chosen may be NaN."""
    return [ca.if_else(condition, a, b) for a, b in zip(ca.vertsplit(first), ca.vertsplit(ca.SX(second)), strict=True)]


def nothing(count: int) -> dict[str, np.ndarray]:
    """Return the columns (n,) of flights that did not start."""
    return {"flight": np.zeros(count, dtype=int), **columns_of(np.tile(NEVER[:, None], count), np.nan, np.nan, False)}


def columns_of(final: np.ndarray, masses: Any, interval: float, is_ideal: bool) -> dict[str, np.ndarray]:
    """Return what is told of flights by name, arrays (n,); NaN where there is nothing to tell, as of a last quarter that was not flown.

    Args:
        final: (1 + k, n) statuses and measures at the end.
        masses: True ones [kg].
        interval: [s] of control.
        is_ideal: Whether the law acts by itself.
    """
    status, told = final[0].astype(int), dict(zip(NAMES, final[1:], strict=True))
    rows = told["rows"]
    with np.errstate(invalid="ignore", divide="ignore"):
        means = told["thrust_sum"] / rows, told["focal_sum"] / rows
        at = Breakdown(told["thrust"], told["thrust_rate"], means[0], told["focal"], told[BEFORE], means[1])
        late = np.sqrt(told["late_squares"] / told["late_rows"])
    status = nearest_singularity(status, at, interval) if is_ideal else status
    settles, ends = told["settled_row"] < rows, status == 0
    names = np.array([each.name.lower() for each in CODES])
    columns = {
        "end_time_s": (rows - 1) * interval,
        "settling_time_s": np.where(settles, told["settled_row"] * interval, np.nan),
        "final_distance_m": told["distance"],
        "max_distance_m": told["max_distance"],
        "max_distance_after_settling_m": np.where(settles, told["max_settled"], np.nan),
        "max_distance_last_quarter_m": np.where(ends, told["max_late"], np.nan),
        "rms_distance_last_quarter_m": np.where(ends, late, np.nan),
        "min_thrust_N": told["min_thrust"],
        "max_thrust_N": told["max_thrust"],
        "peak_rate_rad_s": told["max_rate"],
        "peak_torque_N_m": told["max_torque"],
        "peak_speed_m_s": told["max_speed"],
        "min_free_fall_margin_m_s2": told["min_thrust"] / masses,
        "min_focal_margin": told["min_focal"],
        "so3_drift": told["drift"],
        "waiting_time_s": told["waiting_rows"] * interval,
    }
    columns = {name: np.where(rows > 0, values, np.nan) for name, values in columns.items()}
    return {"status": names[status], **columns, "given_up": np.round(told["given_up"]).astype(int)}

"""Fly a law: integrate the closed loop from a start and return the record."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from gammastar import engine
from gammastar.checks import number
from gammastar.errors import FlightError, InputError, SingularStartError, UnknownNameError
from gammastar.flight.integrator import integrator as integrator_by_name
from gammastar.flight.loop import FEEDBACKS, TRUE_PARAMETER, ClosedLoop, interval_of
from gammastar.flight.record import FlightRecord, Status
from gammastar.flight.sensors import SIZE as NOISE_SIZE
from gammastar.flight.sensors import SensorNoise
from gammastar.law import AnyReference, Heading, Law, Speed
from gammastar.vehicle import State, Vehicle
from gammastar.vehicle.state import SIZE as STATE_SIZE

MOST_STEPS = 5_000_000  # rows of a record, some 2 GB
SMALLEST_FOCAL_MARGIN = 1e-9
SMALLEST_THRUST = 1e-6  # of the thrust at the start; below it the law divides by rounding
RESOLVED_SHARE = 0.1  # of the first transverse error, by which a resolved flight may end beside its closed form
LARGEST_TURN = 1.0  # [rad] in one integration step; beyond it no method of fixed step resolves the motion
NEAR = 0.1  # of a margin's usual size: a flight that breaks down this near to a singularity broke down because of it


def fly(
    law: Law,
    start: State,
    *,
    speed: float | None = None,
    reference: AnyReference | None = None,
    duration: float = 20.0,
    step: float = 1e-3,
    feedback: str = "continuous",
    rate: float | None = None,
    integrator: str = "rkmk4",
    truth: Vehicle | None = None,
    noise: SensorNoise | None = None,
    seed: int = 0,
    yaw_reference: float = 0.0,
    heading: Heading | None = None,
    settled_within: float = 1e-3,
    progress: Callable[[int, int], None] | None = None,
    throw: bool = False,
) -> FlightRecord:
    """Fly a law from a start and return the record; it draws, prints and saves nothing.

    Args:
        law: From `design`.
        start: Where and how the flight begins; a thrust left open is the believed weight.
        speed: Constant speed along the path [path parameter/s], short for `reference=Speed(speed)`.
        reference: `Speed`, `Ramp`, `Point` or `Stop`; exactly one of `speed` and `reference` is given.
        duration: [s].
        step: Longest integration step [s].
        feedback: 'continuous' evaluates the law in every stage; 'start' and 'middle' hold the input over the control
            interval, computed from the state at its start, or from the state predicted for its middle (second order in
            the interval).
        rate: Control rate [Hz] of sampled feedback.
        integrator: 'rkmk4', 'cf4', 'carpenter-kennedy', 'lie-euler' or 'rk4'.
        truth: The vehicle that really flies, when the law's belief about it is wrong.
        noise: On what the law measures; needs sampled feedback.
        seed: Of the noise.
        yaw_reference: Constant reference of the yaw output [rad/s for the default output].
        heading: `Along`, `Azimuth` or `Towards` in place of a constant reference.
        settled_within: Distance [m] that counts as on the path in the summary.
        progress: Called with (steps done, steps in all).
        throw: Raise `FlightError` when the flight ends early; otherwise the record's status says so.

    Raises:
        SingularStartError: The law has no finite input at the start.
        FlightError: The flight ended early and `throw` is set.
    """
    for value, kind, name in ((law, Law, "law"), (start, State, "start")):
        if not isinstance(value, kind):
            raise InputError(f"{name} must be a gammastar {kind.__name__} (got {type(value).__name__}); make one first")
    if (speed is None) == (reference is None):
        raise InputError("a flight needs exactly one of speed and reference (got both or none); give one of them")
    wanted: AnyReference = Speed(speed) if speed is not None else reference  # type: ignore[assignment]
    duration, step = number(duration, "duration [s]", above=0), number(step, "step [s]", above=0)
    number(settled_within, "settled_within [m]", above=0)
    if feedback not in FEEDBACKS:
        raise UnknownNameError("feedback", feedback, FEEDBACKS)
    if rate is not None:
        rate = number(rate, "rate [Hz]", above=0)
    if noise is not None and feedback == "continuous":
        raise InputError(
            "sensor noise needs sampled feedback (got continuous); choose feedback 'start' or 'middle' and a rate"
        )
    interval, substeps = interval_of(feedback, step, rate)
    steps = max(1, round(duration / interval))
    if steps > MOST_STEPS:
        raise InputError(f"a flight must have at most {MOST_STEPS} rows (got {steps}); shorten it or take longer steps")
    x, parameter = law.start_vector(start)
    loop = ClosedLoop(
        law=law,
        truth=law.vehicle if truth is None else truth,
        reference=wanted.resolved(law.path, parameter),
        yaw=number(yaw_reference, "yaw reference") if heading is None else heading,
        integrator=integrator_by_name(integrator),
        feedback=feedback,  # type: ignore[arg-type]
        interval=interval,
        substeps=substeps,
        noisy=noise is not None,
    )
    first = loop.start(x, parameter)
    if not np.all(np.isfinite(first)):
        raise SingularStartError(
            "the law must have a finite input at the start (got NaN or infinity); move the start", {}
        )
    samples = np.zeros((NOISE_SIZE, steps + 1)) if noise is None else noise.samples(seed, steps + 1)
    exogenous = np.vstack([np.arange(steps + 1) * interval, samples])
    states, observations = engine.scan(
        loop.step(),
        first,
        exogenous,
        stop=lambda after, seen: _first_bad(after, seen, SMALLEST_THRUST * x[18], interval / substeps),
        progress=None if progress is None else lambda done: progress(min(done, steps), steps),
    )
    record = _record(loop, states, observations, exogenous[0], start, wanted, settled_within, steps)
    if record.completed and record.nominal and not _is_resolved(record):
        record = dataclasses.replace(record, status=Status.UNRESOLVED)
    if throw and not record.completed:
        raise FlightError(
            f"the flight must reach {duration:g} s (got {record.status_time:.4g} s: {record.status.value}); "
            "change the start, the poles or the speed",
            record,
        )
    return record


def _first_bad(after: np.ndarray, seen: np.ndarray, least_thrust: float, step: float) -> int | None:
    """Return how many steps of a chunk come before the first one that must not be kept, or None."""
    with np.errstate(invalid="ignore", over="ignore"):
        bad = ~(np.isfinite(after).all(axis=0) & np.isfinite(seen).all(axis=0))
        bad |= ~(after[STATE_SIZE - 2] > least_thrust)
        bad |= ~((seen[-1] > SMALLEST_FOCAL_MARGIN) | (seen[-3] > 0))
        bad |= ~(np.linalg.norm(after[15:18], axis=0) * step < LARGEST_TURN)
    return int(bad.argmax()) if bad.any() else None


def _is_resolved(record: FlightRecord) -> bool:
    """Return whether a nominal flight ends roughly where its closed form does.

    Both are exact but for the integration, so what parts them is the step.  Small differences are for the summary to show.
    """
    across = record.law.predict_transverse(record.start, record.time[-1:])[0, :, 0]
    ended = np.linalg.norm(record.transverse_state[-1, :, 0])
    size = np.linalg.norm(record.transverse_state[0, :, 0])
    return bool(abs(ended - np.linalg.norm(across)) <= 10 * record.settled_within + RESOLVED_SHARE * size)


def _record(
    loop: ClosedLoop,
    states: np.ndarray,
    observations: np.ndarray,
    times: np.ndarray,
    start: State,
    reference: Any,
    settled_within: float,
    steps: int,
) -> FlightRecord:
    """Return the record of a scan; one extra step gave the observation at the end, and its state is dropped."""
    path, rows = loop.law.path, max(1, min(observations.shape[1], steps + 1))
    completed = observations.shape[1] > steps
    if observations.shape[1] == 0:  # not even the first step was good: show the start itself
        observations = np.array(loop.step()(states[:, 0], np.zeros(1 + NOISE_SIZE))[1])
    states, observations = states[:, :rows].T, observations[:, :rows].T
    state, parameters = states[:, :STATE_SIZE], states[:, TRUE_PARAMETER]
    width = 4 * path.components
    transverse = observations[:, 4 : 4 + width].reshape(rows, 4, path.components).swapaxes(1, 2)
    free_fall, focal = state[:, 18] / loop.truth.mass, observations[:, -1]
    status = Status.COMPLETED if completed else _cause(state[-1], free_fall, focal, loop)
    return FlightRecord(
        time=times[:rows],
        state=state,
        input=observations[:, :4],
        transverse_state=path.normal_components(parameters, transverse),
        tangential_state=observations[:, 4 + width : 8 + width],
        yaw_output=observations[:, 8 + width],
        waiting=observations[:, 9 + width] > 0,
        constrained=observations[:, 10 + width] > 0,
        distance=path.distances(state[:, :3], parameters),
        free_fall_margin=free_fall,
        focal_margin=focal,
        status=status,
        status_time=float(times[rows - 1]),
        status_margin=float(focal[-1] if status is Status.FOCAL_POINT else free_fall[-1]),
        law=loop.law,
        truth=loop.truth,
        start=start,
        reference=reference,
        yaw_reference=loop.yaw,
        settled_within=settled_within,
        nominal=loop.feedback == "continuous"
        and loop.truth is loop.law.vehicle
        and not observations[:, 10 + width].any(),
    )


def _cause(last: np.ndarray, free_fall: np.ndarray, focal: np.ndarray, loop: ClosedLoop) -> Status:
    """Return why a flight ended early: the nearer of the two singularities, if one is near, in its usual size."""
    step = loop.interval / loop.substeps
    nearness = {
        Status.FOCAL_POINT: min(focal[-1], 2 * focal[-1] - focal[-2] if len(focal) > 1 else focal[-1])
        / np.median(focal),
        Status.FREE_FALL: min(last[18], last[18] + loop.interval * last[19]) / loop.truth.mass / np.median(free_fall),
    }
    cause = min(nearness, key=lambda status: nearness[status])
    if nearness[cause] < NEAR:
        return cause
    return Status.UNRESOLVED if np.linalg.norm(last[15:18]) * step > LARGEST_TURN / 2 else Status.NOT_FINITE

"""Fly a law: integrate the closed loop from a start and return the record."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.checks import instance, whole
from gammastar.errors import FlightError, InputError, SingularStartError
from gammastar.flight.autopilot_rows import AutopilotRows
from gammastar.flight.autopiloted import AutopilotLoop
from gammastar.flight.conditions import Conditions
from gammastar.flight.loop import ClosedLoop
from gammastar.flight.noise import SensorNoise
from gammastar.flight.phases import Phase, Replacement, phases_of
from gammastar.flight.record import FlightRecord, Status
from gammastar.flight.sensors import Sensors
from gammastar.flight.software_in_the_loop import Pilot
from gammastar.flight.task import Chance, Task, task
from gammastar.flight.watch import CODES, LARGEST_TURN, Breakdown, Watch, is_resolved, nearest_singularity
from gammastar.flight.wind import Wind
from gammastar.law import AnyReference, Heading, Law
from gammastar.law.guidance import Guidance
from gammastar.law.law import Yaw
from gammastar.vehicle import State, Vehicle

NO_CHANCE = Chance(0, 0)
SMALLEST_THRUST = 1e-6  # of the thrust at the start; below it the law divides by rounding


def fly(
    law: Law,
    start: State,
    *,
    speed: float | None = None,
    reference: AnyReference | None = None,
    duration: float = 20.0,
    step: float = 1e-3,
    feedback: str | None = None,
    rate: float | None = None,
    integrator: str = "rkmk4",
    truth: Vehicle | None = None,
    noise: SensorNoise | None = None,
    sensors: Sensors | None = None,
    wind: Wind | None = None,
    seed: int = 0,
    flight: int = 0,
    yaw_reference: float = 0.0,
    heading: Heading | None = None,
    settled_within: float = 1e-3,
    replacements: Sequence[Replacement] = (),
    progress: Callable[[int, int], None] | None = None,
    throw: bool = False,
    pilot: Pilot | None = None,
) -> FlightRecord:
    """Fly a law from a start and return the record; it draws, prints and saves nothing.

    Args:
        law: From `design`.
        start: Where and how the flight begins; a thrust left open is the believed weight.
        speed: Constant speed along the path [path parameter/s], short for `reference=Speed(speed)`.
        reference: `Speed`, `Ramp`, `Point`, `Stop`, `Legs` or `Profile`; exactly one of `speed` and `reference` is given.
        duration: [s].
        step: Longest integration step [s].
        feedback: 'continuous' evaluates the law in every stage; 'start' and 'middle' hold the input over the control
            interval, computed from the state at its start, or from the state predicted for its middle (second order in
            the interval).  Continuous when left out, but 'middle' for a vehicle or law that needs an autopilot: one with rotors,
            latency, disturbance rejection, an estimator, sensors or wind.
        rate: Control rate [Hz] of sampled feedback; 500 for an autopilot when left out.
        integrator: 'rkmk4', 'cf4', 'carpenter-kennedy', 'lie-euler' or 'rk4'.
        truth: The vehicle that really flies, when the law's belief about it is wrong.
        noise: White noise on every sample that the law measures; needs sampled feedback.
        sensors: With rates, noise, biases, delays and lost samples, in place of `noise`.
        wind: In which the vehicle really flies; the law does not know it.
        seed: Of noise, sensors and gusts.
        flight: Number of this flight among those of the seed; each draws anew, see `fly_many`.
        yaw_reference: Constant reference of the yaw output [rad/s for the default output].
        heading: `Along`, `Azimuth` or `Towards` in place of a constant reference.
        settled_within: Distance [m] that counts as on the path in the summary.
        replacements: Other paths to follow from some times on, in their order.
        progress: Called with (steps done, steps in all).
        throw: Raise `FlightError` when the flight ends early; otherwise the record's status says so.
        pilot: The autopilot of this very flight, compiled: it flies in place of its graph.

    Raises:
        SingularStartError: The law has no finite input at the start.
        FlightError: The flight ended early and `throw` is set.
    """
    instance(start, State, "start", "make one with gs.State(position)")
    wanted = task(law, speed, reference, yaw_reference, heading, settled_within)
    conditions = Conditions(duration, step, feedback, rate, integrator, truth, noise, sensors, wind, pilot)
    chance = Chance(whole(seed, "seed"), whole(flight, "flight"))
    loop, first, steps = prepared(law, start, wanted.reference, wanted.yaw, conditions, chance)
    phases = phases_of(law, wanted.reference, replacements, loop.interval, steps)
    if pilot is not None and len(phases) > 1:
        raise InputError(
            f"a compiled autopilot has one path (got {len(phases) - 1} replacements); fly the law itself, or leave them out"
        )
    record = recorded(wanted, start, loop, first, steps, phases, chance, progress)
    if throw and not record.completed:
        raise FlightError(
            f"the flight must reach {duration:g} s (got {record.status_time:.4g} s: {record.status.value}); "
            "change the start, the poles or the speed",
            record,
        )
    return record


class Family(NamedTuple):
    """The step that a flight takes together with others, and its own parameters of it."""

    step: engine.Step
    parameters: np.ndarray | None = None


def recorded(
    wanted: Task,
    start: State,
    loop: ClosedLoop | AutopilotLoop,
    first: np.ndarray,
    steps: int,
    phases: Sequence[Phase],
    chance: Chance,
    progress: Callable[[int, int], None] | None = None,
    machine: str = "casadi",
    family: Family | None = None,
) -> FlightRecord:
    """Return the record of a flight whose loop starts with a state and takes some steps; one of a family takes the family's."""
    times, law = np.arange(steps + 1) * loop.interval, wanted.law
    watch = Watch(float(least_thrust(first)), loop.interval / loop.substeps, loop.is_ideal)
    if not float(ca.norm_2(first[15:18])) * watch.step < LARGEST_TURN:
        watch.status = Status.UNRESOLVED
    parts = _flown(loop, first, phases, times, chance, watch, progress, machine, family)
    rows = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    status, count = watch.status, len(rows["state"])
    if loop.is_ideal:
        status = CODES[int(nearest_singularity(CODES.index(status), _breakdown(rows), loop.interval))]
    told = {each.name: rows.pop(each.name) for each in dataclasses.fields(AutopilotRows) if each.name in rows}
    record = FlightRecord(
        **rows,
        autopilot=AutopilotRows(**told) if told else None,
        time=times[:count],
        status=status,
        status_time=float(times[count - 1]),
        status_margin=float(rows["focal_margin" if status is Status.FOCAL_POINT else "free_fall_margin"][-1]),
        law=law,
        truth=loop.truth,
        start=start,
        reference=wanted.reference,
        yaw_reference=wanted.yaw,
        settled_within=wanted.settled_within,
        phases=tuple(phases[: len(parts)]),
        nominal=isinstance(loop, ClosedLoop)
        and loop.feedback == "continuous"
        and loop.truth.signature == law.vehicle.signature
        and len(phases) == 1
        and not rows["constrained"].any(),
    )
    if record.completed and record.nominal and not is_resolved(record):
        record = dataclasses.replace(record, status=Status.UNRESOLVED)
    return record


def least_thrust(first: np.ndarray) -> np.ndarray:
    """Return the thrusts [N] below which the law divides by rounding, of flights whose loops start with states (n, ...)."""
    return np.asarray(SMALLEST_THRUST * first[18])


def _breakdown(rows: dict[str, np.ndarray]) -> Breakdown:
    """Return where a flight ended."""
    (thrust, thrust_rate), focal = rows["state"][:, 18:20].T, rows["focal_margin"]
    return Breakdown(thrust[-1], thrust_rate[-1], thrust.mean(), focal[-1], focal[max(len(focal) - 2, 0)], focal.mean())


def _flown(
    loop: ClosedLoop | AutopilotLoop,
    first: np.ndarray,
    phases: Sequence[Phase],
    times: np.ndarray,
    chance: Chance,
    watch: Watch,
    progress: Callable[[int, int], None] | None,
    machine: str,
    family: Family | None,
) -> list[dict[str, np.ndarray]]:
    """Return the rows of every phase that is reached; the last one has the row at the end, for whose sake one more step is taken."""
    parts, last, steps = list[dict[str, np.ndarray]](), first, len(times) - 1
    for phase, end in zip(phases, [*(later.row for later in phases[1:]), len(times)], strict=True):
        if phase.row > 0:
            loop, first = _continued(loop, last, phase, times[phase.row])

        def told(done: int, row: int = phase.row) -> None:
            if progress is not None:
                progress(min(row + done, steps), steps)

        taken, parameters = family or Family(loop.step())
        numbers: dict[str, Any] = {**chance._asdict(), "first": phase.row, "machine": machine, "parameters": parameters}
        drawn: Any = functools.partial(engine.trace, taken, first, **numbers)
        count = end - phase.row if watch.status is Status.COMPLETED else 0
        states, observations = drawn(count, stop=watch, progress=told, chunk=max(1, engine.CHUNK // loop.substeps))
        if observations.shape[1] == 0 and not parts:  # not even the first step was good: show the start itself
            _, observations = drawn(1)
            _require_finite(observations)
        parts.append(loop.rows(states, observations))
        if watch.status is not Status.COMPLETED:
            break
        last = states[:, -1]
    return parts


def prepared(
    law: Law,
    start: State,
    reference: AnyReference,
    yaw: Yaw,
    conditions: Conditions,
    chance: Chance = NO_CHANCE,
) -> tuple[ClosedLoop | AutopilotLoop, np.ndarray, int]:
    """Return the closed loop of a flight, its state at the start, and its intervals; nothing after this refuses the flight.

    Raises:
        SingularStartError: The law has no finite input at the start.
        InputError: The times, the reference or the heading do not fit.
    """
    _, _, steps = conditions.timing(law)
    x, parameter = law.start_vector(start)
    loop = conditions.loop(Guidance(law, reference.resolved(law.path, parameter), yaw))
    first = loop.start(x, parameter, *chance)
    _require_finite(first)
    return loop, first, steps


def _continued(
    loop: ClosedLoop | AutopilotLoop, last: np.ndarray, phase: Phase, time: float
) -> tuple[ClosedLoop | AutopilotLoop, np.ndarray]:
    """Return the loop of the next phase and its state at its first time [s], from the last state of the one before."""
    parameter = phase.law.path.start_parameter(last[:3])
    reference = phase.reference.resolved(phase.law.path, parameter).moved(time)
    following = loop.guided(Guidance(phase.law, reference, loop.guidance.yaw))
    first = following.continued(last, parameter)
    _require_finite(first)
    return following, first


def _require_finite(values: np.ndarray) -> None:
    if not np.all(np.isfinite(values)):
        raise SingularStartError(
            "the law must have a finite input at the start (got NaN or infinity); move the start", {}
        )

"""Many flights of one law at once: what is worth knowing of each is computed while it flies, and any of them can be seen whole."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gammastar import engine as engines
from gammastar.checks import array, instance, shape_of, shortened, whole
from gammastar.errors import InputError
from gammastar.flight.autopiloted import AutopilotLoop
from gammastar.flight.conditions import Conditions
from gammastar.flight.flights import Flights
from gammastar.flight.fly import least_thrust
from gammastar.flight.loop import ClosedLoop
from gammastar.flight.noise import SensorNoise
from gammastar.flight.reductions import FIRST, LATE, NEVER, Parameters, reduced
from gammastar.flight.sensors import Sensors
from gammastar.flight.task import Task, task
from gammastar.flight.variation import given_quantities, tunings, with_path_data
from gammastar.flight.wind import Wind
from gammastar.law import AnyReference, Heading, Law, Reference, Speed
from gammastar.law.guidance import Guidance
from gammastar.lookup import Table
from gammastar.path import Path
from gammastar.path.base import distinct
from gammastar.vehicle import State, Vehicle
from gammastar.vehicle.state import SIZE as STATE_SIZE


def fly_many(
    law: Law | Sequence[Law],
    starts: Sequence[State],
    *,
    speed: ArrayLike | None = None,
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
    flights: Sequence[int] | None = None,
    yaw_reference: float = 0.0,
    heading: Heading | None = None,
    settled_within: float = 1e-3,
    varied: Mapping[str, ArrayLike] | None = None,
    machine: str = "auto",
    workers: int | None = None,
    record: Iterable[int] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Flights:
    """Fly a law from many starts and return what is worth knowing of every flight; arguments that are not listed are those of `fly`.

    Memory does not grow with the length of the flights.  What becomes of a flight depends on its start and its number, not on the others;
    one that cannot start is told as such, and raises nothing.  Each keeps its path: replacements are flown by `fly`.

    Args:
        law: From `design`; or one a flight, of laws that differ in poles, approach speed, observer bandwidths and the numbers of their
            paths alone, such as courses through other waypoints, or circles of other radii.
        starts: One a flight.
        speed: Constant speed along the path [path parameter/s]; or one a flight, (flights,).
        seed: Of noise, sensors and gusts of all flights.
        flights: Numbers of the flights, with which their noise goes; counted from zero when left out.
        varied: What differs from flight to flight in what really flies, (flights,) by name: `mass_scale`, `inertia_scale`, also
            (flights, 3) for the body axes, `thrust_scale` and `lag_scale` of the rotors, `force_scale` of all forces but buoyancy,
            `noise_scale` of all deviations of noise or sensors, `rate_bandwidth` [rad/s] of the inner loop of the interface 'rates', and
            `wind` (flights, 3) [m/s], world, on top of the mean of that of the argument; gusts turn with it.
        machine: 'native' compiles the loop as C once, and flies some flights side by side on every processor; 'casadi' needs no compiler;
            'auto' is native where a compiler answers.
        workers: Threads; one for every processor when left out.
        record: Places in the result of flights that are to be recorded whole as well; `Flights.record` does so later.
        progress: Called with (steps done, steps in all), over all flights.

    Raises:
        InputError: The arguments do not fit together.
    """
    if isinstance(starts, State) or not isinstance(starts, Iterable):
        raise InputError(f"starts must be a list (got {shortened(starts)}); write [gs.State(position), ...]")
    begun = list(starts)
    for start in begun:
        instance(start, State, "each of the starts", "make one with gs.State(position)")
    numbers = engines.checked_flights(flights, len(begun))
    laws = list(law) if isinstance(law, Iterable) else [law] * max(1, len(begun))
    if isinstance(law, Iterable) and (len(laws) != len(begun) or not laws):
        raise InputError(f"laws must be one, or one a start (got {len(laws)} for {len(begun)}); give as many")
    if not isinstance(record, Iterable):
        raise InputError(f"record must be a list of places (got {shortened(record)}); write [0, 3]")
    kept = [whole(place, "each place to record") for place in record]
    if any(place >= len(begun) for place in kept):
        raise InputError(
            f"places to record must be below the number of flights {len(begun)} (got {max(kept)}); count from zero"
        )
    own, flying = _speeds(speed, len(begun)), with_path_data(laws)
    common: Any = own[0].speed if own else speed
    wanted = task(flying[0], common, reference, yaw_reference, heading, settled_within)
    conditions = Conditions(duration, step, feedback, rate, integrator, truth, noise, sensors, wind)
    _, _, steps = conditions.timing(wanted.law)
    variation = given_quantities(varied, len(begun)) | (tunings(flying) if isinstance(law, Iterable) else {})
    conditions.require_possible(variation, wanted.law)
    parameters = np.vstack([np.empty((0, len(begun))), *variation.values()])
    asked: Sequence[AnyReference] = own or [wanted.reference]
    keys = whole(seed, "seed"), numbers
    loops, firsts = _begun(wanted, flying, asked, begun, conditions, *keys, tuple(variation), parameters)
    flown = np.array([place for place, loop in enumerate(loops) if loop is not None], dtype=int)
    final = np.tile(NEVER[:, None], len(begun))
    if flown.size:
        together, given = _together([loops[place] for place in flown], wanted, firsts, steps)
        given = np.vstack([parameters[:, flown], given])
        total = len(flown) * (steps + 1)
        ended = engines.run(
            together,
            np.vstack([firsts, np.tile(FIRST[:, None], len(flown))]),
            steps + 1,  # the row at the end is told by one more
            seed=seed,
            flights=numbers[flown],
            parameters=given,
            machine=machine,
            workers=workers,
            progress=None if progress is None else lambda done: progress(done, total),
        )
        final[:, flown] = ended[len(firsts) :]
    result = Flights(
        wanted,
        tuple(laws[: len(begun)]),
        tuple(begun),
        tuple(loops),
        numbers,
        seed,
        steps,
        flown,
        firsts,
        final,
        machine,
        tuple(variation),
        parameters,
        tuple(own),
    )
    result.records.update((place, result.record(place)) for place in kept)
    return result


def _begun(
    wanted: Task,
    laws: list[Law],
    asked: Sequence[AnyReference],
    starts: list[State],
    conditions: Conditions,
    seed: int,
    numbers: np.ndarray,
    names: tuple[str, ...],
    varying: np.ndarray,
) -> tuple[list[ClosedLoop | AutopilotLoop | None], np.ndarray]:
    """Return the loop of every flight, None where it cannot start, and the states (n, flights) of the others at their starts."""
    law = wanted.law
    states = np.array([start.vector(law.vehicle.weight) for start in starts]).reshape(-1, STATE_SIZE).T
    paths = [each.path for each in laws]
    places = _nearest(paths, states[:3].T)
    begins = np.flatnonzero(law.can_start(states, places))
    loops: list[ClosedLoop | AutopilotLoop | None] = [None] * len(starts)
    if not begins.size:
        return loops, np.empty((0, 0))
    chosen = begins.tolist()
    wishes = [asked[k] for k in chosen] if len(asked) > 1 else asked
    references = _resolved(wishes, [paths[k] for k in chosen], places[0, begins])
    loop = dataclasses.replace(conditions.loop(Guidance(law, references[0], wanted.yaw)), varied=names)
    firsts = loop.starts(states[:, begins], places[:, begins], references, seed, numbers[begins], varying[:, begins])
    finite = np.isfinite(firsts).all(axis=0)
    for index in np.flatnonzero(finite):
        own, reference = laws[begins[index]], references[0 if len(references) == 1 else index]
        same = len(references) == 1 and own is law
        loops[begins[index]] = loop if same else loop.guided(Guidance(own, reference, wanted.yaw))
    return loops, firsts[:, finite]


def _speeds(speed: ArrayLike | None, count: int) -> list[Speed]:
    """Return the references of flights that have a speed each; none where there is one for all."""
    if speed is None or shape_of(speed) == ():
        return []
    given = array(speed, "speed [path parameter/s], of all flights or of each,", (count,)).tolist()
    distinct = {each: Speed(each) for each in given}
    return [distinct[each] for each in given]


def _nearest(paths: list[Path], positions: np.ndarray) -> np.ndarray:
    """Return the places (1 + data_size, n) of the points of paths nearest to positions (n, 3) [m], each of its own path."""
    places = np.empty((1 + paths[0].data_size, len(positions)))
    for path, own in distinct(paths[: len(positions)]):
        parameters = path.start_parameters(positions[own])
        places[:, own] = np.vstack([parameters, path.data(parameters)])
    return places


def _resolved(asked: Sequence[AnyReference], paths: list[Path], parameters: np.ndarray) -> list[Reference]:
    """Return the references of flights along paths from parameters (n,), each by its own wish or all by one.

    It is the only one if one speed leaves the place free, which is the same for all.
    """
    first = asked[0].resolved(paths[0], float(parameters[0]))
    is_one = len(asked) == 1 and all(path is paths[0] or path.ends is None for path in paths)
    if is_one and isinstance(asked[0], Speed) and not first.holds_position:
        return [first]
    each = zip(itertools.cycle(asked), paths, parameters.tolist(), strict=False)
    found = [wish.resolved(path, parameter) for wish, path, parameter in each]
    if any(each.holds_position != first.holds_position for each in found):
        raise InputError(
            "flights that are flown together must all hold a place in the end, or none (got paths that end and others, or speeds of zero "
            "and others along a path that ends); fly them apart"
        )
    return found


def _together(loops: list[Any], wanted: Task, firsts: np.ndarray, steps: int) -> tuple[engines.Step, np.ndarray]:
    """Return the step that all flights take, with a table for each of whatever differs in them, and its parameters (5, flights)."""
    step = reduced(loops[0])
    tables = zip(
        *((each.reference.lookup.table, *(of.table for of in each.law.path.lookups)) for each in loops), strict=True
    )
    lookups = [lookup._replace(table=_one(own)) for lookup, own in zip(step.lookups, tables, strict=True)]
    late = LATE * (steps * loops[0].interval)
    ends = np.array([each.law.path.ends or (-np.inf, np.inf) for each in loops]).T
    given = Parameters(least_thrust(firsts), late, wanted.settled_within, *ends)
    return dataclasses.replace(step, lookups=tuple(lookups)), np.vstack(np.broadcast_arrays(*given))


def _one(tables: tuple[Table, ...]) -> Table | tuple[Table, ...]:
    """Return the tables of flights as one where it is the same in all of them."""
    return tables[0] if all(each is tables[0] for each in tables) else tables

"""The rows of a campaign: flights of some numbers, flown, with what was drawn for each beside what became of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from gammastar.campaign import starts
from gammastar.campaign.case import Case
from gammastar.campaign.setting import Setting
from gammastar.campaign.starts import Starts
from gammastar.campaign.store import arrow
from gammastar.errors import GammastarError, InputError
from gammastar.flight import Flights, Status
from gammastar.flight.reductions import nothing

REFUSED = "refused"  # status of a flight that a check does not let begin
STEPS = b"steps"  # key of a table's metadata: how many control intervals were flown
SENTENCES = {status.name.lower(): status.value for status in Status if status is not Status.COMPLETED}

Progress = Callable[[int, int], None]


def rows(
    setting: Setting, numbers: Any, machine: str, workers: int | None = None, progress: Progress | None = None
) -> Any:
    """Return the rows of the flights of some numbers (n,) as a `pyarrow.Table`; they depend on neither the other flights nor the workers.

    A flight that a check refuses is a row too, with the status 'refused' and the sentence as its cause.

    Args:
        setting: What is flown.
        numbers: From zero.
        machine: 'native' or 'casadi'.
        workers: Threads of the native machine.
        progress: Called with (flights done, flights in all).
    """
    pyarrow, _ = arrow()
    numbers = np.asarray(numbers, dtype=np.int64)
    values, count, steps, done = setting.sample(numbers), len(numbers), 0, 0
    told, begun = nothing(count), starts.unknown(count)
    told["status"], causes = np.full(count, REFUSED, dtype=object), np.full(count, "", dtype=object)

    def tell(flown: int, total: int) -> None:
        if progress is not None:
            progress(done + flown * len(case.numbers) // max(total, 1), count)

    for case in setting.cases(numbers, values):
        if isinstance(case.mission, GammastarError):
            causes[case.places] = str(case.mission)
        else:
            places = case.starts()
            _fill(begun, case.places, places.columns())
            for chosen, result in flown(case, places, {"machine": machine, "workers": workers, "progress": tell}):
                if isinstance(result, Flights):
                    _fill(told, case.places[chosen], result.columns)
                    steps += _steps(result)
                else:
                    causes[case.places[chosen]] = str(result)
        done += len(case.numbers)
    del told["flight"]
    status = told.pop("status")
    for name, sentence in SENTENCES.items():
        causes[status == name] = sentence
    settled = (status == Status.COMPLETED.name.lower()) & np.isfinite(told["settling_time_s"])
    columns = {"flight": numbers, "status": status, "settled": settled, "cause": causes}
    kinds = {"status": pyarrow.string(), "cause": pyarrow.string()}
    every = columns | told | begun | setting.columns(values)
    arrays = {name: pyarrow.array(column, type=kinds.get(name)) for name, column in every.items()}
    return pyarrow.table(arrays).replace_schema_metadata({STEPS: str(steps)})


def flown(case: Case, places: Starts, given: dict[str, Any]) -> Iterator[tuple[np.ndarray, Flights | InputError]]:
    """Yield the flights of a case in few batches, by their places in it, and those that a check refuses one by one with its error.

    Those that a look refuses are not tried.  What else refuses one refuses its batch: halves of it are tried again, until the one stands
    alone.
    """
    assert not isinstance(case.mission, GammastarError)
    states, laws = case.begun(places), case.laws
    refused = {k: state for k, state in enumerate(states) if isinstance(state, InputError)}
    yield from ((np.array([k]), error) for k, error in refused.items())
    waiting = [np.array([k for k in range(len(states)) if k not in refused], dtype=int)]
    while waiting:
        chosen = waiting.pop()
        if not len(chosen):
            continue
        own: dict[str, Any] = {} if laws is None else {"laws": [laws[k] for k in chosen]}
        try:
            own |= {"flights": case.numbers[chosen]} | case.given(chosen)
            yield chosen, case.mission.fly_many([states[k] for k in chosen], **own, **given)
        except InputError as error:
            if len(chosen) == 1:
                yield chosen, error
            else:
                waiting += np.array_split(chosen, 2)[::-1]


def _fill(columns: dict[str, np.ndarray], places: np.ndarray, values: Any) -> None:
    for name in columns:
        columns[name][places] = values[name]


def _steps(flights: Flights) -> int:
    """Return how many control intervals some flights took together."""
    if not flights.flown.size:
        return 0
    loop = flights.loops[flights.flown[0]]
    assert loop is not None
    interval: float = loop.interval
    return round(float(np.nansum(flights["end_time_s"])) / interval)

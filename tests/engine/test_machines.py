"""Machines by name fly the same flights; what they are given is checked once."""

from __future__ import annotations

import dataclasses
import tracemalloc

import casadi as ca
import numpy as np
import pytest

from engine import steps
from gammastar import engine
from gammastar.engine import machines, virtual
from gammastar.errors import CompilerError, InputError, MachineWarning, ShapeError, UnknownNameError
from gammastar.lookup import Lookup, Table

NAMES = ["casadi", "python", pytest.param("native", marks=steps.needs_compiler)]
SHORT = 400
HOW = {"seed": 3, "parameters": [0.003]}


@pytest.mark.parametrize("name", NAMES)
def test_machines_agree_and_a_trace_is_the_flight(name: str, monkeypatch) -> None:
    """Each state of a trace follows from the one before; its end is that of `run` to the last bit, however both are cut."""
    monkeypatch.setattr(virtual, "CHUNK", 64)
    step, starts = steps.noisy(), steps.noisy_starts(7)
    ends = engine.run(step, starts, SHORT, machine=name, **HOW)
    assert np.allclose(ends, engine.run(step, starts, SHORT, machine="casadi", **HOW), rtol=1e-12, atol=1e-12)
    ended = set()
    for k in range(7):
        states, observations = engine.trace(step, starts[:, k], SHORT, flight=k, machine=name, chunk=77, **HOW)
        assert states[:, -1].tobytes() == ends[:, k].tobytes()
        count = observations.shape[1]
        assert states.shape == (3, count + 1)
        assert (states[2, -1] != 0) == (count < SHORT)
        assert not states[2, :-1].any()
        assert np.array_equal(observations[0], 2 * states[0, :-1])
        assert np.array_equal(observations[2], np.arange(count))
        ended.add(count)
    assert len(ended) > 2


@pytest.mark.parametrize("kind", ["paper_circle", "quadrotor"])
def test_emitted_python_equals_the_virtual_machine(kind: str) -> None:
    loop = getattr(steps, kind)()
    few, count = loop.starts[:, :5], round(0.1 / loop.interval)
    found, expected = (engine.run(loop.step, few, count, machine=name) for name in ("python", "casadi"))
    assert np.all(np.abs(found - expected) <= 1e-10 * np.maximum(1, np.abs(expected)))


@pytest.mark.parametrize("name", NAMES)
def test_each_flight_has_its_own_tables(name: str) -> None:
    step = steps.noisy()
    own = dataclasses.replace(
        step, lookups=(step.lookups[0], Lookup([steps.STAIRS, steps.UPWARD], step.lookups[1].variable))
    )
    found = engine.run(own, steps.noisy_starts(2), 30, machine=name, **HOW)
    shared = engine.run(step, steps.noisy_starts(2), 30, machine=name, **HOW)
    assert np.array_equal(found[:, 0], shared[:, 0])
    assert found[1, 1] > shared[1, 1]


@pytest.mark.parametrize("name", NAMES)
def test_no_steps_no_flights_and_flights_that_have_ended_leave_the_start(name: str) -> None:
    start = np.array([[1.0, 2.0]])
    assert np.array_equal(engine.run(steps.tiny(2.0), start, 0, machine=name), start)
    assert engine.run(steps.tiny(2.0), np.empty((1, 0)), 5, machine=name).shape == (1, 0)
    assert np.array_equal(engine.run(steps.tiny(2.0), start, 2, machine=name), [[7.0, 11.0]])
    assert np.array_equal(start, [[1.0, 2.0]])
    ended = np.array([[1.0, 1.0], [2.0, 2.0], [3.0, np.nan]])
    assert np.array_equal(engine.run(steps.noisy(), ended, 5, machine=name, **HOW), ended, equal_nan=True)
    states, observations = engine.trace(steps.noisy(), ended[:, 0], 5, machine=name, **HOW)
    assert (states.shape, observations.shape) == ((3, 1), (3, 0))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("status", [-1.0, 0.5, np.nan])
def test_any_status_but_zero_ends_a_flight(status: float, name: str) -> None:
    def after(state: ca.SX, parameters: ca.SX, number: ca.SX) -> ca.SX:
        return ca.vertcat(state[0] + 1, ca.if_else(state[0] < 5, 0, parameters))

    step = steps.step_of(2, 1, after, status=1)
    found = engine.run(step, np.zeros((2, 1)), 50, parameters=[status], machine=name)
    assert np.array_equal(found, [[6.0], [status]], equal_nan=True)
    assert engine.trace(step, np.zeros(2), 50, parameters=[status], machine=name)[0].shape == (2, 7)


@pytest.mark.parametrize("name", NAMES)
def test_progress_counts_up_to_the_end(name: str) -> None:
    told: list[int] = []
    engine.run(steps.noisy(), steps.noisy_starts(5), SHORT, machine=name, progress=told.append, **HOW)
    assert told == sorted(told)
    assert told[-1] == 5 * SHORT
    told.clear()
    engine.trace(steps.tiny(1.0), [0.0], 20, machine=name, chunk=8, progress=told.append)
    assert told == [8, 16, 20]


@pytest.mark.parametrize("name", ["casadi", pytest.param("native", marks=steps.needs_compiler)])
def test_memory_does_not_grow_with_the_steps(name: str) -> None:
    """One number a step would be 400 kB more; what is not collected yet is less."""
    most = []
    for count in (1000, 6000):
        tracemalloc.start()
        engine.run(steps.tiny(1.0), np.zeros((1, 9)), count, machine=name)
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert most[1] < most[0] + 100_000


def test_a_trace_ends_where_it_is_told_to() -> None:
    def stop(after: np.ndarray, observations: np.ndarray) -> int | None:
        assert observations.shape[1] == after.shape[1]
        return int(np.argmax(after[0] > 12)) if np.any(after[0] > 12) else None

    states, observations = engine.trace(steps.tiny(1.0), [0.0], 50, machine="casadi", chunk=5, stop=stop)
    assert states[0].tolist() == list(range(13))
    assert observations.shape == (0, 12)


def test_without_a_compiler_auto_says_so_and_flies(monkeypatch) -> None:
    def refused(step: engine.Step) -> None:
        raise CompilerError("a C compiler must be there; install gcc", "log")

    monkeypatch.setitem(machines.KINDS, "native", refused)
    with pytest.warns(
        MachineWarning, match="some hundred times slower than native: a C compiler must be there"
    ) as told:
        assert engine.run(steps.tiny(2.0), [[1.0, 2.0]], 1).tolist() == [[3.0, 5.0]]
    assert told[0].filename == __file__
    with pytest.raises(CompilerError):
        engine.run(steps.tiny(2.0), [[1.0]], 1, machine="native")


@steps.needs_compiler
def test_auto_is_native_where_a_compiler_answers() -> None:
    assert isinstance(machines.machine_of("auto", steps.tiny(2.0)), machines.KINDS["native"])


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"starts": np.zeros((3, 2))}, r"starts must be \(1, flights\) \(got \(3, 2\)\)"),
        ({"flights": [1]}, "flights must be 2 whole numbers"),
        ({"flights": [-1, 0]}, "flights must be 2 whole numbers"),
        ({"flights": [0.5, 1]}, "flights must be 2 whole numbers"),
        ({"flights": [2**64, 0]}, r"flights must be 2 whole numbers from 0 to 2\^64 - 1"),
        ({"flights": 3}, "flights must be 2 whole numbers"),
        ({"parameters": "x"}, "parameters must be numbers"),
        ({"starts": [[1.0, 2.0], [3.0]]}, "starts must be numbers"),
        ({"workers": 0}, "workers must be at least 1"),
        ({"workers": "2"}, "workers must be a number"),
        ({"workers": 1.5}, "workers must be a whole number"),
        ({"steps": 2**53, "first": 1}, r"first and steps must be at most 2\^53 together"),
        ({"parameters": [1.0]}, r"parameters must be \(0,\) or \(0, 2\) \(got \(1,\)\)"),
        ({"steps": -1}, "steps must be a whole number from zero"),
        ({"steps": 1.5}, "steps must be a whole number from zero"),
        ({"first": -1}, "first must be a whole number from zero"),
        ({"seed": -1}, "seed must be a whole number"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(how: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        engine.run(steps.tiny(2.0), **{"starts": np.zeros((1, 2)), "steps": 1, **how})


def test_tables_are_one_or_as_many_as_flights() -> None:
    step = dataclasses.replace(steps.noisy(), lookups=(Lookup([steps.ROUND] * 3, None), steps.noisy().lookups[1]))
    with pytest.raises(ShapeError, match=r"one for all flights or 2 \(got 3\)"):
        engine.run(step, np.zeros((3, 2)), 1, parameters=[0.0])


def test_tables_of_flights_are_of_one_width() -> None:
    narrow = Table(steps.ROUND.begins, steps.ROUND.rows[:, :1])
    step = dataclasses.replace(steps.noisy(), lookups=(Lookup([steps.ROUND, narrow], None), steps.noisy().lookups[1]))
    with pytest.raises(ShapeError, match="rows of one width"):
        engine.run(step, np.zeros((3, 2)), 1, parameters=[0.0])


def test_an_unknown_machine_is_told_the_known_ones() -> None:
    with pytest.raises(UnknownNameError, match="machine must be one of auto, casadi, native, python"):
        engine.run(steps.tiny(2.0), [[1.0]], 1, machine="cassadi")
    with pytest.raises(ShapeError, match=r"start must be \(1,\) \(got \(1, 1\)\)"):
        engine.trace(steps.tiny(2.0), [[1.0]], 1)

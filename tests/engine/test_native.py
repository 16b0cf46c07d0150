"""Compiled lanes are flights: the same as the virtual machine's, each for itself."""

from __future__ import annotations

import dataclasses
import shutil

import casadi as ca
import numpy as np
import pytest

from engine import steps
from gammastar import engine
from gammastar.engine.batch import batch
from gammastar.engine.compiler import compiler
from gammastar.engine.native import Native
from gammastar.engine.random import uniforms
from gammastar.lookup import Lookup, Table

pytestmark = steps.needs_compiler
SHORT = 400  # steps of the noisy step


def flown(step: engine.Step, starts: np.ndarray, count: int, **how: object) -> np.ndarray:
    return engine.run(step, starts, count, machine="native", **how)


def drawing(channels: tuple[int, ...]) -> engine.Step:
    """Return a step whose state becomes its random numbers and the number of the step."""
    count, nothing = 2 * len(channels), ca.SX(0, 1)
    column = ca.SX.sym("column", 1 + count)
    core = ca.Function("core", [ca.SX.sym("state", 1 + count), nothing, column, nothing], [column, nothing])
    return engine.Step(core, channels=channels)


@pytest.mark.parametrize("kind", ["paper_circle", "quadrotor"])
def test_lanes_equal_the_virtual_machine_after_a_second(kind: str) -> None:
    """On 64 random starts, to 1e-10 of what each number goes through, or of one SI unit: estimates near zero come from such numbers."""
    loop = getattr(steps, kind)()
    count = round(1 / loop.interval)
    found = flown(loop.step, loop.starts, count)
    for flight in range(loop.starts.shape[1]):
        states, _ = engine.trace(loop.step, loop.starts[:, flight], count, machine="casadi")
        assert np.all(np.isfinite(states))
        assert np.all(np.abs(found[:, flight] - states[:, -1]) <= 1e-10 * np.maximum(1, np.abs(states).max(axis=1)))


def test_a_flight_of_nan_stays_nan_and_touches_no_other() -> None:
    loop = steps.paper_circle()
    starts = loop.starts[:, :19].copy()  # not a whole number of registers
    alone = flown(loop.step, starts, 50)
    starts[:, 4], starts[7, 17] = np.nan, np.nan
    found = flown(loop.step, starts, 50)
    assert np.isnan(found[:3, [4, 17]]).all()
    others = np.delete(np.arange(19), [4, 17])
    assert found[:, others].tobytes() == alone[:, others].tobytes()


def test_a_flight_is_the_same_alone_among_others_in_another_order_and_with_more_workers() -> None:
    """Flights end at different steps, so that lanes are taken again at different times, with tables and noise of their own."""
    step, starts, how = steps.noisy(), steps.noisy_starts(37), {"seed": 3, "parameters": [0.003]}
    together = flown(step, starts, SHORT, workers=1, **how)
    assert 0.2 < (together[2] != 0).mean() < 0.8
    order = np.random.default_rng(1).permutation(37)
    for workers in (1, 2, 5):
        found = flown(step, starts[:, order], SHORT, flights=order, workers=workers, **how)
        assert found.tobytes() == together[:, order].tobytes()
    for flight in (0, 5, 36):
        alone = flown(step, starts[:, flight : flight + 1], SHORT, flights=[flight], **how)
        assert alone[:, 0].tobytes() == together[:, flight].tobytes()


@pytest.mark.parametrize("lanes", [1, 2, 4, 8])
def test_random_numbers_are_those_of_numpy_to_the_last_bit(lanes: int) -> None:
    channels, seed, numbers = (0, 5, 2**40), 2**64 - 3, np.array([0, 1, 7, 2**33, 2**63 - 1])
    flights = batch(drawing(channels), np.zeros((7, 5)), 3, 2**32, seed, numbers, None)
    found = Native(flights.step, lanes).fly(flights, 1, lambda done: None)
    assert np.array_equal(found[0], np.full(5, 2**32 + 2))
    assert np.array_equal(found[1:], uniforms(seed, numbers, [2**32 + 2], channels)[:, 0])


def test_each_flight_has_its_own_parameters_and_tables() -> None:
    """Tables may differ in length and period; those of one flight alone, and of all, are the same to the last bit."""
    step, starts = steps.noisy(), steps.noisy_starts(11)
    draw = np.random.default_rng(2)
    tables = [
        Table(np.sort(draw.normal(size=3 + k)), draw.normal(size=(3 + k, 2)), *(9.0, draw.normal(size=2)) * (k % 2))
        for k in range(11)
    ]
    own = dataclasses.replace(step, lookups=(Lookup(tables, step.lookups[0].variable), step.lookups[1]))
    parameters = 0.001 * draw.normal(size=(1, 11))
    found = flown(own, starts, SHORT, parameters=parameters)
    for k, table in enumerate(tables):
        one = dataclasses.replace(step, lookups=(Lookup(table, step.lookups[0].variable), step.lookups[1]))
        alone = flown(one, starts[:, k : k + 1], SHORT, flights=[k], parameters=parameters[:, k])
        assert alone[:, 0].tobytes() == found[:, k].tobytes()


def test_a_variable_is_looked_up_as_numpy_looks_it_up() -> None:
    """At begins and beside them, before the first and beyond the last one, rounds of a period away, forth and back, and nowhere."""
    table = Table(
        np.array([0.5, 1.0, 2.5]), np.array([[0.5, 10.0], [1.0, 20.0], [2.5, 30.0]]), 3.0, np.array([3.0, 0.0])
    )
    places = np.array([0.5, 1.0, 2.5, 0.75, 3.5, 3.4, -2.5, -2.1, 8e6, -8e6])
    places = np.concatenate(
        [places, np.nextafter(places, -np.inf), np.nextafter(places, np.inf), [np.nan, np.inf, -np.inf]]
    )
    for used in (table, Table(table.begins, table.rows)):
        state, given, nothing = ca.SX.sym("state", 2), ca.SX.sym("parameters", 2), ca.SX(0, 1)
        rows, number = ca.SX.sym("rows", 2), ca.SX.sym("number")
        core = ca.Function("core", [state, given, number, rows], [rows, nothing])
        there = Lookup(used, lambda inputs, _: ca.if_else(inputs.column[0] < 1, *ca.vertsplit(inputs.parameters)))
        from_to = np.stack([np.roll(places, 7), places])
        found = flown(engine.Step(core, (there,)), np.zeros((2, len(places))), 2, parameters=from_to)
        with np.errstate(invalid="ignore"):
            assert np.array_equal(found, used.at(places), equal_nan=True)


def test_a_flight_goes_on_where_it_was_left() -> None:
    step, starts, how = steps.noisy(), steps.noisy_starts(5), {"seed": 1, "parameters": [0.0]}
    half = flown(step, starts, 150, **how)
    assert flown(step, half, 250, first=150, **how).tobytes() == flown(step, starts, SHORT, **how).tobytes()


def test_progress_counts_every_step_of_every_flight_in_the_end() -> None:
    told: list[int] = []
    flown(steps.noisy(), steps.noisy_starts(37), SHORT, parameters=[0.003], progress=told.append, workers=2)
    assert told == sorted(told)
    assert told[-1] == 37 * SHORT


def test_what_progress_raises_ends_the_flights() -> None:
    def interrupted(done: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        flown(steps.tiny(1.0), np.zeros((1, 64)), 10**12, progress=interrupted, workers=2)


@pytest.mark.parametrize("name", [name for name in ("gcc", "clang") if shutil.which(name)])
@pytest.mark.parametrize("options", ["", "-mno-avx512f", "-mno-avx"])
def test_compilers_and_registers_make_no_difference(name: str, options: str, monkeypatch) -> None:
    """The same bits in lanes of eight, four and two; one lane takes the C library's functions, which differ in the last bit."""
    step, starts, how = steps.noisy(), steps.noisy_starts(11), {"seed": 3, "parameters": [0.003]}
    expected = flown(step, starts, SHORT, **how)
    monkeypatch.setenv("CC", f"{name} {options}")
    if options and "__x86_64__" not in compiler().macros:
        pytest.skip("an option of another processor")
    assert flown(step, starts, SHORT, **how).tobytes() == expected.tobytes()
    flights = batch(step, starts, SHORT, 0, 3, None, [0.003])
    plain = Native(step, lanes=1).fly(flights, 1, lambda done: None)
    assert np.allclose(plain, expected, rtol=1e-12, atol=1e-12)


def test_shared_cores_are_compiled_once_whatever_stands_in_the_tables() -> None:
    step = steps.noisy()
    other = Table(np.arange(20.0), np.ones((20, 2)))
    moved = dataclasses.replace(step, lookups=(Lookup(other, step.lookups[0].variable), step.lookups[1]))
    assert Native(moved).library is Native(step).library

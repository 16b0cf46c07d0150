"""Many flights at once: each tells the numbers of its record, and none feels the others."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from engine import steps
from gammastar import so3
from gammastar.errors import InputError, SingularStartError, UnknownColumnError
from gammastar.flight.reductions import CODES, reduced
from gammastar.flight.watch import Status
from gammastar.vehicle import presets

PLAIN = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
DRAGGED = gs.Vehicle(
    mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81, forces=[gs.LinearDrag((0.3, 0.3, 0.2))]
)
POLES = (-3.4, -3.8, -4.2, -4.6)
COURSE = gs.waypoints([(0, 0, -2), (4, 1, -3), (6, 5, -1.5), (2, 8, -1)])
NEAR = (gs.State((1.2, 0.1, 0.1), attitude=so3.roll(40)), gs.State((0.2, 1.3, -0.1), (0.1, 0.2, 0.0)))
NOISY = gs.Sensors(
    gs.Channel((0.01, 0.02, 0), 50, delay=0.01), gs.Channel(0.01, bias=0.01, dropout=0.2), gs.Channel(1e-3)
)
GUSTY = gs.Wind((1, 0.5, 0), gs.Gusts((0.3, 0.2, 0.1), 0.5))


def case(kind: str) -> tuple[gs.Law, tuple[gs.State, ...], dict[str, Any]]:
    """Return a law, starts and a setting."""
    circle, implicit = gs.paths.circle(), gs.paths.circle(kind="implicit")
    quick: dict[str, Any] = {"speed": 1.0, "duration": 1.5, "step": 2e-3}
    if kind == "implicit":
        return gs.design(PLAIN, implicit, POLES), NEAR, quick
    if kind == "stop":
        return (
            gs.design(PLAIN, COURSE, POLES),
            (gs.State((1, 0, -2)), gs.State((3, 3, -2)), gs.State((0, 10, -1))),
            quick,
        )
    if kind == "noise":
        noise = gs.SensorNoise((0.01, 0, 0.01), (0, 0, 0.02))
        return gs.design(PLAIN, circle, POLES), NEAR, quick | {"feedback": "middle", "rate": 100.0, "noise": noise}
    if kind == "autopilot":
        law = gs.design(presets.load("hummingbird"), circle, -4, rejection=gs.Observer(), approach=gs.Approach())
        return law, (*NEAR, gs.State((0, 0, 0.5))), quick | {"rate": 200.0, "step": 5e-3, "sensors": NOISY}
    if kind == "wind":
        setting = quick | {"truth": DRAGGED, "wind": GUSTY, "rate": 200.0, "step": 5e-3}
        return gs.design(PLAIN, COURSE, POLES), (gs.State((1, 0, -2)), gs.State((3, 3, -2))), setting
    if kind == "free fall":
        law = gs.design(gs.Vehicle(0.1, (0.0177, 0.0177, 0.0344), gravity=9.8), gs.paths.line(), -2)
        return law, (gs.State((0, 0, -1), attitude=so3.roll(180)),), {"speed": 0.0, "duration": 2.0}
    if kind == "focal point":
        law = gs.design(gs.Vehicle(0.1, (0.0177, 0.0177, 0.0344), gravity=9.8), circle, -1.5)
        return law, (gs.State((1.4, 0, 0), (-2, 0, 0)),), {"speed": 1.0, "duration": 3.0}
    assert kind == "unresolved"
    return (
        gs.design(PLAIN, circle, POLES),
        (gs.State((1.2, 0, 0), angular_velocity=(0, 0, 150.5)),),
        quick,
    )  # slower after a step


KINDS = ("implicit", "stop", "noise", "autopilot", "wind", "free fall", "focal point", "unresolved")


@functools.cache
def flown(kind: str) -> gs.Flights:
    law, starts, setting = case(kind)
    return gs.fly_many(law, starts, seed=7, machine="casadi", **setting)


def told(record: gs.FlightRecord) -> dict[str, Any]:
    """Return what a record's summary tells under the names of the columns."""
    all_of = record.summary()
    distance, thrust, margin = all_of["distance_m"], all_of["thrust_N"], all_of["margin_min"]
    values = {
        "end_time_s": all_of["end_time_s"],
        "settling_time_s": all_of["settling_time_s"]["measured"],
        "final_distance_m": distance["final"],
        "min_thrust_N": thrust["min"],
        "max_thrust_N": thrust["max"],
        "peak_rate_rad_s": all_of["peak_rate_rad_s"],
        "peak_torque_N_m": all_of["peak_torque_N_m"],
        "peak_speed_m_s": all_of["peak_speed_m_s"],
        "min_free_fall_margin_m_s2": margin["free_fall_m_s2"],
        "min_focal_margin": margin["focal"],
        "so3_drift": all_of["so3_drift"],
        "waiting_time_s": record.waiting.sum() * (record.time[1] - record.time[0] if len(record.time) > 1 else 0.0),
        "given_up": 0 if record.autopilot is None else record.autopilot.given_up.max(),
    }
    if not record.waiting.any():
        values["max_distance_m"] = distance["max"]
    if record.completed:
        values["max_distance_last_quarter_m"] = distance["max_last_quarter"]
        values["rms_distance_last_quarter_m"] = distance["rms_last_quarter"]
    return values


@pytest.mark.parametrize("kind", KINDS)
def test_a_flight_among_many_tells_the_numbers_of_its_record(kind: str) -> None:
    """Both fly the same step; the measures that are carried along agree with those of the rows to rounding."""
    law, starts, setting = case(kind)
    flights = flown(kind)
    for place, start in enumerate(starts):
        record = gs.fly(law, start, seed=7, flight=place, **setting)
        assert flights["status"][place] == record.status.name.lower()
        for name, value in told(record).items():
            expected = np.nan if value is None else value
            assert flights[name][place] == pytest.approx(expected, rel=1e-9, abs=1e-9, nan_ok=True), name
    if kind in ("free fall", "focal point", "unresolved"):
        assert flights["status"].tolist() == [kind.replace(" ", "_")]
        assert np.isnan(flights["max_distance_last_quarter_m"]).all()


def test_while_a_target_waits_the_distance_is_that_beside_it() -> None:
    """Never less than the distance to the whole path, which no flight can search as it goes; and more where another point is nearer."""
    law = gs.design(PLAIN, gs.paths.circle(), POLES, approach=gs.Approach())
    start, setting = gs.State((0.05, 0, 0), (-0.3, 0, 0)), {"speed": 0.0, "duration": 0.5, "step": 2e-3}
    record = gs.fly(law, start, **setting)
    flights = gs.fly_many(law, [start], machine="casadi", **setting)
    assert record.waiting[-1]
    assert flights["waiting_time_s"][0] == pytest.approx(record.waiting.sum() * record.time[1])
    beside = np.linalg.norm(record.position - [1, 0, 0], axis=1)
    assert flights["final_distance_m"][0] == pytest.approx(beside[-1], abs=1e-3)
    assert flights["max_distance_m"][0] >= record.distance.max()


def test_progress_is_told_over_all_flights() -> None:
    law, starts, setting = case("noise")
    told = list[tuple[int, int]]()
    gs.fly_many(law, starts, machine="casadi", progress=lambda done, total: told.append((done, total)), **setting)
    assert told[-1] == (2 * 151, 2 * 151)
    assert told == sorted(told)


@steps.needs_compiler
def test_compiled_flights_are_those_of_the_virtual_machine() -> None:
    """To rounding; and to the last bit whatever the number of workers, and when one is recorded."""
    law, starts, setting = case("noise")
    one, two = (gs.fly_many(law, starts * 5, seed=7, machine="native", workers=n, **setting) for n in (1, 2))
    for name, column in flown("noise").items():
        assert np.array_equal(one[name], two[name], equal_nan=column.dtype.kind == "f")
        if name not in ("flight", "status"):
            assert one[name][:2] == pytest.approx(column, rel=1e-9, abs=1e-9, nan_ok=True)
    record = one.record(1)
    speeds = np.linalg.norm(record.velocity, axis=1)
    assert speeds.max() == pytest.approx(one["peak_speed_m_s"][1], rel=1e-15)


@pytest.mark.parametrize("kind", ["stop", "noise", "autopilot", "wind"])
def test_a_flight_is_the_same_alone_and_in_any_order(kind: str) -> None:
    """To the last bit, also where each flight has a reference of its own."""
    law, starts, setting = case(kind)
    whole, last = flown(kind), len(starts) - 1
    alone = gs.fly_many(law, starts[last:], flights=[last], seed=7, machine="casadi", **setting)
    turned = gs.fly_many(law, starts[::-1], flights=range(last, -1, -1), seed=7, machine="casadi", **setting)
    for name, column in whole.items():
        assert np.array_equal(alone[name], column[last:], equal_nan=column.dtype.kind == "f")
        assert np.array_equal(turned[name][::-1], column, equal_nan=column.dtype.kind == "f")


def test_any_flight_can_be_recorded() -> None:
    law, starts, setting = case("autopilot")
    flights = gs.fly_many(law, starts, seed=7, machine="casadi", record=(1,), **setting)
    assert list(flights.records) == [1]
    for place in (0, 1):
        record = flights.record(place)
        assert np.array_equal(record.state, gs.fly(law, starts[place], seed=7, flight=place, **setting).state)
        assert record.distance[-1] == pytest.approx(flights["final_distance_m"][place], abs=1e-12)
    assert flights.record(1) is flights.records[1]
    assert not np.array_equal(flights.record(0).state, gs.fly(law, starts[0], seed=7, flight=1, **setting).state)


def test_a_start_that_is_singular_is_told_and_harms_no_other() -> None:
    """On the axis of the circle, without thrust, and so fast that the law's numbers overflow."""
    law = gs.design(PLAIN, gs.paths.circle(), POLES)
    starts = [NEAR[0], gs.State((0, 0, 0)), gs.State((1, 0, 0), thrust=-1.0), NEAR[1]]
    starts.append(gs.State((1.2, 0, 0), (0, 1e200, 0)))
    flights = gs.fly_many(law, starts, speed=1.0, duration=0.1, machine="casadi")
    assert flights["status"].tolist() == ["completed", *["singular_start"] * 2, "completed", "singular_start"]
    assert np.isnan(flights["max_distance_m"]).tolist() == [False, True, True, False, True]
    assert flights.summary()["status"] == {"completed": 2, "singular_start": 3}
    assert flights.record(3).completed
    with pytest.raises(SingularStartError, match="place 1"):
        flights.record(1)
    nobody = gs.fly_many(law, starts[1:3], speed=1.0, duration=0.1, machine="casadi")
    assert nobody["status"].tolist() == ["singular_start"] * 2
    assert len(gs.fly_many(law, [], speed=1.0)["status"]) == 0


def test_after_its_end_a_flight_does_not_change() -> None:
    """Status, measures and state stay, whatever steps are taken further."""
    flights = flown("free fall")
    loop = flights.loops[0]
    assert loop is not None
    step = reduced(loop).graph()
    state = np.concatenate([flights.firsts[:, 0], flights.final[:, 0]])
    assert CODES[int(flights.final[0, 0])] is Status.FREE_FALL
    for wild in (state, np.where(np.arange(len(state)) < len(flights.firsts), np.nan, state)):
        after, _ = step(wild, [0, 0, 1e-3, -np.inf, np.inf], [3])
        assert np.array_equal(after.full().ravel(), wild, equal_nan=True)


def test_the_summary_counts_and_orders() -> None:
    summary = flown("implicit").summary()
    assert summary["flights"] == summary["status"]["completed"] == 2
    found = flown("implicit")["max_thrust_N"]
    assert summary["max_thrust_N"]["min"] == found.min()
    assert summary["max_thrust_N"]["median"] == pytest.approx(found.mean())
    assert summary["max_thrust_N"]["max"] == found.max()


def test_flights_and_records_are_shown_in_a_line() -> None:
    flights = flown("implicit")
    assert repr(flights).startswith("<2 flights: 2 completed; columns flight, status, ")
    assert repr(flights.record(1)) == "<a flight of 1.5 s in 751 rows: flew to the end>"
    assert repr(gs.fly_many(flights.task.law, [], speed=1.0, machine="casadi")).startswith("<0 flights: none; ")


def test_a_column_that_is_none_names_those_that_are() -> None:
    """It is a KeyError too, so that flights are a mapping."""
    flights = flown("implicit")
    assert flights.get("final_distance", None) is None
    with pytest.raises(
        UnknownColumnError, match=r"(?s)^column must be one of .*got 'final_distance'.*final_distance_m"
    ) as caught:
        flights["final_distance"]
    assert isinstance(caught.value, KeyError)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"starts": NEAR[0]}, "starts must be a list"),
        ({"starts": [3.0]}, r"gs\.State"),
        ({"flights": [1]}, "flights must be 2 whole numbers"),
        ({"flights": [1, -1]}, "flights must be 2 whole numbers"),
        ({"record": [2]}, "below the number of flights"),
        ({"machine": "abacus"}, "must be one of"),
        ({"speed": None}, "exactly one of speed and reference"),
        ({"noise": gs.SensorNoise()}, "sampled feedback"),
        ({"record": 3}, "record must be a list of places"),
        ({"law": []}, r"laws must be one, or one a start \(got 0 for 2\)"),
        ({"varied": [1, 2]}, "varied must be a Mapping"),
        ({"varied": {"mass_scale": ["a", "b"]}}, "mass_scale must be numbers"),
    ],
    ids=str,
)
def test_what_cannot_be_flown_is_refused(arguments: dict[str, Any], words: str) -> None:
    law = gs.design(PLAIN, gs.paths.circle(), POLES)
    given = {"law": law, "starts": NEAR, "speed": 1.0, "duration": 0.1} | arguments
    with pytest.raises(InputError, match=words):
        gs.fly_many(**given)
    with pytest.raises(InputError, match="below their number"):
        flown("implicit").record(2)


def test_seeds_and_numbers_that_differ_in_their_last_digit_draw_anew() -> None:
    """Up to the largest word; a double does not hold their last digits."""
    law, far = gs.design(PLAIN, gs.paths.circle(), POLES), 2**64 - 1
    setting: dict[str, Any] = {"speed": 1.0, "duration": 0.1, "step": 1e-2, "feedback": "start", "rate": 100.0}
    setting["noise"] = gs.SensorNoise((0.1, 0.1, 0.1), (0, 0, 0))
    ends = list[float]()
    for seed in (far, far - 1):
        setting["seed"] = seed
        flights = gs.fly_many(law, [NEAR[0]] * 3, flights=[far, far - 1, 0], machine="casadi", **setting)
        ends += flights["final_distance_m"].tolist()
        assert flights["flight"].tolist() == [far, far - 1, 0]
        assert gs.fly(law, NEAR[0], flight=far, **setting).distance[-1] == flights["final_distance_m"][0]
    assert len(set(ends)) == 6

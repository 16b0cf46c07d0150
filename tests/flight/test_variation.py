"""Flights that differ in vehicle, noise, wind, tuning or speed, flown together, are those that are flown apart with these numbers."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from gammastar.errors import InputError
from gammastar.vehicle import Scales, presets, scaled

COUNT = 3
HUMMINGBIRD = presets.load("hummingbird")
PATH = gs.paths.ellipse((1.0, 1.3))
STARTS = [gs.State((1.5 + 0.1 * k, 0.2, -0.5), attitude=gs.so3.roll(60 * k)) for k in range(COUNT)]
BARE: dict[str, Any] = {"speed": 1.0, "duration": 1.0, "step": 2e-3, "settled_within": 0.01}
SENSORS = gs.Sensors(gs.Channel(1e-3, rate=100.0, bias=1e-3), attitude=gs.Channel(2e-3, dropout=0.1))
NOISE = gs.SensorNoise((1e-3, 0, 1e-3), attitude=(0, 0, 2e-3))
SETTING = BARE | {"sensors": SENSORS}
TOLD = ("max_distance_m", "final_distance_m", "max_thrust_N", "peak_rate_rad_s", "min_free_fall_margin_m_s2")
SCALES = {
    "mass_scale": np.array([0.9, 1.0, 1.2]),
    "inertia_scale": np.array([[1.0, 1.0, 1.0], [0.9, 1.1, 1.0], [1.05, 1.0, 0.95]]),
    "thrust_scale": np.array([1.05, 0.95, 1.0]),
    "lag_scale": np.array([0.3, 1.0, 3.0]),
    "force_scale": np.array([0.5, 1.0, 2.0]),
    "noise_scale": np.array([2.0, 0.0, 0.5]),
    "wind": np.array([[0.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.0, 1.0, 0.5]]),
}


def quadrotor(poles: float = -5.0, speed: float = 2.0, force: float = 40.0) -> gs.Law:
    approach, observer = gs.Approach(speed), gs.Observer(force, 120.0)
    return gs.design(HUMMINGBIRD, PATH, poles=poles, approach=approach, rejection=observer)


def compared(flights: gs.Flights, place: int, record: gs.FlightRecord) -> None:
    """The row of a flight, and its record, tell what the flight flown apart tells."""
    told = record.summary()
    expected = {
        "max_distance_m": told["distance_m"]["max"],
        "final_distance_m": told["distance_m"]["final"],
        "max_thrust_N": told["thrust_N"]["max"],
        "peak_rate_rad_s": told["peak_rate_rad_s"],
        "min_free_fall_margin_m_s2": told["margin_min"]["free_fall_m_s2"],
    }
    for name, value in expected.items():
        assert flights[name][place] == pytest.approx(value, rel=1e-8), name
    again = flights.record(place)
    np.testing.assert_allclose(again.position, record.position, atol=1e-9)
    np.testing.assert_allclose(again.state[:, 19], record.state[:, 19], rtol=1e-6, atol=1e-6)
    assert again.truth.mass == pytest.approx(record.truth.mass)
    assert again.summary()["distance_m"]["max"] == pytest.approx(flights["max_distance_m"][place], rel=1e-12)


@pytest.mark.parametrize("names", [["mass_scale"], ["wind"], list(SCALES)], ids=["mass", "wind", "all"])
def test_vehicles_that_differ_fly_as_they_do_apart(names: list[str]) -> None:
    law = quadrotor()
    varied = {name: SCALES[name] for name in names}
    flights = gs.fly_many(law, STARTS, varied=varied, machine="casadi", **SETTING)
    for place in range(COUNT):
        given = {name.removesuffix("_scale"): SCALES[name][place] for name in names}
        sensors, wind = SENSORS.scaled(given.pop("noise", 1.0)), gs.Wind(given.pop("wind", np.zeros(3)))
        truth = scaled(HUMMINGBIRD, thrust=given.pop("thrust", 1.0), lag=given.pop("lag", 1.0), scales=Scales(**given))
        record = gs.fly(law, STARTS[place], truth=truth, flight=place, **SETTING | {"sensors": sensors, "wind": wind})
        compared(flights, place, record)


def test_only_noise_is_scaled() -> None:
    """Deviations are, and neither biases nor rates nor losses."""
    position, attitude = SENSORS.scaled(3.0).position, SENSORS.scaled(3.0).attitude
    assert [np.asarray(each.deviation)[0] for each in (position, attitude)] == pytest.approx([3e-3, 6e-3])
    assert (np.asarray(position.bias)[0], np.asarray(position.rate)[0], attitude.dropout) == (1e-3, 100.0, 0.1)


@pytest.mark.parametrize("feedback", ["continuous", "middle"])
def test_a_law_by_itself_flies_vehicles_that_differ(feedback: str) -> None:
    vehicle = gs.Vehicle(0.5, (0.0037, 0.0037, 0.007), forces=[gs.LinearDrag(0.1)])
    law = gs.design(vehicle, PATH, poles=-5)
    setting = BARE | {"feedback": feedback}
    varied = {name: SCALES[name] for name in ("mass_scale", "force_scale")}
    if feedback == "middle":
        setting |= {"rate": 250.0, "noise": NOISE}
        varied["noise_scale"] = SCALES["noise_scale"]
    flights = gs.fly_many(law, STARTS, varied=varied, machine="casadi", **setting)
    for place in range(COUNT):
        truth = scaled(vehicle, Scales(mass=varied["mass_scale"][place], force=varied["force_scale"][place]))
        own = {"noise": NOISE.scaled(varied["noise_scale"][place])} if feedback == "middle" else {}
        compared(flights, place, gs.fly(law, STARTS[place], truth=truth, flight=place, **setting | own))


def test_inner_loops_that_differ_fly_as_they_do_apart() -> None:
    law = gs.design(HUMMINGBIRD, PATH, poles=-4, interface="rates")
    bandwidths, setting = np.array([10.0, 20.0, 40.0]), BARE | {"rate": 100.0, "step": 0.01, "duration": 0.5}
    flights = gs.fly_many(law, STARTS, varied={"rate_bandwidth": bandwidths}, machine="casadi", **setting)
    for place, bandwidth in enumerate(bandwidths):
        truth = dataclasses.replace(HUMMINGBIRD, rate_bandwidth=bandwidth)
        compared(flights, place, gs.fly(law, STARTS[place], truth=truth, flight=place, **setting))
        assert flights.record(place).truth.rate_bandwidth == bandwidth
    with pytest.raises(InputError, match="rate bandwidth must be at most 100 rad/s"):
        gs.fly_many(law, STARTS, varied={"rate_bandwidth": [10.0, 20.0, 101.0]}, **setting)


@pytest.mark.parametrize("ends", [False, True])
def test_speeds_that_differ_fly_as_they_do_apart(ends: bool) -> None:
    """Where a speed leaves the place free, and along a path that ends, to whose end each flies at its own speed."""
    path = gs.waypoints([(0, 0, 0), (1, 1, 0), (3, 1, 0)]) if ends else PATH
    law, speeds = gs.design(gs.Vehicle(0.5, (0.0037, 0.0037, 0.007)), path, poles=-5), [0.5, 1.0, -0.7]
    setting = BARE | {"feedback": "start", "rate": 100.0, "step": 0.01}
    flights = gs.fly_many(law, STARTS, machine="casadi", **setting | {"speed": speeds})
    for place, speed in enumerate(speeds):
        compared(flights, place, gs.fly(law, STARTS[place], flight=place, **setting | {"speed": speed}))
        assert flights.record(place).reference == gs.Speed(speed)
    again = gs.fly_many(law, STARTS[2:], machine="casadi", flights=[2], **setting | {"speed": speeds[2:]})
    assert all(again[name][0] == flights[name][2] for name in TOLD)


@pytest.mark.parametrize(
    ("speed", "said"),
    [([1.0, 2.0], r"must have shape \(3,\)"), ([1.0, 0.0, 1.0], "must all hold a place in the end, or none")],
)
def test_speeds_that_do_not_fit_are_refused(speed: list[float], said: str) -> None:
    law = gs.design(gs.Vehicle(0.5, (0.0037, 0.0037, 0.007)), gs.waypoints([(0, 0, 0), (1, 1, 0), (3, 1, 0)]))
    with pytest.raises(InputError, match=said):
        gs.fly_many(law, STARTS, **BARE | {"speed": speed})


def test_laws_that_differ_fly_as_they_do_apart() -> None:
    laws = [quadrotor(), quadrotor(poles=-6.0, speed=1.0), quadrotor(force=25.0)]
    flights = gs.fly_many(laws, STARTS, machine="casadi", **SETTING)
    for place, law in enumerate(laws):
        compared(flights, place, gs.fly(law, STARTS[place], flight=place, **SETTING))
        assert flights.record(place).law is law
    built = gs.engine.compilations()
    again = gs.fly_many([laws[2], quadrotor(-5.5, 1.5, 30.0)], STARTS[1:], flights=[1, 2], machine="casadi", **SETTING)
    alone = gs.fly_many(laws[2:], STARTS[2:], flights=[2], machine="casadi", **SETTING)
    assert gs.engine.compilations() == built
    assert again["final_distance_m"][0] != flights["final_distance_m"][1]
    assert all(alone[name][0] == flights[name][2] for name in TOLD)


def test_compiled_flights_are_the_same() -> None:
    law = quadrotor()
    by_machine = [
        gs.fly_many(law, STARTS, varied=SCALES, machine=machine, **SETTING) for machine in ("casadi", "native")
    ]
    for name in TOLD:
        np.testing.assert_allclose(by_machine[0][name], by_machine[1][name], rtol=1e-9)


def test_a_flight_among_others_is_the_flight_alone_to_the_last_bit() -> None:
    law, setting = quadrotor(), SETTING | {"machine": "native"}
    together = gs.fly_many(law, STARTS, varied=SCALES, **setting)
    alone = gs.fly_many(
        law, STARTS[2:], varied={name: values[2:] for name, values in SCALES.items()}, flights=[2], **setting
    )
    assert all(together[name][2] == alone[name][0] for name in TOLD)


def test_laws_of_other_vehicles_are_flown_apart() -> None:
    other = dataclasses.replace(quadrotor(), vehicle=dataclasses.replace(HUMMINGBIRD, mass=0.6))
    with pytest.raises(InputError, match="fly them apart"):
        gs.fly_many([quadrotor(), other, quadrotor()], STARTS, **SETTING)


@pytest.mark.parametrize(
    ("varied", "said"),
    [
        ({"mas_scale": [1, 1, 1]}, 'did you mean "mass_scale"'),
        ({"mass_scale": [1, 1]}, r"shape \(3,\)"),
        ({"inertia_scale": [[1, 1, 1], [1, 2, 4], [1, 1, 1]]}, "inertia .* must satisfy the triangle inequality"),
        ({"mass_scale": [1, 1, -1]}, "finite and positive"),
        ({"noise_scale": [1, 0, -1]}, "finite and not negative"),
        ({"wind": [1, 1, 1]}, r"shape \(3, 3\)"),
        ({"wind": np.full((3, 3), np.nan)}, "finite"),
    ],
)
def test_what_cannot_vary_is_refused(varied: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        gs.fly_many(quadrotor(), STARTS, varied=varied, **SETTING)


@pytest.mark.parametrize("name", ["thrust_scale", "lag_scale", "force_scale", "noise_scale", "rate_bandwidth", "wind"])
def test_what_has_no_effect_is_refused(name: str) -> None:
    law = gs.design(gs.Vehicle(0.5, (0.0037, 0.0037, 0.007)), PATH, poles=-5)
    with pytest.raises(InputError, match=f"{name} needs a vehicle with"):
        gs.fly_many(law, STARTS, varied={name: SCALES.get(name, [1.0, 2.0, 3.0])}, **BARE)

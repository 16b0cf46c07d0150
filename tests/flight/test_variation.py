"""Flights that differ in vehicle, wind or tuning, flown together, are those that are flown apart with these numbers."""

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
SETTING: dict[str, Any] = {"speed": 1.0, "duration": 1.0, "step": 2e-3, "settled_within": 0.01}
TOLD = ("max_distance_m", "final_distance_m", "max_thrust_N", "peak_rate_rad_s", "min_free_fall_margin_m_s2")
SCALES = {
    "mass_scale": np.array([0.9, 1.0, 1.2]),
    "inertia_scale": np.array([[1.0, 1.0, 1.0], [0.9, 1.1, 1.0], [1.05, 1.0, 0.95]]),
    "thrust_scale": np.array([1.05, 0.95, 1.0]),
    "force_scale": np.array([0.5, 1.0, 2.0]),
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
    assert again.truth.mass == pytest.approx(record.truth.mass)
    assert again.summary()["distance_m"]["max"] == pytest.approx(flights["max_distance_m"][place], rel=1e-12)


@pytest.mark.parametrize("names", [["mass_scale"], ["wind"], list(SCALES)], ids=["mass", "wind", "all"])
def test_vehicles_that_differ_fly_as_they_do_apart(names: list[str]) -> None:
    law = quadrotor()
    varied = {name: SCALES[name] for name in names}
    flights = gs.fly_many(law, STARTS, varied=varied, machine="casadi", **SETTING)
    for place in range(COUNT):
        given = {name.removesuffix("_scale"): SCALES[name][place] for name in names}
        thrust, wind = given.pop("thrust", 1.0), given.pop("wind", np.zeros(3))
        truth = scaled(HUMMINGBIRD, Scales(**given), thrust)
        record = gs.fly(law, STARTS[place], truth=truth, wind=gs.Wind(wind), flight=place, **SETTING)
        compared(flights, place, record)


@pytest.mark.parametrize("feedback", ["continuous", "middle"])
def test_a_law_by_itself_flies_vehicles_that_differ(feedback: str) -> None:
    vehicle = gs.Vehicle(0.5, (0.0037, 0.0037, 0.007), forces=[gs.LinearDrag(0.1)])
    law = gs.design(vehicle, PATH, poles=-5)
    setting = SETTING | {"feedback": feedback, "rate": None if feedback == "continuous" else 250.0}
    varied = {"mass_scale": SCALES["mass_scale"], "force_scale": SCALES["force_scale"]}
    flights = gs.fly_many(law, STARTS, varied=varied, machine="casadi", **setting)
    for place in range(COUNT):
        truth = scaled(vehicle, Scales(mass=varied["mass_scale"][place], force=varied["force_scale"][place]))
        compared(flights, place, gs.fly(law, STARTS[place], truth=truth, flight=place, **setting))


def test_laws_that_differ_fly_as_they_do_apart() -> None:
    laws = [quadrotor(), quadrotor(poles=-6.0, speed=1.0), quadrotor(force=25.0)]
    flights = gs.fly_many(laws, STARTS, machine="casadi", **SETTING)
    for place, law in enumerate(laws):
        compared(flights, place, gs.fly(law, STARTS[place], flight=place, **SETTING))
        assert flights.record(place).law is law


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
        ({"mass_scale": [1, 1, -1]}, "finite and positive"),
        ({"wind": [1, 1, 1]}, r"shape \(3, 3\)"),
        ({"wind": np.full((3, 3), np.nan)}, "finite"),
    ],
)
def test_what_cannot_vary_is_refused(varied: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        gs.fly_many(quadrotor(), STARTS, varied=varied, **SETTING)


@pytest.mark.parametrize("name", ["thrust_scale", "force_scale", "wind"])
def test_what_has_no_effect_is_refused(name: str) -> None:
    law = gs.design(gs.Vehicle(0.5, (0.0037, 0.0037, 0.007)), PATH, poles=-5)
    with pytest.raises(InputError, match=f"{name} needs a vehicle with"):
        gs.fly_many(law, STARTS, varied={name: SCALES[name]}, **SETTING)

"""The oracle: the closed form against its own laws, and against the numbers that the design prints."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest
import scipy.integrate

from gammastar import so3
from gammastar.errors import InputError, PredictionError, SingularStartError
from gammastar.law import Point, Prediction, Ramp, Speed, Stop, design
from gammastar.path import catalogue as paths
from gammastar.vehicle import State
from strategies import PAPER_POSITION, PAPER_VEHICLE, PATHS, UPRIGHT, UPSIDE_DOWN, VEHICLES

TIMES = np.arange(0, 20.0005, 1e-3)
STARTS = {"upright": UPRIGHT, "upside down": UPSIDE_DOWN}
# Design, section 5: equal poles -p on all chains, zeta1(0) = m g: min T/mg, max T/mg, largest rate [rad/s].  Printed to the
# digits given; its torques are not repeated here, tests/flight compares ours with simulation.
PRINTED = {
    (1.5, "upright"): ("0.73", "1.16", "0.5"),
    (2.0, "upright"): ("0.56", "1.27", "1.3"),
    (2.5, "upright"): ("0.43", "1.40", "4.1"),
    (3.0, "upright"): ("0.38", "1.56", "11"),
    (4.0, "upright"): ("0.34", "1.98", "34"),
    (1.5, "upside down"): ("0.11", "1.64", "28"),
    (2.0, "upside down"): ("0.19", "1.55", "20"),
    (2.5, "upside down"): ("0.30", "1.52", "13"),
    (3.0, "upside down"): ("0.49", "1.59", "8.2"),
    (4.0, "upside down"): ("0.82", "1.96", "7.5"),
}


@functools.cache
def paper_flight(pole: float, start: str) -> Prediction:
    """Return the paper's flight in closed form: implicit circle with the printed functions, 1 rad/s along it."""
    law = design(PAPER_VEHICLE, PATHS["quadratic circle"], poles=-pole)
    return law.predict(State(PAPER_POSITION, attitude=STARTS[start]), Speed(1.0), TIMES)


def half_a_unit(printed: str) -> float:
    """Return half of the last digit's unit, with a little room for a digit that was rounded twice."""
    digits = len(printed.split(".")[1]) if "." in printed else 0
    return 0.56 * 10.0**-digits


@pytest.mark.parametrize(("pole", "start"), PRINTED)
def test_the_paper_scenarios_meet_the_numbers_of_the_design(pole: float, start: str) -> None:
    flight, (least, most, rate) = paper_flight(pole, start), PRINTED[pole, start]
    weight = PAPER_VEHICLE.weight
    assert flight.thrust.min() / weight == pytest.approx(float(least), abs=half_a_unit(least))
    assert flight.thrust.max() / weight == pytest.approx(float(most), abs=half_a_unit(most))
    assert flight.tilt_rate.max() == pytest.approx(float(rate), abs=half_a_unit(rate))


def test_the_inverted_start_costs_more_than_the_upright_one_only_with_slow_poles() -> None:
    """The paper's remark on effort holds below p of about 2.8 (design, section 5)."""
    costs = {p: [paper_flight(p, start).tilt_rate.max() for start in STARTS] for p in (1.5, 2.0, 2.5, 3.0, 4.0)}
    assert {p: upside > up for p, (up, upside) in costs.items()} == {
        1.5: True,
        2.0: True,
        2.5: True,
        3.0: False,
        4.0: False,
    }


# --- laws of the closed form itself ----------------------------------------------------------------------------------

SCENARIOS = {
    "circle": ("paper", "circle", Speed(1.0), State((1.5, 0.4, 9.6), attitude=so3.roll(60))),
    "quadratic circle": ("loaded", "quadratic circle", Ramp(-0.8), State((1.5, 0.4, 9.6), (0.3, 0, 0), so3.roll(30))),
    "line": ("full inertia", "line", Stop(0.7, 8.0, 3.0), State((0, 2, 3), attitude=so3.pitch(-100))),
    "helix": ("loaded", "helix", Speed(0.5), State((1.0, 0.6, 1.5), angular_velocity=(0.5, -0.3, 0.8))),
    "ellipse": ("paper", "ellipse", Point(2.0), State((3.4, 1.0, 2.5), (0.1, 0.2, 0.3), so3.yaw(40))),
    "nonplanar circle": (
        "full inertia",
        "nonplanar circle",
        Ramp(0.45),
        State((1.6, 0.3, 1.2), attitude=so3.roll(-20)),
    ),
    "twisted": ("paper", "twisted", Ramp(0.2), State((0, 0.3, 0.1))),
    "parabola": ("loaded", "parabola", Point(0.7), State((0.2, 0.1, 0.1))),
}


@functools.cache
def scenario(name: str) -> tuple[Prediction, State]:
    body, path, reference, start = SCENARIOS[name]
    law = design(VEHICLES[body], PATHS[path], poles=(-1.5, -2, -2 + 1j, -2 - 1j))
    return law.predict(start, reference, np.arange(0, 8.0005, 1e-3), yaw_reference=0.2), start


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_closed_form_starts_at_the_start(name: str) -> None:
    """Position, velocity, thrust vector and rates at time zero are those of the state, though only outputs were stored."""
    flight, start = scenario(name)
    weight = VEHICLES[SCENARIOS[name][0]].weight
    assert flight.position[0] == pytest.approx(start.position, abs=1e-11)
    assert flight.velocity[0] == pytest.approx(start.velocity, abs=1e-11)
    assert flight.thrust[0] == pytest.approx(weight, rel=1e-11)
    assert flight.thrust_direction[0] == pytest.approx(start.attitude[:, 2], abs=1e-11)
    assert flight.tilt_rate[0] == pytest.approx(np.hypot(*start.angular_velocity[:2]), abs=1e-10)
    assert flight.yaw_output[0] == pytest.approx(start.angular_velocity[2], abs=1e-15)


@pytest.mark.parametrize("name", SCENARIOS)
def test_predicted_derivatives_integrate_into_each_other(name: str) -> None:
    """Position, velocity, acceleration, jerk, snap at 1 ms: Simpson's rule is exact to 1e-13 times a fifth derivative."""
    flight, _ = scenario(name)
    chain = [flight.position, flight.velocity, flight.acceleration, flight.jerk, flight.snap]
    for lower, upper in itertools.pairwise(chain):
        change = scipy.integrate.simpson(upper, x=flight.time, axis=0)
        assert lower[-1] - lower[0] == pytest.approx(change, abs=1e-8 * (1 + np.abs(upper).max()))
        middle = len(flight.time) // 3 * 2
        change = scipy.integrate.simpson(upper[: middle + 1], x=flight.time[: middle + 1], axis=0)
        assert lower[middle] - lower[0] == pytest.approx(change, abs=1e-8 * (1 + np.abs(upper).max()))


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_chains_solve_their_differential_equations(name: str) -> None:
    """Y' = A y with the gains of the poles: an adaptive integrator against the matrix exponential."""
    flight, _ = scenario(name)
    gains = np.poly([-1.5, -2, -2 + 1j, -2 - 1j])[:0:-1].real
    for chain in flight.transverse_state.transpose(1, 0, 2):
        solved = scipy.integrate.solve_ivp(
            lambda _, y: np.append(y[1:], -gains @ y),
            (0, 8),
            chain[0],
            "DOP853",
            flight.time[::500],
            rtol=1e-12,
            atol=1e-13,
        )
        assert chain[::500] == pytest.approx(solved.y.T, abs=1e-10 * (1 + np.abs(chain).max()))
    assert flight.yaw_output == pytest.approx(
        0.2 + (flight.yaw_output[0] - 0.2) * np.exp(-2.5 * flight.time), abs=1e-14
    )


@pytest.mark.parametrize("name", SCENARIOS)
def test_tilt_is_how_the_thrust_direction_moves(name: str) -> None:
    """|d/dt R e3| = sqrt(p^2 + q^2), by central differences (error of second order in 1 ms)."""
    flight, _ = scenario(name)
    step = flight.time[1]
    rate = (flight.thrust_direction[2:] - flight.thrust_direction[:-2]) / (2 * step)
    assert np.linalg.norm(flight.thrust_direction, axis=1) == pytest.approx(np.ones(len(flight.time)), abs=1e-14)
    size = 1 + flight.tilt_acceleration.max() * (1 + flight.tilt_rate.max())
    assert np.linalg.norm(rate, axis=1) == pytest.approx(flight.tilt_rate[1:-1], abs=2e-4 * size)
    assert np.mean(np.abs(np.linalg.norm(rate, axis=1) - flight.tilt_rate[1:-1])) < 1e-5 * size


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_thrust_vector_obeys_newton(name: str) -> None:
    """M chi'' = m g e3 - zeta1 R e3 - m K_t."""
    flight, _ = scenario(name)
    vehicle = VEHICLES[SCENARIOS[name][0]]
    force = flight.thrust[:, None] * flight.thrust_direction
    expected = np.array([0, 0, vehicle.gravity]) - force / vehicle.mass - vehicle.bias_acceleration
    assert flight.acceleration == pytest.approx(expected, abs=1e-12 * np.abs(flight.acceleration).max() + 1e-12)


@pytest.mark.parametrize("name", ["circle", "ellipse", "line", "helix"])
def test_the_distance_is_the_length_of_the_transverse_vector(name: str) -> None:
    """In a rotation-minimising frame the two components keep the length of the vector to the nearest point."""
    flight, _ = scenario(name)
    assert flight.distance == pytest.approx(np.linalg.norm(flight.transverse_state[:, :, 0], axis=1), abs=1e-9)


def test_on_the_path_a_circle_takes_its_centripetal_thrust() -> None:
    """After settling at 1 rad/s on 1 m: thrust m sqrt(g^2 + 1), tilt atan(1/g), turning once per lap at sin(tilt)."""
    flight = paper_flight(2.5, "upright")
    late = flight.time > 15
    assert flight.thrust[late] == pytest.approx(np.full(late.sum(), 0.1 * np.hypot(9.8, 1)), abs=1e-9)
    assert flight.thrust_direction[late, 2] == pytest.approx(np.full(late.sum(), 9.8 / np.hypot(9.8, 1)), abs=1e-9)
    assert flight.tilt_rate[late] == pytest.approx(np.full(late.sum(), 1 / np.hypot(9.8, 1)), abs=1e-9)
    assert flight.tangential_state[late, 1] == pytest.approx(np.ones(late.sum()), abs=1e-9)


# --- times -----------------------------------------------------------------------------------------------------------


def test_the_answer_at_a_time_does_not_depend_on_the_other_times() -> None:
    """Uniform times use powers of one exponential, others one exponential each: the same numbers."""
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-2)
    start = State((1.5, 0.4, 9.6))
    uniform = law.predict(start, Speed(1.0), np.arange(0, 5.0005, 0.01))
    uneven = law.predict(start, Speed(1.0), np.array([0.01, 0.5, 0.51, 4.99]))
    rows = [1, 50, 51, 499]
    for field in ("position", "velocity", "acceleration", "jerk", "snap", "thrust", "tilt_rate", "tangential_state"):
        assert getattr(uneven, field) == pytest.approx(getattr(uniform, field)[rows], abs=1e-12 * 50)
    late = law.predict(start, Speed(1.0), np.arange(3, 5.0005, 0.01))
    assert late.position == pytest.approx(uniform.position[300:], abs=1e-12)
    assert law.predict(start, Speed(1.0), np.array([0.0])).position == pytest.approx(uniform.position[:1], abs=1e-15)


@pytest.mark.parametrize(
    "times",
    [[], [0.0, 0.0], [1.0, 0.5], [-0.1, 0.0], [0.0, np.nan], [[0.0, 1.0]], [0.0, np.inf]],
    ids=["none", "twice", "back", "before", "NaN", "nested", "forever"],
)
def test_times_grow_from_zero(times: list) -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"])
    with pytest.raises(InputError, match="growing list"):
        law.predict(State((1.5, 0.4, 9.6)), Speed(1.0), np.array(times))


def test_a_singular_start_has_no_prediction() -> None:
    with pytest.raises(SingularStartError):
        design(PAPER_VEHICLE, PATHS["circle"]).predict(State((0, 0, 9)), Speed(1.0), TIMES[:3])


@pytest.mark.parametrize("name", ["circle", "implicit circle", "quadratic circle"])
def test_beyond_a_focal_point_there_is_no_closed_form(name: str) -> None:
    """Thrown inwards, the radius in closed form falls below zero: no position belongs to it, and the first such time is told."""
    law = design(PAPER_VEHICLE, PATHS[name], poles=-1.5)
    start = State((1.4, 0, 10), velocity=(-2, 0, 0))
    with pytest.raises(PredictionError, match="focal point") as caught:
        law.predict(start, Point(0.0), TIMES[:2000])
    before = law.predict(start, Point(0.0), TIMES[caught.value.time - 2e-3 > TIMES])
    radius, across = np.hypot(*before.position[:, :2].T), before.transverse_state[:, 0, 0]
    square = name == "quadratic circle"
    expected = radius**2 - 1 if square else np.abs(radius - 1)
    assert (across if square else np.abs(across)) == pytest.approx(expected, abs=1e-9)
    assert radius[-1] < 0.1
    ending = {"quadratic circle": 0.548}.get(name, 0.7835)
    assert caught.value.time == pytest.approx(ending, abs=2e-3)


def test_the_settling_time_is_the_last_crossing() -> None:
    flight = paper_flight(2.5, "upright")
    for tolerance in (1.0, 1e-3):
        time = flight.settling_time(tolerance)
        assert np.all(flight.distance[flight.time >= time] <= tolerance)
        assert flight.distance[np.searchsorted(flight.time, time) - 1] > tolerance
    assert flight.settling_time(100.0) == 0.0
    short = design(PAPER_VEHICLE, PATHS["circle"]).predict(State(PAPER_POSITION), Speed(1.0), TIMES[:100])
    assert short.settling_time(1e-3) == np.inf


def test_the_faster_the_poles_the_sooner_it_settles() -> None:
    law = [design(PAPER_VEHICLE, paths.circle(1.0, (0, 0, 10)), poles=-p) for p in (1.5, 2.5, 4.0)]
    times = [each.predict(State(PAPER_POSITION), Speed(1.0), TIMES).settling_time(1e-3) for each in law]
    assert times[0] > times[1] > times[2]

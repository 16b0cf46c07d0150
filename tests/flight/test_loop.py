"""Sampled feedback: its order in the control interval, the design's measured numbers, and how an interval is divided."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gammastar import so3
from gammastar.errors import InputError
from gammastar.flight import FlightRecord, fly
from gammastar.flight.timing import MOST_SUBSTEPS, interval_of
from gammastar.law import Ramp, Speed, Stop, design
from gammastar.vehicle import State, Vehicle
from strategies import PATHS, VEHICLES, numbers

# Design, section 3.7: worst distance [m] to the nonplanar circle after 15 s at 0.45 rad/s, by control rate [Hz].  The gravity and the
# start are not printed; neither changes these digits.
MEASURED = {
    "start": {100: 45e-6, 400: 11e-6, 1000: 4.6e-6},
    "middle": {100: 6.1e-6, 400: 0.36e-6, 1000: 0.057e-6},
}
PELICAN = Vehicle(1.923, (1.152e-2, 1.152e-2, 2.18e-2), 9.8)


@functools.cache
def sampled_flight(feedback: str, rate: int) -> FlightRecord:
    law = design(PELICAN, PATHS["nonplanar circle"], poles=(-3, -3.3, -3.6, -3.9))
    return fly(law, State((1.6, 0.1, 1.1)), speed=0.45, duration=30.0, feedback=feedback, rate=rate, step=1 / rate)


def worst(record: FlightRecord) -> float:
    return float(record.distance[record.time >= 15].max())


@pytest.mark.parametrize(("feedback", "rate"), [(f, r) for f in MEASURED for r in MEASURED[f]])
def test_the_nonplanar_circle_meets_its_measured_distances(feedback: str, rate: int) -> None:
    """Within a factor of 2 over two laps."""
    record = sampled_flight(feedback, rate)
    assert record.completed
    assert MEASURED[feedback][rate] / 2 <= worst(record) <= MEASURED[feedback][rate] * 2


@pytest.mark.parametrize(("feedback", "order"), [("start", 1), ("middle", 2)])
def test_the_distance_has_its_order_in_the_control_interval(feedback: str, order: int) -> None:
    """Held from the start of the interval: first order.  Evaluated for its middle: second order."""
    distances = [worst(sampled_flight(feedback, rate)) for rate in (100, 200, 400)]
    assert np.log2(np.array(distances[:-1]) / distances[1:]) == pytest.approx([order, order], abs=0.1)


@pytest.mark.parametrize("feedback", ["start", "middle"])
@pytest.mark.parametrize("path", ["circle", "quadratic circle", "helix"])
def test_fast_sampling_is_continuous_feedback(path: str, feedback: str) -> None:
    """At the same speed, halving the interval brings the whole flight nearer to the closed form at the order of the hold."""
    law = design(VEHICLES["loaded"], PATHS[path], poles=-2.5)
    start = State(PATHS[path].points(np.array([0.4]))[0] * [1.1, 1.1, 1] + [0, 0, 0.2], attitude=so3.roll(40))
    gaps = []
    for rate in (200, 400):
        record = fly(law, start, reference=Ramp(0.6), duration=2.0, feedback=feedback, rate=rate, step=1 / rate)
        gaps.append(np.linalg.norm(record.position - record.prediction.position, axis=1).max())
        assert not record.nominal
    order = {"start": 1, "middle": 2}[feedback]
    assert np.log2(gaps[0] / gaps[1]) == pytest.approx(order, abs=0.2)


def test_the_input_is_held_over_its_interval() -> None:
    """One integration step or ten of them in an interval: the same input, the same flight to the integrator's error."""
    law = design(VEHICLES["full inertia"], PATHS["circle"], poles=-2.5)
    start = State((1.3, 0.2, 9.8), attitude=so3.roll(30))
    coarse, fine = (
        fly(law, start, speed=1.0, duration=1.0, feedback="start", rate=100, step=step) for step in (1e-2, 1e-3)
    )
    assert len(coarse.time) == len(fine.time) == 101
    assert np.diff(coarse.time) == pytest.approx(np.full(100, 0.01), abs=1e-15)
    assert coarse.state == pytest.approx(fine.state, abs=1e-6)
    # within an interval the thrust is the parabola of a constant second derivative
    thrust, rate = fine.state[:, 18], fine.state[:, 19]
    assert thrust[1:] == pytest.approx(thrust[:-1] + 0.01 * rate[:-1] + 0.5e-4 * fine.input[:-1, 0], abs=1e-12)
    assert rate[1:] == pytest.approx(rate[:-1] + 0.01 * fine.input[:-1, 0], abs=1e-12)


@pytest.mark.parametrize("feedback", ["start", "middle"])
def test_a_sampled_flight_follows_a_stop_and_counts_laps(feedback: str) -> None:
    law = design(VEHICLES["paper"], PATHS["implicit circle"], poles=-4)
    stop = Stop(2.0, 3.0, 2.0, laps=2)
    record = fly(law, State((1.2, 0.1, 9.9)), reference=stop, duration=14.0, feedback=feedback, rate=200)
    assert record.tangential_state[-1, 0] == pytest.approx(3.0 + 2 * 2 * np.pi, abs=1e-4)
    assert np.abs(np.diff(record.tangential_state[:, 0])).max() < 0.05  # never wraps


# --- how an interval is divided --------------------------------------------------------------------------------------


@given(numbers(1e-5, 1e-1), numbers(1.0, 2000.0))
def test_an_interval_is_cut_into_the_fewest_steps_that_are_short_enough(step: float, rate: float) -> None:
    if 1 / rate / step > MOST_SUBSTEPS:
        with pytest.raises(InputError, match="raise the step or the rate"):
            interval_of("start", step, rate)
        return
    interval, substeps = interval_of("start", step, rate)
    assert interval == 1 / rate
    assert interval / substeps <= step * (1 + 1e-8)
    assert substeps == 1 or interval / (substeps - 1) > step


@given(st.integers(1, 1000), st.integers(1, 1000))
def test_a_whole_ratio_is_not_rounded_up(rate: int, substeps: int) -> None:
    assert interval_of("middle", 1 / rate / substeps, rate) == (1 / rate, substeps)


def test_continuous_feedback_has_one_step_in_an_interval() -> None:
    assert interval_of("continuous", 2e-3, None) == (2e-3, 1)


def test_a_rate_belongs_to_sampled_feedback_alone() -> None:
    with pytest.raises(InputError, match="no control rate"):
        interval_of("continuous", 1e-3, 400.0)
    for feedback in ("start", "middle"):
        with pytest.raises(InputError, match="needs a control rate"):
            interval_of(feedback, 1e-3, None)
    assert Speed(1.0).resolved(PATHS["circle"], 0.0).holds_position is False

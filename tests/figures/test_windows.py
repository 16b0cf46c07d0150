"""Stretches of a flight, limits and wrapped lines."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from figures.kinds import KINDS
from gammastar.figures.windows import distance_text, limits, unwrapped_gaps, windows


@given(
    arrays(float, st.integers(1, 40), elements=st.floats(-3, 3)), st.floats(-50, 50), st.floats(6.5, 10)
)  # steps shorter than half a period, as any recorded flight has
def test_a_wrapped_line_stays_in_one_period_and_breaks_at_wraps(steps: np.ndarray, start: float, period: float) -> None:
    """Values lie in (-P/2, P/2] and differ from the given ones by whole periods; no drawn piece spans a wrap."""
    values = start + np.cumsum(steps)
    time, wrapped = unwrapped_gaps(np.arange(len(values), dtype=float), values, period)
    kept = ~np.isnan(wrapped)
    assert np.array_equal(np.isnan(time), ~kept)
    assert np.array_equal(time[kept], np.arange(len(values)))
    assert np.all(wrapped[kept] <= period / 2 + 1e-12)
    assert np.all(wrapped[kept] >= -period / 2 - 1e-12)
    turns = (values - wrapped[kept]) / period
    assert np.allclose(turns, np.round(turns), atol=1e-9)
    pieces = np.abs(np.diff(wrapped))
    assert np.all(pieces[~np.isnan(pieces)] <= period / 2)


def test_a_settled_flight_has_an_approach_and_a_stretch_on_the_path() -> None:
    record = KINDS["upside down"]()
    approach, follow = windows(record)
    assert approach.begin == record.time[0]
    assert approach.end == follow.begin == record.summary()["settling_time_s"]["predicted"]
    assert follow.end == record.time[-1]


def test_only_a_settled_flight_is_said_to_be_within_its_distance() -> None:
    record = KINDS["upside down"]()
    far = record.distance.copy()
    far[-1] = 10 * record.settled_within
    for distance, name in ((record.distance, "within 1 mm, own scale"), (far, "not settled, own scale")):
        assert windows(dataclasses.replace(record, distance=distance))[1].name == name


@pytest.mark.parametrize("kind", ["ended early", "one row"])
def test_a_flight_that_ended_early_has_one_stretch(kind: str) -> None:
    (only,) = windows(KINDS[kind]())
    assert only.end == KINDS[kind]().time[-1]


@given(arrays(float, st.integers(0, 20), elements=st.floats(-1e9, 1e9)))
def test_limits_enclose_every_value_and_have_a_width(values: np.ndarray) -> None:
    low, high = limits(values)
    assert low < high
    assert np.all((values > low) & (values < high))


@given(arrays(float, st.integers(1, 20), elements=st.floats(allow_nan=True, allow_infinity=True)))
def test_limits_are_finite_whatever_is_drawn(values: np.ndarray) -> None:
    low, high = limits(values)
    assert np.isfinite(high - low)
    assert low < high


@pytest.mark.parametrize(("distance", "text"), [(1.5, "1.5 m"), (1e-3, "1 mm"), (0.2, "200 mm"), (2e-5, "20 µm")])
def test_a_distance_is_written_in_the_unit_that_suits_it(distance: float, text: str) -> None:
    assert distance_text(distance) == text

"""The layout of a measurement: parts and stack are inverses, and freshness tells the axes apart."""

import itertools

import casadi as ca
import numpy as np
import pytest

from gammastar.law.measurement import SIZE, fresh_axes, freshness, join_measurement, split_measurement


def test_splitting_and_joining_are_inverses() -> None:
    stacked = ca.DM(np.arange(SIZE, dtype=float))
    parts = split_measurement(ca.SX(stacked))
    assert np.array_equal(ca.evalf(join_measurement(parts)).full(), stacked.full())
    assert ca.evalf(parts.attitude).full().tolist() == [[6, 9, 12], [7, 10, 13], [8, 11, 14]]
    assert ca.evalf(parts.fresh).full().ravel().tolist() == [18, 19, 20, 21]


@pytest.mark.parametrize("axes", list(itertools.product([0, 1], repeat=3)), ids=str)
def test_freshness_tells_all_eight_cases_apart(axes: tuple[int, int, int]) -> None:
    fresh = ca.evalf(freshness(ca.SX(ca.DM(axes))))
    assert ca.evalf(fresh_axes(ca.SX(fresh))).full().ravel().tolist() == list(axes)
    assert ca.evalf(fresh_axes(ca.SX(float(np.float32(float(fresh)))))).full().ravel().tolist() == list(axes)


def test_one_is_all_axes_and_zero_is_none() -> None:
    assert ca.evalf(fresh_axes(ca.SX(1.0))).full().ravel().tolist() == [1, 1, 1]
    assert ca.evalf(fresh_axes(ca.SX(0.0))).full().ravel().tolist() == [0, 0, 0]

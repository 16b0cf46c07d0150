"""Bins end at round numbers and hold everything between their ends."""

from __future__ import annotations

import numpy as np
import pytest

from gammastar.campaign.edges import ANGLES, STEPS, edges

ENDS = [
    (0.9003, 1.0998),
    (-179.9, 179.9),
    (0.1, 179.5),
    (178.02, 179.99),
    (-3e-9, 5e-7),
    (2e5, 7e8),
    (-7.0, -6.0),
    (0.9, 1.1),
]


@pytest.mark.parametrize("angle", [False, True])
@pytest.mark.parametrize("most", [2, 3, 10, 24, 1000])
@pytest.mark.parametrize("ends", ENDS)
def test_bins_hold_all_are_equal_and_no_more_than_asked_for(ends: tuple[float, float], most: int, angle: bool) -> None:
    found, reach = edges(*ends, most, angle), ends[1] - ends[0]
    assert found[0] <= ends[0] + 1e-9 * reach
    assert found[-1] >= ends[1] - 1e-9 * reach
    assert len(found) - 1 <= most
    widths = np.diff(found)
    np.testing.assert_allclose(widths, widths[0], rtol=1e-6)
    mantissa = widths[0] / 10.0 ** np.floor(np.log10(widths[0] * (1 + 1e-6)))
    assert np.isclose(mantissa, ANGLES if angle else STEPS, rtol=1e-6).any()


def test_no_more_are_empty_than_roundness_takes() -> None:
    """A width is at most the next one of STEPS beyond the narrowest, so that at least a third of what is asked for is there."""
    for ends in ENDS[:6]:
        assert len(edges(*ends, 24)) - 1 >= 24 / 3


def test_one_bin_ends_where_the_numbers_do() -> None:
    assert edges(0.3, 0.7, 1).tolist() == [0.3, 0.7]


def test_ends_are_the_numbers_that_people_write() -> None:
    assert edges(0.9, 1.1, 10).tolist() == [0.9, 0.92, 0.94, 0.96, 0.98, 1.0, 1.02, 1.04, 1.06, 1.08, 1.1]
    assert edges(-180, 180, 8, angle=True).tolist() == [-180, -135, -90, -45, 0, 45, 90, 135, 180]

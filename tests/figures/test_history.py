"""Figures over time of a flight whose path is replaced: every phase by its own path and reference, and a line in between."""

import numpy as np

from figures.kinds import KINDS
from gammastar.figures import history


def test_the_reference_is_that_of_each_phase() -> None:
    """A speed leaves the place on the closed path free; towards the end of the open one it is held, and reached."""
    record = KINDS["replaced"]()
    wanted, row = history.reference_jet(record), record.phases[1].row
    assert np.isnan(wanted[:row, 0]).all()
    assert np.allclose(wanted[:row, 1], 1)
    assert abs(wanted[row, 0] - record.tangential_state[row, 0]) < 1e-9
    assert np.allclose(wanted[-1, :2], record.tangential_state[-1, :2], atol=1e-4)  # decaying still


def test_every_panel_marks_when_the_path_was_replaced() -> None:
    record = KINDS["replaced"]()
    for draw in (history.draw_states, history.draw_margins, history.draw_rates):
        for axis in draw(record).axes:
            assert any(np.array_equal(line.get_xdata(), [6.0, 6.0]) for line in axis.lines)
    assert not any(np.ptp(line.get_xdata()) == 0 for line in history.draw_states(KINDS["open path"]()).axes[0].lines)

"""The figure of an autopilot: everything that it has is drawn."""

import numpy as np
import pytest
from matplotlib import pyplot

import gammastar as gs
from gammastar.figures.autopilot import draw_autopilot
from gammastar.flight.autopilot_rows import GIVEN_UP


@pytest.mark.parametrize("count", [4, 6, 8])
def test_every_rotor_is_drawn_and_looks_like_no_other(count: int) -> None:
    rotors = gs.Rotors.ring(count, 0.2, 1.1e-5, 1.6e-7, 1200.0, first_angle=20)
    vehicle = gs.Vehicle(mass=1.2, inertia=(0.012, 0.012, 0.022), rotors=rotors)
    record = gs.fly(gs.design(vehicle, gs.paths.circle()), gs.State((1.2, 0, 0)), speed=1.0, duration=0.2)
    figure = draw_autopilot(record)
    _, speeds, taken = figure.axes
    lines = [line for line in speeds.lines if line.get_label().isdigit()]
    assert [line.get_label() for line in lines] == [str(k + 1) for k in range(count)]
    assert record.autopilot is not None
    assert np.array_equal([line.get_ydata() for line in lines], record.autopilot.rotor_speeds.T)
    assert len({(line.get_color(), line.get_linestyle(), str(line._dash_pattern)) for line in lines}) == count
    assert [text.get_text() for text in taken.get_yticklabels()][::4] == ["none", "tilt"]
    assert len(taken.get_yticklabels()) == len(GIVEN_UP)
    pyplot.close(figure)

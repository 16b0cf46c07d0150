"""The closed form of section VI: against the design's table, against the package's oracle, and against its own derivatives."""

import numpy as np
import pytest

from gammastar import so3
from gammastar.claims.nominal import (
    GRAVITY,
    MASS,
    PRINTED_INVERTED,
    PRINTED_UPRIGHT,
    START,
    TRANSVERSE_INERTIA,
    chain,
    fly_nominal,
)
from gammastar.claims.objectives import paper_law
from gammastar.law import Speed
from gammastar.vehicle import State

TIMES = np.linspace(0.0, 8.0, 8001)  # [s]
TABLE = {  # design, section 5: pole -> min T/mg, max T/mg, rate rad/s, upright, then upside down; as printed there
    1.5: ("0.73", "1.16", "0.5", "0.11", "1.64", "28"),
    2.0: ("0.56", "1.27", "1.3", "0.19", "1.55", "20"),
    2.5: ("0.43", "1.40", "4.1", "0.30", "1.52", "13"),
    3.0: ("0.38", "1.56", "11", "0.49", "1.59", "8.2"),
    4.0: ("0.34", "1.98", "34", "0.82", "1.96", "7.5"),
}


@pytest.mark.parametrize("pole", TABLE)
def test_peaks_are_those_of_the_design(pole: float) -> None:
    """Thrust and rates round to the printed digits."""
    found = []
    for printed in (PRINTED_UPRIGHT, PRINTED_INVERTED):
        flight = fly_nominal(pole, so3.project(printed)[0], TIMES)
        found += [flight.thrust.min() / (MASS * GRAVITY), flight.thrust.max() / (MASS * GRAVITY), flight.rate.max()]
    for value, printed_value in zip(found, TABLE[pole], strict=True):
        digits = len(printed_value.partition(".")[2])
        assert abs(value - float(printed_value)) < 0.51 * 10**-digits


@pytest.mark.parametrize("printed", [PRINTED_UPRIGHT, PRINTED_INVERTED], ids=["upright", "inverted"])
def test_the_package_predicts_the_same_flight(printed: tuple[tuple[float, ...], ...]) -> None:
    attitude, _ = so3.project(printed)
    ours = fly_nominal(2.5, attitude, TIMES)
    theirs = paper_law().predict(State(position=START, attitude=attitude), Speed(1.0), TIMES)
    assert np.abs(ours.position - theirs.position).max() < 1e-9
    assert np.abs(ours.thrust - theirs.thrust).max() < 1e-9
    assert np.abs(ours.rate - theirs.tilt_rate).max() < 1e-7
    assert np.abs(ours.torque / TRANSVERSE_INERTIA - theirs.tilt_acceleration).max() < 1e-6


def test_a_chain_solves_its_equation() -> None:
    """A chain obeys y'''' + 4 p y''' + 6 p^2 y'' + 4 p^3 y' + p^4 y = 0, and each column is the derivative of the one before."""
    pole, step = 1.7, 1e-3
    times = np.arange(0, 3, step)
    values = chain(pole, [1.0, -2.0, 0.5, 3.0], times)
    terms = values @ [pole**4, 4 * pole**3, 6 * pole**2, 4 * pole, 1]
    assert np.abs(terms).max() < 1e-12 * np.abs(values).max() * pole**4 * 100
    central = (values[2:, :4] - values[:-2, :4]) / (2 * step)
    assert np.abs(central - values[1:-1, 1:]).max() < 1e-3  # second order in the step, constant 5th derivative / 6


def test_the_angle_is_the_integral_of_its_rate() -> None:
    """The position's angle advances by the speed along the path: arctan of the position against the trapezoidal rule."""
    flight = fly_nominal(2.0, so3.project(PRINTED_INVERTED)[0], TIMES)
    angle = np.unwrap(np.arctan2(flight.position[:, 1], flight.position[:, 0]))
    assert angle[-1] - angle[-1001] == pytest.approx(1.0, abs=1e-4)  # one second at 1 rad/s, late in the flight

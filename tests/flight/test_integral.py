"""Integral action in flight: what it promises under a steady force, on a straight path, where the vehicle holds, and on a bent one."""

from __future__ import annotations

import numpy as np
import pytest

import gammastar as gs
from gammastar.law import IntegralAction, Observer, Rejection

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3))
PUSHED = gs.Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), bias_acceleration=(0.0, 1.0, -0.5), bias_torque=(2e-3, -1e-3, 0))
POLES = -4.0
INTEGRAL = IntegralAction(0.8, POLES)


def late_distance(path: gs.Curve, start: gs.State, rejection: Rejection | None, speed: float) -> float:
    """Return the largest distance [m] to a path in the last of 20 seconds under a steady force and torque."""
    law = gs.design(VEHICLE, path, poles=POLES, rejection=rejection)
    record = gs.fly(law, start, speed=speed, duration=20.0, rate=100.0, step=5e-3, truth=PUSHED, feedback="middle")
    assert record.completed
    return float(record.distance[record.time > 19].max())


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_integral_action_takes_a_steady_error_to_zero_on_a_straight_path(speed: float) -> None:
    """Without it the error stays at some k_3 / k_1 = 6 / 16 m for 1 m/s^2; with it exp(-0.8 * 19) of that is left, 1e-7."""
    line, start = gs.paths.line((0, 0, 0), (1, 0, 0)), gs.State((0, 0, 0), (speed, 0, 0))
    assert late_distance(line, start, None, speed) > 0.3
    assert late_distance(line, start, INTEGRAL, speed) < 1e-5


def test_on_a_bent_path_integral_action_leaves_an_error_that_the_observer_does_not() -> None:
    """A steady force turns against a circle: the integral takes most of the error away, the observer all of it."""
    circle, start = gs.paths.circle(2.0), gs.State((2, 0, 0), (0, 0.8, 0))
    plain, integral, observer = (
        late_distance(circle, start, each, 0.4) for each in (None, INTEGRAL, Observer(20.0, 60.0))
    )
    assert plain > 0.1
    assert 1e-3 < integral < 0.02
    assert observer < 1e-6


def test_what_the_law_tells_of_the_integral_balances_the_force() -> None:
    """The integral ends at k_3 times the acceleration d, and at what the law, not knowing d, mispredicts for the interval's middle.

    The velocity there lacks d T/2 and the position d T^2/8.
    """
    law = gs.design(VEHICLE, gs.paths.line((0, 0, 0), (1, 0, 0)), poles=POLES, rejection=INTEGRAL)
    force = gs.Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), bias_acceleration=(0.0, 1.0, -0.5))
    start = gs.State((0, 0, 0), (0.5, 0, 0))
    record = gs.fly(law, start, speed=0.5, duration=20.0, rate=100.0, step=5e-3, truth=force)
    assert record.autopilot is not None
    k, T = law.gains["transverse"], 0.01
    wanted = (k[2] + k[1] * T / 2 + k[0] * T**2 / 8) * np.array([-1.0, 0.5])
    assert record.autopilot.unknown[-1][7:9] == pytest.approx(wanted, rel=1e-4)

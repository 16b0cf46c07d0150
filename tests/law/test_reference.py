"""References along the path: exact jets, and a stop that stops where it says."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.errors import InputError
from gammastar.law import Point, Ramp, Reference, Speed, Stop
from strategies import PATHS, numbers

CIRCLE, LINE = PATHS["circle"], PATHS["line"]
TURN = 2 * np.pi


def jets(reference: Reference, times: np.ndarray) -> np.ndarray:
    """Return (n, 5) jets at times."""
    return reference.jets(np.asarray(times, dtype=float), np.zeros((len(times), 4)))


def braked(start: float, speed: float, begin: float, duration: float) -> Callable[[Any], Any]:
    """Return the coordinate of a stop as one formula of time with clamps, as the integral of speed (1 - S(u))."""

    def coordinate(time: Any) -> Any:
        since = ca.fmax(time - begin, 0)
        u = ca.fmin(since / duration, 1)
        covered = duration * (7 * u**5 - 14 * u**6 + 10 * u**7 - 2.5 * u**8) + since - duration * u
        return start + speed * (time - covered)

    return coordinate


def differentiated(coordinate: Callable[[Any], Any]) -> ca.Function:
    """Return the jet by differentiating the coordinate again and again."""
    time = ca.SX.sym("time")
    derivatives = [ca.SX(coordinate(time))]
    for _ in range(4):
        derivatives.append(ca.jacobian(derivatives[-1], time))
    return ca.Function("jet", [time], [ca.vertcat(*(ca.densify(d) for d in derivatives))])


STOPS = {
    "forwards": (Stop(0.8, 2.0, 3.0, laps=1), CIRCLE, 0.3),
    "backwards": (Stop(-0.8, 2.0, 1.0), CIRCLE, 0.3),
    "on a line": (Stop(2.0, 30.0, 2.5), LINE, -4.0),
}


@pytest.mark.parametrize("name", STOPS)
@settings(max_examples=40)
@given(numbers(0, 25))
def test_a_jet_is_the_derivatives_of_the_coordinate(name: str, time: float) -> None:
    stop, path, start = STOPS[name]
    found = jets(stop.resolved(path, start), np.array([time]))[0]
    again = AGAIN[name](time).full().ravel()
    assert found == pytest.approx(again, abs=1e-10 * (1 + np.abs(again).max()))  # u^8 of a braking as short as 1 s


AGAIN = {
    name: differentiated(braked(start, stop.speed, stop.braking_start(path, start), stop.braking_time))
    for name, (stop, path, start) in STOPS.items()
}


@given(numbers(-3, 3), numbers(-5, 5), numbers(0, 20))
def test_a_speed_and_a_ramp_run_from_the_start(speed: float, start: float, time: float) -> None:
    for kind, holds in ((Speed, False), (Ramp, True)):
        reference = kind(speed).resolved(CIRCLE, start)
        assert jets(reference, np.array([time]))[0] == pytest.approx([start + speed * time, speed, 0, 0, 0], abs=1e-13)
        assert reference.holds_position is holds


@given(numbers(-20, 20), numbers(-20, 20))
def test_a_point_on_a_closed_path_is_reached_the_short_way(coordinate: float, start: float) -> None:
    target, *rest = jets(Point(coordinate).resolved(CIRCLE, start), np.array([3.0]))[0]
    assert abs(target - start) <= np.pi + 1e-12
    assert (target - coordinate) / TURN == pytest.approx(round((target - coordinate) / TURN), abs=1e-12)
    assert rest == [0, 0, 0, 0]
    assert jets(Point(coordinate).resolved(LINE, start), np.array([3.0]))[0, 0] == coordinate


speeds = st.one_of(numbers(0.1, 4), numbers(-4, -0.1))


@settings(max_examples=40)
@given(speeds, numbers(-20, 20), numbers(0.2, 8), st.integers(0, 3), numbers(-10, 10))
def test_a_stop_comes_to_rest_exactly_at_its_coordinate(
    speed: float, coordinate: float, braking: float, laps: int, start: float
) -> None:
    stop = Stop(speed, coordinate, braking, laps)
    begin = stop.braking_start(CIRCLE, start)
    lap = TURN / abs(speed)
    assert laps * lap * (1 - 1e-9) <= begin <= (laps + 1) * lap * (1 + 1e-9)
    reference = stop.resolved(CIRCLE, start)
    assert reference.holds_position
    rest = jets(reference, begin + braking + np.array([1e-9, 0.5, 100.0]))
    turns = (rest[:, 0] - coordinate) / TURN
    assert turns == pytest.approx(np.round(turns), abs=1e-11)
    assert np.array_equal(rest[:, 1:], np.zeros((3, 4)))
    flown = jets(reference, np.array([0.0, begin / 2]))
    assert flown[:, 1:] == pytest.approx(np.array([[speed, 0, 0, 0]] * 2), abs=0)
    assert flown[0, 0] == pytest.approx(start, abs=1e-14)
    assert abs(rest[0, 0] - start) == pytest.approx(abs(speed) * (begin + braking / 2), rel=1e-9)


@settings(max_examples=25)
@given(speeds, numbers(0.5, 8))
def test_a_stop_is_four_times_continuously_differentiable_at_its_joints(speed: float, braking: float) -> None:
    """Left and right limits of all five numbers agree; the next derivative is at most 840 speed / braking^4."""
    stop = Stop(speed, 1.0, braking)
    begin, reference = stop.braking_start(CIRCLE, 0.0), stop.resolved(CIRCLE, 0.0)
    gap = 1e-7 * braking
    for joint in (begin, begin + braking):
        before, after = jets(reference, joint + np.array([-gap, gap]))
        natural = abs(speed) * braking ** (1.0 - np.arange(5))
        assert np.all(np.abs(after - before) <= 1e3 * gap / braking * natural)


@settings(max_examples=25)
@given(speeds, numbers(0.5, 8))
def test_braking_never_turns_back(speed: float, braking: float) -> None:
    """The speed falls from its value to zero without changing sign, and covers half of speed times braking time."""
    stop = Stop(speed, 1.0, braking)
    begin = stop.braking_start(CIRCLE, 0.0)
    along = jets(stop.resolved(CIRCLE, 0.0), begin + braking * np.linspace(0, 1, 21))
    share = along[:, 1] / speed
    assert np.all(np.diff(share) <= 1e-12)
    assert share[0] == pytest.approx(1, abs=1e-12)
    assert share[10] == pytest.approx(0.5, abs=1e-12)  # S(1/2) = 1/2 by symmetry
    assert along[-1, 0] - along[0, 0] == pytest.approx(speed * braking / 2, rel=1e-12)


def test_a_stop_far_round_a_closed_path_is_found_at_once_and_exactly() -> None:
    """Whole turns are taken off together, not one after the other with the rounding of each."""
    coordinate = 1e7 * TURN + 1.0
    for speed in (1.0, -1.0):
        stop = Stop(speed, coordinate, 2.0)
        rest = jets(stop.resolved(CIRCLE, 0.0), np.array([50.0]))[0, 0]
        assert (rest - 1.0) / TURN == pytest.approx(round((rest - 1.0) / TURN), abs=1e-8)  # eps of 6e7


@pytest.mark.parametrize(("speed", "coordinate"), [(1.0, -1.0), (1.0, 0.5), (-1.0, 2.0), (-1.0, -0.9)])
def test_on_an_open_path_a_stop_lies_ahead_by_its_braking_distance(speed: float, coordinate: float) -> None:
    with pytest.raises(InputError, match="ahead by the braking distance 1 "):
        Stop(speed, coordinate, 2.0).resolved(LINE, 0.0)
    assert Stop(speed, 2 * speed, 2.0).braking_start(LINE, 0.0) == pytest.approx(1.0)


BAD = {
    "speed of NaN": lambda: Speed(np.nan),
    "speed of text": lambda: Speed("fast"),
    "ramp of infinity": lambda: Ramp(np.inf),
    "point nowhere": lambda: Point(np.nan),
    "stop without speed": lambda: Stop(0.0, 1.0, 1.0),
    "stop at once": lambda: Stop(1.0, 1.0, 0.0),
    "stop nowhere": lambda: Stop(1.0, np.inf, 1.0),
    "negative laps": lambda: Stop(1.0, 1.0, 1.0, laps=-1),
    "half a lap": lambda: Stop(1.0, 1.0, 1.0, laps=0.5),
    "laps of NaN": lambda: Stop(1.0, 1.0, 1.0, laps=np.nan),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_reference_is_refused(case: str) -> None:
    with pytest.raises(InputError):
        BAD[case]()

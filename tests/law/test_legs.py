"""Schedules of legs: smooth, exact at their stops, and tracked without leaving the path."""

from __future__ import annotations

import numpy as np
import pytest

import gammastar as gs

CIRCLE, LINE = gs.paths.circle(), gs.paths.line()
SCHEDULE = gs.Legs((gs.Leg(1.0, to=2.0, hold=2.0), gs.Leg(-0.5, to=0.5, hold=1.0), gs.Leg(0.8)), change_time=1.0)


def jets(legs: gs.Legs, path: gs.Curve, start: float, times: np.ndarray) -> np.ndarray:
    """Return (n, 5): the reference and its derivatives."""
    return legs.resolved(path, start).jets(np.asarray(times, dtype=float), np.zeros((len(times), 4)))


def test_a_schedule_stops_exactly_where_it_should_and_holds() -> None:
    times = np.linspace(0, 15, 1501)
    reference = jets(SCHEDULE, LINE, 0.0, times)
    holding = (times > 3.0) & (times < 5.0)  # 2 m at 1 m/s and 1 s of change
    np.testing.assert_allclose(reference[holding, 0], 2.0, atol=1e-14)
    np.testing.assert_allclose(reference[holding, 1:], 0.0, atol=1e-12)
    assert reference[(times > 6) & (times < 8), 1].max() < 0  # on the way back
    second = (times > 9.0) & (times < 10.0)  # 1.5 m at 0.5 m/s and 1 s of change, after the hold
    np.testing.assert_allclose(reference[second, 0], 0.5, atol=1e-14)
    assert reference[-1, 1] == pytest.approx(0.8)


@pytest.mark.parametrize("order", range(4))
def test_every_derivative_is_the_integral_of_the_next(order: int) -> None:
    """Trapezoids over fine steps: the error is of second order in the step."""
    times = np.linspace(0, 12, 48_001)
    reference = jets(SCHEDULE, LINE, 0.0, times)
    integral = np.concatenate([[0], np.cumsum((reference[1:, order + 1] + reference[:-1, order + 1]) / 2 * times[1])])
    np.testing.assert_allclose(reference[:, order] - reference[0, order], integral, atol=2e-6 * 10**order)


def test_a_leg_too_short_for_its_speed_is_flown_slower() -> None:
    reference = jets(gs.Legs((gs.Leg(5.0, to=0.3),), change_time=1.0), LINE, 0.0, np.linspace(0, 4, 401))
    assert reference[:, 1].max() == pytest.approx(0.3)
    assert reference[-1, 0] == pytest.approx(0.3, abs=1e-14)


def test_on_a_closed_path_a_leg_goes_on_in_its_direction() -> None:
    forward = jets(gs.Legs((gs.Leg(1.0, to=0.0),)), CIRCLE, 1.0, np.array([30.0]))[0, 0]
    backward = jets(gs.Legs((gs.Leg(-1.0, to=0.0, laps=1),)), CIRCLE, 1.0, np.array([30.0]))[0, 0]
    assert forward == pytest.approx(2 * np.pi)
    assert backward == pytest.approx(-2 * np.pi)


def test_the_path_is_never_left_for_a_schedule() -> None:
    """Started at rest on the path, the vehicle accelerates, stops, reverses and goes on within rounding of it."""
    law = gs.design(gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81), CIRCLE, poles=-3)
    flight = gs.fly(law, gs.State(position=(1, 0, 0)), reference=SCHEDULE, duration=13)
    assert flight.distance.max() < 1e-9
    at = np.searchsorted(flight.time, 4.0)
    assert flight.tangential_state[at, 0] == pytest.approx(2.0, abs=1e-9)
    assert flight.summary()["oracle"]["max_position_error_m"] < 1e-9


def test_what_is_no_schedule_is_refused() -> None:
    for wrong in (
        lambda: gs.Leg(0.0),
        lambda: gs.Leg(1.0, to=1.0, hold=-1.0),
        lambda: gs.Leg(1.0, to=1.0, laps=-1),
        lambda: gs.Legs(()),
        lambda: gs.Legs((gs.Leg(1.0), gs.Leg(1.0, to=2.0))),
        lambda: gs.Legs((gs.Leg(1.0),), change_time=0.0),
        lambda: gs.Legs((gs.Leg(1.0, to=-2.0),)).resolved(LINE, 0.0),
    ):
        with pytest.raises(gs.errors.InputError):
            wrong()


@pytest.mark.parametrize("reference", [SCHEDULE, gs.Stop(1.0, 2.0, 1.0)], ids=["legs", "stop"])
def test_at_the_very_instants_of_its_joints_a_reference_is_smooth_too(reference) -> None:
    """Where two clamps switch at one instant, no slope is counted twice: the jet there is the limit from both sides."""
    joints = np.array([0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 5.0, 6.0, 8.0, 9.0])
    exact, before = (jets(reference, LINE, 0.0, joints + shift) for shift in (0.0, -1e-9))
    np.testing.assert_allclose(exact[1:, :4], before[1:, :4], atol=1e-6)


def test_changes_that_follow_at_once_leave_no_empty_piece_between() -> None:
    """Only two neighbouring pieces reach a step of the graph: an empty one between them would hide the next."""
    at_once = gs.Legs((gs.Leg(1.0, to=1.0), gs.Leg(-1.0, to=0.0), gs.Leg(1.0, to=5.0)), change_time=1.0)
    pieces = at_once.resolved(LINE, 0.0).pieces
    assert np.diff(pieces.begins).min() > 0.5
    assert len(pieces.begins) == 8  # two changes a leg, cruising on the last one alone, then rest


def test_a_vehicle_at_its_goal_but_for_rounding_is_there() -> None:
    goal = 0.29874686716791987
    place = CIRCLE.start_parameter(np.array([np.cos(goal), np.sin(goal), 0.0]))
    for start in (goal, place, np.nextafter(goal, 1), np.nextafter(goal, 0)):
        end = jets(gs.Legs((gs.Leg(1.0, to=goal, hold=1.0),)), CIRCLE, start, np.array([60.0]))[0, 0]
        assert end == pytest.approx(goal, abs=1e-8)


def test_legs_come_as_any_list_of_legs() -> None:
    assert len(gs.Legs(gs.Leg(1.0, to=float(k)) for k in range(3)).legs) == 3
    for wrong in (None, 3, gs.Leg(1.0), "legs"):
        with pytest.raises(gs.errors.InputError):
            gs.Legs(wrong)


@pytest.mark.parametrize("reference", [gs.Legs((gs.Leg(1.0, to=2.0, laps=1),)), gs.Stop(1.0, 2.0, 1.0, laps=1)])
def test_laps_of_a_path_that_is_open_are_refused(reference) -> None:
    """They would have been left out without a word."""
    reference.resolved(CIRCLE, 0.0)
    with pytest.raises(gs.errors.InputError, match=r"laps of .* need a closed path \(got 1 on line, which is open\)"):
        reference.resolved(LINE, 0.0)

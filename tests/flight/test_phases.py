"""A path replaced in flight, and paths that end: nothing jumps, and the vehicle ends where it should."""

from __future__ import annotations

import numpy as np
import pytest

import gammastar as gs
from gammastar import engine
from gammastar.errors import InputError

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
POLES = (-3.4, -3.8, -4.2, -4.6)
ROUND = gs.waypoints([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1), (-2, 4, -2)], closed=True)
AWAY = gs.waypoints([(0, 0, -2), (4, 1, -3), (6, 5, -1.5), (2, 8, -1)])
SAMPLED = {"feedback": "middle", "rate": 400.0}


@pytest.mark.parametrize("how", [{}, SAMPLED], ids=["continuous", "sampled"])
def test_a_path_replaced_in_flight_is_followed_without_a_jump(how: dict) -> None:
    """Within one step no part of the state changes by more than its rate allows; the end of the new path is held."""
    law = gs.design(VEHICLE, ROUND, POLES)
    gs.fly(law, gs.State((0, 0, 0)), speed=1.0, duration=0.1, **how)
    gs.fly(law, gs.State((0, 0, 0)), reference=gs.Ramp(1.0), duration=0.1, **how)
    before = engine.compilations()
    record = gs.fly(law, gs.State((0, 0, 0)), speed=1.0, duration=30, replacements=[gs.Replacement(10.0, AWAY)], **how)
    assert engine.compilations() == before  # a path is data
    row = record.phases[1].row
    assert record.time[row] == pytest.approx(10.0)
    assert record.completed
    summary = record.summary()
    assert summary["settled"] is True
    assert summary["settling_time_s"]["predicted"] > 10
    step = record.time[1]
    for part in (slice(0, 3), slice(3, 6), slice(6, 15), slice(18, 19)):
        jumps = np.abs(np.diff(record.state[row - 1 : row + 2, part], axis=0)).max(axis=0)
        usual = np.abs(np.diff(record.state[row - 200 : row, part], axis=0)).max() + 40 * step**2
        assert jumps.max() <= 3 * usual
    assert record.position[-1] == pytest.approx([2, 8, -1], abs=1e-9)
    assert np.abs(record.velocity[-1]).max() < 1e-9
    assert record.distance[row] > 0.1  # from now on to the new path


def test_an_implicit_path_may_replace_a_curve_with_a_reference_of_its_own() -> None:
    law = gs.design(VEHICLE, gs.paths.circle(), POLES)
    new = gs.Replacement(6.0, gs.paths.circle(1.5, kind="implicit"), reference=gs.Point(1.0))
    record = gs.fly(law, gs.State((1.2, 0, 0)), speed=1.0, duration=20, replacements=[new])
    assert record.position[-1] == pytest.approx([1.5 * np.cos(1), 1.5 * np.sin(1), 0], abs=1e-6)
    assert record.summary()["settled"] is True
    assert "oracle" not in record.summary()


@pytest.mark.parametrize(
    "start", [(-5, -3, -2), (2, 14, 1), (0, 0, -2), (3, 3, -2)], ids=["before", "beyond", "on", "beside"]
)
def test_an_open_path_is_flown_to_its_end_and_held_there(start: tuple) -> None:
    """Also from before its first waypoint and from beyond its last one, where the curve runs on straight; as the closed form says."""
    record = gs.fly(gs.design(VEHICLE, AWAY, POLES), gs.State(start), speed=1.0, duration=30)
    assert record.position[-1] == pytest.approx([2, 8, -1], abs=1e-9)
    assert record.summary()["settled"] is True
    assert record.summary()["oracle"]["max_position_error_m"] < 1e-6


@pytest.mark.parametrize(("reference", "end"), [(gs.Speed(-1.0), 0), (gs.Ramp(1.0), 1), (gs.Legs((gs.Leg(0.7),)), 1)])
def test_every_endless_reference_ends_with_its_path(reference, end: int) -> None:
    record = gs.fly(gs.design(VEHICLE, AWAY, POLES), gs.State((4, 1, -3)), reference=reference, duration=35)
    assert record.tangential_state[-1, 0] == pytest.approx(AWAY.ends[end], abs=1e-8)
    assert record.tangential_state[-1, 1] == pytest.approx(0, abs=1e-8)
    beyond = record.tangential_state[:, 0] - AWAY.ends[end]
    assert (beyond * (1 if end else -1)).max() < 0.05


def test_a_formula_ends_where_it_says() -> None:
    curve = gs.Curve(lambda t: (t, 0.3 * t**2, 0 * t), ends=(0.0, 3.0))
    record = gs.fly(gs.design(VEHICLE, curve, POLES), gs.State((0, 0, 0)), speed=0.8, duration=20)
    assert record.position[-1] == pytest.approx([3, 2.7, 0], abs=1e-8)
    assert curve.domain == (0.0, 3.0)


def test_what_cannot_replace_is_refused() -> None:
    law, start = gs.design(VEHICLE, ROUND, POLES, approach=gs.Approach()), gs.State((0, 0, 0))
    implicit = gs.paths.circle(kind="implicit")
    for wrong in (
        [gs.Replacement(40.0, AWAY)],
        [gs.Replacement(4.0, AWAY), gs.Replacement(2.0, ROUND)],
        [gs.Replacement(2.0, implicit)],
        [AWAY],
    ):
        with pytest.raises(InputError):
            gs.fly(law, start, speed=1.0, duration=5, replacements=wrong)
    for wrong_one in (lambda: gs.Replacement(-1.0, AWAY), lambda: gs.Replacement(1.0, "circle")):
        with pytest.raises(InputError):
            wrong_one()
    for beyond in (gs.Point(99.0), gs.Stop(1.0, 99.0, 1.0), gs.Legs((gs.Leg(1.0, to=99.0),))):
        with pytest.raises(InputError, match="must lie on the path"):
            gs.fly(gs.design(VEHICLE, AWAY, POLES), start, reference=beyond, duration=1)


def test_stopping_at_an_end_is_gentle_at_any_speed() -> None:
    """40 m straight down at 6 m/s: braked within a second it would take more than gravity gives."""
    down = gs.waypoints([(0, 0, -1), (0, 0, -41)])
    for reference in (gs.Speed(6.0), gs.Ramp(6.0)):
        record = gs.fly(gs.design(VEHICLE, down, POLES), gs.State((0, 0, -1)), reference=reference, duration=30)
        assert record.position[-1] == pytest.approx([0, 0, -41], abs=1e-8)
        late = record.time > 4  # after the start
        assert record.free_fall_margin[late].min() > VEHICLE.gravity - 2.5


def test_beyond_its_end_a_vehicle_is_not_on_the_path() -> None:
    path = gs.waypoints([(3, 0, 0), (6, 0, 0), (9, 0, 0)])
    record = gs.fly(gs.design(VEHICLE, path, POLES), gs.State((59, 0, 0)), speed=1.0, duration=30)
    assert record.distance[0] == pytest.approx(50)
    summary = record.summary()
    assert summary["settled"] is True
    assert summary["settling_time_s"]["predicted"] > 3
    assert not gs.fly(gs.design(VEHICLE, path, POLES), gs.State((59, 0, 0)), speed=1.0, duration=2).summary()["settled"]


def test_a_flight_along_two_paths_has_no_single_closed_form() -> None:
    law = gs.design(VEHICLE, ROUND, POLES)
    record = gs.fly(law, gs.State((0, 0, 0)), speed=1.0, duration=1, replacements=[gs.Replacement(1e-9, AWAY)])
    assert record.phases[1].row == 1
    with pytest.raises(InputError, match="must follow one path"):
        _ = record.prediction
    for wrong in (None, gs.Replacement(0.5, AWAY)):
        with pytest.raises(InputError, match="must be a list"):
            gs.fly(law, gs.State((0, 0, 0)), speed=1.0, duration=1, replacements=wrong)
    with pytest.raises(InputError, match="reference must be one"):
        gs.fly(law, gs.State((0, 0, 0)), reference=gs.Speed, duration=1)

"""Speeds that vary along the path, or in time: smooth, within their points, and followed without leaving the path."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gammastar as gs
from gammastar.errors import InputError
from strategies import numbers

CIRCLE, LINE = gs.paths.circle(), gs.paths.line()
TRACK = gs.waypoints([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1)])
VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)


def speeds(profile: gs.Profile, path: gs.Curve, places: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Return the speed wanted at places (n,), or its derivative along the path."""
    return profile.resolved(path, 0.0).pieces.values(places, derivative)


@settings(max_examples=40)
@given(st.lists(st.tuples(numbers(0.1, 3), numbers(0.2, 4)), min_size=2, max_size=6), st.booleans())
def test_a_speed_over_progress_stays_between_its_points(steps: list[tuple[float, float]], back: bool) -> None:
    """It takes their values, never leaves the range of two neighbours, and its first three derivatives are continuous."""
    places, values = np.cumsum([step for step, _ in steps]), np.array([value for _, value in steps])
    sign = -1.0 if back else 1.0
    profile = gs.Profile(np.column_stack([places, sign * values]))
    assert speeds(profile, LINE, places) == pytest.approx(sign * values, rel=1e-9)
    for k in range(len(places) - 1):
        between = sign * speeds(profile, LINE, np.linspace(places[k], places[k + 1], 50))
        assert between.min() >= min(values[k : k + 2]) - 1e-9
        assert between.max() <= max(values[k : k + 2]) + 1e-9
    gap = 1e-6
    for derivative in range(3):
        sides = [speeds(profile, LINE, places + shift, derivative) for shift in (-gap, gap)]
        size = np.abs(np.diff(values)).max() / np.diff(places).min() ** (derivative + 1)
        np.testing.assert_allclose(sides[0], sides[1], atol=2e4 * gap * size + 1e-9)


@pytest.mark.parametrize("points", [((0, 1), (4, 0)), ((-4, 0), (0, -1))], ids=["forwards", "backwards"])
def test_a_speed_of_zero_is_a_place_of_rest(points: tuple) -> None:
    """Towards it the speed falls in proportion to the distance left, and beyond it it leads back."""
    profile = gs.Profile(points)
    rest, sign = (4.0, 1.0) if points[1][1] == 0 else (-4.0, -1.0)
    left = np.array([1e-2, 1e-4, -1e-2, -1.0])
    found = speeds(profile, LINE, rest - sign * left)
    assert found[:3] == pytest.approx(sign * 0.5 * left[:3], rel=1e-3)  # 2 speed / length
    assert found[3] * sign < 0


def test_on_a_closed_path_a_profile_comes_again() -> None:
    profile = gs.Profile(((1.0, 0.5), (3.0, 1.5)))
    places = np.linspace(0, 2 * np.pi, 40)
    np.testing.assert_allclose(
        speeds(profile, CIRCLE, places), speeds(profile, CIRCLE, places + 20 * np.pi), atol=1e-12
    )
    assert speeds(profile, CIRCLE, np.array([1.0 + 2 * np.pi]))[0] == pytest.approx(0.5)


def test_a_profile_over_time_covers_the_integral_of_its_speed() -> None:
    """From 1 to 3 in 2 s the mean is 2: S is symmetric about its middle."""
    reference = gs.Profile(((1.0, 1.0), (3.0, 3.0), (4.0, 0.0)), over="time").resolved(LINE, 0.5)
    jets = reference.jets(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 9.0]), np.zeros((6, 4)))
    assert jets[:, 1] == pytest.approx([1, 1, 2, 3, 0, 0], abs=1e-12)
    assert jets[[0, 1, 3, 4, 5], 0] == pytest.approx([0.5, 1.5, 5.5, 7.0, 7.0], abs=1e-12)


@pytest.mark.parametrize(
    ("path", "profile", "end"),
    [
        (CIRCLE, gs.Profile(((0, 0.6), (2, 1.5), (4, 0.8))), None),
        (TRACK, gs.Profile(((0, 0.8), (4, 1.5), (8, 0.5), (11, 0))), 11.0),
        (TRACK, gs.Profile(((0, 0.8), (4, 1.5), (8, 0)), over="time"), None),
    ],
    ids=["round a circle", "along a track to rest", "over time"],
)
def test_the_path_is_never_left_for_a_profile(path, profile: gs.Profile, end: float | None) -> None:
    """Started on the path at rest: within rounding of it all the way, and as the closed form says."""
    law = gs.design(VEHICLE, path, poles=(-3, -3.2, -3.4, -3.6))
    record = gs.fly(law, gs.State(path.points(np.array([0.0]))[0]), reference=profile, duration=25)
    assert record.completed
    assert record.distance.max() < 1e-8
    assert record.summary()["oracle"]["max_position_error_m"] < 1e-4  # along the path, of the steps that hold a joint
    if profile.over == "progress":
        settled = record.time > 8
        wanted = profile.resolved(path, 0.0).pieces.values(record.tangential_state[settled, 0])
        assert record.tangential_state[settled, 1] == pytest.approx(wanted, abs=1e-5)
    if end is not None:
        assert record.tangential_state[-1, 0] == pytest.approx(end, abs=5e-2)  # exponentially: exp(-1 / 3) a second


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: gs.Profile(()),
        lambda: gs.Profile(((0, 1, 2),)),
        lambda: gs.Profile("fast"),
        lambda: gs.Profile(((0, np.nan),)),
        lambda: gs.Profile(((1, 1), (0, 1))),
        lambda: gs.Profile(((0, 1), (0, 2))),
        lambda: gs.Profile(((0, 1), (1, -1))),
        lambda: gs.Profile(((0, 0), (1, 1))),
        lambda: gs.Profile(((0, 0),)),
        lambda: gs.Profile(((-1, 1), (1, 1)), over="time"),
        lambda: gs.Profile(((0, 1),), over="space"),
        lambda: gs.Profile(((0, 1), (1, 0))).resolved(CIRCLE, 0.0),
        lambda: gs.Profile(((0, 1), (7, 1))).resolved(CIRCLE, 0.0),
        lambda: gs.Profile(((0, 1), (5, 1))).resolved(TRACK, 0.0),
        lambda: gs.Profile(((0, 1), (500, 0))).resolved(TRACK, 0.0),
    ],
)
def test_what_is_no_profile_is_refused(wrong) -> None:
    with pytest.raises(InputError):
        wrong()


@pytest.mark.parametrize("points", [((0.5, 2), (2, 1)), ((0.5, -1), (2, -2))], ids=["forwards", "backwards"])
def test_joints_are_met_in_both_directions(points: tuple) -> None:
    """Within a step the pieces change where they meet, whichever way the path is flown: the error falls with the step."""
    law = gs.design(VEHICLE, gs.paths.circle(2.0), poles=(-3.4, -3.8, -4.2, -4.6))
    errors = []
    for step in (4e-3, 1e-3):
        record = gs.fly(law, gs.State((2.0, 0, 0)), reference=gs.Profile(points), duration=8, step=step)
        errors.append(record.summary()["oracle"]["max_position_error_m"])
    assert errors[1] < 1e-5
    assert errors[1] < errors[0] / 4


def test_a_profile_that_leaves_a_path_or_jumps_at_its_seam_is_refused() -> None:
    for profile in (((0, 0), (2, 3)), ((0, 5), (9, 0)), ((0, -2), (2, 0))):
        with pytest.raises(InputError, match="come to rest between"):
            gs.Profile(profile, over="time").resolved(TRACK, 1.0)
    assert gs.Profile(((0, 0), (2, 1), (4, 0)), over="time").resolved(TRACK, 1.0).holds_position
    with pytest.raises(InputError, match="leave some of its period"):
        gs.Profile(((0, 1), (6.2831, 2))).resolved(CIRCLE, 0.0)
    for text in (((0, True),), (("0", "1"),)):
        with pytest.raises(InputError, match="must be a number"):
            gs.Profile(text)

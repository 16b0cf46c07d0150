"""A speed that the vehicle can fly everywhere."""

import dataclasses

import numpy as np
import pytest

from gammastar import (
    Curve,
    Limits,
    Observer,
    Speed,
    State,
    Vehicle,
    by_length,
    certify,
    design,
    errors,
    feasible_profile,
    fly,
    paths,
    vehicles,
)
from gammastar.certificate.feasible import _Search

HUMMINGBIRD = vehicles.load("hummingbird")
COEFFICIENT = float(np.sum(np.asarray(HUMMINGBIRD.rotors.thrust_coefficient)))
WEAK = dataclasses.replace(
    HUMMINGBIRD,
    forces=(),
    rotors=dataclasses.replace(HUMMINGBIRD.rotors, fastest=float(np.sqrt(2 * HUMMINGBIRD.weight / COEFFICIENT))),
)  # thrust-to-weight 2
OVAL = by_length(paths.ellipse((6.0, 2.0)))


def test_what_can_be_flown_everywhere_is_flown_everywhere() -> None:
    assert feasible_profile(WEAK, OVAL, 1.5).points == ((0.0, 1.5),)


def test_the_speed_drops_where_the_rotors_need_it_and_comes_back() -> None:
    """Slower in the bends than the constant speed that all places allow would have it, as fast as wanted on the straights."""
    points = np.array(feasible_profile(WEAK, OVAL, 5.0).points)
    everywhere = certify(WEAK, OVAL, 5.0).allowed_speeds[0][1]
    assert 0.9 * everywhere < points[:, 1].min() < everywhere
    assert points[:, 1].max() == 5.0


def test_the_motion_along_the_profile_keeps_to_the_limits_and_to_mechanics() -> None:
    """Its derivatives are those of the position in time, and between the places that were looked at it keeps to the reserve too."""
    profile = feasible_profile(WEAK, OVAL, 5.0)
    search = _Search(WEAK, OVAL, Limits(), 1.0)
    motion = search.motion(np.array(profile.points))
    assert search.usage(motion).max() <= 0.9 + 1e-12
    speed = np.linalg.norm(motion[:, 1], axis=1)
    time = np.concatenate([[0], np.cumsum(np.diff(search.places) / ((speed[1:] + speed[:-1]) / 2))])
    for order, share in (
        (1, 0.01),
        (2, 0.02),
        (3, 0.2),
    ):  # of the largest: differences blur the sharpest changes of the snap
        slope = np.gradient(motion[:, order], time, axis=0)[2:-2]
        assert slope == pytest.approx(motion[2:-2, order + 1], abs=share * np.abs(motion[:, order + 1]).max())


def test_the_path_is_kept_while_the_speed_drops() -> None:
    """A speed that the rotors cannot fly on one stretch: as a profile it costs speed there, as it is centimetres and speed everywhere."""
    law = design(WEAK, OVAL, -6, rejection=Observer())
    start = State(OVAL.points(np.zeros(1))[0] + [0, 0.3, -0.2])
    record = fly(law, start, reference=feasible_profile(WEAK, OVAL, 5.0), duration=14.0)
    late = record.time > 5
    assert record.distance[late].max() < 1e-3
    assert not record.autopilot.given_up[late].any()
    speed = np.linalg.norm(record.velocity[late], axis=1)
    assert speed.min() < 3.0
    assert speed.max() > 4.99
    wished = fly(law, start, reference=Speed(5.0), duration=14.0)
    assert 1e-2 < wished.distance[late].max() < 1.0
    assert np.linalg.norm(wished.velocity[late], axis=1).mean() < speed.mean()


def test_a_wish_may_be_of_any_size() -> None:
    fast, any_speed = (np.array(feasible_profile(WEAK, OVAL, each).points)[:, 1] for each in (1e3, 1e30))
    assert any_speed.max() == pytest.approx(fast.max(), rel=0.03)
    assert any_speed.max() < 20


def test_a_path_that_ends_ends_at_rest_and_backwards_is_the_mirror() -> None:
    line = Curve(lambda u: (u, 0.3 * u**2, -1.0), ends=(-2.0, 2.0))
    points = np.array(feasible_profile(WEAK, line, 3.0).points)
    assert points[-1] == pytest.approx([2.0, 0.0])
    assert np.all(points[:-1, 1] > 0)
    forwards, backwards = (np.array(feasible_profile(WEAK, OVAL, each).points) for each in (5.0, -5.0))
    assert backwards[:, 1] == pytest.approx(-forwards[:, 1])


def test_limits_beside_the_rotors_count() -> None:
    vehicle = Vehicle(0.5, (3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
    points = np.array(feasible_profile(vehicle, OVAL, 5.0, Limits(thrust=8.0)).points)
    assert points[:, 1].min() < 3.5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((WEAK, OVAL, 0.0), "speed other than zero"),
        ((WEAK, OVAL, 5.0, None, 1.0), "reserve below one"),
        ((WEAK, OVAL, float("nan")), "must be finite"),
        ((WEAK, OVAL, 5.0, Limits(thrust=1.0)), "no profile of the speed"),
        (("hummingbird", OVAL, 5.0), "must be a Vehicle"),
    ],
)
def test_what_has_no_profile_is_refused(arguments: tuple[object, ...], words: str) -> None:
    with pytest.raises(errors.GammastarError, match=words):
        feasible_profile(*arguments)

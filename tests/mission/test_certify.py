"""The certificate of a mission: its vehicle, path and limits, at the speed that its reference asks for."""

import inspect
from typing import Any

import pytest

from gammastar.certificate import Limits, certify
from gammastar.errors import InputError, MissionError
from gammastar.mission import Mission, load, parse

QUICK: dict[str, Any] = {
    "vehicle": {"mass": 0.5, "inertia": [0.004, 0.004, 0.007]},
    "path": {"name": "loop", "radius": 2},
    "reference": {"kind": "speed", "speed": 1},
    "start": {"position": [0, 0.2, 1.5]},
}


@pytest.mark.parametrize(
    ("reference", "speed"),
    [
        ({"kind": "speed", "speed": -3}, -3),
        ({"kind": "ramp", "speed": 1.5}, 1.5),
        ({"kind": "stop", "speed": 2, "coordinate": 1, "braking_time": 1}, 2),
        ({"kind": "legs", "legs": [{"speed": 1, "to": 2}, {"speed": -2, "to": 1}, {"speed": 1.5}]}, -2),
        ({"kind": "point", "coordinate": 1}, 0),
    ],
)
def test_the_speed_is_the_largest_that_the_reference_asks_for(reference: dict[str, Any], speed: float) -> None:
    assert Mission.from_values(QUICK | {"reference": reference}).certify().speed == speed


def test_the_certificate_is_that_of_the_parts() -> None:
    mission = Mission.from_values(QUICK | {"limits": {"thrust": 12, "tilt_rate": 9.0}})
    law = mission.law()
    expected = certify(law.vehicle, law.path, 1.0, limits=Limits(thrust=12, tilt_rate=9.0))
    assert mission.certify().as_dict() == expected.as_dict()


def test_a_loop_at_the_speed_of_free_fall_is_not_flyable() -> None:
    """At sqrt(g / r) rad/s the thrust vanishes at the top."""
    found = load("loop").with_values({"reference.speed": 2.2143}).certify()
    assert not found.flyable
    assert load("loop").certify().flyable


def test_limits_take_the_arguments_of_their_class() -> None:
    for name in inspect.signature(Limits).parameters:
        limited = Mission.from_values(QUICK | {"limits": {name: 5}})
        assert limited.values()["limits"] == {name: 5}
        assert parse(limited.toml()) == limited
        with pytest.raises(InputError, match=rf"\[limits\] limit of {name.replace('_', ' ')} must be greater than 0"):
            limited.with_values({f"limits.{name}": -5})


def test_limits_left_out_and_empty_are_the_same() -> None:
    without, empty = Mission.from_values(QUICK), Mission.from_values(QUICK | {"limits": {}})
    assert without == empty
    assert "limits" not in without.toml()


def test_unknown_limits_are_refused() -> None:
    with pytest.raises(MissionError, match=r'unknown key "tilt" in \[limits\]; did you mean "tilt_rate"'):
        Mission.from_values(QUICK | {"limits": {"tilt": 5}})

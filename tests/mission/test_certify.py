"""The certificate of a mission: its vehicle, path and limits, at the speed that its reference asks for."""

import inspect
from typing import Any

import pytest

from gammastar.certificate import Limits, certify
from gammastar.errors import InputError, MissionError, UnknownNameError
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


@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_a_certificate_names_points_in_the_frame_of_its_mission(frame: str) -> None:
    """Of a loop about (3, 4, 10) that falls at its top, 2 m above the centre: z is -1 times the height in `ned`, the height in `enu`."""
    found = Mission.from_values(
        QUICK
        | {"frame": frame, "path": {"name": "loop", "radius": 2, "center": [3, 4, 10]}}
        | {"reference": {"kind": "speed", "speed": 2.2143}, "start": {"position": [3, 4.2, 8.5]}}
    ).certify()
    top = [3, 4, 12] if frame == "enu" else [3, 4, 8]
    assert found.check("specific thrust").place.point == pytest.approx(top, abs=1e-6)
    assert f"point 3, 4, {top[2]} m" in found.reasons[0]
    data = found.as_dict()
    row = next(row for row in data["checks"] if row["name"] == "specific thrust")
    assert row["place"]["point_m"] == pytest.approx(top, abs=1e-6)
    middle = [sum(end["point_m"][2] for end in stretch) / 2 for stretch in data["free_fall_stretches"]]
    assert middle == pytest.approx([top[2]], abs=0.1)


def test_an_unknown_frame_is_refused() -> None:
    mission = Mission.from_values(QUICK)
    with pytest.raises(UnknownNameError, match="frame must be one of enu, ned"):
        certify(mission.law().vehicle, mission.law().path, frame="nwu")


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


def test_a_feasible_profile_is_feasible_on_its_own_path_alone() -> None:
    """A replacement that takes it over is flown as fast as it is anywhere, so that is what its certificate is for."""
    slow_in_bends = {"kind": "feasible", "speed": 6.0}
    found = Mission.from_values(
        {
            "vehicle": {"preset": "crazyflie"},
            "path": {"name": "ellipse", "progress": "metres"},
            "reference": slow_in_bends,
            "start": {"position": [1.0, 0, 0]},
            "replacements": [{"time": 1.0, "path": {"name": "circle", "radius": 1.2, "progress": "metres"}}],
        }
    ).certificates()
    assert found["path"].flyable
    assert found["replacements.0.path"].speed > 1.2 * found["path"].speed

"""Complaints: values as TOML writes them, one section, one sentence."""

import datetime
from typing import Any

import pytest

from gammastar.errors import GammastarError, InputError
from gammastar.mission import Mission, load
from gammastar.mission.complaint import LONGEST_SHOWN, shown, within

ANY: dict[str, Any] = load("upright").values()


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (True, "true"),
        ([True, False], "[true, false]"),
        ("it's", '"it\'s"'),
        ('a "b"', '"a \\"b\\""'),
        ("é", '"é"'),
        ("a\nb\0", '"a\\nb\\u0000"'),
        (["a", 1, 2.5], '["a", 1, 2.5]'),
        ({"a": [1], "b": {"c": False}}, "{a = [1], b = {c = false}}"),
        (float("inf"), "inf"),
        (datetime.date(1979, 5, 27), "1979-05-27"),
        pytest.param(-(10**5000), "a whole number of more than 60 digits", id="endless"),
        (None, "a NoneType"),
        (1j, "a complex"),
    ],
)
def test_a_value_is_shown_as_toml_writes_it(value: Any, expected: str) -> None:
    assert shown(value) == expected


def test_a_long_value_is_cut() -> None:
    for value in ("x" * 10**6, list(range(10**6)), {str(k): k for k in range(10**5)}):
        assert shown(value).endswith("...")
        assert len(shown(value)) == LONGEST_SHOWN + 3


def test_a_section_is_named_once() -> None:
    with (
        pytest.raises(InputError, match=r"^\[vehicle\] mass must be positive$"),
        within("[start]"),
        within("[vehicle]"),
    ):
        raise InputError("mass must be positive")
    with pytest.raises(InputError, match=r"^mine.toml: \[vehicle\] wrong$"), within("mine.toml:"), within("[vehicle]"):
        raise InputError("wrong")


HUMMINGBIRD: dict[str, Any] = {"vehicle": {"preset": "hummingbird"}}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "vehicle": ({"vehicle.mass": -1}, r"^\[vehicle\] mass"),
    "path": ({"path.normal": [0, 0, 0]}, r"^\[path\] normal"),
    "start": ({"start.attitude": [[1, 0, 0]] * 3}, r"^\[start\] "),
    "poles": ({"controller.poles": 1}, r"^\[controller\] "),
    "reference": ({"reference": {"kind": "stop", "speed": 0, "coordinate": 1, "braking_time": 1}}, r"^\[reference\] "),
    "truth": ({"truth.inertia_scale": -1}, r"^\[truth\] "),
    "uneven truth": ({"truth.inertia_scale": [[1, 2], 3]}, r"^\[truth\] inertia_scale must be numbers of shape"),
    "scales of other rotors": (
        HUMMINGBIRD | {"truth.thrust_scale": [1, 1, 1]},
        r"^\[truth\] thrust_scale must have shape",
    ),
    "uneven scales": (
        HUMMINGBIRD | {"truth.thrust_scale": [[1, 2], 3]},
        r"^\[truth\] thrust_scale must be numbers of shape",
    ),
    "uneven inertia": ({"vehicle.inertia": [[1, 2], 3]}, r"^\[vehicle\] inertia .* rows of different lengths"),
    "limits": ({"limits.torque": -1}, r"^\[limits\] "),
    "rows": ({"flight.duration": 1e12}, r"^\[flight\] a flight must have at most \d+ rows \(got 1e\+15"),
    "more rows": ({"flight.duration": 1e308}, r"^\[flight\] a flight must have at most"),
    "no step": ({"flight.step": 5e-324}, r"^\[flight\] a flight must have at most"),
    "no rate": ({"controller.feedback": "middle", "controller.rate": 1e-308}, r"^\[controller\] a control interval"),
    "no thrust": ({"start.thrust": 1e-308}, "^the law must have a finite input at the start"),
    "far too fast": ({"start.velocity": [1e308, 0, 0]}, "^the law must have a finite input at the start"),
    "nose along a surface": ({"heading": {"kind": "along"}}, "^a nose along the path needs a curve"),
    "endless mass": ({"vehicle.mass": 10**400}, r"^\[vehicle\] mass must be a number \(got one beyond the range"),
    "endless laps": ({"reference.laps": 10**400, "reference.kind": "stop"}, r"\[reference\] (laps|must have)"),
    "endless seed": ({"flight.seed": 10**5000}, r"^\[flight\] seed must be at most 9223372036854775807"),
    "deep": ({"path." + ".".join("a" * 3000): 1}, "^a mission must be nested at most 20 deep"),
    "flag for a name": ({"frame": True}, r"^frame must be one of enu, ned \(got true\)"),
    "long name": ({"frame": "x" * 10**5}, "^frame must be one of enu, ned .{1,100}$"),
    "strange key": ({"a\nb": 1}, r'^unknown key "a\\nb"'),
    "two lines": ({"title": "a\nb"}, r'^title must be one printable line .*\(got "a\\nb"\)'),
    "no character": ({"title": "a\0"}, "^title must be one printable line"),
    "half a character": ({"title": "\ud800"}, r"^title must be one printable line .*ud800"),
    "escape": ({"title": "\x1b[31m"}, "^title must be one printable line"),
    "long title": ({"title": "x" * 201}, "^title must be one printable line of at most 200 characters"),
    "number for a title": ({"title": 3}, r"^title must be text \(got 3\)"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_flown_is_no_mission(case: str) -> None:
    """Refused when it is read, not when it is flown; in one sentence that names its section once."""
    changes, message = REFUSED[case]
    with pytest.raises(GammastarError, match=message) as caught:
        Mission.from_values(ANY).with_values(changes)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_title_of_200_characters_is_kept() -> None:
    title = "é — " + "x" * 196
    assert load("upright").with_values({"title": title}).title == title

"""What is no path is refused, when it is made or by its certificate, in one sentence that names the place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar.certificate import certify
from gammastar.errors import InputError
from gammastar.path import Curve
from gammastar.path.formula import curve_from_formula, implicit_from_formula
from gammastar.path.table import read_points

VEHICLE = gs.Vehicle(mass=0.5, inertia=(4e-3, 4e-3, 7e-3))
TURN = 2 * np.pi

REFUSED_WHEN_MADE: dict[str, tuple[Callable[[], Any], str]] = {
    "a cusp": (lambda: Curve(lambda s: (s**2, s**3, 0)), "zero speed at parameter 0, point [0.0, 0.0, 0.0]"),
    "a corner": (
        lambda: Curve(lambda s: (s, ca.fabs(s - 2), 0)),
        "a corner at parameter 2 (16.97 m along, point 2, 0, 0 m)",
    ),
    "a corner where a closed curve comes back": (
        lambda: Curve(lambda s: (ca.sin(s / 2), ca.sin(s), 0), period=TURN),
        "a corner at parameter 0 (0 m along, point 0, 0, 0 m)",
    ),
    "a gap": (lambda: Curve(lambda s: (s, ca.if_else(s > 1, 1, 0), 0)), "a gap at parameter 1 "),
    "a jump of the fifth derivative": (
        lambda: Curve(lambda s: (s, ca.fmax(s - 1, 0) ** 5, 0)),
        "a jump of the fifth derivative at parameter 1 ",
    ),
    "an open curve with a period": (
        lambda: Curve(lambda s: (ca.cos(s), ca.sin(s), s / 10), period=TURN),
        "a gap of 0.628 m",
    ),
    "no length": (lambda: Curve(lambda s: (1 + 0 * s, 2, 3)), "zero speed at parameter -10, point [1.0, 2.0, 3.0]"),
    "a circle without size": (lambda: gs.paths.circle(radius=0.0), "radius [m] must be greater than 0 (got 0)"),
    "two equal neighbouring waypoints": (
        lambda: gs.waypoints([(0, 0, 0), (1, 0, 0), (1, 0, 0), (2, 1, 0)]),
        "waypoints[1] and waypoints[2]",
    ),
    "one waypoint": (lambda: gs.waypoints([(0, 0, 0)]), "at least 2"),
    "waypoints that turn back on the spot": (
        lambda: gs.waypoints([(0, 0, 0), (1, 0, 0), (0, 0, 0)]),
        "zero speed between waypoints",
    ),
    "NaN among waypoints": (lambda: gs.waypoints([(0, 0, 0), (1, np.nan, 0)]), "waypoints[1]"),
    "an unknown name": (
        lambda: curve_from_formula("lambda", "r*sin(lambda)", "0"),
        "the name at column 1 of y of formula",
    ),
    "an unknown function": (
        lambda: curve_from_formula("lambda", "sinus(lambda)", "0"),
        "the function at column 1 of y of formula",
    ),
    "an attribute": (lambda: curve_from_formula("lambda", "2*lambda.real", "0"), "(got 'lambda.real' at column 3)"),
    "a call of Python": (lambda: curve_from_formula("lambda", "__import__('os')", "0"), "at column 1 of y of formula"),
    "a text in a formula": (lambda: curve_from_formula("lambda", "1 + 'a'", "0"), "at column 5"),
}

REFUSED_BY_THE_CERTIFICATE: dict[str, tuple[Callable[[], Curve], str]] = {
    "a self-crossing": (
        lambda: Curve(lambda s: (2 * ca.sin(s), ca.sin(2 * s), 0), period=TURN),
        "between parameter 0 (0 m along, point 0, 0, 0 m) and parameter 3.14159 (6.097 m along, point 0, 0, 0 m)",
    ),
    "a closed curve that touches itself": (
        lambda: Curve(lambda s: (2 * ca.cos(s), ca.sin(s) * ca.cos(s) ** 2, 0), period=TURN),
        "a path that touches itself: ",
    ),
    "an open curve that meets itself at its ends": (
        lambda: Curve(lambda s: (ca.cos(s), ca.sin(s), 0), domain=(0, TURN)),
        "a path that meets itself at its ends: ",
    ),
    "a curve that runs over itself": (
        lambda: Curve(lambda s: (ca.cos(2 * s), ca.sin(2 * s), 0), period=TURN),
        "a path that runs over itself: ",
    ),
}

FILES = {
    "NaN": ("0,0,0\n1,nan,0\n2,1,0\n", "y in line 2 of"),
    "text": ("x,y,z\n0,0,0\n1,one,0\n", "y in line 3 of"),
    "an empty cell": ("0,0,0\n1,,0\n", "y in line 2 of"),
    "two columns": ("0,0\n1,0\n", "line 1 of"),
    "one point": ("0,0,0\n", "at least two points"),
    "the same point twice": ("0,0,0\n1,0,0\n1,0,0\n", "in line 2 and again in line 3"),
}


@pytest.mark.parametrize("case", REFUSED_WHEN_MADE)
def test_it_is_refused_when_it_is_made(case: str) -> None:
    make, place = REFUSED_WHEN_MADE[case]
    with pytest.raises(InputError) as caught:
        make()
    assert place in str(caught.value)


@pytest.mark.parametrize("case", REFUSED_BY_THE_CERTIFICATE)
def test_it_is_refused_by_the_certificate(case: str) -> None:
    make, place = REFUSED_BY_THE_CERTIFICATE[case]
    found = certify(VEHICLE, make(), speed=0.5)
    assert not found.flyable
    assert any(place in reason for reason in found.reasons), found.reasons


@pytest.mark.parametrize("case", FILES)
def test_a_file_is_refused_with_the_line(case: str, tmp_path: Path) -> None:
    text, place = FILES[case]
    file = tmp_path / "points.csv"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_points(file)
    assert place in str(caught.value)


def test_two_waypoints_make_a_straight_line_and_three_a_smooth_curve() -> None:
    line = gs.waypoints([(0, 0, -1), (4, 3, -1)])
    assert line.length() == pytest.approx(5, rel=1e-14)
    assert certify(VEHICLE, line, speed=0.5).check("curvature").value == pytest.approx(0, abs=1e-12)
    curve = certify(VEHICLE, gs.waypoints([(0, 0, -1), (4, 3, -1), (8, 0, -1)]), speed=0.5)
    assert curve.flyable
    assert curve.check("smooth").note == "five continuous derivatives"


def test_a_parabola_at_its_ballistic_speed_is_refused_with_the_stretch_and_the_speed_that_would_do() -> None:
    """On z = g x^2 / (2 v^2), flown at v in x, gravity alone does all the work, everywhere."""
    speed = 3.0
    gravity = VEHICLE.gravity
    path = Curve(lambda s: (s, 0, gravity * s**2 / (2 * speed**2)), domain=(-1, 1), name="parabola")
    found = certify(VEHICLE, path, speed)
    (reason,) = found.reasons
    assert "got free fall at" in reason
    assert "from parameter -1 to 1 (0 to 2.345 m)" in reason
    assert "fly at most 2.924 parameter/s" in reason
    assert certify(VEHICLE, path, 2.924).flyable


FAR_TOO_LARGE: dict[str, Callable[[], Any]] = {
    "an implicit circle": lambda: gs.paths.circle(radius=1e308, kind="implicit"),
    "its quadratic kind": lambda: gs.paths.circle(radius=1e300, kind="implicit", coordinates="quadratic"),
    "a circle": lambda: gs.paths.circle(radius=1e308),
    "a circle far off": lambda: gs.paths.circle(center=(0, 1e308, 0)),
    "a helix": lambda: gs.paths.helix(pitch=1e308),
    "next to nothing": lambda: gs.paths.circle(radius=1e-308),
    "a period": lambda: implicit_from_formula("sqrt(x**2 + y**2) - 1", "z", "atan2(y, x)", (1, 0, 0), period=1e308),
    "a domain": lambda: implicit_from_formula("y", "z", "x", (0, 0, 0), domain=(0, 1e308)),
    "a start": lambda: gs.State((1e308, 0, 0)),
    "a mass": lambda: gs.Vehicle(mass=1e300, inertia=(1, 1, 1)),
    "next to no mass": lambda: gs.Vehicle(mass=1e-300, inertia=(1, 1, 1)),
    "an inertia": lambda: gs.Vehicle(mass=1, inertia=(1e300, 1e300, 1e300)),
    "next to no inertia": lambda: gs.Vehicle(mass=1, inertia=(1e-300, 1e-300, 1e-300)),
}


@pytest.mark.parametrize("name", FAR_TOO_LARGE)
def test_numbers_that_no_computation_stands_are_refused_in_one_sentence(name: str) -> None:
    with pytest.raises(InputError, match=r"must be between .* check its unit") as caught:
        FAR_TOO_LARGE[name]()
    assert len(str(caught.value)) <= 200


@pytest.mark.parametrize("place", ["parameter", "constants"])
def test_a_name_of_any_length_is_refused_in_a_short_sentence(place: str) -> None:
    long = "x" * 3000
    with pytest.raises(InputError, match="at most 40 letters") as caught:
        curve_from_formula("1", "2", "3", **{place: long if place == "parameter" else {long: 1}})
    assert len(str(caught.value)) <= 200

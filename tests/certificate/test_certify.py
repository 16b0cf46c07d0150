"""The certificate as a whole: closed forms with places, refusals that say what to do, plain data, and its cost."""

import json
import time

import casadi as ca
import numpy as np
import pytest

from certificate.curves import (
    QUAD,
    SATELLITE,
    TURN,
    closed,
    figure_eight,
    loop,
    opened,
    pinched,
    placed,
    ring,
    trefoil,
    uneven,
)
from gammastar import so3
from gammastar.certificate import Certificate, Limits, Verdict, certify
from gammastar.errors import InputError, UnknownNameError
from gammastar.path import catalogue as paths

G = QUAD.gravity


@pytest.mark.parametrize("kind", ["curve", "implicit"])
def test_a_circle_is_certified_in_closed_form(kind: str) -> None:
    radius, speed = 2.0, 1.5
    found = certify(QUAD, paths.circle(radius, (1, 2, 3), kind=kind), speed)
    assert found.flyable
    assert found.reasons == ()
    assert found.length == pytest.approx(TURN * radius, rel=1e-13)
    values = {name: found.check(name).value for name in ("curvature", "tube radius", "self-distance", "regular")}
    assert values == pytest.approx({"curvature": 0.5, "tube radius": 2, "self-distance": 4, "regular": 1}, rel=1e-12)
    thrust = np.hypot(G, speed**2 * radius)
    assert found.check("specific thrust").value == pytest.approx(thrust, rel=1e-12)
    assert found.check("most thrust").value == pytest.approx(QUAD.mass * thrust, rel=1e-12)
    assert found.check("tilt rate").value == pytest.approx(speed * speed**2 * radius / thrust, rel=1e-10)
    assert found.largest_speed == np.inf
    assert found.in_metres(speed) == pytest.approx((3, 3))


@pytest.mark.parametrize(("a", "b"), [(2.0, 1.0), (1.1, 1.0), (50.0, 1.0)])
def test_an_ellipse_bends_most_at_its_ends(a: float, b: float) -> None:
    """Largest curvature a/b^2 at (a, 0); the tube radius min(b^2/a, b) is its inverse."""
    found = certify(QUAD, paths.ellipse((a, b)), 0.5)
    bend, tube = found.check("curvature"), found.check("tube radius")
    assert bend.value == pytest.approx(a / b**2, rel=1e-12)
    assert bend.place.point == pytest.approx((a, 0, 0), abs=1e-6)
    assert tube.value == pytest.approx(min(b**2 / a, b), rel=1e-12)


def test_a_helix_and_its_tube() -> None:
    """Curvature r / (r^2 + h^2) with h = pitch / 2 pi; where turns are close, half their distance is the tube."""
    wide, tight = certify(QUAD, paths.helix(1.0, 5.0), 1.0), certify(QUAD, paths.helix(1.0, 0.5), 1.0)
    assert wide.check("curvature").value == pytest.approx(1 / (1 + (5 / TURN) ** 2), rel=1e-12)
    assert wide.check("tube radius").note == "least radius of curvature"
    distance = tight.check("self-distance").value
    assert distance == pytest.approx(0.5, rel=1e-2)
    assert tight.check("tube radius").value == pytest.approx(distance / 2)
    assert tight.check("tube radius").second_place is not None


def test_half_the_distance_to_itself_is_the_tube_of_a_trefoil() -> None:
    found = certify(QUAD, closed(trefoil), 0.5)
    tube = found.check("tube radius")
    assert tube.value == pytest.approx(found.check("self-distance").value / 2)
    chord = np.subtract(tube.place.point, tube.second_place.point)
    assert np.linalg.norm(chord) == pytest.approx(2 * tube.value)


def test_a_ballistic_parabola_is_refused_with_the_stretch_and_the_speed() -> None:
    path = opened(lambda t: (t, 0, G * t**2 / (2 * 3.0**2)), -1, 1)
    found = certify(QUAD, path, 3.0)
    assert not found.flyable
    (reason,) = found.reasons
    assert "got free fall at" in reason
    assert "from parameter -1 to 1 (0 to 2.345 m)" in reason
    assert "fly at most 2.924 parameter/s" in reason
    assert "or at least 3.075 parameter/s" in reason
    ((first, last),) = found.stretches
    assert (first.parameter, last.parameter) == (-1, 1)
    assert last.arc_length == pytest.approx(found.length)
    assert certify(QUAD, path, 2.924).flyable
    assert certify(QUAD, path, 3.075).flyable


def test_a_loop_is_refused_at_its_top_between_two_speeds() -> None:
    speed = np.sqrt(G * 2.0)
    found = certify(QUAD, loop(2.0), speed, progress="metres")
    row = found.check("specific thrust")
    assert row.verdict is Verdict.FAILS
    assert row.value == pytest.approx(0, abs=1e-9)
    assert row.place.parameter == pytest.approx(np.pi, abs=1e-9)
    assert row.place.point == pytest.approx((0, 0, -2), abs=1e-9)
    ((first, last),) = found.stretches
    width = 2 * 2 * np.arcsin(FLOOR / 2)  # |g e3 - g n| = 2 g sin(angle / 2) is below 5 % of g
    assert last.arc_length - first.arc_length == pytest.approx(2 * width, rel=1e-9)
    assert "m/s" in found.reasons[0]
    slow, fast = found.allowed_speeds
    for allowed in (slow[1], fast[0]):
        assert certify(QUAD, loop(2.0), allowed, progress="metres").flyable
    for forbidden in (slow[1] * 1.00001, fast[0] * 0.99999):
        assert not certify(QUAD, loop(2.0), forbidden, progress="metres").flyable


FLOOR = 0.05


def test_a_stretch_over_the_seam_is_named_once() -> None:
    """The loop begun at its top."""
    path = closed(lambda t: (2 * ca.sin(t), 0, -2 * ca.cos(t)))
    found = certify(QUAD, path, np.sqrt(G / 2))
    ((first, last),) = found.stretches
    assert first.parameter == pytest.approx(TURN - last.parameter, abs=1e-9)


def test_a_straight_line_without_gravity_is_explained() -> None:
    found = certify(SATELLITE, paths.line(), 0.5)
    (reason,) = found.reasons
    assert "a straight stretch at constant speed needs no thrust, which is free fall" in reason
    assert found.allowed_speeds == ()
    assert found.largest_speed is None
    assert certify(QUAD, paths.line(), 0.5).flyable


def test_limits_of_the_vehicle_refuse_with_the_speed_that_keeps_them() -> None:
    limits = Limits(thrust=1.5 * QUAD.weight, tilt_rate=2.0, torque=0.02)
    found = certify(QUAD, closed(trefoil), 2.0, limits=limits)
    assert len(found.reasons) == 3
    for word in ("thrust must stay within 7.355 N", "tilt rate must stay within 2 rad/s", "torque must stay within"):
        assert any(word in reason for reason in found.reasons)
    best = found.largest_speed
    assert f"fly at most {np.floor(best * 1e4) / 1e4:.4g} parameter/s" in found.reasons[0]  # rounded down
    assert certify(QUAD, closed(trefoil), best, limits=limits).flyable
    assert not certify(QUAD, closed(trefoil), best * 1.000001, limits=limits).flyable


REFUSED = {
    "cusp": (opened(lambda t: (t**2, t**3, 0), -1, 1.1), "zero speed of the parameterisation", (0.0,)),
    "corner": (opened(lambda t: (t, ca.fabs(t - 0.25), 0), -1, 1), "a corner at", (0.25,)),
    "kink": (opened(lambda t: (t, ca.fabs(t - 0.25) ** 5, 0), -1, 1), "a jump of the fifth derivative", (0.25,)),
    "gap": (opened(lambda t: (t, ca.if_else(t > 0.25, 1, 0), 0), -1, 1), "a gap at", (0.25,)),
    "crossing": (closed(figure_eight), "crosses itself", (0.0, np.pi)),
    "touching": (closed(pinched), "touches itself", (np.pi / 2, 3 * np.pi / 2)),
    "overlap": (closed(lambda t: (ca.cos(t), ca.sin(t), 0), 2 * TURN), "runs over itself", None),
    "ends": (opened(lambda t: (ca.cos(t), ca.sin(t), 0), 0, TURN), "give its period", (0.0, TURN)),
}


@pytest.mark.parametrize("name", REFUSED)
def test_degenerate_curves_are_refused_with_the_place(name: str) -> None:
    path, words, places = REFUSED[name]
    found = certify(QUAD, path, 0.5)
    assert not found.flyable
    assert any(words in reason for reason in found.reasons)
    row = next(each for each in found.checks if each.verdict is Verdict.FAILS)
    if places is not None:
        got = [place.parameter for place in (row.place, row.second_place) if place is not None]
        assert got == pytest.approx(list(places), abs=1e-3)
    json.dumps(found.as_dict(), allow_nan=False)


def test_what_has_no_meaning_is_not_examined() -> None:
    found = certify(QUAD, REFUSED["corner"][0], 0.5)
    assert found.check("curvature").verdict is Verdict.SKIPPED
    assert found.check("largest speed").value is None
    assert certify(QUAD, REFUSED["kink"][0], 0.5).check("curvature").value > 0


def test_many_corners_make_one_sentence() -> None:
    found = certify(QUAD, opened(lambda t: (t, ca.fabs(ca.sin(20 * t)), 0), 0.01, 3), 0.5)
    (reason,) = found.reasons
    assert reason.count("a corner at") == 3
    assert "and 16 more places" in reason


def rows(found: Certificate) -> dict[str, float]:
    return {each.name: each.value for each in found.checks if each.name != "regular" and each.value is not None}


def test_the_parameterisation_changes_nothing_in_metres() -> None:
    one = certify(QUAD, closed(trefoil), 2.0, progress="metres")
    two = certify(QUAD, closed(lambda t: trefoil(uneven(t))), 2.0, progress="metres")
    assert rows(two) == pytest.approx(rows(one), rel=1e-8)
    assert np.array(two.allowed_speeds) == pytest.approx(np.array(one.allowed_speeds), rel=1e-9)
    assert two.check("curvature").place.arc_length == pytest.approx(one.check("curvature").place.arc_length, abs=1e-5)


@pytest.mark.parametrize("angle", [0.4, 2.0])
def test_place_and_heading_of_the_path_change_nothing(angle: float) -> None:
    """Gravity singles out the vertical, so the path is turned about it and moved."""
    moved = placed(trefoil, so3.exp(np.array([0, 0, angle])), np.array([5.0, -3.0, 100.0]))
    one, two = certify(QUAD, closed(trefoil), 1.2), certify(QUAD, closed(moved), 1.2)
    assert rows(two) == pytest.approx(rows(one), rel=1e-9)
    assert two.check("torque").place.parameter == pytest.approx(one.check("torque").place.parameter, abs=1e-5)


@pytest.mark.parametrize("seed", range(2))
def test_without_gravity_no_direction_is_special(seed: int) -> None:
    generator = np.random.default_rng(seed)
    moved = placed(trefoil, so3.exp(generator.normal(size=3)), generator.normal(size=3))
    one, two = certify(SATELLITE, closed(trefoil), 1.2), certify(SATELLITE, closed(moved), 1.2)
    assert rows(two) == pytest.approx(rows(one), rel=1e-9)


def test_flying_backwards_demands_the_same() -> None:
    assert rows(certify(QUAD, closed(trefoil), -1.2)) == rows(certify(QUAD, closed(trefoil), 1.2))


def test_the_picture_is_coloured_by_the_tightest_margin() -> None:
    """1 - floor / specific thrust without other limits: zero where the floor is met, -1 in free fall."""
    found = certify(QUAD, loop(2.0), 1.0, limits=Limits(thrust=1e9))
    exact = 1 - FLOOR * G / np.linalg.norm(
        [0 * found.parameters, G + 2 * np.cos(found.parameters), 2 * np.sin(found.parameters)], axis=0
    )
    assert found.tightest_margin == pytest.approx(exact, abs=1e-9)
    assert len(found.parameters) == len(found.points) == len(found.arc_lengths) == len(found.tightest_margin)
    worst = found.check("specific thrust").place.parameter
    assert found.parameters[np.argmin(found.tightest_margin)] == pytest.approx(worst, abs=1e-6)
    assert certify(QUAD, loop(2.0), np.sqrt(G / 2)).tightest_margin.min() == -1


def test_the_certificate_is_plain_data() -> None:
    found = certify(QUAD, loop(2.0), 2.2)
    data = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert data["flyable"] is False
    assert data["speed_m_per_s"] == pytest.approx([4.4, 4.4])
    assert data["allowed_speeds_per_s"][1][1] is None
    assert data["checks"][0]["place"].keys() == {"parameter", "arc_length_m", "point_m"}


def test_bad_requests_are_refused() -> None:
    for bad in (float("nan"), "fast"):
        with pytest.raises(InputError):
            certify(QUAD, paths.circle(), bad)
    with pytest.raises(InputError, match="limit of tilt rate"):
        certify(QUAD, paths.circle(), limits=Limits(tilt_rate=0))
    with pytest.raises(UnknownNameError, match="metres"):
        certify(QUAD, paths.circle(), progress="feet")
    with pytest.raises(UnknownNameError, match="curvature"):
        certify(QUAD, paths.circle()).check("curvatur")


@pytest.mark.parametrize("count", [100, 200])
def test_the_largest_speed_is_the_largest_on_every_segment(count: int) -> None:
    """Peaks of tilt rate and torque on a spline are short; none may be missed on the way to the largest speed."""
    path, limits = ring(count), Limits(tilt_rate=10.0, torque=0.3)
    best = certify(QUAD, path, 1e-3, limits=limits).largest_speed
    assert certify(QUAD, path, best * (1 - 1e-8), limits=limits).flyable
    assert not certify(QUAD, path, best * (1 + 1e-6), limits=limits).flyable


def test_a_path_of_a_hundred_waypoints_costs_less_than_a_second() -> None:
    """Processor time, which other work on the machine does not stretch."""
    path, limits = ring(100), Limits(thrust=4 * QUAD.weight, tilt_rate=10.0, torque=1.0)
    certify(QUAD, path, 1.0, limits=limits)
    begin = time.process_time()
    found = certify(QUAD, path, 1.0, limits=limits)
    assert time.process_time() - begin < 1.0
    assert found.check("smooth").verdict is Verdict.OK
    assert found.check("self-distance").value > 1

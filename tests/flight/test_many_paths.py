"""Flights along paths of their own, flown together, are those that are flown apart."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import gammastar as gs
from engine import steps
from gammastar.errors import InputError

PLAIN = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
LAW = gs.design(PLAIN, gs.paths.circle(), (-3.4, -3.8, -4.2, -4.6))
SAMPLED: dict[str, Any] = {"speed": 1.0, "duration": 1.0, "step": 2e-2, "feedback": "start", "rate": 50.0}
CONTINUOUS: dict[str, Any] = {"speed": 1.0, "duration": 0.6, "step": 5e-3}
TOLD = ("max_distance_m", "final_distance_m", "peak_rate_rad_s", "so3_drift", "min_focal_margin")
ROUND = [
    gs.paths.circle(),
    gs.paths.circle(2.0, (0, 0, 1)),
    gs.paths.ellipse((1.5, 1.0)),
    gs.paths.circle(1.3, (1, 0, 0)),
]
ENDING = [
    gs.curve_from_formula("lambda", "a*sin(lambda)", "0", ends=(0, end), constants={"a": a})
    for a, end in ((1, 4), (0.5, 2))
]


def along(path: gs.Path) -> gs.Law:
    return dataclasses.replace(LAW, path=path)


def beside(path: gs.Path, share: float = 0.3) -> gs.State:
    """Return a start near a share of a path's domain."""
    low, high = path.domain
    return gs.State(path.points(np.array([low + share * (high - low)]))[0] + [0.1, 0.2, -0.1])


def courses(count: int) -> list[gs.Path]:
    draw = np.random.default_rng(1)
    return [gs.waypoints(np.arange(4)[:, None] * [3, 1, 0] + draw.normal(size=(4, 3)), k % 2 > 0) for k in range(count)]


def flown(paths: list[gs.Path], **given: Any) -> gs.Flights:
    return gs.fly_many([along(path) for path in paths], [beside(path) for path in paths], **given)


@steps.needs_compiler
def test_courses_fly_in_one_program_as_each_does_alone() -> None:
    """To the last bit: closed ones are data of the same graph, and open ones too, which have a place to hold in the end."""
    for parity in (0, 1):
        paths = courses(50)[parity::2]
        setting = SAMPLED | {"machine": "native"}
        flights = flown(paths, **setting)
        for place, path in enumerate(paths):
            alone = gs.fly_many([along(path)], [beside(path)], flights=[place], **setting)
            assert all(alone[name][0] == flights[name][place] for name in TOLD)
        assert len(set(flights["max_distance_m"])) == len(paths)


@steps.needs_compiler
def test_curves_fly_in_one_program_whoever_flies_beside_them() -> None:
    """To the last bit, on one thread or two, and when one of them is flown again."""
    setting = SAMPLED | {"machine": "native"}
    flights, turned = flown(ROUND, workers=1, **setting), flown(ROUND[::-1], workers=2, **setting)
    few = flown(ROUND[1:3], flights=[1, 2], **setting)
    for name in TOLD:
        assert np.array_equal(turned[name][::-1], flights[name])
        assert np.array_equal(few[name], flights[name][1:3])
    for place, path in enumerate(ROUND):
        record = flights.record(place)
        assert record.law.path is path
        assert np.linalg.norm(record.angular_velocity, axis=1).max() == flights["peak_rate_rad_s"][place]


@pytest.mark.parametrize(
    ("paths", "setting"),
    [
        (ROUND[1:], SAMPLED),
        (courses(6)[::2], CONTINUOUS),
        (courses(4)[1::2], SAMPLED),
        ([gs.by_length(gs.paths.ellipse((r, 1.0))) for r in (1.5, 2.0)], SAMPLED),
        ([gs.placed(gs.paths.helix(r), (r, 0, 0)) for r in (0.8, 1.0)], SAMPLED),
        (ENDING, SAMPLED),
    ],
    ids=["round", "open courses", "closed courses", "by length", "helices", "ends"],
)
def test_paths_that_differ_fly_as_they_do_apart(paths: list[gs.Path], setting: dict[str, Any]) -> None:
    """Distances, starts, places to hold and ends are those of each path."""
    flights = flown(paths, machine="casadi", **setting)
    for place, path in enumerate(paths):
        record = gs.fly(along(path), beside(path), flight=place, **setting)
        summary = record.summary()
        assert flights["status"][place] == record.status.name.lower()
        assert flights["final_distance_m"][place] == pytest.approx(record.distance[-1], abs=1e-9)
        assert flights["max_distance_m"][place] == pytest.approx(record.distance.max(), abs=1e-9)
        assert flights["peak_rate_rad_s"][place] == pytest.approx(summary["peak_rate_rad_s"], rel=1e-9)
        np.testing.assert_allclose(flights.record(place).position, record.position, atol=1e-9)


def test_each_holds_at_the_end_of_its_own_course() -> None:
    """An end that another course does not have: distances count to the course between its own ends."""
    paths: list[gs.Path] = [
        gs.waypoints([(0, 0, 0), (1.5, 0, 0)]),
        gs.waypoints([(0, 0, 0), (2.0, 0, 0), (3.0, 0.5, 0)]),
    ]
    starts = [gs.State((1.4, 0, 0)), gs.State((2.9, 0.4, 0))]
    flights = gs.fly_many([along(path) for path in paths], starts, speed=1.0, duration=6.0, step=1e-2, machine="casadi")
    for place, path in enumerate(paths):
        end = path.points(np.array(path.domain))[1]
        assert flights.record(place).position[-1] == pytest.approx(end, abs=1e-2)
    assert flights["final_distance_m"] == pytest.approx([0, 0], abs=1e-2)


def test_an_autopilot_takes_paths_of_its_own_too() -> None:
    law = gs.design(gs.vehicles.load("hummingbird"), ROUND[0], -4, rejection=gs.Observer(), approach=gs.Approach())
    laws, starts = (
        [dataclasses.replace(law, path=path) for path in ROUND[:2]],
        [gs.State((1.5, 0, 0)), gs.State((0, 0, 1))],
    )
    setting: dict[str, Any] = {"speed": 1.0, "duration": 0.4, "step": 5e-3, "rate": 200.0}
    flights = gs.fly_many(laws, starts, machine="casadi", **setting)
    for place, each in enumerate(laws):
        record = gs.fly(each, starts[place], flight=place, **setting)
        assert record.waiting.any() == (place == 1)
        np.testing.assert_allclose(flights.record(place).state, record.state, atol=1e-9)


def test_paths_and_poles_may_differ_together() -> None:
    laws = [
        dataclasses.replace(gs.design(PLAIN, path, poles))
        for path, poles in zip(ROUND, (-3, -4, -5, -3.5), strict=True)
    ]
    starts = [beside(path) for path in ROUND]
    flights = gs.fly_many(laws, starts, machine="casadi", **SAMPLED)
    for place, law in enumerate(laws):
        record = gs.fly(law, starts[place], **SAMPLED)
        assert flights["max_distance_m"][place] == pytest.approx(record.distance.max(), abs=1e-9)


def test_paths_of_one_formula_need_one_graph() -> None:
    flown(ROUND[:2], machine="casadi", **SAMPLED)
    before = gs.engine.compilations()
    flown([gs.paths.circle(0.1 * k + 0.7) for k in range(5)], machine="casadi", **SAMPLED)
    assert gs.engine.compilations() == before


@pytest.mark.parametrize(
    ("paths", "words"),
    [
        ([gs.paths.circle(), gs.paths.trefoil()], "paths with other formulas"),
        ([gs.paths.circle(kind="implicit"), gs.paths.circle(2.0, kind="implicit")], "paths with other formulas"),
        (
            [gs.paths.line(), dataclasses.replace(gs.paths.line(), ends=(-5, 5))],
            "must all hold a place in the end",
        ),
    ],
    ids=["other formulas", "implicit", "one ends"],
)
def test_paths_that_need_programs_of_their_own_are_flown_apart(paths: list[gs.Path], words: str) -> None:
    with pytest.raises(InputError, match=words):
        flown(paths, machine="casadi", **SAMPLED)

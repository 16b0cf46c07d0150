"""A compiled export flies as the graph does: in float64 to rounding, in float32 as well as the path is wanted."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from engine.steps import needs_compiler
from gammastar.errors import GammastarError
from gammastar.flight import FlightRecord, Replacement, fly
from gammastar.mission import load
from gammastar.path.catalogue import circle

pytestmark = needs_compiler


@functools.cache
def flown(name: str, **changes: Any) -> FlightRecord:
    """Return the flight of a built-in mission, with values of its sections changed: controller__interface="c"."""
    return load(name).with_values({key.replace("__", "."): value for key, value in changes.items()}).fly()


def test_float64_flies_as_the_graph() -> None:
    """With rotors, observers, wind, and a velocity measured every fifth interval; rounding grows a million times while it turns over."""
    shared: dict[str, Any] = {
        "flight__duration": 1.2,
        "sensors__velocity__rate": 100.0,
        "sensors__velocity__deviation": 1e-3,
    }
    graph = flown("quadrotor", **shared)
    compiled = flown("quadrotor", **shared, controller__interface="c", controller__real="float64")
    assert compiled.completed
    assert np.all(np.abs(compiled.state - graph.state).max(axis=0) < 1e-8 * np.abs(graph.state).max(axis=0))
    assert compiled.autopilot is not None
    assert graph.autopilot is not None
    assert (
        np.abs(compiled.autopilot.unknown - graph.autopilot.unknown).max()
        < 1e-8 * np.abs(graph.autopilot.unknown).max()
    )
    assert np.array_equal(compiled.autopilot.given_up, graph.autopilot.given_up)


def test_what_float32_tells_is_what_the_graph_tells() -> None:
    """Of the unknown force and torque, within the rounding that observers enlarge, and of what limits take."""
    shared: dict[str, Any] = {"flight__duration": 1.2}
    graph = flown("quadrotor", **shared).autopilot
    compiled = flown("quadrotor", **shared, controller__interface="c").autopilot
    assert graph is not None
    assert compiled is not None
    largest = np.maximum(1, np.abs(graph.unknown).max(axis=0))
    assert np.all(np.abs(compiled.unknown - graph.unknown).max(axis=0) < 1e-3 * largest)
    assert np.mean(compiled.given_up == graph.given_up) > 0.98


def test_float32_turns_over_and_settles_within_a_millimetre() -> None:
    """The paper's second scenario; what is left are the digits of float32 at ten metres from the origin."""
    record = flown("upside-down", flight__duration=12.0, controller__interface="c")
    summary = record.summary()
    assert summary["settled"]
    assert summary["distance_m"]["max_last_quarter"] < 1e-3
    assert record.autopilot is not None
    assert np.abs(record.autopilot.estimated_position - record.state[:, :3]).max() < 1e-5


def test_progress_is_counted_over_rounds_although_the_code_takes_them_off() -> None:
    record = flown("upside-down", flight__duration=12.0, controller__interface="c")
    assert np.abs(np.diff(record.tangential_state[:, 0])).max() < 0.1
    assert record.tangential_state[-1, 0] - record.tangential_state[0, 0] > 2 * np.pi


def test_the_frame_of_a_mission_is_that_of_its_code() -> None:
    """Waypoints with z upwards, in tables: the flight is that of the graph, which is `ned` inside."""
    shared = {"flight__duration": 1.0, "controller__feedback": "middle", "controller__rate": 500.0}
    graph = flown("waypoints", **shared)
    compiled = flown("waypoints", **shared, controller__interface="c", controller__real="float64")
    assert np.abs(compiled.state[:, :3] - graph.state[:, :3]).max() < 2e-3  # two ways to look half an interval ahead


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"controller.feedback": "continuous"}, "needs sampled feedback"),
        ({"controller.interface": "wrench"}, 'must have interface = "c"'),
    ],
)
def test_what_cannot_be_flown_as_code_is_refused_when_the_mission_is_read(changes: dict[str, str], words: str) -> None:
    with pytest.raises(GammastarError, match=words):
        load("upright").with_values({"controller.interface": "c", "controller.real": "float32"} | changes)


def test_code_of_one_path_at_one_rate_flies_no_other() -> None:
    mission = load("upright").with_values({"controller.interface": "c"})
    law, start, pilot = mission.law(), mission.start(), mission._pilot
    with pytest.raises(GammastarError, match="must fly at its own rate"):
        fly(law, start, speed=1.0, rate=100.0, duration=0.1, pilot=pilot)
    with pytest.raises(GammastarError, match="has one path"):
        fly(law, start, speed=1.0, duration=0.1, pilot=pilot, replacements=[Replacement(0.05, circle())])
    with pytest.raises(GammastarError, match="must have one path"):
        load("replanned").with_values({"controller.interface": "c"})

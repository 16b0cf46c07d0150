"""Exported C is the graph: in float64 to the last digits, in float32 as far as its digits go, for every mission."""

from __future__ import annotations

import dataclasses
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from export.programs import exported, flown, has_sanitizers, needs_compiler, start_of
from gammastar.errors import InputError
from gammastar.export.c99 import sources
from gammastar.export.load import CONSTRAINED, MEASUREMENT_REFUSED, NOT_STARTED, RESULT_REFUSED, loaded, told_of
from gammastar.export.program import c_name
from gammastar.export.targets import files_of
from gammastar.export.vectors import moments
from gammastar.mission import names

pytestmark = needs_compiler

ONE_PATH = [name for name in names() if name != "replanned"]
FAST = "CFLAGS=-O0"
UNMEASURED = np.append(np.full(18, np.nan), np.zeros(4))


def made(folder: Path, *words: str) -> str:
    """Return what make prints in a folder; it must succeed."""
    answer = subprocess.run(["make", *words], cwd=folder, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return answer.stdout


@pytest.mark.parametrize("name", ONE_PATH)
def test_every_mission_compiles_without_a_warning_and_passes_its_self_test(name: str, tmp_path: Path) -> None:
    """In float32, which every constant has to fit; -Wall -Wextra -Wpedantic -Wconversion -Werror stand in the Makefile."""
    for file, text in files_of(exported(name, "float32"), "c99", 0.1).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    assert "passed" in made(tmp_path, "check", FAST)


@pytest.mark.parametrize("real", ["float32", "float64"])
@pytest.mark.parametrize("name", ["upright", "waypoints", "quadrotor"])
def test_no_function_is_written_that_nothing_calls(name: str, real: str) -> None:
    """Clang warns of them where gcc does not."""
    for file, text in sources(exported(name, real)).items():
        for function in re.findall(r"^static (?:inline )?\w+ (\w+)\(", text, re.MULTILINE):
            assert len(re.findall(rf"\b{function}\b", text)) > 1, (file, function)


def test_a_self_test_fails_where_the_code_is_wrong(tmp_path: Path) -> None:
    files = files_of(exported("upright"), "c99", 0.1)
    wrong, count = re.subn(r"y1\[1\] = (v\d+);", r"y1[1] = \1 + 1e-9;", files["upright.c"])
    assert count == 1
    for file, text in (files | {"upright.c": wrong}).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    answer = subprocess.run(["make", "check", FAST], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert answer.returncode != 0
    assert "FAILED" in answer.stdout


def test_a_compiler_that_takes_all_numbers_for_finite_is_refused(tmp_path: Path) -> None:
    """With -ffast-math gcc and clang leave the checks for NaN out."""
    for file, text in sources(exported("upright")).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    words = ["cc", "-std=c99", "-ffast-math", "-c", "upright.c"]
    answer = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert answer.returncode != 0
    assert "not finite" in answer.stderr


@pytest.mark.parametrize(("name", "kind"), [("upside-down", "speed"), ("quadrotor", "speed"), ("waypoints", "ramp")])
def test_float64_equals_the_graph_on_random_states(name: str, kind: str) -> None:
    """To 1e-12 of the size of each number, on 10,000 states in all, over rounds where they count; sums are rounded in the same order."""
    program, count = exported(name, reference__kind=kind), 3334
    random = np.random.default_rng(0)
    recorded = moments(program, 8.0)
    chosen = random.integers(len(recorded), size=count)
    memory = np.stack([recorded[k].memory for k in chosen], axis=1)
    memory[2:] *= 1 + 0.1 * random.standard_normal(memory[2:].shape)
    low, high = program.path.domain
    memory[0] = random.uniform(low, high if program.wraps else 3 * high, count)
    measurement = np.stack([recorded[k].measurement for k in chosen], axis=1)
    measurement[:6] += random.standard_normal((6, count))
    measurement[15:18] += random.standard_normal((3, count))
    code = loaded(program)
    pilot = code.start(measurement[:, 0])
    found, wanted = [], []
    for k in range(count):
        pilot.state.memory[:] = memory[:, k].tolist()
        pilot.state.interval = int(chosen[k])
        output = pilot.step(measurement[:, k])
        assert not output.flags & (MEASUREMENT_REFUSED | RESULT_REFUSED)
        found.append(np.concatenate([pilot.memory, output.command, *told_of(output).values()]))
        wanted.append(np.concatenate(program.stepped(memory[:, k], measurement[:, k], int(chosen[k]))))
    error = np.abs(np.array(found) - wanted)
    assert np.all(error <= 1e-12 * np.maximum(1, np.abs(wanted)))


def test_hours_cost_no_digit_of_float32() -> None:
    """After 200 rounds and five hours the same numbers come out as at the start: rounds and intervals are counted as whole numbers."""
    program = exported("knot", "float32")
    code = loaded(program)
    pilot, motion = code.start(program.graphs.measurement(start_of(program))), start_of(program)
    motions = flown(pilot, program, motion, 4000)
    low, high = program.path.domain
    assert low <= pilot.memory[0] < high
    memory, measurement = pilot.memory, program.graphs.measurement(motions[-1])
    outputs = []
    for interval, laps in ((0, 0), (9_000_000, 200)):
        pilot.state.memory[:], pilot.state.interval, pilot.state.laps = memory.tolist(), interval, laps
        outputs.append(pilot.step(measurement))
    assert list(outputs[0].command) == list(outputs[1].command)
    assert outputs[1].laps == 200


def test_rounds_of_a_closed_path_are_counted() -> None:
    """The parameter jumps back by a period where a round ends, and laps times the period makes it whole again."""
    program = exported("upside-down", "float32")
    pilot = loaded(program).start(program.graphs.measurement(start_of(program)))
    flown(pilot, program, start_of(program), 7000)  # 14 s at 1 rad/s
    reached = pilot.memory[0] + 2 * np.pi * pilot.state.laps
    assert pilot.state.laps == 2
    assert reached == pytest.approx(program.parameter + 14, abs=1.5)


@pytest.mark.parametrize("rounds", [1000, -1000])
def test_rounds_that_a_wrong_measurement_makes_are_taken_off_at_once(rounds: int) -> None:
    """From far away a parameter may move by thousands of rounds, beside which float32 does not hold its digits."""
    program = exported("upside-down", "float32")
    measurement = program.graphs.measurement(start_of(program))
    pilot = loaded(program).start(measurement)
    pilot.state.memory[0] += 2 * np.pi * rounds
    pilot.step(measurement)
    low, high = program.path.domain
    assert low <= pilot.memory[0] <= high
    assert pilot.state.laps == rounds


def test_a_reference_beyond_all_counts_is_left_out(tmp_path: Path) -> None:
    """The vehicle would brake for thirty years: its stop begins after the last control interval that is counted."""
    program = exported("stop", "float32", reference__braking_time=1e9)
    assert len(program.autopilot.guidance.reference.pieces.begins) > len(program.schedule.first)
    for file, text in files_of(program, "c99", 0.1).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    assert "passed" in made(tmp_path, "check", FAST)


def test_moments_end_where_measurements_are_refused() -> None:
    """The law throws the vehicle from far away faster than can be believed; a start that is refused itself has no moments."""
    program = exported("upright", "float32")
    far, refused = (
        dataclasses.replace(program, start=np.concatenate([[x, 0.0, 0.0], program.start[3:]])) for x in (9.9e5, 1e7)
    )
    recorded = moments(far, 20.0)
    assert all(np.all(np.abs(each.measurement[:18]) <= 1e6) for each in recorded)
    assert recorded[-1].interval < 1000
    with pytest.raises(InputError, match=r"the start of an export must be within 1e\+06 m"):
        moments(refused, 20.0)


@pytest.mark.parametrize("broken", [np.nan, np.inf, 1e9])
def test_a_broken_measurement_holds_the_last_output(broken: float) -> None:
    program = exported("upside-down", "float32")
    good = program.graphs.measurement(start_of(program))
    pilot = loaded(program).start(good)
    before = pilot.step(good)
    memory, interval = pilot.memory, pilot.state.interval
    for entry in range(18):
        bad = good.copy()
        bad[entry] = broken
        output = pilot.step(bad)
        assert output.flags & MEASUREMENT_REFUSED
        assert list(output.command) == list(before.command)
        assert np.array_equal(pilot.memory, memory)
    assert pilot.state.interval == interval + 18  # time goes on
    assert not pilot.step(good).flags & MEASUREMENT_REFUSED


def test_a_channel_with_nothing_fresh_is_not_looked_at() -> None:
    """NaN there, from the first step on, gives what the graph makes of the channel's last sample."""
    program = exported("quadrotor")
    good = program.graphs.measurement(start_of(program))
    moved = good + np.concatenate([np.full(6, 1e-3), np.zeros(9), np.full(3, 1e-3), np.zeros(4)])
    channels = {18: slice(0, 3), 19: slice(3, 6), 20: slice(6, 15), 21: slice(15, 18)}
    for fresh, numbers in channels.items():
        pilot = loaded(program).start(good)
        for step, (measurement, last) in enumerate([(moved, good), (moved, moved), (good, moved)]):
            held = measurement.copy()
            held[fresh] = float(last is measurement)
            held[numbers] = last[numbers]
            wanted = program.stepped(pilot.memory, held, step)
            if held[fresh] == 0:
                held[numbers] = np.nan
            output = pilot.step(held)
            assert np.array(output.command) == pytest.approx(wanted[1], rel=1e-9)
            assert pilot.memory == pytest.approx(wanted[0], rel=1e-9, abs=1e-9)
            assert not output.flags & MEASUREMENT_REFUSED


def test_a_broken_sample_is_forgotten() -> None:
    """The sample before it is the last one of its channel."""
    program = exported("quadrotor", "float32")
    good = program.graphs.measurement(start_of(program))
    pilot, stale, broken = loaded(program).start(good), good.copy(), good.copy()
    stale[18], broken[0] = 0.0, np.nan
    assert pilot.step(broken).flags & MEASUREMENT_REFUSED
    assert not pilot.step(stale).flags & MEASUREMENT_REFUSED


def test_a_matrix_that_is_no_rotation_is_refused() -> None:
    program = exported("upside-down", "float32")
    good = program.graphs.measurement(start_of(program))
    pilot = loaded(program).start(good)
    for attitude in (np.zeros(9), 1.2 * good[6:15], -good[6:15]):
        assert pilot.step(np.concatenate([good[:6], attitude, good[15:]])).flags & MEASUREMENT_REFUSED


def test_a_result_that_is_not_finite_is_not_given() -> None:
    program = exported("upside-down", "float32")
    good = program.graphs.measurement(start_of(program))
    pilot = loaded(program).start(good)
    before = pilot.step(good)
    pilot.state.memory[3] = 0.0  # no thrust: attitude has no effect, and the law divides by it
    memory = pilot.memory
    output = pilot.step(good)
    assert output.flags & RESULT_REFUSED
    assert list(output.command) == list(before.command)
    assert np.array_equal(pilot.memory, memory)


def test_the_first_usable_measurement_starts() -> None:
    program = exported("upside-down")
    good = program.graphs.measurement(start_of(program))
    pilot, wanted = loaded(program).start(UNMEASURED), loaded(program).start(good)
    output = pilot.step(UNMEASURED)
    assert output.flags == NOT_STARTED | MEASUREMENT_REFUSED
    assert list(output.command) == [0.0] * 4
    assert bytes(pilot.step(good)) == bytes(wanted.step(good))
    assert bytes(pilot.state) == bytes(wanted.state)


def test_it_starts_where_the_path_is_nearest() -> None:
    """The search in C against the one of `start_parameter`, from anywhere around the track."""
    program = exported("waypoints")
    code, random = loaded(program), np.random.default_rng(1)
    for _ in range(50):
        position = np.append(random.uniform(-8, 14, 2), -random.uniform(0, 6))
        motion = np.concatenate([position, start_of(program)[3:]])
        found = code.start(program.graphs.measurement(motion)).memory[0]
        wanted = program.path.start_parameter(position)
        assert np.linalg.norm(program.path.points(np.array([found])) - position) == pytest.approx(
            np.linalg.norm(program.path.points(np.array([wanted])) - position), abs=1e-9
        )


@pytest.mark.parametrize("name", ["selftest", "math", "look_up", "log", "crazyflie", "Upright", "2d", "a-b", ""])
def test_a_name_that_c_cannot_have_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="the name of an export must"):
        dataclasses.replace(exported("upright"), name=name)


@pytest.mark.parametrize(
    ("name", "prefix"), [("log", "mission_log"), ("look_up", "mission_look_up"), ("a b-c", "a_b_c")]
)
def test_a_mission_whose_name_is_taken_has_another_prefix(name: str, prefix: str) -> None:
    """A file log.h of ours beside the firmware's, or an array look_up_path_0 beside the function, would be taken for the other."""
    assert c_name(name) == prefix


def test_a_title_stands_as_it_is() -> None:
    """Though it looks like a placeholder, or like the end of a comment."""
    program = dataclasses.replace(exported("upright"), title="@real@ @mission@ */ int x;")
    files = files_of(program, "c99", 0.1)
    assert "\n@real@ @mission@ * / int x;\n" in files["README.md"]
    assert files["upright.h"].startswith("/* @real@ @mission@ * / int x;\n")


def test_a_frame_is_a_name_for_the_same_flight() -> None:
    """The quadrotor mission counts z upwards: what comes out has the signs of its frame, and believed position is the measured one."""
    program = exported("quadrotor")
    measurement = program.graphs.measurement(start_of(program))
    assert program.frame == "enu"
    output = loaded(program).start(measurement).step(measurement)
    assert np.array(output.position) == pytest.approx(start_of(program)[:3] * [1, -1, -1])
    assert not output.flags & ~CONSTRAINED


@pytest.mark.skipif(not has_sanitizers(), reason="no sanitizers are installed")
def test_nothing_undefined_happens(tmp_path: Path) -> None:
    """Under the sanitizers of addresses and undefined behaviour, with tables, rotors and observers."""
    for file, text in files_of(exported("hexarotor", "float32"), "c99", 0.1).items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    made(tmp_path, "check", "CFLAGS=-O0 -g -fsanitize=address,undefined -fno-sanitize-recover=all")

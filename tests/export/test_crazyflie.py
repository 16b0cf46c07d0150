"""The Crazyflie's controller, around stand-ins of the firmware's headers: units, axes, rates, and a flight through all of them."""

from __future__ import annotations

import ctypes
import functools
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from export.programs import exported, needs_compiler
from gammastar import so3
from gammastar.errors import InputError
from gammastar.export.c99 import template
from gammastar.export.program import Program, c_name
from gammastar.export.targets import files_of
from gammastar.export.vectors import believed

pytestmark = needs_compiler

STAND_INS = Path(__file__).parent / "crazyflie"
STRICT = ["-std=gnu11", "-Wall", "-Wextra", "-Wdouble-promotion", "-Werror", "-Wno-pedantic"]
CORTEX = ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-c"]
FLIP = np.diag([1.0, -1.0, -1.0])  # forward, right, down <-> forward, left, up
MILLISECOND = 1e-3


class State(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_float * size)
        for name, size in (("position", 4), ("velocity", 4), ("attitude", 4), ("quaternion", 5))
    ]


class Sensors(ctypes.Structure):
    _fields_ = [("acc", ctypes.c_float * 3), ("gyro", ctypes.c_float * 3)]


class Control(ctypes.Structure):
    _fields_ = [("wrench", ctypes.c_float * 4), ("mode", ctypes.c_int)]


class Variable(ctypes.Structure):
    _fields_ = [("type", ctypes.c_int), ("name", ctypes.c_char_p), ("address", ctypes.c_void_p)]


def written(program: Program, folder: Path) -> list[str]:
    """Write the files of a program, and return the C among them."""
    files = files_of(program, "crazyflie")
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return [str(folder / name) for name in files if name.endswith(".c")]


@functools.cache
def firmware(program: Program) -> ctypes.CDLL:
    """Return the controller of a program, compiled with the stand-ins."""
    folder = Path(tempfile.mkdtemp())
    try:
        made = folder / "controller.so"
        words = ["cc", *STRICT, "-O1", f"-I{STAND_INS}", f"-I{folder / 'src'}", *written(program, folder)]
        answer = subprocess.run([*words, "-shared", "-fPIC", "-lm", "-o", str(made)], capture_output=True, text=True)
        assert (answer.returncode, answer.stderr) == (0, "")
        return ctypes.CDLL(str(made))
    finally:
        shutil.rmtree(folder)


class Vehicle:
    """A Crazyflie in Python: what its firmware knows of a motion (18,) in `ned`, and what its controller asks for."""

    def __init__(self, program: Program) -> None:
        self.controller = firmware(program)
        self.controller.controllerOutOfTreeInit()
        assert self.controller.controllerOutOfTreeTest()
        table = (Variable * 2).in_dll(self.controller, "gammastar_parameters")
        assert (table[0].name, table[1].name) == (b"fly", b"gammastar")
        self.fly = ctypes.c_uint8.from_address(table[0].address)
        self.fly.value = 0  # as after a start of the firmware
        self.control = Control()

    def log(self, name: bytes, kind: Any = ctypes.c_float) -> float:
        table = (Variable * 8).in_dll(self.controller, "gammastar_logs")
        (address,) = (each.address for each in table if each.name == name)
        return kind.from_address(address).value

    def asked(self, motion: np.ndarray, step: int) -> np.ndarray:
        """Return force and torque (4,) in `ned`, of a motion in a step of 1 ms."""
        attitude = FLIP @ motion[6:15].reshape(3, 3).T @ FLIP
        turn = so3.log(attitude)
        angle = np.linalg.norm(turn)
        axis = turn / angle if angle > 0 else turn
        state = State()
        state.position[1:] = (FLIP @ motion[:3]).tolist()
        state.velocity[1:] = (FLIP @ motion[3:6]).tolist()
        state.quaternion[1:] = [*(np.sin(angle / 2) * axis).tolist(), float(np.cos(angle / 2))]
        sensors = Sensors((0, 0, 1), tuple(np.degrees(FLIP @ motion[15:18]).tolist()))
        arguments = (ctypes.byref(each) for each in (self.control, Control(), sensors, state))
        self.controller.controllerOutOfTree(*arguments, ctypes.c_uint32(step))
        assert self.control.mode == 1  # force and torque
        return np.append(self.control.wrench[0], FLIP @ self.control.wrench[1:])


@pytest.mark.parametrize("name", ["quadrotor", "waypoints"])
def test_the_microcontroller_compiles_it_without_a_warning(name: str, tmp_path: Path) -> None:
    if shutil.which(CORTEX[0]) is None:
        pytest.skip(f"{CORTEX[0]} is not there; run make arm-tools")
    for source in written(exported(name, "float32"), tmp_path):
        words = [
            *CORTEX,
            *STRICT,
            "-O1",
            f"-I{STAND_INS}",
            f"-I{tmp_path / 'src'}",
            source,
            "-o",
            str(tmp_path / "x.o"),
        ]
        answer = subprocess.run(words, capture_output=True, text=True, check=False)
        assert (answer.returncode, answer.stderr) == (0, "")


def test_a_wrench_is_the_commanded_one_in_the_firmwares_axes() -> None:
    """Of a `ned` mission from its tilted, turning start, step by step against the graph."""
    program = exported("upside-down", "float32")
    vehicle, motion, move = Vehicle(program), program.start[:18].copy(), believed(program)
    motion[15:18] = 0.3, -0.2, 0.1
    vehicle.fly.value = 1
    memory = program.started(program.graphs.measurement(motion))
    for k in range(200):
        memory, command, _ = program.stepped(memory, program.graphs.measurement(motion), k)
        assert vehicle.asked(motion, 2 * k) == pytest.approx(command, rel=2e-3, abs=2e-3 * np.abs(command).max())
        motion = move(motion, memory[program.wrench]).full()[:, 0]


def test_a_vehicle_with_rotors_comes_to_its_path() -> None:
    """Through rotors with lag at 1000 Hz, from a tilted start; with a wrong sign, unit or rate it tumbles."""
    program = exported("quadrotor", "float32", start__roll=40.0)
    rotors, lookahead = program.autopilot.vehicle.rotors, program.autopilot.belief.lookahead
    assert rotors is not None
    assert lookahead.interface == "wrench"
    vehicle, motion = Vehicle(program), program.start[:18].copy()
    move = believed(program, MILLISECOND)
    speeds = rotors.hover(program.autopilot.vehicle.weight).speeds
    vehicle.fly.value = 1
    for step in range(3500):
        thrusts = np.linalg.solve(rotors.mixer, vehicle.asked(motion, step))
        commands = np.sqrt(np.maximum(thrusts, 0) / rotors.thrust_coefficient)
        assert np.all(commands <= rotors.fastest * (1 + 1e-4))
        after = commands + (speeds - commands) * np.exp(-MILLISECOND / 0.005)
        wrench = rotors.mixer @ (rotors.thrust_coefficient * ((speeds + after) / 2) ** 2)
        speeds, motion = after, move(motion, wrench).full()[:, 0]
    assert program.path.distances(motion[None, :3], np.array([vehicle.log(b"parameter")]))[0] < 2e-3
    assert vehicle.log(b"flags", ctypes.c_uint32) == 0


def test_it_answers_at_its_own_rate_and_holds_in_between() -> None:
    program = exported("quadrotor", "float32")
    vehicle, motion = Vehicle(program), program.start[:18].copy()
    vehicle.fly.value = 1
    asked = [vehicle.asked(motion, step) for step in range(6)]
    changed = [bool(np.any(asked[k] != asked[k - 1])) for k in range(1, 6)]
    assert changed == [False, True, False, True, False]


def test_without_leave_to_fly_nothing_is_asked_and_the_flight_is_forgotten() -> None:
    program = exported("quadrotor", "float32")
    vehicle, motion = Vehicle(program), program.start[:18].copy()
    assert not vehicle.asked(motion, 0).any()
    vehicle.fly.value = 1
    first = [vehicle.asked(motion, step) for step in (2, 4, 6)]
    assert vehicle.log(b"thrust") == pytest.approx(first[-1][0])
    vehicle.fly.value = 0
    assert not vehicle.asked(motion, 8).any()
    vehicle.fly.value = 1
    np.testing.assert_array_equal([vehicle.asked(motion, step) for step in (10, 12, 14)], first)


def test_no_name_hides_a_header_of_the_firmware() -> None:
    """The C of an export lies beside what includes the firmware's headers, and a file beside it would be taken first."""
    included = re.findall(r'#include "(\w+)\.h"', template("crazyflie.c"))
    assert len(included) == 7
    assert all(c_name(header) == f"mission_{header.lower()}" for header in [*included, "crazyflie"])


def test_what_no_crazyflie_takes_is_refused() -> None:
    for changes, words in (
        ({"controller__interface": "rates"}, "must command a wrench"),
        ({"controller__rate": 400.0}, "must be 1000 Hz over a whole number"),
    ):
        with pytest.raises(InputError, match=words):
            files_of(exported("quadrotor", "float32", **changes), "crazyflie")
    with pytest.raises(InputError, match="must be float32"):
        files_of(exported("quadrotor", "float64"), "crazyflie")

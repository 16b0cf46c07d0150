"""The target `crazyflie`: an out-of-tree controller of the Crazyflie firmware around the C99 of a program.

The firmware takes a force and torques.  A vehicle with rotors is allocated and its lag made up for by the autopilot itself, in rotor
speeds; the answer is the wrench that these speeds give when the rotors have reached them, so that the firmware's own mixer, which knows
neither limits by priority nor lag, commands the thrusts of these speeds again.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import casadi as ca

from gammastar.engine import tape_of
from gammastar.engine.c_source import c_file
from gammastar.errors import InputError
from gammastar.export.c99 import filled, placeholders, sources, template
from gammastar.export.program import Program
from gammastar.export.sizes import state_bytes, table_bytes
from gammastar.law.actuation import RotorSpeeds

FRAME, REAL = "enu", "float32"  # of the firmware: forward, left, up
MAIN_RATE = 1000  # [Hz] of its stabilizer
COMMAND = ["force [N]", *(f"torque about body axis {axis} [N m]" for axis in "xyz")]
ROUNDING = 1e-9  # relative, of a rate that is a whole number
ASKED = "for (int k = 0; k < 4; k++) asked[k] = output.command[k]"
MAKEFILE = """\
# make CRAZYFLIE_BASE=...: the firmware with @NAME@ as its out-of-tree controller; make cload: onto a Crazyflie
CRAZYFLIE_BASE ?= ../crazyflie-firmware
OOT_CONFIG := $(CURDIR)/app-config

include $(CRAZYFLIE_BASE)/tools/make/oot.mk
"""
CONFIG = "CONFIG_APP_ENABLE=y\nCONFIG_APP_PRIORITY=1\nCONFIG_APP_STACKSIZE=350\nCONFIG_CONTROLLER_OOT=y\n"
OPTIMISED = "-O2 -fno-tree-pre -fno-fast-math"  # fewest instructions; NaN has to be seen


def crazyflie(program: Program, duration: float = 0.0) -> dict[str, str]:
    """Return the files of an out-of-tree controller by their names; the frame of the mission is turned to the firmware's.

    Args:
        program: In float32.
        duration: Not used; there is no self-test.

    Raises:
        InputError: The law commands body rates, the program is in float64, or its rate is no whole part of 1000 Hz.
    """
    pilot, rate = program.autopilot, 1 / program.autopilot.interval
    if pilot.law.interface == "rates":
        raise InputError(
            'the law of a Crazyflie must command a wrench (got the interface "rates"); take "wrench" in [controller]'
        )
    if program.real != REAL:
        raise InputError(f"the numbers of a Crazyflie must be {REAL} (got {program.real}); leave --real out")
    if abs(rate - round(rate)) > ROUNDING * rate or MAIN_RATE % round(rate):
        raise InputError(
            f"the rate of a Crazyflie's controller must be {MAIN_RATE} Hz over a whole number (got {rate:g} Hz); take 500 or 250"
        )
    turned = dataclasses.replace(program, frame=FRAME)
    code = sources(turned)
    objects = sorted(name.replace(".c", ".o") for name in code if name.endswith(".c"))
    has_rotors = isinstance(pilot.actuation, RotorSpeeds)
    values = placeholders(turned) | {
        "rate": str(round(rate)),
        "wrench": _wrench(turned) if has_rotors else "",
        "asked": "wrench(output.command, asked)" if has_rotors else ASKED,
        "answer": "what the commanded rotor speeds give when they are reached"
        if has_rotors
        else "the commanded wrench",
        "operations": str(turned.operations),
        "state_bytes": str(state_bytes(turned)),
        "table_bytes": str(table_bytes(turned)),
    }
    optimised = "".join(f"CFLAGS_{name} += {OPTIMISED}\n" for name in objects)
    return {
        **{f"src/{name}": text for name, text in code.items()},
        "src/crazyflie.c": filled(template("crazyflie.c"), values),
        "src/Kbuild": f"obj-y += crazyflie.o {' '.join(objects)}\n{optimised}",
        "Kbuild": "obj-y += src/\n",
        "Makefile": filled(MAKEFILE, values),
        "app-config": CONFIG,
        "README.md": filled(template("crazyflie.md"), values),
    }


def _wrench(program: Program) -> str:
    """Return the C function from commanded rotor speeds to the wrench that they give."""
    rotors = program.autopilot.vehicle.rotors
    assert rotors is not None
    speeds = ca.SX.sym("speeds", rotors.count)
    wrench = program.graphs.turned_wrench(rotors.wrench(rotors.thrusts(speeds)))
    function: Any = ca.Function("wrench", [speeds], [ca.densify(wrench)])
    code = c_file({"wrench": tape_of(function)}, "float", storage="static ")
    return "\n" + code.replace(
        "static void", "/* The force [N] and the torque [N m] of rotor speeds [rad/s]. */\nstatic void", 1
    )

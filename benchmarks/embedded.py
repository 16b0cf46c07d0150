"""Exported C on this machine: time of a call, agreement with the graph, and every built-in mission through every compiler's warnings.

A call begins with a copy of the state at a moment of the mission's flight, all moments in turn; the copy is in the time.  Agreement is
that of all numbers that come out, as a share of the size of each over the flight or of one SI unit: of float64 on 10,000 random states
near the flight, of float32 at its moments.  `make check` runs in the exported folders, with the warnings of their Makefile.
"""

from __future__ import annotations

import ctypes
import dataclasses
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import machine
import numpy as np

from gammastar.engine.compiler import compiler, library
from gammastar.export.load import Compiled, loaded, single_file, told_of
from gammastar.export.program import Program, c_name
from gammastar.export.sizes import state_bytes, table_bytes
from gammastar.export.targets import files_of
from gammastar.export.vectors import Moment, moments, sizes_of
from gammastar.mission import load, names

STATES, ROUNDS, REPEATS = 10_000, 20_000, 5
MOST_MICROSECONDS, MOST_ERROR = 2.0, 1e-12  # of float64
ONE_MILLIMETRE = 1e-3  # [m], of the upside-down start in float32
REPEATED = """
void repeat(const NAME_state *states, const NAME_measurement *measurements, int count, long rounds, NAME_output *output) {
    for (long k = 0; k < rounds; k++) {
        NAME_state now = states[k % count];
        NAME_step(&now, &measurements[k % count], output);
    }
}
"""


def microseconds(program: Program, recorded: list[Moment]) -> float:
    """Return the time of a call over the moments of a flight [us], the best of some runs."""
    source = single_file(program) + REPEATED.replace("NAME", program.name)
    made = library(compiler(), f"#pragma GCC visibility push(default)\n{source}")
    code = Compiled(program, made, loaded(program).structures)
    states = (code.structures.state * len(recorded))()
    measurements = (code.structures.measurement * len(recorded))()
    for k, moment in enumerate(recorded):
        states[k].memory[:], states[k].interval, states[k].is_started = moment.memory.tolist(), moment.interval, 1
        measurements[k] = code.measured(moment.measurement)
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        made.repeat(states, measurements, len(recorded), ctypes.c_long(ROUNDS), ctypes.byref(code.structures.output()))
        times.append(time.process_time() - begin)
    return 1e6 * min(times) / ROUNDS


def disagreement(program: Program, recorded: list[Moment], count: int) -> float:
    """Return the largest difference from the graph on moments, or on `count` random states near them, as a share of each number's size."""
    draw, sizes, code = np.random.default_rng(0), np.concatenate(sizes_of(recorded)), loaded(program)
    pilot, worst = code.start(recorded[0].measurement), 0.0
    for k in range(count or len(recorded)):
        moment = recorded[k if not count else int(draw.integers(len(recorded)))]
        memory, measurement = moment.memory.copy(), moment.measurement.copy()
        if count:
            memory[2:] *= 1 + 0.1 * draw.standard_normal(len(memory) - 2)
            measurement[:6] += draw.standard_normal(6)
            measurement[15:18] += draw.standard_normal(3)
        pilot.state.memory[:], pilot.state.interval = memory.tolist(), moment.interval
        output = pilot.step(measurement)
        found = np.concatenate([pilot.memory, output.command, *told_of(output).values()])
        wanted = np.concatenate(program.stepped(memory, measurement, moment.interval))
        worst = max(worst, float(np.max(np.abs(found - wanted) / np.maximum(sizes, np.abs(wanted)))))
    return worst


def checked(program: Program, duration: float) -> list[str]:
    """Return what went wrong in the exported folder of a program, compiler by compiler."""
    wrong = []
    for command in ("gcc", "clang"):
        if shutil.which(command) is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files_of(program, "c99", duration).items():
                Path(folder, name).write_text(text, encoding="utf-8")
            words = ["make", "check", f"CC={command}", "CFLAGS=-O1"]
            answer = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
            if answer.returncode:
                wrong.append(f"{program.name}, {program.real}, {command}: {answer.stdout[-300:]}{answer.stderr[-300:]}")
    return wrong


def main() -> int:
    """Print a row for every mission, and what must hold."""
    print(machine.describe())
    used = [command for command in ("gcc", "clang") if shutil.which(command)]
    print(f"warnings and self-tests with {' and '.join(used)}; times with {compiler().command[0]}\n")
    print(
        "mission        operations  state [bytes]  tables [bytes]  float64 [us]  float32 [us]  float64 differs  float32 differs"
    )
    wrong, slowest, largest = list[str](), 0.0, 0.0
    for name in names():
        mission = load(name)
        if mission.file.replacements:
            continue
        double = mission.program(c_name(name), "float64")
        single = dataclasses.replace(double, real="float32")
        recorded = moments(double, mission.file.flight.duration)
        times = [microseconds(each, recorded) for each in (double, single)]
        errors = [disagreement(double, recorded, STATES), disagreement(single, recorded, 0)]
        sizes = f"{single.operations:10}  {state_bytes(single):13}  {table_bytes(single):14}"
        print(f"{name:13}  {sizes}  {times[0]:12.2f}  {times[1]:12.2f}  {errors[0]:15.1e}  {errors[1]:15.1e}")
        slowest, largest = max(slowest, times[0]), max(largest, errors[0])
        for program in (double, single):
            wrong += checked(program, 0.2)
    flight = load("upside-down").with_values({"controller.interface": "c"}).fly().summary()
    settled = flight["distance_m"]["max_last_quarter"]
    print(f"\nupside-down in float32, flown as C: {1e3 * settled:.3g} mm from the path at most in the last quarter")
    print(*wrong, sep="\n")
    good = not wrong and slowest < MOST_MICROSECONDS and largest < MOST_ERROR and settled < ONE_MILLIMETRE
    print(
        "all hold" if good else "NOT all hold",
        f"(float64 {slowest:.2f} us a call at most, {largest:.1e} from the graph)",
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

"""The export of a whole mission in float32 on an emulated Cortex-M4F: instructions and stack of a call, flash, and how exact it is.

A flight in wind is recorded in Python, the measurements and what the autopilot remembers.  The exported C takes every one of these
control intervals, compiled for the microcontroller and run by qemu with 32 ns an instruction.  The largest and the mean number of
instructions of a call are told, the deepest stack, and how far the commands are from those of the float64 graph.  Flash is that of the
export with all it takes of the C library.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gammastar.export.program import Program
from gammastar.export.targets import c99
from gammastar.mission import load

HERE = Path(__file__).parent / "cortex_m4"
NAME = "race"
MACHINE = "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16"
OPTIMISED = "-std=c99 -O2 -fno-tree-pre -ffp-contract=fast -fno-math-errno"
FLAGS = f"{MACHINE} {OPTIMISED} -ffunction-sections -fdata-sections -Wdouble-promotion -Werror"
LINKED = "-nostartfiles -Wl,--gc-sections -Wl,-T"
EMULATOR = (
    "qemu-system-arm -M mps2-an386 -nographic -monitor none -semihosting-config enable=on,target=native -icount shift=5"
)
TICKS_TO_INSTRUCTIONS = 40 / 32
BUDGET = {"instructions": 5000, "stack_bytes": 1536, "flash_bytes": 32 * 1024}
TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
LONGEST = 100.0  # [s] that the emulator may take


def missing() -> str:
    """Return what lacks to run this, in one sentence; nothing where all is there."""
    absent = [tool for tool in TOOLS if shutil.which(tool) is None]
    if not absent and not Path(_said(["arm-none-eabi-gcc", "--print-file-name=rdimon.specs"]).strip()).is_absolute():
        absent = ["newlib for Arm"]
    return f"the Cortex-M4F was skipped: {' and '.join(absent)} must be there; run make arm-tools" if absent else ""


def measured(duration: float) -> dict[str, Any]:
    """Return the figures of a replay of a flight's first seconds."""
    mission = load(str(HERE / f"{NAME}.toml")).with_values({"flight.duration": duration})
    made, flight = mission.program(NAME, "float32"), mission.fly()
    rows = np.array([made.graphs.measurement(state[:18]) for state in flight.state[:-1]])
    memories, expected = _flown(made, rows)
    with tempfile.TemporaryDirectory(prefix="gammastar-") as folder:
        place = Path(folder)
        for name, text in c99(made, duration).items():
            (place / name).write_text(text, encoding="utf-8")
        arrays = _array("flight", rows[:, :18]) + _array("memories", memories)
        (place / "flight.h").write_text(f"#define CALLS {len(rows)}\n{arrays}", encoding="utf-8")
        built, emulated = _built(place), _emulated(place)
    start, calls = emulated[0], emulated[1:]
    found = np.array([[int(word, 16) for word in call[3:]] for call in calls], dtype=np.uint32).view(np.float32)
    sizes = np.abs(expected).max(axis=0)
    counts = [TICKS_TO_INSTRUCTIONS * int(call[0]) for call in calls]
    return {
        "mission": mission.title,
        "calls": len(calls),
        "operations": made.operations,
        "most_instructions": round(max(counts)),
        "mean_instructions": round(float(np.mean(counts))),
        "start_instructions": round(TICKS_TO_INSTRUCTIONS * int(start[0])),
        "stack_bytes": max(int(call[1]) for call in calls),
        "start_stack_bytes": int(start[1]),
        **built,
        "waiting_calls": sum(int(call[2], 16) >> 3 & 1 for call in calls),
        "refused_calls": sum(int(call[2], 16) & 7 != 0 for call in calls),
        "largest_relative_error": float((np.abs(found - expected) / sizes).max()),
        "budget": BUDGET,
    }


def _flown(made: Program, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return memories (n, m) before, and commands, inputs and parameters (n, 9) by the graph in float64, for measurements (n, 22)."""
    memories, results = [made.started(rows[0])], []
    for k, row in enumerate(rows):
        memory, command, told = made.stepped(memories[-1], row, k)
        memories.append(memory)
        results.append([*command, *told[:4], told[-1]])
    return np.array(memories[:-1]), np.array(results)


def _array(name: str, rows: np.ndarray) -> str:
    """Return rows of numbers as an array in C."""
    lines = ",\n".join(f"{{{', '.join(f'{float(x)!r}f' for x in row)}}}" for row in rows)
    return f"static const float {name}[CALLS][{rows.shape[1]}] = {{\n{lines}\n}};\n"


def _built(place: Path) -> dict[str, Any]:
    """Compile and link all programs, and return what the export takes of the flash and the names it may not take."""
    exported = [NAME, f"{NAME}_tables"]
    for name in exported:
        _compile(place, place / f"{name}.c", name)
    _compile(place, HERE / "startup.c", "startup", "-DREPLAY")
    _compile(place, HERE / "replay.c", "replay")
    _link(place, [*exported, "startup", "replay"], "replay", "--specs=rdimon.specs")
    _compile(place, HERE / "startup.c", "bare")
    _compile(place, HERE / "footprint.c", "with")
    _compile(place, HERE / "footprint.c", "without", "-DEMPTY")
    for name in ("with", "without"):
        _link(place, [*exported, "bare", name], name, "--specs=nosys.specs")
    symbols = _said(["arm-none-eabi-nm", str(place / "with.elf")])
    sizes = [_size(place / f"{name}.elf") for name in ("with", "without")]
    doubles = sorted(set(re.findall(r"__aeabi_\w*d\w*", symbols)))
    return {"flash_bytes": sizes[0] - sizes[1], "double_functions": doubles}


def _emulated(place: Path) -> list[list[str]]:
    """Return the words of every line that the replay prints."""
    lines = _said([*EMULATOR.split(), "-kernel", str(place / "replay.elf")]).splitlines()
    return [line.split() for line in lines if line.strip()]


def _compile(place: Path, source: Path, name: str, *more: str) -> None:
    _said(["arm-none-eabi-gcc", *FLAGS.split(), *more, f"-I{place}", "-c", str(source), "-o", str(place / f"{name}.o")])


def _link(place: Path, parts: Sequence[str], name: str, specs: str) -> None:
    words = [*MACHINE.split(), specs, *LINKED.split()]
    words[-1] += f",{HERE / 'memory.ld'}"
    objects = [str(place / f"{part}.o") for part in parts]
    _said(["arm-none-eabi-gcc", *words, *objects, "-lm", "-o", str(place / f"{name}.elf")])


def _size(file: Path) -> int:
    """Return the bytes of a program that lie in flash: text and the first values of data."""
    text, data, *_ = _said(["arm-none-eabi-size", str(file)]).splitlines()[1].split()
    return int(text) + int(data)


def _said(words: list[str]) -> str:
    """Return what a program prints, or end with what it complains about."""
    answer = subprocess.run(
        words, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=LONGEST, check=False
    )
    if answer.returncode != 0:
        raise SystemExit(f"{words[0]} must succeed (got exit code {answer.returncode}): {answer.stderr[-2000:]}")
    return answer.stdout


def main() -> None:
    """Print the figures, and end with an error where a budget is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=8.0, help="seconds of the flight that are replayed")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    if reason := missing():
        print(json.dumps({"skipped": reason}) if options.json else reason)
        return
    figures = measured(options.duration)
    if options.json:
        print(json.dumps(figures, indent=2))
    else:
        print(f"{figures['mission']}: {figures['calls']} calls, {figures['operations']} operations in the graph")
        for name, words in (("most_instructions", "a call, at most"), ("mean_instructions", "a call, in the mean")):
            print(f"{figures[name]:>8} instructions {words}")
        print(f"{figures['start_instructions']:>8} instructions of the start, once")
        print(f"{figures['stack_bytes']:>8} bytes of stack, {figures['start_stack_bytes']} of the start")
        print(f"{figures['flash_bytes']:>8} bytes of flash, with what is taken of the C library")
        print(f"{figures['largest_relative_error']:>8.1e} largest error, of the largest such number of the flight")
    over = [name for name, most in BUDGET.items() if figures[name if name in figures else f"most_{name}"] > most]
    if over or figures["double_functions"] or figures["refused_calls"]:
        raise SystemExit(
            f"the budget must be kept (got {', '.join([*over, *figures['double_functions']])} beyond it); see above"
        )


if __name__ == "__main__":
    main()

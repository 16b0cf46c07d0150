"""Closed-loop steps a second on one core: CasADi's machine, compiled C with one lane, and with as many lanes as a register holds.

The paper's upside-down recovery with continuous feedback, rkmk4 at 1 ms.  CasADi's machine also computes what a record keeps of every step;
without that, as the compiled steps run, it stands on a line of its own.  Times are those of the processor, the best of several runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import machine
import numpy as np

import gammastar as gs
from gammastar import engine
from gammastar.engine.batch import batch
from gammastar.engine.compiler import compiler
from gammastar.engine.native import Native
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.mission import load

STEP = 1e-3  # [s]
FLIGHTS, STEPS = 512, 1000
REPEATS = 5


def fastest(steps: int, run: Callable[[], object]) -> float:
    """Return the steps a second of the best of several runs."""
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        run()
        times.append(time.process_time() - begin)
    return steps / min(times)


def main() -> None:
    """Print one row a way to run."""
    found = compiler()
    version = next(line.split('"')[1] for line in found.macros.splitlines() if line.startswith("#define __VERSION__"))
    print(machine.describe())
    print(f"{' '.join(found.command)} {version}, {found.lanes} lanes")
    mission = load("upside-down")
    loop, first, _ = prepared(mission.law(), mission.start(), gs.Speed(1.0), 0.0, Conditions(1.0, STEP))
    step = loop.step()
    starts = np.repeat(first[:, None], FLIGHTS, axis=1)
    starts[:3] += 0.1 * np.random.default_rng(0).normal(size=(3, FLIGHTS))
    expected = engine.run(step, starts[:, :64], STEPS, machine="casadi")
    speeds = {
        "casadi": fastest(20 * STEPS, lambda: engine.trace(step, first, 20 * STEPS, machine="casadi")),
        "casadi, bare": fastest(20 * STEPS, lambda: engine.run(step, first[:, None], 20 * STEPS, machine="casadi")),
    }
    flights = batch(step, starts, STEPS, 0, 0, None, None)
    errors, operations = {}, engine.tape_of(step.core, (0,)).operations
    for name, lanes in (("native, one lane", 1), ("native, lanes", None)):
        begin = time.perf_counter()
        made = Native(step, lanes)
        print(f"{name}: ready after {time.perf_counter() - begin:.2f} s")
        ended = made.fly(flights, 1, lambda done: None)[:, : expected.shape[1]]
        errors[name] = np.abs((ended - expected) / np.maximum(np.abs(expected), 1e-9)).max()
        speeds[name] = fastest(FLIGHTS * STEPS, lambda made=made: made.fly(flights, 1, lambda done: None))
    print(
        f"{'':<20}{'steps/s/core':>14}{'operations/s':>14}{'x casadi':>10}{'x bare':>8}{'largest relative error':>24}"
    )
    for name, speed in speeds.items():
        total = engine.tape_of(step.core).operations if name == "casadi" else operations
        ratios = speed / speeds["casadi"], speed / speeds["casadi, bare"]
        error = f"{errors[name]:.1e}" if name in errors else "-"
        print(f"{name:<20}{speed:>14.3g}{speed * total:>14.3g}{ratios[0]:>10.1f}{ratios[1]:>8.1f}{error:>24}")
    print(f"lanes over one lane: {speeds['native, lanes'] / speeds['native, one lane']:.2f}")


if __name__ == "__main__":
    main()

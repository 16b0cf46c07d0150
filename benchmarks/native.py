"""Closed-loop steps a second of every machine, on one core and on two, and how far they agree on 1,000 random flights of a second.

Two loops: the paper's circle with continuous feedback, rkmk4 at 1 ms; and a Hummingbird with rotors, the Path-Flyer's sensors and a Kalman
filter at 500 Hz, around the law for any curve.  Times are the processor's, the best of several runs; of two workers and of readiness they
are the clock's.  The peak is that of independent multiplications and additions in registers, rounded one by one as the loops' are.  Where
crazyflow is installed, its steps stand beside: float32 in JAX, Runge-Kutta of order four, its attitude controller.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import machine
import numpy as np

import gammastar as gs
from gammastar import engine, so3
from gammastar.engine import c_source, native
from gammastar.engine.batch import Batch, batch
from gammastar.engine.compiler import Compiler, compiler, library
from gammastar.engine.native import Native
from gammastar.flight import PATH_FLYER
from gammastar.flight.conditions import Conditions
from gammastar.flight.fly import prepared
from gammastar.mission import load

FLIGHTS, FEW = 1000, 512
SENSORS = (0.0224, 0.0224, 0.001, 0.01)  # deviations that the filter believes in: the Path-Flyer's largest
REPEATS = 5
PEAK = """
typedef double real __attribute__((vector_size(8 * LANES)));
__attribute__((visibility("default"))) double peak(long long rounds) {
    real x[12], sum = {0};
    for (int i = 0; i < 12; i++) x[i] = sum + (1.0 + i);
    const real a = sum + 1.0000001, b = sum + 1e-9;
    for (long long k = 0; k < rounds; k++) {
#pragma GCC unroll 12
        for (int i = 0; i < 12; i++) x[i] = x[i] * a + b;
    }
    for (int i = 0; i < 12; i++) sum += x[i];
    return sum[0];
}
"""


@dataclass(frozen=True)
class Loop:
    name: str
    step: engine.Step
    starts: np.ndarray  # (n, FLIGHTS)
    interval: float  # [s]
    wanted: float  # times as fast as CasADi's machine


def looped(name: str, law: gs.Law, center: tuple[float, float, float], conditions: Conditions, wanted: float) -> Loop:
    """Return the closed loop of a law with starts within 0.3 m of a point, tilted by up to 20 degrees."""
    draw = np.random.default_rng(5)
    first = gs.State(center)
    loop, _, _ = prepared(law, first, gs.Speed(1.0), 0.0, conditions)
    starts = []
    for flight in range(FLIGHTS):
        attitude = so3.roll(draw.uniform(-20, 20)) @ so3.pitch(draw.uniform(-20, 20))
        start = gs.State(np.asarray(center) + draw.uniform(-0.3, 0.3, 3), attitude=attitude)
        starts.append(loop.start(*law.start_vector(start), seed=0, flight=flight))
    return Loop(name, loop.step(), np.column_stack(starts), loop.interval, wanted)


def loops() -> list[Loop]:
    """Return the two loops."""
    hummingbird = load("quadrotor").law().vehicle
    filtered = gs.design(
        hummingbird, gs.paths.circle(), -3, estimator=gs.KalmanFilter(*SENSORS), approach=gs.Approach()
    )
    sensed = Conditions(1.0, 2e-3, rate=500.0, sensors=PATH_FLYER)
    return [
        looped("the paper's circle", load("upside-down").law(), (1.3, 0.0, 9.8), Conditions(1.0, 1e-3), 100),
        looped("rotors, noise and a filter", filtered, (1.3, 0.0, 0.0), sensed, 60),
    ]


def seconds(run: Callable[[], object], clock: Callable[[], float] = time.process_time, repeats: int = REPEATS) -> float:
    """Return the time of the best of several runs."""
    times = []
    for _ in range(repeats):
        begin = clock()
        run()
        times.append(clock() - begin)
    return min(times)


def flown(made: Native, flights: Batch, workers: int = 1) -> np.ndarray:
    """Return the ends of flights."""
    return made.fly(flights, workers, lambda done: None)


def peak(maker: Compiler, lanes: int) -> float:
    """Return how many sums and products a second one core makes at most."""
    made = library(maker, f"#define LANES {lanes}\n{PEAK}").peak
    made.argtypes, made.restype = [ctypes.c_longlong], ctypes.c_double
    rounds = 10_000_000
    return 24 * lanes * rounds / seconds(lambda: made(rounds))


def first_and_later(step: engine.Step) -> tuple[float, float]:
    """Return how long a step takes to be ready [s] where nothing is kept, and where an earlier process has compiled it."""
    with tempfile.TemporaryDirectory() as place, _environment("XDG_CACHE_HOME", place):
        times = []
        for _ in range(2):
            for kept in (library, c_source._function, native._core):
                kept.cache_clear()  # as a new process begins
            begin = time.perf_counter()
            Native(step)
            times.append(time.perf_counter() - begin)
        library.cache_clear()
        return times[0], times[1]


@contextlib.contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    yield
    os.environ.pop(name)
    if before is not None:
        os.environ[name] = before


def shown(loop: Loop, top: float) -> None:
    """Print what one loop takes on every machine."""
    step, count = loop.step, round(1 / loop.interval)
    every = batch(step, loop.starts, count, 0, 0, None, None)
    few = batch(step, loop.starts[:, :FEW], count, 0, 0, None, None)
    operations = engine.tape_of(step.core, (0,)).operations
    print(f"\n{loop.name}: {operations} operations a step, {len(step.channels)} channels of noise")
    print("ready after {:.2f} s, later {:.2f} s".format(*first_and_later(step)))

    expected = engine.run(step, loop.starts, count, machine="casadi")
    plain, lanes = Native(step, lanes=1), Native(step)
    few_flown = few.flights * count
    speeds = {
        "casadi, a record": 4000 / seconds(lambda: engine.trace(step, loop.starts[:, 0], 4000, machine="casadi")),
        "casadi": 4 * count / seconds(lambda: engine.run(step, loop.starts[:, :4], count, machine="casadi")),
        "python": FLIGHTS * 20 / seconds(lambda: engine.run(step, loop.starts, 20, machine="python"), repeats=2),
        "native, one lane": few_flown / seconds(lambda: flown(plain, few)),
        "native": few_flown / seconds(lambda: flown(lanes, few)),
    }
    ends = {
        "python": engine.run(step, loop.starts, count, machine="python"),
        "native, one lane": flown(plain, every),
        "native": flown(lanes, every, workers=2),
    }
    scale = np.maximum(1, np.abs(expected))
    print(f"{np.isnan(expected).any(axis=0).sum()} of {FLIGHTS} flights meet a singularity")
    print(f"{'':<20}{'steps/s/core':>14}{'operations/s':>14}{'of peak':>9}{'x casadi':>10}{'largest difference':>20}")
    for name, speed in speeds.items():
        rate = speed * operations
        difference = f"{np.nanmax(np.abs(ends[name] - expected) / scale):.1e}" if name in ends else "-"
        assert name not in ends or np.array_equal(np.isnan(ends[name]), np.isnan(expected))
        print(
            f"{name:<20}{speed:>14.3g}{rate:>14.3g}{rate / top:>9.0%}{speed / speeds['casadi']:>10.1f}{difference:>20}"
        )
    print(
        f"native over casadi: {speeds['native'] / speeds['casadi']:.0f} (wanted: {loop.wanted:g}); "
        f"lanes over one lane: {speeds['native'] / speeds['native, one lane']:.1f} (wanted: 2.5)"
    )
    clocks, spent = (
        [seconds(lambda n=n: flown(lanes, every, n), clock) for n in (1, 2)]
        for clock in (time.perf_counter, time.process_time)
    )
    print(
        f"two workers over one: {clocks[0] / clocks[1]:.2f} by the clock (wanted: 1.8), "
        f"{2 * spent[0] / spent[1]:.2f} by what they spend, as on cores that nobody else uses"
    )


def grown(loop: Loop) -> None:
    """Print how time grows with flights and with steps, and memory with steps."""
    made, times = Native(loop.step), {}
    for name, flights, count in (("once", 128, 500), ("flights x 4", 512, 500), ("steps x 4", 128, 2000)):
        given = batch(loop.step, loop.starts[:, :flights], count, 0, 0, None, None)
        times[name] = seconds(lambda given=given: flown(made, given))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    flown(made, batch(loop.step, loop.starts[:, :64], 100_000, 0, 0, None, None))
    more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    ratios = ", ".join(f"{name}: {times[name] / times['once']:.2f} times as long" for name in list(times)[1:])
    print(f"\n{ratios}; 50 times the steps: {more / 1024:.1f} MB more at the highest")


def crazyflow() -> None:
    """Print the steps a second of crazyflow, where it is installed."""
    try:
        import jax
        from crazyflow.sim import Sim
    except ImportError:
        print("\ncrazyflow is not installed")
        return
    sim = Sim(n_worlds=FEW, control="attitude", integrator="rk4", freq=500)
    sim.reset()
    sim.attitude_control(np.tile([0.0, 0.0, 0.0, 0.35], (FEW, 1, 1)))

    def stepped() -> None:
        sim.step(500)
        jax.block_until_ready(sim.data)

    stepped()
    print(f"\ncrazyflow, {FEW} worlds: {FEW * 500 / seconds(stepped):.3g} steps/s/core")


def main() -> None:
    """Print everything."""
    maker = compiler()
    version = next(line.split('"')[1] for line in maker.macros.splitlines() if line.startswith("#define __VERSION__"))
    top = peak(maker, maker.lanes)
    print(machine.describe())
    print(f"{' '.join(maker.command)} {version}, {maker.lanes} lanes; peak of one core: {top:.3g} operations a second")
    both = loops()
    for loop in both:
        shown(loop, top)
    grown(both[0])
    crazyflow()


if __name__ == "__main__":
    main()

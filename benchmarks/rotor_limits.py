"""Random attitudes at rest around a circle, flown through rotors with limits and lag: how many settle, and why the others do not.

Starts are uniform in a ball of 5 m about a random point of a circle of 1 m; attitudes uniform on SO(3).  The vehicle has inertia and
rotors of the Hummingbird (lag 5 ms), with the speed limit of the rotors set for each thrust-to-weight ratio; sampled at 500 Hz.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from concurrent.futures import ProcessPoolExecutor

import machine
import numpy as np
from from_anywhere import ball

import gammastar as gs

RATIOS = (2.0, 4.0, 10.0)
POLES = -4.0
SETTLED = 1e-3  # [m], the most in the last quarter


def vehicle(ratio: float) -> gs.Vehicle:
    """Return the Hummingbird in calm air with rotors that give so many times its weight."""
    believed = gs.vehicles.load("hummingbird")
    fastest = np.sqrt(ratio * believed.weight / np.sum(np.asarray(believed.rotors.thrust_coefficient)))
    return dataclasses.replace(believed, forces=(), rotors=dataclasses.replace(believed.rotors, fastest=float(fastest)))


def fly(ratio: float, seed: int) -> tuple[str, float, float]:
    """Fly one start and return what happened, the largest distance beyond that at the start [m], and the settling time [s]."""
    generator, path = np.random.default_rng(seed), gs.paths.circle(1.0)
    point = path.points(np.array([generator.uniform(0, 2 * np.pi)]))[0]
    start = gs.State(point + ball(generator, 5.0), attitude=gs.so3.random(generator))
    law = gs.design(vehicle(ratio), path, POLES, approach=gs.Approach(speed=2.0))
    flight = gs.fly(law, start, speed=1.0, duration=9.0, rate=500.0, step=2e-3)
    beyond = float(flight.distance.max() - flight.distance[0])
    if not flight.completed:
        return f"{flight.status.name.lower()} at {flight.status_time:.2f} s", beyond, np.nan
    outside = np.flatnonzero(flight.distance > SETTLED)
    settled = float(flight.time[outside[-1]]) if outside.size else 0.0
    worst = flight.distance[flight.time > 0.75 * flight.time[-1]].max()
    return "settled" if worst <= SETTLED else f"{worst:.2e} m off in the last quarter", beyond, settled


def main() -> None:
    """Print one row a ratio, then every failure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=2000, help="random starts a ratio")
    parser.add_argument("--workers", type=int, default=None)
    options = parser.parse_args()
    print(machine.describe())
    print(
        f"{'thrust to weight':<18}{'starts':>8}{'settled':>9}{'share':>9}{'settling s':>20}{'beyond the start m':>22}{'wall s':>9}"
    )
    print(f"{'':<44}{'median':>10}{'largest':>10}{'95 %':>11}{'largest':>11}")
    failures = []
    with ProcessPoolExecutor(options.workers) as pool:
        for ratio in RATIOS:
            begin = time.perf_counter()
            results = list(pool.map(fly, [ratio] * options.starts, range(options.starts), chunksize=5))
            settled = [result for result in results if result[0] == "settled"]
            failures += [(ratio, seed, result[0]) for seed, result in enumerate(results) if result[0] != "settled"]
            beyond, times = np.array([r[1] for r in results]), np.array([r[2] for r in settled])
            print(
                f"{ratio:<18g}{options.starts:>8}{len(settled):>9}{len(settled) / options.starts:>9.2%}{np.median(times):>9.2f}"
                f"{times.max():>10.2f}{np.percentile(beyond, 95):>11.2f}{beyond.max():>11.2f}{time.perf_counter() - begin:>9.0f}",
                flush=True,
            )
    for ratio, seed, outcome in failures:
        print(f"failed: thrust to weight {ratio:g}, seed {seed}: {outcome}")


if __name__ == "__main__":
    main()

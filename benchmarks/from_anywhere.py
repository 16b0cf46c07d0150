"""Random starts around several paths, some of them on the focal set: how many settle, and why the others do not.

Positions are uniform in a ball of three path sizes, one in five within 1 % of the focal set where the path has a simple one; attitudes
uniform on SO(3), body rates uniform to 5 rad/s and velocities to 3 m/s; ideal actuators.
"""

from __future__ import annotations

import argparse
import collections
import functools
import time
from concurrent.futures import ProcessPoolExecutor

import machine
import numpy as np

import gammastar as gs

POLES = (-3.4, -3.8, -4.2, -4.6)
GATES = np.array([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1), (-2, 4, -2)], dtype=float)
PATHS = {
    "circle": lambda: gs.paths.circle(1.0),
    "ellipse": lambda: gs.paths.ellipse((2.0, 0.7)),
    "nonplanar circle": gs.paths.nonplanar_circle,
    "helix": lambda: gs.paths.helix(1.0, 1.5),
    "trefoil": gs.paths.trefoil,
    "waypoints": lambda: gs.waypoints(GATES, closed=True),
}
SETTLED = 1e-3  # [m]


def ball(generator: np.random.Generator, radius: float) -> np.ndarray:
    """Return a point drawn uniformly from a ball."""
    direction = generator.standard_normal(3)
    return radius * generator.uniform() ** (1 / 3) * direction / np.linalg.norm(direction)


@functools.cache
def path_of(name: str) -> gs.Curve:
    """Return a path, the same object every time, so that its graph is built once in each process."""
    return PATHS[name]()


def fly(name: str, seed: int) -> tuple[str, int, str]:
    """Fly one start and return (path, seed, 'settled' or what happened instead)."""
    path = path_of(name)
    generator = np.random.default_rng((seed, len(name)))
    sample = path.points(np.linspace(*path.domain, 200))
    middle = sample.mean(axis=0)
    size = float(np.linalg.norm(sample - middle, axis=1).max()) if path.period else 2.0
    position = middle + ball(generator, 3 * size)
    if seed % 5 == 0:  # on the focal set: at the centre of curvature of a point of the path, within 1 %
        jet = path.jets(np.array([generator.uniform(*path.domain)]), 2)[0]
        speed = np.linalg.norm(jet[1])
        curvature = (jet[2] - jet[1] * (jet[1] @ jet[2]) / speed**2) / speed**2
        if np.linalg.norm(curvature) > 1e-3:
            radius = 1 / np.linalg.norm(curvature)
            position = jet[0] + curvature * radius**2 * (1 + generator.uniform(-0.01, 0.01))
    start = gs.State(
        position=position,
        velocity=ball(generator, 3.0),
        attitude=gs.so3.random(generator),
        angular_velocity=ball(generator, 5.0),
    )
    vehicle = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
    law = gs.design(vehicle, path, POLES, approach=gs.Approach(speed=2.0))
    flight = gs.fly(law, start, speed=0.5, duration=10 + 2 * size, step=2e-3)
    if not flight.completed:
        return name, seed, f"{flight.status.name.lower()} at {flight.status_time:.2f} s"
    worst = flight.distance[flight.time > 0.75 * flight.time[-1]].max()
    return name, seed, "settled" if worst <= SETTLED else f"{worst:.2e} m off in the last quarter"


def main() -> None:
    """Print one row a path, then every failure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=500, help="random starts a path")
    parser.add_argument("--paths", nargs="*", default=list(PATHS), choices=list(PATHS))
    options = parser.parse_args()
    print(machine.describe())
    print(f"{'path':<18}{'starts':>8}{'settled':>9}{'share':>9}{'wall s':>9}")
    failures = []
    with ProcessPoolExecutor() as pool:
        for name in options.paths:
            begin = time.perf_counter()
            results = list(pool.map(fly, [name] * options.starts, range(options.starts), chunksize=5))
            counts = collections.Counter(outcome == "settled" for _, _, outcome in results)
            failures += [result for result in results if result[2] != "settled"]
            wall = time.perf_counter() - begin
            print(
                f"{name:<18}{options.starts:>8}{counts[True]:>9}{counts[True] / options.starts:>9.1%}{wall:>9.0f}",
                flush=True,
            )
    for name, seed, outcome in failures:
        print(f"failed: {name}, seed {seed}: {outcome}")


if __name__ == "__main__":
    main()

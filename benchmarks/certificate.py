"""How long a full certificate takes, beside its accuracy: paths of the catalogue, formulas, and waypoints by the hundred.

Times are the least of several calls, which other work on the machine disturbs least; making the path is timed beside it.  The length
stands for the accuracy: its error is against a quadrature of its own, refined until halving changes nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import machine
import numpy as np

import gammastar as gs
from gammastar.certificate import Limits, certify
from gammastar.path import Path

REPEATS = 5
ALLOWED = 1.0  # [s] for 100 waypoints
VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3))
LIMITS = Limits(thrust=2.5 * VEHICLE.weight, tilt_rate=8.0, torque=0.5)


def course(count: int) -> gs.path.ParametricPath:
    """Return a closed path through points scattered about a large closed curve."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    points = np.column_stack([20 * np.cos(angle), 14 * np.sin(angle), 3 * np.sin(3 * angle)]) * count / 100
    return gs.waypoints(points + np.random.default_rng(1).normal(scale=0.3, size=points.shape), closed=True)


PATHS: dict[str, Callable[[], Path]] = {
    "circle": lambda: gs.paths.circle(radius=2.0),
    "implicit circle": lambda: gs.paths.circle(radius=2.0, kind="implicit"),
    "helix": lambda: gs.paths.helix(radius=2.0, pitch=1.0),
    "torus knot": lambda: gs.paths.torus_knot(),
    "10 waypoints": lambda: course(10),
    "100 waypoints": lambda: course(100),
    "300 waypoints": lambda: course(300),
}


def main() -> None:
    """Print one line a path, and the one that is asked for."""
    print(machine.describe())
    print("path                made [s]  certified [s]   length [m]  relative error  flyable at 1 m/s  reasons")
    seconds = {}
    for name, make in PATHS.items():
        made, certified = [], []
        for _ in range(REPEATS):
            begin = time.perf_counter()
            path = make()
            middle = time.perf_counter()
            found = certify(VEHICLE, path, 1.0, progress="metres", limits=LIMITS)
            made.append(middle - begin)
            certified.append(time.perf_counter() - middle)
        seconds[name] = min(certified)
        error = abs(found.length / path.length() - 1)
        print(
            f"{name:18s}  {min(made):8.3f}  {seconds[name]:13.3f}  {found.length:11.4f}  {error:14.1e}  "
            f"{found.flyable!s:>16s}  {len(found.reasons)}"
        )
    verdict = "within" if seconds["100 waypoints"] <= ALLOWED else "more than"
    print(
        f"a full certificate of a 100-waypoint path takes {seconds['100 waypoints']:.2f} s, {verdict} the {ALLOWED:g} s asked for"
    )


if __name__ == "__main__":
    main()

"""Paths of every form, each flown at speeds that its certificate allows: how near, how exact, how steady.

From 0.3 m beside the path with continuous feedback at 80 % of the largest certified speed (at most 2 m/s): distance once settled, and the
largest error against the closed form; kicked off the path by 0.5 m/s and 0.5 rad/s, the distance 15 s later.  With the input held at
400 Hz for the middle of the interval, poles near -3, at a third of the certified speed (at most 1 m/s): distance after 15 s.  From rest on
the path, no kick: the largest error across it within 60 s.  A path that ends is flown to its end and held there.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import machine
import numpy as np

import gammastar as gs
from gammastar import engine
from gammastar.certificate import Limits, certify
from gammastar.path.formula import curve_from_formula, implicit_from_formula
from gammastar.path.placement import placed
from gammastar.path.table import read_points

VEHICLE = gs.Vehicle(mass=0.5, inertia=(3.65e-3, 3.68e-3, 7.03e-3), gravity=9.81)
LIMITS = Limits(thrust=2 * VEHICLE.weight, tilt_rate=6.0, torque=0.3)
POLES = (-2.7, -2.9, -3.1, -3.3)
GATES = np.array([(0, 0, -1), (4, 1, -2), (6, 5, -1.5), (2, 7, -1), (-2, 4, -2)], dtype=float)
ANGLES = np.linspace(0, 6 * np.pi, 19)
AWAY = np.column_stack([1.5 * ANGLES, 2 * np.sin(ANGLES), -1 - 0.5 * np.cos(ANGLES)])
ALLOWED = {"settled": 1e-3, "oracle": 1e-6, "kicked": 1e-3, "sampled": 1e-5, "steady": 1e-8}  # [m]


def from_file() -> gs.path.Path:
    """Return a closed path through the points of a file."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "points.csv"
        np.savetxt(file, GATES * [1.2, 0.8, 1.0], delimiter=",", header="x,y,z", comments="")
        return gs.waypoints(read_points(file), closed=True)


def tilted(path: gs.Curve) -> gs.Curve:
    """Return a curve turned, enlarged and moved."""
    return placed(path, (1, -2, -3), gs.so3.roll(40) @ gs.so3.yaw(25), 1.5)


PATHS: dict[str, tuple[str, Callable[[], gs.path.Path]]] = {
    "circle": ("catalogue", lambda: gs.paths.circle(1.5)),
    "implicit circle": ("s1, s2, pi", lambda: gs.paths.circle(1.5, kind="implicit")),
    "ellipse": ("catalogue", lambda: gs.paths.ellipse((2.0, 1.0))),
    "loop": ("catalogue", gs.paths.loop),
    "line": ("catalogue", gs.paths.line),
    "helix": ("catalogue", lambda: gs.paths.helix(1.0, 1.5)),
    "sine": ("catalogue", gs.paths.sine),
    "lemniscate": ("catalogue", gs.paths.lemniscate),
    "lissajous": ("catalogue", gs.paths.lissajous),
    "trefoil": ("catalogue", gs.paths.trefoil),
    "torus knot": ("catalogue", gs.paths.torus_knot),
    "nonplanar circle": ("catalogue", gs.paths.nonplanar_circle),
    "viviani": ("catalogue", gs.paths.viviani),
    "spiral": ("catalogue", gs.paths.spiral),
    "polynomial": ("catalogue", lambda: gs.paths.polynomial(((0, 1), (0, 0, 0.05), (-1,)))),
    "formula": (
        "text in lambda",
        lambda: curve_from_formula("2*cos(t)", "2*sin(t)", "-1 + 0.3*cos(2*t)", "t", "2*pi"),
    ),
    "implicit formula": (
        "text in x, y, z",
        lambda: implicit_from_formula("sqrt(x**2 + y**2) - 2", "z - 0.2*x", "atan2(y, x)", (2, 0, 0.4), "2*pi"),
    ),
    "callable": ("Python", lambda: gs.Curve(lambda t: (t, 0.5 * t**2 / (1 + 0.1 * t**2), -0.2 * t))),
    "closed waypoints": ("waypoints", lambda: gs.waypoints(GATES, closed=True)),
    "open waypoints": ("waypoints", lambda: gs.waypoints(AWAY)),
    "file": ("CSV", from_file),
    "tilted trefoil": ("placed", lambda: tilted(gs.paths.trefoil())),
    "trefoil by length": ("in metres", lambda: gs.by_length(gs.paths.trefoil())),
}


@dataclass(frozen=True)
class Row:
    """What was measured on a path; distances and errors in metres."""

    name: str
    largest: float  # [m/s] certified
    figures: dict[str, float]

    @property
    def failures(self) -> list[str]:
        """Return the figures that are not allowed."""
        return [key for key, value in self.figures.items() if not value <= ALLOWED[key]]


def measured(name: str) -> Row:
    """Certify a path and fly it."""
    path = PATHS[name][1]()
    certificate = certify(VEHICLE, path, 0.1, limits=LIMITS)
    assert certificate.largest_speed is not None, certificate.reasons
    pace = certificate.metres_per_progress[1]
    first = path.points(np.array([path.domain[0]]))[0]
    law = gs.design(VEHICLE, path, POLES)
    speed, slow = min(0.8 * certificate.largest_speed, 2 / pace), min(certificate.largest_speed / 3, 1 / pace)
    beside = gs.State(first + np.array([0.2, -0.2, 0.1]))
    flight = gs.fly(law, beside, speed=speed, duration=25)
    summary = flight.summary()
    end = flight.state[-1].copy()
    generator = np.random.default_rng(0)
    for part, size in ((slice(3, 6), 0.5), (slice(15, 18), 0.5)):
        direction = generator.standard_normal(3)
        end[part] += size * direction / np.linalg.norm(direction)
    kicked = gs.fly(law, gs.State.from_vector(end), speed=speed, duration=15)
    sampled = gs.fly(law, beside, speed=slow, duration=25, feedback="middle", rate=400.0)
    steady = gs.fly(law, gs.State(first), speed=slow, duration=60)
    figures = {
        "settled": summary["distance_m"]["max_after_settling"] if summary["settled"] else np.inf,
        "oracle": summary["oracle"]["max_position_error_m"] if flight.completed else np.inf,
        "kicked": kicked.distance[-1] if kicked.completed else np.inf,
        "sampled": sampled.distance[sampled.time >= 15].max() if sampled.completed else np.inf,
        "steady": np.linalg.norm(steady.transverse_state[:, :, 0], axis=1).max() if steady.completed else np.inf,
    }
    return Row(name, certificate.largest_speed * pace, {key: float(value) for key, value in figures.items()})


def reuse(count: int) -> tuple[int, int]:
    """Return how many graphs the first random waypoint path needs, and how many all others after it."""
    generator, counts = np.random.default_rng(0), [engine.compilations()]
    for _ in range(count):
        path = gs.waypoints(3 * generator.standard_normal((6, 3)), closed=True)
        gs.fly(gs.design(VEHICLE, path, POLES), gs.State(path.points(np.zeros(1))[0]), speed=0.2, duration=0.1)
        counts.append(engine.compilations())
    return counts[1] - counts[0], counts[-1] - counts[1]


def main() -> None:
    """Print one row a path, and whether every figure is allowed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paths", nargs="*", default=list(PATHS), choices=list(PATHS))
    names = parser.parse_args().paths
    print(machine.describe())
    print(f"{'path':<18}{'form':<17}{'certified':>10}" + "".join(f"{key + ' m':>12}" for key in ALLOWED))
    failures = []
    with ProcessPoolExecutor() as pool:
        for row in pool.map(measured, names):
            values = "".join(f"{row.figures[key]:>12.1e}" for key in ALLOWED)
            print(f"{row.name:<18}{PATHS[row.name][0]:<17}{row.largest:>6.2f} m/s{values}", flush=True)
            failures += [f"{row.name}: {key} {row.figures[key]:.2e} m" for key in row.failures]
    print(f"{'allowed':<45}" + "".join(f"{value:>12.0e}" for value in ALLOWED.values()))
    first, others = reuse(10)
    print(f"compilations: {first} for a first path through waypoints, {others} for nine others")
    print(f"{len(names)} paths, {len(failures)} figures not allowed" + "".join(f"\n{failure}" for failure in failures))


if __name__ == "__main__":
    main()

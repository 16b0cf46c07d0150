"""One short flight of every kind that a figure has to cope with."""

import functools
from collections.abc import Callable

import numpy as np

import gammastar as gs

VEHICLE = gs.Vehicle(mass=0.1, inertia=(0.0177, 0.0177, 0.0344), gravity=9.8)
INVERTED = [[1, 0, 0], [0, -0.9998, -0.0175], [0, 0.0175, -0.9998]]  # paper, section VI-B
STEP = 5e-3  # [s]; figures need no more


def paper_law() -> gs.Law:
    return gs.design(VEHICLE, gs.paths.circle(1.0, (0, 0, 10), kind="implicit", coordinates="quadratic"))


def upside_down() -> gs.FlightRecord:
    start = gs.State(position=(3.2, 5, 0), attitude=INVERTED)
    return gs.fly(paper_law(), start, speed=1.0, duration=16, step=STEP)


def noisy() -> gs.FlightRecord:
    noise = gs.SensorNoise(position=(0.02,) * 3, attitude=(0.002,) * 3)
    truth = gs.Vehicle(mass=0.101, inertia=(0.0195, 0.0195, 0.0378), gravity=9.8)
    start = gs.State(position=(3.2, 5, 0), attitude=INVERTED)
    return gs.fly(
        paper_law(),
        start,
        speed=1.0,
        duration=10,
        truth=truth,
        noise=noise,
        feedback="middle",
        rate=100,
        settled_within=0.3,
    )


def open_path() -> gs.FlightRecord:
    start = gs.State(position=(2, 0, 0), attitude=gs.so3.roll(60))
    return gs.fly(gs.design(VEHICLE, gs.paths.helix()), start, speed=1.0, duration=10, step=STEP)


def stop() -> gs.FlightRecord:
    law = gs.design(VEHICLE, gs.paths.circle(1.5))
    reference = gs.Stop(speed=1.0, coordinate=1.0, braking_time=4.0)
    return gs.fly(law, gs.State(position=(2, 0, 0.5)), reference=reference, duration=14, step=STEP)


def free_fall() -> gs.FlightRecord:
    """A flight that ends early: the circle lies so far below that the law lets the vehicle fall."""
    return gs.fly(paper_law(), gs.State(position=(1, 0, -20)), speed=1.0, duration=10, step=STEP)


def one_row() -> gs.FlightRecord:
    """A flight that ends at once: it turns by more than a radian within the first step."""
    start = gs.State(position=(3, 0, 9), angular_velocity=(1000, 0, 0))
    return gs.fly(paper_law(), start, speed=1.0, duration=10, step=STEP)


def diverged() -> gs.FlightRecord:
    """A flight of one row: its steps are far too long for how it turns at the start."""
    start = gs.State(position=(3, 0, 9), angular_velocity=(300, 0, 0))
    return gs.fly(paper_law(), start, speed=1.0, duration=10, step=STEP)


def on_path() -> gs.FlightRecord:
    """A flight at rest on the path: nothing to see, and ranges of zero."""
    law = gs.design(VEHICLE, gs.paths.circle(1.0))
    return gs.fly(law, gs.State(position=(1, 0, 0)), reference=gs.Point(0.0), duration=1, step=STEP)


def replaced() -> gs.FlightRecord:
    """A flight along a closed path, then along an open one, which ends."""
    law = gs.design(VEHICLE, gs.waypoints([(0, 0, 0), (3, 1, 0), (1, 4, 1)], closed=True))
    away = gs.Replacement(6.0, gs.waypoints([(0, 5, 0), (-3, 5, -1), (-6, 3, 0)]))
    return gs.fly(law, gs.State(position=(0, 0, 0.3)), speed=1.0, duration=18, step=STEP, replacements=[away])


KINDS: dict[str, Callable[[], gs.FlightRecord]] = {
    "upside down": functools.cache(upside_down),
    "noisy": functools.cache(noisy),
    "open path": functools.cache(open_path),
    "stop": functools.cache(stop),
    "ended early": functools.cache(free_fall),
    "one row": functools.cache(one_row),
    "diverged": functools.cache(diverged),
    "replaced": functools.cache(replaced),
    "at rest on the path": functools.cache(on_path),
}


def tilt_degrees(record: gs.FlightRecord) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(record.attitude[:, 2, 2], -1, 1)))

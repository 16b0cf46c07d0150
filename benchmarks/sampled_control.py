"""Worst distance to a non-planar circle under sampled control, held from the start or from the middle of the interval.

The setting is the one of the author's published multi-agent study: 1.923 kg, a circle of 1.5 m with a wave of 0.25 m in
height, 0.45 rad/s, poles -3 ... -3.9; the distance is the largest after 15 s.  The order is the slope between neighbours.
"""

from __future__ import annotations

import math
import time

import machine

import gammastar as gs

RATES = (100.0, 400.0, 1000.0)  # [Hz]
EXPECTED = {"start": (45e-6, 11e-6, 4.6e-6), "middle": (6.1e-6, 0.36e-6, 0.057e-6)}  # [m] the design's targets
SETTLED = 15.0  # [s]


def worst_distance(feedback: str, rate: float) -> tuple[float, float]:
    """Return the largest distance [m] after settling, and the wall time [s] of the flight."""
    vehicle = gs.Vehicle(mass=1.923, inertia=(1.152e-2, 1.152e-2, 2.18e-2), gravity=9.81)
    poles = (-3.0, -3.3, -3.6, -3.9)
    law = gs.design(vehicle, gs.paths.nonplanar_circle(), poles={"transverse": poles, "tangential": poles, "yaw": -3.0})
    begin = time.perf_counter()
    flight = gs.fly(
        law, gs.State(position=(1.8, 0.3, 1.2)), speed=0.45, duration=29.0, feedback=feedback, rate=rate, throw=True
    )
    return float(flight.distance[flight.time > SETTLED].max()), time.perf_counter() - begin


def main() -> None:
    """Print the table."""
    print(machine.describe())
    print(f"{'held from':<10}{'rate Hz':>9}{'worst µm':>11}{'target µm':>11}{'ratio':>8}{'order':>8}{'wall s':>8}")
    for feedback, targets in EXPECTED.items():
        rows = [(rate, target, *worst_distance(feedback, rate)) for rate, target in zip(RATES, targets, strict=True)]
        for k, (rate, target, distance, wall) in enumerate(rows):
            slope = math.log(rows[k - 1][2] / distance) / math.log(rate / rows[k - 1][0]) if k else math.nan
            order = f"{slope:.2f}" if k else ""
            print(
                f"{feedback:<10}{rate:>9.0f}{distance * 1e6:>11.3f}{target * 1e6:>11.3f}{distance / target:>8.2f}"
                f"{order:>8}{wall:>8.2f}"
            )


if __name__ == "__main__":
    main()

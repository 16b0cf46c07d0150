"""Accuracy and cost of every integrator on the closed loop, against its exact solution; and drift off SO(3) over 60 s.

The flight is the paper's upside-down recovery; the error is the largest position error against `law.predict`.
"""

from __future__ import annotations

import math
import time

import machine
import numpy as np

import gammastar as gs
from gammastar import so3
from gammastar.mission import load

STEPS = (8e-3, 4e-3, 2e-3, 1e-3)  # [s]


def main() -> None:
    """Print one row an integrator."""
    print(machine.describe())
    mission = load("upside-down")
    law, start = mission.law(), mission.start()
    heading = "".join(f"{f'error m, {1e3 * step:g} ms':>17}" for step in STEPS)
    print(f"{'integrator':<19}{'order':>6}{'measured':>10}{heading}{'wall s at 1 ms':>16}{'drift after 60 s':>18}")
    for name, method in gs.INTEGRATORS.items():
        errors = []
        for step in STEPS:
            begin = time.perf_counter()
            flight = gs.fly(law, start, speed=1.0, duration=8.0, step=step, integrator=name)
            wall = time.perf_counter() - begin
            apart = np.linalg.norm(flight.position - flight.prediction.position, axis=1).max()
            errors.append(
                apart if flight.time[-1] > 7.99 else math.nan
            )  # also where the step does not resolve the motion
        slope = math.log2(errors[0] / errors[1]) if method.order > 1 else math.log2(errors[-2] / errors[-1])
        drift = so3.drift(gs.fly(law, start, speed=1.0, duration=60.0, step=2e-3, integrator=name).attitude)
        row = "".join(f"{error:>17.2e}" for error in errors)
        print(f"{name:<19}{method.order:>6}{slope:>10.2f}{row}{wall:>16.3f}{drift:>18.1e}")


if __name__ == "__main__":
    main()

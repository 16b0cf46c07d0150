"""Fly a circle in RotorPy, once with gammastar and once with RotorPy's own SE3Control, in the same wind.

gammastar is told mass, inertia and rotors; drag and wind it has to find out.  Needs RotorPy: pip install 'gammastar[rotorpy]'.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

import gammastar as gs
from gammastar.adapters import rotorpy

FREQUENCY = 0.2  # [Hz] of the laps


def main() -> None:
    """Fly both and print how far from the circle they are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicle", default="hummingbird", help="one of RotorPy's")
    parser.add_argument("--wind", type=float, default=3.0, help="[m/s] along the first axis")
    parser.add_argument("--duration", type=float, default=12.0, help="[s]")
    options = parser.parse_args()
    parameters = rotorpy.parameters(options.vehicle)
    from rotorpy.controllers.quadrotor_control import SE3Control
    from rotorpy.trajectories.circular_traj import ThreeDCircularTraj
    from rotorpy.wind.default_winds import ConstantWind

    circle = gs.paths.circle(radius=1.0)
    vehicle = rotorpy.vehicle_of(parameters)
    law = gs.design(vehicle, circle, poles=-6, approach=gs.Approach(), rejection=gs.Observer(force=40, torque=120))
    ours = rotorpy.Controller(
        law, speed=-2 * np.pi * FREQUENCY
    )  # backwards about the axis down is forwards about that up

    def fly(controller: Any) -> np.ndarray:
        """Return the distances (n,) [m] to the circle."""
        world = rotorpy.environment(
            controller,
            parameters,
            gs.State(position=(1.5, 0.0, -0.5)),
            wind_profile=ConstantWind(options.wind, 0.0, 0.0),
            trajectory=ThreeDCircularTraj(np.zeros(3), np.array([1.0, 1.0, 0.0]), np.full(3, FREQUENCY)),
        )
        flight = rotorpy.flown(world.run(options.duration, terminate=False))
        return circle.global_distances(flight.position)

    print(f"{options.vehicle} in {options.wind:g} m/s of wind, {options.duration:g} s, start 0.71 m from the circle")
    for name, controller in (("gammastar", ours), ("SE3Control", SE3Control(parameters))):
        distances = fly(controller)
        last = distances[3 * len(distances) // 4 :]
        print(
            f"{name:<12} last quarter: RMS {1e3 * np.sqrt(np.mean(last**2)):8.3f} mm, farthest {distances.max():.2f} m"
        )


if __name__ == "__main__":
    main()

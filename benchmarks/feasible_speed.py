"""A speed that the rotors cannot fly in the bends: what the vehicle does when it is asked for as it is, and as a feasible profile.

An oval of 12 m by 4 m is to be flown at 5 m/s by a Hummingbird with a thrust-to-weight ratio of 2, at 500 Hz with motor lag, in truth with
drag that the law does not know.
"""

from __future__ import annotations

import dataclasses

import machine
import numpy as np

import gammastar as gs

SPEED = 5.0  # [m/s]
LATE = 6.0  # [s] from when on the vehicle is on the path


def main() -> None:
    """Print one row a reference."""
    print(machine.describe())
    path, known = gs.by_length(gs.paths.ellipse((6.0, 2.0))), gs.vehicles.load("hummingbird")
    fastest = np.sqrt(2 * known.weight / np.sum(np.asarray(known.rotors.thrust_coefficient)))
    truth = dataclasses.replace(known, rotors=dataclasses.replace(known.rotors, fastest=float(fastest)))
    believed = dataclasses.replace(truth, forces=())
    largest = gs.certify(believed, path, SPEED).allowed_speeds[0][1]
    print(f"largest constant speed everywhere on the path: {largest:.3g} m/s")
    law = gs.design(believed, path, -6, approach=gs.Approach(), rejection=gs.Observer())
    start = gs.State(path.points(np.zeros(1))[0] + np.array([0.0, 0.3, -0.2]))
    references = {"as wanted": gs.Speed(SPEED), "feasible profile": gs.feasible_profile(believed, path, SPEED)}
    print(f"{'reference':<18}{'speed m/s':>16}{'largest distance mm':>22}{'RMS mm':>10}{'limits took':>13}")
    for name, reference in references.items():
        flight = gs.fly(law, start, reference=reference, duration=25.0, truth=truth, step=2e-3)
        late = flight.time > LATE
        speed, distance = np.linalg.norm(flight.velocity[late], axis=1), 1e3 * flight.distance[late]
        took = np.mean(flight.autopilot.given_up[late] > 0)
        print(
            f"{name:<18}{speed.min():>8.2f}{speed.max():>8.2f}{distance.max():>22.2f}{np.sqrt(np.mean(distance**2)):>10.2f}{took:>13.1%}"
        )


if __name__ == "__main__":
    main()

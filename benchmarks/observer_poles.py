"""The observer poles that are best for measured sensors: predicted by linear theory, and flown.

RotorPy's Hummingbird with its aerodynamics, of which the law knows mass, inertia and rotors only, on a circle of 1 m at 0.2 Hz; control
at 500 Hz; noise and rates of the sensors as measured by Path-Flyer.  The predicted figure is the root mean square distance of the flight
without noise and of the band that noise makes about it; the flown one is that over seeds.  The best poles are those of the least
prediction among those where noise stays five deviations off the limits of the rotors, without which linear theory ends.
"""

from __future__ import annotations

import argparse
import dataclasses

import machine
import numpy as np

import gammastar as gs
from gammastar.flight import PATH_FLYER, noise_band
from gammastar.flight.band import LINEAR
from gammastar.law import KalmanFilter, Observer
from gammastar.vehicle import presets

FORCES = (3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 26.0, 40.0)  # [rad/s]
TORQUES = (40.0, 80.0, 160.0)  # tried at the best force
SPEED, DURATION, LAST = 2 * np.pi * 0.2, 12.0, 9.0  # [rad/s], [s], [s] from which distances count
START = gs.State((1.0, 0.0, 0.0), (0.0, SPEED, 0.0))


def main() -> None:
    """Print the table of bandwidths, and the best of each path of the measurements."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=12, help="flights for each pair of bandwidths")
    parser.add_argument("--poles", type=float, default=-6.0, help="all poles of the law [1/s]")
    chosen = parser.parse_args()
    print(machine.describe())
    for name, estimator in (("filter", KalmanFilter(**PATH_FLYER.deviations(), gravity=9.81)), ("raw samples", None)):
        print(
            f"{name}: RMS distance [mm], predicted / flown (largest of all seeds), rotors off limits, instants in the 3-sigma band"
        )

        def row(force: float, torque: float, estimator: KalmanFilter | None = estimator) -> tuple[float, float, float]:
            predicted, flown, largest, off, inside = figures(
                estimator, Observer(force, torque), chosen.poles, chosen.seeds
            )
            figure = (
                f"{predicted:8.1f} / {flown:8.1f} ({largest:.1f}), {off:.1f} deviations, {100 * inside:.2f} % inside"
            )
            print(f"  force {force:4g}, torque {torque:4g} rad/s   {figure}", flush=True)
            return predicted if off >= LINEAR else np.inf, force, torque

        _, force, _ = min(row(force, TORQUES[1]) for force in FORCES)
        _, force, torque = min(row(force, torque) for torque in TORQUES)
        print(f"  best by prediction: force {force:g}, torque {torque:g} rad/s")


def figures(estimator: KalmanFilter | None, observer: Observer, poles: float, seeds: int) -> tuple[float, ...]:
    """Return the RMS distance [mm] as predicted and as flown, the largest one, how far rotors are off limits, and the share in the band."""
    truth = presets.load("hummingbird")
    believed = dataclasses.replace(truth, forces=())
    law = gs.design(believed, gs.paths.circle(), poles=poles, rejection=observer, estimator=estimator)
    arguments = {"sensors": PATH_FLYER, "speed": SPEED, "duration": DURATION, "truth": truth, "step": 2e-3}
    band = noise_band(law, START, after=LAST - 4, **arguments)
    bound = (band.nominal + band.bound())[band.time >= LAST]
    distances, inside = [], []
    for seed in range(seeds):
        record = gs.fly(law, START, seed=seed, **arguments)
        late = record.distance[record.time >= LAST] if record.completed else np.full(len(bound), np.inf)
        distances.append(late)
        inside.append(late <= bound)
    flown = np.concatenate(distances)
    off = float(band.saturation[band.time >= LAST].min())
    return (
        1e3 * band.over(LAST),
        1e3 * float(np.sqrt(np.mean(flown**2))),
        1e3 * float(flown.max()),
        off,
        float(np.mean(inside)),
    )


if __name__ == "__main__":
    main()

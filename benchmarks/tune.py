"""What tuning is worth: a Crazyflie on flights that the search has not seen, and the paper's recovery with a lower peak rate.

The first cost is the default one of `gammastar tune`, over the campaign of the built-in mission.  The second is the largest body rate
of the paper's upside-down recovery, by the poles across the path, at no longer a settling time than the mission has; that mission has one
flight and no chance.  Beside it: the least rate that equal poles on all chains have.
"""

from __future__ import annotations

import argparse
import time

import machine
import numpy as np

import gammastar as gs
from gammastar.campaign.space import Candidate
from gammastar.campaign.trials import Trials
from gammastar.campaign.tuned import Tuned

SHOWN = (
    "settling_time_s",
    "peak_rate_rad_s",
    "peak_torque_N_m",
    "max_thrust_N",
    "rms_distance_last_quarter_m",
    "failed",
)


def main() -> None:
    """Print both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=24, help="of each tuning of the Crazyflie")
    parser.add_argument("--evaluations", type=int, default=400, help="tunings of the Crazyflie")
    parser.add_argument("--recoveries", type=int, default=1000, help="tunings of the recovery")
    chosen = parser.parse_args()
    print(machine.describe())
    begun = time.perf_counter()
    crazyflie = gs.tune(gs.load_mission("crazyflie"), flights=chosen.flights, evaluations=chosen.evaluations)
    show("crazyflie", crazyflie, time.perf_counter() - begun)
    begun = time.perf_counter()
    recovery = gs.tune(
        gs.load_mission("upside-down"),
        evaluations=chosen.recoveries,
        cost={"peak_rate_rad_s": 1.0},
        limits={"settling_time_s": None},
        only=["transverse", "transverse_2"],
    )
    show("upside-down", recovery, time.perf_counter() - begun)
    print("  with equal poles at {:g} 1/s at least {:.3g} rad/s, settled within {:.3g} s".format(*equal_poles()))


def equal_poles() -> tuple[float, float, float]:
    """Return the pole [1/s] that turns least [rad/s] of those that all chains may have alike, the rate, and the settling time [s]."""
    mission = gs.load_mission("upside-down")
    poles, law = np.arange(-6.0, -2.0, 0.1), mission.law()
    alike = [
        Candidate({chain: (complex(pole),) * len(own) for chain, own in law.poles.items()}, {}, None) for pole in poles
    ]
    flown = Trials(mission, range(1), seed=0).fly(alike)
    rates = [float(columns["peak_rate_rad_s"][0]) for columns in flown]
    best = int(np.argmin(rates))
    return float(poles[best]), rates[best], float(flown[best]["settling_time_s"][0])


def show(name: str, found: Tuned, wall: float) -> None:
    """Print what has been found of a mission."""
    print(f"{name}: {found.message} ({len(found.tried) - 1} tunings in {wall:.0f} s)")
    own, best = found.unseen
    for term in SHOWN:
        print(f"  {term:28s} {own[term]:10.4g} -> {best[term]:10.4g}")
    for term, _, before, after in found.numbers():
        print(f"  {term:28s} {before:10.4g} -> {after:10.4g}")


if __name__ == "__main__":
    main()

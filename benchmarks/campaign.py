"""What many flights cost: wall time, flights and closed-loop steps a second, peak memory and disk, of two campaigns.

The built-in mission any-attitude, a Hummingbird with rotors, observers and noisy sensors, 20 s at 400 Hz; and the plain law from any
attitude, 20 s with continuous feedback, rkmk4 at 1 ms.  Each is flown by a process of its own, after its step was compiled:

    python benchmarks/campaign.py --flights 100000
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import machine

import gammastar as gs
from gammastar.campaign.rate import percent

PLAIN = {  # the paper's vehicle and its first scenario, around the law for any curve
    "title": "the plain law from any attitude",
    "path": {"name": "circle", "radius": 1.0, "center": [0.0, 0.0, 10.0]},
    "controller": {"poles": -4.0},
    "approach": {"speed": 2.0},
    "campaign": {"vary": [{"quantity": "start.attitude", "kind": "any"}]},
}


def missions() -> dict[str, gs.Mission]:
    """Return the campaigns by name."""
    return {"any-attitude": gs.load_mission("any-attitude"), "plain": gs.load_mission("upright").with_values(PLAIN)}


def flown(name: str, flights: int) -> None:
    """Fly a campaign in this process and print its facts, peak memory and disk as JSON."""
    mission = missions()[name]
    with tempfile.TemporaryDirectory() as folder:
        gs.campaign(mission, 4, Path(folder, "first"))
        campaign = gs.campaign(mission, flights, Path(folder, "all"))
        disk = sum(file.stat().st_size for file in Path(folder, "all").rglob("*") if file.is_file())
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(json.dumps({**campaign.facts(), "memory_MB": memory, "disk_MB": disk / 1e6}))


def main() -> None:
    """Fly the campaigns and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=2000)
    parser.add_argument("--only", choices=sorted(missions()))
    parser.add_argument("--child", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        flown(given.child, given.flights)
        return
    print(machine.describe())
    for name in [given.only] if given.only else missions():
        command = [sys.executable, __file__, "--child", name, "--flights", str(given.flights)]
        told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        low, high = told["interval"]
        print(
            f"{name}: {told['flights']} flights in {told['wall_time_s']:.1f} s, {told['flights_per_s']:.0f} flights/s, "
            f"{told['steps_per_s'] / 1e6:.2f} M steps/s; {percent(told['share'])} settle ({percent(low)} to {percent(high)}); "
            f"memory {told['memory_MB']:.0f} MB, disk {told['disk_MB']:.1f} MB"
        )


if __name__ == "__main__":
    main()

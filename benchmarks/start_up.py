"""Start-up and flight times: import, the command line from cold, and a 20 s flight at 1 kHz beside its accuracy.

Times of whole processes are medians of several fresh interpreters; the bare interpreter stands beside them.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time

import machine

import gammastar as gs
from gammastar.mission import load

REPEATS = 5


def process_time(arguments: list[str]) -> tuple[float, str]:
    """Return the median wall time [s] of a fresh interpreter with these arguments, and what it printed last."""
    times, printed = [], ""
    for _ in range(REPEATS):
        begin = time.perf_counter()
        printed = subprocess.run([sys.executable, *arguments], check=True, capture_output=True, text=True).stdout
        times.append(time.perf_counter() - begin)
    return statistics.median(times), printed


def main() -> None:
    """Print the times."""
    print(machine.describe())
    bare, _ = process_time(["-c", "pass"])
    imported, _ = process_time(["-c", "from gammastar import fly"])
    whole, printed = process_time(["-m", "gammastar", "fly", "upside-down", "--json"])
    print(f"bare interpreter                        {bare:8.3f} s")
    print(f"from gammastar import fly               {imported:8.3f} s")
    print(f"gammastar fly upside-down --json, cold  {whole:8.3f} s")
    mission = load("upside-down")
    law, start = mission.law(), mission.start()
    walls = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        flight = gs.fly(law, start, speed=1.0, duration=20.0, step=1e-3)
        walls.append(time.perf_counter() - begin)
    wall = statistics.median(walls)
    error = json.loads(printed)["oracle"]["max_position_error_m"]
    print(f"20 s flight at 1 kHz, continuous        {wall:8.3f} s   {20 / wall:.0f} times real time")
    print(f"its largest position error              {error:8.1e} m   against the closed form")
    print(f"closed-loop steps per second            {(len(flight.time) - 1) / wall:8.0f}")


if __name__ == "__main__":
    main()

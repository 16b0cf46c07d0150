"""The noisy mission over many seeds: how many settle, and the root mean square distance to the path.

Section VI-C of the paper with the substitute noise that the mission states.  Each seed is one flight of the built-in mission.
"""

from __future__ import annotations

import argparse

import machine
import numpy as np

from gammastar.mission import load


def main() -> None:
    """Print the table over seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="number of seeds, from zero")
    seeds = parser.parse_args().seeds
    print(machine.describe())
    root_mean_squares, worst, settled = [], [], 0
    for seed in range(seeds):
        summary = load("noisy").with_values({"flight.seed": seed}).fly().summary()
        settled += summary["settled"]
        root_mean_squares.append(summary["distance_m"]["rms_after_settling"])
        worst.append(summary["distance_m"]["max_after_settling"])
    values = np.array(root_mean_squares, dtype=float)
    print(f"settled                          {settled} of {seeds} (within {summary['settled_within_m']:g} m)")
    print(f"RMS distance over all seeds      {np.sqrt(np.mean(values**2)):.4f} m")
    print(
        f"RMS distance by seed             {values.min():.4f} to {values.max():.4f} m, median {np.median(values):.4f} m"
    )
    print(f"largest distance after settling  {np.max(worst):.4f} m")


if __name__ == "__main__":
    main()

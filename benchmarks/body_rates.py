"""Every built-in mission by thrust and body rates, through an inner loop of 20 rad/s: where it settles.

The law has relative degree three then, and leads the inner loop by its own inverse.  `noisy` is left out: its noise leaves no 5 mm.
"""

from __future__ import annotations

import machine

from gammastar import mission

WITHIN = 5e-3  # [m]


def main() -> None:
    """Print one row a mission."""
    print(machine.describe())
    print(f"{'mission':<14}{'settled':>9}{'after s':>9}{'largest distance in the last quarter mm':>42}")
    for name in mission.names():
        if name == "noisy":
            continue
        changes = {"controller.interface": "rates", "flight.settled_within": WITHIN}
        summary = mission.load(name).with_values(changes).fly().summary()
        measured, last = summary["settling_time_s"]["measured"], 1e3 * summary["distance_m"]["max_last_quarter"]
        settled = "yes" if measured is not None and last <= 1e3 * WITHIN else "no"
        print(
            f"{name:<14}{settled:>9}{measured if measured is not None else float('nan'):>9.2f}{last:>42.4f}", flush=True
        )


if __name__ == "__main__":
    main()

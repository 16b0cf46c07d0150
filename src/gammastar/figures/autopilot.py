"""What an autopilot did: rotors, what limits took, what it found unknown, and the wind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gammastar.figures import style
from gammastar.figures.history import Panel, columns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gammastar.flight import FlightRecord


UNNAMED = "_"  # a name that no legend shows
TAKEN = ("none", "along", "yaw", "thrust", "tilt")  # by the numbers in the rows, short; tilt is roll and pitch


@style.drawing()
def draw_autopilot(record: FlightRecord, title: str = "") -> Figure:
    """Draw the unknown acceleration, the wind where any blows, and of rotors their speeds with limits and what these took."""
    rows = record.autopilot
    assert rows is not None
    unknown = [(f"${axis}$", rows.unknown[:, k]) for k, axis in enumerate("xyz")]
    panels = [Panel("unknown acceleration,\nworld [m/s²]", unknown)]
    if np.any(rows.wind):
        panels.append(Panel("wind, world [m/s]", [(f"${axis}$", rows.wind[:, k]) for k, axis in enumerate("xyz")]))
    rotors = record.truth.rotors
    if rotors is not None and rows.rotor_speeds.size:
        speeds = [(f"{k + 1}", values) for k, values in enumerate(rows.rotor_speeds.T)]
        panels.append(Panel("rotor speeds [rad/s]", speeds, [("limits", rotors.slowest), (UNNAMED, rotors.fastest)]))
        ends = [(UNNAMED, 0.0), (UNNAMED, len(TAKEN) - 1.0)]
        panels.append(Panel("limits took", [("the most important", rows.given_up)], ends, levels=TAKEN))
    return columns(record, panels, title)

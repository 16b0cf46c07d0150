"""The set of figures of one flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gammastar.figures import autopilot, history, scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gammastar.flight import FlightRecord

DRAWINGS = {
    "path": scene.draw_path,
    "states": history.draw_states,
    "velocities": history.draw_velocities,
    "rates": history.draw_rates,
    "inputs": history.draw_inputs,
    "margins": history.draw_margins,
}
AUTOPILOT_DRAWINGS = {"autopilot": autopilot.draw_autopilot}  # of flights that have one


def draw_flight(record: FlightRecord, title: str = "") -> dict[str, Figure]:
    """Return the figures of a flight by name: path, states, velocities, rates, inputs, margins, and autopilot where there is one.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    drawings = DRAWINGS | (AUTOPILOT_DRAWINGS if record.autopilot is not None else {})
    return {name: draw(record, title) for name, draw in drawings.items()}

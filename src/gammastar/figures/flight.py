"""The set of figures of one flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gammastar.figures import history, scene

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


def draw_flight(record: FlightRecord, title: str = "") -> dict[str, Figure]:
    """Return the figures of a flight by name: path, states, velocities, rates, inputs, margins.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    return {name: draw(record, title) for name, draw in DRAWINGS.items()}

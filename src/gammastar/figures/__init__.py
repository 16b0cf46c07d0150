"""From the record of a flight to figures that people look at."""

from gammastar.figures.animation import animate
from gammastar.figures.flight import draw_flight
from gammastar.figures.save import save

__all__ = ["animate", "draw_flight", "save"]

"""Missions: the TOML file that describes a flight, its model, and the ones that come with gammastar."""

from gammastar.mission.load import load, names, parse, titles, value
from gammastar.mission.mission import Mission

__all__ = ["Mission", "load", "names", "parse", "titles", "value"]

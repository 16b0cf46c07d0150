"""What the columns of a campaign's rows are called: units, words for people, and which of them tell what a mission varies."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from gammastar.errors import UnknownNameError
from gammastar.mission.campaign import QUANTITIES

UNITS = {  # by the end of a name, the longest first
    "_rad_s": "rad/s",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_N_m": "N m",
    "_deg": "°",
    "_m": "m",
    "_N": "N",
    "_s": "s",
}
ATTITUDE = ("start_tilt_deg", "start_tilt_direction_deg", "start_heading_deg")
FRAMED = re.compile(
    r"start_(position|velocity|angular_velocity)_[xyz]_|start_(tilt_direction|heading)_|wind\.mean\.|path\.(position|center|normal|axis|point|along)\."
)
OF_PATH = {f"path.{each}": "m" for each in ("radius", "position", "center", "point")} | {
    f"path.{each}": "°" for each in ("rotation.roll", "rotation.pitch", "rotation.yaw", "heading")
}
THRUST_TO_WEIGHT = "thrust_to_weight"


def parted(column: str) -> tuple[str, str]:
    """Return the words and the unit of a column; a key of a mission keeps its own spelling, and may have no unit that is known.

    >>> parted("peak_rate_rad_s"), parted("truth.mass_scale"), parted("wind.mean.x")
    (('peak rate', 'rad/s'), ('truth.mass_scale', ''), ('wind.mean.x', 'm/s'))
    """
    if "." in column:
        units = {key: each.unit for key, each in QUANTITIES.items()} | OF_PATH
        return column, next((unit for key, unit in units.items() if f"{column}.".startswith(f"{key}.")), "")
    for end, unit in UNITS.items():
        if column.endswith(end):
            return column.removesuffix(end).replace("_", " "), unit
    return column.replace("_", " "), ""


def label(column: str, frame: str = "") -> str:
    """Return a column as people read it, with its unit in brackets, and with the frame where it needs one and one is given."""
    words, unit = parted(column)
    named = f"{words}, {frame}" if frame and FRAMED.match(column) else words
    return f"{named} [{unit}]" if unit else named


def varied(kinds: Mapping[str, str]) -> list[str]:
    """Return the columns that tell what a campaign may vary: the start, keys of the mission, and what follows from those."""
    return [name for name in kinds if name.startswith("start_") or "." in name or name == THRUST_TO_WEIGHT]


def those_of(quantity: str, known: Iterable[str]) -> list[str]:
    """Return the columns that tell a quantity, which is a column itself, or a key of a mission such as wind.mean or start.position.

    Raises:
        UnknownNameError: No column does.
    """
    columns = list(known)
    if quantity in columns:
        return [quantity]
    found = [name for name in columns if name.startswith((f"{quantity}.", f"{quantity.replace('.', '_')}_"))]
    if quantity == "start.attitude":
        found = [name for name in ATTITUDE if name in columns]
    if not found or "." not in quantity:
        raise UnknownNameError("quantity", quantity, columns)
    return found

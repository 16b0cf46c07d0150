"""The figures of a study: from where flights succeed, and how far tolerances reach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gammastar.campaign.answers import Bin
from gammastar.campaign.columns import THRUST_TO_WEIGHT, label
from gammastar.campaign.rate import percent
from gammastar.campaign.study import Study
from gammastar.figures.basin import Basin, draw_basin
from gammastar.figures.tolerance import Tolerance, draw_tolerance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PER_CELL = 80  # flights in a cell of a map, on average: its share is then known to some percents
CELLS = (4, 24)  # least and most along an axis of a map
TILT, DIRECTIONS = "start_tilt_deg", ("start_tilt_direction_deg", "start_heading_deg")
POSITION = tuple(f"start_position_{axis}_m" for axis in "xyz")
OBLONG = 4.0  # ratio of spreads up to which both axes of a map have one scale


def pictures(study: Study, columns: Sequence[str], bins: int) -> dict[str, Figure]:
    """Return the figures of a study by the names of their files: maps of the basin, and a curve for each column.

    Args:
        study: Of the campaign.
        columns: Over which success is drawn.
        bins: Of them, at most.
    """
    title, frame = headline(study), study.mission.frame
    basins = {"basin-attitude": attitude_basins(study), "basin-position": position_basins(study)}
    drawn = {name: draw_basin(maps, title) for name, maps in basins.items() if maps}
    for column in columns:
        name = "thrust-to-weight" if column == THRUST_TO_WEIGHT else f"tolerance-{column}"
        drawn[name] = draw_tolerance(tolerance(label(column, frame), study.by(column, bins)), title)
    return drawn


def attitude_basins(study: Study) -> list[Basin]:
    """Return the maps over the initial tilt and its direction, and over tilt and heading; none of what does not vary."""
    if not _vary(study, (TILT,)):
        return []
    return [_basin(study, across, TILT) for across in _vary(study, DIRECTIONS)]


def position_basins(study: Study) -> list[Basin]:
    """Return the map over the two coordinates of the initial position with the largest spread, in a list; none of fewer."""
    spread = {name: high - low for name in _vary(study, POSITION) for low, high in [study.ends(name) or (0, 0)]}
    two = sorted(sorted(spread, key=lambda name: -spread[name])[:2])
    if len(two) < 2:
        return []
    basin = _basin(study, *two)
    oblong = max(spread[name] for name in two) > OBLONG * min(spread[name] for name in two)
    downward = two[1] == POSITION[2] and study.mission.frame == "ned"
    return [basin._replace(equal=not oblong, downward=downward)]


def tolerance(name: str, bins: Sequence[Bin]) -> Tolerance:
    """Return the numbers of a curve over bins, which are all ranges or all single values."""
    single = all(each.low == each.high for each in bins)
    return Tolerance(
        name,
        None if single else np.array([bins[0].low, *(each.high for each in bins)]),
        [each.low for each in bins] if single else (),
        np.array([each.rate.flights for each in bins]),
        np.array([each.rate.share for each in bins]),
        np.array([[each.rate.low, each.rate.high] for each in bins]).reshape(-1, 2),
        np.array([each.settling for each in bins]).reshape(-1, 2),
    )


def _basin(study: Study, across: str, up: str) -> Basin:
    frame = study.mission.frame
    most = int(np.clip(np.sqrt(study.rate().flights / PER_CELL), *CELLS))
    found = study.over(across, up, (most, most))
    return Basin(label(across, frame), label(up, frame), *found)


def _vary(study: Study, columns: Sequence[str]) -> list[str]:
    """Return those of some columns that are there and vary."""
    return [name for name in columns if name in study.numbers and study.varies(name)]


def headline(study: Study) -> str:
    """Return the title of a figure: the mission, the rate of success, and its interval."""
    rate = study.rate()
    interval = f"Wilson's 95 % interval {percent(rate.low)} to {percent(rate.high)}"
    words = _together(f"{percent(rate.share)} of {rate.flights:,} flights settle, {interval}", " %", " 95", " interval")
    return f"{study.mission.title}: {words}" if study.mission.title else words


def _together(words: str, *parts: str) -> str:
    """Return words in which some parts do not begin a line."""
    for part in parts:
        words = words.replace(part, f"\N{NO-BREAK SPACE}{part.lstrip()}")
    return words

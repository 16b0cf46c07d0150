"""One of the flights of a campaign again, whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gammastar.campaign.flown import flown, rows
from gammastar.campaign.setting import Setting
from gammastar.campaign.store import Store
from gammastar.checks import whole
from gammastar.errors import GammastarError, InputError
from gammastar.flight import FlightRecord, Flights
from gammastar.mission import Mission


@dataclass(frozen=True, eq=False)
class Again:
    """A flight of a campaign, flown again."""

    mission: Mission  # of this flight alone, without [campaign]
    record: FlightRecord
    row: Mapping[str, Any]  # that of the campaign
    same: bool  # whether the flight has the numbers of the row, all of them to the last bit


def flown_again(store: Store, mission: Mission, number: int) -> Again:
    """Return a flight of a campaign by its number; see `Campaign.fly`."""
    manifest, number = store.manifest, whole(number, "number of a flight")
    if number >= manifest.flights:
        raise InputError(
            f"number of a flight must be below the {manifest.flights} of the campaign (got {number}); count from zero"
        )
    row, numbers, setting = store.row(number), np.array([number]), Setting(mission, manifest.seed)
    if row is None:
        raise InputError(f"flight {number} must have been flown (got no row of it yet); let the campaign go on first")
    case = next(setting.cases(numbers, setting.sample(numbers)))
    if isinstance(case.mission, GammastarError):
        raise InputError(f"flight {number} must be one that began (got one that was refused: {case.mission})")
    alone = {"machine": manifest.machine, "workers": 1}
    _, result = next(flown(case, case.starts(), alone | {"record": (0,)}))
    if not isinstance(result, Flights):
        raise InputError(f"flight {number} must be one that began (got one that was refused: {result})") from result
    again = rows(setting, [number], manifest.machine, 1).to_pylist()[0]
    return Again(case.alone(), result.record(0), row, repr(again) == repr(row))

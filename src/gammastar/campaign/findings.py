"""What a study finds, as one object of plain data: the rate, why flights fail, what they took, and how success depends on what varies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gammastar.campaign.answers import Bin, Cause
from gammastar.campaign.columns import THRUST_TO_WEIGHT, parted, those_of, varied
from gammastar.campaign.database import SUCCESS
from gammastar.campaign.rate import CONFIDENCE
from gammastar.campaign.study import Study

BINS = 10
LATE_DISTANCE = "rms_distance_last_quarter_m"
DISTRIBUTIONS = (
    "settling_time_s",
    "max_distance_m",
    "max_distance_last_quarter_m",
    LATE_DISTANCE,
    "peak_rate_rad_s",
    "peak_torque_N_m",
    "peak_speed_m_s",
    "min_thrust_N",
    "max_thrust_N",
    "min_free_fall_margin_m_s2",
)
UNSETTLED = "flew to the end, but was not on the path within the mission's settled_within"


def findings(study: Study, quantities: Sequence[str] = (), bins: int = BINS) -> dict[str, Any]:
    """Return what a campaign teaches; shares are of one, intervals Wilson's, and quantiles those of the flights that settle.

    Args:
        study: Of the campaign.
        quantities: By which success is told, columns or keys of the mission; all that vary if there are none.
        bins: At most, of each.

    Raises:
        UnknownNameError: No column tells a quantity.
    """
    chosen = columns_by(study, quantities)
    manifest, mission = study.store.manifest, study.mission
    rate = study.rate()
    told = [name for name in DISTRIBUTIONS if name in study.columns]
    return {
        "mission": mission.title,
        "frame": mission.frame,
        "seed": manifest.seed,
        "machine": manifest.machine,
        "version": manifest.version,
        "settled_within_m": mission.settled_within,
        "flights": rate.flights,
        "flights_missing": manifest.flights - rate.flights,
        "confidence": CONFIDENCE,
        "success": rate.values(),
        "settled_late": study.late(),
        "causes": [_cause(study, each) for each in study.causes()],
        "distributions": {name: study.distribution(name, SUCCESS) for name in told},
        "by": {name: _by(name, study.by(name, bins), rate.flights) for name in chosen},
    }


def columns_by(study: Study, quantities: Sequence[str] = ()) -> list[str]:
    """Return the columns that tell some quantities, each once; those of everything that varies if there are none."""
    named = [name for quantity in quantities for name in those_of(quantity, study.columns)]
    return list(dict.fromkeys(named)) or [name for name in _in_order(varied(study.columns)) if study.varies(name)]


def _in_order(names: Sequence[str]) -> list[str]:
    """Return keys of the mission first, then what follows from them, then the tilt and the rest of the start."""
    places = {THRUST_TO_WEIGHT: 1, "start_tilt_deg": 2}
    return sorted(names, key=lambda name: 0 if "." in name else places.get(name, 3))


def _by(column: str, bins: Sequence[Bin], flights: int) -> dict[str, Any]:
    return {
        "unit": parted(column)[1].replace("°", "deg").replace("²", "^2") or None,
        "flights_without": flights - sum(each.rate.flights for each in bins),
        "bins": [_bin(each) for each in bins],
    }


def _bin(each: Bin) -> dict[str, Any]:
    place = {"value": each.low} if each.low == each.high else {"low": each.low, "high": each.high}
    median, late = each.settling
    return place | each.rate.values() | {"settling_time_s": {"50%": median, "95%": late}}


def _cause(study: Study, cause: Cause) -> dict[str, Any]:
    return {
        "cause": cause.status,
        "sentence": cause.words or (UNSETTLED + _how_far(study) if cause.status == "not settled" else ""),
        "flights": cause.rate.successes,
        "share": cause.rate.share,
        "interval": [cause.rate.low, cause.rate.high],
        "median_end_time_s": cause.end,
        "first_flight": cause.first,
    }


def _how_far(study: Study) -> str:
    """Return how far from their paths those were that flew to their end and did not settle, as the end of a sentence."""
    if LATE_DISTANCE not in study.columns:
        return ""
    told = study.distribution(LATE_DISTANCE, f"status = 'completed' AND {SUCCESS} IS NOT TRUE")
    least, half, most = (told.get(each, float("nan")) for each in ("0%", "50%", "100%"))
    return f": {least:.3g} to {most:.3g} m away in the last quarter (RMS), in the median {half:.3g} m" if told else ""

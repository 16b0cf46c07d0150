"""The numbers of a flight that are worth knowing first."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from gammastar import so3
from gammastar.errors import PredictionError

SETTLED_SHARE = (
    0.5  # of settled_within: from when the closed form is this near for good, the flight must keep the whole
)


class Summary(dict[str, Any]):
    """A nested dictionary of plain numbers whose keys carry units; its text is a short table."""

    def __str__(self) -> str:
        """Return one line a number, nested keys joined by dots."""
        lines = _flat(self)
        width = max(len(key) for key, _ in lines)
        return "\n".join(f"{key:<{width}}  {_shown(value)}" for key, value in lines)


def _flat(values: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    rows: list[tuple[str, Any]] = []
    for key, value in values.items():
        rows += _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else [(prefix + key, value)]
    return rows


def _shown(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def summary_of(record: Any) -> Summary:
    """Return the numbers worth knowing first of a `FlightRecord`."""
    weight, predicted = record.truth.weight, _predicted_settling(record)
    outside = np.flatnonzero(record.distance > record.settled_within)
    measured = None
    if not outside.size:
        measured = 0.0
    elif outside[-1] < len(record.time) - 1:
        measured = float(record.time[outside[-1] + 1])
    after = record.distance[record.time >= predicted]
    last_quarter = record.distance[record.time >= 0.75 * record.time[-1]]
    values: dict[str, Any] = {
        "status": record.status.name.lower(),
        "message": record.status.value,
        "end_time_s": float(record.status_time),
        "settled": bool(record.completed and after.size and after.max() <= record.settled_within),
        "settled_within_m": record.settled_within,
        "settling_time_s": {"predicted": None if np.isinf(predicted) else predicted, "measured": measured},
        "distance_m": {
            "start": float(record.distance[0]),
            "final": float(record.distance[-1]),
            "max": float(record.distance.max()),
            "max_after_settling": float(after.max()) if after.size else None,
            "rms_after_settling": float(np.sqrt(np.mean(after**2))) if after.size else None,
            "max_last_quarter": float(last_quarter.max()),
            "rms_last_quarter": float(np.sqrt(np.mean(last_quarter**2))),
        },
        "so3_drift": so3.drift(record.attitude),
        "thrust_N": {"min": float(record.thrust.min()), "max": float(record.thrust.max())},
        "peak_rate_rad_s": float(np.linalg.norm(record.angular_velocity, axis=1).max()),
        "peak_torque_N_m": float(np.linalg.norm(record.torque, axis=1).max()),
        "peak_speed_m_s": float(np.linalg.norm(record.velocity, axis=1).max()),
        "flips": record.flips(),
        "margin_min": {
            "free_fall_m_s2": float(record.free_fall_margin.min()),
            "focal": float(record.focal_margin.min()),
        },
    }
    if weight > 0:
        values["thrust_to_weight"] = {
            "min": values["thrust_N"]["min"] / weight,
            "max": values["thrust_N"]["max"] / weight,
        }
    if record.autopilot is not None:
        values["autopilot"] = record.autopilot.summary()
    if record.nominal and record.completed:
        with contextlib.suppress(PredictionError):
            values["oracle"] = _oracle(record)
    return Summary(values)


def _predicted_settling(record: Any) -> float:
    """Return when the closed form is near the path for good [s]; infinity if not by the end.

    It starts where the loop is linear for the rest of the flight: at the start, after the last row at which an approach bent it, or
    where the path was replaced last; there xi stands for the distance.
    """
    tolerance, first = SETTLED_SHARE * record.settled_within, 0
    if record.constrained.any():
        first = int(np.flatnonzero(record.constrained)[-1]) + 1
    first = max(first, record.phases[-1].row)
    if first == len(record.time):
        return np.inf
    if first > 0:
        chains = record.law.decay(record.transverse_state[first], record.time[first:] - record.time[first])
    elif record.law.path.components == 2 or record.law.path.ends is not None:  # xi is not the distance
        try:
            return float(record.prediction.settling_time(tolerance))
        except PredictionError:
            return np.inf
    else:
        chains, _ = record.law.predict_chains(record.start, record.reference, record.time)
    far = np.linalg.norm(chains[:, :, 0], axis=1) > tolerance
    path = record.phases[-1].law.path
    if path.ends is not None:  # beyond an end the vehicle is not on the path, however small xi is
        place = record.tangential_state[first:, 0]
        slack = tolerance / np.linalg.norm(path.jets(np.array(path.ends))[:, 1], axis=1).max()
        far |= (place < path.ends[0] - slack) | (place > path.ends[1] + slack)
    outside = np.flatnonzero(far)
    after = first + (outside[-1] + 1 if outside.size else 0)
    return float(record.time[after]) if after < len(record.time) else np.inf


def _oracle(record: Any) -> dict[str, float]:
    """Return the largest departures of the flight from its closed form."""
    exact = record.prediction
    return {
        "max_position_error_m": float(np.linalg.norm(record.position - exact.position, axis=1).max()),
        "max_transverse_error_m": float(
            np.abs(record.transverse_state[:, :, 0] - exact.transverse_state[:, :, 0]).max()
        ),
        "max_thrust_error_N": float(np.abs(record.thrust - exact.thrust).max()),
    }

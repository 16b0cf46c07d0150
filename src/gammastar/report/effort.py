"""How much effort a start takes as a function of the poles, in closed form: nothing is flown."""

from __future__ import annotations

from typing import Any

import numpy as np

from gammastar.flight import FlightRecord
from gammastar.law import design

POLES = (1.5, 2.0, 2.5, 3.0, 4.0)  # [1/s] p, every chain having all its poles at -p; those of the design's table
TIMES = np.linspace(0.0, 6.0, 6001)  # [s]; the peaks of all these flights fall within the first two seconds
BRACKET = (2.0, 4.0)  # [1/s] in which the two starts change places


def effort(record: FlightRecord, pole: float) -> dict[str, float]:
    """Return thrust, rate and torque extremes of a scenario's start flown with all poles at -pole [1/s].

    The torque is Jx times the tilt acceleration: exact for Jx = Jy and a yaw rate that starts at zero, as in the paper.
    """
    vehicle = record.law.vehicle
    flight = design(vehicle, record.law.path, poles=-pole).predict(record.start, record.reference, TIMES)
    return {
        "min_thrust_over_weight": float(flight.thrust.min() / vehicle.weight),
        "max_thrust_over_weight": float(flight.thrust.max() / vehicle.weight),
        "peak_rate_rad_s": float(flight.tilt_rate.max()),
        "peak_torque_N_m": float(np.asarray(vehicle.inertia)[0, 0] * flight.tilt_acceleration.max()),
    }


def effort_table(upright: FlightRecord, inverted: FlightRecord) -> dict[str, Any]:
    """Return the efforts of two starts for each pole, and the pole at which their peak torques are equal."""
    from scipy.optimize import brentq

    def extra(pole: float) -> float:
        return effort(inverted, pole)["peak_torque_N_m"] - effort(upright, pole)["peak_torque_N_m"]

    rows = [{"pole_per_s": -p, "upright": effort(upright, p), "upside_down": effort(inverted, p)} for p in POLES]
    changes = extra(BRACKET[0]) * extra(BRACKET[1]) < 0
    return {"rows": rows, "equal_torque_pole_per_s": -float(brentq(extra, *BRACKET, xtol=1e-3)) if changes else None}

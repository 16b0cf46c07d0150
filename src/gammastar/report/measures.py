"""The numbers of one flight that the paper's section VI talks about."""

from __future__ import annotations

from typing import Any

import numpy as np

from gammastar.flight import FlightRecord

Measures = dict[str, Any]


def measures(record: FlightRecord) -> Measures:
    """Return plain numbers, units in the keys: the summary, the last lap, attitude and effort.

    Tilt is the angle between the body's third axis and the world's, 180 degrees upside down.  Pitch is that of yaw-pitch-roll
    angles, which lock at 90 degrees.  The rotor arm is max |(tau_p, tau_q)| / thrust: rotors that only push and carry the thrust
    T at an arm l give at most T l, so shorter arms cannot produce these torques.  xi_1 and xi_2 hold the largest of xi_i1 ... xi_i4.
    """
    R = record.attitude
    tilt = np.degrees(np.arccos(np.clip(R[:, 2, 2], -1, 1)))
    across = np.linalg.norm(record.torque[:, :2], axis=1)
    turned = np.flatnonzero(tilt >= 90)
    return {
        "summary": dict(record.summary()),
        "last_lap": last_lap(record),
        "tilt_deg": {"start": float(tilt[0]), "end": float(tilt[-1])},
        "last_time_beyond_90_deg_tilt_s": float(record.time[turned[-1]]) if turned.size else None,
        "largest_pitch_deg": float(np.degrees(np.arcsin(np.clip(np.abs(R[:, 2, 0]).max(), 0, 1)))),
        "largest_yaw_rate_rad_s": float(np.abs(record.angular_velocity[:, 2]).max()),
        "smallest_rotor_arm_m": float(np.max(across / record.thrust)),
        "true_over_believed": {
            "mass": record.truth.mass / record.law.vehicle.mass,
            "inertia": (np.diag(record.truth.inertia) / np.diag(record.law.vehicle.inertia)).tolist(),
        },
    }


def last_lap(record: FlightRecord) -> Measures:
    """Return largest values over the last lap of a closed path, or over the last quarter of an open or shorter flight."""
    along, period = record.tangential_state[:, 0], record.law.path.period
    lap = record.time >= 0.75 * record.time[-1]
    if period is not None and np.ptp(along) > period:
        lap = np.abs(along[-1] - along) <= period
    largest = np.abs(record.transverse_state[lap]).max(axis=0)
    speed, distance = record.tangential_state[lap, 1], record.distance[lap]
    velocity, rates = np.abs(record.velocity[lap]).max(axis=0), np.abs(record.angular_velocity[lap]).max(axis=0)
    return {
        "begin_s": float(record.time[lap][0]),
        "transverse_state": {"xi_1": largest[0].tolist(), "xi_2": largest[1].tolist()},
        "mean_transverse_output": record.transverse_state[lap, :, 0].mean(axis=0).tolist(),
        "speed_along_path_rad_s": {"min": float(speed.min()), "mean": float(speed.mean()), "max": float(speed.max())},
        "distance_m": {"max": float(distance.max()), "rms": float(np.sqrt(np.mean(distance**2)))},
        "velocity_m_s": dict(zip("xyz", velocity.tolist(), strict=True)),
        "rates_rad_s": dict(zip("pqr", rates.tolist(), strict=True)),
        "thrust_N": {"min": float(record.thrust[lap].min()), "max": float(record.thrust[lap].max())},
        "torque_N_m": float(np.linalg.norm(record.torque[lap], axis=1).max()),
    }

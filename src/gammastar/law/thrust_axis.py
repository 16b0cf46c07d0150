"""The thrust vector of a motion without forces, and how its axis turns: F = m (g e3 - K_t - chi'') = zeta1 R e3 and its derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from gammastar.vehicle import Vehicle


def is_bare(vehicle: Vehicle) -> bool:
    """Return whether nothing but gravity, thrust and constant loads moves a vehicle, so that closed forms hold."""
    return not vehicle.forces and vehicle.added_mass == 0


@np.errstate(over="ignore")  # a speed beyond all bounds demands infinite rates
def thrust_axis(
    vehicle: Vehicle, derivatives: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return thrust (n,), its axis b3 = R e3, b3' and b3'' across b3, (n, 3) each, from position derivatives; without forces."""
    constant = np.array([0.0, 0.0, vehicle.gravity]) - np.asarray(vehicle.bias_acceleration)
    force = vehicle.mass * (constant - derivatives[2])
    force_rate, force_ddot = -vehicle.mass * derivatives[3], -vehicle.mass * derivatives[4]
    thrust = np.linalg.norm(force, axis=1)
    direction = force / thrust[:, None]

    def across(vector: Any) -> Any:
        return vector - direction * np.sum(direction * vector, axis=1, keepdims=True)

    turning = across(force_rate) / thrust[:, None]  # of length sqrt(p^2 + q^2)
    thrust_rate = np.sum(direction * force_rate, axis=1, keepdims=True)
    tilting = (across(force_ddot) - 2 * thrust_rate * turning) / thrust[:, None]
    return thrust, direction, turning, tilting

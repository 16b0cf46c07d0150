"""The package as a witness: its graphs evaluated in floating point at the exact states of the symbolic derivation.

What the package flies and what SymPy derives are written twice, by different means; where they agree, both are believed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from gammastar.claims.symbols import extended_system
from gammastar.law import Law, design
from gammastar.path import Path, catalogue
from gammastar.path.jet import outputs_from_jet
from gammastar.taylor import Series
from gammastar.vehicle import State, Vehicle, join, split

Values = Mapping[Any, Any]  # symbol of the extended system -> rational number

TOLERANCE = 1e-10  # relative; both sides are well conditioned at the states used, so only rounding separates them


def vehicle_of(values: Values) -> Vehicle:
    """Return the package's vehicle with the parameters of an exact state."""
    system = extended_system()
    return Vehicle(
        mass=float(values[system.mass]),
        inertia=[float(values[moment]) for moment in system.inertia],
        gravity=float(values[system.gravity]),
        bias_acceleration=float(values[system.bias_acceleration]),
        bias_torque=float(values[system.bias_torque]),
    )


def state_vector(values: Values) -> np.ndarray:
    """Return the stacked state (20,) of an exact state."""
    return np.array([float(values[symbol]) for symbol in extended_system().state])


def law_of(values: Values, poles: Any = -2.0) -> Law:
    """Return the package's law for the circle of section VI in the paper's own coordinates."""
    return design(vehicle_of(values), paper_circle(), poles=poles)


def paper_circle() -> Path:
    """Return the circle of section VI in the paper's own functions: x1^2 + x2^2 - 1, x3 - 10 and the angle."""
    return catalogue.circle(radius=1.0, center=(0.0, 0.0, 10.0), kind="implicit", coordinates="quadratic")


def rates(values: Values, inputs: Sequence[float]) -> np.ndarray:
    """Return the package's right-hand side of Eq. (7), (20,), at an exact state and input."""
    x, u = ca.SX.sym("x", 20), ca.SX.sym("u", 4)
    state = split(x)
    parts = vehicle_of(values).rates(state, u[0], u[1:4])
    attitude_rate = ca.mtimes(state.attitude, ca.skew(state.angular_velocity))
    moved = state._replace(
        position=parts.position,
        velocity=parts.velocity,
        attitude=attitude_rate,
        angular_velocity=parts.angular_velocity,
        thrust=parts.thrust,
        thrust_rate=parts.thrust_rate,
    )
    return np.array(ca.Function("rates", [x, u], [join(moved)])(state_vector(values), inputs)).ravel()


def decoupling(values: Values) -> np.ndarray:
    """Return the package's decoupling matrix (4, 4) of the paper's circle, Eq. (17)."""
    return law_of(values).decoupling_matrix(State.from_vector(state_vector(values)))


def transformed(values: Values) -> np.ndarray:
    """Return the package's T(x), (20,): xi_1, xi_2, eta_1, eta_2, mu, in the order of Eq. (19)."""
    xi, eta, mu = law_of(values).transformed_state(State.from_vector(state_vector(values)))
    return np.concatenate([xi.ravel(), eta, mu])


def feedback(values: Values, poles: Mapping[str, Any], reference: Sequence[float], yaw: Sequence[float]) -> np.ndarray:
    """Return the package's input (4,), Eqs. (23), (25), (26), with reference jets (5,) and (2,)."""
    law = law_of(values, poles)
    x, parameter = law.start_vector(State.from_vector(state_vector(values)))
    symbol = ca.SX.sym("x", 20)
    control = law.control(split(symbol), parameter, ca.DM(reference), ca.DM(yaw), holds_position=True)
    return np.array(ca.Function("feedback", [symbol], [control.input])(x)).ravel()


def nearest_parameter(jet: Sequence[Any], motion: Sequence[Any]) -> np.ndarray:
    """Return the package's first four derivatives (4,) of the nearest parameter from a curve's jet (6 vectors) and a motion.

    Args:
        jet: sigma, sigma', ..., sigma^(5) at the nearest parameter, three numbers each.
        motion: Position, velocity, acceleration and jerk, three numbers each; the snap is zero.
    """
    position = Series.from_derivatives([ca.SX(np.array(vector, dtype=float)) for vector in motion])
    outputs = outputs_from_jet(tuple(ca.SX(np.array(vector, dtype=float)) for vector in jet), position, ca.SX(0))
    rates = ca.vertcat(outputs.tangential[1:], outputs.tangential_drift)
    return np.array(ca.evalf(rates)).ravel()


def difference(ours: Any, theirs: np.ndarray) -> float:
    """Return the largest difference between an exact array and the package's, relative to the largest entry (at least one)."""
    exact = np.array([float(entry) for entry in ours])
    return float(np.max(np.abs(exact - np.ravel(theirs))) / max(1.0, float(np.max(np.abs(exact)))))

"""The state of a vehicle of the class C_V with its dynamic extension: 20 numbers in the paper's order, Eq. (7)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar import so3
from gammastar.checks import array, magnitudes, number

SIZE = 20
NAMES = (
    *(f"position_{axis}" for axis in "xyz"),
    *(f"velocity_{axis}" for axis in "xyz"),
    *(f"r{row}{column}" for column in (1, 2, 3) for row in (1, 2, 3)),
    *(f"angular_velocity_{axis}" for axis in "xyz"),
    "thrust",
    "thrust_rate",
)


class StateGraph(NamedTuple):
    """Graph: the parts of a state; world frame for position and velocity, body frame for the angular velocity."""

    position: Any  # SX (3,) [m]
    velocity: Any  # SX (3,) [m/s]
    attitude: Any  # SX (3, 3), body to world
    angular_velocity: Any  # SX (3,) [rad/s], body
    thrust: Any  # SX, zeta1 [N]
    thrust_rate: Any  # SX, zeta2 [N/s]


def symbols() -> StateGraph:
    """Graph: return a state of fresh symbols."""
    return StateGraph(
        ca.SX.sym("position", 3),
        ca.SX.sym("velocity", 3),
        ca.SX.sym("attitude", 3, 3),
        ca.SX.sym("angular_velocity", 3),
        ca.SX.sym("thrust"),
        ca.SX.sym("thrust_rate"),
    )


def split(state: Any) -> StateGraph:
    """Graph: return the parts of a stacked state SX (20,)."""
    return StateGraph(state[0:3], state[3:6], ca.reshape(state[6:15], 3, 3), state[15:18], state[18], state[19])


def join(parts: StateGraph) -> Any:
    """Graph: return the stacked state SX (20,) of its parts, the map id x (diamond) x id of the paper's Corollary 7."""
    return ca.vertcat(
        parts.position,
        parts.velocity,
        so3.stack(parts.attitude),
        parts.angular_velocity,
        parts.thrust,
        parts.thrust_rate,
    )


@dataclass(frozen=True, eq=False)
class State:
    """Where a vehicle is, how it is turned and how it moves; world frame third axis down, body rates in body axes.

    Raises:
        ShapeError: A part has the wrong shape or is not finite.
        RotationError: The attitude is farther than 1e-2 from SO(3); nearer ones are projected onto it.
    """

    position: ArrayLike  # (3,) [m]
    velocity: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [m/s]
    attitude: ArrayLike = field(default_factory=lambda: np.eye(3))  # (3, 3), body to world
    angular_velocity: ArrayLike = (0.0, 0.0, 0.0)  # (3,) [rad/s], body
    thrust: float | None = None  # zeta1 [N]; None is the weight of the vehicle that flies
    thrust_rate: float = 0.0  # zeta2 [N/s]
    attitude_distance: float = field(default=0.0, init=False)  # Frobenius distance of the given matrix to SO(3)

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", magnitudes(self.position, "position [m]", (3,)))
        for name in ("velocity", "angular_velocity"):
            object.__setattr__(self, name, array(getattr(self, name), name, (3,)))
        rotation, distance = so3.project(self.attitude)
        rotation.setflags(write=False)
        object.__setattr__(self, "attitude", rotation)
        object.__setattr__(self, "attitude_distance", distance)
        if self.thrust is not None:
            object.__setattr__(self, "thrust", number(self.thrust, "start thrust"))
        object.__setattr__(self, "thrust_rate", number(self.thrust_rate, "start thrust rate"))

    def vector(self, hover_thrust: float) -> np.ndarray:
        """Return the stacked state (20,); a thrust left open becomes `hover_thrust` [N]."""
        thrust = hover_thrust if self.thrust is None else self.thrust
        parts = (
            self.position,
            self.velocity,
            so3.stack(self.attitude),
            self.angular_velocity,
            [thrust, self.thrust_rate],
        )
        return np.concatenate([np.asarray(part, dtype=float) for part in parts])

    @classmethod
    def from_vector(cls, vector: ArrayLike) -> State:
        """Return the state of 20 stacked numbers, the inverse of `vector`."""
        x = array(vector, "state", (SIZE,))
        return cls(x[0:3], x[3:6], so3.unstack(x[6:15]), x[15:18], float(x[18]), float(x[19]))

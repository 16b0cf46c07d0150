"""The feedback law with its numbers: where a flight starts, and its closed form."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from gammastar import engine
from gammastar.checks import instance, number
from gammastar.errors import SingularStartError
from gammastar.law.feedback import Control, Feedback, RateControl, Yaw
from gammastar.law.heading import Heading
from gammastar.law.linearization import decoupling_matrix, linearize
from gammastar.law.predict import Initial, Prediction, chains_from, predict, tangential_chain, transverse_chains
from gammastar.law.reference import AnyReference, reference_given
from gammastar.vehicle import State, split

__all__ = ["Control", "Law", "RateControl", "Yaw"]

SMALLEST_MARGIN = 1e-6  # focal margin at which a start counts as singular; the law's gain grows as its inverse


@dataclass(frozen=True, eq=False)
class Law(Feedback):
    """A path-following law: parameters only, no history; made by `design`."""

    def predict(self, start: State, reference: AnyReference, times: np.ndarray, yaw_reference: Yaw = 0.0) -> Prediction:
        """Return the closed-form flight of the exact model under continuous feedback.

        Valid while the predicted thrust is positive and no focal point is met.

        Args:
            start: As in `fly`.
            reference: Along the path.
            times: (n,) [s], increasing from zero or later.
            yaw_reference: Constant reference of beta(r), or a heading, for which the yaw output has no closed form.

        Raises:
            SingularStartError: The law has no input at the start.
            InputError: Times not increasing or negative.
        """
        instance(start, State, "start", "make one with gs.State(position)")
        reference_given(reference)
        initial = self._initial(start)
        fixed = reference.resolved(self.path, initial.parameter)
        gains = self.gains | {"tangential": self.tangential_gains(fixed.holds_position)}
        constant = None if isinstance(yaw_reference, Heading) else number(yaw_reference, "yaw reference")
        return predict(self.vehicle, self.path, gains, initial, fixed, constant, times)

    def predict_chains(self, start: State, reference: AnyReference, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the closed form of the chains alone at times (n,) [s]: transverse (n, 2, 5) and tangential (n, 5)."""
        initial = self._initial(start)
        fixed = reference.resolved(self.path, initial.parameter)
        gains = self.tangential_gains(fixed.holds_position)
        transverse = transverse_chains(self.path, self.gains, initial, times)
        return transverse, tangential_chain(gains, initial, fixed, times)

    def decay(self, transverse: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the closed form (n, 2, 5) of transverse chains from components (2, 4), at times (n,) [s] since then."""
        return chains_from(self.gains, transverse, times)

    def _initial(self, start: State) -> Initial:
        x, parameter = self.start_vector(start)
        _, xi, eta, *_ = (value.full() for value in self._numbers(x, self.place(parameter)))
        return Initial(x[:3], parameter, xi, eta[:4, 0], float(eta[4, 0]))

    def decoupling_matrix(self, state: State) -> np.ndarray:
        """Return D, Eq. (17), (n + 2, 4) at a state; n is 3 for a curve and 2 for an implicit path."""
        x, parameter = self.start_vector(state)
        return np.array(self._numbers(x, self.place(parameter))[0])

    def transformed_state(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return xi (n, 4), eta (5,) with the yaw output last, and mu (7,), Eqs. (19), (20), at a state."""
        x, parameter = self.start_vector(state)
        _, xi, eta, mu, _, _ = self._numbers(x, self.place(parameter))
        return np.array(xi), np.array(eta).ravel(), np.array(mu).ravel()

    def start_vector(self, start: State) -> tuple[np.ndarray, float]:
        """Return the stacked start (20,) with an open thrust filled in, and its path parameter.

        Raises:
            SingularStartError: The thrust is zero or negative, or the position is a focal point of the path.
        """
        x = start.vector(self.vehicle.weight)
        parameter = self.path.start_parameter(x[:3])
        if not x[18] > 0:
            raise SingularStartError(
                f"thrust at the start must be positive (got {x[18]:.4g} N); in free fall the attitude has no "
                "effect on the motion: start with thrust, such as the weight, or give a vehicle without gravity a start thrust",
                {"thrust_N": float(x[18])},
            )
        margin = self.focal_margin(x, parameter)
        if self.approach is None and not margin > SMALLEST_MARGIN:
            raise SingularStartError(
                f"the start must have one nearest point of the path (got position {x[:3].tolist()} with focal margin {margin:.3g}); "
                "move it off the focal set, such as the axis of a circle, or give the law an approach",
                {"focal_margin": margin},
            )
        return x, parameter

    def can_start(self, states: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return whether the law has an input (n,) at stacked states (20, n), nearest at places (1 + data_size, n)."""
        has_foot = self.approach is not None or self._numbers(states, places)[4].full()[0] > SMALLEST_MARGIN
        return np.asarray((states[18] > 0) & has_foot)

    def focal_margin(self, state: np.ndarray, parameter: float) -> float:
        """Return the focal margin of a stacked state (20,) at a path parameter."""
        return float(self._numbers(state, self.place(parameter))[4])

    def place(self, parameter: float) -> np.ndarray:
        """Return the place (1 + data_size,) of a path parameter: the parameter and the path's data there."""
        return np.asarray(self.places(np.array([parameter]))[:, 0])

    def places(self, parameters: np.ndarray) -> np.ndarray:
        """Return the places (1 + data_size, n) of path parameters (n,)."""
        return np.vstack([parameters, self.path.data(parameters)])

    @functools.cached_property
    def _numbers(self) -> Any:
        """The function (state, place) -> D, xi, eta with yaw output, mu, focal margin, slope of beta."""
        return engine.compiled(
            ("numbers", self.vehicle.signature, self.path.graph_key, self._yaw_output_key), self._build_numbers
        )

    def _build_numbers(self) -> Any:
        state, place = ca.SX.sym("state", 20), ca.SX.sym("place", 1 + self.path.data_size)
        linear = linearize(self.vehicle, self.path, split(state), place, self.yaw_output)
        eta = ca.vertcat(linear.outputs.tangential, linear.yaw_value)
        results = [
            decoupling_matrix(linear),
            linear.outputs.transverse,
            eta,
            linear.internal_state(),
            linear.outputs.focal_margin,
            linear.yaw_slope,
        ]
        return ca.Function("numbers", [state, place], ca.cse([ca.densify(result) for result in results]))

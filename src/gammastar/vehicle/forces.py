"""Forces beside thrust and gravity, as graphs of where the vehicle is, how it moves through the air and how it is turned.

The law differentiates them twice along the flow.  They may depend on position, velocity, attitude and thrust: the fourth derivative of
position is then still the first one that torques reach, relative degree {4, 4, 4, 1}.  A force of the body rates would bring the torques
into the third derivative already, and one of the thrust rate the second derivative of the thrust: both leave the class of vehicles.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import instance, magnitude, magnitudes, shortened, three
from gammastar.errors import InputError
from gammastar.vehicle.state import StateGraph, symbols


class Force(ABC):
    """A force on the vehicle."""

    @property
    @abstractmethod
    def signature(self) -> tuple[Any, ...]:
        """Return what names the force's graph: forces with one signature act alike."""

    @abstractmethod
    def value(self, state: StateGraph, wind: Any) -> Any:
        """Graph: return the force SX (3,) [N], world, in air that moves at wind SX (3,) [m/s], world."""

    def scaled(self, factor: float) -> Force:
        """Return the same force, a factor as large."""
        return dataclasses.replace(self, coefficients=factor * np.asarray(self.coefficients))  # type: ignore[attr-defined, type-var]


@dataclass(frozen=True, eq=False)
class LinearDrag(Force):
    """Drag in proportion to the velocity through the air, in body axes: -R C R^T w.

    Of a rotorcraft near hover this is what its rotors do (Faessler, Franchi, Scaramuzza, RA-L 2018); of a slow underwater vehicle
    it is the linear damping.
    """

    coefficients: ArrayLike  # (3,) or one number [kg/s], diagonal of C, body axes

    def __post_init__(self) -> None:
        _set_coefficients(self, "linear drag [kg/s]")

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return the kind and its numbers."""
        return ("linear drag", *np.asarray(self.coefficients).tolist())

    def value(self, state: StateGraph, wind: Any) -> Any:
        """Graph: return -R C R^T w SX (3,) [N], world."""
        through_air = ca.mtimes(state.attitude.T, state.velocity - wind)
        return -ca.mtimes(state.attitude, ca.DM(np.asarray(self.coefficients)) * through_air)


@dataclass(frozen=True, eq=False)
class RotorDrag(Force):
    """Drag of spinning rotors, in body axes: -sqrt(thrust) R C R^T w.

    The drag of a rotor is its speed times its velocity through the air times a coefficient k; n equal rotors of thrust k_eta w^2 that
    share the thrust turn at w = sqrt(thrust / (n k_eta)), so C = k sqrt(n / k_eta).
    """

    coefficients: ArrayLike  # (3,) or one number [kg/s per sqrt(N)], diagonal of C, body axes
    smoothing: float = 1e-3  # [N] of thrust, below which the root is rounded off so that it has derivatives at zero

    def __post_init__(self) -> None:
        _set_coefficients(self, "rotor drag [kg/s per sqrt(N)]")
        object.__setattr__(self, "smoothing", magnitude(self.smoothing, "smoothing of rotor drag [N]", above=0))

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return the kind and its numbers."""
        return ("rotor drag", *np.asarray(self.coefficients).tolist(), self.smoothing)

    def value(self, state: StateGraph, wind: Any) -> Any:
        """Graph: return -sqrt(thrust) R C R^T w SX (3,) [N], world."""
        root = (state.thrust**2 + self.smoothing**2) ** 0.25
        through_air = ca.mtimes(state.attitude.T, state.velocity - wind)
        return -ca.mtimes(state.attitude, ca.DM(np.asarray(self.coefficients)) * root * through_air)


@dataclass(frozen=True, eq=False)
class QuadraticDrag(Force):
    """Drag that grows with the square of the velocity through the air, in body axes: -R C |w| w, rounded off at zero.

    |w| is sqrt(|w|^2 + smoothing^2), which has all derivatives.  With unequal coefficients it is also the lift of a flat wing: normal
    to the wing C is large, along it small (Lustosa, Defay, Moschetta, J. Guidance 2019).
    """

    coefficients: (
        ArrayLike  # (3,) or one number [kg/m], diagonal of C, body axes: 1/2 density times area times drag coefficient
    )
    each_axis: bool = False  # |w_i| w_i axis by axis, as underwater damping is given, instead of |w| w_i
    smoothing: float = 0.01  # [m/s]

    def __post_init__(self) -> None:
        _set_coefficients(self, "quadratic drag [kg/m]")
        object.__setattr__(self, "smoothing", magnitude(self.smoothing, "smoothing of drag [m/s]", above=0))
        if not isinstance(self.each_axis, (bool, np.bool_)):
            raise InputError(f"each_axis must be true or false (got {shortened(self.each_axis)}); give one of the two")

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return the kind and its numbers."""
        return ("quadratic drag", *np.asarray(self.coefficients).tolist(), bool(self.each_axis), self.smoothing)

    def value(self, state: StateGraph, wind: Any) -> Any:
        """Graph: return -R C |w| w SX (3,) [N], world."""
        through_air = ca.mtimes(state.attitude.T, state.velocity - wind)
        square = through_air**2 if self.each_axis else ca.dot(through_air, through_air)
        speed = ca.sqrt(square + self.smoothing**2)
        return -ca.mtimes(state.attitude, ca.DM(np.asarray(self.coefficients)) * speed * through_air)


@dataclass(frozen=True, eq=False)
class Buoyancy(Force):
    """The weight of the displaced fluid, upwards at the centre of mass: -density volume g e3."""

    volume: float  # [m^3]
    density: float = 1000.0  # [kg/m^3], fresh water
    gravity: float = 9.80665  # [m/s^2]

    def __post_init__(self) -> None:
        for name, unit in (("volume", "m^3"), ("density", "kg/m^3"), ("gravity", "m/s^2")):
            object.__setattr__(self, name, magnitude(getattr(self, name), f"{name} of buoyancy [{unit}]", above=0))

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return the kind and its numbers."""
        return ("buoyancy", self.lift)

    def scaled(self, factor: float) -> Buoyancy:
        """Return the buoyancy itself: it is no drag, and what varies in drag leaves it as it is."""
        return self

    @property
    def lift(self) -> float:
        """Return the magnitude of the force [N]."""
        return self.volume * self.density * self.gravity

    def value(self, state: StateGraph, wind: Any) -> Any:
        """Graph: return the force SX (3,) [N], world."""
        return ca.SX(ca.DM([0.0, 0.0, -self.lift]))


@dataclass(frozen=True, eq=False)
class CustomForce(Force):
    """A force of your own: a function of a `StateGraph` and the wind that returns three CasADi scalars, smooth in all of them.

    Raises:
        InputError: The function returns something else, or depends on the body rates or the thrust rate.
    """

    graph: Callable[[StateGraph, Any], Any]  # (state, wind SX (3,) [m/s]) -> SX (3,) [N], world
    name: str = "custom force"

    def __post_init__(self) -> None:
        if not callable(self.graph):
            raise InputError(
                f"a {self.name} must be a function of state and wind (got {shortened(self.graph)}); see gs.CustomForce"
            )
        state, wind = symbols(), ca.SX.sym("wind", 3)
        value = self.graph(state, wind)
        if not isinstance(value, (ca.SX, ca.DM)) or value.shape != (3, 1):
            raise InputError(
                f"the function of a {self.name} must return three CasADi scalars (got {shortened(value)}); use casadi.vertcat"
            )
        known = ca.veccat(*state, wind)
        if strange := [each for each in ca.symvar(ca.SX(value)) if not ca.depends_on(known, each)]:
            raise InputError(
                f"the function of a {self.name} must use its two arguments alone (got the symbol {strange[0]} beside them); "
                "put numbers in its place"
            )
        for part, why in (("angular_velocity", "body rates"), ("thrust_rate", "thrust rate")):
            if ca.depends_on(ca.SX(value), getattr(state, part)):
                raise InputError(
                    f"a {self.name} must depend on position, velocity, attitude and thrust alone (got one of the {why}): the input "
                    "would reach the third derivative of position already, relative degree {4, 4, 4, 1} is lost and the vehicle leaves "
                    "the class; drop that part, or leave it to the disturbance observer"
                )
        self._require_finite(state, wind, ca.SX(value))

    def scaled(self, factor: float) -> CustomForce:
        """Return the same force, a factor as large."""
        return CustomForce(lambda state, wind: factor * self.graph(state, wind), self.name)

    def _require_finite(self, state: StateGraph, wind: Any, value: Any) -> None:
        """Raise `InputError` when the force or its slope is not finite at rest, where many a formula has its kink."""
        arguments = [ca.vertcat(state.position, state.velocity, ca.vec(state.attitude), state.thrust), wind]
        function = ca.Function("force", arguments, [value, ca.jacobian(value, arguments[0])])
        at_rest = [*np.zeros(6), *np.eye(3).ravel(), 1.0]
        if not all(np.isfinite(each.full()).all() for each in function(at_rest, np.zeros(3))):
            raise InputError(
                f"a {self.name} must be finite and differentiable at rest too (got NaN or infinity there); round it off, such as |w| by "
                "sqrt(w^2 + 0.01^2)"
            )

    @property
    def signature(self) -> tuple[Any, ...]:
        """Return the kind and the graph as text: a function over changed data is another one."""
        state, wind = symbols(), ca.SX.sym("wind", 3)
        arguments = [state.position, state.velocity, state.attitude, state.thrust, wind]
        return ("custom force", str(ca.Function("force", arguments, [ca.SX(self.graph(state, wind))]).serialize()))

    def value(self, state: StateGraph, wind: Any) -> Any:
        """Graph: return the force SX (3,) [N], world."""
        return ca.SX(self.graph(state, wind))


def listed(forces: Any) -> tuple[Force, ...]:
    """Return the forces as a tuple, or raise."""
    if isinstance(forces, Force) or not isinstance(forces, Sequence):
        raise InputError(f"forces must be a list (got {shortened(forces)}); write forces=[LinearDrag(0.1)]")
    for force in forces:
        instance(force, Force, "each of the forces", "make one such as gs.LinearDrag(0.1)")
    return tuple(forces)


def _set_coefficients(force: Any, name: str) -> None:
    """Check the coefficients of a drag and make them three; a negative one would drive the vehicle."""
    values = magnitudes(three(force.coefficients, name), name, (3,))
    if np.any(np.asarray(values) < 0):
        raise InputError(
            f"{name} must not be negative (got {np.asarray(values).tolist()}); drag acts against the motion"
        )
    object.__setattr__(force, "coefficients", values)

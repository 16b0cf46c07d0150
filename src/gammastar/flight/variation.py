"""What differs from flight to flight beside the start: numbers of the true vehicle, noise, wind, and the law's tuning.

Flights that differ in these alone take one step, whose graph has them as parameters, and each gives its own numbers.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from gammastar.checks import array as numbers
from gammastar.checks import instance, shape_of, shortened
from gammastar.errors import InputError, ShapeError, UnknownNameError
from gammastar.law import Law, Observer
from gammastar.law.guidance import Guidance
from gammastar.law.tuned import Tuning, tuned
from gammastar.vehicle import Scales, Vehicle, varied

POSITIVE, NOT_NEGATIVE = "positive", "not negative"


class Quantity(NamedTuple):
    """What may differ in what really flies."""

    size: int = 1  # how many numbers it is
    sign: str | None = POSITIVE  # that they must have


QUANTITIES = {
    "mass_scale": Quantity(),
    "inertia_scale": Quantity(3),
    "thrust_scale": Quantity(),
    "lag_scale": Quantity(),
    "force_scale": Quantity(),
    "noise_scale": Quantity(sign=NOT_NEGATIVE),
    "rate_bandwidth": Quantity(),  # [rad/s]
    "wind": Quantity(3, None),  # [m/s]
}
TUNING = {"approach_speed": 1, "force_observer": 1, "torque_observer": 1}


class Variation(NamedTuple):
    """Graphs SX (k,) of what varies, or the numbers (k,) of one flight, by name."""

    values: Mapping[str, Any]

    def vehicle(self, vehicle: Vehicle) -> Vehicle:
        """Graph: return the true vehicle."""
        scales = {name: self.values.get(f"{name}_scale") for name in Scales._fields}
        given, bandwidth = {k: v for k, v in scales.items() if v is not None}, self.values.get("rate_bandwidth")
        return vehicle if not given and bandwidth is None else varied(vehicle, Scales(**given), bandwidth)

    @property
    def thrust(self) -> Any:
        """Graph: return what the rotors' thrust coefficients are multiplied by."""
        return self.values.get("thrust_scale", 1.0)

    @property
    def lag(self) -> Any:
        """Graph: return what the rotors' lag is multiplied by."""
        return self.values.get("lag_scale", 1.0)

    @property
    def noise(self) -> Any:
        """Graph: return what the noise of the sensors is multiplied by."""
        return self.values.get("noise_scale", 1.0)

    @property
    def wind(self) -> Any:
        """Graph: return the velocity SX (3,) [m/s], world, that is added to the wind."""
        return self.values.get("wind", ca.DM.zeros(3))

    def law(self, law: Law) -> Law:
        """Graph: return the law with its tuning."""
        gains = {chain: self.values[chain] for chain in law.gains if chain in self.values}
        others = (self.values.get(name) for name in TUNING)
        return tuned(law, Tuning(gains or None, *others))


NOTHING = Variation({})


def sizes_of(names: Sequence[str], law: Law) -> dict[str, int]:
    """Return the sizes of quantities that vary, in the order of their names."""
    own = {name: quantity.size for name, quantity in QUANTITIES.items()}
    chains = {chain: len(gains) for chain, gains in law.gains.items()}
    return {name: (own | TUNING | chains)[name] for name in names}


def constants_of(guidance: Guidance, names: Iterable[str]) -> Guidance:
    """Return a guidance of which all is a constant of the graph: where the tuning varies, with some or other in its place."""
    return guidance if set(names) <= set(QUANTITIES) else dataclasses.replace(guidance, law=_untuned(guidance.law))


def parameters_of(names: Sequence[str], law: Law) -> Any:
    """Graph: return the symbols SX (p,) of what varies, one below the other."""
    return ca.SX.sym("parameters", sum(sizes_of(names, law).values()))


def graphs_of(names: Sequence[str], law: Law, parameters: Any) -> Variation:
    """Graph: return what varies, from the parameters of a step, one below the other."""
    sizes = sizes_of(names, law)
    parts = ca.vertsplit(parameters, np.cumsum([0, *sizes.values()]).tolist())
    return Variation(dict(zip(sizes, parts, strict=True)))


def unknown_in(results: Sequence[Any], known: Sequence[Any]) -> Any:
    """Graph: return the symbols SX (k,) in graphs that are none of those known: what varies from flight to flight."""
    names = ca.veccat(*known)
    return ca.vertcat(*(each for each in ca.symvar(ca.veccat(*results)) if not ca.depends_on(names, each)))


def given_quantities(given: Mapping[str, ArrayLike] | None, count: int) -> dict[str, np.ndarray]:
    """Return what varies of the truth in some flights, (k, count) by name; checked.

    Raises:
        InputError: A quantity is unknown, has not one value a flight, or is not finite; a scale is not positive.
    """
    result = dict[str, np.ndarray]()
    instance({} if given is None else given, Mapping, "varied", 'write {"mass_scale": [...]}')
    for name, values in (given or {}).items():
        if name not in QUANTITIES:
            raise UnknownNameError("what varies", name, QUANTITIES)
        shape, (size, sign) = shape_of(values), QUANTITIES[name]
        if shape not in (
            {(count,), (count, 3)} if name == "inertia_scale" else {(count,) if size == 1 else (count, 3)}
        ):
            wanted = f"({count},)" if size == 1 else f"({count}, 3)"
            raise ShapeError(f"{name} must have shape {wanted} (got {shape}); give one value a flight")
        array = numbers(values, name, shape or ())
        columns = np.tile(array, (size, 1)) if array.ndim == 1 else array.T
        if sign and not np.all(columns > 0 if sign == POSITIVE else columns >= 0):
            raise InputError(
                f"{name} must be finite and {sign} in every flight (got {shortened(array.tolist())}); correct it"
            )
        result[name] = np.ascontiguousarray(columns)
    return result


def require_effect(names: Iterable[str], truth: Vehicle, interface: str, is_noisy: bool) -> None:
    """Raise `InputError` when something varies that the vehicle that flies does not have."""
    rotors = truth.rotors if interface == "wrench" else None
    has = {
        "thrust_scale": (rotors is not None, "rotors that the law commands"),
        "lag_scale": (rotors is not None and np.any(rotors.lag), "rotors that the law commands and that lag"),
        "noise_scale": (is_noisy, "sensors that are noisy"),
        "rate_bandwidth": (interface == "rates", "an inner loop that takes body rates"),
        "force_scale": (truth.feels_the_air, "forces other than buoyancy"),
        "wind": (truth.feels_the_air, "forces that depend on the air"),
    }
    for name in names:
        found, what = has.get(name, (True, ""))
        if not found:
            raise InputError(f"{name} needs a vehicle with {what} (got one without); leave it out")


def tunings(laws: Sequence[Law]) -> dict[str, np.ndarray]:
    """Return the tuning of laws that differ in that and in their paths' data alone, (k, laws) by name.

    Raises:
        InputError: They differ in more than poles, approach speed, observer bandwidths and the data of their paths.
    """
    first, kinds = laws[0], {_kind(law): law for law in laws}
    if len({_untuned(law).signature for law in kinds.values()}) > 1:
        raise InputError(
            "laws of flights that are flown together must differ in poles, approach speed, observer bandwidths and the numbers of their "
            "paths alone (got laws of other vehicles, interfaces, observers or approaches of other kinds, or paths with other formulas); "
            "fly them apart"
        )
    columns = {chain: np.array([law.gains[chain] for law in laws]).T for chain in first.gains}
    if first.approach is not None:
        columns["approach_speed"] = np.array([[law.approach.speed for law in laws if law.approach]])
    if isinstance(first.rejection, Observer):
        for name in ("force", "torque"):
            if getattr(first.rejection, name) is not None:
                columns[f"{name}_observer"] = np.array([[getattr(law.rejection, name) for law in laws]])
    return columns


def _kind(law: Law) -> tuple[Any, ...]:
    """Return what tells apart laws that may differ in more than their tuning: the objects that they share otherwise."""
    approach, rejection = law.approach, law.rejection
    has = (rejection.force is None, rejection.torque is None) if isinstance(rejection, Observer) else id(rejection)
    bounds = None if approach is None else (approach.thrust_floor, approach.leave, approach.enter)
    shared = id(law.vehicle), law.path.graph_key, id(law.yaw_output), id(law.estimator)
    return (*shared, bounds, has, law.interface, tuple(map(len, law.poles.values())))


def with_path_data(laws: Sequence[Law]) -> list[Law]:
    """Return laws whose paths share a graph where they can: of paths that differ the numbers become data."""
    for law in {id(law): law for law in laws}.values():
        instance(law, Law, "law", "make one with gs.design(vehicle, path)")
    if all(law.path is laws[0].path for law in laws):
        return list(laws)
    paths = {id(law.path): law.path.with_data() for law in laws}
    found = {id(law): dataclasses.replace(law, path=paths[id(law.path)]) for law in laws}
    return [found[id(law)] for law in laws]


def _untuned(law: Law) -> Law:
    """Return a law with some tuning or other in place of its own."""
    changed: dict[str, Any] = {"poles": {chain: (-1.0,) * len(poles) for chain, poles in law.poles.items()}}
    if law.approach is not None:
        changed["approach"] = dataclasses.replace(law.approach, speed=1.0)
    if isinstance(law.rejection, Observer):
        force, torque = (None if part is None else 1.0 for part in (law.rejection.force, law.rejection.torque))
        changed["rejection"] = Observer(force, torque)
    return dataclasses.replace(law, **changed)

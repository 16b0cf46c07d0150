"""From a vehicle, a path and poles to the feedback law, Eqs. (23), (25), (26)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from gammastar.checks import instance, shape_of, shortened
from gammastar.errors import InputError, PoleError, UnknownNameError
from gammastar.law.approach import Approach
from gammastar.law.filter import KalmanFilter
from gammastar.law.gains import chain_poles, without_slowest
from gammastar.law.law import Law
from gammastar.law.observer import IntegralAction, Observer, Rejection
from gammastar.path import Path
from gammastar.vehicle import Vehicle

DEFAULT_POLES = (-2.2, -2.4, -2.6, -2.8)  # [1/s] distinct and near -2.5, the design's choice for the paper's scenarios
DEFAULT_YAW_POLE = -2.5  # [1/s]
CHAINS = {"transverse": 4, "transverse_2": 4, "tangential": 4, "speed": 3, "yaw": 1}  # states that each chain has
INTERFACES = ("wrench", "rates")
YAW_RATE_RANGE = 100.0  # [rad/s] over which the slope of a yaw output is checked

Poles = complex | Sequence[complex] | Mapping[str, Any]


def design(
    vehicle: Vehicle,
    path: Path,
    poles: Poles = DEFAULT_POLES,
    yaw_output: Callable[[Any], Any] | None = None,
    approach: Approach | None = None,
    rejection: Rejection | None = None,
    estimator: KalmanFilter | None = None,
    interface: str = "wrench",
) -> Law:
    """Return the path-following law of a vehicle and a path with prescribed poles.

    Args:
        vehicle: As the law believes it to be.
        path: Curve or implicit path.
        poles: [1/s] One number for every pole; four numbers for the transverse and tangential chains alike; or a
            mapping with the keys 'transverse', 'transverse_2' (implicit paths only: its own poles for s2),
            'tangential', 'speed' (three, used when only a speed is asked for) and 'yaw', each one number or as many as
            the chain has states.  What a mapping leaves out keeps the default; 'speed' follows 'tangential' without its
            slowest pole.
        yaw_output: Graph beta(r) of Eq. (14), smooth and with a slope that never vanishes; r itself when left out.
        approach: Bounds and modes that bring the vehicle in from anywhere, for a curve; none when left out.
        rejection: `Observer` or `IntegralAction`: what estimates unknown forces and torques; none when left out.
        interface: 'wrench' commands thrust and torque, or rotor speeds; 'rates' thrust and body rates, one integrator less: every chain
            is one state shorter, and of poles that are given for the longer chain the slowest is left out.
        estimator: `KalmanFilter` between sensors and law; measurements are taken as they are when left out.

    Raises:
        PoleError: Unstable or unpaired poles, or a number of poles that does not fit.
        InputError: The slope of the yaw output vanishes, or an argument is of another kind.
    """
    instance(vehicle, Vehicle, "vehicle", "make one with gs.Vehicle(mass, inertia)")
    instance(path, Path, "path", "make one with gs.paths, such as gs.paths.circle()")
    if approach is not None:
        instance(approach, Approach, "approach", "make one with gs.Approach()")
    if rejection is not None:
        instance(
            rejection, (Observer, IntegralAction), "rejection", "make one with gs.Observer() or gs.IntegralAction()"
        )
    if estimator is not None:
        instance(estimator, KalmanFilter, "estimator", "make one with gs.KalmanFilter(**sensors.deviations())")
    if interface not in INTERFACES:
        raise UnknownNameError("interface", interface, INTERFACES)
    resolved = chains_of(poles, path, interface)
    if approach is not None:
        if path.components != 3:
            raise InputError(
                "an approach from anywhere needs a curve (got an implicit path, which has no jet); give a curve"
            )
        approach.floor(vehicle)
    law = Law(vehicle, path, resolved, yaw_output or _body_rate, approach, rejection, estimator, interface)
    assert law.gains  # refuses bad poles now, not in flight
    _check_yaw_output(law.yaw_output)
    return law


def by_chain(poles: Poles) -> dict[str, Any]:
    """Return poles by chain, as they are given: a number is for all chains, a list for those that have as many states."""
    if isinstance(poles, Mapping):
        return dict(poles)
    return {"transverse": poles, "tangential": poles} | ({"yaw": poles} if shape_of(poles) == () else {})


def chains_of(poles: Poles, path: Path, interface: str) -> dict[str, tuple[complex, ...]]:
    """Return the poles [1/s] of all chains of a law, from those that are given; see `design`.

    Raises:
        PoleError: A number of poles does not fit its chain, or they are those of a chain that the path does not have.
        UnknownNameError: There is no chain of a name.
    """
    given = by_chain(poles)
    for key in given:
        if key not in CHAINS:
            raise UnknownNameError("a chain of poles", key, CHAINS)
    if "transverse_2" in given and path.components == 3:
        raise PoleError(
            "transverse_2 poles need an implicit path (got a curve, whose normal plane has no preferred axes); "
            "give 'transverse' alone, or use an implicit path"
        )
    chosen = {"transverse": DEFAULT_POLES, "tangential": DEFAULT_POLES, "yaw": DEFAULT_YAW_POLE} | given
    chosen.setdefault("transverse_2", chosen["transverse"])
    resolved = {chain: _poles(chosen[chain], chain, interface) for chain in chosen}
    resolved.setdefault("speed", without_slowest(resolved["tangential"]))
    return {chain: resolved[chain] for chain in CHAINS}  # laws with the same chains have the same signature


def _poles(given: Any, chain: str, interface: str) -> tuple[complex, ...]:
    """Return the poles of a chain: as many as it has states with an interface."""
    count = CHAINS[chain]
    if interface == "wrench" or chain == "yaw":
        return chain_poles(given, count, chain)
    if np.size(given) == count:
        return without_slowest(chain_poles(given, count, chain))
    return chain_poles(given, count - 1, chain)


def _body_rate(yaw_rate: Any) -> Any:
    """Graph: the paper's simplest beta: r itself."""
    return yaw_rate


def _check_yaw_output(yaw_output: Callable[[Any], Any]) -> None:
    symbol = ca.SX.sym("yaw_rate")
    value = yaw_output(symbol)
    if not isinstance(value, ca.SX) or value.shape != (1, 1):
        raise InputError(
            f"the yaw output beta(r) must return one CasADi scalar (got {shortened(value)}); use casadi functions of r"
        )
    slope = ca.Function("slope", [symbol], [ca.densify(ca.jacobian(value, symbol))])
    grid = np.linspace(-YAW_RATE_RANGE, YAW_RATE_RANGE, 2001)
    slopes = np.array(slope(grid[None, :])).ravel()
    worst = int(np.argmin(np.abs(slopes)))
    if not np.all(np.isfinite(slopes)) or np.any(slopes == 0) or np.any(np.sign(slopes) != np.sign(slopes[0])):
        raise InputError(
            f"the yaw output beta(r) must be smooth with a slope that never vanishes (got slope {slopes[worst]:.3g} at "
            f"r = {grid[worst]:.3g} rad/s); use a strictly monotonic function such as r or sinh(r)"
        )

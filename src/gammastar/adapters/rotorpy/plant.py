"""RotorPy's side: its vehicles as ours, a start and a flight in both axes, and its environment around a controller."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from gammastar.adapters.rotorpy.controller import FRAME, RATE, Controller
from gammastar.checks import instance, number, shortened
from gammastar.errors import InputError, MissingExtraError, UnknownNameError
from gammastar.frames import REVERSAL, convert_attitude, convert_vector
from gammastar.vehicle import Rotors, State, Vehicle

GRAVITY = 9.81  # [m/s^2] RotorPy's own, in rotorpy.vehicles.multirotor
ABSTRACTIONS = (
    "cmd_motor_speeds",
    "cmd_motor_thrusts",
    "cmd_ctbm",
)  # of RotorPy, that leave the wrench to a controller
NEEDED = (
    *("mass", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "rotor_pos", "rotor_directions"),
    *("k_eta", "k_m", "rotor_speed_max", "rotor_speed_min", "tau_m"),
)  # of a vehicle's parameters, for its model
SUFFIX = "_params"  # of the modules in which RotorPy keeps its vehicles


class Flown(NamedTuple):
    """What flew in RotorPy, in our axes."""

    time: np.ndarray  # (n,) [s]
    position: np.ndarray  # (n, 3) [m], world
    velocity: np.ndarray  # (n, 3) [m/s], world
    attitude: np.ndarray  # (n, 3, 3), body to world
    angular_velocity: np.ndarray  # (n, 3) [rad/s], body
    rotor_speeds: np.ndarray  # (n, rotors) [rad/s]


def parameters(name: str) -> dict[str, Any]:
    """Return RotorPy's parameters of one of its vehicles, such as 'hummingbird' or 'crazyflie'.

    Raises:
        MissingExtraError: RotorPy is not installed.
        UnknownNameError: RotorPy has no such vehicle.
    """
    vehicles = _library("rotorpy.vehicles")
    modules = [each.name for each in pkgutil.iter_modules(vehicles.__path__)]
    known = [module.removesuffix(SUFFIX) for module in modules if module.endswith(SUFFIX)]
    if name not in known:
        raise UnknownNameError("a vehicle of RotorPy", name, known)
    return dict(_library(f"rotorpy.vehicles.{name}{SUFFIX}").quad_params)


def vehicle_of(parameters: Mapping[str, Any]) -> Vehicle:
    """Return the vehicle of RotorPy's parameters: mass, inertia and rotors, without any aerodynamics.

    What is left out is for an observer; to know it too, give the vehicle forces with `dataclasses.replace`.
    """
    _require(parameters, *NEEDED)
    moments = {axes: float(parameters[f"I{axes}"]) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")}
    rows = [("xx", "xy", "xz"), ("xy", "yy", "yz"), ("xz", "yz", "zz")]
    inertia = np.array([[moments[axes] for axes in row] for row in rows])
    positions = convert_vector(np.array(list(parameters["rotor_pos"].values()), dtype=float), FRAME)
    # A direction of +1 is a torque on the body about the axis up: of a rotor that turns clockwise, as a spin of +1 does.
    rotors = Rotors(
        positions,
        spins=parameters["rotor_directions"],
        thrust_coefficient=parameters["k_eta"],
        torque_coefficient=parameters["k_m"],
        fastest=parameters["rotor_speed_max"],
        slowest=parameters["rotor_speed_min"],
        lag=parameters["tau_m"],
    )
    return Vehicle(float(parameters["mass"]), REVERSAL @ inertia @ REVERSAL, GRAVITY, rotors=rotors)


def initial_state(parameters: Mapping[str, Any], start: State) -> dict[str, np.ndarray]:
    """Return a start as RotorPy wants it, with rotors that share its thrust, or the weight where it is left open."""
    instance(start, State, "start", "make one with gs.State(position)")
    _require(parameters, "mass", "num_rotors", "k_eta")
    weight = float(parameters["mass"]) * GRAVITY
    count = int(parameters["num_rotors"])
    thrust = weight if start.thrust is None else number(start.thrust, "thrust at the start [N]", at_least=0)
    speed = np.sqrt(thrust / count / float(parameters["k_eta"]))
    return {
        "x": convert_vector(start.position, FRAME),
        "v": convert_vector(start.velocity, FRAME),
        "q": Rotation.from_matrix(convert_attitude(start.attitude, FRAME)).as_quat(),
        "w": convert_vector(start.angular_velocity, FRAME),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(count, speed),
    }


def environment(
    controller: Any,
    parameters: Mapping[str, Any],
    start: State,
    *,
    aerodynamics: bool = True,
    abstraction: str = "cmd_motor_speeds",
    **others: Any,
) -> Any:
    """Return RotorPy's `Environment` around a controller, ready to `run(t_final, terminate=False)`.

    Args:
        controller: Ours, whose rate becomes that of the simulation, or one of RotorPy's, which is called at the default rate.
        parameters: Of the vehicle that flies, as RotorPy has them.
        start: Where it begins.
        aerodynamics: Whether RotorPy's drag and inflow act.
        abstraction: One of `ABSTRACTIONS`, in which the command is passed on.
        others: For `Environment`, such as wind_profile; a trajectory, which the law does not use, hovers when left out.

    Raises:
        MissingExtraError: RotorPy is not installed.
        UnknownNameError: The abstraction is not one that commands a wrench.
    """
    if abstraction not in ABSTRACTIONS:
        raise UnknownNameError("abstraction", abstraction, ABSTRACTIONS)
    environments, multirotor = _library("rotorpy.environments"), _library("rotorpy.vehicles.multirotor")
    if "trajectory" not in others:
        others["trajectory"] = _library("rotorpy.trajectories.hover_traj").HoverTraj()
    vehicle = multirotor.Multirotor(
        dict(parameters),
        initial_state=initial_state(parameters, start),
        control_abstraction=abstraction,
        aero=aerodynamics,
    )
    rate = controller.rate if isinstance(controller, Controller) else RATE
    return environments.Environment(vehicle=vehicle, controller=controller, sim_rate=rate, **others)


def flown(result: Mapping[str, Any]) -> Flown:
    """Return what RotorPy's `run` gave, or a part of it with time and state, in our axes."""
    state = result["state"]
    return Flown(
        time=np.asarray(result["time"], dtype=float),
        position=convert_vector(state["x"], FRAME),
        velocity=convert_vector(state["v"], FRAME),
        attitude=convert_attitude(Rotation.from_quat(state["q"]).as_matrix(), FRAME),
        angular_velocity=convert_vector(state["w"], FRAME),
        rotor_speeds=np.asarray(state["rotor_speeds"], dtype=float),
    )


def _require(parameters: Mapping[str, Any], *names: str) -> None:
    """Raise `InputError` for the first parameter that is missing."""
    instance(parameters, Mapping, "parameters", "take those of a vehicle, as rotorpy.parameters('hummingbird')")
    for name in names:
        if name not in parameters:
            raise InputError(f"parameters of RotorPy must have {name!r} (got {shortened(sorted(parameters))}); add it")


def _library(module: str) -> Any:
    """Return a module of RotorPy, or raise `MissingExtraError`."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError("rotorpy", "rotorpy", "flying in RotorPy") from error

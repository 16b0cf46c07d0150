"""The one place where a mission's own frame is turned into `ned`, in which everything inside is computed, and results back.

Every number of a mission is read in the mission's frame, defaults included: the default normal (0, 0, 1) of a circle is down in
`ned` and up in `enu`, so the circle runs right-handed about it in both, clockwise on a map in `ned` and anticlockwise in `enu`.
S = diag(1, -1, -1) is a rotation, so what is right-handed stays right-handed, a helix keeps the sign of its pitch, and path
parameters, speeds along the path and transverse states are the same numbers in both frames.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gammastar.flight import FlightRecord
from gammastar.flight.autopilot_rows import AutopilotRows
from gammastar.frames import REVERSAL, convert_attitude, convert_vector
from gammastar.path import Curve, Path, catalogue
from gammastar.path.placement import Placement, placed
from gammastar.vehicle import Rotors, State, Vehicle

VECTORS = (
    "center",
    "normal",
    "axis",
    "point",
    "along",
    "direction",
)  # arguments that are points or directions in space


def vehicle_in_ned(vehicle: Vehicle, frame: str) -> Vehicle:
    """Return a vehicle whose numbers were given in `frame`: loads turn as vectors, the inertia as S J S, rotors with their places."""
    return dataclasses.replace(
        vehicle,
        inertia=convert_attitude(vehicle.inertia, frame),
        bias_acceleration=convert_vector(vehicle.bias_acceleration, frame),
        bias_torque=convert_vector(vehicle.bias_torque, frame),
        rotors=None if vehicle.rotors is None else rotors_in_ned(vehicle.rotors, frame),
    )


def rotors_in_ned(rotors: Rotors, frame: str) -> Rotors:
    """Return rotors whose numbers were given in `frame`: places turn as vectors, and so does the axis about which they spin."""
    places = np.array([convert_vector(each, frame) for each in np.asarray(rotors.positions)])
    third = float(convert_vector((0.0, 0.0, 1.0), frame)[2])
    return dataclasses.replace(rotors, positions=places, spins=third * np.asarray(rotors.spins))


def path_in_ned(factory: Callable[..., Path], arguments: Mapping[str, Any], frame: str) -> Path:
    """Return the path of a factory whose arguments were given in `frame`.

    Where vectors give a path they turn; the heading of a loop runs from the first axis towards the second one, which points the
    other way in `enu`, and its lowest point stays the lowest.  Every other path is written in the axes of its frame and is turned as
    a whole: what is knotted right-handed in one frame is in the other.  But upwards is upwards: what is made to rise rises.
    """
    if frame == "ned":
        return factory(**arguments)
    if set(VECTORS) & set(arguments):
        turned = arguments_in_ned(arguments, frame)
        return factory(**(turned | {"heading": -turned["heading"]} if "heading" in turned else turned))
    path: Any = factory(**arguments)
    rises = factory is catalogue.spiral or arguments.get("kind") == "rising"
    turned_whole: Path = _risen(path) if rises else placed(path, rotation=REVERSAL)
    return turned_whole


def arguments_in_ned(arguments: Mapping[str, Any], frame: str) -> dict[str, Any]:
    """Return arguments with those that are points or directions in space turned."""
    return {name: convert_vector(value, frame) if name in VECTORS else value for name, value in arguments.items()}


def placement_in_ned(position: Any, rotation: Any, scale: float, frame: str) -> dict[str, Any]:
    """Return the arguments of a placement given in `frame`."""
    place = Placement(position, rotation, scale)
    position, rotation = convert_vector(place.position, frame), convert_attitude(place.rotation, frame)
    return {"position": position, "rotation": rotation, "scale": place.scale}


def points_in_ned(points: Any, frame: str) -> np.ndarray:
    """Return points (n, 3) [m] given in `frame`."""
    return convert_vector(points, frame)


def state_in_ned(position: Any, velocity: Any, attitude: Any, angular_velocity: Any, frame: str, **rest: Any) -> State:
    """Return a start state given in `frame`."""
    return State(
        convert_vector(position, frame),
        convert_vector(velocity, frame),
        convert_attitude(attitude, frame),
        convert_vector(angular_velocity, frame),
        **rest,
    )


def yaw_in_ned(value: float, frame: str) -> float:
    """Return a value of an odd yaw output beta(r): r is about the third body axis, which enu turns round."""
    return value if frame == "ned" else -value


def record_columns(record: FlightRecord, frame: str) -> dict[str, np.ndarray]:
    """Return a record's columns with every vector, attitude and torque in `frame`, and the yaw output about its third axis."""
    state = record.state.copy()
    for part in (slice(0, 3), slice(3, 6), slice(15, 18)):
        state[:, part] = convert_vector(state[:, part], frame)
    state[:, 6:15] = convert_attitude(record.attitude, frame).swapaxes(1, 2).reshape(-1, 9)
    inputs = np.column_stack([record.input[:, :1], convert_vector(record.input[:, 1:], frame)])
    yaw = record.yaw_output if frame == "ned" else -record.yaw_output
    told = None if record.autopilot is None else _told(record.autopilot, frame)
    return dataclasses.replace(record, state=state, input=inputs, yaw_output=yaw, autopilot=told).columns()


def _told(rows: AutopilotRows, frame: str) -> AutopilotRows:
    """Return an autopilot's rows with their vectors in `frame`."""
    unknown = convert_vector(rows.unknown.reshape(-1, 4, 3), frame).reshape(-1, 12)
    position, wind = convert_vector(rows.estimated_position, frame), convert_vector(rows.wind, frame)
    return dataclasses.replace(rows, unknown=unknown, estimated_position=position, wind=wind)


def _risen(path: Curve) -> Curve:
    """Return a curve of `enu` whose formula has minus its altitude as third coordinate: S diag(1, 1, -1) = diag(1, -1, 1)."""
    formula = path.point

    def point(parameter: Any) -> Any:
        x, y, z = formula(parameter)
        return x, -y, z

    return dataclasses.replace(path, point=point)

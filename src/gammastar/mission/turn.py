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
from gammastar.frames import convert_attitude, convert_vector
from gammastar.path import Curve, Path
from gammastar.vehicle import State, Vehicle

VECTORS = ("center", "normal", "axis", "point", "along")  # arguments of paths that are points or directions in space


def vehicle_in_ned(vehicle: Vehicle, frame: str) -> Vehicle:
    """Return a vehicle whose numbers were given in `frame`: loads turn as vectors, the inertia as S J S."""
    return dataclasses.replace(
        vehicle,
        inertia=convert_attitude(vehicle.inertia, frame),
        bias_acceleration=convert_vector(vehicle.bias_acceleration, frame),
        bias_torque=convert_vector(vehicle.bias_torque, frame),
    )


def path_in_ned(factory: Callable[..., Path], arguments: Mapping[str, Any], frame: str) -> Path:
    """Return the path of a factory whose arguments were given in `frame`.

    Vectors of space turn; what is left needs a word each.  The heading of a loop runs from the first axis towards the second one,
    which points the other way in `enu`; its lowest point stays the lowest.  The circle of varying height is a formula in the axes
    of its frame, so the curve is turned as a whole.
    """
    if frame == "ned":
        return factory(**arguments)
    turned = {name: convert_vector(value, frame) if name in VECTORS else value for name, value in arguments.items()}
    if "heading" in turned:
        turned["heading"] = -turned["heading"]
    path = factory(**turned)
    return _turned(path) if factory.__name__ == "nonplanar_circle" else path


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
    return dataclasses.replace(record, state=state, input=inputs, yaw_output=yaw).columns()


def _turned(path: Path) -> Path:
    """Return a curve whose formula was written in `enu`."""
    assert isinstance(path, Curve)
    formula = path.point

    def point(parameter: Any) -> Any:
        x, y, z = formula(parameter)
        return x, -y, -z

    normal = None if path.plane_normal is None else tuple(convert_vector(path.plane_normal, "enu"))
    return dataclasses.replace(path, point=point, plane_normal=normal)

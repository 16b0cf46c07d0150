"""Orientations in a mission file: a matrix, a quaternion, or roll, pitch and yaw in degrees."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator, ValidationInfo

from gammastar import so3
from gammastar.errors import InputError
from gammastar.mission.complaint import shown
from gammastar.mission.values import Number, Section, nested


class AnglesSection(Section):
    """Turns about the axes of the frame, roll first."""

    roll: Number = 0.0  # [deg] about the first axis
    pitch: Number = 0.0  # [deg] about the second
    yaw: Number = 0.0  # [deg] about the third


@functools.lru_cache(64)
def from_angles(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the rotation (3, 3) by angles [deg], roll applied first; not to be written to."""
    rotation: np.ndarray = so3.yaw(yaw) @ so3.pitch(pitch) @ so3.roll(roll)
    rotation.setflags(write=False)
    return rotation


def matrix_of(rotation: Any) -> np.ndarray:
    """Return the matrix (3, 3) of a rotation in any of its forms."""
    if isinstance(rotation, AnglesSection):
        return from_angles(rotation.roll, rotation.pitch, rotation.yaw)
    return so3.from_quaternion(rotation) if np.ndim(rotation) == 1 else np.array(rotation)


def _rotation(value: Any, info: ValidationInfo) -> Any:
    if isinstance(value, (Mapping, AnglesSection)):
        return AnglesSection.model_validate(value)
    rotation = nested(value, info, depth=2)
    rows = [len(row) if isinstance(row, tuple) else 0 for row in rotation] if isinstance(rotation, tuple) else []
    if rows not in ([3, 3, 3], [0, 0, 0, 0]):
        raise InputError(
            f"{info.field_name} must be three rows of three numbers, a quaternion (w, x, y, z), or a table of roll, pitch and "
            f"yaw [deg] (got {shown(value)}); give one of them"
        )
    return rotation


Rotation = Annotated[Any, PlainValidator(_rotation)]  # matrix, quaternion, or angles

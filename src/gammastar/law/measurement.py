"""What a controller is told once a control interval: 22 numbers, the latest samples of four channels and whether they are new."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gammastar import so3

SIZE = 22
CHANNELS = ("position", "velocity", "attitude", "angular_velocity")
AXES = (1 / 7, 2 / 7, 4 / 7)  # what each axis adds to the freshness of its channel; all three make 1


class Measurement(NamedTuple):
    """Graph: the parts of a measurement; each holds its latest sample until another one comes."""

    position: Any  # SX (3,) [m], world
    velocity: Any  # SX (3,) [m/s], world
    attitude: Any  # SX (3, 3), body to world
    angular_velocity: Any  # SX (3,) [rad/s], body
    fresh: Any  # SX (4,) by channel: 1 where the sample is of this interval, 0 where it is older, see `fresh_axes`


def split_measurement(measurement: Any) -> Measurement:
    """Graph: return the parts of a stacked measurement SX (22,)."""
    position, velocity, attitude, angular_velocity, fresh = ca.vertsplit(measurement, [0, 3, 6, 15, 18, SIZE])
    return Measurement(position, velocity, so3.unstack(attitude), angular_velocity, fresh)


def join_measurement(parts: Measurement) -> Any:
    """Graph: return the stacked measurement SX (22,) of its parts."""
    return ca.vertcat(parts.position, parts.velocity, so3.stack(parts.attitude), parts.angular_velocity, parts.fresh)


def freshness(axes: Any) -> Any:
    """Graph: return the freshness of a channel from SX (3,) flags of its axes: 1 for all three, 0 for none, shares in between.

    Axes of one channel may have sensors of their own, such as height beside horizontal position; the shares tell all eight cases apart.
    """
    return ca.dot(ca.DM(np.array(AXES)), axes)


def fresh_axes(fresh: Any) -> Any:
    """Graph: return the flags SX (3,) of the axes, each 0 or 1, from the freshness of their channel; the inverse of `freshness`."""
    third = fresh > AXES[2] - AXES[0] / 2
    rest = fresh - AXES[2] * third
    second = rest > AXES[1] - AXES[0] / 2
    return ca.vertcat(rest - AXES[1] * second > AXES[0] / 2, second, third)

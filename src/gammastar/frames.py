"""The one place where world and body frames are converted between `ned` (the paper's, inside) and `enu` (z up).

`ned`: world north-east-down, body forward-right-down.  `enu` here is the z-up pair reached by S = diag(1, -1, -1) on
both sides: first axes shared, second and third reversed, in the world and in the body.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from gammastar.errors import UnknownNameError

Frame = Literal["ned", "enu"]
FRAMES = ("ned", "enu")
REVERSAL = np.diag([1.0, -1.0, -1.0])  # S, its own inverse


def check_frame(frame: str) -> None:
    """Raise `UnknownNameError` unless the frame is a known one."""
    if frame not in FRAMES:
        raise UnknownNameError("frame", frame, FRAMES)


def convert_vector(vector: ArrayLike, frame: str) -> np.ndarray:
    """Return vectors (..., 3) of `frame` in `ned`, or the reverse: position, velocity, body rates, torques."""
    check_frame(frame)
    value = np.asarray(vector, dtype=float)
    return value.copy() if frame == "ned" else value * np.array([1.0, -1.0, -1.0]) + 0.0  # no -0


def convert_attitude(attitude: ArrayLike, frame: str) -> np.ndarray:
    """Return attitudes (..., 3, 3), body to world, of `frame` in `ned`, or the reverse: S R S."""
    check_frame(frame)
    value = np.asarray(attitude, dtype=float)
    return value.copy() if frame == "ned" else REVERSAL @ value @ REVERSAL

"""A small quadrotor drawn in space: arms, rotor discs that look different from above and below, and the thrust.

It stands for any vehicle of the class: what is true about it is the attitude and the direction and size of the thrust.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gammastar.figures import scene, style
from gammastar.figures.scene import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROTORS = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]]) / np.sqrt(2)  # body axes
ROTOR_RADIUS, ROTOR_LIFT = 0.5, 0.16  # of an arm; rotors sit above the arms, against the third body axis
RIM = np.linspace(0, 2 * np.pi, 25)
ABOVE, BELOW, THRUST = "#56B4E9", "#B8B8B8", style.VERMILION
COLORS = (ABOVE, BELOW, THRUST)
THRUST_LENGTH = 1.7  # of an arm, for a thrust that carries the weight
REACH = 2.1  # [arms] a thrust of twice the weight points out of a panel of this half side
ARROW_HEAD = 0.3  # of an arm


class Quadrotor:
    """The artists of one vehicle in a panel; `move` puts them where it is now."""

    def __init__(self, axis: Any, arm: float) -> None:
        """Create the artists; `arm` is the length of an arm in the panel's units."""
        from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

        nowhere = np.zeros((1, 2, 3))
        self.axis, self.arm = axis, arm
        self.discs = Poly3DCollection([np.zeros((3, 3))], linewidths=style.THIN, edgecolors=style.INK, zorder=8)
        self.arms = Line3DCollection(nowhere, colors=style.INK, linewidths=1.6 * style.STRONG, zorder=7)
        self.thrust = Line3DCollection(nowhere, colors=THRUST, linewidths=style.STRONG, zorder=9)
        for artist in (self.discs, self.arms, self.thrust):
            axis.add_collection3d(artist)

    def move(self, place: np.ndarray, attitude: np.ndarray, thrust: float) -> None:
        """Show the vehicle at a place (3,) as drawn, with an attitude (3, 3) body to world and a thrust in multiples of the weight."""
        self.arms.set_segments([[place, place + self.arm * drawn(attitude @ rotor)] for rotor in ROTORS])
        up = drawn(-attitude[:, 2])
        seen_from_above = up @ towards_viewer(self.axis) > 0
        circle = ROTOR_RADIUS * np.column_stack([np.cos(RIM), np.sin(RIM), np.full(len(RIM), 0.0)])
        lifted = ROTORS - [0.0, 0.0, ROTOR_LIFT]
        self.discs.set_verts([place + self.arm * drawn((rotor + circle) @ attitude.T) for rotor in lifted])
        self.discs.set_facecolor([ABOVE if seen_from_above else BELOW] * len(ROTORS))
        self.discs.set_zorder(8 if seen_from_above else 6)
        self._point(place, up, THRUST_LENGTH * self.arm * thrust)

    def _point(self, place: np.ndarray, up: np.ndarray, length: float) -> None:
        """Draw the thrust as an arrow whose head lies across the line of sight."""
        tip = place + length * up
        across = np.cross(up, towards_viewer(self.axis))
        across = across / max(float(np.linalg.norm(across)), 1e-9)
        head = ARROW_HEAD * self.arm
        barbs = [[tip, tip - head * up + side * 0.6 * head * across] for side in (1, -1)]
        self.thrust.set_segments([[place, tip], *barbs])


def close_up(figure: Figure, box: tuple[float, float, float, float], reach: float = REACH) -> Quadrotor:
    """Add a panel to look at a vehicle's attitude from close by, and return the vehicle at its middle, with arms of length one.

    Args:
        figure: Where to add it.
        box: Left, bottom, width and height [in].
        reach: Half the side of the space shown [arms].
    """
    left, bottom, width, height = box
    square = 1.5 * max(width, height)  # a panel in space leaves its corners empty
    corner = np.array([left + (width - square) / 2, bottom + (height - square) / 2])
    size = figure.get_size_inches()
    axis: Any = figure.add_axes((*(corner / size), *(square / size)), projection="3d", computed_zorder=False)
    scene.dress_space(axis, np.full(3, -reach), np.full(3, reach))
    axis.set_axis_off()
    return Quadrotor(axis, 1.0)


def towards_viewer(axis: Any) -> np.ndarray:
    """Return the unit vector (3,) from the scene to the eye, in the coordinates of the panel; its second axis runs backwards."""
    elevation, azimuth = np.radians(axis.elev), np.radians(axis.azim)
    flat = np.cos(elevation)
    return np.array([flat * np.cos(azimuth), -flat * np.sin(azimuth), np.sin(elevation)])

"""Draw the README's picture and animation, the upside-down start of the paper's section VI-B, and the basins of two campaigns.

Run it from anywhere: python docs/make.py [FOLDER].  Without a folder it rewrites docs/images.  The same source gives the same bytes.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import gammastar as gs
from gammastar import mission
from gammastar.campaign.pictures import attitude_basins, headline
from gammastar.figures import animate, save, scene, style
from gammastar.figures.basin import draw_basin
from gammastar.figures.quadrotor import close_up

IMAGES = Path(__file__).parent / "images"
FLIGHTS = {"basin": 20_000, "any-attitude": 100_000}  # of the campaigns, by the names of their images
CHANGES: dict[str, Any] = {
    "title": "a quadrotor has 1.7 s to its circle",
    "flight.duration": 1.7,
    "campaign.vary": [
        {"quantity": "start.attitude", "kind": "any"},
        {"quantity": "truth.mass_scale", "kind": "uniform", "low": 0.9, "high": 1.1},
    ],
}
SIZE = (7.8, 5.6)  # [in]
WHOLE = (0.05, 0.05, 4.5, 5.15)  # [in] left, bottom, width, height of the panel in space
FLIP = ((0.0, 0.24), (0.29, 0.33), (0.38, 0.6))  # [s] rows of close-ups: upside down, over, and upright again
CLOSE_UP = (4.65, 0.1, 1.5, 1.65)  # [in] left and bottom of the last row, width and height of one


def main(folder: Path = IMAGES) -> list[Path]:
    """Write all images into a folder and return the files."""
    record = flight()
    picture = save(readme_picture(record), folder / "upside-down", ("png",))
    for name, flown in {"basin": hurried(), "any-attitude": mission.load("any-attitude")}.items():
        with tempfile.TemporaryDirectory() as place:
            study = gs.campaign(flown, FLIGHTS[name], place).study()
            picture += save(draw_basin(attitude_basins(study), headline(study)), folder / name, ("png",))
    return [*picture, animate(record, folder / "upside-down.gif", seconds=12, fps=15)]


def hurried() -> Any:
    """Return the mission of docs/howto/campaigns.md: a quadrotor that has 1.7 s to get onto its circle."""
    return mission.load("quadrotor").with_values(CHANGES)


def flight() -> gs.FlightRecord:
    """Return the first ten seconds of the paper's upside-down scenario: recovery, and half a lap on the circle."""
    return mission.load("upside-down").with_values({"flight.duration": 10.0}).fly()


@style.drawing()
def readme_picture(record: gs.FlightRecord) -> Any:
    """Return the figure: the whole flight with its body axes on the left, the flip enlarged on the right."""
    figure = style.new_figure(*SIZE)
    figure.set_layout_engine("none")
    flown, target = scene.drawn(record.position), scene.drawn(scene.target_points(record)[0])
    rows = scene.pose_rows(record)
    whole: Any = figure.add_subplot(1, 2, 1, projection="3d", computed_zorder=False)
    scene.draw_curves(whole, flown, [target])
    tips = scene.draw_axes(whole, flown[rows], record.attitude[rows], scene.AXIS_LENGTH * scene.scene_size(record))
    scene.dress_space(whole, *scene.bounds(np.vstack([flown, target, tips])))
    scene.fill(figure, whole, (0.05, 0.05, 4.6, 5.4))
    draw_flip(figure, record)
    figure.legend(
        handles=whole.get_legend_handles_labels()[0],
        loc="upper center",
        ncols=6,
        fontsize=style.SMALL,
        frameon=False,
        labelcolor=style.INK,
    )
    return figure


def draw_flip(figure: Any, record: gs.FlightRecord) -> None:
    """Add close-ups of the vehicle and its thrust at chosen instants, with time and tilt below each."""
    left, bottom, width, height = CLOSE_UP
    figure.text(
        (left + width) / SIZE[0],
        (bottom + len(FLIP) * height + 0.05) / SIZE[1],
        "the first 0.6 s: vehicle and thrust",
        ha="center",
        fontsize=style.SMALL,
        color=style.FAINT,
    )
    for row, times in enumerate(reversed(FLIP)):
        for column, time in enumerate(times):
            k = int(np.searchsorted(record.time, time))
            corner = left + column * width, bottom + row * height
            vehicle = close_up(figure, (*corner, width, height), 2.0)
            vehicle.move(np.zeros(3), record.attitude[k], record.thrust[k] / record.truth.weight)
            tilt = np.degrees(np.arccos(np.clip(record.attitude[k, 2, 2], -1, 1)))
            figure.text(
                (corner[0] + width / 2) / SIZE[0],
                (corner[1] + 0.05) / SIZE[1],
                f"{time:.2f} s, tilt {tilt:.0f}°",
                ha="center",
                fontsize=style.SMALL,
                color=style.INK,
            )


if __name__ == "__main__":
    for file in main(*map(Path, sys.argv[1:])):
        print(file)

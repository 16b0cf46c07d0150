"""A flight as an animated GIF: the whole scene, and the vehicle from close by; time runs slower while it turns fast."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gammastar.checks import number
from gammastar.errors import InputError
from gammastar.figures import scene, style
from gammastar.figures.quadrotor import COLORS as QUADROTOR_COLORS
from gammastar.figures.quadrotor import Quadrotor, close_up
from gammastar.figures.save import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gammastar.flight import FlightRecord

SIZE = (6.4, 4.8)  # [in]
RESOLUTION = 90  # [dots/in]
SCENE = (0.05, 0.05, 3.7, 4.7)  # [in] left, bottom, width, height of the panel with the whole flight
CLOSE_UP = (3.7, 0.5, 2.7, 3.4)  # [in] of the panel with the vehicle
CLOSE_UP_NOTE = (CLOSE_UP[0] + CLOSE_UP[2] / 2) / SIZE[0]  # of the width, where its note is centred
SHADES = 4  # of each colour in the palette that all frames share, from pale to full
PAUSES = 0.8, 1.5  # [s] on the first and on the last frame
SHARES = (0.45, 0.2, 0.35)  # of the animation given to time passed, way flown and tilt turned; chosen by eye
ARM = 0.05  # of the vehicle in the scene, relative to the scene's longest side
MOST_FRAMES = 2000


@style.drawing()
def animate(record: FlightRecord, path: Path, seconds: float = 12.0, fps: float = 12.0) -> Path:
    """Write the animation of a flight as a GIF and return its file.

    Args:
        record: Of any flight.
        path: File to write, it appears whole or not at all.
        seconds: Length of the animation [s]; a clock in the picture tells the time of the flight.
        fps: Frames per second.

    Raises:
        InputError: No length, no frames, or too many of them.
        MissingExtraError: matplotlib or Pillow is not installed.
    """
    seconds, fps = number(seconds, "length of the animation [s]", above=0), number(fps, "frames per second", above=0)
    count = max(1, round(seconds * fps))
    if count > MOST_FRAMES:
        raise InputError(f"an animation must have at most {MOST_FRAMES} frames (got {count}); make it shorter")
    style.require_pillow()
    rows = frame_rows(record, count)
    images = _with_one_palette(list(_frames(record, rows, fps)))
    shown = [round(1000 / fps)] * len(images)  # [ms]
    shown[0], shown[-1] = (round(1000 * pause) for pause in PAUSES)
    buffer = io.BytesIO()
    images[0].save(buffer, "GIF", save_all=True, append_images=images[1:], duration=shown, loop=0, optimize=False)
    write_whole(path, buffer.getvalue())
    return path


def frame_rows(record: FlightRecord, count: int) -> np.ndarray:
    """Return the rows of a record that `count` frames show: even steps of a mix of time, way and turn."""
    passed = record.time - record.time[0]
    parts = (passed, scene.activity(record, 0.0), scene.activity(record, 1.0) - scene.activity(record, 0.0))
    mix = sum(share * part / part[-1] for share, part in zip(SHARES, parts, strict=True) if part[-1] > 0)
    if not np.ndim(mix):
        return np.zeros(count, dtype=int)
    return np.searchsorted(mix, np.linspace(0, np.asarray(mix)[-1], count)).clip(0, len(passed) - 1)


def _frames(record: FlightRecord, rows: np.ndarray, fps: float) -> Iterator[Any]:
    """Yield the frames as images; one figure is made and its artists are moved."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    figure = style.new_figure(*SIZE)
    figure.set_layout_engine("none")
    figure.set_dpi(RESOLUTION)
    flown = scene.drawn(record.position)
    trail, distant = _scene(figure, record, flown)
    near = close_up(figure, CLOSE_UP)
    figure.text(CLOSE_UP_NOTE, 0.05, "vehicle and thrust", ha="center", fontsize=style.SMALL, color=style.FAINT)
    clock = figure.text(0.97, 0.95, "", ha="right", va="top", fontsize=style.LABEL, color=style.INK, family="monospace")
    canvas: Any = FigureCanvasAgg(figure)
    weight = record.truth.weight or float(record.thrust.max())
    paces = np.gradient(record.time[rows]) * fps if len(rows) > 1 else np.zeros(1)
    for row, pace in zip(rows, paces, strict=True):
        trail.set_data_3d(*flown[: row + 1].T)
        distant.move(flown[row], record.attitude[row], record.thrust[row] / weight)
        near.move(np.zeros(3), record.attitude[row], record.thrust[row] / weight)
        clock.set_text(_reading(record, row, float(pace)))
        canvas.draw()
        yield Image.fromarray(np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[:, :, :3]))


def _scene(figure: Figure, record: FlightRecord, flown: np.ndarray) -> tuple[Any, Quadrotor]:
    """Add the panel with the whole flight and return the trail and the vehicle in it."""
    targets = [scene.drawn(points) for points in scene.target_points(record)]
    size = scene.scene_size(record)
    axis: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    for target, dashes in zip(targets, itertools.cycle(scene.TARGET_DASHES)):
        axis.plot(*target.T, color=style.GREEN, linewidth=style.STRONG, linestyle=(0, dashes), zorder=3)
    axis.plot(*flown[:1].T, color=style.INK, marker="o", markersize=style.MARKER, linestyle="none", zorder=5)
    (trail,) = axis.plot(*flown[:1].T, color=style.FAINT, linewidth=style.STRONG, zorder=2)
    reach = 1.5 * ARM * size
    scene.dress_space(axis, *scene.bounds(np.vstack([flown - reach, flown + reach, *targets])))
    scene.fill(figure, axis, SCENE)
    return trail, Quadrotor(axis, ARM * size)


def _reading(record: FlightRecord, row: int, pace: float) -> str:
    """Return the clock: time of the flight, how fast it is shown, and how far the vehicle is tilted."""
    tilt = np.degrees(np.arccos(np.clip(record.attitude[row, 2, 2], -1, 1)))
    return f"t = {record.time[row]:5.2f} s \nshown at {pace:4.2f} × speed \ntilt {tilt:5.0f} ° "


def _with_one_palette(images: list[Any]) -> list[Any]:
    """Return images in shades of the colours that were drawn, one palette for all, so that still parts stay still."""
    from PIL import Image

    colors = (style.INK, style.FAINT, style.GRID, style.GREEN, *QUADROTOR_COLORS)
    full = np.array([[int(color[k : k + 2], 16) for k in (1, 3, 5)] for color in colors])
    shares = np.arange(1, SHADES + 1)[:, None, None] / SHADES
    entries = np.vstack([[[255, 255, 255]], (255 + shares * (full - 255)).reshape(-1, 3)]).round().astype(int)
    palette = Image.new("P", (1, 1))
    palette.putpalette(entries.ravel().tolist())
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]

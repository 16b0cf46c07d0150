"""Figures over time: transformed states, velocities, rates, inputs and margins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from gammastar.figures import style
from gammastar.figures.phases import flown_phases, mark_replacements
from gammastar.figures.windows import Window, distance_text, drawable, limits, settling_time, unwrapped_gaps, windows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gammastar.flight import FlightRecord

SMALLEST_DISTANCE = 1e-16  # [m] what a logarithm can still show; the flights themselves end at rounding, near 1e-13
RAGGED = 40  # ways up and down, in ranges of its values, from which a line is noise and is drawn thin


@dataclass(frozen=True)
class Panel:
    """What one row of a figure shows: lines over the times of the record, and constant guides."""

    label: str
    lines: Sequence[tuple[str, np.ndarray]]  # name and values (n,)
    guides: Sequence[tuple[str, float]] = ()  # name and value, dashed
    shown: Sequence[float] = field(default=())  # values that belong inside the limits of the first column
    levels: Sequence[str] = ()  # names of the values 0, 1, 2, ... where these are no quantity


@style.drawing()
def draw_states(record: FlightRecord, title: str = "", units: tuple[str, str] | None = None) -> Figure:
    """Draw the chains xi_1 and xi_2, and place and speed along the path, as the paper's Figure 4 does.

    Args:
        record: Of any flight.
        title: Of the figure.
        units: Of xi_11 and xi_21, where the functions of an implicit path have units that are known.
    """
    figure, axes = style.panels(3, 1, title)
    units = units or transverse_units(record)
    for i in range(2):
        axis = axes[i, 0]
        for j in range(4):
            _line(axis, record.time, record.transverse_state[:, i, j], rf"$\xi_{{{i + 1}{j + 1}}}$", style.CYCLE[j])
        style.label(axis, rf"$\xi_{{{i + 1}j}}$ [{units[i]}/s$^{{j-1}}$]")
        mark_replacements(axis, record, named=i == 0)
        style.legend(axis, columns=5)
    _along(axes[2, 0], record)
    mark_replacements(axes[2, 0], record)
    _span(axes[2, 0], record.time)
    return figure


@style.drawing()
def draw_velocities(record: FlightRecord, title: str = "") -> Figure:
    """Draw the translational velocity in world axes."""
    lines = [(f"$v_{axis}$", record.velocity[:, k]) for k, axis in enumerate("xyz")]
    return columns(record, [Panel("velocity, world [m/s]", lines)], title)


@style.drawing()
def draw_rates(record: FlightRecord, title: str = "") -> Figure:
    """Draw the angular velocity in body axes."""
    lines = [(f"${name}$", record.angular_velocity[:, k]) for k, name in enumerate("pqr")]
    return columns(record, [Panel("body rates [rad/s]", lines)], title)


@style.drawing()
def draw_inputs(record: FlightRecord, title: str = "") -> Figure:
    """Draw the thrust u_t = zeta_1 and the torques."""
    weight = record.truth.weight
    guides = [("weight", weight)] if weight > 0 else []
    torques = [(rf"$\tau_{name}$", record.torque[:, k]) for k, name in enumerate("pqr")]
    panels = [
        Panel("thrust [N]", [("$u_t$", record.thrust)], guides, shown=(0.0,)),
        Panel("torque, body [N m]", torques),
    ]
    return columns(record, panels, title)


@style.drawing()
def draw_margins(record: FlightRecord, title: str = "") -> Figure:
    """Draw how far the flight stays from the two singularities, free fall and focal points, and from its path."""
    figure, axes = style.panels(3, 1, title)
    fall, focal, distance = axes[:, 0]
    _line(fall, record.time, record.free_fall_margin, "$u_t/m$", style.BLUE)
    _guide(fall, "free fall", 0.0, style.VERMILION)
    fall.set_ylim(*limits(np.append(record.free_fall_margin, 0.0)))
    style.label(fall, "thrust / mass [m/s²]")
    style.legend(fall)
    _line(focal, record.time, np.maximum(record.focal_margin, SMALLEST_DISTANCE), "zero at focal points", style.BLUE)
    focal.set_yscale("log")
    _decade(focal, record.focal_margin)
    style.label(focal, "focal margin [1]")
    style.legend(focal)
    _distance(distance, record)
    for axis in axes[:, 0]:
        mark_replacements(axis, record)
    _span(distance, record.time)
    return figure


def reference_jet(record: FlightRecord) -> np.ndarray:
    """Return the reference coordinate and four derivatives (n, 5); the coordinate is NaN where it is left free."""
    parts = []
    for phase, rows in flown_phases(record):
        time, tangential = record.time[rows], record.tangential_state[rows]
        reference = phase.reference.resolved(phase.law.path, float(tangential[0, 0])).moved(float(time[0]))
        jets = reference.jets(time, tangential)
        if not reference.holds_position:
            jets[:, 0] = np.nan
        parts.append(jets)
    return np.concatenate(parts)


def transverse_units(record: FlightRecord) -> tuple[str, str]:
    """Return the units of xi_11 and xi_21: metres on a curve, those of the user's functions on an implicit path."""
    curves = all(phase.law.path.components == 3 for phase in record.phases)
    return ("m", "m") if curves else ("unit of $s_1$ ", "unit of $s_2$ ")


def parameter_unit(record: FlightRecord) -> str:
    """Return the unit of the path coordinate: an angle where the path closes after one turn, its own parameter otherwise."""
    periods = [phase.law.path.period or 0.0 for phase in record.phases]
    return "rad" if np.allclose(periods, 2 * np.pi) else "parameter"


def columns(record: FlightRecord, rows: Sequence[Panel], title: str) -> Figure:
    """Draw panels as rows and the windows of a flight as columns, each with limits of its own."""
    spans = windows(record)
    figure, axes = style.panels(len(rows), len(spans), title)
    for i, panel in enumerate(rows):
        for k, window in enumerate(spans):
            _panel(axes[i, k], record.time, panel, window, panel.shown if k == 0 else ())
            mark_replacements(axes[i, k], record)
            if panel.levels:
                axes[i, k].set_yticks(range(len(panel.levels)), panel.levels if k == 0 else [""] * len(panel.levels))
        style.label(axes[i, 0], panel.label)
        style.legend(axes[i, -1], columns=max(4, len(panel.lines) + 1))
    for axis, window in zip(axes[0], spans, strict=True):
        style.heading(axis, window.name)
    for axis, window in zip(axes[-1], spans, strict=True):
        _span(axis, np.array([window.begin, window.end]))
    return figure


def _panel(axis: Axes, time: np.ndarray, panel: Panel, window: Window, shown: Sequence[float]) -> None:
    inside = (time >= window.begin) & (time <= window.end)
    for k, (name, values) in enumerate(panel.lines):
        dashes = "-" if k < len(style.CYCLE) else style.DOTTED
        _line(axis, time[inside], values[inside], name, style.CYCLE[k % len(style.CYCLE)], dashes)
    for name, value in panel.guides:
        _guide(axis, name, value, style.FAINT)
    visible = [values[inside] for _, values in panel.lines]
    axis.set_ylim(*limits(np.concatenate([*visible, [value for _, value in panel.guides], shown])))


def _along(axis: Axes, record: FlightRecord) -> None:
    """Draw eta_11, wrapped on a closed path, and eta_12 with its reference."""
    unit, wanted = parameter_unit(record), reference_jet(record)
    _line(axis, *_wrapped(record, record.tangential_state[:, 0]), r"$\eta_{11}$", style.BLUE)
    _line(axis, record.time, record.tangential_state[:, 1], r"$\eta_{12}$", style.VERMILION)
    if np.isfinite(wanted[:, 0]).any():
        target = _wrapped(record, wanted[:, 0])
        axis.plot(*target, color=style.INK, linewidth=style.THIN, linestyle=":", label=r"$\eta_{11}^{ref}$")
    name = r"$\eta_{12}^{ref}$"
    axis.plot(record.time, wanted[:, 1], color=style.INK, linewidth=style.THIN, linestyle=style.DASHED, label=name)
    style.label(axis, f"along the path\n[{unit}, {unit}/s]")
    style.legend(axis)


def _wrapped(record: FlightRecord, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times and path coordinates to draw: wrapped on closed paths, and with a gap where the path was replaced."""
    times, values = list[np.ndarray](), list[np.ndarray]()
    for phase, rows in flown_phases(record):
        period, part = phase.law.path.period, (record.time[rows], places[rows])
        time, value = part if period is None else unwrapped_gaps(*part, period)
        gap = [np.nan] if times else []
        times.append(np.concatenate([gap, time]))
        values.append(np.concatenate([gap, value]))
    return np.concatenate(times), np.concatenate(values)


def _distance(axis: Axes, record: FlightRecord) -> None:
    _line(axis, record.time, np.maximum(record.distance, SMALLEST_DISTANCE), "flown", style.BLUE)
    _guide(axis, f"settled: {distance_text(record.settled_within)}", record.settled_within, style.GREEN)
    settled = settling_time(record)
    if settled is not None:
        axis.axvline(
            settled, color=style.INK, linewidth=style.THIN, linestyle=":", label=f"predicted settling: {settled:.2f} s"
        )
    axis.set_yscale("log")
    _decade(axis, np.append(record.distance, record.settled_within))
    style.label(axis, "distance to path [m]")
    style.legend(axis)


def _decade(axis: Axes, values: np.ndarray) -> None:
    """Set logarithmic limits to whole decades that leave some room around positive values."""
    positive = drawable(values[np.isfinite(values) & (values > SMALLEST_DISTANCE)])
    if not positive.size:
        positive = np.array([1.0])
    low, high = np.floor(np.log10(positive.min() / 1.3)), np.ceil(np.log10(positive.max() * 1.3))
    axis.set_ylim(10.0**low, 10.0**high)
    axis.yaxis.set_minor_formatter(lambda value, place: "")


def _line(axis: Axes, time: np.ndarray, values: np.ndarray, name: str, color: str, dashes: Any = "-") -> None:
    values = drawable(values)
    finite = values[np.isfinite(values)]
    ragged = np.abs(np.diff(finite)).sum() > RAGGED * np.ptp(finite) if finite.size else False
    width = style.THIN if ragged else style.LINE
    marker: Any = "o" if len(time) == 1 else None
    look: dict[str, Any] = {"linewidth": width, "linestyle": dashes, "marker": marker, "markersize": style.MARKER}
    axis.plot(time, values, color=color, label=name, **look)


def _guide(axis: Axes, name: str, value: float, color: str) -> None:
    axis.axhline(float(drawable(value)), color=color, linewidth=style.THIN, linestyle=style.DASHED, label=name)


def _span(axis: Axes, time: np.ndarray) -> None:
    """Let the time axis end where the flight ends."""
    if time[-1] > time[0]:
        axis.set_xlim(time[0], time[-1])

"""Campaigns made up on disk, whose rows are known."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from gammastar import mission
from gammastar.campaign.manifest import Manifest
from gammastar.campaign.store import Store, arrow

COUNT = 4_000
STRONG = 0.8  # of the thrust scale over the mass scale, below which made-up flights fail


@functools.cache
def hummingbird() -> mission.Mission:
    """Return a mission with rotors whose truth differs from what is believed."""
    return mission.load("quadrotor").with_values({"truth.thrust_scale": 0.9, "truth.mass_scale": 1.2})


def stored(folder: Path, columns: dict[str, np.ndarray], part: int = 2000, toml: str = "", lost: int = -1) -> Store:
    """Return a campaign of some columns, one of whose parts may be missing."""
    manifest = Manifest(toml, 0, len(columns["flight"]), part, "native", "1")
    store = Store.opened(folder, manifest)
    write(store, columns, set(range(manifest.parts)) - {lost})
    return store


def write(store: Store, columns: dict[str, np.ndarray], parts: Iterable[int]) -> None:
    """Write some parts of a campaign of some columns."""
    pyarrow, _ = arrow()
    for k in parts:
        chosen = store.manifest.numbers(k)
        store.write(k, pyarrow.table({name: values[chosen.start : chosen.stop] for name, values in columns.items()}))


@functools.cache
def known() -> dict[str, np.ndarray]:
    """Return rows of flights that settle if and only if they are strong enough, or lean by less than a right angle."""
    draw = np.random.default_rng(0)
    mass, thrust, tilt = draw.uniform(0.9, 1.1, COUNT), draw.uniform(0.6, 1.0, COUNT), draw.uniform(0, 180, COUNT)
    settled = (thrust / mass >= STRONG) | (tilt < 90)
    return {
        "flight": np.arange(COUNT),
        "status": np.where(settled, "completed", "free_fall"),
        "settled": settled,
        "cause": np.where(settled, "", "thrust fell to zero"),
        "end_time_s": np.where(settled, 20.0, 1.0),
        "settling_time_s": np.where(settled, 1 + tilt / 60, np.nan),
        "max_distance_m": np.where(settled, 2.0, np.inf),
        "peak_rate_rad_s": tilt / 10,
        "max_thrust_N": 10 * thrust,
        "truth.mass_scale": mass,
        "truth.thrust_scale": thrust,
        "wind.mean.x": np.zeros(COUNT),
        "path.radius": np.where(np.arange(COUNT) % 2, 1.0, 2.0),
        "controller.feedback": np.where(np.arange(COUNT) % 4, "held", "middle"),
        "start_tilt_deg": tilt,
        "start_tilt_direction_deg": draw.uniform(-180, 180, COUNT),
        "start_heading_deg": draw.uniform(-180, 180, COUNT),
        "start_position_x_m": draw.uniform(-1, 1, COUNT),
        "start_position_y_m": draw.uniform(4.9, 5.1, COUNT),
        "start_position_z_m": np.where(tilt < 90, 0.5, -0.5) + draw.uniform(-0.4, 0.4, COUNT),
    }

"""Flights on slow and noisy sensors: with the filter beside the raw path, with the observer beside the filter."""

from __future__ import annotations

import dataclasses

import numpy as np

import gammastar as gs
from gammastar.flight import PATH_FLYER
from gammastar.law import KalmanFilter, Observer
from gammastar.vehicle import presets

HUMMINGBIRD = presets.load("hummingbird")
BELIEVED = dataclasses.replace(HUMMINGBIRD, forces=())
START = gs.State((1.3, 0.0, 0.2))


def distance(estimator: KalmanFilter | None, observer: Observer | None, truth: gs.Vehicle) -> float:
    """Return the RMS distance [m] to a circle over the last four of eight seconds, over two seeds, on the Path-Flyer's sensors."""
    law = gs.design(BELIEVED, gs.paths.circle(1.0), poles=-6.0, rejection=observer, estimator=estimator)
    values = []
    for seed in (0, 1):
        record = gs.fly(law, START, speed=1.2, duration=8.0, sensors=PATH_FLYER, truth=truth, seed=seed, step=2e-3)
        assert record.completed
        values.append(record.distance[record.time > 4])
    return float(np.sqrt(np.mean(np.square(values))))


def test_a_filter_brings_the_vehicle_nearer_than_raw_samples() -> None:
    """Without anything unknown: samples held for a fifth of a second cost half as much again as estimates."""
    kalman = KalmanFilter(**PATH_FLYER.deviations(), acceleration_density=0.02)
    filtered, raw = distance(kalman, None, BELIEVED), distance(None, None, BELIEVED)
    assert filtered < 0.016
    assert raw > 1.2 * filtered


def test_an_observer_beside_a_filter_hears_the_samples_and_not_itself() -> None:
    """Fed by the estimate, which moves with what the observer says, the two would talk each other away within seconds."""
    kalman = KalmanFilter(**PATH_FLYER.deviations())
    assert distance(kalman, Observer(force=8.0, torque=80.0), HUMMINGBIRD) < 0.05

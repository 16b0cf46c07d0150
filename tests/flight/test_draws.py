"""What chance does: normal numbers from uniform ones, and pairs that go by what they are for."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.stats

import gammastar as gs
from gammastar import engine
from gammastar.flight.draws import FIRST_GUSTS, GUSTS, PER_SENSOR, Draws, evaluated, gust_pairs

STEPS = np.arange(20_000)


def test_two_normal_numbers_come_from_a_pair() -> None:
    """Radius and angle are those of the uniform numbers: u1 = exp(-r^2/2), u2 the angle over 2 pi; both are normal and unrelated."""
    first, second = evaluated(lambda _, draws: draws.normals(5), (5,), 11, STEPS, flight=3)
    uniforms = engine.uniforms(11, 3, STEPS, (5,))
    assert np.exp(-(first**2 + second**2) / 2) == pytest.approx(uniforms[0], rel=1e-12)
    assert np.mod(np.arctan2(second, first) / (2 * np.pi), 1) == pytest.approx(uniforms[1], abs=1e-12)
    assert min(scipy.stats.kstest(each, "norm").pvalue for each in (first, second)) > 1e-3
    assert np.corrcoef(first, second)[0, 1] == pytest.approx(0, abs=4 / np.sqrt(len(STEPS)))
    assert np.mean(first[1:] * first[:-1]) == pytest.approx(0, abs=4 / np.sqrt(len(STEPS)))


def test_a_pair_is_found_by_its_number() -> None:
    symbols = ca.SX.sym("uniforms", 4)
    graph = ca.Function("pair", [symbols], [Draws((3, 17), symbols).uniform(17)])
    assert graph([0.1, 0.2, 0.3, 0.4]).full().ravel().tolist() == [0.3, 0.4]


@pytest.mark.parametrize(
    ("channel", "parts"),
    [
        ({}, []),
        ({"bias": 0.3, "rate": 5.0, "delay": 0.1}, []),
        ({"deviation": 0.1}, [0, 1]),
        ({"deviation": (0, 0.1, 0)}, [0]),
        ({"deviation": (0, 0, 0.1)}, [1]),
        ({"dropout": 0.1}, [2]),
    ],
    ids=str,
)
def test_only_what_is_needed_is_drawn(channel: dict[str, Any], parts: list[int]) -> None:
    assert gs.Sensors(velocity=gs.Channel(**channel)).pairs == tuple(PER_SENSOR + part for part in parts)


def test_no_two_purposes_share_a_pair() -> None:
    noisy = gs.Channel(0.1, dropout=0.1)
    pairs = gs.Sensors(noisy, noisy, noisy, noisy).pairs
    for first in (GUSTS, FIRST_GUSTS):
        pairs += gust_pairs(np.ones(3), first)
    assert len(set(pairs)) == len(pairs) == 12 + 6
    assert gs.SensorNoise((1, 0, 0), (0, 0, 1)).pairs == (0, PER_SENSOR + 1)


def test_flights_of_a_seed_draw_anew() -> None:
    """Flight k of a seed is one flight, whatever comes before it."""
    law = gs.design(gs.Vehicle(0.5, (3e-3, 3e-3, 6e-3)), gs.paths.circle(), poles=-4)
    setting = {
        "speed": 0.5,
        "duration": 0.05,
        "feedback": "start",
        "rate": 200.0,
        "noise": gs.SensorNoise((0.01, 0, 0)),
    }
    one, two, again = (gs.fly(law, gs.State((1.2, 0, 0)), seed=2, flight=k, **setting).state for k in (0, 5, 5))
    assert np.array_equal(two, again)
    assert not np.array_equal(one, two)

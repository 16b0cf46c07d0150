"""The search: it finds the least of a function, within bounds, the same way every time, with as many points as asked for."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from gammastar.campaign.search import search
from gammastar.errors import MissingExtraError

BEST = np.array([0.7, -1.2, 0.3])
LOW, HIGH = np.full(3, -2.0), np.full(3, 2.0)


def seen(evaluations: int, seed: int = 0, best: np.ndarray = BEST) -> np.ndarray:
    """Return the points of a search for the least of a stretched parabola."""
    points = list[np.ndarray]()

    def evaluate(given: np.ndarray) -> np.ndarray:
        points.extend(given)
        return np.asarray((given - best) ** 2 @ np.array([1.0, 10.0, 100.0]))

    search(evaluate, LOW, HIGH, evaluations, seed)
    return np.array(points)


def test_it_finds_the_least() -> None:
    assert np.abs(seen(250) - BEST).max(axis=1).min() < 1e-2


def test_it_stays_within_the_bounds() -> None:
    points = seen(200, best=np.array([9.0, 0.0, 0.0]))
    assert np.all((points >= LOW) & (points <= HIGH))
    assert points[:, 0].max() > 1.99


@pytest.mark.parametrize("evaluations", [1, 9, 1500])
def test_it_takes_as_many_points_as_asked_for(evaluations: int) -> None:
    """The last number is beyond the first convergence, after which it begins anew."""
    assert len(seen(evaluations)) == evaluations


def test_same_seed_same_points_and_the_generator_of_numpy_is_left_alone() -> None:
    np.random.seed(3)
    before = np.random.get_state()[1].copy()  # type: ignore[index, union-attr]
    first = seen(60)
    assert np.array_equal(first, seen(60))
    assert not np.array_equal(first, seen(60, seed=1))
    assert np.array_equal(before, np.random.get_state()[1])  # type: ignore[index]


def test_a_missing_library_names_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cma", None)
    with pytest.raises(MissingExtraError, match="gammastar\\[campaign\\]"):
        seen(1)

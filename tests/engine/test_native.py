"""Compiled lanes are flights: the same as the virtual machine's, each for itself."""

from __future__ import annotations

import numpy as np
import pytest

from engine import steps
from gammastar import engine
from gammastar.engine import native
from gammastar.errors import InputError, ShapeError

pytestmark = steps.needs_compiler


@pytest.mark.parametrize("kind", ["paper_circle", "quadrotor"])
def test_lanes_equal_the_virtual_machine_after_a_second(kind: str) -> None:
    """On 64 random starts, to 1e-10 of what each number goes through, or of one SI unit: estimates near zero come from such numbers."""
    loop = getattr(steps, kind)()
    count = round(1 / loop.interval)
    found = engine.run(loop.step, loop.starts, loop.outside, count)
    for lane in range(loop.starts.shape[1]):
        states, _ = engine.scan(loop.step, loop.starts[:, lane], loop.outside, count)
        assert np.all(np.isfinite(states))
        assert np.all(np.abs(found[:, lane] - states[:, -1]) <= 1e-10 * np.maximum(1, np.abs(states).max(axis=1)))


def test_a_lane_of_nan_stays_nan_and_touches_no_other() -> None:
    loop = steps.paper_circle()
    starts = loop.starts[:, :19].copy()  # not a whole number of registers
    alone = engine.run(loop.step, starts, loop.outside, 50)
    starts[:, 4], starts[7, 17] = np.nan, np.nan
    found = engine.run(loop.step, starts, loop.outside, 50)
    assert np.isnan(found[:3, [4, 17]]).all()
    others = np.delete(np.arange(19), [4, 17])
    assert found[:, others].tobytes() == alone[:, others].tobytes()


def test_a_lane_flies_the_same_alone_and_among_others() -> None:
    loop = steps.paper_circle()
    together = engine.run(loop.step, loop.starts[:, :11], loop.outside, 50)
    for lane in range(11):
        alone = engine.run(loop.step, loop.starts[:, lane : lane + 1], loop.outside, 50)
        assert alone[:, 0].tobytes() == together[:, lane].tobytes()


def test_columns_by_lane_reach_their_lane() -> None:
    loop = steps.paper_circle()
    shared = engine.run(loop.step, loop.starts[:, :11], loop.outside, 20)
    delays = np.arange(11)[None, None] * np.r_[1.0, np.zeros(loop.step.numel_in(1) - 1)][:, None, None]
    same = engine.run(loop.step, loop.starts[:, :11], lambda a, b: loop.outside(a, b)[..., None] + 0 * delays, 20)
    assert same.tobytes() == shared.tobytes()
    step, columns = steps.every_operation(), np.arange(2 * 3 * 11.0).reshape(2, 3, 11)
    found = engine.run(step, np.zeros((step.numel_out(0), 11)), lambda a, b: columns[:, a:b], 3)
    assert np.array_equal(found[0], columns[:, 2].sum(axis=0))  # the first operation is the sum, of the last step


def test_how_a_run_is_cut_into_chunks_does_not_matter(monkeypatch) -> None:
    loop = steps.paper_circle()
    whole = engine.run(loop.step, loop.starts, loop.outside, 50)
    told: list[int] = []
    monkeypatch.setattr(native, "WORK", 64 * 2000 * 7)
    cut = engine.run(loop.step, loop.starts, loop.outside, 50, progress=told.append)
    assert cut.tobytes() == whole.tobytes()
    assert told == [7, 14, 21, 28, 35, 42, 49, 50]


def test_columns_are_asked_for_a_few_at_a_time() -> None:
    """However many steps and however few lanes: memory does not grow with the steps."""
    asked: list[int] = []

    def exogenous(first: int, end: int) -> np.ndarray:
        asked.append(end - first)
        return np.ones((1, end - first))

    assert engine.run(steps.tiny(1.0), np.zeros((1, 1)), exogenous, 1_000_000).item() == 1_000_000
    assert sum(asked) == 1_000_000
    assert max(asked) <= native.LONGEST


def test_no_steps_and_no_lanes_leave_the_start() -> None:
    step = steps.tiny(2.0)
    start = np.array([[1.0, 2.0]])
    assert np.array_equal(engine.run(step, start, lambda a, b: np.zeros((1, b - a)), 0), start)
    assert engine.run(step, np.empty((1, 0)), lambda a, b: np.zeros((1, b - a)), 5).shape == (1, 0)
    assert np.array_equal(engine.run(step, start, lambda a, b: np.ones((1, b - a)), 2), [[7.0, 11.0]])
    assert np.array_equal(start, [[1.0, 2.0]])


def test_what_does_not_fit_is_refused_in_one_sentence() -> None:
    step = steps.tiny(2.0)
    with pytest.raises(ShapeError, match=r"states must be \(1, lanes\) \(got \(3, 2\)\)"):
        engine.run(step, np.zeros((3, 2)), lambda a, b: np.zeros((1, b - a)), 1)
    with pytest.raises(ShapeError, match=r"must be \(1, 4\) or \(1, 4, 2\) \(got \(4, 1\)\)"):
        engine.run(step, np.zeros((1, 2)), lambda a, b: np.zeros((4, 1)), 4)
    with pytest.raises(InputError, match="a step must take"):
        engine.run(steps.jet("trefoil"), np.zeros((1, 2)), lambda a, b: np.zeros((1, b - a)), 1)

"""The virtual machine: many steps in a row are the same as one after the other, however they are cut into chunks."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from gammastar import engine
from gammastar.engine.virtual import CHUNK


def step(width: int = 1) -> ca.Function:
    """Return a nonlinear map of two numbers, driven by two more, that observes `width` columns of three."""
    state, exogenous = ca.SX.sym("state", 2), ca.SX.sym("exogenous", 2)
    after = ca.vertcat(ca.cos(state[1]) + exogenous[0], 0.5 * state[0] * exogenous[1])
    observed = ca.horzcat(*(ca.vertcat(state, exogenous[0] + k) for k in range(width)))
    return ca.Function("step", [state, exogenous], [after, observed])


def one_by_one(function: ca.Function, state: np.ndarray, exogenous: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    states, observations = [state], []
    for column in exogenous.T:
        after, observed = function(states[-1], column)
        states.append(np.array(after).ravel())
        observations.append(np.array(observed))
    return np.array(states).T, np.hstack(observations)


START = np.array([0.3, -0.2])


def scan(function: ca.Function, state: np.ndarray, exogenous: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scan over columns that lie ready."""
    return engine.scan(function, state, lambda a, b: exogenous[:, a:b], exogenous.shape[1])


@pytest.mark.parametrize("width", [1, 3])
@pytest.mark.parametrize("steps", [1, 2, CHUNK - 1, CHUNK, CHUNK + 1, 2 * CHUNK, 2 * CHUNK + 7])
def test_a_scan_is_its_steps_one_after_the_other(steps: int, width: int) -> None:
    exogenous = np.random.default_rng(0).normal(size=(2, steps))
    found = scan(step(width), START, exogenous)
    expected = one_by_one(step(width), START, exogenous)
    assert found[0].shape == (2, steps + 1)
    assert found[1].shape == (3, steps * width)
    assert np.array_equal(found[0], expected[0])
    assert np.array_equal(found[1], expected[1])


def test_no_steps_leave_the_start() -> None:
    states, observations = scan(step(), START, np.zeros((2, 0)))
    assert np.array_equal(states, START[:, None])
    assert observations.shape == (3, 0)


def test_the_same_scan_gives_the_same_bytes() -> None:
    exogenous = np.random.default_rng(2).normal(size=(2, 1234))
    first, second = (scan(step(), START, exogenous) for _ in range(2))
    assert first[0].tobytes() == second[0].tobytes()
    assert first[1].tobytes() == second[1].tobytes()

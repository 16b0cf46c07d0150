"""The exact system: rational states are states, and Lie derivatives are derivatives."""

import pytest
import sympy as sp

from gammastar.claims.coordinates import circular_motion
from gammastar.claims.symbols import (
    cayley,
    circle_towers,
    extended_system,
    hat,
    is_zero,
    position_jets,
    random_values,
    size,
)


@pytest.mark.parametrize("seed", range(5))
def test_random_states_are_exact_states(seed: int) -> None:
    system, values = extended_system(), random_values(seed)
    R = system.attitude.xreplace(values)
    assert sp.eye(3) == R.T * R
    assert R.det() == 1
    assert all(value.is_Rational for value in values.values())
    assert values[system.thrust] > 0
    moments = [values[moment] for moment in system.inertia]
    assert len(set(moments)) == 3
    assert max(moments) < sum(moments) - max(moments)


def test_cayley_turns_about_its_vector() -> None:
    w = sp.Matrix([sp.Rational(2, 3), -1, sp.Rational(1, 5)])
    assert cayley(w) * w == w


def test_hat_is_the_cross_product() -> None:
    a, b = sp.Matrix(sp.symbols("a1:4")), sp.Matrix(sp.symbols("b1:4"))
    assert is_zero(hat(a) * b - a.cross(b))


def test_the_drift_is_the_lie_derivative_of_the_state() -> None:
    system = extended_system()
    assert is_zero(sp.Matrix([system.lie(x) for x in system.state]) - system.drift)


def test_circular_motion_has_the_derivatives_of_a_circle() -> None:
    """At 2 rad/s on the unit circle chi'' = -4 n, chi''' = -8 t; here at (1, 0, 10) with n = e1 and t = e2."""
    jets = position_jets(circular_motion(), sp.zeros(4, 1))
    assert list(jets[1]) == [0, 2, 0]
    assert list(jets[2]) == [-4, 0, 0]
    assert list(jets[3]) == [0, -8, 0]


def test_size_refuses_what_is_not_rational() -> None:
    with pytest.raises(TypeError):
        size(sp.sqrt(2))


def test_towers_are_free_of_the_input_until_the_snap() -> None:
    system = extended_system()
    for tower in circle_towers():
        assert [is_zero(system.lie_inputs(level)) for level in tower[:4]] == [True, True, True, False]

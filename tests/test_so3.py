"""The rotation group: its laws, its charts, and the nine-number coordinates of the paper."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from hypothesis import given

from gammastar import so3
from gammastar.errors import GammastarError, RotationError, ShapeError
from strategies import UPRIGHT, UPSIDE_DOWN, batches, quaternions, rotation_vectors, rotations, vectors

ROUNDOFF = 1e-14  # a few products of numbers of size one, eps = 2.2e-16
CHARTS = {"exp": so3.exp, "cayley": so3.cayley}


def graph_of(formula, *lengths: int) -> ca.Function:
    """Return a formula of so3, applied to symbols, as a function of columns."""
    symbols = [ca.SX.sym("argument", length) for length in lengths]
    value = formula(*symbols)
    assert isinstance(value, ca.SX)
    return ca.Function("formula", symbols, [value, ca.jacobian(ca.vec(value), symbols[0])])


# --- hat and vee -----------------------------------------------------------------------------------------------------


@given(vectors(10.0), vectors(10.0))
def test_hat_is_the_cross_product(a: np.ndarray, b: np.ndarray) -> None:
    assert so3.hat(a) @ b == pytest.approx(np.cross(a, b), abs=1e-13)


@given(vectors(10.0))
def test_vee_is_the_inverse_of_hat(a: np.ndarray) -> None:
    assert np.array_equal(so3.vee(so3.hat(a)), a)
    assert np.array_equal(so3.hat(a), -so3.hat(a).T)


@given(vectors(), vectors(length=9))
def test_vee_ignores_a_symmetric_part(a: np.ndarray, entries: np.ndarray) -> None:
    square = entries.reshape(3, 3)
    assert so3.vee(so3.hat(a) + square + square.T) == pytest.approx(a, abs=ROUNDOFF)


# --- charts: one property, every chart -------------------------------------------------------------------------------


@pytest.mark.parametrize("chart", CHARTS)
@given(rotation_vectors())
def test_charts_give_rotations(chart: str, w: np.ndarray) -> None:
    R = CHARTS[chart](w)
    assert pytest.approx(np.eye(3), abs=ROUNDOFF) == R.T @ R
    assert np.linalg.det(R) == pytest.approx(1, abs=ROUNDOFF)


@pytest.mark.parametrize("chart", CHARTS)
@given(rotation_vectors())
def test_charts_turn_about_their_vector(chart: str, w: np.ndarray) -> None:
    assert CHARTS[chart](w) @ w == pytest.approx(w, abs=ROUNDOFF)


@pytest.mark.parametrize("chart", CHARTS)
@given(rotation_vectors())
def test_opposite_vectors_give_inverse_rotations(chart: str, w: np.ndarray) -> None:
    assert CHARTS[chart](-w) == pytest.approx(CHARTS[chart](w).T, abs=ROUNDOFF)


@pytest.mark.parametrize("chart", CHARTS)
@given(rotation_vectors(), rotations())
def test_charts_commute_with_conjugation(chart: str, w: np.ndarray, R: np.ndarray) -> None:
    """R f(w) R^T = f(R w), the law behind every change of frame."""
    assert R @ CHARTS[chart](w) @ R.T == pytest.approx(CHARTS[chart](R @ w), abs=ROUNDOFF)


@pytest.mark.parametrize("chart", CHARTS)
@given(rotation_vectors())
def test_graph_and_numbers_agree(chart: str, w: np.ndarray) -> None:
    graph = GRAPHS[chart](w)[0]
    assert np.array(graph) == pytest.approx(CHARTS[chart](w), abs=1e-15)  # sums in another order


GRAPHS = {name: graph_of(chart, 3) for name, chart in CHARTS.items()}


@given(rotation_vectors())
def test_exp_is_the_matrix_exponential(w: np.ndarray) -> None:
    assert so3.exp(w) == pytest.approx(scipy.linalg.expm(so3.hat(w)), abs=ROUNDOFF)


@given(rotation_vectors(), vectors(length=2))
def test_exp_is_a_one_parameter_group(w: np.ndarray, times: np.ndarray) -> None:
    s, t = 3 * times
    assert so3.exp(s * w) @ so3.exp(t * w) == pytest.approx(so3.exp((s + t) * w), abs=2 * ROUNDOFF)


@given(rotation_vectors())
def test_exp_has_its_closed_form_derivative(w: np.ndarray) -> None:
    """D exp(w) = exp(w) hat(Jr dw) with Jr = sum of (-hat(w))^k / (k + 1)!, an entire series."""
    skew, right, term = so3.hat(w), np.eye(3), np.eye(3)
    for k in range(1, 30):
        term = term @ -skew / (k + 1)
        right = right + term
    turned, derivative = (np.array(value) for value in GRAPHS["exp"](w))
    columns = [so3.stack(turned @ so3.hat(column)) for column in right.T]
    # next to the switch the derivative of sin(a)/a divides rounding of 1e-16 by the angle of 1e-2
    assert derivative == pytest.approx(np.column_stack(columns), abs=1e-13)


def test_exp_has_its_second_derivatives_at_zero() -> None:
    """d2 exp(0)(a, b) = (hat(a) hat(b) + hat(b) hat(a)) / 2."""
    w = ca.SX.sym("w", 3)
    second = ca.Function("second", [w], [ca.jacobian(ca.jacobian(ca.vec(so3.exp(w)), w), w)])
    found = np.array(second([0, 0, 0])).reshape(3, 9, 3)  # [k, entry, l]
    for k in range(3):
        for j in range(3):
            a, b = so3.hat(np.eye(3)[k]), so3.hat(np.eye(3)[j])
            assert pytest.approx((a @ b + b @ a) / 2, abs=ROUNDOFF) == found[k, :, j].reshape(3, 3).T


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_exp_is_smooth_across_its_switch(order: int) -> None:
    """Values and derivatives meet at the small angle: both branches are one analytic function."""
    t = ca.SX.sym("t")
    value = ca.vec(so3.exp(t * ca.DM([0.6, -0.48, 0.64])))
    for _ in range(order):
        value = ca.jacobian(value, t)
    at = ca.Function("at", [t], [value])
    gap = 1e-9
    before, after = (np.array(at(so3.SMALL_ANGLE * (1 + side * gap))) for side in (-1, 1))
    # the argument moves by 2e-10; the closed branch loses one factor 1 / angle = 10 of rounding with every derivative, and the series'
    # first neglected term 3e-18 gains a factor 10 / angle = 100 at most
    assert after == pytest.approx(before, abs=4e-10 + 4e-16 * 10**order + 3e-18 * 100**order)


@given(rotation_vectors())
def test_cayley_is_the_rational_cayley_transform(w: np.ndarray) -> None:
    """cay(w) = (I - hat(w)/2)^-1 (I + hat(w)/2)."""
    half = so3.hat(w) / 2
    assert so3.cayley(w) == pytest.approx(np.linalg.solve(np.eye(3) - half, np.eye(3) + half), abs=ROUNDOFF)


@given(rotation_vectors())
def test_cayley_turns_by_twice_the_arc_tangent(w: np.ndarray) -> None:
    size = np.linalg.norm(w)
    angle = 2 * np.arctan(size / 2)
    assert so3.cayley(w) == pytest.approx(so3.exp(angle * w / size if size else w), abs=ROUNDOFF)


@given(vectors(3.0), vectors(3.0))
def test_cayley_rate_is_the_exact_coordinate_rate(w: np.ndarray, omega: np.ndarray) -> None:
    """d/dt cay(w) = cay(w) hat(Omega) when w' = cayley_rate(w, Omega), by automatic differentiation."""
    turned, derivative = (np.array(value) for value in GRAPHS["cayley"](w))
    rate = (derivative @ so3.cayley_rate(w, omega)).reshape(3, 3).T
    assert rate == pytest.approx(turned @ so3.hat(omega), abs=1e-13)


def test_cayley_agrees_with_exp_to_second_order() -> None:
    w = np.array([0.3, -0.5, 0.4])
    gaps = [np.linalg.norm(so3.cayley(h * w) - so3.exp(h * w)) for h in (0.4, 0.2, 0.1)]
    assert np.log2(np.array(gaps[:-1]) / gaps[1:]) == pytest.approx(3, abs=0.05)


# --- logarithm -------------------------------------------------------------------------------------------------------


@given(rotation_vectors())
def test_log_of_exp_is_identity(w: np.ndarray) -> None:
    """Relative to the vector near zero (R keeps its small entries to full precision), absolute elsewhere."""
    assert np.linalg.norm(so3.log(so3.exp(w)) - w) <= ROUNDOFF * min(1.0, np.linalg.norm(w)) + 1e-30


@given(rotations())
def test_exp_of_log_is_identity(R: np.ndarray) -> None:
    assert so3.exp(so3.log(R)) == pytest.approx(R, abs=ROUNDOFF)
    assert np.linalg.norm(so3.log(R)) <= np.pi * (1 + 1e-15)


@given(vectors().filter(lambda v: np.linalg.norm(v) > 0.1))
def test_log_at_exactly_pi_is_one_of_the_two_opposite_vectors(axis: np.ndarray) -> None:
    axis = axis / np.linalg.norm(axis)
    half_turn = 2 * np.outer(axis, axis) - np.eye(3)
    w = so3.log(half_turn)
    assert np.linalg.norm(w) == pytest.approx(np.pi, abs=ROUNDOFF)
    assert abs(w @ axis) == pytest.approx(np.pi, abs=ROUNDOFF)


@given(rotations())
def test_log_is_the_same_as_a_graph(R: np.ndarray) -> None:
    """What a graph does not choose is finite too: no NaN at the identity, none at half a turn."""
    symbol = ca.SX.sym("R", 3, 3)
    assert np.array_equal(ca.Function("log", [symbol], [so3.log(symbol)])(R).full().ravel(), so3.log(R))


# --- the nine coordinates: Proposition 1 -----------------------------------------------------------------------------


def test_stack_puts_column_under_column() -> None:
    """The map of the paper: (r11, r21, r31, r12, r22, r32, r13, r23, r33)."""
    named = np.array([[11, 12, 13], [21, 22, 23], [31, 32, 33]])
    assert so3.stack(named).tolist() == [11, 21, 31, 12, 22, 32, 13, 23, 33]


@given(vectors(length=9))
def test_stack_and_unstack_are_inverses(entries: np.ndarray) -> None:
    assert np.array_equal(so3.stack(so3.unstack(entries)), entries)
    assert np.array_equal(so3.unstack(so3.stack(entries.reshape(3, 3))), entries.reshape(3, 3))


@given(rotations(), rotations())
def test_stack_is_a_homomorphism(R: np.ndarray, S: np.ndarray) -> None:
    """Proposition 1: stack(R S) = stack(R) * stack(S) with the product of Eq. (5)."""
    assert so3.product(so3.stack(R), so3.stack(S)) == pytest.approx(so3.stack(R @ S), abs=1e-15)


@given(rotations(), rotations(), rotations())
def test_product_makes_a_group(R: np.ndarray, S: np.ndarray, T: np.ndarray) -> None:
    a, b, c = so3.stack(R), so3.stack(S), so3.stack(T)
    one = so3.stack(np.eye(3))
    assert so3.product(so3.product(a, b), c) == pytest.approx(so3.product(a, so3.product(b, c)), abs=ROUNDOFF)
    assert np.array_equal(so3.product(one, a), a)
    assert np.array_equal(so3.product(a, one), a)
    assert so3.product(a, so3.stack(R.T)) == pytest.approx(one, abs=ROUNDOFF)


@given(rotations(), rotations())
def test_product_graph_is_bilinear_and_agrees_with_numbers(R: np.ndarray, S: np.ndarray) -> None:
    """Eq. (5) is smooth: its derivative with respect to the first factor is that of a linear map."""
    value, derivative = (np.array(entry) for entry in PRODUCT(so3.stack(R), so3.stack(S)))
    assert value.ravel() == pytest.approx(so3.product(so3.stack(R), so3.stack(S)), abs=1e-15)
    assert derivative == pytest.approx(np.kron(S.T, np.eye(3)), abs=1e-15)


PRODUCT = graph_of(so3.product, 9, 9)


# --- projection ------------------------------------------------------------------------------------------------------


@given(rotations(), vectors(5e-4, length=9))
def test_projection_is_the_polar_factor(R: np.ndarray, error: np.ndarray) -> None:
    M = R + error.reshape(3, 3)
    rotation, distance = so3.project(M)
    factor, _ = scipy.linalg.polar(M)
    assert rotation == pytest.approx(factor, abs=ROUNDOFF)
    assert distance == pytest.approx(np.linalg.norm(M - factor), abs=ROUNDOFF)


@given(rotations(), vectors(5e-4, length=9), vectors(1e-3))
def test_projection_is_nearest(R: np.ndarray, error: np.ndarray, nudge: np.ndarray) -> None:
    M = R + error.reshape(3, 3)
    rotation, distance = so3.project(M)
    assert distance <= np.linalg.norm(M - rotation @ so3.exp(nudge)) + 1e-15
    assert distance <= np.linalg.norm(M - R) + 1e-15


@given(rotations())
def test_projection_is_idempotent(R: np.ndarray) -> None:
    once, distance = so3.project(R)
    assert distance <= ROUNDOFF
    assert so3.project(once)[0] == pytest.approx(once, abs=1e-15)


@given(rotations())
def test_projection_refuses_reflections(R: np.ndarray) -> None:
    with pytest.raises(RotationError, match="reflects") as caught:
        so3.project(R @ np.diag([1, 1, -1]))
    assert caught.value.distance == pytest.approx(2, abs=1e-12)


@pytest.mark.parametrize(
    "matrix",
    [1.02 * np.eye(3), np.zeros((3, 3)), [[1, 0.05, 0], [0, 1, 0], [0, 0, 1]], 1e200 * np.eye(3)],
    ids=["scaled", "zero", "sheared", "huge"],
)
def test_projection_refuses_what_is_no_rotation(matrix: object) -> None:
    with pytest.raises(RotationError, match="orthonormal") as caught:
        so3.project(matrix)
    assert caught.value.distance > so3.PROJECTION_LIMIT
    assert isinstance(caught.value, GammastarError)


def test_the_printed_upside_down_start_has_its_closed_form_distance() -> None:
    """Its lower block is s times a rotation with s^2 = 0.9998^2 + 0.0175^2, so the distance is sqrt(2) (1 - s): 6.6e-5."""
    scale = np.hypot(0.9998, 0.0175)
    rotation, distance = so3.project(UPSIDE_DOWN)
    assert distance == pytest.approx(np.sqrt(2) * (1 - scale), abs=1e-15)
    assert distance == pytest.approx(6.6e-5, abs=1e-6)
    assert np.degrees(so3.log(rotation)) == pytest.approx([np.degrees(np.arctan2(0.0175, -0.9998)), 0, 0], abs=1e-10)


def test_the_printed_upright_start_is_a_rotation_to_its_digits() -> None:
    """Rounding nine entries to four digits moves a rotation by at most 3 x 5e-5."""
    rotation, distance = so3.project(UPRIGHT)
    factor, stretch = scipy.linalg.polar(np.array(UPRIGHT))
    assert distance == pytest.approx(np.linalg.norm(stretch - np.eye(3)), rel=1e-9)
    assert 0 < distance <= 1.5e-4
    assert rotation == pytest.approx(factor, abs=1e-15)


# --- named rotations, quaternions, random ones -----------------------------------------------------------------------


def test_named_turns_are_the_textbook_matrices() -> None:
    c, s = np.cos(0.3), np.sin(0.3)
    degrees = np.degrees(0.3)
    assert so3.roll(degrees) == pytest.approx(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), abs=1e-15)
    assert so3.pitch(degrees) == pytest.approx(np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), abs=1e-15)
    assert so3.yaw(degrees) == pytest.approx(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), abs=1e-15)
    assert so3.roll(180) == pytest.approx(np.diag([1, -1, -1]), abs=1e-15)


@given(quaternions())
def test_quaternions_cover_the_group_twice(q: np.ndarray) -> None:
    assert np.array_equal(so3.from_quaternion(q), so3.from_quaternion(-q))


@given(quaternions(), quaternions())
def test_quaternions_multiply_as_rotations(p: np.ndarray, q: np.ndarray) -> None:
    """Hamilton's product (w, v)(w', v') = (w w' - v.v', w v' + w' v + v x v')."""
    w = p[0] * q[0] - p[1:] @ q[1:]
    v = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
    both = so3.from_quaternion([w, *v])
    assert so3.from_quaternion(p) @ so3.from_quaternion(q) == pytest.approx(both, abs=ROUNDOFF)


@given(rotation_vectors())
def test_a_quaternion_is_half_the_angle(w: np.ndarray) -> None:
    angle = np.linalg.norm(w)
    axis = w / angle if angle else w
    q = [np.cos(angle / 2), *np.sin(angle / 2) * axis]
    assert so3.from_quaternion(q) == pytest.approx(so3.exp(w), abs=ROUNDOFF)


@pytest.mark.parametrize("q", [(1, 0, 0), (np.nan, 0, 0, 1), ((1, 0, 0, 0),)], ids=["three", "NaN", "nested"])
def test_a_quaternion_is_four_finite_numbers(q: object) -> None:
    with pytest.raises(ShapeError, match="four finite numbers"):
        so3.from_quaternion(q)


@pytest.mark.parametrize("q", [(0, 0, 0, 0), (1, 1, 0, 0)], ids=["zero", "too long"])
def test_a_quaternion_has_length_one(q: object) -> None:
    with pytest.raises(RotationError, match="normalise"):
        so3.from_quaternion(q)


def test_random_rotations_are_uniform() -> None:
    """Haar measure: the angle has the distribution (a - sin a)/pi, and every column is uniform on the sphere."""
    generator = np.random.default_rng(1)
    drawn = np.array([so3.random(generator) for _ in range(2000)])
    turned = np.arccos(np.clip((np.trace(drawn, axis1=1, axis2=2) - 1) / 2, -1, 1))
    assert scipy.stats.kstest(turned, lambda a: (a - np.sin(a)) / np.pi).pvalue > 0.01
    for entry in drawn.reshape(-1, 9).T:  # Archimedes: each coordinate of a uniform point of the sphere is uniform
        assert scipy.stats.kstest(entry, scipy.stats.uniform(-1, 2).cdf).pvalue > 0.001


def test_random_rotations_repeat_with_their_seed() -> None:
    first, second = (so3.random(np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(first, second)


# --- drift and shapes ------------------------------------------------------------------------------------------------


@given(batches(rotations()), vectors(1e-3, length=9))
def test_drift_of_many_is_the_largest_of_each(many: np.ndarray, error: np.ndarray) -> None:
    many = many + error.reshape(3, 3)
    assert so3.drift(many) == max(so3.drift(one) for one in many)


def test_drift_measures_the_departure_from_orthonormal() -> None:
    assert so3.drift(np.eye(3)) == 0
    assert so3.drift(1.1 * np.eye(3)) == pytest.approx(0.21)
    assert so3.drift(np.eye(3)[[1, 2, 0]] + 0.5 * np.eye(3)) == pytest.approx(0.5)


@pytest.mark.parametrize("function", [so3.log, so3.project, so3.as_matrix])
@pytest.mark.parametrize(
    "matrix",
    [np.eye(4), [1, 2, 3], [[1, 0, 0], [0, np.nan, 0], [0, 0, 1]], [[1, 2], [3]], "rotation"],
    ids=["4x4", "vector", "NaN", "ragged", "text"],
)
def test_a_matrix_is_three_rows_of_three_finite_numbers(function, matrix: object) -> None:
    with pytest.raises(ShapeError, match="matrix"):
        function(matrix)

"""Transverse feedback linearization: the decoupling matrix, its determinant, and the input that makes chains of integrators."""

from __future__ import annotations

import functools
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.law import decoupling_matrix, linearize
from gammastar.vehicle import split
from strategies import CURVES, IMPLICIT, PATHS, VEHICLES, feet, flow, numbers, states, vectors

BODIES = dict(
    zip(PATHS, [*VEHICLES, *VEHICLES, *VEHICLES, *VEHICLES, *VEHICLES], strict=False)
)  # each path flies one of them


few = settings(max_examples=25)  # on each of fourteen paths


class Chains(NamedTuple):
    """The ends of the chains of integrators at a state and an input."""

    highest: np.ndarray  # (n + 2,) fourth derivatives and beta', by differentiating along the flow
    drift: np.ndarray  # (n + 2,) the same without input: L_f^4 and L_f beta
    slope: np.ndarray  # (n + 2, 4) their derivative with respect to the input
    matrix: np.ndarray  # (n + 2, 4) D of the law
    realised: np.ndarray  # (n + 2,) highest derivatives under the input for a request
    requested: np.ndarray  # (n + 2,)
    input: np.ndarray  # (4,) that input
    unreached: np.ndarray  # how the input enters lower derivatives

    @property
    def size(self) -> float:
        return 1 + max(np.abs(part).max() for part in (self.highest, self.drift, self.slope, self.requested))


def curved(yaw_rate: ca.SX) -> ca.SX:
    """Graph: beta(r) = sinh(r / 5), smooth with slope cosh(r / 5) / 5 > 0."""
    return ca.sinh(yaw_rate / 5)


@functools.cache
def chains(name: str) -> ca.Function:
    """Return (state, parameter, input, request) -> the fields of `Chains`."""
    path, vehicle = PATHS[name], VEHICLES[BODIES[name]]
    state, control, rate = flow(vehicle)
    parameter, request = ca.SX.sym("parameter"), ca.SX.sym("request", path.components + 2)
    linear = linearize(vehicle, path, split(state), parameter, curved)
    outputs = linear.outputs
    where, moving = ca.vertcat(state, parameter), ca.vertcat(rate, outputs.tangential[1])
    normal = ca.SX.eye(2)
    if name in CURVES:
        tangent = CURVES[name].jet(parameter, 1)[1]
        normal = ca.SX.eye(3) - ca.mtimes(tangent, tangent.T) / ca.dot(tangent, tangent)
    across = ca.mtimes(normal, ca.jtimes(outputs.transverse[:, 3], where, moving))
    highest = ca.vertcat(
        across, ca.jtimes(outputs.tangential[3], where, moving), ca.jtimes(linear.yaw_value, where, moving)
    )
    at = ca.Function("highest", [state, parameter, control], [highest])
    requested = ca.vertcat(ca.mtimes(normal, request[:-2]), request[-2:])
    answer = linear.input_for(requested[:-2], requested[-2], requested[-1])
    lower = ca.jtimes(ca.vertcat(ca.vec(outputs.transverse[:, :3]), outputs.tangential[:3]), where, moving)
    results = [
        highest,
        at(state, parameter, ca.SX.zeros(4)),
        ca.jacobian(highest, control),
        decoupling_matrix(linear),
        at(state, parameter, answer),
        requested,
        answer,
        ca.jacobian(lower, control),
    ]
    return ca.Function("chains", [state, parameter, control, request], [ca.densify(result) for result in results])


@st.composite
def situations(draw: st.DrawFn, name: str) -> tuple[np.ndarray, Chains, float]:
    """Return a state near, on or far from a path, what its chains do there, and the focal margin."""
    foot = draw(feet(name))
    vehicle = VEHICLES[BODIES[name]]
    x = draw(states(foot.position, weight=9.8 * vehicle.mass))
    u, request = draw(vectors(5.0, 4)), draw(vectors(50.0, PATHS[name].components + 2))
    values = [np.array(value) for value in chains(name)(x, foot.parameter, u, request)]
    flat = {"slope", "matrix", "unreached"}
    return x, Chains(*(v if f in flat else v.ravel() for f, v in zip(Chains._fields, values, strict=True))), foot.margin


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_decoupling_matrix_is_the_slope_of_the_highest_derivatives(name: str, data: st.DataObject) -> None:
    """Eq. (17): D = d/du of the fourth derivatives, which are affine in u: highest = L_f^4 + D u."""
    _, found, margin = data.draw(situations(name))
    assert np.abs(found.matrix - found.slope).max() <= 1e-12 * found.size / min(1, margin) ** 4


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_highest_derivatives_are_affine_in_the_input(name: str, data: st.DataObject) -> None:
    _, found, margin = data.draw(situations(name))
    u = found.input
    size = found.size + np.abs(found.slope).max() * np.abs(u).max()
    assert np.abs(found.drift + found.slope @ u - found.realised).max() <= 1e-12 * size / min(1, margin) ** 4


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_input_solves_the_decoupling_equation(name: str, data: st.DataObject) -> None:
    """Eq. (23): D u = v - L_f^4, by asking what the motion then does; v lies in the normal plane of a curve."""
    _, found, margin = data.draw(situations(name))
    size = found.size + np.abs(found.slope).max() * np.abs(found.input).max()
    assert np.abs(found.realised - found.requested).max() <= 1e-12 * size / min(1, margin) ** 4


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_input_enters_no_lower_derivative(name: str, data: st.DataObject) -> None:
    """Eq. (16): the vector relative degree is {4, 4, 4, 1}."""
    _, found, _ = data.draw(situations(name))
    assert np.all(found.unreached == 0)


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_decoupling_matrix_has_full_rank_wherever_there_is_thrust(name: str, data: st.DataObject) -> None:
    """Lemma 4, and beyond Gamma*: rank 4 at any attitude; two of the three transverse rows of a curve are independent."""
    _, found, _ = data.draw(situations(name))
    scaled = found.matrix / np.linalg.norm(found.matrix, axis=0)  # columns of very different units
    assert np.linalg.matrix_rank(scaled, tol=1e-9) == 4
    if name in CURVES:
        assert np.linalg.matrix_rank(found.matrix[:3] / np.linalg.norm(found.matrix[:3]), tol=1e-9) == 2


@functools.cache
def gradients(name: str) -> ca.Function:
    path, x = IMPLICIT[name], ca.SX.sym("x", 3)
    outputs = [formula(*ca.vertsplit(x)) for formula in (path.first, path.second, path.coordinate)]
    return ca.Function("gradients", [x], [ca.jacobian(ca.vertcat(*outputs), x)])


@pytest.mark.parametrize("name", IMPLICIT)
@settings(max_examples=50)
@given(st.data())
def test_the_determinant_is_the_papers_with_the_gradient_of_pi(name: str, data: st.DataObject) -> None:
    """Eq. (18), corrected: det D = zeta1^2 beta' det R <-d alpha1, d alpha2 x d pi> / (m^3 det J), on the path and off it."""
    x, found, _ = data.draw(situations(name))
    vehicle = VEHICLES[BODIES[name]]
    first, second, along = np.array(gradients(name)(x[:3]))
    slope = np.cosh(x[17] / 5) / 5
    expected = (
        x[18] ** 2 * slope * (-first @ np.cross(second, along)) / (vehicle.mass**3 * np.linalg.det(vehicle.inertia))
    )
    # a product of numbers as large as the columns: relative to them, not to a small determinant
    assert np.linalg.det(found.matrix) == pytest.approx(
        expected, rel=1e-10, abs=1e-13 * np.prod(np.linalg.norm(found.matrix, axis=0))
    )


def test_the_printed_determinant_differs_off_the_path() -> None:
    """With sigma' in place of the gradient of pi, Eq. (18) is off by the distance to the axis: 3 m instead of 1 m here."""
    name = "implicit circle"
    position = np.array([3.0, 0.0, 10.0])
    first, second, along = np.array(gradients(name)(position))
    tangent = CURVES["circle"].jets(np.array([0.0]))[0, 1]
    assert first @ np.cross(second, tangent) == pytest.approx(3 * (first @ np.cross(second, along)), rel=1e-12)


@few
@given(feet("tilted circle"), st.data())
def test_the_internal_state_is_two_columns_and_the_thrust(foot, data: st.DataObject) -> None:
    """Eq. (20)."""
    x = data.draw(states(foot.position))
    parts = split(ca.DM(x))
    linear = linearize(VEHICLES["paper"], CURVES["tilted circle"], parts, foot.parameter, curved)
    assert np.array(ca.DM(linear.internal_state())).ravel().tolist() == [*x[6:12], x[18]]
    assert float(linear.yaw_value) == pytest.approx(np.sinh(x[17] / 5), rel=1e-14)
    assert float(linear.yaw_slope) == pytest.approx(np.cosh(x[17] / 5) / 5, rel=1e-14)


@given(numbers(0.1, 3.0))
def test_the_determinant_vanishes_as_the_square_of_the_thrust(share: float) -> None:
    """Free fall, the first of the two singularities: halving the thrust quarters det D."""
    name = "implicit circle"
    x = np.array([2, 1, 9, 0.3, -0.2, 0.1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.1, 0.2, 0.3, share, 0.0])
    values = []
    for part in (1.0, 0.5):
        x[18] = share * part
        values.append(np.linalg.det(np.array(chains(name)(x, 0.46, np.zeros(4), np.zeros(4))[3])))
    assert values[0] == pytest.approx(4 * values[1], rel=1e-12)

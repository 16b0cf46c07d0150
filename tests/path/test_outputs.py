"""The contract of a path: outputs that are derivatives of each other, that snap reaches, and that can be inverted.

Every law here runs on every path of `strategies.PATHS`, of both kinds.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar import taylor
from gammastar.path import PathOutputs
from gammastar.taylor import Series
from strategies import CURVES, IMPLICIT, PATHS, Foot, feet, numbers, uneven, vectors

few = settings(max_examples=40)  # on each of fourteen paths
motions = st.builds(  # velocity, acceleration, jerk, snap as columns (3, 4)
    lambda *columns: np.column_stack(columns), vectors(3.0), vectors(10.0), vectors(30.0), vectors(100.0)
)


class Answers(NamedTuple):
    """What a path says about a position and its first four derivatives, and what differentiation says about that."""

    transverse: np.ndarray  # (n, 4)
    tangential: np.ndarray  # (4,)
    transverse_highest: np.ndarray  # (n,) drift + gradient @ snap
    tangential_highest: float
    transverse_rate: np.ndarray  # (n, 4) d/dt of the columns along the motion, in the normal plane for a curve
    tangential_rate: np.ndarray  # (4,)
    margin: float
    realised: np.ndarray  # (n + 1,) highest derivatives of the snap that `snap` answers to a request
    requested: np.ndarray  # (n + 1,) that request
    recovered: np.ndarray  # (3, 5) position series of these outputs

    @property
    def size(self) -> float:
        """The largest number in the chains, to which rounding is relative, amplified towards focal points."""
        chains = (self.transverse, self.tangential, self.transverse_rate, self.tangential_rate)
        return 1 + max(np.abs(part).max() for part in chains) / min(1, self.margin) ** 2


@functools.cache
def answers(name: str) -> ca.Function:
    """Return (position with four derivatives (3, 5), parameter, request) -> the fields of `Answers`."""
    path = PATHS[name]
    chi, parameter = ca.SX.sym("chi", 3, 5), ca.SX.sym("parameter")
    request = ca.SX.sym("request", path.components + 1)
    outputs = path.outputs(Series.from_derivatives(ca.horzsplit(chi[:, :4])), parameter)
    snap = chi[:, 4]
    normal = normal_plane(path, parameter)
    where = ca.vertcat(ca.vec(chi[:, :4]), parameter)
    rate = ca.vertcat(ca.vec(chi[:, 1:]), outputs.tangential[1])

    def highest(snap: Any) -> tuple[Any, Any]:
        return (
            outputs.transverse_drift + ca.mtimes(outputs.transverse_gradient, snap),
            outputs.tangential_drift + ca.mtimes(outputs.tangential_gradient, snap),
        )

    derivative = ca.reshape(ca.jtimes(ca.vec(outputs.transverse), where, rate), path.components, 4)
    tangential_rate = ca.jtimes(outputs.tangential, where, rate)
    requested = ca.vertcat(ca.mtimes(normal, request[:-1]), request[-1])
    realised = highest(outputs.snap(requested[:-1], requested[-1]))
    across, along = highest(snap)
    recovered = path.position_series(
        ca.horzcat(outputs.transverse, across), ca.vertcat(outputs.tangential, along), chi[:, 0] + 1e-3
    )
    results = [
        outputs.transverse,
        outputs.tangential,
        across,
        along,
        ca.mtimes(normal, derivative),
        tangential_rate,
        outputs.focal_margin,
        ca.vertcat(*realised),
        requested,
        ca.horzcat(*recovered.derivatives()),
    ]
    return ca.Function("answers", [chi, parameter, request], ca.cse([ca.densify(ca.SX(result)) for result in results]))


def normal_plane(path: Any, parameter: Any) -> Any:
    """Graph: the projector onto the normal plane of a curve; nothing to project for an implicit path."""
    if path.components == 2:
        return ca.SX.eye(2)
    tangent = path.jet(parameter, 1)[1]
    return ca.SX.eye(3) - ca.mtimes(tangent, tangent.T) / ca.dot(tangent, tangent)


def ask(name: str, foot: Foot, motion: np.ndarray, request: np.ndarray | None = None) -> Answers:
    request = np.zeros(PATHS[name].components + 1) if request is None else request
    values = answers(name)(np.column_stack([foot.position, motion]), foot.parameter, request)
    found = Answers(*(np.array(value) for value in values))
    flat = {field: value.ravel() for field, value in found._asdict().items() if value.shape[1] == 1}
    numbers = {field: float(flat[field][0]) for field in ("tangential_highest", "margin")}
    return found._replace(**flat | numbers)


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_outputs_are_derivatives_of_each_other(name: str, data: st.DataObject) -> None:
    """xi_{k+1} = P d/dt xi_k and eta_{k+1} = d/dt eta_k, up to the fourth derivative, by automatic differentiation."""
    foot, motion = data.draw(feet(name)), data.draw(motions)
    found = ask(name, foot, motion)
    across = np.column_stack([found.transverse[:, 1:], found.transverse_highest])
    along = np.append(found.tangential[1:], found.tangential_highest)
    assert np.abs(across - found.transverse_rate).max() <= 1e-12 * found.size
    assert np.abs(along - found.tangential_rate).max() <= 1e-12 * found.size


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_snap_realises_the_requested_fourth_derivatives(name: str, data: st.DataObject) -> None:
    foot, motion = data.draw(feet(name)), data.draw(motions)
    request = data.draw(vectors(100.0, PATHS[name].components + 1))
    found = ask(name, foot, motion, request)
    assert np.abs(found.realised - found.requested).max() <= 1e-12 * (found.size + 100)


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_position_series_inverts_the_outputs(name: str, data: st.DataObject) -> None:
    foot, motion = data.draw(feet(name)), data.draw(motions)
    found = ask(name, foot, motion)
    expected = np.column_stack([foot.position, motion])
    assert np.abs(found.recovered - expected).max() <= 1e-12 * found.size * (1 + np.abs(foot.position).max())


@pytest.mark.parametrize("name", CURVES)
@few
@given(st.data())
def test_the_transverse_output_of_a_curve_is_the_vector_from_its_nearest_point(name: str, data: st.DataObject) -> None:
    foot = data.draw(feet(name))
    found = ask(name, foot, np.zeros((3, 4)))
    assert found.transverse[:, 0] == pytest.approx(
        foot.position - PATHS[name].points(np.array([foot.parameter]))[0], abs=0
    )
    assert found.tangential.tolist() == [foot.parameter, 0, 0, 0]
    assert np.all(found.transverse[:, 1:] == 0)


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_focal_margin_is_the_one_of_geometry(name: str, data: st.DataObject) -> None:
    """1 - <e, sigma''>/|sigma'|^2 for a curve; for an implicit path see `margin_of`, where the seed lies on the path."""
    foot = data.draw(feet(name))
    assert ask(name, foot, np.zeros((3, 4))).margin == pytest.approx(foot.margin, rel=1e-12)


# --- exact solutions -------------------------------------------------------------------------------------------------


def polynomial_derivatives(coefficients: np.ndarray) -> np.ndarray:
    """Return value and four derivatives of a polynomial at time zero."""
    return coefficients * np.array([1, 1, 2, 6, 24])


@pytest.mark.parametrize("kind", ["circle", "implicit circle"])
@given(numbers(-3, 3), vectors(0.6, 5), vectors(0.6, 5), vectors(2.0, 4))
def test_cylinder_coordinates_are_the_outputs_of_a_circle(
    kind: str, angle: float, outward: np.ndarray, down: np.ndarray, turning: np.ndarray
) -> None:
    """chi(t) = ((1 + a) cos b, (1 + a) sin b, 10 + c): the outputs are a, c and b with their plain derivatives."""
    coefficients = [outward, down, np.array([angle, *turning])]
    position = np.array([p(angle, outward, down, turning) for p in CYLINDER])[:, :, 0].T
    foot = Foot(position[:, 0], angle, 1 + outward[0])
    found = ask(kind, foot, position[:, 1:])
    a, c, b = (polynomial_derivatives(values) for values in coefficients)
    if kind == "circle":  # vectors of the normal plane: outwards and down
        frame = np.array([[np.cos(angle), np.sin(angle), 0], [0, 0, 1]])
        transverse, highest = frame @ found.transverse, frame @ found.transverse_highest
    else:
        transverse, highest = found.transverse, found.transverse_highest
    across = np.column_stack([transverse, highest])
    assert np.abs(across - np.array([a, c])).max() <= 1e-12 * found.size
    assert np.abs(np.append(found.tangential, found.tangential_highest) - b).max() <= 1e-12 * found.size


def cylinder() -> list[ca.Function]:
    """Return the five time derivatives of a motion in cylinder coordinates, by automatic differentiation."""
    time, angle = ca.SX.sym("time"), ca.SX.sym("angle")
    outward, down, turning = (ca.SX.sym(name, length) for name, length in (("a", 5), ("c", 5), ("b", 4)))
    powers = ca.vertcat(*(time**k for k in range(5)))
    a, c, b = ca.dot(outward, powers), ca.dot(down, powers), angle + ca.dot(turning, powers[1:])
    derivatives = [ca.vertcat((1 + a) * ca.cos(b), (1 + a) * ca.sin(b), 10 + c)]
    for _ in range(4):
        derivatives.append(ca.jacobian(derivatives[-1], time))
    symbols = [angle, outward, down, turning]
    return [ca.Function("derivative", symbols, [ca.substitute(d, time, ca.SX(0))]) for d in derivatives]


CYLINDER = cylinder()


@given(feet("line"), motions)
def test_along_a_line_the_outputs_are_the_parts_of_the_motion(foot: Foot, motion: np.ndarray) -> None:
    """Zero curvature is no special case: xi_k = P chi^(k), eta_k = <t, chi^(k)>."""
    found = ask("line", foot, motion)
    tangent = np.array([1, -1, 0.5]) / 1.5
    along = tangent @ motion
    across = np.column_stack([found.transverse[:, 1:], found.transverse_highest])
    assert across == pytest.approx(motion - np.outer(tangent, along), abs=1e-12)
    assert np.append(found.tangential[1:], found.tangential_highest) == pytest.approx(along, abs=1e-12)
    assert found.margin == 1


# --- any frame, any parameter ----------------------------------------------------------------------------------------


def flight_past(name: str, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return parameters, outputs (n, rows, 4) and eta (n, 4) along an analytic motion beside a path, one time after the other."""
    path, time, parameter = PATHS[name], ca.SX.sym("time"), ca.SX.sym("parameter")
    start = float(np.mean(path.domain))
    near = start + 0.9 * ca.sin(time) + 0.4 * time
    if name in CURVES:
        point = path.jet(near, 0)[0]
    else:
        twin = {"quadratic circle": "circle", "implicit circle": "circle", "implicit tilted circle": "tilted circle"}
        point = (
            ca.vertcat(near / 9, (near / 9) ** 2, 0.1 * (near / 9) ** 3)
            if name == "parabola"
            else CURVES[twin[name]].jet(near, 0)[0]
        )
    position = point + 0.15 * ca.vertcat(ca.sin(2 * time), ca.cos(1.5 * time), ca.sin(time + 1))
    derivatives = [position]
    for _ in range(3):
        derivatives.append(ca.jacobian(derivatives[-1], time))
    tracked = path.track(position, parameter)
    for _ in range(3):
        tracked = path.track(position, tracked)
    outputs = path.outputs(Series.from_derivatives(derivatives), tracked)
    step = ca.Function("step", [parameter, time], [tracked, outputs.transverse, outputs.tangential])
    current = path.start_parameter(np.array(ca.Function("at", [time], [position])(times[0])).ravel())
    rows = []
    for moment in times:
        for part in np.linspace(0, 1, 9)[1:]:  # small moves, so that Newton steps keep to the nearest point
            before = rows[-1][0] if rows else moment
            current, transverse, tangential = step(current, before + part * (moment - before))
        rows.append((moment, float(current), np.array(transverse), np.array(tangential).ravel()))
    return np.array([r[1] for r in rows]), np.array([r[2] for r in rows]), np.array([r[3] for r in rows])


@pytest.mark.parametrize("name", PATHS)
def test_components_are_plain_derivatives_along_a_flight(name: str) -> None:
    """In the frame of the path the components integrate into each other (Gauss-Legendre over a flight of 2 s)."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    panels = np.arange(4)[:, None] / 2
    times = np.concatenate([[0.0], (panels + (nodes + 1) / 4).ravel(), [2.0]])
    weights = np.tile(weights / 4, 4)
    parameters, transverse, tangential = flight_past(name, times)
    components = PATHS[name].normal_components(parameters, transverse)
    assert components.shape == (122, 2, 4)
    changes = components[-1] - components[0]
    integrals = np.tensordot(weights, components[1:-1], 1)
    # the quadrature is exact to rounding; the frame of a twisted curve is transported to 1e-12 a step
    assert integrals[:, 1:] == pytest.approx(changes[:, :-1], abs=1e-11 * np.abs(components).max())
    along = np.tensordot(weights, tangential[1:-1], 1)
    assert along[1:] == pytest.approx((tangential[-1] - tangential[0])[:-1], abs=1e-11 * np.abs(tangential).max())
    if name in CURVES:  # components keep the length of the vector
        assert np.linalg.norm(components[:, :, 0], axis=1) == pytest.approx(np.linalg.norm(transverse[:, :, 0], axis=1))


@pytest.mark.parametrize("name", PATHS)
def test_normal_vectors_invert_normal_components(name: str) -> None:
    path, parameters = PATHS[name], np.array([0.7, -0.4, 1.1, 0.7, 0.2])
    if name in CURVES:
        across = np.random.default_rng(0).normal(size=(5, 3, 4))
        tangents = CURVES[name].tangents(parameters)
        across -= np.einsum("ki,kj,kjm->kim", tangents, tangents, across)
    else:
        across = np.random.default_rng(0).normal(size=(5, 2, 4))
    components = path.normal_components(parameters, across)
    assert path.normal_vectors(parameters, components, parameters[0]) == pytest.approx(across, abs=1e-11)
    single = np.concatenate(
        [path.normal_vectors(parameters[k : k + 1], components[k : k + 1], parameters[0]) for k in range(5)]
    )
    assert single == pytest.approx(across, abs=1e-11)


@given(feet("uneven circle"), motions)
def test_outputs_do_not_depend_on_the_parameterisation(foot: Foot, motion: np.ndarray) -> None:
    """Lambda = mu + 0.3 sin(mu): the same transverse vectors, and coordinates along the path related by the chain rule."""
    by_mu = ask("uneven circle", foot, motion)
    angle = foot.parameter + 0.3 * np.sin(foot.parameter)
    by_angle = ask("circle", Foot(foot.position, angle, foot.margin), motion)
    assert np.abs(by_mu.transverse - by_angle.transverse).max() <= 1e-12 * by_angle.size
    assert np.abs(by_mu.transverse_highest - by_angle.transverse_highest).max() <= 1e-12 * by_angle.size
    chain = np.array(CHAIN(np.append(by_mu.tangential, by_mu.tangential_highest))).ravel()
    expected = np.append(by_angle.tangential, by_angle.tangential_highest)
    assert np.abs(chain - expected).max() <= 1e-11 * (by_mu.size + np.abs(by_mu.tangential).max() ** 4)
    assert by_mu.margin == pytest.approx(by_angle.margin, rel=1e-12)


def chain_rule() -> ca.Function:
    """Return derivatives of mu (5,) -> derivatives of mu + 0.3 sin(mu)."""
    mu, symbol = ca.SX.sym("mu", 5), ca.SX.sym("symbol")
    series = Series.from_derivatives(ca.vertsplit(mu))
    angle = taylor.through(ca.Function("uneven", [symbol], [uneven(symbol)]), [series])[0]
    return ca.Function("chain", [mu], [ca.vertcat(*angle.derivatives())])


CHAIN = chain_rule()


def test_higher_coefficients_of_the_position_are_ignored() -> None:
    """The drift is free of the snap, whatever the caller's series holds beyond the jerk."""
    for path in (PATHS["helix"], PATHS["implicit circle"]):
        chi, parameter = ca.SX.sym("chi", 3, 6), ca.SX.sym("parameter")
        short = path.outputs(Series.from_derivatives(ca.horzsplit(chi[:, :4])), parameter)
        long: PathOutputs = path.outputs(Series.from_derivatives(ca.horzsplit(chi)), parameter)
        for a, b in ((short.transverse_drift, long.transverse_drift), (short.tangential_drift, long.tangential_drift)):
            both = ca.Function("both", [chi, parameter], [a, b])
            first, second = (np.array(value) for value in both(np.random.default_rng(0).normal(size=(3, 6)), 0.3))
            assert np.array_equal(first, second)


def test_both_kinds_are_covered() -> None:
    assert {path.components for path in CURVES.values()} == {3}
    assert {path.components for path in IMPLICIT.values()} == {2}

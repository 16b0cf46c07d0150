"""The law: it realises the error chains that its poles promise, for every path, body and kind of reference."""

from __future__ import annotations

import functools
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gammastar.errors import GammastarError, InputError, PoleError, SingularStartError, UnknownNameError
from gammastar.law import KalmanFilter, Law, Observer, design
from gammastar.law.design import CHAINS, DEFAULT_POLES
from gammastar.vehicle import State, Vehicle, split
from strategies import (
    CURVES,
    PAPER_VEHICLE,
    PATHS,
    VEHICLES,
    Foot,
    feet,
    flow,
    numbers,
    state_of_motion,
    states,
    vectors,
)

BODIES = dict(zip(PATHS, list(VEHICLES) * 5, strict=False))  # each path flies one of them
POLES = {
    "transverse": (-2 + 1j, -2 - 1j, -3, -4),
    "tangential": (-1.5, -1.5, -2.5, -5),
    "speed": (-1, -2 + 3j, -2 - 3j),
    "yaw": -1.7,
}
few = settings(max_examples=25)  # on each of fourteen paths


def curved(yaw_rate: ca.SX) -> ca.SX:
    """Graph: beta(r) = sinh(r / 5)."""
    return ca.sinh(yaw_rate / 5)


@functools.cache
def law_of(name: str) -> Law:
    poles = POLES if name in CURVES else POLES | {"transverse_2": (-1.2, -2.2, -3.2, -4.2)}
    return design(VEHICLES[BODIES[name]], PATHS[name], poles, curved)


class Loop(NamedTuple):
    """The transformed state under the law, and the highest derivatives that it causes."""

    transverse: np.ndarray  # (n, 4)
    tangential: np.ndarray  # (4,)
    yaw: np.ndarray
    transverse_highest: np.ndarray  # (n,)
    tangential_highest: np.ndarray
    yaw_highest: np.ndarray
    input: np.ndarray  # (4,)


@functools.cache
def loop_of(name: str, holds_position: bool) -> ca.Function:
    """Return (state, parameter, reference (5,), yaw reference (2,)) -> the fields of `Loop`, derivatives along the flow."""
    law = law_of(name)
    state, control, rate = flow(law.vehicle)
    parameter, reference, yaw = ca.SX.sym("parameter"), ca.SX.sym("reference", 5), ca.SX.sym("yaw", 2)
    answer = law.control(split(state), parameter, reference, yaw, holds_position)
    outputs = answer.linearization.outputs
    where, moving = ca.vertcat(state, parameter), ca.vertcat(rate, outputs.tangential[1])
    normal = ca.SX.eye(2)
    if name in CURVES:
        tangent = CURVES[name].jet(parameter, 1)[1]
        normal = ca.SX.eye(3) - ca.mtimes(tangent, tangent.T) / ca.dot(tangent, tangent)
    highest = ca.Function(
        "highest",
        [state, parameter, control],
        [
            ca.mtimes(normal, ca.jtimes(outputs.transverse[:, 3], where, moving)),
            ca.jtimes(outputs.tangential[3], where, moving),
            ca.jtimes(answer.linearization.yaw_value, where, moving),
        ],
    )
    results = [outputs.transverse, outputs.tangential, answer.linearization.yaw_value]
    results += [*highest(state, parameter, answer.input), answer.input]
    return ca.Function("loop", [state, parameter, reference, yaw], [ca.densify(ca.SX(result)) for result in results])


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data())
def test_the_law_realises_its_error_chains(name: str, data: st.DataObject) -> None:
    """Eqs. (25), (26), signs corrected: every chain obeys its own poles, whatever the state and the reference."""
    law, foot, holds_position = law_of(name), data.draw(feet(name)), data.draw(st.booleans())
    x = data.draw(states(foot.position, weight=9.8 * law.vehicle.mass))
    reference, yaw = data.draw(vectors(5.0, 5)), data.draw(vectors(1.0, 2))
    values = [np.array(v) for v in loop_of(name, holds_position)(x, foot.parameter, reference, yaw)]
    found = Loop(values[0], *(value.ravel() for value in values[1:]))
    gains = {chain: np.poly(np.atleast_1d(poles))[:0:-1].real for chain, poles in law.poles.items()}
    per_row = [gains["transverse"]] * (len(found.transverse) - 1) + [gains["transverse_2"]]
    across = -np.sum(np.array(per_row) * found.transverse, axis=1)
    error = found.tangential - reference[:4]
    along = gains["tangential"] @ error if holds_position else gains["speed"] @ error[1:]
    size = 1 + max(np.abs(part).max() for part in (found.transverse, found.tangential, reference)) * 100
    size += np.abs(found.input).max() * 100 / law.vehicle.mass
    tolerance = 1e-12 * size / min(1, foot.margin) ** 4
    assert found.transverse_highest == pytest.approx(across, abs=tolerance)
    assert found.tangential_highest == pytest.approx([reference[4] - along], abs=tolerance)
    assert found.yaw_highest == pytest.approx([yaw[1] - gains["yaw"][0] * (found.yaw[0] - yaw[0])], abs=tolerance)


# --- both kinds of path are one law ----------------------------------------------------------------------------------

TWINS = {"circle": "implicit circle", "tilted circle": "implicit tilted circle"}


@functools.cache
def both_inputs(name: str, body: str) -> ca.Function:
    """Return (state, angle, reference) -> input with the curve, input with the implicit path in distance coordinates."""
    state, angle, reference = ca.SX.sym("state", 20), ca.SX.sym("angle"), ca.SX.sym("reference", 5)
    inputs = []
    for path in (PATHS[name], PATHS[TWINS[name]]):
        law = design(VEHICLES[body], path, poles={key: POLES[key] for key in ("transverse", "tangential", "yaw")})
        inputs.append(law.control(split(state), angle, reference, ca.vertcat(0.1, 0), True).input)
    return ca.Function("inputs", [state, angle, reference], [ca.densify(u) for u in inputs])


@pytest.mark.parametrize("body", VEHICLES)
@pytest.mark.parametrize("name", TWINS)
@settings(max_examples=60)
@given(st.data())
def test_both_kinds_of_circle_give_the_same_input(name: str, body: str, data: st.DataObject) -> None:
    """To 1e-12 of the input, in any plane, at random states: a tube of 0.2 to 30 m around a circle of 1 or 2 m."""
    foot = data.draw(feet(name, least_margin=0.2))
    vehicle = VEHICLES[body]
    x = data.draw(states(foot.position, weight=9.8 * vehicle.mass))
    reference = data.draw(vectors(3.0, 5))
    curve, implicit = (np.array(u).ravel() for u in both_inputs(name, body)(x, foot.parameter, reference))
    # rounding of the outputs passes through D^-1: relative to the terms that make up each input, not to a small sum
    terms = 100 * (1 + np.abs(foot.position).max()) * vehicle.mass * max(1, np.abs(vehicle.inertia).max() / x[18])
    assert np.abs(curve - implicit).max() <= 1e-12 * (terms + np.abs(curve).max())


def start_on_the_circle() -> State:
    return State((1.2, -0.4, 9.7), (0.3, 0.2, -0.1), np.eye(3), (0.1, -0.2, 0.3), 1.1, 0.2)


def test_the_transformed_states_of_both_kinds_agree() -> None:
    vehicle = VEHICLES["full inertia"]
    curve, implicit = (design(vehicle, PATHS[name]) for name in ("circle", "implicit circle"))
    start = start_on_the_circle()
    (xi, eta, mu), (xi_2, eta_2, mu_2) = curve.transformed_state(start), implicit.transformed_state(start)
    outward = np.append(start.position[:2], 0) / np.linalg.norm(start.position[:2])
    assert np.array([outward, [0, 0, 1]]) @ xi == pytest.approx(xi_2, abs=1e-13)
    assert (eta[0] - eta_2[0]) / (2 * np.pi) == pytest.approx(round((eta[0] - eta_2[0]) / (2 * np.pi)), abs=1e-13)
    assert eta[1:] == pytest.approx(eta_2[1:], abs=1e-13)
    assert np.array_equal(mu, mu_2)
    assert mu.tolist() == [*start.attitude[:, 0], *start.attitude[:, 1], 1.1]


# --- invariance of the path-following manifold -----------------------------------------------------------------------


@pytest.mark.parametrize("name", PATHS)
@few
@given(st.data(), numbers(-1.5, 1.5), numbers(-3, 3))
def test_a_motion_along_the_path_is_on_the_manifold(
    name: str, data: st.DataObject, speed: float, heading: float
) -> None:
    """Gamma*, Eq. (11) for i = 0 ... 3: the state that differential flatness gives to sigma(s t) has xi = 0, eta = (., s, 0, 0)."""
    path, vehicle = PATHS[name], VEHICLES[BODIES[name]]
    parameter = data.draw(numbers(*path.domain))
    jets = path.jets(np.array([parameter]))[0]
    state = state_of_motion(vehicle, tuple(jets[k] * speed**k for k in range(4)), heading)
    xi, eta, _ = law_of(name).transformed_state(state)
    size = 1 + np.abs(jets).max()
    assert xi == pytest.approx(np.zeros_like(xi), abs=1e-12 * size)
    assert eta[1:4] == pytest.approx([speed, 0, 0], abs=1e-12 * size)


# --- poles -----------------------------------------------------------------------------------------------------------


def test_one_pole_is_every_pole() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=-2.5)
    assert {chain: set(poles) for chain, poles in law.poles.items()} == {chain: {-2.5 + 0j} for chain in CHAINS}
    assert {chain: len(poles) for chain, poles in law.poles.items()} == CHAINS
    assert law.gains["yaw"].tolist() == [2.5]


def test_four_poles_are_those_of_both_chains() -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"], poles=(-1, -2, -3, -4))
    for chain in ("transverse", "transverse_2", "tangential"):
        assert law.poles[chain] == (-1, -2, -3, -4)
    assert law.poles["speed"] == (-2, -3, -4)
    assert law.gains["speed"].tolist() == [24, 26, 9]
    assert law.tangential_gains(holds_position=True).tolist() == [24, 50, 35, 10]
    assert law.tangential_gains(holds_position=False).tolist() == [0, 24, 26, 9]


def test_the_order_of_chains_does_not_tell_laws_apart() -> None:
    """Nor does it whether a chain is named that has its default anyway: `fly_many` flies such laws together."""
    named = {"yaw": -2.0, "speed": (-2.0, -3.0, -4.0), "transverse": -3.0, "tangential": (-1.0, -2.0, -3.0, -4.0)}
    turned = dict(reversed(named.items()))
    left_out = {name: poles for name, poles in named.items() if name != "speed"}
    laws = [design(PAPER_VEHICLE, CURVES["circle"], poles) for poles in (named, turned, left_out)]
    assert laws[0].signature == laws[1].signature == laws[2].signature


def test_a_mapping_keeps_the_defaults_that_it_leaves_out() -> None:
    law = design(PAPER_VEHICLE, PATHS["implicit circle"], {"transverse_2": -4, "speed": (-1, -2, -3)})
    assert law.poles["transverse"] == law.poles["tangential"] == DEFAULT_POLES
    assert law.poles["transverse_2"] == (-4,) * 4
    assert law.poles["speed"] == (-1, -2, -3)


BAD_POLES = {
    "unstable": (1.0, PoleError, "negative real parts"),
    "one unstable": ((-1, -2, -3, 0.5), PoleError, "negative real parts"),
    "three": ((-1, -2, -3), PoleError, "one number or 4"),
    "unpaired": (-2 + 1j, PoleError, "conjugate"),
    "NaN": (np.nan, PoleError, "finite"),
    "nothing": (None, PoleError, "finite|number"),
    "text": ("slow", PoleError, "numbers"),
    "four speeds": ({"speed": (-1, -2, -3, -4)}, PoleError, "speed poles"),
    "unstable yaw": ({"yaw": 2.5}, PoleError, "negative real parts"),
    "complex yaw": ({"yaw": -1 + 1j}, PoleError, "conjugate"),
    "an unknown chain": ({"transversal": -2}, UnknownNameError, "did you mean"),
    "two axes on a curve": ({"transverse_2": -2}, PoleError, "implicit path"),
}


@pytest.mark.parametrize("case", BAD_POLES)
def test_bad_poles_are_refused_at_the_door(case: str) -> None:
    poles, error, reason = BAD_POLES[case]
    with pytest.raises(error, match=reason) as caught:
        design(PAPER_VEHICLE, PATHS["circle"], poles)
    assert isinstance(caught.value, GammastarError)


# --- yaw output ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "beta",
    [lambda r: r**3, lambda r: r**2, ca.cos, lambda r: 0 * r + 1, lambda r: ca.log(r), lambda r: r - 4.7 * ca.atan(r)],
    ids=["cube", "square", "cosine", "constant", "logarithm", "not monotonic"],
)
def test_a_yaw_output_has_a_slope_that_never_vanishes(beta) -> None:
    """rank(d beta) = 1, Eq. (14)."""
    with pytest.raises(InputError, match="slope that never vanishes"):
        design(PAPER_VEHICLE, PATHS["circle"], yaw_output=beta)


@pytest.mark.parametrize("part", ["rejection", "estimator", "approach"])
@pytest.mark.parametrize("given", [Observer, KalmanFilter, "observer", 4])
def test_parts_of_another_kind_are_refused(part: str, given: object) -> None:
    """A class in place of what it makes, a filter in place of an observer: not in flight, but at once."""
    with pytest.raises(InputError, match=f"^{part} must be a .* \\(got .*\\); make one with "):
        design(PAPER_VEHICLE, PATHS[next(iter(CURVES))], **{part: given})


@pytest.mark.parametrize("beta", [lambda r: -2 * r, lambda r: ca.sinh(r / 10), lambda r: r + 0.5 * ca.sin(r), ca.atan])
def test_a_strictly_monotonic_yaw_output_is_accepted(beta) -> None:
    law = design(PAPER_VEHICLE, PATHS["circle"], yaw_output=beta)
    eta = law.transformed_state(start_on_the_circle())[1]
    assert eta[4] == pytest.approx(float(ca.DM(beta(ca.DM(0.3)))), rel=1e-14)


# --- where the law has no input --------------------------------------------------------------------------------------

SATELLITE = Vehicle(5.0, (8.05e-3, 5.158e-2, 5.124e-2), gravity=0.0)
SINGULAR = {
    "no thrust": (PAPER_VEHICLE, "circle", {"thrust": 0.0}, "thrust_N"),
    "negative thrust": (PAPER_VEHICLE, "circle", {"thrust": -1.0}, "thrust_N"),
    "no weight and no thrust": (SATELLITE, "line", {}, "thrust_N"),
    "on the axis": (PAPER_VEHICLE, "circle", {"position": (0, 0, 3)}, "focal_margin"),
    "on the axis of an implicit circle": (PAPER_VEHICLE, "implicit circle", {"position": (0, 0, 3)}, "focal_margin"),
    "on a tilted axis": (PAPER_VEHICLE, "tilted circle", {"position": (2, 0, 1)}, "focal_margin"),
    "on the quadratic axis": (PAPER_VEHICLE, "quadratic circle", {"position": (0, 0, 10)}, "focal_margin"),
}


@pytest.mark.parametrize("case", SINGULAR)
def test_a_singular_start_is_refused_with_its_margin(case: str) -> None:
    vehicle, path, parts, margin = SINGULAR[case]
    start = State(**{"position": (1.5, 0.2, 9.0), **parts})
    law = design(vehicle, PATHS[path])
    for ask in (law.start_vector, law.transformed_state, law.decoupling_matrix):
        with pytest.raises(SingularStartError) as caught:
            ask(start)
        assert list(caught.value.margins) == [margin]
        assert not caught.value.margins[margin] > 1e-6


def test_a_satellite_with_thrust_may_start() -> None:
    x, parameter = design(SATELLITE, PATHS["circle"]).start_vector(State((2, 0, 10), thrust=0.4))
    assert x[18] == 0.4
    assert parameter % (2 * np.pi) == pytest.approx(0, abs=1e-12)


@few
@given(feet("ellipse", least_margin=0.3))
def test_numbers_and_graph_give_the_same_decoupling_matrix(foot: Foot) -> None:
    """D of `Law` is (n + 2, 4): three transverse rows of rank two, the path coordinate, the yaw output."""
    law = law_of("ellipse")
    D = law.decoupling_matrix(State(foot.position, thrust=2.0))
    assert D.shape == (5, 4)
    tangent = CURVES["ellipse"].tangents(np.array([law.start_vector(State(foot.position))[1]]))[0]
    assert tangent @ D[:3] == pytest.approx(np.zeros(4), abs=1e-10 * np.abs(D).max())
    inverse = np.linalg.inv(law.vehicle.inertia)[2]
    assert D[4] == pytest.approx(np.append(0, inverse / 5), rel=1e-12)


def test_ragged_poles_are_refused_by_name() -> None:
    """Shown as they came, not as what NumPy says of them."""
    with pytest.raises(PoleError, match=r"transverse poles must be numbers \(got \[\[1, 2\], 3\]\)"):
        design(PAPER_VEHICLE, PATHS["circle"], poles=[[1, 2], 3])

"""Random inputs for every test, drawn where formulas break: identity, almost identity, almost pi, upside down, on the path, far.

The paths and vehicles that the suite flies stand here as well, and the one graph that many tests differentiate: the flow.
Strategies are made once (`functools.cache`): Hypothesis spends longer on making one than on drawing from it.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from gammastar import so3
from gammastar.path import Curve, ImplicitPath, Path
from gammastar.path import catalogue as paths
from gammastar.vehicle import State, Vehicle, join, split

UPRIGHT = ((0.9980, -0.0517, 0.0358), (0.0523, 0.9985, -0.0156), (-0.0349, 0.0174, 0.9992))  # paper, section VI-A
UPSIDE_DOWN = ((1.0, 0.0, 0.0), (0.0, -0.9998, -0.0175), (0.0, 0.0175, -0.9998))  # paper, section VI-B
PAPER_POSITION = (3.2, 5.0, 0.0)  # [m] paper, section VI
PAPER_VEHICLE = Vehicle(mass=0.1, inertia=(0.0177, 0.0177, 0.0344), gravity=9.8)  # paper, section VI


def uneven(angle: Any) -> Any:
    """Graph: a change of parameter that keeps the period 2 pi; its slope is between 0.7 and 1.3."""
    return angle + 0.3 * ca.sin(angle)


CURVES: dict[str, Curve] = {
    "circle": paths.circle(1.0, (0, 0, 10)),
    "tilted circle": paths.circle(2.0, (1, -2, 3), normal=(1, 2, -2)),
    "ellipse": paths.ellipse((3.0, 1.2), (0, 1, 2), normal=(0, 1, 1)),
    "loop": paths.loop(2.0, (0, 0, -5), heading=30),
    "line": paths.line((1, 2, 3), (1, -1, 0.5)),
    "helix": paths.helix(1.5, 2.0, (0, 0, 1), axis=(0, 1, 3)),
    "nonplanar circle": paths.nonplanar_circle(),
    "inflection": Curve(lambda s: (s, s**3 / 3, 0.5 * s), name="inflection", domain=(-1.5, 1.5)),
    "twisted": Curve(lambda s: (s, s**3 / 6, ca.sin(s)), name="twisted", domain=(-2.0, 2.0)),
    "uneven circle": Curve(
        lambda s: (ca.cos(uneven(s)), ca.sin(uneven(s)), 10), period=2 * np.pi, name="uneven circle"
    ),
}
IMPLICIT: dict[str, ImplicitPath] = {
    "implicit circle": paths.circle(1.0, (0, 0, 10), kind="implicit"),
    "implicit tilted circle": paths.circle(2.0, (1, -2, 3), normal=(1, 2, -2), kind="implicit"),
    "quadratic circle": paths.circle(1.0, (0, 0, 10), kind="implicit", coordinates="quadratic"),
    "parabola": ImplicitPath(
        lambda x, y, z: y - x**2,
        lambda x, y, z: z - 0.1 * x * y,
        lambda x, y, z: x + 0.2 * z,
        seed=(0.1, 0, 0),
        name="parabola",
        domain=(-1, 1),
    ),
}
PATHS: dict[str, Path] = {**CURVES, **IMPLICIT}


@functools.cache
def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Return finite numbers of an interval, its ends included."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False, allow_subnormal=False)


@functools.cache
def vectors(size: float = 1.0, length: int = 3) -> st.SearchStrategy[np.ndarray]:
    """Return vectors with entries up to a size, zero among them."""
    return st.lists(numbers(-size, size), min_size=length, max_size=length).map(np.array)


@functools.cache
def directions() -> st.SearchStrategy[np.ndarray]:
    """Return unit vectors, the axes among them."""
    oblique = vectors().filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
    return st.one_of(st.sampled_from([*np.eye(3), *-np.eye(3)]), oblique)


@functools.cache
def angles() -> st.SearchStrategy[float]:
    """Return angles from zero to below pi [rad]: zero, tiny, at the switch of `so3.exp`, ordinary, almost pi."""
    switch = so3.SMALL_ANGLE
    return st.one_of(
        st.sampled_from([0.0, 1e-12, 1e-8, switch * 0.999999, switch, switch * 1.000001, np.pi / 2]),
        numbers(0.0, 2 * switch),
        numbers(0.0, 3.1),
        numbers(1e-9, 1e-3).map(lambda gap: np.pi - gap),
    )


@functools.cache
def rotation_vectors() -> st.SearchStrategy[np.ndarray]:
    """Return rotation vectors (3,) [rad] shorter than pi."""
    return st.builds(lambda angle, axis: angle * axis, angles(), directions())


@functools.cache
def quaternions() -> st.SearchStrategy[np.ndarray]:
    """Return unit quaternions (w, x, y, z), both covers."""
    return vectors(length=4).filter(lambda q: np.linalg.norm(q) > 0.1).map(lambda q: q / np.linalg.norm(q))


@functools.cache
def rotations() -> st.SearchStrategy[np.ndarray]:
    """Return rotations: identity, almost identity, almost pi, exactly upside down, the paper's starts, and any other."""
    special = [np.eye(3), np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, -1.0, 1.0]), so3.roll(179.0), so3.pitch(90.0)]
    special += [so3.project(printed)[0] for printed in (UPRIGHT, UPSIDE_DOWN)]
    return st.one_of(st.sampled_from(special), rotation_vectors().map(so3.exp), quaternions().map(so3.from_quaternion))


def batches(elements: st.SearchStrategy[np.ndarray], most: int = 4) -> st.SearchStrategy[np.ndarray]:
    """Return stacks of one or more elements along a new first axis."""
    return st.lists(elements, min_size=1, max_size=most).map(np.stack)


@functools.cache
@st.composite
def inertias(draw: st.DrawFn) -> np.ndarray:
    """Return inertias (3, 3) [kg m^2] that a body can have: J = tr(S) I - S with second moments S of mass, turned anyhow."""
    moments = np.array([draw(numbers(1e-3, 1.0)) for _ in range(3)])
    turn = draw(rotations())
    return turn @ np.diag(moments.sum() - moments) @ turn.T


GRAVITIES = st.sampled_from([0.0, 1.62, 9.80665])


@functools.cache
@st.composite
def vehicles(draw: st.DrawFn) -> Vehicle:
    """Return vehicles with full symmetric inertia and constant loads."""
    return Vehicle(
        mass=draw(numbers(0.02, 20.0)),
        inertia=draw(inertias()),
        gravity=draw(GRAVITIES),
        bias_acceleration=draw(vectors(2.0)),
        bias_torque=draw(vectors(0.5)),
    )


VEHICLES = {
    "paper": PAPER_VEHICLE,
    "full inertia": Vehicle(1.3, ((0.03, 0.004, -0.002), (0.004, 0.035, 0.005), (-0.002, 0.005, 0.05))),
    "loaded": Vehicle(
        0.8, ((0.02, 0.002, 0.0), (0.002, 0.02, 0.001), (0.0, 0.001, 0.03)), 9.8, (0.3, -0.2, 0.4), (0.02, 0.01, -0.03)
    ),
}


@functools.cache
def stable_poles(count: int) -> st.SearchStrategy[list[complex]]:
    """Return `count` poles [1/s] in the left half plane, closed under conjugation: distinct, repeated and in pairs."""
    real = numbers(-20.0, -0.05)
    pair = st.builds(lambda re, im: [complex(re, im), complex(re, -im)], real, numbers(0.01, 20.0))
    one = real.map(lambda pole: [complex(pole)])

    def assemble(parts: list[list[complex]]) -> list[complex]:
        poles = [pole for part in parts for pole in part]
        return poles if len(poles) == count else []

    mixed = st.lists(st.one_of(pair, one), min_size=1, max_size=count).map(assemble).filter(len)
    return st.one_of(
        st.lists(one, min_size=count, max_size=count).map(assemble), real.map(lambda p: [p] * count), mixed
    )


DISTANCES = st.one_of(st.sampled_from([0.0, 1e-9]), numbers(0.0, 0.5), numbers(0.5, 30.0))


class Foot(NamedTuple):
    """A position and the parameter of its nearest point (of a critical point, when it is far from a bent curve)."""

    position: np.ndarray  # (3,) [m]
    parameter: float
    margin: float  # focal margin


@functools.cache
def jet_of(name: str) -> Any:
    """Return the function parameter -> point, first and second derivative of a curve of `CURVES`."""
    symbol = ca.SX.sym("parameter")
    return ca.Function("jet", [symbol], list(CURVES[name].jet(symbol, 2)))


@functools.cache
def parameters(name: str) -> st.SearchStrategy[float]:
    """Return parameters of a path of `PATHS`, within its domain; zero among them."""
    return st.one_of(st.just(0.0), numbers(*PATHS[name].domain))


@functools.cache
@st.composite
def feet(draw: st.DrawFn, name: str, least_margin: float = 0.05) -> Foot:
    """Return positions with their parameter on a path of `PATHS`: on it, almost on it, beside it and far from it."""
    distance = draw(DISTANCES)
    path = PATHS[name]
    parameter = draw(parameters(name))
    if isinstance(path, ImplicitPath):
        position = path.points(np.array([parameter]))[0] + min(distance, 3.0) * draw(directions())
        margin = margin_of(name)(position)
        assume(margin > least_margin)
        return Foot(position, path.start_parameter(position), float(margin))
    point, tangent, second = (np.array(value).ravel() for value in jet_of(name)(parameter))
    across = np.cross(tangent, draw(directions()))
    assume(np.linalg.norm(across) > 0.1 * np.linalg.norm(tangent))
    offset = distance * across / np.linalg.norm(across)
    margin = 1 - offset @ second / (tangent @ tangent)
    assume(margin > least_margin)
    return Foot(point + offset, parameter, float(margin))


@functools.cache
def margin_of(name: str) -> Any:
    """Return the function position -> focal margin of an implicit path.

    How independent its gradients are, times how much steeper pi is at the seed than here.
    """
    path, position = IMPLICIT[name], ca.SX.sym("position", 3)
    entries = ca.vertsplit(position)
    gradient = ca.jacobian(ca.vertcat(*(f(*entries) for f in (path.first, path.second, path.coordinate))), position)
    lengths = [ca.norm_2(gradient[row, :]) for row in range(3)]
    steepness = ca.Function("steepness", [position], [lengths[2]])
    independence = ca.fabs(ca.det(gradient)) / (lengths[0] * lengths[1] * lengths[2])
    return ca.Function("margin", [position], [independence * float(steepness(path.seed)) / lengths[2]])


@st.composite
def states(draw: st.DrawFn, position: np.ndarray | None = None, weight: float = 1.0) -> np.ndarray:
    """Return stacked states (20,) anywhere in the state space, thrust from a tenth to three times a weight [N]."""
    where = draw(vectors(20.0)) if position is None else position
    thrust, thrust_rate = weight * draw(numbers(0.1, 3.0)), weight * draw(numbers(-2.0, 2.0))
    velocity, turn, rates = draw(vectors(5.0)), draw(rotations()), draw(vectors(5.0))
    return State(where, velocity, turn, rates, thrust, thrust_rate).vector(weight)


def flow(vehicle: Vehicle) -> tuple[Any, Any, Any]:
    """Graph: return symbols of state SX (20,) and input SX (4,), and the rate SX (20,) of the state, Eq. (7)."""
    state, control = ca.SX.sym("state", 20), ca.SX.sym("input", 4)
    parts = split(state)
    rates = vehicle.rates(parts, control[0], control[1:])
    turning = ca.mtimes(parts.attitude, so3.hat(parts.angular_velocity))
    return state, control, join(parts._replace(**{**rates._asdict(), "attitude": turning}))


def state_of_motion(
    vehicle: Vehicle, derivatives: tuple[np.ndarray, ...], heading: float = 0.0, yaw_rate: float = 0.0
) -> State:
    """Return the state of a vehicle that moves with these position derivatives (value to jerk), by differential flatness.

    m (g e3 - K_t - a) = zeta1 b3 with b3 = R e3 fixes thrust and b3; its derivative fixes zeta2 and b3' = q b1 - p b2.
    """
    position, velocity, acceleration, jerk = derivatives
    force = np.array([0, 0, vehicle.gravity]) - np.asarray(vehicle.bias_acceleration) - acceleration
    size = np.linalg.norm(force)
    third = force / size
    first = np.cross([-np.sin(heading), np.cos(heading), 0.1], third)
    first /= np.linalg.norm(first)
    second = np.cross(third, first)
    turning = -(jerk - third * (third @ jerk)) / size
    return State(
        position,
        velocity,
        np.column_stack([first, second, third]),
        (-(second @ turning), first @ turning, yaw_rate),
        vehicle.mass * size,
        -vehicle.mass * (third @ jerk),
    )

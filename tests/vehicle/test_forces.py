"""Forces beside thrust and gravity: their values, their derivatives along the flow, and what leaves the class."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gammastar import Vehicle, errors, so3
from gammastar.vehicle import Buoyancy, CustomForce, LinearDrag, QuadraticDrag, RotorDrag, StateGraph
from gammastar.vehicle.flow import total
from gammastar.vehicle.state import symbols

FORCES = {
    "linear": [LinearDrag((0.1, 0.2, 0.3))],
    "rotor": [RotorDrag((0.02, 0.03, 0.01))],
    "quadratic": [QuadraticDrag((0.05, 0.06, 0.1))],
    "each axis": [QuadraticDrag((0.05, 0.06, 0.1), each_axis=True)],
    "buoyancy": [Buoyancy(1e-4)],
    "spring": [CustomForce(lambda state, wind: -0.3 * state.position)],
    "all": [LinearDrag(0.1), RotorDrag(0.02), QuadraticDrag((0.05, 0.06, 0.1)), Buoyancy(1e-4)],
}


def vehicle_with(name: str) -> Vehicle:
    return Vehicle(0.5, (3e-3, 4e-3, 6e-3), forces=FORCES[name], added_mass=0.1)


def numbers(seed: int) -> list[object]:
    """Return a state in motion: position, velocity, attitude, body rates, thrust, thrust rate."""
    generator = np.random.default_rng(seed)
    position, velocity, rates = generator.normal(size=(3, 3)) * [[1], [4], [2]]
    return [position, velocity, so3.random(generator), rates, generator.uniform(2, 8), generator.normal()]


def force_of(force: object, values: list[object], wind: object = (0, 0, 0)) -> np.ndarray:
    state, air = symbols(), ca.SX.sym("wind", 3)
    return ca.Function("force", [*state, air], [total([force], state, air)])(*values, wind).full().ravel()


@pytest.mark.parametrize("name", FORCES)
def test_jerk_and_snap_are_the_derivatives_of_acceleration_along_the_flow(name: str) -> None:
    """J = a', s = a'' along the motion itself, by central differences of fourth order."""
    vehicle, state, control = vehicle_with(name), symbols(), ca.SX.sym("input", 4)
    rates = vehicle.rates(state, control[0], control[1:])
    turning = ca.vec(ca.mtimes(state.attitude, so3.hat(state.angular_velocity)))
    flow = ca.Function("flow", [*state, control], [ca.vertcat(rates[0], rates[1], turning, *rates[2:])])
    snap = vehicle.snap(state, control[0], rates.angular_velocity)
    jets = ca.Function("jets", [*state, control], [vehicle.acceleration(state), vehicle.jerk(state), snap])

    def parts(x: np.ndarray) -> list[object]:
        return [x[:3], x[3:6], x[6:15].reshape(3, 3).T, x[15:18], x[18], x[19]]

    values, u, h = numbers(3), np.array([0.4, 2e-3, -1e-3, 5e-4]), 2e-3
    start = np.concatenate([np.ravel(np.transpose(value)) for value in values])

    def acceleration(time: float) -> np.ndarray:
        if time == 0:
            return jets(*parts(start), u)[0].full().ravel()
        motion = solve_ivp(lambda _, x: flow(*parts(x), u).full().ravel(), (0, time), start, rtol=1e-12, atol=1e-13)
        return jets(*parts(motion.y[:, -1]), u)[0].full().ravel()

    a = [acceleration(k * h) for k in (-2, -1, 0, 1, 2)]
    _, jerk, exact_snap = (value.full().ravel() for value in jets(*parts(start), u))
    size = np.linalg.norm(exact_snap)
    assert (a[0] - 8 * a[1] + 8 * a[3] - a[4]) / (12 * h) == pytest.approx(jerk, abs=1e-6 * size)
    second = (-a[0] + 16 * a[1] - 30 * a[2] + 16 * a[3] - a[4]) / (12 * h**2)
    assert second == pytest.approx(exact_snap, abs=1e-5 * size)


@pytest.mark.parametrize("name", FORCES)
@pytest.mark.parametrize("seed", range(3))
def test_input_for_inverts_snap(name: str, seed: int) -> None:
    """The input that gives a snap and an r' is the one that made them: B is invertible, relative degree {4, 4, 4, 1}."""
    vehicle, state, control = vehicle_with(name), symbols(), ca.SX.sym("input", 4)
    rates = vehicle.rates(state, control[0], control[1:])
    snap = vehicle.snap(state, control[0], rates.angular_velocity)
    back = vehicle.input_for(state, snap, rates.angular_velocity[2])
    u = np.random.default_rng(seed).normal(size=4)
    found = ca.Function("back", [*state, control], [back])(*numbers(seed), u).full().ravel()
    assert found == pytest.approx(u, abs=1e-9)


@pytest.mark.parametrize("name", ["linear", "rotor", "quadratic", "each axis"])
def test_drag_takes_energy_and_vanishes_in_moving_air(name: str) -> None:
    """<d, v> < 0 in calm air; at v = wind there is no drag."""
    for seed in range(5):
        values = numbers(seed)
        assert force_of(FORCES[name][0], values) @ values[1] < 0
        assert force_of(FORCES[name][0], values, values[1]) == pytest.approx(np.zeros(3), abs=1e-15)


def test_drag_of_isotropic_coefficients_does_not_know_the_attitude() -> None:
    values = numbers(1)
    assert force_of(LinearDrag(0.2), values) == pytest.approx(-0.2 * values[1], rel=1e-14)
    speed = np.linalg.norm(values[1])
    assert force_of(QuadraticDrag(0.2, smoothing=1e-6), values) == pytest.approx(-0.2 * speed * values[1], rel=1e-9)
    assert force_of(RotorDrag(0.2), values) == pytest.approx(-0.2 * np.sqrt(values[4]) * values[1], rel=1e-6)


def test_buoyancy_carries_weight_and_added_mass_slows_the_fall() -> None:
    """A sphere of the fluid's density hovers; released, a heavier one falls with g (m - rho V) / (m + rho V / 2)."""
    volume, density, g = 1e-3, 1000.0, 9.81
    neutral = Vehicle(1.0, (1, 1, 1), gravity=g, forces=[Buoyancy(volume, density, g)], added_mass=0.5)
    assert neutral.weight == pytest.approx(0, abs=1e-14)
    heavy = Vehicle(2.0, (1, 1, 1), gravity=g, forces=[Buoyancy(volume, density, g)], added_mass=0.5)
    state = symbols()
    at_rest = [np.zeros(3), np.zeros(3), np.eye(3), np.zeros(3), 0.0, 0.0]
    fall = ca.Function("fall", [*state], [heavy.acceleration(state)])(*at_rest).full().ravel()
    assert fall == pytest.approx([0, 0, g * (2 - 1) / 2.5], rel=1e-12)
    assert heavy.weight == pytest.approx(g, rel=1e-12)


def rates_too(state: StateGraph, wind: object) -> object:
    return -0.1 * state.velocity + ca.cross(state.angular_velocity, state.velocity)


def thrust_rate_too(state: StateGraph, wind: object) -> object:
    return -0.1 * state.thrust_rate * state.velocity


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: CustomForce(rates_too), "body rates.*relative degree"),
        (lambda: CustomForce(thrust_rate_too), "thrust rate.*relative degree"),
        (lambda: CustomForce(lambda state, wind: state.thrust), "three CasADi scalars"),
        (
            lambda: CustomForce(lambda state, wind: -ca.norm_2(state.velocity) * state.velocity),
            "differentiable at rest",
        ),
        (lambda: CustomForce(None), "must be a function of state and wind"),
        (
            lambda: CustomForce(lambda state, wind: ca.SX.sym("q", 3) - state.velocity),
            "must use its two arguments alone .got the symbol q_0",
        ),
        (lambda: LinearDrag(1e100), "check its unit"),
        (lambda: LinearDrag((0.1, -0.1, 0.1)), "must not be negative"),
        (lambda: LinearDrag((0.1, float("nan"), 0.1)), "must be finite"),
        (lambda: QuadraticDrag(0.1, smoothing=0.0), "greater than 0"),
        (lambda: QuadraticDrag(0.1, each_axis="yes"), "each_axis"),
        (lambda: Buoyancy(-1.0), "greater than 0"),
        (lambda: Vehicle(1, (1, 1, 1), added_mass=(6.0, 7.0, 18.0)), "the same in all directions.*body rates"),
        (lambda: Vehicle(1, (1, 1, 1), added_mass=-1.0), "at least 0"),
        (lambda: Vehicle(1, (1, 1, 1), forces=LinearDrag(0.1)), "must be a list"),
        (lambda: Vehicle(1, (1, 1, 1), forces=[0.1]), "must be a Force"),
        (
            lambda: Vehicle(
                1, (1, 1, 1), forces=[CustomForce(lambda state, wind: state.thrust * state.attitude[:, 2])]
            ),
            "cancels the thrust",
        ),
    ],
)
def test_what_leaves_the_class_is_refused_with_the_reason(make: object, words: str) -> None:
    with pytest.raises(errors.GammastarError, match=words):
        make()


def test_vehicles_with_other_forces_have_other_signatures() -> None:
    signatures = [vehicle_with(name).signature for name in FORCES]
    signatures += [Vehicle(0.5, (3e-3, 4e-3, 6e-3)).signature]
    assert len(set(signatures)) == len(signatures)
    assert vehicle_with("spring").signature == vehicle_with("spring").signature

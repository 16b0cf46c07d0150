"""Break the physics, on either side, and the claims about it must fail: no check is a tautology."""

import dataclasses
import importlib
import pkgutil
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from gammastar import claims
from gammastar.claims import all_claims, check, symbols, witness

MODULES = [importlib.import_module(f"gammastar.claims.{info.name}") for info in pkgutil.iter_modules(claims.__path__)]
CLAIMS = {each.key: each for each in all_claims()}
SYSTEM = symbols.extended_system()


def forget() -> None:
    """Empty every cache of the room."""
    for module in MODULES:
        for value in vars(module).values():
            if hasattr(value, "cache_clear"):
                value.cache_clear()


@pytest.fixture(autouse=True)
def fresh_caches() -> Iterator[None]:
    forget()
    yield
    forget()


def failed(keys: set[str]) -> set[str]:
    return {result.key for result in check(CLAIMS[key] for key in sorted(keys)) if not result.passed}


def drift_with(**parts: Any) -> Any:
    """Return the drift with some rows replaced."""
    rows = {"velocity": 3, "attitude": 6, "angular_velocity": 15, "thrust": 18}
    drift = SYSTEM.drift.copy()
    for name, value in parts.items():
        for i, entry in enumerate(value):
            drift[rows[name] + i] = entry
    return drift


def reversed_thrust() -> dict[str, Any]:
    sp = symbols.load_sympy()
    return {
        "drift": drift_with(
            velocity=SYSTEM.drift[3:6, 0] + 2 * SYSTEM.thrust / SYSTEM.mass * SYSTEM.attitude * sp.Matrix([0, 0, 1])
        )
    }


def real_drag() -> dict[str, Any]:
    return {"drift": drift_with(velocity=SYSTEM.drift[3:6, 0] - SYSTEM.velocity)}


def turning_the_other_way() -> dict[str, Any]:
    return {"drift": drift_with(attitude=(SYSTEM.attitude * symbols.hat(SYSTEM.angular_velocity).T).vec())}


def world_rates() -> dict[str, Any]:
    return {"drift": drift_with(attitude=(symbols.hat(SYSTEM.angular_velocity) * SYSTEM.attitude).vec())}


def reversed_gyroscope() -> dict[str, Any]:
    sp = symbols.load_sympy()
    J, omega = sp.diag(*SYSTEM.inertia), SYSTEM.angular_velocity
    return {"drift": drift_with(angular_velocity=SYSTEM.drift[15:18, 0] + 2 * J.inv() * omega.cross(J * omega))}


def damped_rotation() -> dict[str, Any]:
    return {"drift": drift_with(angular_velocity=SYSTEM.drift[15:18, 0] - SYSTEM.angular_velocity)}


def one_integrator() -> dict[str, Any]:
    inputs = SYSTEM.inputs.copy()
    inputs[18, 0], inputs[19, 0] = 1, 0
    return {"inputs": inputs}


def swapped_torques() -> dict[str, Any]:
    inputs = SYSTEM.inputs.copy()
    inputs[15, 1], inputs[16, 2] = SYSTEM.inputs[16, 2], SYSTEM.inputs[15, 1]
    return {"inputs": inputs}


def stronger_yaw_torque() -> dict[str, Any]:
    inputs = SYSTEM.inputs.copy()
    inputs[17, 3] *= 2
    return {"inputs": inputs}


MUTATIONS: dict[Callable[[], dict[str, Any]], set[str]] = {
    reversed_thrust: {"(1)", "(7)", "(9)", "(11)", "(17)", "(19)", "(22)", "(23)"},
    real_drag: {"(1)", "(7)", "(9)", "(11)", "(19)", "(22)", "(23)", "internal dynamics"},
    turning_the_other_way: {"(3)", "(6)", "(7)", "(9)", "(17)", "(19)", "(22)", "(23)", "(27)", "(29)"},
    world_rates: {"(3)", "(6)", "(7)", "(9)", "(17)", "(19)", "(22)", "(27)", "internal dynamics"},
    reversed_gyroscope: {"(3)", "(4)", "(7)", "(9)", "(22)", "(23)", "(28)"},
    damped_rotation: {"(3)", "(4)", "(7)", "(9)", "(22)", "(23)", "(28)"},
    one_integrator: {"(4)", "(7)", "(9)", "(16)", "(17)", "(20)"},
    stronger_yaw_torque: {"(3)", "(7)", "(9)", "(14)", "(17)", "(18)"},
    swapped_torques: {"(3)", "(7)", "(9)", "(17)", "(22)", "(23)", "(28)"},
}


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_a_broken_derivation_is_noticed(
    mutation: Callable[[], dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = dataclasses.replace(SYSTEM, **mutation())
    for module in MODULES:
        monkeypatch.setattr(module, "extended_system", lambda: broken, raising=False)
    assert failed(MUTATIONS[mutation]) == MUTATIONS[mutation]


def twice(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with its result doubled."""
    return lambda *arguments: 2 * function(*arguments)


def transposed(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with its result transposed."""
    return lambda *arguments: function(*arguments).T


def dependent(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the outputs of a path with the second made from the first."""
    return lambda system: (function(system)[0], function(system)[0] ** 2, function(system)[2])


def one_for_two(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return mu with r11 squared in the place of r32."""
    return lambda: symbols.load_sympy().Matrix([*function()[:5, 0], function()[0] ** 2, function()[6]])


def beside_the_path(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the outputs of a path with the first one nonzero on it."""
    return lambda system: (function(system)[0] + system.position[0], *function(system)[1:])


def each_twice(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a tuple with its entries doubled."""
    return lambda *arguments: tuple(2 * entry for entry in function(*arguments))


def by_rows(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the stack of a matrix's rows."""
    return lambda matrix: function(matrix.T)


def shifted(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a list with its first two entries exchanged."""
    return lambda: [function()[1], function()[0], *function()[2:]]


@pytest.mark.parametrize(
    ("room", "name", "wrong", "keys"),
    [
        ("attitude", "cayley", transposed, {"(2)"}),
        ("attitude", "hat", transposed, {"(2)", "(6)"}),
        ("attitude", "stack", by_rows, {"stacking", "Proposition 1", "(5)", "(6)"}),
        ("coordinates", "circle_outputs", dependent, {"Assumption 1"}),
        ("coordinates", "circle_outputs", beside_the_path, {"Assumption 1", "Lemma 3"}),
        ("coordinates", "on_circle", twice, {"Assumption 1"}),
        ("outputs", "circle_outputs", dependent, {"(15)"}),
        ("outputs", "nearest_parameter", each_twice, {"(12)", "(13)"}),
        ("transformation", "internal_state", one_for_two, {"(20)", "Corollary 6"}),
        ("transformation", "hat", twice, set()),  # another basis of the same tangent space: rightly not noticed
        ("control", "gains", shifted, {"(23)", "(25)"}),
        ("internal", "cayley", twice, {"internal dynamics", "(29)"}),
    ],
)
def test_a_broken_tool_is_noticed(
    room: str, name: str, wrong: Callable[..., Any], keys: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    module = importlib.import_module(f"gammastar.claims.{room}")
    monkeypatch.setattr(module, name, wrong(getattr(module, name)))
    assert failed(keys or {"Corollary 7"}) == keys


@pytest.mark.parametrize(
    ("function", "keys"),
    [
        ("rates", {"(7)"}),
        ("decoupling", {"(17)"}),
        ("transformed", {"(19)"}),
        ("feedback", {"(23)"}),
        ("nearest_parameter", {"(12)"}),
    ],
)
def test_a_package_that_disagrees_is_noticed(function: str, keys: set[str], monkeypatch: pytest.MonkeyPatch) -> None:
    honest = getattr(witness, function)

    def off_in_the_last_entry(*arguments: Any) -> np.ndarray:
        values = np.array(honest(*arguments))
        values.flat[-1] += 1e-6 * max(1.0, np.abs(values).max())
        return values

    monkeypatch.setattr(witness, function, off_in_the_last_entry)
    assert failed(keys) == keys


def test_flights_of_a_wrong_vehicle_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A law that believes in a slightly heavier vehicle than flies leaves the closed form, the path and its speed."""
    from gammastar.claims import objectives
    from gammastar.vehicle import Vehicle

    honest = objectives.fly

    def wrong_truth(law: Any, *arguments: Any, **options: Any) -> Any:
        believed = law.vehicle
        heavier = Vehicle(believed.mass * 1.001, believed.inertia, believed.gravity)
        return honest(law, *arguments, **options, truth=heavier)

    monkeypatch.setattr(objectives, "fly", wrong_truth)
    assert failed({"G1", "G2", "G3", "G4"}) == {"G1", "G2", "G3", "G4"}

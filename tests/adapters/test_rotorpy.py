"""RotorPy as a plant: axes, commands within limits, and flights in the original where it is installed."""

from __future__ import annotations

import dataclasses
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import gammastar as gs
from gammastar.adapters import rotorpy
from gammastar.errors import GammastarError, InputError, MissingExtraError, UnknownNameError
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance

EXAMPLE = Path(__file__).parents[2] / "examples" / "in_rotorpy.py"
KEYS = {"motor_speeds", "motor_thrusts", "thrust", "moment", "q", "w", "v", "acc"}
ARM = 0.17 * np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]]) / np.sqrt(2)
HUMMINGBIRD = {  # as in rotorpy.vehicles.hummingbird_params 3.0.0, without aerodynamics
    "mass": 0.5,
    **{"Ixx": 3.65e-3, "Iyy": 3.68e-3, "Izz": 7.03e-3, "Ixy": 0.0, "Iyz": 0.0, "Ixz": 0.0},
    **{"num_rotors": 4, "rotor_pos": dict(zip(("r1", "r2", "r3", "r4"), ARM, strict=True))},
    **{"rotor_directions": np.array([1, -1, 1, -1]), "k_eta": 5.57e-6, "k_m": 1.36e-7},
    **{"rotor_speed_min": 0, "rotor_speed_max": 1500, "tau_m": 0.005},
}
CIRCLE = gs.paths.circle(1.0)


def law_for(parameters: dict[str, Any], **changes: Any) -> gs.Law:
    vehicle = dataclasses.replace(rotorpy.vehicle_of(parameters), **changes)
    return gs.design(vehicle, CIRCLE, poles=-6, approach=gs.Approach(), rejection=gs.Observer())


@pytest.fixture(scope="module")
def law() -> gs.Law:
    return law_for(HUMMINGBIRD)


def told(start: gs.State, **more: Any) -> dict[str, Any]:
    """Return what RotorPy tells of a start."""
    return {**rotorpy.initial_state(HUMMINGBIRD, start), **more}


def test_a_vehicle_of_rotorpy_is_the_preset_with_its_source() -> None:
    """Rotors, mass and inertia were written down twice, from RotorPy's file and here through its axes."""
    ours, theirs = gs.vehicles.load("hummingbird"), rotorpy.vehicle_of(HUMMINGBIRD)
    assert (theirs.mass, theirs.gravity) == (ours.mass, ours.gravity)
    np.testing.assert_array_equal(theirs.inertia, ours.inertia)
    np.testing.assert_allclose(theirs.rotors.mixer, ours.rotors.mixer, rtol=1e-12, atol=1e-15)
    assert theirs.rotors.lag == ours.rotors.lag
    assert theirs.forces == ()


def test_products_of_inertia_change_sign_with_the_axes() -> None:
    """J of the other axes is S J S with S = diag(1, -1, -1): xy and xz change sign, yz stays."""
    vehicle = rotorpy.vehicle_of({**HUMMINGBIRD, "Ixy": 1e-4, "Ixz": 2e-4, "Iyz": 3e-4})
    inertia = np.asarray(vehicle.inertia)
    assert (inertia[0, 1], inertia[0, 2], inertia[1, 2]) == (-1e-4, -2e-4, 3e-4)


def test_a_start_survives_both_axes() -> None:
    generator = np.random.default_rng(0)
    start = gs.State(*generator.standard_normal((2, 3)), gs.so3.random(generator), generator.standard_normal(3))
    there = rotorpy.initial_state(HUMMINGBIRD, start)
    back = rotorpy.flown({"time": [0.0], "state": {key: value[None] for key, value in there.items()}})
    for name in ("position", "velocity", "attitude", "angular_velocity"):
        np.testing.assert_allclose(getattr(back, name)[0], getattr(start, name), atol=1e-15)
    up = Rotation.from_quat(there["q"]).as_matrix()[:, 2]  # RotorPy thrusts along it; ours against the third column
    np.testing.assert_allclose(up * [1, -1, -1], -np.asarray(start.attitude)[:, 2], atol=1e-15)


def test_commands_are_those_of_the_autopilot_in_the_other_axes(law: gs.Law) -> None:
    """The same measurement, built without the adapter, gives the same rotor speeds, call after call; time counts from the first."""
    generator, rate, ramp = np.random.default_rng(1), 500.0, gs.Ramp(1.0)
    controller, first = rotorpy.Controller(law, reference=ramp, rate=rate), gs.State((1.5, 0.2, -0.5))
    vector, parameter = law.start_vector(first)
    guidance = Guidance(law, ramp.resolved(CIRCLE, parameter), 0.0)
    autopilot = Autopilot(guidance, 1 / rate)
    memory, step = autopilot.start(vector, parameter), autopilot.function()
    state = first
    for k in range(3):
        parts = [state.position, state.velocity, gs.so3.stack(state.attitude), state.angular_velocity, np.ones(4)]
        data = guidance.reference.pieces.data(np.array([k / rate]))[:, 0]
        memory, wanted, _ = step(memory, np.concatenate(parts), k / rate, data)
        answer = controller.update(5 + k / rate, told(state), None)
        np.testing.assert_allclose(answer["cmd_motor_speeds"], wanted.full()[:, 0], atol=1e-6)  # rounding of 1000 rad/s
        state = gs.State(
            np.asarray(first.position) + 1e-3 * generator.standard_normal(3),
            attitude=gs.so3.exp(0.1 * generator.standard_normal(3)),
            angular_velocity=0.1 * generator.standard_normal(3),
        )


vectors = st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3).map(np.array)


@settings(max_examples=60)
@given(position=vectors, velocity=vectors, rates=vectors, turn=vectors, later=vectors)
def test_no_command_is_impossible(
    law: gs.Law, position: np.ndarray, velocity: np.ndarray, rates: np.ndarray, turn: np.ndarray, later: np.ndarray
) -> None:
    """Whatever is told, rotor speeds stay within the limits, and the other forms are the same command, about axes up."""
    controller = rotorpy.Controller(law, speed=1.0)
    state = told(gs.State((1.5, 0.0, 0.0)))
    controller.update(0.0, state)
    state |= {"x": position, "v": velocity, "w": rates, "q": Rotation.from_rotvec(turn).as_quat()}
    for k, moved in enumerate((np.zeros(3), later)):
        answer = controller.update((k + 1) / 500, {**state, "x": position + moved})
        assert set(answer) == {f"cmd_{key}" for key in KEYS}
        assert all(np.all(np.isfinite(value)) for value in answer.values())
        speeds = answer["cmd_motor_speeds"]
        assert np.all((speeds >= 0) & (speeds <= HUMMINGBIRD["rotor_speed_max"]))
        thrusts = HUMMINGBIRD["k_eta"] * speeds**2
        np.testing.assert_allclose(answer["cmd_motor_thrusts"], thrusts, rtol=1e-12)
        yaw = HUMMINGBIRD["k_m"] * np.sum(HUMMINGBIRD["rotor_directions"] * speeds**2)
        tilting = np.cross(ARM, np.outer(thrusts, [0, 0, 1])).sum(axis=0)
        np.testing.assert_allclose(answer["cmd_moment"], [*tilting[:2], yaw], atol=1e-12)
        assert answer["cmd_thrust"] == pytest.approx(thrusts.sum())


def test_time_that_goes_back_starts_anew(law: gs.Law) -> None:
    controller, state = rotorpy.Controller(law, speed=1.0), told(gs.State((1.5, 0.0, 0.0)))
    first = [controller.update(k / 500, {**state, "v": np.array([0.0, 0.0, -k / 10])}) for k in range(3)]
    again = [controller.update(k / 500, {**state, "v": np.array([0.0, 0.0, -k / 10])}) for k in range(3)]
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a["cmd_motor_speeds"], b["cmd_motor_speeds"])
    assert np.any(first[1]["cmd_motor_speeds"] != first[2]["cmd_motor_speeds"])


def test_a_flight_may_begin_with_rotors_at_rest(law: gs.Law) -> None:
    controller = rotorpy.Controller(law, speed=1.0)
    answer = controller.update(0.0, told(gs.State((1.5, 0.0, 0.0)), rotor_speeds=np.zeros(4)))
    assert np.all(np.isfinite(answer["cmd_motor_speeds"]))
    assert np.any(answer["cmd_motor_speeds"] > 0)


def test_bad_use_is_refused_in_one_sentence(law: gs.Law) -> None:
    state = told(gs.State((1.5, 0.0, 0.0)))
    with pytest.raises(InputError, match="must command rotors"):
        rotorpy.Controller(law_for(HUMMINGBIRD, rotors=None), speed=1.0)
    with pytest.raises(InputError, match="exactly one of speed and reference"):
        rotorpy.Controller(law)
    with pytest.raises(InputError, match="reference must be one"):
        rotorpy.Controller(law, reference=1.0)  # type: ignore[arg-type]
    for broken in ({"x": np.full(3, np.nan)}, {"q": np.ones(3)}, {"w": "fast"}):
        with pytest.raises(InputError, match="finite numbers"):
            rotorpy.Controller(law, speed=1.0).update(0.0, state | broken)
    controller = rotorpy.Controller(law, speed=1.0)
    controller.update(0.0, state)
    with pytest.raises(InputError, match="same sim_rate"):
        controller.update(0.01, state)
    with pytest.raises(UnknownNameError, match="cmd_ctbr"):
        rotorpy.environment(controller, HUMMINGBIRD, gs.State((1.5, 0.0, 0.0)), abstraction="cmd_ctbr")


BROKEN: dict[str, tuple[object, object]] = {
    "time that is none": (np.nan, {}),
    "text for time": ("now", {}),
    "no state": (0.0, None),
    "no attitude": (0.0, {"q": np.zeros(4)}),
    "no speeds": (0.0, {"rotor_speeds": None}),
    "text for speeds": (0.0, {"rotor_speeds": "fast"}),
    "three speeds": (0.0, {"rotor_speeds": [1, 2, 3]}),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_no_simulation_tells_is_refused(case: str, law: gs.Law) -> None:
    """Above all a time that is NaN, which compares with nothing: commands would be NaN cut to the limits."""
    time, change = BROKEN[case]
    controller, state = rotorpy.Controller(law, speed=1.0), told(gs.State((1.5, 0.0, 0.0)))
    with pytest.raises(GammastarError, match=r" must .*\(got .*; "):
        controller.update(time, change if change is None else state | change)  # type: ignore[arg-type, operator]


def test_parameters_and_starts_that_rotorpy_could_not_use_are_refused() -> None:
    short = {key: value for key, value in HUMMINGBIRD.items() if key != "Ixx"}
    for make in (
        lambda: rotorpy.vehicle_of(short),
        lambda: rotorpy.vehicle_of(None),  # type: ignore[arg-type]
        lambda: rotorpy.initial_state({}, gs.State((1.5, 0.0, 0.0))),
        lambda: rotorpy.initial_state(HUMMINGBIRD, None),  # type: ignore[arg-type]
        lambda: rotorpy.initial_state(HUMMINGBIRD, gs.State((1.5, 0.0, 0.0), thrust=-1.0)),
    ):
        with pytest.raises(InputError, match=r" must .*\(got .*; "):
            make()


def test_its_absence_names_the_extra(law: gs.Law, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("rotorpy", "rotorpy.vehicles", "rotorpy.environments"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError, match=r"gammastar\[rotorpy\]"):
        rotorpy.parameters("hummingbird")
    with pytest.raises(MissingExtraError, match=r"gammastar\[rotorpy\]"):
        rotorpy.environment(rotorpy.Controller(law, speed=1.0), HUMMINGBIRD, gs.State((1.5, 0.0, 0.0)))


def test_parameters_here_are_those_of_rotorpy() -> None:
    pytest.importorskip("rotorpy")
    theirs = rotorpy.parameters("hummingbird")
    assert {key: theirs[key] for key in HUMMINGBIRD if np.ndim(theirs[key]) == 0 and key != "rotor_pos"} == {
        key: value for key, value in HUMMINGBIRD.items() if np.ndim(value) == 0 and key != "rotor_pos"
    }
    np.testing.assert_allclose(list(theirs["rotor_pos"].values()), ARM, atol=1e-9)
    assert rotorpy.vehicle_of(rotorpy.parameters("crazyflie")).rotors.lag == (0.072, 0.072)
    with pytest.raises(UnknownNameError, match="hummingbird"):
        rotorpy.parameters("humingbird")


@pytest.mark.parametrize("abstraction", rotorpy.ABSTRACTIONS)
def test_rotorpy_takes_the_three_forms_as_one(law: gs.Law, abstraction: str) -> None:
    multirotor = pytest.importorskip("rotorpy.vehicles.multirotor")
    state = told(gs.State((1.2, 0.1, 0.0), attitude=gs.so3.roll(100), angular_velocity=(3.0, -2.0, 1.0)))
    answer = rotorpy.Controller(law, speed=1.0).update(0.0, state)
    vehicle = multirotor.Multirotor(rotorpy.parameters("hummingbird"), state, abstraction)
    taken = np.clip(vehicle.get_cmd_motor_speeds(state, answer), 0, HUMMINGBIRD["rotor_speed_max"])
    np.testing.assert_allclose(taken, answer["cmd_motor_speeds"], rtol=1e-6, atol=1e-3)


def test_started_on_the_circle_it_stays_there_in_rotorpy() -> None:
    """One second in RotorPy without aerodynamics, from the exact motion of circling without yaw rate.

    Thrust is m (g e3 - a) along the axis b3, with a = -rate^2 r; b3 turns with the circle, so Omega = b3 x b3'.  What is left comes
    from the torques, which are not there at the start.
    """
    pytest.importorskip("rotorpy")
    parameters, rate = rotorpy.parameters("hummingbird"), 0.4 * np.pi
    law = gs.design(rotorpy.vehicle_of(parameters), CIRCLE, poles=-6)
    pull = law.vehicle.mass * np.array([rate**2, 0.0, rotorpy.GRAVITY])
    axis = pull / np.linalg.norm(pull)
    lean = gs.so3.pitch(np.degrees(np.arctan2(axis[0], axis[2])))
    np.testing.assert_allclose(lean[:, 2], axis, atol=1e-15)
    turning = lean.T @ np.cross(axis, np.cross([0.0, 0.0, rate], axis))
    start = gs.State((1.0, 0.0, 0.0), (0.0, rate, 0.0), lean, turning, float(np.linalg.norm(pull)))
    world = rotorpy.environment(rotorpy.Controller(law, speed=rate), parameters, start, aerodynamics=False)
    flight = rotorpy.flown(world.run(1.0, terminate=False))
    assert flight.time[-1] == pytest.approx(1.0)
    assert CIRCLE.global_distances(flight.position).max() < 1e-5
    turned = np.arctan2(flight.position[-1, 1], flight.position[-1, 0])
    assert turned == pytest.approx(rate, rel=1e-5)


def test_the_example_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("rotorpy")
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE), "--duration", "0.2"])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    printed = capsys.readouterr().out
    assert "gammastar" in printed
    assert "SE3Control" in printed

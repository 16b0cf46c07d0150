"""Quantities that vary in one program: each flight is that of the mission with its own value written in, flown by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gammastar as gs
from gammastar.campaign.flown import rows
from gammastar.campaign.run import resolved
from gammastar.campaign.setting import Setting
from gammastar.errors import GammastarError, InputError
from gammastar.mission import Mission, load

QUICK = {"flight.duration": 0.2, "flight.step": 0.01, "controller.rate": 100.0}
TOLD = {
    "final_distance_m": ("distance_m", "final"),
    "max_thrust_N": ("thrust_N", "max"),
    "min_free_fall_margin_m_s2": ("margin_min", "free_fall_m_s2"),
}
ONE_PROGRAM: list[dict[str, Any]] = [
    {"quantity": "truth.noise_scale", "kind": "uniform", "low": 0.5, "high": 2.0},
    {"quantity": "truth.lag_scale", "kind": "log-uniform", "low": 0.5, "high": 2.0},
    {"quantity": "controller.poles.transverse", "kind": "uniform", "low": -6.0, "high": -4.0},
    {"quantity": "controller.poles.yaw", "kind": "list", "choices": [-4.0, -5.0]},
    {"quantity": "approach.speed", "kind": "normal", "mean": 1.0, "deviation": 0.1},
    {"quantity": "observer.force", "kind": "uniform", "low": 10.0, "high": 20.0},
    {"quantity": "observer.torque", "kind": "grid", "low": 20.0, "high": 45.0, "count": 3, "spacing": "log"},
    {"quantity": "reference.speed", "kind": "uniform", "low": -1.0, "high": 1.0},
]


def varied(mission: Mission, *vary: dict[str, Any], **changes: Any) -> Mission:
    return mission.with_values(changes | {"campaign": {"vary": list(vary)}})


@pytest.fixture(scope="module")
def crazyflie() -> Mission:
    """With rotors that lag, observers, an approach and noisy sensors."""
    return load("crazyflie").with_values(QUICK)


@pytest.fixture(scope="module")
def circle() -> Mission:
    """The law by itself, along a curve."""
    changes = {
        "path": {"name": "circle"},
        "start": {"position": [1.1, 0.2, 0.3]},
        "controller": {"poles": -3.0, "feedback": "start", "rate": 100.0},
    }
    return load("upright").with_values(changes | {"flight.duration": 0.2, "flight.step": 0.01})


def listed(setting: Setting, numbers: Any) -> list[dict[str, Any]]:
    return list(rows(setting, numbers, "casadi").to_pylist())


def same(row: dict[str, Any], mission: Mission) -> None:
    """A row tells what a mission tells that is flown by itself."""
    told = mission.fly().summary()
    for name, (group, key) in TOLD.items():
        assert row[name] == pytest.approx(told[group][key], rel=1e-9), name
    assert row["peak_rate_rad_s"] == pytest.approx(told["peak_rate_rad_s"], rel=1e-9)


def flown_alone(setting: Setting, numbers: Any) -> list[dict[str, Any]]:
    """Return rows of flights, each of which is that of the mission with the drawn values, and is written as that mission."""
    drawn, own = setting.sample(np.array(numbers)), setting.mission.given()
    del own["campaign"]
    table = listed(setting, numbers)
    for k, row in enumerate(table):
        values = {name: each[k].item() for name, each in drawn.items()}
        assert {name: row[name] for name in values} == values
        if row["status"] == "completed":
            mission = Mission.from_values(own).with_values(
                values | {"flight.seed": setting.seed, "flight.number": numbers[k]}
            )
            same(row, mission)
            (case,) = setting.cases(np.array([numbers[k]]), setting.sample(np.array([numbers[k]])))
            written, wanted = case.alone().values(), mission.values()
            assert written | {"start": None} == wanted | {"start": None}
    assert repr(listed(setting, numbers[-1:])) == repr(table[-1:])
    return table


def test_many_quantities_vary_in_one_program(crazyflie: Mission) -> None:
    setting = Setting(varied(crazyflie, *ONE_PROGRAM), seed=4)
    first, second = flown_alone(setting, [1, 5])
    assert first["observer.torque"] == pytest.approx(30.0)  # in the middle of equal ratios
    assert second["observer.torque"] == 45.0
    built = gs.engine.compilations()
    listed(setting, [2, 3])
    assert resolved(setting, "casadi") == "casadi"
    assert gs.engine.compilations() == built


def test_latencies_take_a_program_for_each_number_of_intervals(circle: Mission) -> None:
    """0 to 25 ms at 100 Hz are one, two or three intervals; what cannot be is told in its row, and none at all is no autopilot."""
    spread = {"quantity": "truth.latency", "kind": "uniform", "low": 0.0, "high": 0.025}
    setting = Setting(varied(circle, spread), seed=1)
    numbers = np.arange(12)
    cases = list(setting.cases(numbers, setting.sample(numbers)))
    assert [sorted(np.ceil(case.values["truth.latency"] / 0.01)) for case in cases] == [
        [k] * len(case.numbers) for k, case in enumerate(cases, 1)
    ]
    flown_alone(setting, [int(case.numbers[0]) for case in cases[1:]])
    few = {"quantity": "truth.latency", "kind": "grid", "choices": [-0.01, 0.0, 1e-9, 5.0]}
    refused, *others, long = flown_alone(Setting(varied(circle, few), seed=1), range(4))
    assert "latency [s] must be at least 0 (got -0.01)" in refused["cause"]
    assert "at most 100 control intervals (got 5 s" in long["cause"]
    assert [row["status"] for row in others] == ["completed"] * 2


def test_poles_that_cannot_be_are_rows(circle: Mission) -> None:
    """The others are what they are without them."""
    poles = {"quantity": "controller.poles", "kind": "grid", "low": -4.0, "high": 2.0, "count": 4}
    table = flown_alone(Setting(varied(circle, poles), seed=0), range(4))
    assert [row["status"] for row in table] == ["completed", "completed", "refused", "refused"]
    assert table[2]["cause"].startswith("[controller] poles must have negative real parts (got 0, 0, 0, 0)")
    assert [row["controller.poles"] for row in table] == [-4.0, -2.0, 0.0, 2.0]


@pytest.mark.parametrize(
    "choices",
    [
        [[-2.0, -3.0, -4.0, -5.0], [-4.0, -4.0, -4.0, -4.0]],
        [-3.0, [[-3.0, 1.0], [-3.0, -1.0], -4.0, -4.0], {"yaw": -1.0}],
    ],
    ids=["of one length", "of all forms"],
)
def test_lists_of_poles_are_tunings_of_one_law(circle: Mission, choices: list[Any]) -> None:
    """Numbers, lists, complex pairs and tables of chains alike; the row tells the place in the list."""
    setting, count = (
        Setting(varied(circle, {"quantity": "controller.poles", "kind": "grid", "choices": choices}), seed=0),
        len(choices),
    )
    (case,) = setting.cases(np.arange(2 * count), setting.sample(np.arange(2 * count)))
    laws = case.laws
    assert laws is not None
    assert all(laws[k] is laws[k + count] for k in range(count))
    for row, choice in zip(listed(setting, range(count)), choices, strict=True):
        alone = circle.with_values({"controller.poles": choice, "flight.number": row["flight"]})
        same(row, alone)
        assert row["controller.poles"] == row["flight"]
        (case,) = setting.cases(np.array([row["flight"]]), setting.sample(np.array([row["flight"]])))
        assert case.alone().values() | {"start": None} == alone.values() | {"start": None}


def test_a_chain_that_varies_leaves_the_others_as_they_are_given(circle: Mission) -> None:
    """The chain of a speed follows the one of a place, where it is not given itself."""
    vary = {"quantity": "controller.poles.tangential", "kind": "uniform", "low": -4.0, "high": -2.0}
    setting = Setting(varied(circle, vary), seed=0)
    (case,) = setting.cases(np.arange(1), setting.sample(np.arange(1)))
    (law,) = case.laws or ()
    assert not isinstance(law, InputError)
    value = case.values["controller.poles.tangential"][0]
    assert law.poles["transverse"] == (-3.0,) * 4
    assert law.poles["tangential"] == (value,) * 4
    assert law.poles["speed"] == (value,) * 3


def test_flights_of_zero_are_of_another_program(circle: Mission) -> None:
    """A speed of zero holds no end of a path that ends, and an observer of bandwidth zero is none."""
    line = circle.with_values({"path": {"name": "line", "ends": [-5.0, 5.0]}})
    speeds = {"quantity": "reference.speed", "kind": "grid", "choices": [0.5, 0.0, -0.5]}
    flown_alone(Setting(varied(line, speeds), seed=0), range(3))
    forces = {"quantity": "observer.force", "kind": "grid", "choices": [0.0, 20.0]}
    observed = circle.with_values({"observer": {"force": 10.0, "torque": 0.0}})
    setting = Setting(varied(observed, forces), seed=0)
    flown_alone(setting, [0, 1])
    assert len(list(setting.cases(np.arange(4), setting.sample(np.arange(4))))) == 2


def test_inner_loops_and_plain_noise_vary_too(circle: Mission) -> None:
    noise = {"quantity": "truth.noise_scale", "kind": "grid", "choices": [0.0, 2.0]}
    noisy = circle.with_values({"noise.position": {"deviation": 0.01, "rate": 100.0}})
    flown_alone(Setting(varied(noisy, noise), seed=0), range(2))
    loops = {"quantity": "truth.rate_bandwidth", "kind": "grid", "choices": [10.0, 20.0, 200.0]}
    rates = {"controller.interface": "rates"}
    table = flown_alone(Setting(varied(circle, loops, **rates), seed=0), range(3))
    assert [row["status"] for row in table] == ["completed", "completed", "refused"]


def test_a_law_that_commands_body_rates_is_tuned_too(crazyflie: Mission) -> None:
    vary = [each for each in ONE_PROGRAM if each["quantity"] not in ("truth.lag_scale", "observer.torque")]
    rates = varied(crazyflie, *vary, **{"controller.interface": "rates"})
    assert [row["status"] for row in flown_alone(Setting(rates, seed=4), [1, 5])] == ["completed"] * 2


def test_what_the_program_cannot_hold_varies_as_a_list_by_missions(circle: Mission) -> None:
    """The speed of another reference; a key of a quantity with a value that is none of its shapes."""
    ramp = circle.with_values({"reference": {"kind": "ramp", "speed": 1.0}})
    speeds = {"quantity": "reference.speed", "kind": "grid", "choices": [0.5, 1.0]}
    setting = Setting(varied(ramp, speeds), seed=0)
    assert len(list(setting.cases(np.arange(2), setting.sample(np.arange(2))))) == 2
    assert [
        each.mission.file.reference.speed for each in setting.cases(np.arange(2), setting.sample(np.arange(2)))
    ] == [0.5, 1.0]
    kinds = {"quantity": "reference.kind", "kind": "grid", "choices": ["ramp", "speed"]}
    setting = Setting(varied(circle, kinds, speeds), seed=0)
    every = np.arange(4)
    missions = [case.mission for case in setting.cases(every, setting.sample(every))]
    assert [(m.file.reference.kind, m.file.reference.speed) for m in missions] == [
        (kind, speed) for kind in ("ramp", "speed") for speed in (0.5, 1.0)
    ]


def test_a_list_over_a_whole_section_keeps_the_seed(circle: Mission) -> None:
    """Which is the campaign's own, whatever else stands in [flight]."""
    sections = {"quantity": "flight", "kind": "list", "choices": [{"duration": 0.1, "step": 0.01}]}
    setting = Setting(varied(circle, sections), seed=5)
    (case,) = setting.cases(np.arange(1), setting.sample(np.arange(1)))
    assert isinstance(case.mission, Mission)
    assert (case.mission.file.flight.seed, case.mission.file.flight.duration) == (5, 0.1)


@pytest.mark.parametrize(
    ("vary", "changes", "said"),
    [
        ("truth.lag_scale", {}, "lag_scale needs a vehicle with rotors that the law commands and that lag"),
        ("truth.noise_scale", {}, "noise_scale needs a vehicle with sensors that are noisy"),
        ("truth.rate_bandwidth", {}, "rate_bandwidth needs a vehicle with an inner loop"),
        ("observer.force", {}, "observer.force needs an observer"),
        ("approach.speed", {}, "approach.speed needs an approach"),
        ("controller.poles.transverse_2", {}, "transverse_2 poles need an implicit path"),
        (
            "controller.poles.tangential",
            {"controller.poles": {"speed": [-3, -3, -3]}},
            "a chain that acts .* transverse, speed, yaw",
        ),
        ("controller.poles.speed", {"reference": {"kind": "ramp", "speed": 1.0}}, "a chain that acts .* tangential"),
        ("controller.poles", {"integral.pole": 0.2, "controller.feedback": "middle"}, "without integral action"),
        ("reference.speed", {"reference": {"kind": "ramp", "speed": 1.0}}, 'a reference of the kind "speed"'),
    ],
)
def test_what_makes_no_difference_is_refused_at_once(
    circle: Mission, vary: str, changes: dict[str, Any], said: str
) -> None:
    spread = {"quantity": vary, "kind": "uniform", "low": 0.5, "high": 1.0}
    with pytest.raises(GammastarError, match=rf"^\[(campaign|controller)\] .*{said}"):
        Setting(varied(circle.with_values(changes), spread), seed=0)

"""The [vehicle] section: forces by kind, in every frame, written out and read again."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from gammastar.errors import GammastarError, MissionError
from gammastar.mission import Mission, parse
from gammastar.mission.vehicles import FORCES
from gammastar.vehicle import Force, Vehicle, split

SHORT: dict[str, Any] = {
    "vehicle": {"mass": 0.5, "inertia": [0.004, 0.004, 0.007]},
    "path": {"name": "circle"},
    "reference": {"kind": "speed", "speed": 1},
    "start": {"position": [1.5, 0, 0.2]},
    "flight": {"duration": 0.05},
}
EVERY_FORCE = [
    {"kind": "linear_drag", "coefficients": [0.1, 0.2, 0.3]},
    {"kind": "rotor_drag", "coefficients": 0.05},
    {"kind": "quadratic_drag", "coefficients": [0.01, 0.01, 0.02], "each_axis": True},
    {"kind": "buoyancy", "volume": 1e-4},
]


def mission(vehicle: dict[str, Any], **changes: Any) -> Mission:
    """Return a short mission of a vehicle."""
    return Mission.from_values(SHORT | {"vehicle": SHORT["vehicle"] | vehicle} | changes)


def flown(each: Mission) -> Vehicle:
    return each.law().vehicle


def test_every_force_with_plain_numbers_can_be_named() -> None:
    made = {kind: section.factory() for kind, section in FORCES.items()}
    named = {each for each in Force.__subclasses__() if each.__name__ != "CustomForce"}
    assert set(made.values()) == named
    assert all(kind.replace("_", "") == each.__name__.lower() for kind, each in made.items())


def test_forces_act_as_those_made_in_python_do() -> None:
    found = flown(mission({"added_mass": 0.2, "forces": EVERY_FORCE}))
    made = [FORCES[each["kind"]].factory()(**{k: v for k, v in each.items() if k != "kind"}) for each in EVERY_FORCE]
    assert found.signature == Vehicle(0.5, (0.004, 0.004, 0.007), added_mass=0.2, forces=made).signature


def test_show_writes_forces_with_their_defaults_and_the_text_is_the_same_mission() -> None:
    first = mission({"forces": EVERY_FORCE})
    table = first.values()["vehicle"]
    assert table["forces"][3] == {"kind": "buoyancy", "volume": 1e-4, "density": 1000.0, "gravity": 9.80665}
    assert table["added_mass"] == 0
    again = parse(first.toml())
    assert again == first
    assert flown(again).signature == flown(first).signature
    assert "forces" not in mission({}).values()["vehicle"]


def test_forces_are_the_same_vector_in_both_frames() -> None:
    """Diagonal coefficients are the same about axes turned round."""
    state = ca.SX(np.concatenate([[0, 0, 0, 1, 2, 3], np.eye(3).ravel(), [0, 0, 0, 4, 0]]))
    both = [flown(mission({"forces": EVERY_FORCE}, frame=frame)) for frame in ("ned", "enu")]
    ned, enu = (ca.DM(each.acceleration(split(state))).full() for each in both)
    assert np.array_equal(ned, enu)


@pytest.mark.parametrize(
    ("forces", "reason"),
    [
        ([{"kind": "drag", "coefficients": 1}], "kind must be one of buoyancy, linear_drag"),
        ([{"coefficients": 1}], 'must have the key "kind"'),
        ([{"kind": "linear_drag"}], "coefficients"),
        ([{"kind": "linear_drag", "coefficients": 1, "volume": 1}], 'unknown key "volume"'),
        ([{"kind": "linear_drag", "coefficients": "1"}], "coefficients"),
        ([{"kind": "linear_drag", "coefficients": [-1, 0, 0]}], r"\[vehicle.forces.0\] linear drag .* negative"),
        ([EVERY_FORCE[0], {"kind": "buoyancy", "volume": 0}], r"\[vehicle.forces.1\] volume"),
        ([{"kind": "quadratic_drag", "coefficients": 1, "each_axis": 1}], "each_axis must be true or false"),
        ({"kind": "linear_drag", "coefficients": 1}, "forces must be a list of tables"),
    ],
)
def test_what_is_no_force_is_refused_with_its_place(forces: Any, reason: str) -> None:
    with pytest.raises(GammastarError, match=reason) as caught:
        mission({"forces": forces})
    assert "\n" not in str(caught.value)


def test_negative_added_mass_is_refused() -> None:
    with pytest.raises(GammastarError, match=r"\[vehicle\] added"):
        mission({"added_mass": -1.0})
    with pytest.raises(MissionError, match="added_mass must be a number"):
        mission({"added_mass": "1"})

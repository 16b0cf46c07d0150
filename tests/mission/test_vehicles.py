"""The [vehicle] section: forces by kind, in every frame, written out and read again."""

from __future__ import annotations

import re
from typing import Any

import casadi as ca
import numpy as np
import pytest

from gammastar.errors import GammastarError, MissionError
from gammastar.mission import Mission, parse
from gammastar.mission.vehicles import FORCES
from gammastar.vehicle import Force, Rotors, Vehicle, presets, split

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


def of_preset(name: str, frame: str = "ned", **changes: Any) -> Mission:
    """Return a short mission of a preset with some keys changed."""
    start = {"position": [1.5, 0, 0.2]} | ({"thrust": 0.1} if presets.load(name).weight == 0 else {})
    return Mission.from_values(SHORT | {"vehicle": {"preset": name} | changes, "frame": frame, "start": start})


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


# --- rotors and presets ----------------------------------------------------------------------------------------------

RING = {
    "count": 4,
    "arm": 0.2,
    "thrust_coefficient": 1e-5,
    "torque_coefficient": 2e-7,
    "fastest": 800,
    "first_angle": 30,
}
PLACES = [[0.1, 0.12, 0.01], [-0.1, 0.12, 0.01], [-0.1, -0.12, 0.01], [0.12, -0.12, 0.01]]
PLACED = {
    "positions": PLACES,
    "spins": [-1, 1, -1, 1],
    "thrust_coefficient": 1e-5,
    "torque_coefficient": 2e-7,
    "fastest": 800,
}


def test_rotors_are_given_by_their_places_or_as_a_ring() -> None:
    assert flown(mission({"rotors": PLACED})).rotors.signature == Rotors(**PLACED).signature
    assert flown(mission({"rotors": RING})).rotors.signature == Rotors.ring(**RING).signature


def test_rotors_of_enu_are_those_of_ned_turned_round() -> None:
    """What is clockwise from above in one frame is so in the other: about an axis that points up that is -1."""
    turned = [[x, -y, -z] for x, y, z in PLACES]
    enu = flown(mission({"rotors": PLACED | {"positions": turned, "spins": [1, -1, 1, -1]}}, frame="enu"))
    assert enu.rotors.signature == Rotors(**PLACED).signature
    ring = flown(mission({"rotors": RING}, frame="enu")).rotors  # numbered and turning the other way round
    assert ring.positions == pytest.approx(Rotors.ring(**RING).positions * [1, -1, 1])
    assert ring.spins.tolist() == [-1, 1, -1, 1]


@pytest.mark.parametrize("name", presets.names())
@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_a_preset_is_the_same_vehicle_in_every_frame_and_is_written_out_by_its_numbers(name: str, frame: str) -> None:
    first = of_preset(name, frame)
    assert flown(first).signature == presets.load(name).signature
    assert "preset" not in first.values()["vehicle"]
    again = parse(first.toml())
    assert again == first
    assert again.toml() == first.toml()  # keys in the same order, too
    assert not re.search(r"-0\.0\b(?!\d)", first.toml())
    assert flown(again).signature == flown(first).signature


def test_any_key_overrides_a_preset_and_the_rest_stays() -> None:
    found = flown(of_preset("hummingbird", mass=0.6, rotors={"fastest": 1200}, forces=[]))
    known = presets.load("hummingbird")
    assert (found.mass, found.rotors.fastest, found.forces) == (0.6, 1200, ())
    assert found.gravity == known.gravity
    assert found.rotors.lag == known.rotors.lag
    assert flown(of_preset("hummingbird", rotors=RING)).rotors.signature == Rotors.ring(**RING).signature
    assert flown(of_preset("paper", rotors=RING)).rotors.signature == Rotors.ring(**RING).signature


def test_an_override_is_in_the_frame_of_the_mission() -> None:
    found = flown(of_preset("paper", "enu", bias_acceleration=[0.1, 0.2, 0.3]))
    assert found.bias_acceleration.tolist() == [0.1, -0.2, -0.3]


def test_a_changed_preset_stays_a_preset() -> None:
    """What is set on the command line changes what was written, not what it stood for."""
    changed = of_preset("hummingbird").with_values({"vehicle.mass": 0.7})
    assert flown(changed).rotors is not None
    assert (
        flown(changed.with_values({"vehicle.preset": "paper"})).signature
        == Vehicle(0.7, (0.0177, 0.0177, 0.0344), 9.8).signature
    )


def test_limits_of_a_preset_count_unless_the_mission_has_its_own() -> None:
    first = of_preset("qdrone")
    assert first.values()["limits"] == {"thrust": 16.0, "torque": 0.8}
    assert first.certify().check("most thrust").limit == 16.0
    own = first.with_values({"limits.thrust": 12.0})
    assert own.certify().check("most thrust").limit == 12.0
    assert own.certify().check("torque").limit == 0.8


@pytest.mark.parametrize(
    ("vehicle", "reason"),
    [
        ({"preset": "humingbird"}, 'preset must be one of .*did you mean "hummingbird"'),
        ({"preset": 3}, "preset must be one of"),
        ({"preset": "paper", "mass": -1.0}, r"\[vehicle\] mass"),
        ({"preset": "paper", "mas": 1.0}, 'unknown key "mas" in .vehicle.; did you mean "mass"'),
        ({"preset": "paper", "rotors": {"fastest": 800}}, r'\[vehicle.rotors\] must have the key "positions"'),
        ({"preset": "hummingbird", "rotors": {"fast": 800}}, r'unknown key "fast" in \[vehicle.rotors\]'),
        ({"preset": "hummingbird", "rotors": {"count": 4}}, r'\[vehicle.rotors\] must have the key "arm"'),
        ({"preset": "hummingbird", "rotors": {"slowest": 1500}}, r"\[vehicle.rotors\] the slowest speed"),
        ({"preset": "hummingbird", "rotors": 4}, r"\[vehicle.rotors\] must be a table"),
        ({"mass": 1.0}, 'must have the key "inertia"'),
        ({"mass": 1.0, "inertia": [1, 1, 1], "rotors": {"arm": 1}}, 'must have the key "count"'),
        ({"mass": 1.0, "inertia": [1, 1, 1], "rotors": RING | {"lag": -1}}, r"\[vehicle.rotors\] lag"),
        ({"prest": "paper"}, 'did you mean "preset"'),
    ],
)
def test_what_is_no_vehicle_is_refused_in_one_sentence(vehicle: dict[str, Any], reason: str) -> None:
    with pytest.raises(GammastarError, match=reason) as caught:
        Mission.from_values(SHORT | {"vehicle": vehicle})
    assert "\n" not in str(caught.value)

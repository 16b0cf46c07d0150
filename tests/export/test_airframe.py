"""What a README tells of the vehicle: numbers that connect rotors, in the axes of the export."""

from __future__ import annotations

import pytest

from export.programs import exported
from gammastar.export.targets import files_of


@pytest.mark.parametrize("target", ["c99", "crazyflie"])
def test_rotors_are_told_in_the_axes_of_the_export(target: str) -> None:
    """The first rotor of a Hummingbird is front left: positive y with the third axis up; it turns clockwise."""
    text = files_of(exported("quadrotor", "float32"), target, 0.1)["README.md"]
    assert "| mass | 0.5 kg |" in text
    assert "| inertia | 0.00365, 0.00368, 0.00703 kg m² |" in text
    assert "| rotors | 0 to 1500 rad/s, lag 0.005 s up, 0.005 s down |" in text
    rows = [line for line in text.splitlines() if line.startswith(("| 1 |", "| 2 |", "| 3 |", "| 4 |"))]
    assert rows[0] == "| 1 | 0.120208, 0.120208, 0 | clockwise | 5.57e-06 | 1.36e-07 |"
    assert rows[1] == "| 2 | 0.120208, -0.120208, 0 | anticlockwise | 5.57e-06 | 1.36e-07 |"
    assert len(rows) == 4


def test_a_full_inertia_is_told_by_rows() -> None:
    """Products with one axis that points the other way in `ned` change their signs."""
    inertia = [[0.02, 0.001, 0.002], [0.001, 0.03, 0.003], [0.002, 0.003, 0.04]]
    program = exported.__wrapped__("upright", "float32", frame="enu", vehicle__inertia=inertia)
    text = files_of(program, "c99", 0.1)["README.md"]
    assert "| inertia | 0.02, 0.001, 0.002; 0.001, 0.03, 0.003; 0.002, 0.003, 0.04 kg m² |" in text
    assert "rotor |" not in text

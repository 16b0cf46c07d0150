"""A law with graphs for its tuning acts as the law does that is designed with these numbers."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import gammastar as gs
from gammastar.law import Law
from gammastar.law.autopilot import Autopilot
from gammastar.law.guidance import Guidance, Surroundings
from gammastar.law.tuned import Tuning, tuned
from gammastar.vehicle import presets

VEHICLE = presets.load("hummingbird")
SIZES = {"transverse": 4, "transverse_2": 4, "tangential": 4, "speed": 3, "yaw": 1}


def designed(poles: float, speed: float, force: float, torque: float) -> Law:
    circle = gs.paths.ellipse((1.0, 1.2))
    return gs.design(VEHICLE, circle, poles=poles, approach=gs.Approach(speed), rejection=gs.Observer(force, torque))


def stepped(law: Law, *known: ca.SX) -> tuple[Autopilot, ca.Function]:
    """Return the autopilot of a law, and the function of one interval of it and what is known of its tuning."""
    pilot = Autopilot(Guidance(law, gs.Speed(1.0).resolved(law.path, 0.0), 0.0), 0.002)
    state, told = ca.SX.sym("state", pilot.size), ca.SX.sym("measurement", 22)
    reference = ca.DM(pilot.guidance.reference.pieces.rows[0])
    result = pilot.step(state, told, ca.SX(0), Surroundings(ca.SX(0, 1), reference))
    return pilot, ca.Function("stepped", [state, told, *known], [ca.densify(each) for each in result[:3]])


def test_a_tuning_given_as_graphs_acts_as_numbers_do() -> None:
    gains = {chain: ca.SX.sym(chain, size) for chain, size in SIZES.items()}
    others = [ca.SX.sym(name) for name in ("approach_speed", "force", "torque")]
    given = designed(-5.0, 3.0, 30.0, 100.0)
    pilot, by_numbers = stepped(given)
    _, by_graph = stepped(tuned(designed(-3.0, 2.0, 40.0, 120.0), Tuning(gains, *others)), *gains.values(), *others)
    generator = np.random.default_rng(0)
    for _ in range(20):
        rotation = gs.so3.random(generator)
        motion = np.concatenate([generator.normal(size=6), rotation.T.ravel(), generator.normal(size=3)])
        start = pilot.start(np.concatenate([motion, [5.0, 0.0]]), 0.3)
        told = np.concatenate([motion + 1e-3, np.ones(4)])
        found = by_graph(start, told, *(given.gains[chain] for chain in SIZES), 3.0, 30.0, 100.0)
        for one, other in zip(found, by_numbers(start, told), strict=True):
            np.testing.assert_allclose(one.full(), other.full(), rtol=1e-9, atol=1e-9)


def test_the_law_itself_stays_as_it_was() -> None:
    law = designed(-3.0, 2.0, 40.0, 120.0)
    before = law.signature
    tuned(law, Tuning({"yaw": ca.SX.sym("k")}, *ca.vertsplit(ca.SX.sym("x", 3))))
    assert law.signature == before
    assert law.rejection == gs.Observer(40.0, 120.0)


@pytest.mark.parametrize("part", ["force", "torque"])
def test_a_part_is_left_as_it_is(part: str) -> None:
    law = designed(-3.0, 2.0, 40.0, 120.0)
    changed = tuned(law, Tuning(**{part: ca.SX.sym(part)}))
    assert changed.approach is law.approach
    assert changed.gains is law.gains or all(np.array_equal(changed.gains[chain], law.gains[chain]) for chain in SIZES)

"""The coordinates of a tuning: every point is a stable law, every stable law is a point, and a mission says the same."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gammastar as gs
from gammastar.campaign.space import FASTEST_POLE, Candidate, Space, numbers_from, poles_from, tunable
from gammastar.errors import InputError, UnknownNameError
from gammastar.mission import Mission

real = st.floats(0.5, 8.0).map(lambda size: [complex(-size)])
pair = st.tuples(st.floats(0.5, 8.0), st.floats(0.1, 8.0)).map(lambda p: [complex(-p[0], p[1]), complex(-p[0], -p[1])])
pieces = st.lists(st.one_of(real, pair), min_size=1, max_size=4).map(lambda each: list(itertools.chain(*each)))


def vehicle() -> gs.Vehicle:
    return gs.Vehicle(mass=0.5, inertia=(3e-3, 3e-3, 5e-3))


@pytest.fixture(scope="module")
def law() -> gs.Law:
    return gs.design(vehicle(), gs.paths.circle(), poles=-4, approach=gs.Approach(), rejection=gs.Observer())


def space(law: gs.Law, *only: str, interval: float = 2e-3) -> Space:
    return Space(law, interval, ("transverse", "speed", "yaw"), only)


@given(pieces.filter(lambda poles: len(poles) <= 4))
def test_every_stable_set_of_poles_is_a_point(poles: list[complex]) -> None:
    """The coefficients agree, to rounding: poles near a double one move by its square root, coefficients do not."""
    again = poles_from(numbers_from(poles), len(poles))
    assert len(again) == len(poles)
    assert np.real(np.poly(again)) == pytest.approx(np.real(np.poly(poles)), rel=1e-9)


@given(st.lists(st.floats(0, 1), min_size=11, max_size=11))
def test_every_point_within_the_bounds_is_a_stable_law(law: gs.Law, shares: list[float]) -> None:
    """Gains are made of it without complaint, and no pole is too fast for the control rate."""
    interval = 0.02
    here = space(law, interval=interval)
    low, high = here.bounds()
    tuned = here.candidate(low + np.array(shares) * (high - low)).law(law)
    assert set(tuned.gains) == set(law.gains)
    for poles in tuned.poles.values():
        assert max(pole.real for pole in poles) < 0
        assert max(abs(pole) for pole in poles) <= FASTEST_POLE / interval * (1 + 1e-12)
    assert tuned.gains["transverse_2"] == pytest.approx(tuned.gains["transverse"])


def test_the_own_tuning_is_at_zero(law: gs.Law) -> None:
    here = space(law)
    low, high = here.bounds()
    assert np.all(low <= 0)
    assert np.all(high >= 0)
    own, at_zero = Candidate.of(law), here.candidate(np.zeros(len(low)))
    assert at_zero.observers == pytest.approx(own.observers)
    assert at_zero.speed == pytest.approx(own.speed)
    for chain, poles in own.poles.items():
        assert np.poly(at_zero.poles[chain]) == pytest.approx(np.poly(poles), rel=1e-9)


def test_only_what_is_named_moves(law: gs.Law) -> None:
    here = space(law, "speed.frequency", "observer")
    assert [each.name for each in here.variables] == ["speed.frequency", "observer.force", "observer.torque"]
    moved = here.candidate([1.0, -1.0, 0.0])
    assert {chain for chain, poles in moved.poles.items() if poles != law.poles[chain]} == {"speed"}
    ratio = moved.poles["speed"][0] / law.poles["speed"][0]
    assert moved.poles["speed"] == pytest.approx([ratio * pole for pole in law.poles["speed"]])
    assert moved.observers["force"] < Candidate.of(law).observers["force"]
    assert moved.speed == Candidate.of(law).speed


@pytest.mark.parametrize("interface", ["wrench", "rates"])
def test_a_mission_with_the_values_of_a_tuning_has_it(interface: str) -> None:
    mission = Mission.from_values(
        {
            "vehicle": {"preset": "hummingbird"},
            "path": {"name": "circle"},
            "reference": {"kind": "speed", "speed": 1.0},
            "start": {"position": [1.5, 0.0, 0.0]},
            "controller": {"poles": -4.0, "interface": interface},
            "observer": {},
            "approach": {},
        }
    )
    law = mission.law()
    here = space(law)
    tuned = here.candidate(np.linspace(-1, 1, len(here.variables))).law(law)
    again = mission.with_values(Candidate.of(tuned).values(law)).law()
    assert again.poles == tuned.poles
    assert again.rejection == tuned.rejection
    assert again.approach is not None
    assert tuned.approach is not None
    assert again.approach.speed == tuned.approach.speed


def test_what_cannot_be_tuned_is_refused(law: gs.Law) -> None:
    with pytest.raises(UnknownNameError, match="what is tuned must be one of"):
        space(law, "transversal")
    integral = gs.IntegralAction(0.5, law.poles["transverse"])
    with pytest.raises(InputError, match="put \\[observer\\] in place"):
        tunable(gs.design(vehicle(), gs.paths.circle(), poles=-4, rejection=integral))

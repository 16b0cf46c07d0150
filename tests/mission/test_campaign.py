"""The [campaign] section: every kind of distribution is read and written, and what does not fit is refused in one sentence."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from gammastar.errors import InputError
from gammastar.mission import Mission, load
from gammastar.mission.campaign import QUANTITIES, Way
from gammastar.mission.choices import Grid

GOOD: list[dict[str, Any]] = [
    {"quantity": "start.attitude", "kind": "any"},
    {"quantity": "start.attitude", "kind": "tilted", "low": 90.0},
    {"quantity": "start.attitude", "kind": "about", "axis": [0.0, 1.0, 0.0]},
    {"quantity": "start.position", "kind": "ball", "radius": 2.0, "center": [0.0, 0.0, 2.0]},
    {"quantity": "start.position", "kind": "along", "radius": 0.5},
    {"quantity": "wind.mean", "kind": "box", "low": [-1.0, -1.0, 0.0], "high": [1.0, 1.0, 0.5]},
    {"quantity": "truth.mass_scale", "kind": "normal", "mean": 1.0, "deviation": 0.1, "low": 0.8},
    {"quantity": "truth.inertia_scale", "kind": "uniform", "low": [0.9, 0.9, 0.8], "high": [1.1, 1.1, 1.2]},
    {"quantity": "truth.force_scale", "kind": "log-uniform", "low": 0.5, "high": 2.0},
    {"quantity": "path.radius", "kind": "grid", "choices": [1.0, 2.0]},
    {"quantity": "path.radius", "kind": "grid", "low": 1.0, "high": 2.0, "count": 3},
    {"quantity": "truth.latency", "kind": "grid", "low": 0.001, "high": 0.1, "count": 3, "spacing": "log"},
    {"quantity": "controller.poles", "kind": "list", "choices": [-4.0, -6.0], "probabilities": [0.3, 0.7]},
    {"quantity": "controller.poles", "kind": "uniform", "low": -6.0, "high": -4.0},
    {"quantity": "controller.poles.yaw", "kind": "log-uniform", "low": -9.0, "high": -4.0},
    {"quantity": "truth.noise_scale", "kind": "uniform", "low": 0.0, "high": 2.0},
]


@pytest.fixture(scope="module")
def mission() -> Mission:
    return load("quadrotor")


def varied(mission: Mission, *given: dict[str, Any], **more: Any) -> Mission:
    return mission.with_values({"campaign": {"vary": list(given), **more}})


@pytest.mark.parametrize("given", GOOD, ids=lambda each: f"{each['quantity']}-{each['kind']}")
def test_what_is_written_is_read_again(mission: Mission, given: dict[str, Any]) -> None:
    campaign = varied(mission, given, sampling="sobol")
    again = Mission.from_values(tomllib.loads(campaign.toml()))
    assert again == campaign
    assert again.file.campaign is not None
    assert list(again.file.campaign.distributions(again.quantities)) == [given["quantity"]]
    assert again != mission


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"quantity": "start.attitude", "kind": "ball", "radius": 1.0}, "start.attitude must vary over attitudes"),
        (
            {"quantity": "truth.mass_scal", "kind": "uniform", "low": 0.5, "high": 1.0},
            'did you mean "truth.mass_scale"',
        ),
        ({"quantity": "truth.mass_scale", "kind": "uniform", "low": 1.0, "high": 1.0}, "low must be below high"),
        ({"quantity": "truth.mass_scale", "kind": "unifrm"}, 'did you mean "uniform"'),
        ({"quantity": "path.radius", "kind": "grid", "choices": []}, "at least one"),
        ({"quantity": "path.radius", "kind": "grid", "choices": 3}, "choices must be a list"),
        ({"quantity": "path.radius", "kind": "grid"}, "must have choices, or low, high and count"),
        (
            {"quantity": "path.radius", "kind": "grid", "low": 1.0, "count": 3},
            "must have choices, or low, high and count",
        ),
        (
            {"quantity": "path.radius", "kind": "grid", "choices": [1], "low": 1.0, "high": 2.0, "count": 3},
            "some of both",
        ),
        ({"quantity": "path.radius", "kind": "grid", "low": 2.0, "high": 1.0, "count": 3}, "low must be below high"),
        ({"quantity": "path.radius", "kind": "grid", "low": 1.0, "high": 2.0, "count": 1}, "from 2 to 100000"),
        ({"quantity": "path.radius", "kind": "grid", "low": 1.0, "high": 2.0, "count": 10**9}, "from 2 to 100000"),
        ({"quantity": "a", "kind": "grid", "low": -1.0, "high": 2.0, "count": 3, "spacing": "log"}, "both of one sign"),
        ({"quantity": "a", "kind": "list", "choices": [1, 2], "probabilities": [0.5, 0.6]}, "must sum to one"),
        ({"kind": "any"}, 'must have the key "quantity"'),
        ({"quantity": "start.attitude", "kind": "any", "radius": 1.0}, 'unknown key "radius"'),
        ({"quantity": "wind.mean", "kind": "ball", "radius": float("nan")}, "finite"),
    ],
)
def test_what_does_not_fit_is_refused(mission: Mission, given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        varied(mission, given)


def test_a_quantity_varies_once(mission: Mission) -> None:
    with pytest.raises(InputError, match="must vary once"):
        varied(mission, GOOD[0], GOOD[1])


@pytest.mark.parametrize(
    ("outer", "inner"),
    [("path", "path.radius"), ("controller.poles", "controller.poles.yaw"), ("start.attitude", "start.roll")],
)
def test_no_two_quantities_say_the_same(mission: Mission, outer: str, inner: str) -> None:
    """One lies within the other, or is another form of it."""
    vary = [{"quantity": name, "kind": "list", "choices": [-1.0]} for name in (inner, outer)]
    with pytest.raises(InputError, match=rf"must not say the same twice \(got {inner} and {outer}\)"):
        varied(mission, *vary)
    angles = [{"quantity": f"start.{name}", "kind": "list", "choices": [1.0]} for name in ("roll", "pitch")]
    assert varied(mission, *angles).file.campaign is not None


@pytest.mark.parametrize(("spacing", "values"), [("linear", [1.0, 4.0, 7.0]), ("log", [1.0, 7.0**0.5, 7.0])])
def test_a_grid_between_two_ends_has_equal_steps_or_ratios(spacing: str, values: list[float]) -> None:
    assert Grid(low=1.0, high=7.0, count=3, spacing=spacing).choices == pytest.approx(values, rel=1e-15)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["flight.number", "flight.seed", "campaign", "campaign.sampling"])
def test_what_a_campaign_sets_itself_does_not_vary(mission: Mission, name: str) -> None:
    with pytest.raises(InputError, match=rf"what the campaign sets itself \(got {name}\)"):
        varied(mission, {"quantity": name, "kind": "list", "choices": [1]})


def test_thousands_of_quantities_are_refused_at_once(mission: Mission) -> None:
    vary = [{"quantity": f"path.k{k}", "kind": "list", "choices": [1.0]} for k in range(201)]
    with pytest.raises(InputError, match=r"vary must be at most 200 tables \(got 201\)"):
        varied(mission, *vary)


def test_something_varies(mission: Mission) -> None:
    with pytest.raises(InputError, match="vary must be a list"):
        varied(mission)
    with pytest.raises(InputError, match="sampling must be one of"):
        varied(mission, GOOD[0], sampling="sobel")


def test_every_quantity_has_an_example() -> None:
    """All others are of the kind of one that has an example."""
    ways = {QUANTITIES[given["quantity"]].way for given in GOOD if given["quantity"] in QUANTITIES}
    assert ways == set(Way) - {Way.SPEED}

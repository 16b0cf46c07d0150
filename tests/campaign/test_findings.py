"""What a study finds is what was put into the rows, in words, numbers and figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from campaign.rows import COUNT, STRONG, hummingbird, known, stored
from gammastar.campaign.columns import THRUST_TO_WEIGHT, label, those_of
from gammastar.campaign.findings import columns_by, findings
from gammastar.campaign.pictures import attitude_basins, pictures, position_basins, tolerance
from gammastar.campaign.rate import percent, wilson
from gammastar.campaign.ratio import thrust_to_weight
from gammastar.campaign.study import Study
from gammastar.errors import InputError
from gammastar.figures import style
from gammastar.report.folder import to_json
from gammastar.report.study_page import page
from gammastar.report.study_tables import as_text


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return Study(stored(tmp_path_factory.mktemp("known"), known(), toml=hummingbird().toml()))


@pytest.fixture(scope="module")
def found(study: Study) -> dict[str, object]:
    return findings(study)


def ratio() -> np.ndarray:
    """Return the thrust to weight of the flights, from the vehicle alone."""
    vehicle = hummingbird().law().vehicle
    assert vehicle.rotors is not None
    scale = known()["truth.thrust_scale"] / known()["truth.mass_scale"]
    return scale * vehicle.rotors.thrust_range[1] / (vehicle.mass * vehicle.gravity)


def test_the_object_is_plain_and_tells_the_campaign(found: dict[str, object]) -> None:
    plain = json.loads(to_json(found))
    settled = int(known()["settled"].sum())
    assert (plain["mission"], plain["flights"], plain["flights_missing"]) == (hummingbird().title, COUNT, 0)
    assert plain["settled_within_m"] == hummingbird().file.flight.settled_within
    assert plain["success"] == {**wilson(settled, COUNT).values()}
    (cause,) = plain["causes"]
    assert (cause["cause"], cause["flights"], cause["median_end_time_s"]) == ("free_fall", COUNT - settled, 1.0)
    assert cause["first_flight"] == int(np.flatnonzero(~known()["settled"])[0])
    assert cause["sentence"] == "thrust fell to zero"


def test_those_that_did_not_settle_are_told_by_how_far_they_were(tmp_path: Path) -> None:
    """A flight that missed its bound by a hair and one that flew away have one status."""
    distance = np.where(known()["settled"], 0.001, 0.1 + np.arange(COUNT))
    rows = {name: known()[name] for name in ("flight", "settled")} | {"rms_distance_last_quarter_m": distance}
    missed = distance[~known()["settled"]]
    told = findings(Study(stored(tmp_path, rows | {"status": np.full(COUNT, "completed")})))["causes"][0]["sentence"]
    expected = f"{missed.min():.3g} to {missed.max():.3g} m away in the last quarter (RMS), in the median {np.median(missed):.3g} m"
    assert told.endswith(expected)


def test_distributions_are_those_of_the_flights_that_settle(found: dict[str, dict[str, dict[str, float]]]) -> None:
    told, settled = found["distributions"], known()["settled"]
    assert told["max_distance_m"] == {
        "flights": settled.sum(),
        "mean": 2.0,
        **dict.fromkeys(list(told["max_distance_m"])[2:], 2.0),
    }
    assert told["peak_rate_rad_s"]["95%"] == pytest.approx(np.quantile(known()["peak_rate_rad_s"][settled], 0.95))
    assert told["max_thrust_N"]["0%"] == known()["max_thrust_N"][settled].min()


def test_everything_that_varies_is_told_and_nothing_else(found: dict[str, dict[str, object]]) -> None:
    assert list(found["by"]) == [
        "truth.mass_scale",
        "truth.thrust_scale",
        "path.radius",
        "controller.feedback",
        THRUST_TO_WEIGHT,
        "start_tilt_deg",
        "start_tilt_direction_deg",
        "start_heading_deg",
        "start_position_x_m",
        "start_position_y_m",
        "start_position_z_m",
    ]


def test_thrust_to_weight_is_that_of_the_vehicle_that_flies(study: Study) -> None:
    rows = study.asked(f"SELECT {THRUST_TO_WEIGHT} FROM flights ORDER BY flight")
    np.testing.assert_allclose(np.array(rows)[:, 0], ratio(), rtol=1e-12)


def test_what_does_not_vary_is_the_missions_own(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The mission's truth has a mass of 1.2 and a thrust of 0.9 of what is believed."""
    for column, others in (("truth.mass_scale", 0.9), ("truth.thrust_scale", 1 / 1.2)):
        rows = {name: known()[name][:50] for name in ("flight", "status", "settled", column)}
        one = Study(stored(tmp_path_factory.mktemp("one"), rows, toml=hummingbird().toml()))
        factor = 1 / rows[column] if column == "truth.mass_scale" else rows[column]
        vehicle = hummingbird().law().vehicle
        expected = others * factor * vehicle.rotors.hover(vehicle.weight).thrust_to_weight
        told = np.array(one.asked(f"SELECT {THRUST_TO_WEIGHT} FROM flights ORDER BY flight"))[:, 0]
        np.testing.assert_allclose(told, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("mission", "columns"),
    [
        ("", ["truth.mass_scale"]),
        ("quadrotor", ["start_tilt_deg"]),
        ("quadrotor", ["truth.mass_scale", "vehicle.preset"]),
        ("quadrotor", ["truth.mass_scale", "vehicle"]),
        ("upside-down", ["truth.mass_scale"]),
    ],
)
def test_thrust_to_weight_is_told_only_where_it_is_known(mission: str, columns: list[str]) -> None:
    from gammastar.mission import load

    assert thrust_to_weight(load(mission).toml() if mission else "", columns) is None


def test_thrust_to_weight_is_not_told_of_places_in_a_list_of_rotors() -> None:
    choices: list[list[Any]] = [[0.9, 1.0], [[1.0, 1.0, 1.0, 0.9], [0.9, 1.0, 1.0, 1.0]]]
    missions = [
        hummingbird().with_values(
            {"campaign.vary": [{"quantity": "truth.thrust_scale", "kind": "list", "choices": each}]}
        )
        for each in choices
    ]
    told = [thrust_to_weight(each.source(), ["truth.thrust_scale"]) for each in missions]
    assert told[0] is not None
    assert told[1] is None


def test_flights_by_body_rates_have_no_rotors() -> None:
    rates = hummingbird().with_values({"controller.interface": "rates", "truth.thrust_scale": 1.0})
    assert thrust_to_weight(rates.source(), ["truth.mass_scale"]) is None


def test_thrust_to_weight_is_told_where_the_path_varies_too() -> None:
    radius = {"quantity": "path.radius", "kind": "uniform", "low": 1.0, "high": 2.0}
    varied = hummingbird().with_values({"campaign.vary": [radius]})
    assert thrust_to_weight(varied.source(), ["truth.mass_scale", "path.radius"]) is not None


def test_bins_of_a_quantity_tell_what_was_put_in(
    found: dict[str, dict[str, dict[str, list[dict[str, object]]]]],
) -> None:
    """Below a right angle every flight settles, beyond it only the strong ones."""
    for each in found["by"]["start_tilt_deg"]["bins"]:
        chosen = (known()["start_tilt_deg"] >= each["low"]) & (known()["start_tilt_deg"] < each["high"])
        assert (each["flights"], each["successes"]) == (chosen.sum(), (chosen & known()["settled"]).sum())
    values = {each["value"]: each["flights"] for each in found["by"]["controller.feedback"]["bins"]}
    assert values == {"held": 3 * COUNT // 4, "middle": COUNT // 4}
    assert found["by"]["start_tilt_deg"]["unit"] == "deg"


def test_quantities_are_columns_or_keys_of_the_mission(study: Study) -> None:
    assert columns_by(study, ["start.position", "truth.mass_scale", "truth.mass_scale"]) == [
        "start_position_x_m",
        "start_position_y_m",
        "start_position_z_m",
        "truth.mass_scale",
    ]
    assert those_of("start.attitude", study.columns) == [
        "start_tilt_deg",
        "start_tilt_direction_deg",
        "start_heading_deg",
    ]
    assert those_of("wind.mean", study.columns) == ["wind.mean.x"]
    for unknown in ("truth.mass", "start", "", "start.velocity"):
        with pytest.raises(InputError, match="quantity must be one of"):
            columns_by(study, [unknown])


def test_labels_have_units_and_frames() -> None:
    assert label("start_tilt_direction_deg", "enu") == "start tilt direction, enu [°]"
    assert label("start_tilt_deg", "enu") == "start tilt [°]"
    assert label("truth.mass_scale", "enu") == "truth.mass_scale"
    assert label("start_angular_velocity_z_rad_s", "enu") == "start angular velocity z, enu [rad/s]"
    assert [label(f"path.{each}", "enu") for each in ("radius", "point.z", "along.x", "heading", "pitch")] == [
        "path.radius [m]",
        "path.point.z, enu [m]",
        "path.along.x, enu",
        "path.heading [°]",
        "path.pitch",
    ]
    assert label("min_free_fall_margin_m_s2") == "min free fall margin [m/s²]"


def test_the_map_over_attitudes_counts_every_flight(study: Study) -> None:
    direction, heading = attitude_basins(study)
    for basin, column in ((direction, "start_tilt_direction_deg"), (heading, "start_heading_deg")):
        counts, *_ = np.histogram2d(known()[column], known()["start_tilt_deg"], (basin.across_edges, basin.up_edges))
        np.testing.assert_array_equal(basin.flights, counts)
        assert (basin.successes[:, basin.up_edges[1:] <= 90] == basin.flights[:, basin.up_edges[1:] <= 90]).all()
        assert (basin.successes[:, basin.up_edges[:-1] >= 90] < basin.flights[:, basin.up_edges[:-1] >= 90]).all()
        cell = [
            np.digitize(known()[name], ends) == 2
            for name, ends in ((column, basin.across_edges), ("start_tilt_deg", basin.up_edges))
        ]
        times = known()["settling_time_s"][cell[0] & cell[1] & known()["settled"]]
        assert basin.settling[1, 1] == pytest.approx(np.median(times))


def test_the_map_over_positions_has_the_two_axes_that_spread_most(study: Study) -> None:
    """Y does not vary; the mission is in `enu`, whose third axis points up already."""
    (basin,) = position_basins(study)
    assert (basin.across, basin.up) == ("start position x, enu [m]", "start position z, enu [m]")
    assert basin.equal
    assert not basin.downward
    assert basin.flights.sum() == COUNT
    above = basin.up_edges[:-1] >= 0.1
    assert (basin.successes[:, above] == basin.flights[:, above]).all()


def test_figures_show_the_numbers_of_the_study(study: Study) -> None:
    columns = ["truth.mass_scale", "controller.feedback", THRUST_TO_WEIGHT]
    drawn = pictures(study, columns, 10)
    assert list(drawn) == [
        "basin-attitude",
        "basin-position",
        "tolerance-truth.mass_scale",
        "tolerance-controller.feedback",
        "thrust-to-weight",
    ]
    steps = drawn["thrust-to-weight"].axes[0].patches[0].get_data()
    bins = study.by(THRUST_TO_WEIGHT, 10)
    np.testing.assert_allclose(steps.values, [100 * each.rate.share for each in bins])
    np.testing.assert_allclose(steps.edges, [bins[0].low, *(each.high for each in bins)])
    vehicle = hummingbird().law().vehicle
    enough = STRONG * vehicle.rotors.hover(vehicle.weight).thrust_to_weight
    assert all((share == 100) == (low >= enough) for share, low in zip(steps.values, steps.edges[:-1], strict=True))
    names = [text.get_text() for text in drawn["tolerance-controller.feedback"].axes[0].get_xticklabels()]
    assert names == ["held", "middle"]
    cells = drawn["basin-attitude"].axes[0].collections[1]
    cells.update_scalarmappable()
    shown = {tuple(color) for color in cells.get_facecolor()}
    assert to_rgba(style.BLUE) in shown
    rate = study.rate()
    title = " ".join(drawn["basin-attitude"]._suptitle.get_text().split())
    assert title.endswith(f"interval {percent(rate.low)} to {percent(rate.high)}")


def test_an_interval_reaches_into_the_picture(study: Study) -> None:
    bins = study.by("start_tilt_deg", 6)
    curve = tolerance("tilt", bins)
    assert curve.interval.tolist() == [[each.rate.low, each.rate.high] for each in bins]
    assert curve.edges is not None
    assert curve.edges.tolist() == [0, 30, 60, 90, 120, 150, 180]
    np.testing.assert_array_equal(curve.settling, [each.settling for each in bins])


def test_the_text_tells_rates_causes_and_where_success_is_least(found: dict[str, Any]) -> None:
    words = as_text(found, whole=False)
    assert words.startswith(f"{hummingbird().title}\n{COUNT:,} flights of the seed 0\n")
    assert "differ by chance too" in words
    rows = {line.split("  ")[0].strip(): line for line in words.splitlines() if line.strip()}
    assert rows["free fall"].split()[2] == f"{COUNT - int(known()['settled'].sum())}"
    assert "free fall: thrust fell to zero" in rows
    assert rows["thrust to weight"].count("100.00 %") == 2  # share and upper end, of the best bin
    assert rows["thrust to weight"].index("100.00 %") > rows["thrust to weight"].index(" to ") + 20
    least = min(found["by"][THRUST_TO_WEIGHT]["bins"], key=lambda each: each["interval"][1])
    assert rows["thrust to weight"].split()[3:7] == [
        f"{least['low']:g}",
        "to",
        f"{least['high']:g}",
        f"{100 * least['share']:.2f}",
    ]
    assert "middle" not in as_text(found, whole=False).split("what success depends on")[0]
    assert "by controller.feedback" in as_text(found, whole=True)
    assert "only in the last quarter" not in words


def test_where_all_settle_the_text_tells_where_soonest_and_latest(tmp_path: Path) -> None:
    """Success then depends on nothing; the settling time grows with the tilt here."""
    tilt = known()["start_tilt_deg"]
    rows = {"flight": known()["flight"], "status": np.full(COUNT, "completed"), "settled": np.full(COUNT, True)}
    rows |= {"start_tilt_deg": tilt, "settling_time_s": 1 + tilt / 180}
    words = as_text(findings(Study(stored(tmp_path, rows, toml=hummingbird().toml()))), whole=False)
    assert "what success depends on" not in words
    (line,) = (
        line for line in words.split("what the settling time depends on")[1].splitlines() if "start tilt" in line
    )
    cells = [cell for cell in line.split("  ") if cell.strip()][1:]
    assert [cells[0].strip(), cells[3].strip()] == ["0 to 20", "160 to 180"]
    assert float(cells[1]) == pytest.approx(1 + np.median(tilt[tilt <= 20]) / 180, rel=1e-3)
    assert float(cells[5]) == pytest.approx(1 + np.quantile(tilt[tilt > 160], 0.95) / 180, rel=1e-3)


def test_what_settles_in_the_last_quarter_alone_is_told(tmp_path: Path) -> None:
    """Such a flight may pass through its path as it ends: a success by the word, but little to rely on."""
    rows = {name: known()[name] for name in ("flight", "status", "settled", "settling_time_s")}
    late = Study(stored(tmp_path, rows | {"end_time_s": np.full(COUNT, 4.0)}, toml=hummingbird().toml()))
    expected = int((known()["settled"] & (known()["settling_time_s"] > 3.0)).sum())
    assert 0 < expected < COUNT
    found = findings(late)
    assert found["settled_late"] == expected
    assert f"{expected:,} of them only in the last quarter of their time" in as_text(found, whole=False)


def test_the_page_holds_every_figure_and_table(found: dict[str, object]) -> None:
    text = page(found, ["basin-attitude", "tolerance-truth.mass_scale", "thrust-to-weight"], "study.json")
    for stem in ("basin-attitude", "tolerance-truth.mass_scale", "thrust-to-weight"):
        assert text.count(f'src="{stem}.png"') == 1
    for title in ("Why flights fail", "Flights that settle", "By path.radius", "By controller.feedback"):
        assert f"<h2>{title}</h2>" in text
    assert "By truth.mass_scale" not in text  # it stands below its figure
    assert text.count("0.98 to 1<") == 1

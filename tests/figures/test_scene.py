"""The scene in space: true to scale, upright, not mirrored, and with the vehicle shown where it turns."""

import casadi as ca
import numpy as np
import pytest
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import proj3d

import gammastar as gs
from figures.kinds import KINDS, tilt_degrees
from gammastar.figures import scene
from gammastar.figures.quadrotor import towards_viewer


def panel(view: tuple[float, float], low: np.ndarray, high: np.ndarray):
    axis = Figure(figsize=(4, 4)).add_subplot(projection="3d")
    scene.dress_space(axis, low, high, view)
    return axis


def on_paper(axis, place: np.ndarray) -> np.ndarray:
    """Return where a world point (3,) is seen: right and up."""
    x, y, _ = proj3d.proj_transform(*scene.drawn(place), axis.get_proj())
    return np.array([x, y])


def test_what_is_above_is_drawn_above() -> None:
    """World third axis down: smaller x3 is higher."""
    axis = panel(scene.VIEW, np.full(3, -1.0), np.full(3, 1.0))
    assert on_paper(axis, np.array([0, 0, -0.5]))[1] > on_paper(axis, np.array([0, 0, 0.5]))[1]


def test_the_scene_is_not_mirrored() -> None:
    """Seen from above, the way from x1 to x2 is clockwise, as on a map with x1 north and x2 east."""
    axis = panel((90, 0), np.full(3, -1.0), np.full(3, 1.0))
    middle = on_paper(axis, np.zeros(3))
    north, east = (on_paper(axis, 0.5 * np.eye(3)[k]) - middle for k in (0, 1))
    assert north[0] * east[1] - north[1] * east[0] < 0


@pytest.mark.parametrize("view", [scene.VIEW, (40.0, 120.0), (-20.0, -70.0)])
def test_the_direction_to_the_viewer_is_seen_as_a_point(view: tuple[float, float]) -> None:
    axis = panel(view, np.full(3, -1.0), np.full(3, 1.0))
    near = towards_viewer(axis)
    seen = [proj3d.proj_transform(*(step * near), axis.get_proj())[:2] for step in (0.0, 0.5, -0.5)]
    assert np.allclose(seen, seen[0], atol=1e-9)
    depth = [proj3d.proj_transform(*(step * near), axis.get_proj())[2] for step in (0.0, 0.5)]
    assert depth[1] < depth[0]


@pytest.mark.parametrize("kind", ["upside down", "stop", "open path"])
def test_the_scene_has_equal_scale(kind: str) -> None:
    """The sides of the box are to each other as the lengths they show."""
    axis = scene.draw_path(KINDS[kind]()).axes[0]
    lengths = [abs(np.subtract(*limit)) for limit in (axis.get_xlim(), axis.get_ylim(), axis.get_zlim())]
    assert np.allclose(axis._box_aspect / axis._box_aspect[0], np.array(lengths) / lengths[0], rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_flight_and_target_lie_inside_the_box(kind: str) -> None:
    record = KINDS[kind]()
    axis = scene.draw_path(record).axes[0]
    low, high = (np.array(pair) for pair in zip(*(sorted(side()) for side in limits_of(axis)), strict=True))
    places = scene.drawn(np.vstack([record.position, *scene.target_points(record)]))
    assert np.all((places >= low - 1e-9) & (places <= high + 1e-9))


def limits_of(axis):
    return axis.get_xlim, axis.get_ylim, axis.get_zlim


def test_a_path_is_drawn_no_farther_than_its_domain_and_the_flight() -> None:
    """Pi is the slope angle of a parabola: below pi/2 everywhere, so there is nothing half a unit beyond 1.2."""
    path = gs.path.ImplicitPath(
        lambda x, y, z: y - x**2, lambda x, y, z: z, lambda x, y, z: ca.atan(x), seed=(0, 0, 0), domain=(-1.2, 1.2)
    )
    law = gs.design(gs.Vehicle(mass=0.5, inertia=(4e-3, 4e-3, 7e-3)), path, poles=-3)
    record = gs.fly(law, gs.State(position=(0.5, 0.3, 0.1)), speed=0.2, duration=4)
    (points,) = scene.target_points(record)
    assert points[0, 0] == pytest.approx(np.tan(record.tangential_state[:, 0].min() - 0.5))
    assert points[-1, 0] == pytest.approx(np.tan(1.2))


def test_poses_are_denser_in_time_where_the_vehicle_turns_fast() -> None:
    """The inverted start goes over within half a second; later the vehicle hardly turns."""
    record = KINDS["upside down"]()
    rows = scene.pose_rows(record)
    times = record.time[rows]
    assert rows[0] == 0
    assert np.all(np.diff(rows) > 0)
    fast = (times > 0.2) & (times < 0.5)  # two thirds of the turn happen here
    assert np.count_nonzero(fast) >= 4
    assert np.diff(times[fast]).max() < 0.5 * np.diff(times[times > 1]).min()
    shown = tilt_degrees(record)[rows]
    assert np.abs(np.diff(shown)).max() < 60  # the flip can be followed from pose to pose


def test_the_second_lap_is_not_drawn_over_the_first() -> None:
    record = KINDS["upside down"]()
    assert record.time[scene.pose_rows(record)[-1]] < record.time[-1] - 1


def test_the_path_of_every_phase_is_drawn() -> None:
    """The first one whole, as it closes, the second one to its end; the legend says from when."""
    record = KINDS["replaced"]()
    first, second = scene.target_points(record)
    assert np.allclose(first[0], first[-1])
    assert np.allclose(second[-1], [-6, 3, 0], atol=1e-4)  # the flight is nearly there
    axis = scene.draw_path(record).axes[0]
    assert {"target at first", "target from 6 s"} <= set(axis.get_legend_handles_labels()[1])


def test_a_flight_that_ran_away_is_drawn() -> None:
    """Its last rows are farther than a view in space can be turned: they are cut."""
    drag = [{"kind": "linear_drag", "coefficients": 1e4}]
    record = gs.load_mission("quadrotor").with_values({"truth.forces": drag, "flight.duration": 0.3}).fly()
    assert np.abs(record.position).max() > 1e100
    assert np.isfinite(scene.scene_size(record))
    scene.draw_path(record)

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bearcub.geometry import Attitude, base_from_optical, camera_attitude, forward_in_camera
from bearcub.messages import Float64, FreeRange, Limit, UInt8
from bearcub.rig import Mount, Rig
from bearcub.viewer.birdseye import (
    View,
    automatic_reach,
    bar,
    birdseye,
    floor_points,
    free_outline,
    visible_floor,
)
from bearcub.viewer.palette import HOLE, VERMILLION, Colour, distance_colour


def pixels_of(picture: UInt8, colour: Colour) -> NDArray[np.int64]:
    return np.argwhere((picture == colour).all(axis=2))


def test_ahead_is_up_and_left_is_left() -> None:
    view = View(width=401, height=300, reach=10.0, foot=50)  # 25 px a metre
    assert view.pixels(np.array([0.0, 0.0])).tolist() == [200.0, 249.0]
    assert view.pixels(np.array([2.0, 1.0])).tolist() == [175.0, 199.0]


def test_obstacle_is_a_bar_at_its_place_as_wide_as_it_is(world: Any, rig: Rig, box: Any) -> None:
    answer = world(obstacles=(box(distance=4.0, width=2.0, sigma_distance=0.0),)).answer()
    picture = birdseye(answer, rig, size=(401, 400), reach=8.0)
    found = pixels_of(picture, distance_colour(4.0))
    rows = np.bincount(found[:, 0])
    bar_rows = np.flatnonzero(rows > 50)
    foot = round(3.4 * 400 / 36)
    scale = (400 - foot) / 8.0
    assert bar_rows.max() == pytest.approx(399 - foot - 4.0 * scale, abs=2)
    assert rows.max() == pytest.approx(2.0 * scale, abs=4)  # less its dark outline


def test_mirrored_input_mirrors_the_picture(world: Any, rig: Rig, box: Any) -> None:
    def centre(bearing: float) -> Float64:
        thing = box(bearing=bearing, sigma_distance=0.0, width=1.0)
        picture = birdseye(world(obstacles=(thing,)).answer(), rig, size=(401, 400), reach=6.0)
        place = View(width=401, height=400, reach=6.0, foot=round(3.4 * 400 / 36))
        u, v = place.pixels(4.0 * np.array([math.cos(bearing), math.sin(bearing)]))
        found = pixels_of(picture, distance_colour(4.0))
        near = found[np.abs(found - [v, u]).max(axis=1) < 15]
        return np.asarray(near.mean(axis=0), dtype=np.float64)

    left, right = centre(0.4), centre(-0.4)
    assert left[1] < 200 < right[1]
    assert left[1] + right[1] == pytest.approx(400, abs=1.0)
    assert left[0] == pytest.approx(right[0], abs=1.0)


def test_bar_lies_across_the_line_of_sight(box: Any) -> None:
    corners = bar(box(distance=3.0, bearing=math.pi / 2, width=0.8), thickness=0.5)
    np.testing.assert_allclose(
        corners, [[0.4, 3.0], [-0.4, 3.0], [-0.4, 3.5], [0.4, 3.5]], atol=1e-12
    )


def test_free_ground_is_bounded_by_arcs_of_its_range() -> None:
    free = FreeRange(
        bearing=np.array([-0.2, 0.0, 0.4]),
        range=np.array([2.0, np.inf, np.nan]),
        limit=(Limit.OBSTACLE, Limit.UNSEEN, Limit.UNSEEN),
    )
    outline = free_outline(free, farthest=10.0)
    np.testing.assert_allclose(np.hypot(*outline.T), [[2, 10, 0], [2, 10, 0]])
    angles = np.arctan2(outline[:2, :, 1], outline[:2, :, 0])
    np.testing.assert_allclose(angles, [[-0.2, -0.1], [-0.1, 0.2]])


def test_border_of_the_free_ground_has_the_colour_of_what_ends_it(world: Any, rig: Rig) -> None:
    ends = birdseye(world(limit=Limit.OBSTACLE).answer(), rig)
    open_ended = birdseye(world(limit=Limit.UNSEEN).answer(), rig)
    assert len(pixels_of(ends, VERMILLION)) > len(pixels_of(open_ended, VERMILLION)) + 50
    assert len(pixels_of(open_ended, VERMILLION)) == 0


def test_hole_is_hatched_on_its_ground_only(world: Any, rig: Rig, pit: Any) -> None:
    picture = birdseye(world(holes=(pit(bearing=0.0, width=2.0, length=1.5),)).answer(), rig)
    found = pixels_of(picture, HOLE)
    height, foot = 480, round(3.4 * 480 / 36)
    scale = (height - foot) / 6.0
    inside = found[
        (found[:, 0] < 479 - foot - 2.5 * scale) & (found[:, 0] > 479 - foot - 4 * scale)
    ]
    assert 0.2 < len(inside) / (2.0 * 1.5 * scale**2) < 0.6
    assert np.abs(inside[:, 1] - 239.5).max() < 1.0 * scale + 8  # its label's bar beside it


def test_level_camera_sees_the_floor_from_its_lowest_row_on(world: Any, rig: Rig) -> None:
    # bottom row 239: depth f h / (v - cy) = 200 / 119.5, half width cx / f of it
    near_left, far_left, far_right, near_right = visible_floor(world().answer(), rig, farthest=20.0)
    depth = 200 / 119.5
    np.testing.assert_allclose(near_left, [depth, 159.5 / 200 * depth], rtol=1e-9)
    np.testing.assert_allclose(near_right, [depth, -159.5 / 200 * depth], rtol=1e-9)
    np.testing.assert_allclose(far_left, [20.0, 15.95], rtol=1e-9)
    np.testing.assert_allclose(far_right, [20.0, -15.95], rtol=1e-9)


def test_floor_points_undo_the_projection_of_a_tilted_and_displaced_camera(rig: Rig) -> None:
    mount = Mount(height=1.0, pitch=math.radians(8), roll=math.radians(-3), x=0.3, y=-0.1)
    tilted = Rig(camera=rig.camera, mount=mount)
    attitude = camera_attitude(body=Attitude(roll=0.2, pitch=0.05), mount=mount.attitude)
    down = attitude.down()
    plane = rig.camera.projection.plane(height=1.0, down=down)
    level = base_from_optical(down, forward_in_camera(mount.attitude))
    truth = np.array([[3.0, 0.5], [6.0, -1.5]])
    points = np.column_stack([truth - [0.3, -0.1], [-1.0, -1.0]]) @ level
    camera = rig.camera.projection
    u = camera.fx * points[:, 0] / points[:, 2] + camera.cx
    v = camera.fy * points[:, 1] / points[:, 2] + camera.cy
    found = floor_points(np.column_stack([u, v]), camera=camera, plane=plane, rig=tilted)
    np.testing.assert_allclose(found, truth, rtol=1e-9)


@pytest.mark.parametrize(
    ("distance", "reach"), [(3.0, 6.0), (5.6, 10.0), (12.0, 15.0), (36.0, 40.0), (90.0, 40.0)]
)
def test_view_reaches_as_far_as_what_was_found(
    world: Any, box: Any, distance: float, reach: float
) -> None:
    answer = world(obstacles=(box(distance=distance),)).answer()
    assert automatic_reach(answer) == reach


def test_size_is_as_asked_even_with_nothing_to_draw(world: Any, rig: Rig) -> None:
    empty = world(bearing=np.zeros(0), seen=False).answer()
    assert birdseye(empty, rig, size=(300, 200)).shape == (200, 300, 3)


def test_unknown_widths_and_sigmas_are_drawn(world: Any, rig: Rig, box: Any, pit: Any) -> None:
    nan = math.nan
    things = (box(width=nan, sigma_distance=nan, sigma_bearing=nan),)
    answer = world(obstacles=things, holes=(pit(length=nan, kind="drop"),)).answer()
    assert birdseye(answer, rig).shape == (480, 480, 3)

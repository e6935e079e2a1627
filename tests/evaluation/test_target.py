"""What of the truth counts."""

import math
from typing import Any

import numpy as np
import pytest

from bearcub.evaluation.target import Target, corners, face, hole_limits, holes, obstacles
from bearcub.rig import Camera, Mount, Rig

RIG = Rig(
    camera=Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12),
    mount=Mount(height=1.2),
)


def thing(**changes: Any) -> dict[str, Any]:
    return {
        "name": "can",
        "distance": 4.0,
        "bearing_deg": 0.0,
        "width": 0.4,
        "height": 0.7,
        "base_height": 0.0,
        "visible_share": 1.0,
        "truncated": [],
        **changes,
    }


def hole(**changes: Any) -> dict[str, Any]:
    pit = {
        "kind": "pit",
        "distance": 3.0,
        "bearing_deg": 0.0,
        "width": 0.6,
        "length": 0.6,
        "depth": 0.3,
        "depth_seen": 0.2,
    }
    return {**pit, **changes}


def of(found: dict[str, Any]) -> Target:
    truth = {"tilt": {"pitch_deg": 0.0, "roll_deg": 0.0}, "obstacles": [found], "holes": []}
    return obstacles(truth, RIG)[0]


def test_numbers_are_taken_over() -> None:
    target = of(thing(bearing_deg=10.0, passable=True))
    assert target.counts
    assert (target.kind, target.distance, target.width, target.height) == ("can", 4.0, 0.4, 0.7)
    assert target.bearing == pytest.approx(math.radians(10.0))
    assert target.passable


@pytest.mark.parametrize("visible", [0.69, 0.0])
def test_mostly_hidden_things_do_not_count(visible: float) -> None:
    assert of(thing(visible_share=0.71)).counts
    assert "visible" in of(thing(visible_share=visible)).ignored


@pytest.mark.parametrize("distance", [0.9, 12.5])
def test_things_out_of_range_do_not_count(distance: float) -> None:
    assert "out of range" in of(thing(distance=distance)).ignored


def test_things_that_only_the_left_camera_sees_do_not_count() -> None:
    # The left border is 39.6 deg to the left; of a can at 1.2 m the right camera loses 5.4 deg.
    assert of(thing(distance=1.2, bearing_deg=30.0, width=0.2)).counts
    assert "both images" in of(thing(distance=1.2, bearing_deg=37.0, width=0.2)).ignored
    assert of(thing(distance=1.2, bearing_deg=-36.0, width=0.1)).counts


def test_wall_across_the_image_counts_without_a_width() -> None:
    wall = of(thing(name="wall", distance=3.0, width=4.9, truncated=["left", "right"]))
    assert wall.counts
    assert not wall.whole


def test_hole_counts_up_to_its_geometric_limit() -> None:
    truth = {"obstacles": [], "holes": [hole(distance=6.4), hole(distance=6.6), hole(rows=5.0)]}
    assert [target.counts for target in holes(truth, RIG)] == [True, False, False]
    assert "5.0 rows" in holes(truth, RIG)[2].ignored


def test_limit_of_a_hole_is_that_of_its_geometry() -> None:
    rows, jump = hole_limits(RIG, distance=4.0, length=1.0, depth=9.0)
    assert rows == pytest.approx(386 * 1.2 * 1.0 / (4 * 5))
    assert jump == pytest.approx(386 * 0.12 / 4 - 386 * 0.12 / 5)


def test_drop_hides_as_much_as_its_depth_shadows() -> None:
    # seen from 1.2 m, a ledge of 0.3 m at 4 m hides 1 m
    deep = hole_limits(RIG, distance=4.0, length=math.nan, depth=0.3)
    assert deep == pytest.approx(hole_limits(RIG, distance=4.0, length=1.0, depth=9.0))


def test_truth_that_says_little_is_enough() -> None:
    little = {"obstacles": [{"distance": 3.0, "bearing_deg": 1.0, "width": 0.5}]}
    (target,) = obstacles(little, RIG)
    assert target.counts
    assert math.isnan(target.height)
    assert holes(little, RIG) == ()


def test_face_stands_across_the_line_of_sight() -> None:
    target = Target(kind="can", distance=4.0, bearing=math.radians(90.0), width=2.0)
    right, left = face(target, shares=np.array([-0.5, 0.5])).T
    assert right == pytest.approx([1.0, 4.0])
    assert left == pytest.approx([-1.0, 4.0])


def test_outline_is_where_the_camera_sees_it() -> None:
    truth = {"tilt": {"pitch_deg": 0.0, "roll_deg": 0.0}}
    target = Target(kind="can", distance=4.0, bearing=0.0, width=0.8, height=1.2, base_height=0.0)
    u, v = corners(target, truth, RIG).T
    assert u == pytest.approx([358.1, 280.9, 280.9, 358.1])  # 386 * 0.4 / 4 to either side
    assert v == pytest.approx([355.3, 355.3, 239.5, 239.5])  # its top as high as the camera

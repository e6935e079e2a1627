import json
import math
from dataclasses import replace
from typing import Any

import pytest

from bearcub.geometry import Attitude
from bearcub.rig import Mount, Rig
from bearcub.sim import objects, render, scenes
from bearcub.sim.solids import Cone
from bearcub.sim.world import Ground, Scene, Thing

RIG = scenes.paper_rig(width=320, height=240)
LEVEL = replace(RIG, mount=Mount(height=1.2))


def truth(scene: Scene, rig: Rig = RIG, *, roll: float = 0.0, pitch: float = 0.0) -> dict[str, Any]:
    body = Attitude(roll=roll, pitch=pitch)
    return render(scene, rig, body=body, supersample=1).truth


def test_can_has_the_numbers_it_was_built_with() -> None:
    (can,) = truth(scenes.garbage_can())["obstacles"]
    assert can["distance"] == pytest.approx(3.05, abs=1e-6)
    assert can["bearing_deg"] == pytest.approx(2.0, abs=1e-6)
    assert can["height"] == pytest.approx(0.70, abs=1e-6)
    assert can["base_height"] == 0
    # between the touching lines of sight: 0.45 sqrt(1 - (0.225 / 3.275)^2)
    assert can["width"] == pytest.approx(0.44894, abs=1e-5)
    assert (can["visible_share"], can["truncated"]) == (1.0, [])


def test_truth_does_not_depend_on_the_tilt() -> None:
    level, tilted = (truth(scenes.garbage_can(), roll=roll, pitch=-roll / 3) for roll in (0, 0.2))
    for key in ("distance", "bearing_deg", "width", "height"):
        assert level["obstacles"][0][key] == tilted["obstacles"][0][key]


def test_positions_are_in_base_link_of_the_rig() -> None:
    mount = Mount(height=1.2, x=0.4, y=-0.3)
    (can,) = truth(scenes.garbage_can(bearing=0.0), replace(RIG, mount=mount))["obstacles"]
    # centre at (3.275 + 0.4, -0.3)
    assert can["distance"] == pytest.approx(math.hypot(3.675, 0.3) - 0.225, abs=1e-6)
    assert can["bearing_deg"] == pytest.approx(math.degrees(math.atan2(-0.3, 3.675)), abs=1e-4)


def test_turned_box_is_as_wide_as_its_diagonal() -> None:
    (box,) = truth(scenes.small_box(distance=2.5, yaw=math.radians(45)))["obstacles"]
    assert box["width"] == pytest.approx(0.1 * math.sqrt(2), abs=1e-6)
    assert box["distance"] == pytest.approx(2.55 - 0.05 * math.sqrt(2), abs=1e-6)
    assert box["height"] == pytest.approx(0.1)


def test_branch_hangs_over_the_ground() -> None:
    (branch,) = truth(scenes.branch(distance=3.0, base=0.9))["obstacles"]
    assert branch["base_height"] == pytest.approx(0.9)
    assert branch["height"] == pytest.approx(1.02)
    assert branch["width"] == pytest.approx(1.6)


def test_height_counts_from_the_ground_at_the_foot() -> None:
    ground = Ground(texture=scenes.ASPHALT, pieces=((2.0, 0.0, 0.1),))
    scene = Scene(ground=ground, things=(scenes.can(4.0, 0.5, ground=ground),))
    (can,) = truth(scene)["obstacles"]
    assert can["height"] == pytest.approx(0.70)
    assert can["base_height"] == pytest.approx(0.0)


def test_wall_is_as_wide_as_the_image_shows() -> None:
    (wall,) = truth(scenes.wall(distance=3.0), LEVEL)["obstacles"]
    assert wall["truncated"] == ["left", "right", "top"]
    # 319 columns of f = 193 px at 3 m, and 119.5 rows up from the camera's height
    assert wall["width"] == pytest.approx(3 * 319 / 193, abs=1e-5)
    assert wall["height"] == pytest.approx(1.2 + 3 * 119.5 / 193, abs=1e-5)
    assert wall["distance"] == pytest.approx(3.0)


def test_half_hidden_can_says_so_and_keeps_what_shows() -> None:
    near, far = truth(scenes.two_cans(near=2.5, far=4.5))["obstacles"]
    assert (near["name"], near["visible_share"]) == ("low can", 1.0)
    assert far["visible_share"] == pytest.approx(0.65, abs=0.05)
    assert (far["distance"], far["height"]) == (pytest.approx(4.5), pytest.approx(1.1))


def test_hidden_thing_is_left_out() -> None:
    ground = Ground(texture=scenes.ASPHALT)
    front = scenes.can(2.5, 0.0, ground=ground, radius=0.3, height=1.2)
    back = scenes.can(4.0, 0.0, ground=ground, radius=0.1, height=0.3)
    found = truth(Scene(ground=ground, things=(front, back)))["obstacles"]
    assert [can["id"] for can in found] == [1]


def test_can_cut_by_the_border_is_as_wide_as_it_shows() -> None:
    (can,) = truth(scenes.garbage_can(bearing=math.radians(38.5)), LEVEL)["obstacles"]
    assert can["truncated"] == ["left"]
    assert 0.1 < can["width"] < 0.4


def test_pit_is_given_whole_with_the_depth_that_shows() -> None:
    (pit,) = truth(scenes.pit(distance=2.5, width=0.8, length=0.6, depth=0.4))["holes"]
    assert (pit["kind"], pit["id"]) == ("pit", -1)
    assert (pit["distance"], pit["width"], pit["length"], pit["depth"]) == (2.5, 0.8, 0.6, 0.4)
    # over the lip at 2.5 m the far wall is seen down to 1.2 * 0.6 / 2.5 = 0.288 m
    assert pit["depth_seen"] == pytest.approx(0.288, abs=0.016)  # a row is 3.1 m / 193


def test_pit_to_the_side_is_nearest_at_its_corner() -> None:
    (pit,) = truth(scenes.pit(distance=2.5, y=0.8))["holes"]
    assert (pit["x"], pit["y"]) == (2.5, pytest.approx(0.4))
    assert pit["bearing_deg"] > 0


def test_pit_behind_a_thing_is_partly_hidden() -> None:
    scene = scenes.pit(distance=2.5, width=0.8)
    free = truth(scene)["holes"][0]
    can = scenes.can(1.9, 0.0, ground=scene.ground)
    hidden = truth(Scene(ground=scene.ground, things=(can,)))["holes"][0]
    assert free["visible_share"] == 1.0
    assert 0.1 < hidden["visible_share"] < 0.7


def test_drop_has_no_length_and_the_width_of_its_lip() -> None:
    (drop,) = truth(scenes.drop(distance=3.0, depth=0.5), LEVEL)["holes"]
    assert (drop["kind"], drop["length"], drop["depth"]) == ("drop", None, 0.5)
    assert drop["distance"] == pytest.approx(3.0)
    assert drop["width"] == pytest.approx(3 * 319 / 193, abs=1e-5)


def test_terrain_is_the_mean_slope_from_1_5_to_5_m() -> None:
    terrain = truth(scenes.ramp(start=3.25, slope=math.atan(0.2)))["terrain"]
    assert terrain["slope_deg"] == pytest.approx(math.degrees(math.atan(0.1)), abs=1e-5)
    steep = math.degrees(math.atan(0.2))
    assert [band["slope_deg"] for band in terrain["profile"]] == pytest.approx(
        [0, 0, 0, math.degrees(math.atan(0.1)), steep, steep, steep], abs=1e-5
    )
    assert truth(scenes.kerb())["terrain"]["slope_deg"] == 0


def test_ground_is_the_camera_against_what_it_stands_over() -> None:
    level = truth(scenes.floor(), roll=math.radians(12))
    assert level["ground"]["height"] == pytest.approx(1.2)
    # a body rolled by 12 deg with a camera 5.9 deg down
    assert level["ground"]["pitch_deg"] == pytest.approx(5.77, abs=0.005)
    assert level["ground"]["roll_deg"] == pytest.approx(12.06, abs=0.005)
    assert level["tilt"] == {"pitch_deg": 0.0, "roll_deg": pytest.approx(12.0)}
    rising_left = truth(scenes.cross_slope(slope=math.radians(6)), LEVEL)
    assert rising_left["ground"]["roll_deg"] == pytest.approx(-6.0)
    assert rising_left["ground"]["height"] == pytest.approx(1.2 * math.cos(math.radians(6)))
    assert rising_left["terrain"]["cross_slope_deg"] == pytest.approx(6.0)


def test_cone_is_as_wide_as_its_foot() -> None:
    part = Cone(x=3.0, y=0.0, bottom=0.0, height=0.8, radii=(0.5, 0.1), texture=scenes.WOOD)
    thing = Thing(name="cone", foot=(3.0, 0.0), parts=(part,))
    (cone,) = truth(Scene(ground=Ground(texture=scenes.ASPHALT), things=(thing,)))["obstacles"]
    assert (cone["distance"], cone["height"]) == (pytest.approx(2.5), pytest.approx(0.8))
    assert cone["width"] == pytest.approx(math.sqrt(1 - (0.5 / 3) ** 2), abs=1e-6)
    assert cone["visible_share"] == 1.0


def test_kerb_is_one_obstacle_as_wide_as_it_is_seen() -> None:
    (kerb,) = truth(scenes.kerb(distance=3.0, height=0.12), LEVEL)["obstacles"]
    assert (kerb["name"], kerb["id"], kerb["passable"]) == ("step", 1, False)
    assert kerb["distance"] == pytest.approx(3.0)
    assert kerb["bearing_deg"] == pytest.approx(0.0, abs=1e-6)
    assert kerb["width"] == pytest.approx(3 * 319 / 193, abs=1e-5)
    assert (kerb["height"], kerb["base_height"]) == (pytest.approx(0.12), 0.0)
    assert kerb["truncated"] == ["left", "right"]


def test_kerb_on_a_cross_slope_has_its_own_height() -> None:
    ground = Ground(texture=scenes.CONCRETE, pieces=((3.0, 0.15, 0.0),), cross=0.1)
    (kerb,) = truth(Scene(ground=ground), LEVEL)["obstacles"]
    assert kerb["height"] == pytest.approx(0.15, abs=1e-6)


@pytest.mark.parametrize(
    "piece",
    [
        (3.0, 0.09, 0.0),  # a step of 9 cm
        (3.0, 0.0, math.tan(math.radians(15))),  # the steepest ramp
        (3.0, 0.0, math.tan(math.radians(29.9))),
        (3.0, -0.5, 0.0),  # a drop is a hole
    ],
)
def test_what_a_robot_may_drive_on_is_no_obstacle(piece: tuple[float, float, float]) -> None:
    assert truth(Scene(ground=Ground(texture=scenes.SOIL, pieces=(piece,))))["obstacles"] == []


def test_bank_steeper_than_30_deg_is_an_obstacle_at_its_foot() -> None:
    slope = math.tan(math.radians(45))
    ground = Ground(texture=scenes.SOIL, pieces=((3.0, 0.0, slope), (3.8, 0.0, 0.0)))
    can = scenes.can(2.0, 0.8, ground=ground)
    found = truth(Scene(ground=ground, things=(can,)), LEVEL)["obstacles"]
    assert [(thing["id"], thing["name"]) for thing in found] == [(1, "can"), (2, "bank")]
    assert found[1]["distance"] == pytest.approx(3.0)
    assert found[1]["height"] == pytest.approx(0.8)
    assert found[1]["visible_share"] < 1.0  # the can hides some of it


def test_bank_that_the_image_cuts_is_as_high_as_it_shows() -> None:
    ground = Ground(texture=scenes.SOIL, pieces=((3.0, 0.0, 1.0),))
    (bank,) = truth(Scene(ground=ground), LEVEL)["obstacles"]
    assert bank["truncated"] == ["left", "right", "top"]
    # z = x - 3 meets the top row's 1.2 + x m, m = 119.5 / 193, at x = 4.2 / (1 - m)
    assert bank["height"] == pytest.approx(4.2 / (1 - 119.5 / 193) - 3, abs=1e-4)


def test_what_hangs_higher_than_the_robot_is_passable() -> None:
    ground = Ground(texture=scenes.TILES)
    things = objects.table(3.0, 0.0, ground=ground)
    for clearance, passable in ((0.6, True), (0.75, False)):
        scene = Scene(ground=ground, things=things, clearance=clearance)
        found = truth(scene)["obstacles"]
        tops = [thing for thing in found if thing["name"] == "table top"]
        legs = [thing for thing in found if thing["name"] == "table leg"]
        assert [top["passable"] for top in tops] == [passable]
        assert [leg["passable"] for leg in legs] == [False] * len(legs)


def test_field_of_view_is_that_of_the_whole_image() -> None:
    fov = truth(scenes.floor())["fov"]
    # 320 columns of f = 193 px, of which 160 lie on either side
    assert fov["horizontal_deg"] == pytest.approx(2 * math.degrees(math.atan(160 / 193)))
    assert fov["left_deg"] == -fov["right_deg"] == pytest.approx(0.5 * fov["horizontal_deg"])
    assert fov["vertical_deg"] == pytest.approx(2 * math.degrees(math.atan(120 / 193)))


def test_pit_tells_how_many_rows_of_its_far_wall_can_show() -> None:
    (pit,) = truth(scenes.pit(distance=2.5, width=0.8, length=0.6, depth=0.4))["holes"]
    assert pit["rows"] == pytest.approx(193 * 1.2 * 0.6 / (2.5 * 3.1), abs=1e-5)
    assert truth(scenes.drop(), LEVEL)["holes"][0]["rows"] is None


@pytest.mark.parametrize("name", ["garbage_can", "pit", "drop", "posts", "table", "wall"])
def test_truth_is_json(name: str) -> None:
    found = truth(getattr(scenes, name)())
    assert json.loads(json.dumps(found, allow_nan=False)) == found

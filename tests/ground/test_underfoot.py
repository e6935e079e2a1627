"""Before a step the floor is the ground under the robot, not the higher or lower ground in view."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from bearcub.messages import Answer, Float32
from bearcub.rig import Rig
from bearcub.sim import Rendered, scenes
from bearcub.sim.solids import Box
from bearcub.sim.world import Scene, Thing

Shot = Callable[..., Rendered]
Noisy = Callable[..., Float32]
Look = Callable[..., Answer]

EDGE = 1.6  # from the robot to the step down [m]; the image begins 1.35 m ahead


@pytest.mark.parametrize("depth", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("roll", [0.0, 5.0])
def test_the_edge_of_a_step_down_is_floor_and_what_lies_below_a_drop(
    shot: Shot, noisy: Noisy, look: Look, depth: float, roll: float
) -> None:
    frame = shot(scenes.drop(distance=EDGE, depth=depth), roll=roll)
    answer = look(noisy(frame.disparity, 0.2), roll=roll, pitch=0.0)
    assert answer.ground.height == pytest.approx(1.2, abs=0.03)
    assert math.degrees(answer.ground.roll) == pytest.approx(roll, abs=0.5)
    assert answer.obstacles == ()
    (drop,) = answer.holes
    assert drop.kind == "drop"
    assert drop.distance == pytest.approx(EDGE, abs=0.05)


@pytest.mark.parametrize(("distance", "height"), [(EDGE, 0.2), (EDGE, 0.3), (2.3, 0.3)])
def test_before_a_step_up_the_ground_behind_it_is_not_the_floor(
    shot: Shot, noisy: Noisy, look: Look, distance: float, height: float
) -> None:
    frame = shot(scenes.kerb(distance=distance, height=height), roll=5.0)
    answer = look(noisy(frame.disparity, 0.2), roll=5.0, pitch=0.0)
    assert answer.ground.height == pytest.approx(1.2, abs=0.03)
    assert answer.holes == ()
    (step,) = answer.obstacles
    assert step.distance == pytest.approx(distance, abs=0.05)
    assert step.height == pytest.approx(height, abs=0.03)


def test_a_camera_mounted_higher_than_stated_stands_over_no_step(
    shot: Shot, noisy: Noisy, look: Look, rig: Rig
) -> None:
    frame = shot(scenes.floor(), by=replace(rig, mount=replace(rig.mount, height=1.6)))
    answer = look(noisy(frame.disparity, 0.2), roll=0.0, pitch=0.0)
    assert answer.ground.height == pytest.approx(1.6, abs=0.03)


def test_a_low_platform_in_the_way_is_an_obstacle_at_the_mounted_height(
    shot: Shot, noisy: Noisy, look: Look
) -> None:
    platform = Box(x=1.4, y=0.0, bottom=0.0, size=(0.3, 3.0, 0.2), texture=scenes.WOOD)
    scene = Scene(
        ground=scenes.floor().ground,
        things=(Thing(name="platform", foot=(1.25, 0.0), parts=(platform,)),),
    )
    answer = look(noisy(shot(scene).disparity, 0.2), roll=0.0, pitch=0.0)
    assert answer.ground.height == pytest.approx(1.2, abs=0.03)
    assert [round(thing.height, 1) for thing in answer.obstacles] == [0.2]

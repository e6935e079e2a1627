"""The 2005 method in the pipeline's place."""

import math

import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.errors import InputError
from bearcub.messages import Float32, Pixel, Snapshot, Tilt
from bearcub.rig import Camera, Mount, Rig
from bearcub.runtime.classic import ClassicPipeline
from bearcub.sim.scenes import paper_rig

RIG = paper_rig()


def _floor_with_board(rig: Rig) -> Float32:
    """The paper's floor, and a board of 40 x 100 px at level 15: 386 * 0.12 / 15 = 3.09 m."""
    a, b, c = rig.camera.projection.plane(height=rig.mount.height, down=rig.mount.attitude.down())
    v, u = np.mgrid[:480, :640]
    disparity: Float32 = np.maximum(a * u + b * v + c, 0.0).astype(np.float32)
    disparity[250:350, 300:340] = 15.4
    return disparity


def test_a_board_is_where_its_level_says() -> None:
    answer = ClassicPipeline(RIG).process(Snapshot(disparity=_floor_with_board(RIG)))
    (board,) = answer.obstacles
    depth = 386 * 0.12 / 15
    # Looking 5.9 deg down, the middle row 299.5 lies 8.8 deg below the axis.
    angle = math.radians(5.9) + math.atan2(299.5 - 239.5, 386)
    ahead = depth / math.cos(angle - math.radians(5.9)) * math.cos(angle)
    assert board.x == pytest.approx(ahead, abs=0.01)
    assert board.width == pytest.approx(40 * depth / 386, abs=0.01)
    assert board.box[0] == 300
    assert board.box[2] == 339
    assert math.isnan(board.sigma_distance)
    assert answer.ground.pitch == pytest.approx(math.radians(5.9))
    assert not answer.ground.seen
    kind = answer.layers.kind
    assert kind[300, 320] == Pixel.OBSTACLE
    assert answer.layers.labels[300, 320] == 1
    assert (kind[260:, :200] == Pixel.FLOOR).mean() > 0.99


def test_tilt_moves_the_floor_that_is_cancelled() -> None:
    level = _floor_with_board(RIG)
    pipeline = ClassicPipeline(RIG)
    tilted = pipeline.process(
        Snapshot(disparity=level, tilt=Tilt(pitch=math.radians(8.0), roll=0.0))
    )
    floor = pipeline.process(Snapshot(disparity=level)).layers.kind == Pixel.FLOOR
    assert (tilted.layers.kind == Pixel.FLOOR).sum() < 0.5 * floor.sum()
    assert tilted.terrain.reference == "gravity"
    assert tilted.ground.source == "tilt"


def test_objects_at_the_border_are_marked() -> None:
    disparity = np.zeros((480, 640), dtype=np.float32)
    disparity[100:200, 600:] = 15.0
    (board,) = ClassicPipeline(RIG).process(Snapshot(disparity=disparity)).obstacles
    assert board.truncated == ("right",)


def test_timing_comes_from_the_clock_given() -> None:
    answer = ClassicPipeline(RIG, clock=ManualClock()).process(
        Snapshot(disparity=_floor_with_board(RIG))
    )
    assert answer.timing.total == 0.0
    assert math.isnan(answer.timing.ground)


def test_a_snapshot_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="a left and a right image, or a disparity map"):
        ClassicPipeline(RIG).process(Snapshot())


def test_a_mount_beside_the_origin_moves_the_obstacles() -> None:
    camera = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
    mount = Mount(height=1.2, pitch=RIG.mount.pitch, x=0.5, y=-0.25)
    snapshot = Snapshot(disparity=_floor_with_board(RIG))
    here = ClassicPipeline(RIG).process(snapshot).obstacles[0]
    moved = ClassicPipeline(Rig(camera=camera, mount=mount)).process(snapshot).obstacles[0]
    assert moved.x - here.x == pytest.approx(0.5)
    assert moved.y - here.y == pytest.approx(-0.25)

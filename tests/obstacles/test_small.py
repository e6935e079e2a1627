"""A box of 10 cm, of which a matcher shows nothing, is found in the images, and paint is not."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from bearcub.geometry import (
    Attitude,
    Float64,
    Projection,
    base_from_optical,
    forward_in_camera,
)
from bearcub.ground.surface import Surface
from bearcub.messages import DisparityMap, Float32, Ground, Limit, Snapshot, UInt8
from bearcub.obstacles.cloud import View
from bearcub.obstacles.joining import Thing
from bearcub.obstacles.parallax import Foot, feet
from bearcub.obstacles.small import small_things
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.upright import Scene, Upright, likeliest
from bearcub.obstacles.verify import Witness
from bearcub.pipeline import Pipeline
from bearcub.rig.model import Camera, Mount, Rig

SHAPE = (200, 320)
# level, 1.2 m above a floor of ten rows per level; 12 px are 4 m, and 10 px there are 10 cm
CAMERA = Projection(fx=400.0, fy=400.0, cx=159.5, cy=20.0, baseline=0.12)
BOX = np.s_[131:141, 200:210]
FOOT = Foot(u=205, v=140, level=12.0, sure=10.0)
ROWS = np.maximum(0.1 * np.arange(SHAPE[0], dtype=np.float32) - 2.0, 0)  # the floor's disparity
FLOOR = np.repeat(ROWS[:, None], SHAPE[1], axis=1)


def pictures(
    rows: Float32 = ROWS, *, box: bool = False, paint: bool = False, gain: float = 1.0
) -> Witness:
    """Return a textured pair whose rows have these disparities.

    On it stands a dark box of 10 cm, 4 m ahead, or is painted where it would stand; the left
    camera sees `gain` times as much.
    """
    rng = np.random.default_rng(5)
    left = 110.0 + _texture(SHAPE, 1.5, rng)
    dark = 60.0 + _texture((10, 10), 1.0, rng)
    if paint:
        left[BOX] = dark
    columns = np.arange(SHAPE[1])
    shifted = [np.interp(columns + d, columns, row) for d, row in zip(rows, left, strict=True)]
    right = np.array(shifted, dtype=np.float64)
    if box:
        left[BOX] = dark
        right[131:141, 188:198] = dark
    return Witness(left=_taken(gain * left, rng), right=_taken(right, rng))


def _texture(shape: tuple[int, int], grain: float, rng: np.random.Generator) -> Float64:
    return np.asarray(cv2.GaussianBlur(rng.normal(0, 50, shape), (0, 0), grain), dtype=np.float64)


def _taken(image: Float64, rng: np.random.Generator) -> UInt8:
    """Return an image as a camera takes it: a little blurred, with noise."""
    blurred = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0, 2, SHAPE)
    shown: UInt8 = np.clip(blurred, 0, 255).astype(np.uint8)
    return shown


@pytest.fixture
def surface(sure_ground: Ground) -> Surface:
    return Surface.of(sure_ground, SHAPE)


def stands(witness: Witness, surface: Surface) -> Upright | None:
    scene = Scene(witness=witness, surface=surface, projection=CAMERA, offset=0.0)
    return scene.standing(FOOT)


def found(
    witness: Witness | None, ground: Ground, known: list[Thing], *, seen: Float32 = FLOOR
) -> list[Thing]:
    """Return the small things over a map that shows the floor alone."""
    sorter = Sorter.of(seen, ground, sigmas=2.0, unevenness=0.01, farthest_level=1.0)
    level = Attitude(roll=0.0, pitch=0.0)
    view = View(
        projection=CAMERA,
        base_from_optical=base_from_optical(level.down(), forward_in_camera(level)),
        origin=np.array([0.0, 0.0, ground.height]),
    )
    return small_things(
        known, witness, sorter, view, offset=0.0, least_height=0.09, least_area=0.003, bias=0.15
    )


@pytest.mark.parametrize("gain", [1.0, 1.3])
def test_a_small_box_shows_at_its_foot_to_unequal_cameras_too(
    surface: Surface, gain: float
) -> None:
    witness = pictures(box=True, gain=gain)
    first = feet(witness.left, witness.right, surface, baseline=0.12, offset=0.0)[0]
    assert abs(first.u - 205) <= 6
    assert abs(first.v - 140) <= 4


def test_it_shows_as_well_where_disparities_have_an_offset(sure_ground: Ground) -> None:
    witness = pictures(box=True)
    farther = replace(sure_ground, plane=sure_ground.plane + np.array([0.0, 0.0, 3.0]))
    surface = Surface.of(farther, SHAPE)
    first = feet(witness.left, witness.right, surface, baseline=0.12, offset=3.0)[0]
    assert abs(first.u - 205) <= 6


def test_paint_shows_nothing_to_unequal_cameras_either(surface: Surface) -> None:
    witness = pictures(paint=True, gain=1.15)
    assert feet(witness.left, witness.right, surface, baseline=0.12, offset=0.0) == []
    assert stands(witness, surface) is None


def test_a_box_is_as_large_as_the_images_show(surface: Surface) -> None:
    box = stands(pictures(box=True), surface)
    assert box is not None
    assert box.disparity == pytest.approx(12.0, abs=0.15)
    # a pixel of blur, and one of parallax at its left
    assert (box.left, box.right) == pytest.approx((200, 209), abs=2)
    assert (box.top, box.foot) == pytest.approx((131, 140), abs=2)
    assert box.alone


def test_a_kerb_from_side_to_side_is_no_small_thing(surface: Surface) -> None:
    kerb = ROWS.copy()
    kerb[131:141] = 12.0
    assert stands(pictures(kerb), surface) is None


def test_ground_that_rises_beyond_what_the_floor_follows_is_no_thing(surface: Surface) -> None:
    ramp = ROWS + np.float32(0.6)
    assert stands(pictures(ramp, paint=True), surface) is None


def test_the_likeliest_rectangle_is_the_one_with_the_largest_sum() -> None:
    ratio = np.random.default_rng(2).normal(-0.2, 1.0, (6, 7))
    sums = {
        (top, left, right): ratio[top:, left : right + 1].sum()
        for top in range(6)
        for left in range(7)
        for right in range(left, 7)
    }
    best = max(sums, key=lambda key: sums[key])
    gain, *rectangle = likeliest(ratio)
    assert tuple(rectangle) == best
    assert gain == pytest.approx(sums[best])


def test_a_small_box_has_its_size_and_place(sure_ground: Ground) -> None:
    (thing,) = found(pictures(box=True), sure_ground, [])
    extent = thing.extent
    assert extent.distance == pytest.approx(math.hypot(4.0, 0.45), rel=0.02)
    assert extent.bearing == pytest.approx(math.atan2(-45.0, 400.0), abs=2 / 400)
    assert extent.width == pytest.approx(0.10, abs=0.02)
    assert extent.top == pytest.approx(0.10, abs=0.02)


def test_what_is_known_is_not_told_twice(sure_ground: Ground) -> None:
    witness = pictures(box=True)
    known = found(witness, sure_ground, [])
    assert found(witness, sure_ground, known) == []


def test_nothing_stands_where_no_floor_is_seen_around_it(sure_ground: Ground) -> None:
    unseen = np.full_like(FLOOR, np.nan)
    assert found(pictures(box=True), sure_ground, [], seen=unseen) == []


def test_without_images_there_is_no_more_to_tell(sure_ground: Ground) -> None:
    assert found(None, sure_ground, []) == []


def test_the_answer_has_what_the_matcher_does_not_show() -> None:
    camera = Camera(
        width=320, height=200, fx=400.0, fy=400.0, cx=159.5, cy=20.0, baseline=0.12, doffs=0.0
    )
    rig = Rig(camera=camera, mount=Mount(height=1.2, pitch=0.0))
    witness = pictures(box=True)
    noise = np.random.default_rng(1).normal(0, 0.1, SHAPE).astype(np.float32)
    seen = np.where(FLOOR > 0, np.maximum(FLOOR + noise, 0.01), 0).astype(np.float32)
    matched = DisparityMap(disparity=seen, largest=60.0, left=witness.left, right=witness.right)
    snapshot = Snapshot(left=witness.left, right=witness.right)
    answer = Pipeline(rig).answer(snapshot, matched)
    (box,) = answer.obstacles
    assert box.distance == pytest.approx(4.0, abs=0.15)
    assert answer.layers.labels[136, 205] == box.id
    ahead = int(np.abs(answer.free_range.bearing - box.bearing).argmin())
    assert answer.free_range.limit[ahead] == Limit.OBSTACLE
    assert answer.free_range.range[ahead] == pytest.approx(4.0, abs=0.3)

"""MuJoCo's pictures against the ray caster's, which is exact."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from bearcub.errors import ConfigError
from bearcub.geometry import Attitude
from bearcub.messages import Bool, Float32, UInt8
from bearcub.sim import Rendered, scenes
from bearcub.sim import render as cast_rays
from bearcub.sim.mujoco import Studio, render
from bearcub.sim.objects import traffic_cone
from bearcub.sim.sensor import Strength
from bearcub.sim.world import Ground, Scene

RIG = scenes.paper_rig(width=160, height=120)
FB = RIG.camera.fx * RIG.camera.baseline
LEVEL = Attitude(roll=0.0, pitch=0.0)
TILTED = Attitude(roll=math.radians(10), pitch=math.radians(-4))


def _step(height: float) -> Scene:
    ground = Ground(texture=scenes.CONCRETE, cross=0.05, pieces=((3.0, height, 0.0),))
    return Scene(ground=ground)


def _cone() -> Scene:
    ground = Ground(texture=scenes.ASPHALT)
    return Scene(ground=ground, things=(traffic_cone(2.0, 0.2, ground=ground),))


SCENES: dict[str, Callable[[], Scene]] = {
    "garbage_can": scenes.garbage_can,
    "pit": scenes.pit,
    "table": scenes.table,
    "branch": scenes.branch,
    "ramp": scenes.ramp,
    "cross_slope": scenes.cross_slope,
    "step": lambda: _step(0.12),
    "drop": lambda: _step(-0.3),
    "cone": _cone,
}


@cache
def both(name: str, body: Attitude = LEVEL) -> tuple[Rendered, Rendered]:
    scene = SCENES[name]()
    return cast_rays(scene, RIG, body=body), render(scene, RIG, body=body)


@pytest.mark.parametrize("name", SCENES)
def test_pictures_look_like_the_ray_casters(name: str) -> None:
    slow, fast = both(name)
    for one, other in ((slow.left, fast.left), (slow.right, fast.right)):
        off = np.abs(one.astype(int) - other)
        # a mirrored, shifted or wrongly lit picture is off by 10 and more
        assert off.mean() < 3.5
        assert abs(float(one.mean()) - float(other.mean())) < 1.5


def test_pictures_of_a_tilted_robot_look_like_the_ray_casters() -> None:
    slow, fast = both("pit", TILTED)
    assert np.abs(slow.left.astype(int) - fast.left).mean() < 3.5
    assert np.abs(slow.right.astype(int) - fast.right).mean() < 3.5


def _shift(one: UInt8, other: UInt8, region: Bool) -> tuple[float, float]:
    """Return by how much `other` is shifted against `one` (to the right, down) [px]."""
    a, b = (cv2.GaussianBlur(x.mean(axis=2), (0, 0), 1.0) for x in (one, other))
    dy, dx = np.gradient(a)
    slopes = np.stack([dx[region], dy[region]], axis=1)
    u, v = np.linalg.lstsq(slopes, -(b - a)[region], rcond=None)[0]
    return float(u), float(v)


@pytest.mark.parametrize("name", ["garbage_can", "table", "step"])
def test_pictures_lie_on_the_ray_casters_within_a_thirtieth_of_a_pixel(name: str) -> None:
    slow, fast = both(name)
    near = slow.disparity > FB / 3  # farther off, filters blur what they should compare
    for one, other in ((slow.left, fast.left), (slow.right, fast.right)):
        assert math.hypot(*_shift(one, other, near)) < 1 / 30


@pytest.mark.parametrize("name", SCENES)
def test_truth_is_the_ray_casters_to_the_last_bit(name: str) -> None:
    slow, fast = both(name, TILTED if name == "pit" else LEVEL)
    np.testing.assert_array_equal(fast.disparity, slow.disparity)
    np.testing.assert_array_equal(fast.labels, slow.labels)
    assert fast.truth == slow.truth


def test_a_silhouette_is_where_the_labels_say() -> None:
    """The can is the only thing that changes between two pictures without shadows."""
    scene = replace(scenes.garbage_can(), shadows=False)
    with_can = render(scene, RIG)
    without = render(replace(scene, things=()), RIG)
    changed = np.abs(with_can.left.astype(int) - without.left).max(axis=2) > 0
    can = with_can.labels == 1
    grown = cv2.dilate(can.astype(np.uint8), np.ones((3, 3))) > 0
    assert not (changed & ~grown).any()
    assert (changed & can).sum() > 0.97 * can.sum()


def _matched(pair: Rendered) -> Float32:
    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (pair.left, pair.right))
    matcher = cv2.StereoSGBM.create(0, 48, 5, 200, 800, 1, 10, 10, 100, 2, cv2.STEREO_SGBM_MODE_HH)
    found = matcher.compute(left, right).astype(np.float32) / 16
    return np.where(found > 0, found, np.float32(np.nan))


@pytest.mark.parametrize("noise", [None, "medium"])
def test_a_matcher_finds_the_exact_disparity(noise: Strength | None) -> None:
    rig = scenes.paper_rig()
    frame = render(scenes.garbage_can(), rig, noise=noise, seed=3)
    off = _matched(frame) - frame.disparity
    z = rig.camera.fx * rig.camera.baseline / np.maximum(frame.disparity, 1e-6)
    floor = (frame.labels == 0) & (z < 6)
    for region, spread in ((floor, 0.15), (frame.labels == 1, 0.35)):
        there = off[region & np.isfinite(off)]
        assert there.size > 0.8 * region.sum()
        assert np.median(np.abs(there)) < spread
    assert abs(np.nanmedian(off[floor])) < 0.1


def test_the_same_seed_takes_the_same_picture_twice() -> None:
    scene = scenes.two_cans()
    with Studio(scene, RIG) as studio:
        first = studio.shot(noise="medium", seed=7)
        studio.shot(body=TILTED)
        again = studio.shot(noise="medium", seed=7)
        other = studio.shot(noise="medium", seed=8)
    anew = render(scene, RIG, noise="medium", seed=7)
    for repeated in (again, anew):
        np.testing.assert_array_equal(repeated.left, first.left)
        np.testing.assert_array_equal(repeated.right, first.right)
    assert (other.left != first.left).any()


def test_two_studios_do_not_disturb_each_other() -> None:
    one, other = scenes.pit(), scenes.branch()
    with Studio(one, RIG) as first:
        alone = first.shot()
        with Studio(other, RIG) as second:
            second.shot()
            beside = first.shot()
        second.close()
        after = first.shot()
    for frame in (beside, after):
        np.testing.assert_array_equal(frame.left, alone.left)


def test_an_off_centre_principal_point_moves_the_picture() -> None:
    camera = replace(RIG.camera, cx=RIG.camera.cx + 8, cy=RIG.camera.cy - 5, doffs=4.0)
    rig = replace(RIG, camera=camera)
    slow, fast = cast_rays(scenes.garbage_can(), rig), render(scenes.garbage_can(), rig)
    for one, other in ((slow.left, fast.left), (slow.right, fast.right)):
        assert math.hypot(*_shift(one, other, slow.disparity > FB / 3)) < 1 / 30


def test_oblong_pixels_are_refused_in_one_sentence() -> None:
    rig = replace(RIG, camera=replace(RIG.camera, fy=1.2 * RIG.camera.fx))
    with pytest.raises(ConfigError, match="square pixels"):
        Studio(scenes.floor(), rig)

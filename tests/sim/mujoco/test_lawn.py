"""Standing grass hides what is behind it, and its disparity is the blades' own."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bearcub.messages import Float64
from bearcub.sim import Rendered, scenes
from bearcub.sim import render as cast_rays
from bearcub.sim.grass import Grass
from bearcub.sim.light import Light
from bearcub.sim.mujoco import render
from bearcub.sim.mujoco.lawn import lawns
from bearcub.sim.render import LEVEL, View
from bearcub.sim.world import Pit, Scene

RIG = scenes.paper_rig(width=240, height=180)
PATCH = Grass(height=0.15, density=150, x0=1.5, x1=5.0, y0=-1.5, y1=1.5, seed=2)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return replace(scenes.garbage_can(), grass=(PATCH,))


@pytest.fixture(scope="module")
def frame(scene: Scene) -> Rendered:
    return render(scene, RIG)


def _nearest_blade(scene: Scene, view: View, u: int, v: int) -> float:
    """Return the depth of the nearest triangle along one ray (Möller and Trumbore, 1997)."""
    grown = lawns(scene, Light(), seed=0)[0]
    ray: Float64 = view.rays(np.array([float(u)]), np.array([float(v)]))[:, 0]
    a, b, c = (grown.vertices[grown.faces[:, corner]] for corner in range(3))
    one, two = b - a, c - a
    p = np.cross(ray, two)
    with np.errstate(all="ignore"):
        scale = 1.0 / (one * p).sum(axis=1)
        off = view.position - a
        s = (off * p).sum(axis=1) * scale
        q = np.cross(off, one)
        t = (ray * q).sum(axis=1) * scale
        depth = (two * q).sum(axis=1) * scale
    met = (s >= 0) & (t >= 0) & (s + t <= 1) & (depth > 0)
    return float(depth[met].min()) if met.any() else np.inf


def test_disparity_is_that_of_the_blade_a_ray_meets(scene: Scene, frame: Rendered) -> None:
    bare = cast_rays(scene, RIG, supersample=1)
    view, fb = View.of(RIG, LEVEL), RIG.camera.fx * RIG.camera.baseline
    rng = np.random.default_rng(0)
    blades = 0
    for u, v in zip(rng.integers(30, 210, 300), rng.integers(82, 176, 300), strict=True):
        depth = _nearest_blade(scene, view, u, v)
        behind = fb / bare.disparity[v, u] if bare.disparity[v, u] > 0 else np.inf
        # a blade's edge may fall on either side of a ray through it within float32
        expected = fb / min(depth, behind)
        assert frame.disparity[v, u] == pytest.approx(expected, abs=2e-3)
        blades += depth < behind
    assert blades > 20


def test_blades_are_ground_and_hide_what_they_cover(scene: Scene, frame: Rendered) -> None:
    bare = cast_rays(scene, RIG, supersample=1)
    covered = frame.disparity > bare.disparity
    assert 0.05 < covered.mean() < 0.5
    assert (frame.labels[covered] == 0).all()
    np.testing.assert_array_equal(frame.labels[~covered], bare.labels[~covered])
    (hidden,), (whole,) = frame.truth["obstacles"], bare.truth["obstacles"]
    assert whole["visible_share"] == 1.0
    assert 0.8 < hidden["visible_share"] < 1.0


def test_a_matcher_sees_the_floor_of_grass_above_the_soil() -> None:
    rig = scenes.paper_rig()
    lawn = replace(PATCH, density=300, x0=1.0, x1=8.0, y0=-4.0, y1=4.0)
    frame = render(replace(scenes.floor(texture=scenes.GRASS), grass=(lawn,)), rig)
    left, right = (cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in (frame.left, frame.right))
    matcher = cv2.StereoSGBM.create(0, 48, 5, 200, 800, 1, 10, 10, 100, 2, cv2.STEREO_SGBM_MODE_HH)
    found = matcher.compute(left, right).astype(np.float32) / 16
    soil = cast_rays(scenes.floor(), rig, supersample=1).disparity
    there = (found > 0) & (soil > 46.32 / 5) & (soil < 46.32 / 2.5)
    above = (found - soil)[there]
    assert 0.1 < np.median(above) < 2.0
    assert np.median(np.abs(above - np.median(above))) > 0.1


def test_no_blade_stands_in_a_pit_and_all_stand_on_the_slope() -> None:
    ground = scenes.ramp(start=3.0).ground
    pit = Pit(x0=1.8, x1=2.4, y0=-0.5, y1=0.5, depth=0.3, texture=scenes.SOIL)
    scene = Scene(ground=replace(ground, pits=(pit,)), grass=(PATCH,))
    grown = lawns(scene, Light(), seed=0)[0]
    roots = grown.roots[grown.faces[:, 0]]
    assert not pit.mouth(roots[:, 0], roots[:, 1]).any()
    low = grown.faces[grown.up[grown.faces[:, 0]] == 0.0, 0]
    z = [ground.at(x, y) for x, y in grown.roots[low]]
    np.testing.assert_allclose(grown.vertices[low, 2], z, atol=1e-9)

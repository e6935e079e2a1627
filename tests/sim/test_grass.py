"""Blades stand where and as high as their patch says."""

from dataclasses import replace

import numpy as np

from bearcub.sim.grass import Grass, blades, palette
from bearcub.sim.light import Light

SUN = np.array([0.0, 0.6, 0.8])
PATCH = Grass(height=0.2, density=100, x0=2.0, x1=6.0, y0=-1.0, y1=1.0, seed=3)


def test_a_patch_has_its_density_and_height() -> None:
    grown = blades(PATCH, sun=SUN)
    roots = np.unique(grown.roots, axis=0)
    assert len(roots) == 800  # 100 on each of 8 square metres
    assert (roots >= [2.0, -1.0]).all()
    assert (roots <= [6.0, 1.0]).all()
    tallest = grown.vertices[:, 2].max()
    assert 0.19 < tallest <= 0.2
    assert grown.vertices[:, 2].min() == 0.0


def test_near_blades_bend_and_far_ones_are_single_triangles() -> None:
    grown = blades(PATCH, sun=SUN)
    near = np.linalg.norm(np.unique(grown.roots, axis=0), axis=1) < 4.0
    assert len(grown.faces) == 3 * near.sum() + (~near).sum()


def test_roots_are_dark_and_tips_are_light() -> None:
    grown = blades(PATCH, sun=SUN)
    low = grown.vertices[:, 2] == 0.0
    assert (grown.up[low] == 0.0).all()
    assert grown.up.max() == 1.0
    colour = palette(Light())
    assert (colour[:, 0] < 0.5 * colour[:, -1]).all()
    assert (colour[1] > colour[0]).all()  # green above blue


def test_the_same_seed_grows_the_same_grass() -> None:
    first, again = blades(PATCH, sun=SUN), blades(PATCH, sun=SUN)
    np.testing.assert_array_equal(first.vertices, again.vertices)
    for other in (blades(replace(PATCH, seed=4), sun=SUN), blades(PATCH, sun=SUN, seed=1)):
        assert (other.roots[:50] != first.roots[:50]).any()

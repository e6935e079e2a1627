"""A strip beside a thing is its only where the images say so."""

import numpy as np
import pytest

from bearcub.messages import Ground, UInt8
from bearcub.obstacles.segment import Member
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.strips import without_strips
from bearcub.obstacles.verify import Witness

LEVEL = 8  # disparity of the thing [px]
THING = np.s_[20:60, 60:100]
STRIP = np.s_[30:36, 100:150]  # to the right of it, above the horizon


def scene(*, textured: tuple[slice, slice], plain: int = 0, contrast: float = 1.0) -> Witness:
    """Return a pair in which only some pixels lie at the thing's disparity, the rest far away.

    The rest is an edge along the rows; of the thing `plain` columns at each side have no texture,
    and right of it the texture has only this share of its contrast.
    """
    rng = np.random.default_rng(3)
    left = np.full((80, 200), 90, dtype=np.uint8)
    left[33:] = 150
    thing = np.array(rng.integers(60, 190, (80, 200)), dtype=np.uint8)
    thing[:, 60 : 60 + plain] = 120
    thing[:, 100 - plain : 100] = 120
    thing[:, 100:] = 120 + contrast * (thing[:, 100:] - 120.0)
    right = left.copy()
    for rows, columns in (THING, textured):
        moved = slice(columns.start - LEVEL, columns.stop - LEVEL)
        left[rows, columns] = thing[rows, columns]
        right[rows, moved] = thing[rows, columns]
    return Witness(left=noisy(left, 1), right=noisy(right, 2))


def noisy(image: UInt8, seed: int) -> UInt8:
    noise = np.random.default_rng(seed).normal(0, 2, image.shape)
    return np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)


def columns_kept(
    witness: Witness, ground: Ground, *, strip: tuple[slice, slice]
) -> tuple[int, int]:
    """Return the first and last column of the thing that was matched with a strip."""
    d = np.full((80, 200), np.nan, dtype=np.float32)
    d[THING] = d[strip] = LEVEL
    v, u = np.nonzero(np.isfinite(d))
    sorter = Sorter.of(d, ground, sigmas=2.0, unevenness=0.0, farthest_level=0.5)
    whole = Member(number=1, u=u, v=v, stride=1, pixels=len(u))
    kept = without_strips(witness, sorter, whole, offset=0.0)
    assert kept.pixels == len(kept.u) == len(kept.v)
    return int(kept.u.min()), int(kept.u.max())


@pytest.mark.parametrize("plain", [0, 15])
def test_strip_along_an_edge_of_the_background_is_taken_off(
    sure_ground: Ground, plain: int
) -> None:
    witness = scene(textured=np.s_[0:0, 0:0], plain=plain)
    first, last = columns_kept(witness, sure_ground, strip=STRIP)
    assert first == 60
    assert last == pytest.approx(99, abs=3)


def test_strip_at_the_left_is_taken_off(sure_ground: Ground) -> None:
    witness = scene(textured=np.s_[0:0, 0:0])
    first, last = columns_kept(witness, sure_ground, strip=np.s_[30:36, 20:60])
    assert first == pytest.approx(60, abs=6)  # of half a window
    assert last == 99


@pytest.mark.parametrize("contrast", [1.0, 0.3])  # whose square the images speak by
def test_strip_that_the_images_show_is_kept(sure_ground: Ground, contrast: float) -> None:
    witness = scene(textured=STRIP, contrast=contrast)
    assert columns_kept(witness, sure_ground, strip=STRIP) == (60, 149)


def test_narrow_strip_is_left_to_other_steps(sure_ground: Ground) -> None:
    witness = scene(textured=np.s_[0:0, 0:0])
    assert columns_kept(witness, sure_ground, strip=np.s_[30:36, 100:106]) == (60, 105)


def test_nothing_is_taken_off_a_thing_for_which_the_images_do_not_speak(
    sure_ground: Ground,
) -> None:
    grey = np.full((80, 200), 90, dtype=np.uint8)
    witness = Witness(left=noisy(grey, 1), right=noisy(grey, 2))
    assert columns_kept(witness, sure_ground, strip=STRIP) == (60, 149)

"""The images speak for what was matched in them, the clearer the less grain they have."""

import cv2
import numpy as np
import pytest

from bearcub.messages import DisparityMap, UInt8
from bearcub.obstacles.verify import Witness

SHIFT, FLOOR = 12.0, 10.0


def witness(*, contrast: float, noise: float) -> Witness:
    """Return the images of a wall at 12 px, with noise of its own in each."""
    random = np.random.default_rng(3)
    texture = cv2.GaussianBlur(random.normal(0, 1, (60, 120)), (0, 0), 2.5)
    wide = 40 + contrast * texture / texture.std()
    left, right = (
        np.clip(x + random.normal(0, noise, x.shape), 0, 255).astype(np.uint8)
        for x in (wide[:, :100], wide[:, 12:112])
    )
    return Witness(left=left, right=right)


def speaks(images: Witness, *, claimed: float, sure: float) -> bool:
    v, u = (index.ravel() for index in np.mgrid[20:40, 40:60])
    claims = np.full(len(u), claimed, dtype=np.float32)
    floor = np.full(len(u), FLOOR, dtype=np.float32)
    return images.supports(u, v, claims, floor, sure=sure)


def test_dark_wall_is_confirmed_without_its_grain() -> None:
    dark = witness(contrast=5.0, noise=4.0)
    assert not speaks(dark, claimed=SHIFT, sure=1.5)
    assert speaks(dark.without_grain(), claimed=SHIFT, sure=1.5)


@pytest.mark.parametrize("contrast", [0.0, 5.0])
def test_without_grain_a_wrong_claim_is_still_refused(contrast: float) -> None:
    dark = witness(contrast=contrast, noise=4.0).without_grain()
    assert not speaks(dark, claimed=SHIFT + 2.0, sure=1.5)


def test_map_without_images_has_no_witness() -> None:
    nothing = DisparityMap(disparity=np.zeros((4, 4), dtype=np.float32))
    assert Witness.of(nothing) is None


def test_smoothing_leaves_the_images_as_they_were() -> None:
    dark = witness(contrast=5.0, noise=4.0)
    before: UInt8 = dark.left.copy()
    assert dark.without_grain().left.std() < dark.left.std()
    np.testing.assert_array_equal(dark.left, before)

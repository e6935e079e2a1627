"""Grain is told from texture; only grainy pairs are smoothed before they are matched."""

import cv2
import numpy as np
import pytest

from bearcub.messages import UInt8
from bearcub.stereo.grain import graininess, without_grain
from bearcub.stereo.matchers import SearchRange, SgbmMatcher

SHIFT = 12


def ground(*, contrast: float, noise: float, seed: int = 0) -> tuple[UInt8, UInt8]:
    """Return a pair of textured ground, shifted by 12 px, with noise of its own in each image."""
    random = np.random.default_rng(seed)
    texture = cv2.GaussianBlur(random.normal(0, 1, (120, 240)), (0, 0), 2.5)
    wide = 90 + contrast * texture / texture.std()
    pair = [wide[:, 20 : 20 + 200], wide[:, 20 + SHIFT : 20 + SHIFT + 200]]
    left, right = (np.clip(x + random.normal(0, noise, x.shape), 0, 255) for x in pair)
    return left.astype(np.uint8), right.astype(np.uint8)


def right_share(left: UInt8, right: UInt8) -> float:
    """Return the share of the pixels that are matched to within a pixel."""
    found = SgbmMatcher(SearchRange(0, 32))(left, right)[:, 40:-10]
    return float((np.abs(found - SHIFT) < 1).mean())


def test_clear_pair_is_left_as_it_is() -> None:
    left, right = ground(contrast=30, noise=1.5)
    assert graininess(left) < 2.0
    one, other = without_grain(left, right)
    assert one is left
    assert other is right


def test_grainy_pair_is_smoothed_and_matched_better() -> None:
    left, right = ground(contrast=5, noise=4)
    assert graininess(left) > 2.4
    smooth = without_grain(left, right)
    assert smooth[0].std() < left.std()
    assert right_share(*smooth) > right_share(left, right) + 0.05


@pytest.mark.parametrize("value", [0, 255])
def test_even_image_has_no_grain(value: int) -> None:
    even = np.full((40, 40), value, dtype=np.uint8)
    assert graininess(even) == 1.0
    assert without_grain(even, even)[0] is even

"""A pair or a map in, one adjusted `DisparityMap` out; whole inputs that cannot be are refused."""

import math

import cv2
import numpy as np
import pytest

from bearcub.config import Matching
from bearcub.errors import InputError
from bearcub.messages import UInt8
from bearcub.rig import Camera, Mount
from bearcub.stereo import StereoStage, from_disparity
from bearcub.stereo.checks import check_order
from bearcub.stereo.choice import matcher_for
from bearcub.stereo.half import HalfResolution
from bearcub.stereo.matchers import CallableMatcher, SearchRange, SgbmMatcher

nan = np.nan


def floor_pair(*, rows_lower: int = 0) -> tuple[UInt8, UInt8]:
    """Return a pair of a textured floor, 2 px of disparity at the top and 22 at the bottom."""
    rng = np.random.default_rng(5)
    texture = cv2.GaussianBlur(rng.normal(128, 80, (200, 500)), (0, 0), 1.2)
    right = np.clip(texture, 0, 255).astype(np.uint8)
    rows, columns = np.mgrid[:200, :320].astype(np.float32)
    left = cv2.remap(right, columns - (2 + 0.1 * rows) + 90, rows, cv2.INTER_CUBIC)
    return left.astype(np.uint8), np.roll(right[:, 90:410], rows_lower, axis=0)


def stage(**options: float) -> StereoStage:
    return StereoStage(SgbmMatcher(SearchRange(0, 48)), **options)  # type: ignore[arg-type]


def test_a_pair_becomes_a_map_with_its_range_share_and_alignment() -> None:
    found = stage()(*floor_pair())
    rows = np.arange(200)[:, None]
    error = np.abs(found.disparity - (2 + 0.1 * rows))[5:-5, 30:-5]
    assert found.disparity.dtype == np.float32
    assert not found.disparity.flags.writeable
    assert np.nanmedian(error) < 0.15
    assert found.valid_share == np.isfinite(found.disparity).mean() > 0.85
    assert (found.smallest, found.largest) == (0, 47)
    assert abs(found.epipolar_offset) < 0.1


def test_a_misaligned_pair_is_measured_unless_told_not_to() -> None:
    pair = floor_pair(rows_lower=2)
    assert stage()(*pair).epipolar_offset == pytest.approx(2.0, abs=0.1)
    assert math.isnan(stage(align=False)(*pair).epipolar_offset)


def test_doffs_is_added() -> None:
    plain = stage()(*floor_pair())
    moved = stage(doffs=5.5)(*floor_pair())
    np.testing.assert_allclose(moved.disparity, plain.disparity + 5.5)
    assert (moved.smallest, moved.largest) == (5.5, 52.5)


def test_sizes_that_differ_are_named() -> None:
    left, right = floor_pair()
    with pytest.raises(InputError, match="left is 320 x 200 pixels and right 310 x 200"):
        stage()(left, right[:, :310])


def test_an_image_that_is_none_is_named() -> None:
    left, _ = floor_pair()
    with pytest.raises(InputError, match="right: expected an 8-bit image"):
        stage()(left, None)  # type: ignore[arg-type]


def test_a_swapped_pair_is_refused() -> None:
    left, right = floor_pair()
    with pytest.raises(InputError, match=r"beyond infinity.*give them in the other order"):
        stage()(right, left)


def test_the_order_is_told_from_doffs_too() -> None:
    left, right = floor_pair()
    # With doffs = -1 infinity is measured as 1 px; swapped, the floor is measured as -2 to -22.
    assert check_order(left, right, largest=48, doffs=-1.0)
    with pytest.raises(InputError, match="other order"):
        check_order(right, left, largest=48, doffs=-1.0)
    # With doffs = 30 measured disparities of -22 are as near as 8: the order cannot be told.
    assert check_order(right, left, largest=48, doffs=30.0)


def test_a_dark_first_frame_does_not_settle_the_order() -> None:
    dark = np.zeros((200, 320), np.uint8)
    left, right = floor_pair()
    both = stage()
    assert both(dark, dark).valid_share == 0
    with pytest.raises(InputError, match="other order"):
        both(right, left)


def test_what_lies_beyond_infinity_is_infinity_or_no_match() -> None:
    values = np.full((16, 16), 5.0, np.float32)
    values[0, :3] = (-0.5, -3.0, nan)
    found = from_disparity(values).disparity
    np.testing.assert_array_equal(found[0, :4], [0, nan, nan, 5])


def test_a_given_map_is_adjusted_and_infinite_values_are_no_match() -> None:
    values = np.array([[1.0, np.inf, -np.inf, nan]])
    found = from_disparity(values, doffs=2.0)
    np.testing.assert_array_equal(found.disparity, np.array([[3, nan, nan, nan]], np.float32))
    assert found.valid_share == 0.25
    assert (found.smallest, found.largest) == (0, math.inf)
    assert math.isnan(found.epipolar_offset)
    assert values[0, 0] == 1.0


def test_a_map_with_nothing_or_mostly_negative_is_refused_with_its_share() -> None:
    with pytest.raises(InputError, match=r"d\.pfm: none of the 4 pixels holds a disparity"):
        from_disparity(np.full((2, 2), nan), name="d.pfm")
    with pytest.raises(InputError, match=r"d\.pfm: 75 % of the disparities are negative"):
        from_disparity(np.array([[-5.0, -6.0], [-7.0, 3.0]]), name="d.pfm")
    # As measured, not adjusted: negative numbers that doffs explains are fine.
    assert from_disparity(np.array([[-5.0, -6.0]]), doffs=31.0).valid_share == 1


@pytest.mark.parametrize("name", ["sgbm", "bm"])
def test_the_configuration_chooses_the_matcher(name: str) -> None:
    camera = Camera(width=320, height=200, fx=200, fy=200, cx=160, cy=100, baseline=0.1)
    built = StereoStage.for_rig(camera, Mount(height=1.0), Matching(matcher=name, nearest=0.7))
    found = built(*floor_pair())
    assert found.largest == 31  # 200 * 0.1 / 0.7 = 28.6
    assert found.valid_share > 0.5


@pytest.mark.parametrize("name", ["native", "sgbm", "bm"])
def test_every_matcher_finds_the_floor_at_half_the_resolution(name: str) -> None:
    half = matcher_for(SearchRange(0, 64), Matching(matcher=name, half_resolution=True))
    assert isinstance(half, HalfResolution)
    assert half.largest == 62
    found = StereoStage(half)(*floor_pair())
    error = np.abs(found.disparity - (2 + 0.1 * np.arange(200)[:, None]))[5:-5, 30:-5]
    assert np.nanmedian(error) < 0.1  # sharpened at the full size
    assert found.valid_share > 0.8


def test_rows_that_are_left_out_are_unseen_and_not_counted() -> None:
    left, right = floor_pair()
    found = stage(doffs=1.5)(left, right, first_row=64)
    assert found.first_row == 64
    assert not found.disparity.flags.writeable
    assert np.isnan(found.disparity[:64]).all()
    below = stage(doffs=1.5)(left[64:], right[64:])
    np.testing.assert_array_equal(found.disparity[64:], below.disparity)
    assert found.valid_share == below.valid_share
    assert found.left is not None
    np.testing.assert_array_equal(found.left, left)  # whole, in step with the disparity


def test_any_matcher_can_be_used() -> None:
    left, right = floor_pair()
    truth = np.repeat(2 + 0.1 * np.arange(200)[:, None], 320, axis=1)
    built = StereoStage(CallableMatcher(lambda *_: truth))
    found = built(left, right)
    assert found.valid_share > 0.9
    # the stage registers every window anew on 8-bit pictures
    assert found.disparity[150, 200] == pytest.approx(17.0, abs=0.05)


def test_a_grainy_pair_is_told_from_a_clear_one() -> None:
    left, right = floor_pair()
    assert not stage()(left, right).grainy
    rng = np.random.default_rng(7)
    dark = [
        np.clip(20 + image / 25 + rng.normal(0, 4, image.shape), 0, 255).astype(np.uint8)
        for image in (left, right)
    ]
    assert stage()(dark[0], dark[1]).grainy

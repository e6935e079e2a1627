"""Matchers measure what is there, say NaN where the right image cannot know, nothing else."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.matchers import (
    BmMatcher,
    CallableMatcher,
    Matcher,
    SearchRange,
    SgbmMatcher,
    left_right_check,
)
from bearcub.stereo.native import NativeMatcher, reason_missing

Kind = Callable[[SearchRange], Matcher]
nan = np.nan
KINDS: list[Kind] = [SgbmMatcher, BmMatcher, *([] if reason_missing() else [NativeMatcher])]


def textured(height: int, width: int, *, seed: int = 0) -> UInt8:
    noise = np.random.default_rng(seed).normal(0, 60, (height, width))
    return np.clip(cv2.GaussianBlur(128 + noise, (0, 0), 1.0), 0, 255).astype(np.uint8)


def pair_of(disparity: Float32) -> tuple[UInt8, UInt8]:
    """Return a textured pair with that disparity at every left pixel."""
    height, width = disparity.shape
    wide = textured(height, width + 200)
    columns = np.arange(width, dtype=np.float32) - disparity + np.float32(100)
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    left = cv2.remap(wide, columns, rows, cv2.INTER_CUBIC)
    return left.astype(np.uint8), wide[:, 100:-100].copy()


@pytest.mark.parametrize("kind", KINDS)
def test_a_slanted_surface_is_measured_to_a_fraction_of_a_pixel(kind: Kind) -> None:
    rows = np.arange(120, dtype=np.float32)[:, None]
    truth = np.repeat(4.25 + 0.1 * rows, 200, axis=1).astype(np.float32)
    found = kind(SearchRange(0, 32))(*pair_of(truth))
    inside = np.s_[10:-10, 40:-10]
    error = np.abs(found - truth)[inside]
    assert np.isfinite(error).mean() > 0.9
    assert np.nanmedian(error) < 0.15
    assert np.nanpercentile(error, 95) < 0.6


@pytest.mark.parametrize("kind", KINDS)
def test_the_left_strip_is_answered_wherever_the_right_image_shows_it(
    kind: Kind,
) -> None:
    left, right = pair_of(np.full((80, 200), 20, np.float32))
    found = kind(SearchRange(0, 64))(left, right)
    assert np.isnan(found[:, :19]).mean() > 0.95  # left of the right image's border
    strip = found[10:-10, 26:64]  # OpenCV alone leaves out the first 64 columns
    assert (np.abs(strip - 20) < 0.5).mean() > 0.9


@pytest.mark.parametrize("kind", KINDS)
def test_no_match_lies_outside_the_right_image(kind: Kind) -> None:
    found = kind(SearchRange(-16, 64))(textured(60, 120, seed=1), textured(60, 120, seed=2))
    columns = np.arange(120) - found
    assert np.nanmin(columns, initial=0) >= 0
    assert np.nanmax(columns, initial=0) <= 119


@pytest.mark.parametrize("kind", KINDS)
def test_negative_disparities_are_measured_up_to_the_right_border(kind: Kind) -> None:
    found = kind(SearchRange(-16, 32))(*pair_of(np.full((80, 160), -7, np.float32)))
    assert (np.abs(found[10:-10, 10:145] + 7) < 0.5).mean() > 0.9
    assert np.isnan(found[:, 155:]).mean() > 0.95


def test_colour_is_matched_as_grey() -> None:
    left, right = pair_of(np.full((40, 100), 5, np.float32))
    matcher = SgbmMatcher(SearchRange(0, 16))
    colour = [np.repeat(image[..., None], 3, axis=2) for image in (left, right)]
    np.testing.assert_array_equal(matcher(*colour), matcher(left, right))


def test_left_right_check_keeps_only_matches_that_point_back() -> None:
    left = np.array([[nan, 1, 1, 2, 3]], np.float32)
    # column 1 -> 0 says 1; column 2 -> 1 says 2; column 3 -> 1 says 2; column 4 -> 1 says 2
    right = np.array([[1, 2, nan, nan, nan]], np.float32)
    exact = left_right_check(left, right, largest_difference=0.5)
    np.testing.assert_array_equal(exact, [[nan, 1, nan, 2, nan]])
    loose = left_right_check(left, right, largest_difference=1.0)
    np.testing.assert_array_equal(loose, [[nan, 1, 1, 2, 3]])


def test_any_callable_is_a_matcher_and_is_held_to_the_shape() -> None:
    image = np.zeros((16, 20), np.uint8)
    matcher: Matcher = CallableMatcher(lambda left, _: np.full(left.shape, np.inf), largest=64)
    assert matcher.largest == 64
    assert np.isnan(matcher(image, image)).all()
    with pytest.raises(InputError, match=r"expected the images' shape \(16, 20\), found \(2, 2\)"):
        CallableMatcher(lambda *_: np.zeros((2, 2)))(image, image)
    with pytest.raises(InputError, match="the matcher's answer: expected a disparity map"):
        CallableMatcher(lambda left, _: left)(image, image)


def test_a_search_that_opencv_cannot_do_is_refused() -> None:
    assert SearchRange(-4, 32).largest == 27
    for count in (0, -16, 20):
        with pytest.raises(InputError, match=f"{count} disparities to search"):
            SearchRange(0, count)

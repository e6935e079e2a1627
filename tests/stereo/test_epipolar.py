"""A vertical misalignment of the pair is measured to a fraction of a pixel."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.messages import UInt8
from bearcub.stereo.epipolar import epipolar_offset
from bearcub.stereo.gates import gate
from bearcub.stereo.matchers import SearchRange, SgbmMatcher

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"
rng = np.random.default_rng(3)


def textured_pair(rows_lower: float, *, disparity: float) -> tuple[UInt8, UInt8]:
    scene = cv2.GaussianBlur(rng.normal(128, 90, (300, 440)), (0, 0), 1.5).astype(np.float32)
    left = scene[20:260, 60:380]
    # What the left image shows at (u, v) the right one shows at (u - disparity, v + rows_lower).
    move = np.array([[1, 0, -60 - disparity], [0, 1, -20 + rows_lower]], np.float32)
    right = cv2.warpAffine(scene, move, (320, 240), flags=cv2.INTER_CUBIC)
    noise = rng.normal(0, 1.5, (2, 240, 320))
    images = [
        np.clip(np.rint(image + n), 0, 255) for image, n in zip((left, right), noise, strict=True)
    ]
    return images[0].astype(np.uint8), images[1].astype(np.uint8)


@pytest.mark.parametrize("rows", [-4.6, -1.3, -0.5, 0.0, 0.25, 0.7, 3.2])
def test_a_shift_of_the_right_image_is_recovered_with_its_sign(rows: float) -> None:
    left, right = textured_pair(rows, disparity=8.4)
    disparity = np.full(left.shape, 8.4, np.float32)
    assert epipolar_offset(left, right, disparity) == pytest.approx(rows, abs=0.05)


@pytest.mark.skipif(not DATA.is_dir(), reason="the public recordings are not beside the repository")
@pytest.mark.parametrize(
    ("left", "right", "rows"),
    [
        ("inria_road/left_46.png", "inria_road/right_46.png", 0.7),
        ("middlebury/cones/im2.png", "middlebury/cones/im6.png", -0.5),
        ("middlebury/teddy/im2.png", "middlebury/teddy/im6.png", 0.3),
    ],
)
def test_a_real_image_moved_up_or_down_changes_the_answer_by_as_much(
    left: str, right: str, rows: float
) -> None:
    images = [np.asarray(cv2.imread(str(DATA / n), 0), np.uint8) for n in (left, right)]
    move = np.array([[1, 0, 0], [0, 1, rows]], np.float32)
    size = images[1].shape[::-1]
    moved = cv2.warpAffine(
        images[1], move, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    before, after = (matched_offset(images[0], x) for x in (images[1], np.asarray(moved, np.uint8)))
    assert after - before == pytest.approx(rows, abs=0.06)


def matched_offset(left: UInt8, right: UInt8) -> float:
    disparity = SgbmMatcher(SearchRange(0, 64))(left, right)
    known = gate(left, right, disparity, agreement=0.65, contrast=0.5, speckle_area=100)
    return epipolar_offset(left, right, known)


def test_wrong_matches_do_not_pull_the_median() -> None:
    left, right = textured_pair(0.7, disparity=8.4)
    disparity = np.full(left.shape, 8.4, np.float32)
    disparity[:, :100] = 40.0
    assert epipolar_offset(left, right, disparity) == pytest.approx(0.7, abs=0.1)


@pytest.mark.parametrize("rows", [-3.4, 0.0, 2.0, 3.0])
@pytest.mark.parametrize("left_over", ["few", "wrong"])
def test_where_hardly_anything_is_matched_the_rows_around_are_searched(
    rows: float, left_over: str
) -> None:
    left, right = textured_pair(rows, disparity=8.4)
    disparity = np.full(left.shape, np.nan, np.float32)
    if left_over == "few":
        disparity[:, 200:260] = 21.0  # as a matcher leaves where rows are off
    else:
        disparity[:] = rng.uniform(0, 40, left.shape)
    assert epipolar_offset(left, right, disparity, largest=64) == pytest.approx(rows, abs=0.15)


def test_without_texture_it_is_unknown() -> None:
    blank = np.full((240, 320), 90, np.uint8)
    assert math.isnan(epipolar_offset(blank, blank, np.zeros(blank.shape, np.float32)))
    assert math.isnan(epipolar_offset(blank, blank, np.full(blank.shape, np.nan, np.float32)))


@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_without_matches_it_is_searched_for(nothing: float) -> None:
    left, right = textured_pair(0.7, disparity=8.4)
    disparity = np.full(left.shape, nothing, np.float32)
    assert epipolar_offset(left, right, disparity) == pytest.approx(0.7, abs=0.1)


@pytest.mark.parametrize("shape", [(16, 16), (23, 64), (47, 30)])
def test_an_image_with_room_for_few_patches_says_nothing(shape: tuple[int, int]) -> None:
    image = rng.integers(0, 255, shape).astype(np.uint8)
    assert math.isnan(epipolar_offset(image, image, np.zeros(shape, np.float32)))


def test_images_of_different_things_give_nothing() -> None:
    left, _ = textured_pair(0.0, disparity=0.0)
    other, _ = textured_pair(0.0, disparity=0.0)
    offset = epipolar_offset(left, other, np.full(left.shape, 4.0, np.float32))
    assert math.isnan(offset)

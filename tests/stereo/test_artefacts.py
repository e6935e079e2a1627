"""Blocks of compression and the frame of a rectification do not become disparity."""

import cv2
import numpy as np
import pytest

from bearcub.messages import Bool, UInt8
from bearcub.stereo.artefacts import block_steps, without_frame
from bearcub.stereo.matchers import SearchRange, SgbmMatcher
from bearcub.stereo.stage import StereoStage

SHAPE = (240, 320)


def compressed(image: UInt8, quality: int) -> UInt8:
    _, coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def textured(seed: int, shape: tuple[int, int] = SHAPE) -> UInt8:
    noise = np.random.default_rng(seed).normal(0, 40, shape)
    return np.clip(128 + cv2.GaussianBlur(noise, (0, 0), 1.5) * 2, 0, 255).astype(np.uint8)


def sky(seed: int) -> UInt8:
    """Return a bright sky that darkens towards one side, with a camera's noise."""
    light = np.linspace(200, 160, SHAPE[0])[:, None] + np.linspace(0, 20, SHAPE[1])
    noise = np.random.default_rng(seed).normal(0, 2, SHAPE)
    return np.rint(light + noise).astype(np.uint8)


def test_steps_between_blocks_grow_with_the_compression() -> None:
    image = textured(1)
    steps = [block_steps(image), *(block_steps(compressed(image, q)) for q in (95, 75, 50))]
    assert steps[0] < 0.3 < steps[2] < steps[3]
    assert steps == sorted(steps)


def test_an_image_narrower_than_two_blocks_has_no_steps() -> None:
    assert block_steps(np.full((20, 12), 50, dtype=np.uint8)) == 0.0
    assert block_steps(textured(1, (20, 5))) == 0.0


@pytest.mark.parametrize("quality", [50, 75])
def test_blocks_of_a_blank_sky_are_not_matched(quality: int) -> None:
    left, right = (compressed(sky(seed), quality) for seed in (1, 2))
    matched = StereoStage(SgbmMatcher(SearchRange(0, 64)))(left, right)
    assert matched.valid_share < 0.005  # 0.3 at 50 by the uncompressed pair's gates


def test_blocks_that_a_rectification_turned_are_told_of_and_not_matched() -> None:
    turn = cv2.getRotationMatrix2D((160, 120), 2.0, 1.0)
    raw = [compressed(sky(seed), 75) for seed in (1, 2)]
    pair = [
        cv2.warpAffine(each, turn, SHAPE[::-1], borderMode=cv2.BORDER_REFLECT).astype(np.uint8)
        for each in raw
    ]
    alone, told = (
        StereoStage(SgbmMatcher(SearchRange(0, 64)))(pair[0], pair[1], steps=steps).valid_share
        for steps in (0.0, block_steps(raw[0]))
    )
    assert told < 0.003
    assert told < 0.5 * alone


def test_ground_that_was_compressed_is_still_matched() -> None:
    image, d = textured(3), 12
    pair = (compressed(each, 75) for each in (image, np.roll(image, -d, axis=1)))
    matched = StereoStage(SgbmMatcher(SearchRange(0, 64)))(*pair)
    assert matched.valid_share > 0.9
    assert np.nanmedian(matched.disparity) == pytest.approx(d, abs=0.1)


def framed(image: UInt8, frame: Bool) -> UInt8:
    return np.where(frame, 0, image).astype(np.uint8)


def curved(width: float) -> Bool:
    """Return a frame that is so wide in the corners and ends in the middle of the sides."""
    v, u = np.mgrid[0 : SHAPE[0], 0 : SHAPE[1]]
    bulge = width * (2 * v / (SHAPE[0] - 1) - 1) ** 2
    frame: Bool = (u < bulge) | (u > SHAPE[1] - 1 - bulge)
    return frame


def test_what_lies_about_a_black_frame_is_not_matched() -> None:
    image, d = np.maximum(textured(2), 10), 10
    left, right = framed(image, curved(16)), framed(np.roll(image, -d, axis=1), curved(24))
    disparity = np.full(SHAPE, d, dtype=np.float32)
    kept = np.isfinite(without_frame(left, right, disparity))
    # seven pixels about the frame of either image, of the right one's as far as it is matched
    assert kept[0].nonzero()[0][0] == 24 + d + 7
    assert kept[0].nonzero()[0][-1] == SHAPE[1] - 1 - 16 - 7
    assert kept[120, 24:-24].all()


def test_a_pair_without_a_frame_is_left_alone() -> None:
    image = np.maximum(textured(2), 10)
    image[100:140, 100:200] = 0  # a black thing in the middle
    disparity = np.full(SHAPE, 10, dtype=np.float32)
    assert without_frame(image, image, disparity) is disparity

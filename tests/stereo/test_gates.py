"""Noise is not matched, weak texture is."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.messages import Float32, UInt8
from bearcub.stereo.gates import agreement_gate, gate, without_islands
from bearcub.stereo.matchers import SearchRange, SgbmMatcher

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"
nan = np.nan
rng = np.random.default_rng(7)


def noisy(image: Float32, sigma: float) -> UInt8:
    return np.clip(np.rint(image + rng.normal(0, sigma, image.shape)), 0, 255).astype(np.uint8)


def asphalt(height: int, width: int, *, contrast: float) -> Float32:
    texture = cv2.GaussianBlur(rng.normal(0, 1, (height, width)), (0, 0), 1.0)
    return np.asarray(100 + contrast * texture / texture.std(), dtype=np.float32)


def gated(left: UInt8, right: UInt8) -> Float32:
    raw = SgbmMatcher(SearchRange(0, 64))(left, right)
    return gate(left, right, raw, agreement=0.65, contrast=0.5, speckle_area=100)


@pytest.mark.parametrize("sigma", [0.0, 2.0, 4.0, 6.0])
def test_a_blank_wall_with_noise_has_no_disparity(sigma: float) -> None:
    blank = np.full((480, 640), 150, np.float32)
    left, right = noisy(blank, sigma), noisy(blank, sigma)
    assert np.isfinite(gated(left, right)).mean() < 0.005


def test_textured_ground_is_kept_under_a_noisy_blank_sky() -> None:
    ground = asphalt(240, 740, contrast=6.0)
    sky = np.full((240, 640), 220, np.float32)
    # Ground 10 px away from infinity: what is at column u in the left image is at u - 10.
    left = noisy(np.vstack([sky, ground[:, :640]]), 2.0)
    right = noisy(np.vstack([sky, ground[:, 10:650]]), 2.0)
    found = gated(left, right)
    assert np.isfinite(found[:225]).mean() < 0.005
    assert (np.abs(found[245:, 12:] - 10) < 1).mean() > 0.97


def test_weak_texture_is_told_from_stronger_noise_elsewhere() -> None:
    """Asphalt of 1.5 grey levels in a quiet camera passes; noise of 6 does not."""
    ground = asphalt(200, 460, contrast=1.5)
    quiet = gated(noisy(ground[:, :400], 0.5), noisy(ground[:, 10:410], 0.5))
    assert (np.abs(quiet[:, 20:] - 10) < 1).mean() > 0.9


def test_agreement_is_the_share_of_gradient_on_which_the_images_differ() -> None:
    steps = np.tile(np.array([100, 110, 120, 110], np.uint8), (40, 10))
    disparity = np.zeros(steps.shape, np.float32)
    # Gradients g and 1.5 g: sum (g_l - g_r)^2 / sum (g_l^2 + g_r^2) = 0.25 / 3.25 = 0.077
    stronger = (100 + 1.5 * (steps.astype(np.float32) - 100)).astype(np.uint8)
    inside = np.s_[8:-8, 8:-8]
    assert agreement_gate(steps, stronger, disparity, agreement=0.08, contrast=0.5)[inside].all()
    assert not agreement_gate(steps, stronger, disparity, agreement=0.07, contrast=0.5).any()


def test_texture_below_the_least_contrast_does_not_count() -> None:
    steps = np.tile(np.array([100, 110, 120, 110], np.uint8), (40, 10))
    disparity = np.zeros(steps.shape, np.float32)
    # Central differences 20, 0, -20, 0: RMS 13.1 to 15.1 in windows of 7 columns.
    inside = np.s_[8:-8, 8:-8]
    assert agreement_gate(steps, steps, disparity, agreement=0.65, contrast=13.0)[inside].all()
    assert not agreement_gate(steps, steps, disparity, agreement=0.65, contrast=15.2)[inside].any()


def test_the_gate_says_no_where_nothing_was_matched() -> None:
    steps = np.tile(np.array([100, 110, 120, 110], np.uint8), (40, 10))
    disparity = np.zeros(steps.shape, np.float32)
    disparity[:, 20:] = nan
    kept = agreement_gate(steps, steps, disparity, agreement=0.5, contrast=0.5)
    assert kept[8:-8, 8:20].all()
    assert not kept[:, 20:].any()


def test_islands_are_patches_of_one_depth_that_are_too_small() -> None:
    disparity = np.full((20, 20), nan, np.float32)
    disparity[2:5, 2:5] = 7  # 9 pixels
    disparity[2:5, 10:14] = 7  # 12 pixels, of which
    disparity[2:5, 13] = 9  # 3 are another depth
    disparity[10:14, 2:5] = 7  # 12 pixels
    kept = without_islands(disparity, smallest_area=10, step=1.0)
    assert kept.sum() == 12
    assert kept[10:14, 2:5].all()


@pytest.mark.parametrize("shape", [(64, 96), (65, 97)])
def test_gating_changes_no_value_and_answers_for_odd_sizes(shape: tuple[int, int]) -> None:
    ground = asphalt(*shape, contrast=20.0)
    image = noisy(ground, 0.0)
    disparity = np.zeros(shape, np.float32)
    disparity[30, 40] = nan
    found = gate(image, image, disparity, agreement=0.65, contrast=0.5, speckle_area=100)
    assert np.isnan(found[30, 40])
    assert np.nansum(np.abs(found)) == 0
    assert np.isfinite(found).mean() > 0.97


@pytest.mark.skipif(not DATA.is_dir(), reason="the public recordings are not beside the repository")
@pytest.mark.parametrize(
    ("left", "right", "search", "floor", "least"),
    [
        # A road well exposed, and one whose texture is barely above the camera's noise.
        ("kitti_odometry/image_l/000000.png", "kitti_odometry/image_r/000000.png", 128,
         np.s_[250:, 400:800], 0.97),
        ("inria_road/left_46.png", "inria_road/right_46.png", 64, np.s_[200:250, 100:400], 0.55),
    ],
)  # fmt: skip
def test_a_real_road_survives_the_gates(
    left: str, right: str, search: int, floor: tuple[slice, slice], least: float
) -> None:
    first, second = (np.asarray(cv2.imread(str(DATA / n), 0), np.uint8) for n in (left, right))
    raw = SgbmMatcher(SearchRange(0, search))(first, second)
    found = gate(first, second, raw, agreement=0.65, contrast=0.5, speckle_area=100)
    assert np.isfinite(found[floor]).mean() > least

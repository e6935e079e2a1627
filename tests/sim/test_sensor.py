import cv2
import numpy as np
import pytest

from bearcub.errors import InputError
from bearcub.messages import DisparityMap
from bearcub.sim import degrade
from bearcub.sim.sensor import Strength, degrade_pair, linear, quantised
from bearcub.stereo.rows import Rows, RowTracker

GREY = np.full((120, 160), 120, dtype=np.uint8)
COLOUR = np.dstack([GREY, GREY // 2, GREY + 60])
TEXTURE = np.random.default_rng(5).integers(40, 200, (240, 320), dtype=np.uint8)
SMOOTH = (
    np.asarray(cv2.GaussianBlur(TEXTURE, (0, 0), 2.0) * 4.0 - 360).clip(0, 255).astype(np.uint8)
)


def test_light_and_pixels_convert_both_ways() -> None:
    every = np.arange(256, dtype=np.uint8).reshape(16, 16)
    np.testing.assert_array_equal(quantised(linear(every)), every)
    assert linear(every)[15, 15] == 1


def test_same_seed_gives_the_same_image_and_another_does_not() -> None:
    one = degrade(COLOUR, "medium", (1, 0))
    np.testing.assert_array_equal(one, degrade(COLOUR, "medium", (1, 0)))
    assert (one != degrade(COLOUR, "medium", (1, 1))).any()


def test_stronger_means_noisier() -> None:
    centre = np.s_[50:70, 60:100]  # where vignetting is flat
    strengths: tuple[Strength, ...] = ("weak", "medium", "strong")
    noise = [degrade(GREY, strength, 3)[centre].std() for strength in strengths]
    assert 0.5 < noise[0] < noise[1] < noise[2] < 8


def test_brightness_stays_within_the_gain() -> None:
    means = [degrade(GREY, "medium", seed)[50:70, 60:100].mean() for seed in range(8)]
    # 6 % of light is 2.7 % of a pixel value: 120 +- 3.3, and a little vignetting
    assert max(abs(mean - 120) for mean in means) < 5
    assert np.ptp(means) > 1


def test_corners_are_darker() -> None:
    bright = degrade(GREY, "strong", 4).astype(float)
    assert bright[:10, :10].mean() < bright[55:65, 75:85].mean() - 10


def test_edges_get_softer() -> None:
    edge = np.zeros((64, 64), dtype=np.uint8)
    edge[:, 32:] = 200
    assert 20 < degrade(edge, "medium", 0)[:, 31].mean() < 150


def test_grey_stays_grey_and_colour_keeps_its_hue() -> None:
    assert degrade(GREY, "weak", 0).shape == GREY.shape
    means = degrade(COLOUR, "weak", 0)[50:70, 60:100].mean(axis=(0, 1))
    assert means == pytest.approx([120, 60, 180], abs=4)


def test_unknown_strength_and_wrong_type_are_refused() -> None:
    with pytest.raises(InputError, match="must be one of weak, medium, strong"):
        degrade(GREY, "huge", 0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected an 8-bit image"):
        degrade(GREY.astype(float), "weak", 0)


def rows_between(strength: Strength, seed: int, rig: int | None = None) -> Rows:
    left, right = degrade_pair(SMOOTH, SMOOTH, strength, (seed,), rig=rig)
    tracker = RowTracker()
    nowhere = np.zeros(SMOOTH.shape, dtype=np.float32)
    tracker.learn(DisparityMap(disparity=nowhere, largest=8.0, left=left, right=right))
    return tracker.rows


def test_a_pair_has_rows_that_are_a_little_off_and_more_so_when_strong() -> None:
    weak, strong = (
        np.array([(r.shift, r.turn) for r in (rows_between(strength, k) for k in range(10))])
        for strength in ("weak", "strong")
    )
    # 0.1 and 0.3 px over the image: shifts of 0.07 and 0.21, turns of 0.12 and 0.37 at the end
    assert 0.02 < weak.std(axis=0).min() < weak.std(axis=0).max() < 0.25
    assert 0.1 < strong.std(axis=0).min() < strong.std(axis=0).max() < 0.7


def test_a_pair_has_columns_that_are_exact() -> None:
    edge = np.full((240, 320), 20, dtype=np.uint8)
    edge[:, 160:] = 200
    for seed in range(4):
        pair = degrade_pair(edge, edge, "medium", (seed,))
        # where light changes: the mean column, weighed by the gradient of the mean row
        slopes = [np.diff(image.mean(axis=0))[155:164] for image in pair]
        one, other = ((s * np.arange(9)).sum() / s.sum() for s in slopes)
        assert one == pytest.approx(other, abs=0.05)


def test_a_pair_is_the_same_with_the_same_seed_and_its_noises_differ() -> None:
    one, other = (degrade_pair(COLOUR, COLOUR, "medium", (7,)) for _ in range(2))
    for image, again in zip(one, other, strict=True):
        np.testing.assert_array_equal(image, again)
    assert (one[0] != one[1]).any()


def test_pairs_of_one_rig_have_the_same_rows_and_noises_of_their_own() -> None:
    one, other = (degrade_pair(SMOOTH, SMOOTH, "strong", (k,), rig=5) for k in (1, 2))
    assert (one[0] != other[0]).any()
    first, second, others = (
        rows_between("strong", seed, rig=rig) for seed, rig in ((1, 5), (2, 5), (2, 6))
    )
    assert first.beside(second) < 0.05
    assert first.beside(others) > 0.1


def test_motion_softens_a_pair() -> None:
    dots = np.zeros((100, 100), dtype=np.uint8)
    dots[10::20, 10::20] = 255
    still = [int((degrade(dots, "strong", (k, 0)) > 60).sum()) for k in range(12)]
    pairs = [degrade_pair(dots, dots, "strong", (k,)) for k in range(12)]
    moved = [[int((image > 60).sum()) for image in pair] for pair in pairs]
    assert min(np.mean(moved, axis=0)) > np.mean(still)

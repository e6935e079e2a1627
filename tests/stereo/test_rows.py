"""What a rectification leaves between the rows of a pair is measured and undone."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from bearcub.messages import DisparityMap, Float32, UInt8
from bearcub.stereo.native import COMPILED, core, levels
from bearcub.stereo.rows import Rows, RowTracker

HEIGHT, WIDTH, DISPARITY = 240, 320, 8.4
OFF = Rows(shift=0.3, turn=-0.2, stretch=0.1, twist=-0.15)
BLANK = np.full((HEIGHT, WIDTH), 90, dtype=np.uint8)


def pair(rows: Rows, *, noise: float = 1.5, seed: int = 3) -> tuple[UInt8, UInt8]:
    """Return a plane of texture whose right image lies lower by `rows`."""
    rng = np.random.default_rng(seed)
    scene = cv2.GaussianBlur(rng.normal(128, 90, (300, 440)), (0, 0), 1.5).astype(np.float32)
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    x, y = 2 * (u - 159.5) / WIDTH, 2 * (v - 119.5) / HEIGHT
    lower = rows.shift + rows.turn * x + (rows.stretch + rows.twist * x) * y
    right = cv2.remap(
        scene, u + 60 + DISPARITY, (v + 20 - lower).astype(np.float32), cv2.INTER_CUBIC
    )
    images = [image + rng.normal(0, noise, right.shape) for image in (scene[20:260, 60:380], right)]
    left, right = (np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in images)
    return left, right


def matched(left: UInt8, right: UInt8, disparity: Float32 | None = None) -> DisparityMap:
    if disparity is None:
        disparity = np.full(left.shape, DISPARITY, np.float32)
    return DisparityMap(disparity=disparity, largest=64.0, left=left, right=right)


def test_shift_turn_stretch_and_twist_are_measured() -> None:
    tracker = RowTracker()
    assert tracker.learn(matched(*pair(OFF)))
    assert tracker.rows.shift == pytest.approx(0.3, abs=0.03)
    assert tracker.rows.turn == pytest.approx(-0.2, abs=0.03)
    assert tracker.rows.stretch == pytest.approx(0.1, abs=0.03)
    assert tracker.rows.twist == pytest.approx(-0.15, abs=0.04)
    assert tracker.offset == tracker.rows.shift


def test_noise_does_not_make_them_less() -> None:
    tracker = RowTracker()
    tracker.learn(matched(*pair(OFF, noise=12.0)))
    assert tracker.rows.shift == pytest.approx(0.3, abs=0.05)


def test_rows_that_fit_are_left_alone() -> None:
    tracker = RowTracker()
    assert not tracker.learn(matched(*pair(Rows())))
    assert tracker.rows.beside(Rows()) < 0.05


def test_undone_rows_lie_where_the_left_image_has_them() -> None:
    _, right = pair(OFF, noise=0.0)
    _, wanted = pair(Rows(), noise=0.0)
    inside = np.s_[4:-4, :-20]
    before = np.abs(right[inside].astype(float) - wanted[inside]).mean()
    after = np.abs(OFF.undone(right)[inside].astype(float) - wanted[inside]).mean()
    assert before > 2
    assert after < 0.3 * before


def test_an_image_whose_rows_fit_is_not_touched() -> None:
    assert Rows().undone(BLANK) is BLANK


def test_frame_by_frame_they_become_better_known() -> None:
    tracker = RowTracker()
    misses = []
    for seed in range(12):
        left, right = pair(OFF, noise=6.0, seed=seed)
        tracker.learn(matched(left, tracker.rows.undone(right)))
        misses.append(tracker.rows.beside(OFF))
    assert misses[-1] < 0.05
    assert misses[-1] < 0.7 * misses[0]


@pytest.mark.parametrize("shift", [-1.6, 2.3])
def test_rows_off_by_pixels_are_told_roughly_and_then_finely(shift: float) -> None:
    off = replace(OFF, shift=shift)
    left, right = pair(off)
    tracker = RowTracker()
    assert tracker.learn(matched(left, right))
    assert tracker.learn(matched(left, tracker.rows.undone(right)))
    assert tracker.rows.beside(off) < 0.15


def test_a_camera_that_is_bent_on_the_way_is_measured_anew() -> None:
    tracker = RowTracker()
    for seed in range(5):
        tracker.learn(matched(*pair(Rows(), seed=seed)))
    left, right = pair(Rows(shift=0.9), seed=9)
    assert tracker.learn(matched(left, tracker.rows.undone(right)))
    assert tracker.offset == pytest.approx(0.9, abs=0.1)


def test_wrong_matches_do_not_pull_them() -> None:
    disparity = np.full((HEIGHT, WIDTH), DISPARITY, np.float32)
    disparity[:, :100] = 40.0
    tracker = RowTracker()
    tracker.learn(matched(*pair(OFF), disparity))
    assert tracker.rows.shift == pytest.approx(0.3, abs=0.05)


def test_plain_or_unmatched_images_tell_nothing() -> None:
    nothing = np.full((HEIGHT, WIDTH), np.nan, np.float32)
    for given in (matched(BLANK, BLANK), matched(*pair(OFF), nothing)):
        tracker = RowTracker()
        assert not tracker.learn(given) or math.isfinite(tracker.offset)
        assert not tracker.learn(matched(BLANK, BLANK))


def test_a_disparity_map_without_images_tells_nothing() -> None:
    tracker = RowTracker()
    assert not tracker.learn(DisparityMap(disparity=np.ones((9, 9), np.float32)))
    assert math.isnan(tracker.offset)


@pytest.mark.parametrize("shape", [(12, 300), (300, 12)])
def test_images_too_small_for_a_cell_tell_nothing(shape: tuple[int, int]) -> None:
    image = np.full(shape, 90, dtype=np.uint8)
    assert not RowTracker().learn(matched(image, image))


@pytest.mark.skipif(not COMPILED, reason="there is no compiled core")
@pytest.mark.parametrize(
    "rows",
    [OFF, Rows(shift=-2.6), Rows(turn=1.7, stretch=-0.9, twist=0.8), Rows(shift=0.4, turn=-0.4)],
)
def test_core_and_opencv_undo_the_same(rows: Rows) -> None:
    _, right = pair(Rows(), noise=0.0)
    both = [rows.undone(right, compiled=compiled).astype(int) for compiled in (True, False)]
    assert np.abs(both[0] - both[1]).max() <= 4  # a 64th of a row where it changes by 200 a row
    assert np.abs(both[0] - both[1]).mean() < 0.5


@pytest.mark.skipif(not COMPILED, reason="there is no compiled core")
@pytest.mark.parametrize("level", levels())
def test_core_interpolates_by_cubic_convolution_on_every_level(level: str) -> None:
    column = np.array([10, 20, 60, 200, 90, 30], dtype=np.uint8)
    image = np.repeat(column[:, None], 37, axis=1)
    slid = np.empty_like(image)
    core.slide_rows(image, first=0.25, across=0.0, down=0.0, twist=0.0, answer=slid, level=level)
    # Keys' weights at a quarter for a = -0.75: -0.10546875, 0.87890625, 0.26171875, -0.03515625
    assert slid[2].tolist() == [100] * 37  # -2.11 + 52.73 + 52.34 - 3.16 = 99.80


def test_corners_are_not_asked_again_once_cells_have_told(monkeypatch: pytest.MonkeyPatch) -> None:
    left, right = pair(OFF)
    tracker = RowTracker()
    tracker.learn(matched(left, right))
    monkeypatch.setattr("bearcub.stereo.rows.epipolar_offset", lambda *_, **__: 0.6)
    tracker.learn(matched(left, tracker.rows.undone(right)))
    assert tracker.rows.beside(OFF) < 0.1


def test_rows_that_change_by_a_third_of_a_row_are_measured_anew_at_once() -> None:
    tracker = RowTracker()
    for seed in range(5):
        left, right = pair(OFF, seed=seed)
        tracker.learn(matched(left, tracker.rows.undone(right)))
    bent = replace(OFF, shift=OFF.shift - 0.35)
    left, right = pair(bent, seed=9)
    assert tracker.learn(matched(left, tracker.rows.undone(right)))
    tracker.learn(matched(left, tracker.rows.undone(right)))
    assert tracker.rows.beside(bent) < 0.1

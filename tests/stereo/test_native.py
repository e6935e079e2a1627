"""The compiled matcher does what its twin in NumPy does, on every level, with any threads."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.matchers import SearchRange
from bearcub.stereo.native import NativeMatcher, Smoothness, levels, reason_missing

pytestmark = pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")

LEVELS = levels()
OUTSIDE = 255


def textured(height: int, width: int, *, seed: int = 0) -> UInt8:
    noise = np.random.default_rng(seed).normal(0, 60, (height, width))
    return np.clip(cv2.GaussianBlur(128 + noise, (0, 0), 1.0), 0, 255).astype(np.uint8)


def stepped_pair(height: int, width: int, *, seed: int = 0) -> tuple[UInt8, UInt8]:
    """Return a pair with disparity 3 above and 11 below, and some noise of each image's own."""
    wide = textured(height, width + 11, seed=seed)
    left, right = wide[:, :width].copy(), wide[:, 3 : 3 + width].copy()
    right[height // 2 :] = wide[height // 2 :, 11:]
    random = np.random.default_rng(seed + 1)
    noisy = [np.clip(x + random.normal(0, 4, x.shape), 0, 255) for x in (left, right)]
    return noisy[0].astype(np.uint8), noisy[1].astype(np.uint8)


def naive_steps(left: UInt8, right: UInt8, search: SearchRange, *, uniqueness: int) -> Float32:
    """Return the disparity before the filters, one pixel and one path at a time."""
    smooth = Smoothness()
    cost = naive_costs(left, right, search)
    grey = left.astype(int)
    across = penalty(smooth, np.abs(np.diff(grey, axis=1, prepend=grey[:, :1])))
    down = penalty(smooth, np.abs(np.diff(grey, axis=0, prepend=grey[:1])))
    ahead = naive_path(cost.transpose(1, 0, 2), across.T, smooth.small_step).transpose(1, 0, 2)
    mirrored = np.roll(across[:, ::-1], 1, axis=1)
    back = naive_path(cost[:, ::-1].transpose(1, 0, 2), mirrored.T, smooth.small_step)
    back = back.transpose(1, 0, 2)[:, ::-1]
    total = np.minimum(ahead + back + naive_path(cost, down, smooth.small_drop), OUTSIDE)
    return naive_winners(total, search, uniqueness=uniqueness)


def penalty(smooth: Smoothness, change: np.ndarray) -> np.ndarray:
    less = smooth.large_step - (change * smooth.edge_discount >> 2)
    return np.asarray(np.maximum(less, smooth.least_step))


def census(image: UInt8) -> np.ndarray:
    wide = np.pad(image.astype(int), 2, mode="edge")
    height, width = image.shape
    weights = np.outer([1, 2, 1], [1, 2, 1])
    mean = sum(
        weights[v, u] * wide[1 + v : 1 + v + height, 1 + u : 1 + u + width]
        for v in range(3)
        for u in range(3)
    )
    return np.stack(
        [
            wide[v : v + height, u : u + width] > np.minimum(mean // 16 + 1, 255)
            for v in range(5)
            for u in range(5)
            if (u, v) != (2, 2)
        ],
        axis=2,
    )


def naive_costs(left: UInt8, right: UInt8, search: SearchRange) -> np.ndarray:
    height, width = left.shape
    cost = np.full((height, width, search.count), OUTSIDE)
    first, second = census(left), census(right)
    for x in range(width):
        for lane in range(search.count):
            there = x - search.smallest - lane
            if 0 <= there < width:
                cost[:, x, lane] = (first[:, x] != second[:, there]).sum(axis=1)
    return cost


def naive_path(cost: np.ndarray, large: np.ndarray, small: int) -> np.ndarray:
    """Sum costs along the first axis; see Hirschmüller, equation 13."""
    path = np.empty_like(cost)
    last = np.zeros_like(cost[0])
    for i, here in enumerate(cost):
        beside = np.pad(last, ((0, 0), (1, 1)), constant_values=OUTSIDE)
        near = np.minimum(np.minimum(beside[:, :-2], beside[:, 2:]) + small, last)
        change = np.minimum(near - last.min(axis=1, keepdims=True), large[i][:, None])
        last = path[i] = np.minimum(change + here, OUTSIDE)
    return path


def naive_winners(total: np.ndarray, search: SearchRange, *, uniqueness: int) -> Float32:
    height, width, count = total.shape
    first = 2 if search.largest > 0 else 0  # there the window leaves the right image
    last = width - 1 - (2 if search.smallest < 0 else 0)
    answer = np.full((height, width), np.nan, np.float32)
    lanes = total.argmin(axis=2)
    for v in range(height):
        right: dict[int, tuple[int, int]] = {}
        for x in range(width):
            key = (total[v, x, lanes[v, x]], lanes[v, x])
            right[x - lanes[v, x]] = min(key, right.get(x - lanes[v, x], key))
        for x in range(width):
            lane, sums = int(lanes[v, x]), total[v, x]
            best = sums[lane]
            others = np.delete(sums, slice(max(lane - 3, 0), lane + 4))
            agrees = abs(right[x - lane][1] - lane) <= 2
            if not first <= x - search.smallest - lane <= last:
                continue
            if best == OUTSIDE or 100 * others.min() <= (100 + uniqueness) * best or not agrees:
                continue
            before = sums[lane - 1] if lane > 0 else OUTSIDE
            after = sums[lane + 1] if lane < count - 1 else OUTSIDE
            rise = before + after - 2 * best
            offset = 0.0
            if before < OUTSIDE and after < OUTSIDE and rise > 0:
                offset = np.floor(32 * (before - after) / rise + 0.5) / 64
            answer[v, x] = search.smallest + max(lane + offset, 0)
    return answer


def filtered(disparity: Float32, smallest: int) -> Float32:
    """Return the median of 3 x 3, smoothed over 5 x 5."""
    known = np.isfinite(disparity)
    height, width = disparity.shape
    even = np.add.outer(np.arange(height), np.arange(width)) % 2 == 0
    missing = np.where(even, 2**15 - 1, -(2**15))  # in balance: no median is pulled to a side
    steps = np.where(known, (np.nan_to_num(disparity) - smallest) * 64, missing).astype(np.int16)
    middle = np.asarray(cv2.medianBlur(steps, 3)).astype(int)
    middle[window(known, 1).sum(axis=0) < 5] = -(2**20)
    around = window(middle, 2)
    near = np.abs(around - middle) <= 96
    change = ((around - middle) * near).sum(axis=0) / near.sum(axis=0)
    smooth = middle + np.floor(change.astype(np.float32) + np.float32(0.5))
    believed = (middle >= 0) & (near.sum(axis=0) >= 13)
    found = np.where(believed, smallest + smooth / 64, np.nan).astype(np.float32)
    there = np.arange(width) - found
    return np.where((there >= 0) & (there <= width - 1), found, np.float32(np.nan))


def window(image: np.ndarray, reach: int) -> np.ndarray:
    """Return what lies around each pixel, the outermost repeated beyond the border."""
    wide = np.pad(image, reach, mode="edge")
    side = 2 * reach + 1
    views = np.lib.stride_tricks.sliding_window_view(wide, (side, side))
    return np.moveaxis(views.reshape(*image.shape, -1), 2, 0)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("smallest", [0, -5, 4])
def test_it_agrees_with_its_naive_twin_to_the_bit(level: str, smallest: int) -> None:
    left, right = stepped_pair(21, 45)
    search = SearchRange(smallest, 16)
    expected = filtered(naive_steps(left, right, search, uniqueness=10), smallest)
    found = NativeMatcher(search, uniqueness=10, speckle_area=0, level=level)(left, right)
    assert np.isfinite(expected).mean() > 0.5
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("shift", [17, 40, 60])
def test_a_known_shift_is_found_and_nothing_else(shift: int) -> None:
    wide = textured(100, 260 + shift)
    found = NativeMatcher(SearchRange(0, 64))(wide[:, :260], wide[:, shift:])
    # The right image shows what is `shift` columns to the right: left column x is right x - shift.
    assert (np.abs(found[3:-3, shift + 4 : -4] - shift) < 0.26).mean() > 0.99
    assert np.isnan(found[:, :shift]).mean() > 0.95


def test_what_is_not_matched_does_not_pull_the_rest_farther_off() -> None:
    random = np.random.default_rng(0)
    weak = cv2.GaussianBlur(random.normal(0, 1, (240, 410)), (0, 0), 3.0)
    weak *= 5 / weak.std()
    left, right = (
        np.rint(100 + part + random.normal(0, 2, part.shape)).astype(np.uint8)
        for part in (weak[:, :400], weak[:, 10:])
    )
    found = NativeMatcher(SearchRange(0, 32), uniqueness=10)(left, right)[20:-20, 50:-20]
    assert np.isfinite(found).mean() > 0.9
    assert np.nanmean(found) == pytest.approx(10.0, abs=0.05)  # 9.92 with all gaps below


def test_levels_and_threads_give_the_same_answer_to_the_bit() -> None:
    left, right = stepped_pair(345, 250, seed=3)
    search = SearchRange(-3, 48)
    expected = NativeMatcher(search, level=LEVELS[0])(left, right)
    assert np.isfinite(expected).mean() > 0.8
    for level in LEVELS:
        for threads in (1, 2, 3, 4):
            matcher = NativeMatcher(search, level=level, threads=threads)
            np.testing.assert_array_equal(matcher(left, right), expected)


@pytest.mark.parametrize("count", range(16, 257, 16))
def test_every_number_of_disparities_works_on_every_level(count: int) -> None:
    left, right = stepped_pair(30, 300, seed=count)
    answers = [NativeMatcher(SearchRange(0, count), level=level)(left, right) for level in LEVELS]
    below = answers[0][17:-2, 14:-14]
    assert (np.abs(below - 11) < 0.5).mean() > 0.9
    for answer in answers[1:]:
        np.testing.assert_array_equal(answer, answers[0])


@settings(max_examples=60, deadline=None)
@given(
    height=st.integers(1, 90),
    width=st.integers(1, 150),
    count=st.integers(1, 16).map(lambda n: 16 * n),
    smallest=st.integers(-200, 200),
    rows=st.integers(1, 3),
    seed=st.integers(0, 2**31),
    area=st.integers(0, 200),
    texture=st.sampled_from([0.0, 8.0]),
)
def test_any_size_range_and_stride_is_answered_alike_on_every_level(
    *,
    height: int,
    width: int,
    count: int,
    smallest: int,
    rows: int,
    seed: int,
    area: int,
    texture: float,
) -> None:
    pair = np.random.default_rng(seed).integers(0, 256, (2, rows * height, width + 7), np.uint8)
    left, right = pair[:, ::rows, 5 : 5 + width]  # rows apart, and not where vectors begin
    search = SearchRange(smallest, count)
    answers = [
        NativeMatcher(
            search, level=level, threads=threads, speckle_area=area, texture=texture, uniqueness=0
        ).with_confidence(left, right)
        for level in LEVELS
        for threads in (1, 3)
    ]
    disparity, confidence = answers[0]
    for other in answers[1:]:
        np.testing.assert_array_equal(other[0], disparity)
        np.testing.assert_array_equal(other[1], confidence)
    known = np.isfinite(disparity)
    assert (confidence[~known] == 0).all()
    assert np.all((disparity >= smallest) & (disparity <= smallest + count - 0.5) | ~known)
    there = np.arange(width) - disparity
    assert np.all((there >= 0) & (there <= width - 1) | ~known)


def test_sixteen_bits_are_told_apart_where_eight_would_be_flat() -> None:
    wide = np.random.default_rng(0).integers(2000, 2016, (60, 140)).astype(np.uint16)
    left, right = wide[:, :130], wide[:, 10:]
    found = NativeMatcher(SearchRange(0, 32), bits=12)(left, right)
    assert (np.abs(found[3:-3, 14:-4] - 10) < 0.2).mean() > 0.99
    flat = [(x >> 4).astype(np.uint8) for x in (left, right)]
    assert np.ptp(flat) == 0


def test_bytes_give_much_the_same_answer_in_either_width() -> None:
    left, right = stepped_pair(60, 100)
    narrow = NativeMatcher(SearchRange(0, 32))(left, right)
    words = [x.astype(np.uint16) * np.uint16(256) for x in (left, right)]
    wide = NativeMatcher(SearchRange(0, 32))(words[0], words[1])
    # A grey level of 16 bits is finer, and so is what counts as brighter.
    both = np.isfinite(wide) & np.isfinite(narrow)
    assert both.mean() > 0.98 * np.isfinite(narrow).mean()
    assert (np.abs(wide - narrow)[both] < 0.1).mean() > 0.95


def test_speckles_go_as_opencv_would_have_them_go() -> None:
    left, right = stepped_pair(200, 240, seed=5)
    left[60:140, 80:200] = textured(80, 120, seed=9)  # matches nothing: small patches
    search = SearchRange(0, 64)
    raw = NativeMatcher(search, uniqueness=0, speckle_area=0)(left, right)
    steps = np.where(np.isnan(raw), -1, raw * 64).astype(np.int16)
    cv2.filterSpeckles(steps, -1, 60, 128)
    found = NativeMatcher(search, uniqueness=0, speckle_area=60, threads=2)(left, right)
    assert np.isfinite(raw).sum() - np.isfinite(found).sum() > 500
    np.testing.assert_array_equal(found, np.where(steps < 0, np.nan, steps / 64))


def test_confidence_is_high_on_texture_and_low_where_it_repeats() -> None:
    wide = textured(60, 220)
    wide[30:] = wide[30:, :16][:, np.arange(220) % 16]  # a pattern of 16 columns
    matcher = NativeMatcher(SearchRange(0, 64), uniqueness=0)
    _, confidence = matcher.with_confidence(wide[:, :200], wide[:, 20:])
    assert np.median(confidence[5:25, 90:190]) > 200
    assert np.median(confidence[40:55, 90:190]) < 40


def test_the_texture_gate_takes_back_what_has_no_gradient_along_the_row() -> None:
    wide = textured(60, 160)
    wide[30:] = (128 + (wide[30:].astype(int) - 128) // 16).astype(np.uint8)
    left, right = wide[:, :150], wide[:, 10:]
    inside = np.s_[36:-3, 16:-6]
    search = SearchRange(0, 32)
    assert np.isfinite(NativeMatcher(search, speckle_area=0)(left, right)[inside]).mean() > 0.5
    gated = NativeMatcher(search, speckle_area=0, texture=3.0)(left, right)
    assert np.isnan(gated[inside]).all()
    assert np.isfinite(gated[3:24, 16:-6]).mean() > 0.99
    flat = np.full((40, 60), 90, np.uint8)
    assert np.isnan(NativeMatcher(search, texture=0.1)(flat, flat)).all()


@pytest.mark.parametrize(("gain", "gamma"), [(0.7, 1.0), (1.4, 1.0), (1.0, 0.8), (1.0, 1.25)])
def test_another_exposure_of_the_right_camera_changes_little(gain: float, gamma: float) -> None:
    wide = (40 + textured(80, 260) // 2).astype(np.uint8)
    left, right = wide[:, :240], wide[:, 20:]
    other = np.clip(255 * (right / 255) ** gamma * gain, 0, 255).astype(np.uint8)
    found = NativeMatcher(SearchRange(0, 64))(left, other)
    assert (np.abs(found[3:-3, 26:-6] - 20) < 0.5).mean() > 0.97


def test_working_memory_is_kept_from_frame_to_frame() -> None:
    left, right = stepped_pair(480, 640)
    matcher = NativeMatcher(SearchRange(0, 64), threads=2)
    assert matcher.working_memory == 0
    matcher(left, right)
    held = matcher.working_memory
    matcher(left, right)
    assert matcher.working_memory == held < 8e6


def test_all_that_the_core_holds_is_told() -> None:
    core = pytest.importorskip("bearcub.stereo._native")
    image = np.zeros((480, 640), np.uint8)
    before = core.held_bytes()
    matcher = NativeMatcher(SearchRange(0, 64), threads=4)
    matcher(image, image)
    assert core.held_bytes() - before == matcher.working_memory < 8e6
    del matcher
    assert core.held_bytes() == before


def test_what_it_cannot_do_is_refused_in_a_sentence() -> None:
    image = np.zeros((20, 30), np.uint8)
    matcher = NativeMatcher(SearchRange(0, 16))
    with pytest.raises(InputError, match="272 disparities to search: the native matcher tries 256"):
        NativeMatcher(SearchRange(0, 272))
    with pytest.raises(InputError, match="level mmx: this machine runs "):
        NativeMatcher(SearchRange(0, 16), level="mmx")
    with pytest.raises(InputError, match="threads = 0: must be from 1 to 1024"):
        NativeMatcher(SearchRange(0, 16), threads=0)
    with pytest.raises(InputError, match=r"large_step=61.*<= 60"):
        Smoothness(large_step=61)
    with pytest.raises(InputError, match=r"left is uint8 of shape \(20, 30\) and right uint8"):
        matcher(image, image[:, :-1])
    with pytest.raises(InputError, match="right: expected an image of uint8 or uint16"):
        matcher(image, image.astype(np.float32))  # type: ignore[arg-type]


def test_words_of_eight_bits_are_refused_in_one_sentence() -> None:
    with pytest.raises(InputError, match="bits = 8: must be from 9 to 16"):
        NativeMatcher(SearchRange(0, 32), bits=8)

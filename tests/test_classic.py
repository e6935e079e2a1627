"""The 2005 column analysis: printed semantics on hand-worked maps, both slips, and as meant."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.classic import (
    PAPER,
    ClassicConfig,
    Peak,
    cancel_floor,
    column_histogram,
    detect,
    levels_from_disparity,
    levels_from_words,
    peaks,
    profiles,
    row_histogram,
)
from bearcub.errors import ConfigError, InputError
from bearcub.geometry import Attitude, Projection
from bearcub.messages import Float32, Float64, Int32

RIG = Projection(fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
TILTED = replace(PAPER, tilt_factor=1.0)


def uniform(level: int, *, width: int = 10) -> Int32:
    return np.full((480, width), level, dtype=np.int32)


def cancelled_rows(kept: Int32, column: int) -> tuple[int, int]:
    """First and last cancelled row of a column, after checking that nothing between is left."""
    rows = np.flatnonzero(kept[:, column] == 0)
    assert rows[-1] - rows[0] + 1 == len(rows)
    return int(rows[0]), int(rows[-1])


def paper_plane(*, roll_deg: float = 0.0) -> Float64:
    down = Attitude(roll=np.radians(roll_deg), pitch=np.radians(5.9)).down()
    return RIG.plane(height=1.2, down=down)


def scene(*, roll_deg: float = 0.0, can: bool = True) -> Float32:
    """The paper's garbage can, 3.05 m ahead, 0.6 m wide and 0.75 m high, on a flat floor."""
    a, b, c = paper_plane(roll_deg=roll_deg)
    u, v = np.meshgrid(np.arange(640), np.arange(480))
    disparity: Float32 = np.maximum(a * u + b * v + c, 0.0).astype(np.float32)
    if can:
        disparity[260:355, 280:356] = np.maximum(15.2, disparity[260:355, 280:356])
    return disparity


# (printed row - 1): Base = 220 + 10 (k - 2), 31 rows; level 22 is the paper's 420:450
@pytest.mark.parametrize(
    ("level", "first", "last"), [(2, 219, 249), (3, 229, 259), (22, 419, 449), (25, 449, 479)]
)
def test_level_loses_the_printed_band_in_every_column(level: int, first: int, last: int) -> None:
    kept = cancel_floor(uniform(level), printed=True)
    assert [cancelled_rows(kept, column) for column in range(10)] == [(first, last)] * 10


@pytest.mark.parametrize("level", [0, 1, 26, 255])
def test_levels_outside_the_kill_loop_are_kept(level: int) -> None:
    np.testing.assert_array_equal(cancel_floor(uniform(level), printed=True), uniform(level))


def test_band_that_leaves_the_image_below_is_cut_off() -> None:
    kept = cancel_floor(uniform(25)[:460], printed=True)
    assert cancelled_rows(kept, 0) == (449, 459)


# slip 1: T is added once per level, so level k is shifted by T (k - 2), in columns 5 and 10 only
@pytest.mark.parametrize(("level", "shift"), [(2, 0), (3, 1), (12, 10), (22, 20)])
def test_printed_tilt_shifts_only_every_fifth_column_and_more_at_higher_levels(
    level: int, shift: int
) -> None:
    kept = cancel_floor(uniform(level), printed=True, config=TILTED)
    first = 219 + 10 * (level - 2)
    for column in range(10):
        top = first + (shift if column in {4, 9} else 0)
        assert cancelled_rows(kept, column) == (top, top + 30)


def test_printed_tilt_does_not_accumulate_over_columns() -> None:
    kept = cancel_floor(uniform(3, width=640), printed=True, config=TILTED)
    assert cancelled_rows(kept, 4) == cancelled_rows(kept, 639) == (230, 260)
    assert cancelled_rows(kept, 0) == cancelled_rows(kept, 638) == (229, 259)


# 11 columns, centre at index 5: one row per 5 columns, rounded, at every level alike
@pytest.mark.parametrize("level", [2, 22])
def test_meant_tilt_grows_with_the_column_and_not_with_the_level(level: int) -> None:
    kept = cancel_floor(uniform(level, width=11), printed=False, config=TILTED)
    shifts = [cancelled_rows(kept, u)[0] - (219 + 10 * (level - 2)) for u in range(11)]
    assert shifts == [-1, -1, -1, 0, 0, 0, 0, 0, 1, 1, 1]


def test_printed_and_meant_agree_on_a_level_robot() -> None:
    levels = np.random.default_rng(1).integers(0, 30, (480, 20)).astype(np.int32)
    np.testing.assert_array_equal(
        cancel_floor(levels, printed=True), cancel_floor(levels, printed=False)
    )


def printed_code(levels: Int32, tilt_factor: int) -> Int32:
    """The paper's loops, statement by statement, with 1-based rows and columns."""
    kept = levels.copy()
    height, width = levels.shape
    for i in range(1, width + 1):
        base = 220
        for kill_value in range(2, 26):
            for row in range(base, base + 30 + 1):
                if 1 <= row <= height and kept[row - 1, i - 1] == kill_value:
                    kept[row - 1, i - 1] = 0
            base += 10
            if i % 5 == 0:
                base += tilt_factor
    return kept


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), tilt=st.integers(-3, 3), height=st.integers(200, 500))
def test_cancelling_equals_the_loops_of_the_paper(seed: int, tilt: int, height: int) -> None:
    levels = np.random.default_rng(seed).integers(0, 30, (height, 6)).astype(np.int32)
    config = replace(PAPER, tilt_factor=float(tilt))
    np.testing.assert_array_equal(
        cancel_floor(levels, printed=True, config=config), printed_code(levels, tilt)
    )


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), tilt=st.floats(-3, 3), width=st.integers(1, 13))
def test_mirrored_map_with_the_opposite_tilt_is_cancelled_mirrored(
    seed: int, tilt: float, width: int
) -> None:
    levels = np.random.default_rng(seed).integers(0, 30, (480, width)).astype(np.int32)
    config = replace(PAPER, tilt_factor=tilt)
    mirrored = cancel_floor(
        levels[:, ::-1], printed=False, config=replace(config, tilt_factor=-tilt)
    )
    np.testing.assert_array_equal(
        mirrored[:, ::-1], cancel_floor(levels, printed=False, config=config)
    )


# slip 2: 0x0F80 is 15.5 px
def test_printed_reader_keeps_the_fraction_and_the_meant_one_the_whole_part() -> None:
    words = np.array([[0x0F80, 0x0F00, 0x1A40, 0xFF00]], dtype=np.uint16)
    assert levels_from_words(words, printed=True).tolist() == [[128, 0, 64, 0]]
    assert levels_from_words(words, printed=False).tolist() == [[15, 15, 26, 255]]


def test_printed_reader_is_right_on_the_byte_swapped_files_the_authors_had() -> None:
    words = np.array([[0x0F80, 0x1A40]], dtype=np.uint16)
    assert levels_from_words(words.byteswap(), printed=True).tolist() == [[15, 26]]


def test_missing_infinite_and_negative_disparities_have_no_level() -> None:
    disparity = np.array([[np.nan, np.inf, -3.0, 0.0, 0.9, 15.99, 1e20]], dtype=np.float32)
    assert levels_from_disparity(disparity).tolist() == [[0, 0, 0, 0, 0, 15, 0]]


def test_histograms_count_every_level_per_column_and_row() -> None:
    levels = np.array([[2, 2, 0], [2, 1, 3], [2, 3, 3]], dtype=np.int32)
    assert column_histogram(levels, n_levels=4).tolist() == [
        [0, 0, 0],
        [0, 1, 0],
        [3, 1, 0],
        [0, 1, 2],
    ]
    assert row_histogram(levels, n_levels=4).tolist() == [[0, 0, 2, 0], [0, 1, 1, 1], [0, 0, 1, 2]]


# (2*30 + 3*20 + 4*50) / 100 = 3.2
def test_peak_has_the_area_and_centre_of_area_of_its_counts() -> None:
    counts = np.zeros((6, 8), dtype=np.int64)
    counts[4] = [0, 19, 30, 20, 50, 0, 90, 0]
    counts[1] = 500  # below the first level: too far
    config = replace(PAPER, peak_columns=3, last_level=5, n_levels=6)
    assert peaks(counts, config=config) == (Peak(level=4, first=2, last=4, area=100, centre=3.2),)


def test_peaks_at_both_image_borders_are_found() -> None:
    counts = np.zeros((6, 12), dtype=np.int64)
    counts[3, :5] = counts[3, 7:] = 20
    assert [(p.first, p.last) for p in peaks(counts)] == [(0, 4), (7, 11)]


# fB/15 = 3.088 m (10 ft = 3.048 m); 76 columns * 3.088 / 386 = 0.608 m; 90 rows: 0.72 m
def test_garbage_can_is_found_at_level_15_with_its_size() -> None:
    answer = detect(scene(), RIG, config=ClassicConfig.from_plane(paper_plane(), shape=(480, 640)))
    (can,) = answer.objects
    assert can.peak.level == 15
    assert (can.peak.first, can.peak.last) == (280, 355)
    assert can.distance == pytest.approx(386 * 0.12 / 15)
    assert can.width == pytest.approx(0.608, abs=1e-3)
    assert (can.top, can.bottom) == (260, 349)  # the band of level 15 starts at row 350
    assert can.height == pytest.approx(0.72, abs=1e-3)
    assert can.bearing == pytest.approx((319.5 - 317.5) / 386, abs=1e-4)  # left is positive


@pytest.mark.parametrize("roll_deg", [-12.0, 12.0])
def test_meant_correction_clears_the_floor_of_a_rolled_robot_and_the_printed_does_not(
    roll_deg: float,
) -> None:
    config = ClassicConfig.from_plane(
        paper_plane(roll_deg=roll_deg), shape=(480, 640), tolerance=0.5
    )
    floor = scene(roll_deg=roll_deg, can=False)
    meant = detect(floor, RIG, config=config)
    printed = detect(floor, RIG, config=config, printed=True)
    seen = np.count_nonzero(meant.levels >= 2)
    assert np.count_nonzero(meant.kept >= 2) == 0
    assert np.count_nonzero(printed.kept >= 2) > 0.4 * seen


@pytest.mark.parametrize("roll_deg", [-12.0, 0.0, 12.0])
def test_can_is_measured_alike_at_every_roll(roll_deg: float) -> None:
    config = ClassicConfig.from_plane(
        paper_plane(roll_deg=roll_deg), shape=(480, 640), tolerance=0.5
    )
    (can,) = detect(scene(roll_deg=roll_deg), RIG, config=config).objects
    assert can.peak.level == 15
    assert can.width == pytest.approx(0.6, rel=0.05)


def test_a_face_between_two_levels_is_one_object() -> None:
    disparity = np.zeros((480, 640), dtype=np.float32)
    disparity[100:180, 100:200] = 14.0
    disparity[130:180, 100:200] = 15.0
    (face,) = detect(disparity, RIG).objects
    assert (face.peak.level, face.peak.area) == (15, 5000)


def test_objects_come_nearest_first_and_equal_bearings_stay_apart() -> None:
    disparity = np.zeros((480, 640), dtype=np.float32)
    disparity[20:100, 300:340] = 10.0
    disparity[110:190, 300:340] = 20.0
    assert [thing.peak.level for thing in detect(disparity, RIG).objects] == [20, 10]


def test_an_empty_map_has_no_objects() -> None:
    assert detect(np.full((480, 640), np.nan, dtype=np.float32), RIG).objects == ()


def test_constants_derived_for_the_rig_of_the_paper_are_the_printed_ones() -> None:
    config = ClassicConfig.from_plane(paper_plane(), shape=(480, 640))
    assert config.base == pytest.approx(220, abs=1.5)
    assert config.floor_increment == pytest.approx(10, abs=0.1)
    assert config.spread == pytest.approx(30, abs=0.3)
    assert config.tilt_factor == 0.0
    assert config.last_level == 27  # (479 - 199.6) / 10.05


# 5 tan(12 deg) = 1.063; REP-103 roll is right side down, where the floor rises to the right
@pytest.mark.parametrize(("roll_deg", "tilt"), [(-12.0, 1.063), (12.0, -1.063)])
def test_tilt_factor_of_figure_16_is_12_degrees_left_side_down(
    roll_deg: float, tilt: float
) -> None:
    plane = paper_plane(roll_deg=roll_deg)
    config = ClassicConfig.from_plane(plane, shape=(480, 640))
    assert config.tilt_factor == pytest.approx(tilt, abs=1e-3)


def test_tolerance_lays_the_band_evenly_about_the_floor() -> None:
    printed = ClassicConfig.from_plane(paper_plane(), shape=(480, 640))
    even = ClassicConfig.from_plane(paper_plane(), shape=(480, 640), tolerance=1.0)
    assert even.spread == pytest.approx(printed.spread)
    assert even.base == pytest.approx(printed.base - printed.floor_increment)


def test_profiles_show_chosen_levels_before_and_after_cancelling() -> None:
    disparity = np.full((480, 10), 3.0, dtype=np.float32)
    disparity[0] = 22.0
    shown = profiles(detect(disparity, RIG, printed=True), levels=(3, 22))
    assert shown.columns[:, 0].tolist() == [[479] * 10, [448] * 10]  # 31 rows less
    assert shown.columns[:, 1].tolist() == [[1] * 10, [1] * 10]
    assert shown.rows[:, 0, 228:231].tolist() == [[10, 10, 10], [10, 0, 0]]
    assert shown.histogram[[3, 22]].tolist() == [4790, 10]
    assert np.flatnonzero(shown.cancelled[:, 0]).tolist() == list(range(229, 260))


@pytest.mark.parametrize("level", [0, 240])
def test_profile_of_a_level_that_does_not_exist_is_refused(level: int) -> None:
    answer = detect(np.zeros((480, 10), dtype=np.float32), RIG)
    with pytest.raises(InputError, match=f"level {level}: expected one from 1 to 239"):
        profiles(answer, levels=(level,))


def test_plane_that_is_no_floor_is_refused() -> None:
    with pytest.raises(InputError, match="expected disparity to grow down"):
        ClassicConfig.from_plane(np.array([0.1, 0.0, 3.0]), shape=(480, 640))


def test_impossible_constants_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"classic\.spread = -1"):
        ClassicConfig(spread=-1)
    with pytest.raises(ConfigError, match="classic levels 2 to 25 of 20"):
        ClassicConfig(n_levels=20)

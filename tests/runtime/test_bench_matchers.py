"""The matchers beside each other: whose turn it is, which pairs there are, how far off they are."""

import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.errors import InputError
from bearcub.runtime.bench_matchers import (
    REFERENCE,
    Pair,
    Score,
    Yardstick,
    contenders,
    mean,
    pairs_in,
    scene,
    score,
    take_turns,
)
from bearcub.stereo import write_disparity
from bearcub.stereo.native import reason_missing

nan = np.nan


def test_matchers_take_turns_and_the_first_turn_is_not_counted() -> None:
    clock = ManualClock()
    turns: list[str] = []

    def taking(name: str, milliseconds: list[int]) -> Callable[[], None]:
        def call() -> None:
            clock.advance(milliseconds[turns.count(name)] / 1000)
            turns.append(name)

        return call

    calls = {"slow": taking("slow", [99, 4, 6]), "fast": taking("fast", [77, 1, 2])}
    times = take_turns(calls, rounds=2, clock=clock)
    assert turns == ["slow", "fast"] * 3
    np.testing.assert_allclose(times["slow"], [4, 6])
    np.testing.assert_allclose(times["fast"], [1, 2])


def test_every_contender_finds_the_floor_of_the_scene() -> None:
    found = contenders(32, threads=(1, 2))
    native = [] if reason_missing() else ["native, 1 thread", "native, 2 threads"]
    assert list(found) == [REFERENCE, "SGBM", "BM", *native]
    for match in found.values():
        disparity = match(*scene(320, 240))
        # The lower left corner is floor: 0.08 (v / 240 - 0.3) 320 px.
        assert np.nanmedian(disparity[200:210, 40:60]) == pytest.approx(14.1, abs=0.5)


def test_an_error_is_scored_on_what_is_matched_and_known() -> None:
    truth = np.array([[9, 10, 10, 10, 10, nan, 10, 10]], np.float32)
    found = np.array([[99, 10.5, 10.25, 12.5, 14, 10, nan, nan]], np.float32)
    image = np.zeros((1, 8), np.uint8)
    pair = Pair(name="made", left=image, right=image, truth=truth)
    assert pair.count == 16
    expected = Score(bad_2=2 / 4, bad_3=1 / 4, density=4 / 6, sub_pixel=0.375)
    assert score(found, pair, first=1) == expected
    nothing = score(np.full_like(found, nan), pair, first=1)
    assert nothing.density == 0
    assert math.isnan(nothing.bad_2)
    other = Score(bad_2=0.0, bad_3=0.75, density=0.0, sub_pixel=0.125)
    assert mean([expected, other]) == Score(bad_2=0.25, bad_3=0.5, density=1 / 3, sub_pixel=0.25)


def test_pairs_are_found_in_the_layouts_of_middlebury(tmp_path: Path) -> None:
    truth = np.array([[np.inf, 3.5], [0, 17.25]], np.float32)
    (tmp_path / "a").mkdir()
    write_disparity(tmp_path / "a" / "disp0.pfm", truth, encoding="pixels")
    (tmp_path / "b").mkdir()
    quarters = np.array([[0, 14], [0, 69]], np.uint8)
    cv2.imwrite(str(tmp_path / "b" / "disp2.png"), quarters)
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "disp0.pfm").touch()  # without its pictures
    for name in ("a/im0.png", "a/im1.png", "b/im2.png", "b/im6.png"):
        cv2.imwrite(str(tmp_path / name), np.full((2, 2, 3), ord(name[4]), np.uint8))
    pairs = pairs_in(tmp_path)
    assert [pair.name for pair in pairs] == ["a", "b"]
    for pair in pairs:
        np.testing.assert_array_equal(pair.truth, [[nan, 3.5], [nan, 17.25]])
        assert pair.count == 32
    assert [(pair.left[0, 0], pair.right[0, 0]) for pair in pairs] == [(48, 49), (50, 54)]
    with pytest.raises(InputError, match=r"holds no pair with truth; expected im0\.png"):
        pairs_in(tmp_path / "c")


def test_yardstick_is_the_median_of_what_the_sample_took() -> None:
    class Ticking(ManualClock):
        steps = iter([0, 0, 0, 0.005, 0, 0, 0, 0.009, 0, 0, 0, 0.006])

        def now_ns(self) -> int:
            self.advance(next(self.steps))
            return super().now_ns()

    yardstick = Yardstick(width=160, height=120, clock=Ticking())
    for _ in range(3):
        yardstick()
    assert yardstick.p50 == pytest.approx(6.0)

"""Matching at half the resolution: small pairs, half the disparities, answers at the full size."""

import numpy as np
import pytest

from bearcub.messages import UInt8
from bearcub.stereo.half import HalfResolution, halved
from bearcub.stereo.matchers import CallableMatcher, SearchRange

nan = np.nan


def test_a_small_pixel_answers_for_four_with_twice_its_disparity() -> None:
    seen: list[UInt8] = []

    def small(left: UInt8, right: UInt8) -> np.ndarray:
        seen.extend((left, right))
        return np.array([[0, 0.5, 1.25], [nan, 0, 1]])

    left = np.array([[1, 3, 10, 10, 0, 0, 9], [5, 7, 10, 10, 0, 0, 9]] * 2 + [[9] * 7], np.uint8)
    found = HalfResolution(CallableMatcher(small, largest=31, fattening=1.5))(left, left)
    np.testing.assert_array_equal(seen[0], [[4, 10, 0]] * 2)
    top, bottom = [0, 0, 1, 1, 2.5, 2.5, 2.5], [nan, nan, 0, 0, 2, 2, 2]
    np.testing.assert_array_equal(found, np.array([top, top, bottom, bottom, bottom], np.float32))


def test_what_it_says_of_itself_is_in_pixels_of_the_full_size() -> None:
    half = HalfResolution(
        CallableMatcher(lambda left, _: left, smallest=-2, largest=31, fattening=1.5)
    )
    assert (half.smallest, half.largest, half.fattening) == (-4, 62, 3)


@pytest.mark.parametrize(
    ("smallest", "count", "expected"),
    [(0, 64, (0, 32)), (0, 48, (0, 32)), (-5, 64, (-3, 48)), (0, 16, (0, 16))],
)
def test_half_the_disparities_are_tried(
    smallest: int, count: int, expected: tuple[int, int]
) -> None:
    assert halved(SearchRange(smallest, count)) == SearchRange(*expected)

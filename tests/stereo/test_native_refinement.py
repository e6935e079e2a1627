"""The compiled refinement does what its twin in NumPy does."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.native import NativeRefinement, levels, reason_missing
from bearcub.stereo.refine import refine

pytestmark = pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")

TOLERANCE = 2e-3  # px: sums of 81 floats in another order, on slopes that nearly vanish


def slanted_pair(height: int, width: int, *, seed: int) -> tuple[UInt8, UInt8, Float32]:
    """Return a pair whose disparity grows with the row, and that disparity."""
    noise = np.random.default_rng(seed).normal(0, 60, (height, width + 40))
    wide = np.clip(cv2.GaussianBlur(128 + noise, (0, 0), 1.2), 0, 255).astype(np.uint8)
    truth = np.repeat(2.0 + 0.11 * np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    columns = np.arange(width, dtype=np.float32) - truth + np.float32(20)
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    left = np.asarray(cv2.remap(wide, columns, rows, cv2.INTER_CUBIC), dtype=np.uint8)
    return left, wide[:, 20 : 20 + width], truth


def test_a_bias_of_the_matcher_is_taken_out() -> None:
    left, right, truth = slanted_pair(100, 160, seed=1)
    found = NativeRefinement()(left, right, truth + np.float32(0.3))
    error = np.abs(found - truth)[8:-8, 20:-8]
    assert np.median(error) < 0.03  # of 0.3
    assert np.percentile(error, 95) < 0.08


@settings(max_examples=40, deadline=None)
@given(
    height=st.integers(1, 90),
    width=st.integers(12, 150),
    seed=st.integers(0, 2**31),
    unknown=st.sampled_from([0.0, 0.3, 1.0]),
    smallest=st.sampled_from([0.0, -9.0]),
)
def test_it_agrees_with_its_twin_on_any_size_and_with_any_threads(
    *, height: int, width: int, seed: int, unknown: float, smallest: float
) -> None:
    left, right, truth = slanted_pair(height, width, seed=seed)
    random = np.random.default_rng(seed)
    noise = random.normal(smallest, 0.3, truth.shape).astype(np.float32)
    disparity: Float32 = truth + noise
    disparity[random.random(truth.shape) < unknown] = np.nan
    expected = refine(left, right, disparity)
    first = NativeRefinement(level=levels()[0])(left, right, disparity)
    np.testing.assert_allclose(first, expected, rtol=0, atol=TOLERANCE)
    for level in levels():
        for threads in (1, 3):
            again = NativeRefinement(level=level, threads=threads)(left, right, disparity)
            np.testing.assert_array_equal(again, first)


def test_rows_may_lie_apart() -> None:
    left, right, truth = slanted_pair(60, 90, seed=2)
    expected = NativeRefinement()(left, right.copy(), truth)
    apart = np.zeros((60, 200), np.uint8)
    apart[:, 33:123] = left
    np.testing.assert_array_equal(NativeRefinement()(apart[:, 33:123], right, truth), expected)


def test_pixels_may_lie_apart() -> None:
    left, right, truth = slanted_pair(60, 90, seed=2)
    expected = NativeRefinement()(left, right, truth)
    left, right = (np.repeat(image, 2, axis=1)[:, ::2] for image in (left, right))
    np.testing.assert_array_equal(NativeRefinement()(left, right, truth), expected)


def test_numbers_without_sense_are_refused() -> None:
    with pytest.raises(InputError, match="threads = 0: must be from 1 to 1024"):
        NativeRefinement(threads=0)

"""The compiled gate does what its twin in NumPy does, to the bit."""

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8
from bearcub.sample import load
from bearcub.stereo.gates import gate
from bearcub.stereo.matchers import SearchRange
from bearcub.stereo.native import NativeGate, NativeMatcher, levels, reason_missing

pytestmark = pytest.mark.skipif(bool(reason_missing()), reason=f"no core: {reason_missing()}")

USUAL: dict[str, Any] = {"agreement": 0.65, "contrast": 0.5, "speckle_area": 100}


def shifted_pair(height: int, width: int, *, shift: float, noise: float, seed: int) -> list[UInt8]:
    """Return a pair of one disparity, and noise of each image's own."""
    random = np.random.default_rng(seed)
    wide = cv2.GaussianBlur(random.normal(128, 90, (height, width + 60)), (0, 0), 1.2)
    columns = np.arange(width, dtype=np.float32)[None].repeat(height, axis=0) + np.float32(30)
    rows = np.arange(height, dtype=np.float32)[:, None].repeat(width, axis=1)
    left = wide[:, 30 : 30 + width]
    right = cv2.remap(wide.astype(np.float32), columns + np.float32(shift), rows, cv2.INTER_LINEAR)
    noisy = [image + random.normal(0, noise, image.shape) for image in (left, right)]
    return [np.clip(image, 0, 255).astype(np.uint8) for image in noisy]


def found_disparity(shape: tuple[int, ...], *, shift: float, unknown: float, seed: int) -> Float32:
    """Return what a matcher could have found: patches of it wrong, unknown or without sense."""
    random = np.random.default_rng(seed)
    error = random.choice([0.0, 0.2, 1.0, 9.0], size=shape)
    smooth = cv2.blur(error, (5, 5)) + random.normal(0, 0.2, shape)
    found: Float32 = (shift + smooth).astype(np.float32)
    found[random.random(shape) < unknown] = np.nan
    odd = random.random(shape) < 0.01
    found[odd] = random.choice([np.inf, -np.inf, 1e30, -7e4, 5000.0], size=int(odd.sum()))
    return found


@settings(max_examples=60, deadline=None)
@given(
    height=st.integers(2, 140),
    width=st.integers(2, 180),
    shift=st.floats(-20, 20),
    noise=st.sampled_from([0.0, 3.0, 12.0]),
    unknown=st.sampled_from([0.0, 0.05, 0.4, 1.0]),
    agreement=st.floats(0.1, 1),
    contrast=st.floats(0, 20),
    speckle_area=st.sampled_from([0, 1, 30, 100, 1000]),
    seed=st.integers(0, 2**31),
)
def test_it_agrees_with_its_twin_on_every_level_and_with_any_threads(
    *,
    height: int,
    width: int,
    shift: float,
    noise: float,
    unknown: float,
    agreement: float,
    contrast: float,
    speckle_area: int,
    seed: int,
) -> None:
    left, right = shifted_pair(height, width, shift=shift, noise=noise, seed=seed)
    disparity = found_disparity(left.shape, shift=shift, unknown=unknown, seed=seed)
    asked: dict[str, Any] = {
        "agreement": agreement,
        "contrast": contrast,
        "speckle_area": speckle_area,
    }
    expected = gate(left, right, disparity, **asked)
    for level in levels():
        for threads in (1, 2, 5):
            native = NativeGate(**asked, threads=threads, level=level)
            np.testing.assert_array_equal(native(left, right, disparity), expected)


def test_it_agrees_with_its_twin_on_the_sample() -> None:
    pair = [np.asarray(cv2.imread(str(path), 0), np.uint8) for path in (load().left, load().right)]
    disparity = NativeMatcher(SearchRange(0, 64))(pair[0], pair[1])
    expected = gate(pair[0], pair[1], disparity, **USUAL)
    assert 0.3 < np.isfinite(expected).mean() < np.isfinite(disparity).mean() - 0.01
    for threads in (1, 2):
        native = NativeGate(**USUAL, threads=threads)
        for _ in range(2):  # the second time its memory is not new
            np.testing.assert_array_equal(native(pair[0], pair[1], disparity), expected)


def test_pixels_may_lie_apart() -> None:
    left, right = shifted_pair(60, 90, shift=4, noise=2, seed=3)
    disparity = found_disparity(left.shape, shift=4, unknown=0.1, seed=3)
    expected = gate(left, right, disparity, **USUAL)
    apart = np.zeros((120, 300), np.uint8)
    rows, columns, both = apart[:60, 33:123], apart[60:, :180:2], np.zeros((120, 180), np.float32)
    rows[:], columns[:], both[::2, ::2] = left, right, disparity
    np.testing.assert_array_equal(NativeGate(**USUAL)(rows, columns, both[::2, ::2]), expected)


def test_another_size_is_no_trouble() -> None:
    native = NativeGate(**USUAL)
    for shape in ((60, 90), (33, 120), (60, 90)):
        left, right = shifted_pair(*shape, shift=4, noise=2, seed=3)
        disparity = found_disparity(left.shape, shift=4, unknown=0.1, seed=3)
        expected = gate(left, right, disparity, **USUAL)
        np.testing.assert_array_equal(native(left, right, disparity), expected)


def test_texture_must_exceed_the_contrast() -> None:
    ramp = np.tile(np.arange(200, dtype=np.uint8), (60, 1))
    disparity = np.zeros(ramp.shape, np.float32)
    # A grey level per pixel: 2 at half the size, 4 over two of its pixels, of which the RMS is 4.
    below, at = (
        np.isfinite(
            NativeGate(agreement=0.65, contrast=contrast, speckle_area=100)(ramp, ramp, disparity)
        )
        for contrast in (3.99, 4.0)
    )
    assert below.mean() > 0.9
    assert not at.any()


def test_numbers_without_sense_are_refused() -> None:
    with pytest.raises(InputError, match="threads = 0: must be from 1 to 1024"):
        NativeGate(**USUAL, threads=0)
    with pytest.raises(InputError, match="level mmx: this machine runs"):
        NativeGate(**USUAL, level="mmx")

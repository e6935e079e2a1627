"""Gates: which of a matcher's answers to believe.

A matcher answers wherever it can, also on blank sky and in the noise of a dark wall. What it says
there has two marks. First, the two images do not agree in detail: noise is drawn anew in each
image, texture is the same in both. Second, it comes in small islands of inconsistent disparity.
Both are measured at half the size, where pixels are averaged two by two: weak texture stands out
better there than noise, and it takes a quarter of the time.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Bool, Float32, UInt8
from bearcub.stereo.images import shifted, shrunk

_MOST_STEPS = 2**14 - 1  # sixteenths of a pixel, either way; farther matches are taken for this far
_WINDOW = 7  # half-size pixels; a side of 14 in the image: the evidence of about 200 pixels


def agreement_gate(
    left: UInt8, right: UInt8, disparity: Float32, *, agreement: float, contrast: float
) -> Bool:
    """Tell where left and right show the same texture at this disparity.

    With ``g`` the horizontal gradient, summed over a small window, the share of it on which the
    images disagree is

        sum (g_left - g_right)^2 / sum (g_left^2 + g_right^2) ,

    the right image shifted by the disparity: 0 for the same texture without noise,
    ``1 / (1 + SNR)`` with noise, 1 for noise alone (0.75 to 0.85 after a matcher has picked the
    most similar noise). It compares the texture with the noise that is there, so that no noise
    level needs to be known, and asphalt of one grey level contrast survives where noise of six
    does not.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Grey rectified pair.
    disparity : ndarray of float32, shape (H, W)
        In pixels of these images; NaN where unmatched.
    agreement : float
        Largest share on which they may disagree, 0 to 1.
    contrast : float
        Least RMS gradient [grey levels per 2 px] whatever the agreement: what is below is the
        rounding of 8 bits.

    Returns
    -------
    ndarray of bool, shape (H, W)
        False also where unmatched.
    """
    known = np.isfinite(disparity)
    weight = known.astype(np.float32)
    here, there = _gradient(left), _gradient(_matched(right, disparity, known))
    texture = _window_sum((here * here + there * there) * weight)
    difference = _window_sum((here - there) ** 2 * weight)
    believed: Bool = known & (difference < np.float32(agreement) * texture)
    return believed & (texture > np.float32(2 * contrast**2) * _window_sum(weight))


def without_islands(disparity: Float32, *, smallest_area: int, step: float) -> Bool:
    """Tell which pixels lie in a connected patch of at least `smallest_area` pixels.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN where unmatched.
    smallest_area : int
        [px].
    step : float
        Neighbours that differ by more [px] are not connected.

    Returns
    -------
    ndarray of bool, shape (H, W)
        False also where unmatched.
    """
    unmatched = np.iinfo(np.int16).min
    numbers = np.clip(np.floor(disparity * np.float32(16)), -_MOST_STEPS, _MOST_STEPS)
    steps = cv2.patchNaNs(numbers, unmatched).astype(np.int16)
    cv2.filterSpeckles(steps, unmatched, smallest_area - 1, 16 * step)
    kept: Bool = steps != unmatched
    return kept


def gate(
    left: UInt8,
    right: UInt8,
    disparity: Float32,
    *,
    agreement: float,
    contrast: float,
    speckle_area: int,
) -> Float32:
    """Return `disparity` with NaN where it is not to be believed.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Grey rectified pair.
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN where unmatched.
    agreement, contrast : float
        See `agreement_gate`; measured on the pair at half the size.
    speckle_area : int
        Smallest connected patch that is kept [px].

    Returns
    -------
    ndarray of float32, shape (H, W)
    """
    height, width = disparity.shape[0] // 2, disparity.shape[1] // 2
    even = np.s_[: 2 * height, : 2 * width]
    small_left, small_right = (
        shrunk(image[even], width=width, height=height) for image in (left, right)
    )
    small = disparity[even][::2, ::2] * np.float32(0.5)
    believed = agreement_gate(
        small_left, small_right, small, agreement=agreement, contrast=contrast
    )
    kept = without_islands(
        _only(small, believed), smallest_area=max(speckle_area // 4, 1), step=0.5
    )
    return _only(disparity, _doubled(kept, disparity.shape))


def _matched(right: UInt8, disparity: Float32, known: Bool) -> UInt8:
    """Return what the right image shows at the match of every left pixel.

    Matches are taken to a 32nd of a pixel, whose interpolation floats hold exactly: the answer is
    the same everywhere.
    """
    parts = np.floor(disparity * np.float32(32) + np.float32(0.5)) / np.float32(32)
    parts[~known] = 0
    shown = shifted(right.astype(np.float32), parts, interpolation=cv2.INTER_LINEAR)
    return (shown + np.float32(0.5)).astype(np.uint8)


def _gradient(image: UInt8) -> Float32:
    return np.asarray(cv2.Sobel(image, cv2.CV_32F, 1, 0, ksize=1))


def _window_sum(values: NDArray[np.floating]) -> Float32:
    return np.asarray(cv2.boxFilter(values, -1, (_WINDOW, _WINDOW), normalize=False))


def _only(disparity: Float32, kept: Bool) -> Float32:
    """Return `disparity` with NaN where not `kept`; several times faster than `numpy.where`."""
    gated = np.full(disparity.shape, np.nan, dtype=np.float32)
    cv2.copyTo(disparity, kept.view(np.uint8), gated)
    return gated


def _doubled(mask: Bool, shape: tuple[int, ...]) -> Bool:
    """Return a half-size mask at full size; an odd last row or column repeats its neighbour."""
    height, width = mask.shape
    # Two equal bytes are written as one word: doubling the columns is a multiplication.
    doubled = np.repeat((mask * np.uint16(0x0101)).view(np.uint8), 2, axis=0)
    bottom, right = shape[0] - 2 * height, shape[1] - 2 * width
    return cv2.copyMakeBorder(doubled, 0, bottom, 0, right, cv2.BORDER_REPLICATE).view(np.bool_)

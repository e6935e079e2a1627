"""What of image handling the stereo stage needs, with the types it promises."""

from typing import TypeVar

import cv2
import numpy as np

from bearcub.messages import Float32, UInt8

_Image = TypeVar("_Image", UInt8, Float32)


def grey(image: UInt8) -> UInt8:
    """Return `image` as grey, converting BGR."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) if image.ndim == 3 else image


def mirrored(image: UInt8) -> UInt8:
    """Return `image` with left and right exchanged."""
    return np.asarray(cv2.flip(image, 1))


def shrunk(image: UInt8, *, width: int, height: int) -> UInt8:
    """Return `image` at a smaller size, every pixel the mean of those it covers."""
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def shifted(right: _Image, disparity: Float32, *, interpolation: int) -> _Image:
    """Return what the right image shows at the match of every left pixel.

    Parameters
    ----------
    right : ndarray of uint8 or float32, shape (H, W)
        Beyond its border its outermost pixels go on.
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN is taken for 0.
    interpolation : int
        OpenCV's flag, such as ``cv2.INTER_LINEAR``.
    """
    height, width = disparity.shape
    columns = np.arange(width, dtype=np.float32) - cv2.patchNaNs(disparity.copy(), 0.0)
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    return np.asarray(
        cv2.remap(right, columns, rows, interpolation, borderMode=cv2.BORDER_REPLICATE),
        dtype=right.dtype,
    )

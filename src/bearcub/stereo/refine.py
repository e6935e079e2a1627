"""Sub-pixel disparity without the matcher's bias: a few steps of image registration.

Semi-global matching smooths along its paths: on a floor, whose disparity grows with the row, the
paths that come from above drag far disparities nearer rows, and fractions lock to whole pixels.
Each pixel's window is therefore registered once more by the gradient method of Lucas and Kanade
[1]_ along the row, which has no such preference.

References
----------
.. [1] B. D. Lucas, T. Kanade: "An iterative image registration technique with an application to
   stereo vision", IJCAI 1981.
"""

from typing import Any

import cv2
import numpy as np

from bearcub.messages import Float32, UInt8

_WINDOW = (9, 9)
_STEPS = 2
_FARTHEST = 0.5  # largest correction of a step [px]
_NOISE = 0.5  # gradient energy that noise alone has [grey levels squared]


def refine(left: UInt8, right: UInt8, disparity: Float32) -> Float32:
    """Sharpen a disparity map to a fraction of a pixel.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Rectified pair, grey.
    disparity : ndarray of float32, shape (H, W)
        Right to about half a pixel; NaN unmatched.

    Returns
    -------
    ndarray of float32, shape (H, W)
        NaN where `disparity` is and where the window leaves the image to the left or right;
        never below 0 where it was not.
    """
    known = np.isfinite(disparity)
    weight = known.astype(np.float32)
    found = np.where(known, disparity, np.float32(0))
    rows, columns = disparity.shape
    u = np.arange(columns, dtype=np.float32)[None, :]
    v = np.repeat(np.arange(rows, dtype=np.float32)[:, None], columns, axis=1)
    grey_left, grey_right = left.astype(np.float32), right.astype(np.float32)
    slope_left = _slope(grey_left)
    for _ in range(_STEPS):
        matched = _float32(
            cv2.remap(grey_right, u - found, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        )
        slope = (slope_left + _slope(matched)) * weight
        difference = grey_left - matched
        difference -= _float32(cv2.blur(difference, _WINDOW))
        shift = _float32(cv2.blur(slope * difference, _WINDOW))
        shift /= _float32(cv2.blur(slope * slope, _WINDOW)) + np.float32(_NOISE)
        found -= np.clip(shift, -_FARTHEST, _FARTHEST) * weight
    np.maximum(found, np.minimum(disparity, 0), out=found, where=known)
    beyond = _WINDOW[0] // 2  # windows that leave the image are not believed
    known[:, :beyond] = False
    known[:, -beyond:] = False
    return np.where(known, found, np.float32(np.nan))


def _slope(image: Float32) -> Float32:
    """Return half the derivative along the row [grey levels per px]."""
    return _float32(cv2.Sobel(image, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 16))


def _float32(image: Any) -> Float32:
    """Tell the type checker what OpenCV's stubs do not."""
    return np.asarray(image, dtype=np.float32)

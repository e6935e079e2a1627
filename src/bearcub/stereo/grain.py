"""Images whose noise outweighs their texture, as cameras give in the dark, are smoothed to match.

A matcher compares small windows; where grain decides how they compare it finds little, and far off.
Smoothing takes the grain away faster than the texture, but blurs the edges of things: images that
are clear are left as they are.
"""

import cv2
import numpy as np

from bearcub.messages import UInt8

_ROW_STEP = 4  # of the rows that are looked at
_GRAINY = 2.4  # share of the differences along a row that smoothing leaves, inverse; 1.2 to 1.9
# in clear daylight recordings, 4.4 for noise alone
_WINDOW = 5  # of the smoothing [px]


def graininess(image: UInt8) -> float:
    """Return how many times smaller smoothing makes the differences of neighbours in a row.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W)

    Returns
    -------
    float
        1 for smooth shades, 4.4 for noise without any texture.

    Examples
    --------
    >>> noise = np.random.default_rng(0).normal(100, 3, (64, 64)).astype(np.uint8)
    >>> print(f"{graininess(noise):.1f}")
    4.4
    >>> graininess(np.full((64, 64), 100, dtype=np.uint8))
    1.0
    """
    rows = image[::_ROW_STEP].astype(np.float32)
    smooth = cv2.GaussianBlur(rows, (_WINDOW, 1), 0)
    raw, left = (cv2.norm(x[:, 1:], x[:, :-1], cv2.NORM_L1) for x in (rows, smooth))
    return raw / left if left > 0 else 1.0


def without_grain(left: UInt8, right: UInt8) -> tuple[UInt8, UInt8]:
    """Return a pair as it is, or smoothed where the left image is mostly grain.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
    """
    return smoothed(left, right) if graininess(left) > _GRAINY else (left, right)


def smoothed(left: UInt8, right: UInt8) -> tuple[UInt8, UInt8]:
    """Return a pair smoothed as grainy ones are.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
    """
    smooth = [cv2.GaussianBlur(image, (_WINDOW, _WINDOW), 0) for image in (left, right)]
    return np.asarray(smooth[0], dtype=np.uint8), np.asarray(smooth[1], dtype=np.uint8)

"""What is in images and not in the world: blocks of compression, and the frame of a rectification.

Both are at the same place in both images, or nearly, and have contrast: a matcher finds them in
blank sky, as posts at multiples of eight pixels of disparity, or along the borders.
"""

import cv2
import numpy as np

from bearcub.messages import Bool, Float32, UInt8
from bearcub.robust import median
from bearcub.stereo.images import shifted

_BLOCK = 8  # side of a JPEG block [px]
_EVERY = 4  # row that is looked at
_BLACK = 2  # brightest that a frame is
_CORNERS = 8  # black pixels along the borders that may be anything [px]
_REACH = 7  # half the side of the window that must agree [px], see `gates`


def block_steps(image: UInt8) -> float:
    """Return how much larger steps between JPEG blocks are than others [grey levels].

    About 0.3, 0.8, 1.5 and 2 at qualities of 95, 90, 75 and 50; 0 where none was compressed, to
    0.2.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W)
        Grey, with its blocks where the compression had them.
    """
    rows = image[image.shape[0] % _EVERY // 2 :: _EVERY]
    whole = (rows.shape[1] - 1) // _BLOCK * _BLOCK
    if whole == 0:
        return 0.0
    steps = cv2.absdiff(rows[:, 1 : whole + 1], rows[:, :whole])
    mean = cv2.reduce(steps, 0, cv2.REDUCE_AVG, dtype=cv2.CV_32F).reshape(-1, _BLOCK).mean(axis=0)
    return max(0.0, float(mean[-1]) - median(mean[:-1]))


def without_blocks(left: UInt8, disparity: Float32, *, contrast: float) -> Float32:
    """Return a disparity map without what is matched where an image has texture at blocks alone.

    Parameters
    ----------
    left : ndarray of uint8, shape (H, W)
        Grey, with its blocks where the compression had them.
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN where unmatched.
    contrast : float
        Least RMS gradient inside the blocks [grey levels per 2 px].

    Returns
    -------
    ndarray of float32, shape (H, W)
    """
    inside = np.zeros(left.shape, dtype=np.float32)
    column = np.arange(left.shape[1]) % _BLOCK
    inside[:, (column > 0) & (column < _BLOCK - 1)] = 1
    gradient = np.asarray(cv2.Sobel(left, cv2.CV_32F, 1, 0, ksize=1))
    texture, weight = (
        cv2.boxFilter(values, -1, (2 * _REACH + 1,) * 2, normalize=False)
        for values in (gradient * gradient * inside, inside)
    )
    return np.where(texture > np.float32(contrast**2) * weight, disparity, np.float32(np.nan))


def without_frame(left: UInt8, right: UInt8, disparity: Float32) -> Float32:
    """Return a disparity map without what is matched at the black frame of a rectification.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Grey rectified pair.
    disparity : ndarray of float32, shape (H, W)
        In pixels of these images; NaN where unmatched.

    Returns
    -------
    ndarray of float32, shape (H, W)
        `disparity` itself where neither image has such a frame.
    """
    here, there = _frame(left), _frame(right)
    if here is None and there is None:
        return disparity
    out = np.zeros(disparity.shape, dtype=np.bool_) if here is None else here
    if there is not None:
        seen = shifted(there.view(np.uint8), disparity, interpolation=cv2.INTER_NEAREST)
        out = out | seen.view(np.bool_)
    return np.where(out, np.float32(np.nan), disparity)


def _frame(image: UInt8) -> Bool | None:
    """Return where a window reaches into what is black from the borders on; None for nowhere."""
    borders = (image[0], image[-1], image[:, 0], image[:, -1])
    if sum(int(np.count_nonzero(line <= _BLACK)) for line in borders) < _CORNERS:
        return None
    black = np.asarray(cv2.inRange(image, 0, _BLACK), dtype=np.uint8)
    _, labels = cv2.connectedComponents(black, connectivity=4, ltype=cv2.CV_16U)
    outside = np.zeros(int(labels.max()) + 1, dtype=np.uint8)
    for line in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        outside[line] = 1
    outside[0] = 0
    side = 2 * _REACH + 1
    return np.asarray(cv2.dilate(outside[labels], np.ones((side, side), dtype=np.uint8))) > 0

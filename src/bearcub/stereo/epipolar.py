"""How well the two images are aligned in rows: the assumption every matcher rests on."""

import math

import cv2
import numpy as np

from bearcub.messages import Bool, Float32, UInt8
from bearcub.stereo.images import shrunk

_PATCHES = 200  # followed at most, one in each cell of a grid
_WINDOW = (17, 17)  # px; the patch followed
_LEVELS = 2  # pyramid levels above the image: follows offsets of several pixels
_FEWEST = 20  # patches that say something together
_CORNER = 1e-4  # least corner strength; below it a patch fixes only one direction


def epipolar_offset(left: UInt8, right: UInt8, disparity: Float32) -> float:
    """Measure how much lower the right image lies than the left one, in rows.

    Corners of the left image that have a disparity are followed into the right image by the
    pyramidal Lucas-Kanade method [1]_, starting at their match; the answer is the median of the
    vertical steps, of those patches alone that were found again near their match.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Grey rectified pair.
    disparity : ndarray of float32, shape (H, W)
        As matched in these images [px]; NaN where unmatched.

    Returns
    -------
    float
        [px], right image lower positive; NaN where fewer than 20 patches could be followed or
        they contradict each other.

    References
    ----------
    .. [1] J.-Y. Bouguet: "Pyramidal implementation of the Lucas Kanade feature tracker", Intel,
       2000.
    """
    starts = _corners(left, np.isfinite(disparity))
    if len(starts) < _FEWEST:
        return math.nan
    columns, rows = starts.astype(np.int64).T
    match = disparity[rows, columns]
    guesses = starts - np.stack([match, np.zeros_like(match)], axis=1)
    ends, found, _ = cv2.calcOpticalFlowPyrLK(
        left,
        right,
        starts[:, None],
        guesses[:, None].copy(),
        winSize=_WINDOW,
        maxLevel=_LEVELS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    steps = ends[:, 0] - guesses
    steps = steps[(found[:, 0] > 0) & (np.abs(steps[:, 0]) < 2.0)]
    if len(steps) < _FEWEST:
        return math.nan
    offset = float(np.median(steps[:, 1]))
    spread = float(np.median(np.abs(steps[:, 1] - offset)))
    return offset if spread < 1.0 else math.nan


def _corners(image: UInt8, known: Bool) -> Float32:
    """Return (u, v) of the strongest corner in every cell that has one, shape (N, 2)."""
    half = shrunk(image, width=image.shape[1] // 2, height=image.shape[0] // 2)
    strength = cv2.cornerMinEigenVal(half, 5)
    cell = max(math.ceil(math.sqrt(strength.size / _PATCHES)), 8)
    n_rows, n_columns = strength.shape[0] // cell, strength.shape[1] // cell
    measured = known[: 2 * n_rows * cell : 2, : 2 * n_columns * cell : 2]
    cells = (strength[: n_rows * cell, : n_columns * cell] * measured).reshape(
        n_rows, cell, n_columns, cell
    )
    best = cells.transpose(0, 2, 1, 3).reshape(n_rows, n_columns, -1)
    row, column = np.nonzero(best.max(axis=2) > _CORNER)
    v, u = np.divmod(best.argmax(axis=2)[row, column], cell)
    return np.stack([2 * (column * cell + u), 2 * (row * cell + v)], axis=1).astype(np.float32)

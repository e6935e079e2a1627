"""How well the two images are aligned in rows: the assumption every matcher rests on."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Bool, Float32, UInt8
from bearcub.robust import median
from bearcub.stereo.images import shrunk

_PATCHES = 200  # followed at most, one in each cell of a grid
_WINDOW = (8, 10)  # px; the patch followed. With even sides both images are interpolated, which
# blurs them alike, and the error is half of what it is with odd ones
_TILE = 24  # px; what is cut out around a patch, more than twice the window
_LEVELS = 1  # pyramid levels above the image: follows offsets of several pixels
_ITERATIONS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 5, 0.05)
_FEWEST = 20  # patches that say something together
_CORNER = 1e-4  # least corner strength; below it a patch fixes only one direction
_MATCHED = 0.5  # share of the corners that are matched in a pair whose rows fit
_ROWS = 4  # a patch is searched for so many rows above and below [px]
_SEARCHED = 60  # patches at most
_HALF = 8  # px; half the side of such a patch
_ALIKE = 0.8  # least correlation of a patch with what is found

Index = NDArray[np.intp]


def epipolar_offset(
    left: UInt8, right: UInt8, disparity: Float32, *, largest: float = math.inf
) -> float:
    """Measure how much lower the right image lies than the left one, in rows.

    Corners of the left image that have a disparity are followed into the right image by the
    pyramidal Lucas-Kanade method [1]_, starting at their match; the answer is the median of the
    vertical steps, of those patches alone that were found again near their match. Only what lies
    around the corners is looked at: pyramids and gradients of whole images would take longer than
    everything else. Where less than half of the corners have a match, or they contradict each
    other, as when rows are off by pixels, the strongest are searched for in the rows around theirs.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Grey rectified pair.
    disparity : ndarray of float32, shape (H, W)
        As matched in these images [px]; NaN where unmatched.
    largest : float
        Disparity to search [px].

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
    strength = _corner_strength(left)
    corners = u, v, _ = _corners(strength)
    offset = math.nan
    if np.count_nonzero(np.isfinite(disparity[v, u])) >= _MATCHED * len(u):
        offset = _followed(left, right, disparity, strength)
    if math.isnan(offset):
        return _searched(left, right, *corners, largest=min(largest, left.shape[1]))
    return offset


def _followed(left: UInt8, right: UInt8, disparity: Float32, strength: Float32) -> float:
    """Return the offset by following corners from their match."""
    u, v, _ = _corners(strength, np.isfinite(disparity[2::4, 2::4]))
    match = u - disparity[v, u]
    column = np.rint(match).astype(np.intp)
    whole = (_whole(u, left.shape[1]) & _whole(column, left.shape[1])) & _whole(v, left.shape[0])
    u, v, column, match = u[whole], v[whole], column[whole], match[whole]
    if len(u) < _FEWEST:
        return math.nan
    starts = np.full((len(u), 2), _TILE // 2, dtype=np.float32)
    starts[:, 0] += _TILE * np.arange(len(u))
    guesses = starts.copy()
    guesses[:, 0] += match - column
    ends, found, _ = cv2.calcOpticalFlowPyrLK(
        _tiles(left, u, v),
        _tiles(right, column, v),
        starts,
        guesses.copy(),
        winSize=_WINDOW,
        maxLevel=_LEVELS,
        criteria=_ITERATIONS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    steps = ends - guesses
    return _agreed(steps[(found[:, 0] > 0) & (np.abs(steps[:, 0]) < 2.0), 1])


def _agreed(steps: Float32) -> float:
    """Return the median of vertical steps; NaN of too few, or where they contradict each other."""
    if len(steps) < _FEWEST:
        return math.nan
    offset = median(steps)
    spread = median(np.abs(steps - offset))
    return offset if spread < 1.0 else math.nan


def _searched(
    left: UInt8, right: UInt8, u: Index, v: Index, strength: Float32, *, largest: float
) -> float:
    """Return the offset by a search for the strongest corners around their rows."""
    found = []
    (height, width), margin, reach = left.shape, _HALF + _ROWS, math.ceil(largest)
    inside = (u >= _HALF) & (u < width - _HALF) & (v >= margin) & (v < height - margin)
    u, v, strength = u[inside], v[inside], strength[inside]
    for k in np.argsort(-strength)[:_SEARCHED].tolist():
        column, row = int(u[k]), int(v[k])
        first, end = max(column - _HALF - reach, 0), column + _HALF + 1
        strip = right[row - margin : row + margin + 1, first:end]
        patch = left[row - _HALF : row + _HALF + 1, column - _HALF : end]
        alike = cv2.matchTemplate(strip, patch, cv2.TM_CCOEFF_NORMED)
        _, best, _, (where, rows) = cv2.minMaxLoc(alike)
        if best > _ALIKE and 0 < rows < 2 * _ROWS:
            found.append(rows - _ROWS + _vertex(*alike[rows - 1 : rows + 2, where].tolist()))
    return _agreed(np.array(found, dtype=np.float32))


def _vertex(before: float, best: float, after: float) -> float:
    """Return where between its neighbours the highest of three values has its peak."""
    bent = 2 * best - before - after
    return 0.5 * (after - before) / bent if bent > 0 else 0.0


def _corner_strength(image: UInt8) -> Float32:
    """Return how strong a corner every pixel of a quarter of the size is."""
    height, width = image.shape
    half = shrunk(image, width=width // 2, height=height // 2)
    quarter = shrunk(half, width=width // 4, height=height // 4)
    return np.asarray(cv2.cornerMinEigenVal(quarter, 3), dtype=np.float32)


def _corners(strength: Float32, known: Bool | None = None) -> tuple[Index, Index, Float32]:
    """Return u, v and strength of the strongest corner in every cell that has one.

    `strength` is of a quarter of the size; `known` says where they may lie there.
    """
    cell = max(math.ceil(math.sqrt(strength.size / _PATCHES)), 4)
    n_rows, n_columns = strength.shape[0] // cell, strength.shape[1] // cell
    grid = np.s_[: n_rows * cell, : n_columns * cell]
    allowed = strength[grid] if known is None else strength[grid] * known[grid]
    cells = allowed.reshape(n_rows, cell, n_columns, cell)
    flat = cells.transpose(0, 2, 1, 3).reshape(n_rows * n_columns, cell * cell)
    best = flat.argmax(axis=1)
    highest = flat[np.arange(len(flat)), best]
    found = np.flatnonzero(highest > _CORNER)
    row, column = np.divmod(found, n_columns)
    v, u = np.divmod(best[found], cell)
    return 4 * (column * cell + u) + 2, 4 * (row * cell + v) + 2, highest[found]


def _whole(centre: Index, size: int) -> Bool:
    """Tell where a tile around this row or column lies inside the image."""
    return (centre >= _TILE // 2) & (centre <= size - _TILE // 2)


def _tiles(image: UInt8, u: Index, v: Index) -> UInt8:
    """Return what lies around every (u, v), side by side."""
    height, width = image.shape
    around = np.lib.stride_tricks.as_strided(
        image, (height - _TILE + 1, width - _TILE + 1, _TILE, _TILE), image.strides * 2
    )
    tiles = around[v - _TILE // 2, u - _TILE // 2]
    return tiles.transpose(1, 0, 2).reshape(_TILE, -1)

"""Points become things: those of neighbouring cells of a grid seen from above."""

import cv2
import numpy as np

from bearcub.evaluation.baselines.frame import FARTHEST
from bearcub.messages import Float64, Int32

CELL = 0.1
"""Side of a cell [m]."""

_PER_CELL = 5  # points that fill one
_PER_THING = 50  # points that make a thing


def clustered(points: Float64) -> Int32:
    """Return the number of the thing that every point belongs to, 0 for stray ones.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 3)
        ``base_link`` [m], none NaN, ahead of the robot.

    Returns
    -------
    ndarray of int32, shape (N,)
    """
    size = int(2 * FARTHEST / CELL) + 1
    row = np.clip((points[:, 0] / CELL).astype(np.int64), 0, size - 1)
    column = np.clip(((points[:, 1] + FARTHEST) / CELL).astype(np.int64), 0, size - 1)
    cell = row * size + column
    counts = np.bincount(cell, minlength=size * size)
    _, grid = cv2.connectedComponents(
        (counts >= _PER_CELL).astype(np.uint8).reshape(size, size), connectivity=8
    )
    return numbered(np.asarray(grid, dtype=np.int32).reshape(-1)[cell])


def numbered(labels: Int32) -> Int32:
    """Return labels of any shape with the large sets numbered 1, 2, ... and 0 for all others."""
    sizes = np.bincount(labels.reshape(-1), minlength=1)
    large = sizes >= _PER_THING
    large[0] = False
    return np.where(large, np.cumsum(large), 0).astype(np.int32)[labels]

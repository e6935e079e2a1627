"""Column and row histograms of disparity, with levels finer than a pixel (paper, sec. 3.1).

The paper counts the pixels of each disparity level in each image column: an upright object is a
peak as wide as the object. The field calls the image u-disparity, its row twin v-disparity.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import Bool, Float32, Int32
from bearcub.obstacles.sorting import Sorting
from bearcub.stereo.native import COMPILED, core

Index = NDArray[np.int64]

_ROUND = 16  # to the next multiple of which the largest level is rounded up [px]
_LUT = 16  # steps of the level table per pixel of disparity


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """A scale of disparity levels: even up to `knee`, then in proportion to the disparity.

    A surface spreads over a range of disparities that is the matcher's noise when far and the
    surface's own relief, in proportion to the disparity, when near.

    Attributes
    ----------
    width : float
        Of a level below the knee [px].
    knee : float
        Where levels begin to widen [px].
    largest : float
        Largest disparity counted [px].
    """

    width: float
    knee: float
    largest: float

    def of(self, disparity: Float64) -> Float64:
        """Return the fractional level of `disparity` [px]."""
        d = np.asarray(disparity, dtype=np.float64)
        above = np.maximum(d, self.knee) / self.knee
        return (np.minimum(d, self.knee) + self.knee * np.log(above)) / self.width

    @property
    def count(self) -> int:
        """Number of levels."""
        return int(self.of(np.array(self.largest))) + 2

    def of_many(self, disparity: Float32) -> Int32:
        """Return the whole level of every disparity, to a sixteenth of a pixel, by table."""
        return level_table(self).take((disparity * np.float32(_LUT)).astype(np.int64))


@cache
def level_table(levels: Levels) -> Int32:
    """Return the whole level of every sixteenth of a pixel of disparity."""
    return levels.of(np.arange(int(levels.largest * _LUT) + 2) / _LUT).astype(np.int32)


@cache
def level_centres(levels: Levels) -> Float64:
    """Return the disparity [px] at the middle of every level, shape (count,)."""
    middle = (np.arange(levels.count) + 0.5) * levels.width
    return np.where(middle < levels.knee, middle, levels.knee * np.exp(middle / levels.knee - 1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Cells:
    """Where the pixels that could be of things fall in the column histogram, arrays of shape (N,).

    Attributes
    ----------
    index : ndarray of int64
        Of the pixel in the flat grid.
    column, cell : ndarray of int32
        Along upright lines; ``level * width + column``.
    tall, overhead : ndarray of bool
        Higher than what is low; than what blocks the way.
    scale : Levels
    width, across : int
        Columns of the histogram, and of the grid.
    """

    index: Index
    column: Int32
    cell: Int32
    tall: Bool
    overhead: Bool
    scale: Levels
    width: int
    across: int


def to_cells(
    sorting: Sorting,
    *,
    farthest: float,
    nearest: float,
    shift: Int32,
    tall: float,
    overhead: float,
    compiled: bool = COMPILED,
) -> Cells:
    """Find where standing pixels fall in the column histogram.

    Parameters
    ----------
    sorting : Sorting
    farthest, nearest : float
        Smallest and largest disparity that is looked at [px].
    shift : ndarray of int32, shape (H,)
        Columns that an upright line has moved to the right, by row.
    tall, overhead : float
        A pixel rises above a height when this share of its disparity exceeds the floor's: one
        less the height over the camera's.
    compiled : bool
        By the native core, ``native/src/grid.cpp``; else by NumPy. The same to the bit.

    Returns
    -------
    Cells
    """
    width = sorting.standing.shape[1] + int(shift.max() - shift.min())
    if not compiled:
        return _in_numpy(sorting, (farthest, nearest), shift, width, tall, overhead)
    grid = (sorting.disparity, sorting.floor, sorting.standing, nearest, farthest)
    count, largest = core.count_standing(*grid)
    scale = _scale(largest)
    index = np.empty(count, dtype=np.int64)
    columns = np.empty((2, count), dtype=np.int32)
    truths = np.empty((2, count), dtype=np.bool_)
    core.to_cells(*grid, shift, level_table(scale), width, tall, overhead, index, *columns, *truths)
    return Cells(
        index=index,
        column=columns[0],
        cell=columns[1],
        tall=truths[0],
        overhead=truths[1],
        scale=scale,
        width=width,
        across=sorting.standing.shape[1],
    )


def _in_numpy(
    sorting: Sorting,
    span: tuple[float, float],
    shift: Int32,
    width: int,
    tall: float,
    overhead: float,
) -> Cells:
    index = np.flatnonzero(sorting.between(*span))
    d = sorting.disparity.ravel().take(index)
    rows = sorting.standing.shape[1] * np.arange(len(shift) + 1)  # where they begin, and the end
    starts = np.repeat(rows[:-1] + shift - shift.max(), np.diff(index.searchsorted(rows)))
    column = (index - starts).astype(np.int32)
    scale = _scale(float(d.max(initial=0.0)))
    floor = sorting.floor.ravel().take(index)
    return Cells(
        index=index,
        column=column,
        cell=scale.of_many(d) * width + column,
        tall=d * np.float32(tall) > floor,
        overhead=d * np.float32(overhead) > floor,
        scale=scale,
        width=width,
        across=sorting.standing.shape[1],
    )


def _scale(largest: float) -> Levels:
    """Return hardly more levels than the nearest thing needs, of one of few scales."""
    return Levels(width=0.25, knee=16.0, largest=_ROUND * math.ceil((largest + 1.0) / _ROUND))


def column_histogram(cells: Int32, *, count: int, width: int) -> Index:
    """Count pixels per (level, column); the u-disparity image.

    Parameters
    ----------
    cells : ndarray of int32, shape (N,)
        ``level * width + column`` of every pixel that counts.
    count, width : int
        Number of levels and of columns.

    Returns
    -------
    ndarray of int64, shape (count, width)

    Examples
    --------
    >>> column_histogram(np.array([5, 5, 0]), count=2, width=3)
    array([[1, 0, 0],
           [0, 0, 2]])
    """
    return np.bincount(cells, minlength=count * width).reshape(count, width)

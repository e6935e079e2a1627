"""From pixels that stand above the floor to separate things, in the column histogram."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64, Projection
from bearcub.messages import Bool, Float32, Int32
from bearcub.obstacles.histograms import _LUT, Levels, column_histogram

Index = NDArray[np.int64]

_LARGE = 200_000  # pixels of an image that is segmented at half its resolution
_MANY = 2500  # pixels at half resolution that tell as much as all
# levels and columns around a thing that are still its, at full and at half resolution
_FOOT = (np.ones((5, 7), dtype=np.uint8), np.ones((5, 5), dtype=np.uint8))


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Connected peaks of the column histogram and their pixels.

    Attributes
    ----------
    labels : ndarray of int32, shape (H, W)
        1.. for the pixels of each peak, 0 elsewhere.
    members : tuple of (ndarray of int64, ndarray of int64)
        Columns and rows of the pixels of each: of every pixel, or of every `stride`-th in both
        directions where they are many.
    stride : tuple of int
        1, or the stride of `members`, for each.
    """

    labels: Int32
    members: tuple[tuple[Index, Index], ...]
    stride: tuple[int, ...]


def segment(
    disparity: Float32,
    floor: Float32,
    standing: Bool,
    projection: Projection,
    *,
    camera_height: float,
    lean: float,
    least_height: float,
    low_height: float,
    nearest_level: float,
    farthest_level: float,
    gap_columns: int = 5,
) -> Segments:
    """Group standing pixels into things by connected peaks of the column histogram.

    A thing at least `least_height` high covers ``least_height * d / B`` rows at level d, so the
    threshold of a peak grows in proportion to the level. Neighbouring levels and columns belong
    together; one thing behind another, or beside it with floor between, stays apart. What rises
    above `low_height` is grouped first: kerbs and banks join many things at their feet, and would
    make one of them.

    Parameters
    ----------
    disparity, floor : ndarray of float32, shape (H, W)
        [px].
    standing : ndarray of bool, shape (H, W)
        Pixels above the floor; NaN disparities must be False.
    projection : Projection
    camera_height : float
        Above the floor [m].
    lean : float
        Columns that an upright line moves to the right per row, ``tan(roll)``: columns are
        counted along it, so that the histogram is exact in roll.
    least_height, low_height : float
        Lowest thing of interest, and lowest that is not "low" [m].
    nearest_level, farthest_level : float
        Largest and smallest disparity to look at [px].
    gap_columns : int
        Columns without a match that a thing may have.

    Returns
    -------
    Segments
    """
    step = 2 if disparity.size > _LARGE else 1
    d_grid, floor_grid = disparity[::step, ::step], floor[::step, ::step]
    rows, width = d_grid.shape
    inside = standing & (disparity >= farthest_level) & (disparity <= nearest_level)
    counts = inside[::step, ::step]
    index = np.flatnonzero(counts)
    d = d_grid[counts]
    # no more levels than the nearest thing needs
    scale = Levels(width=0.25, knee=16.0, largest=float(d.max(initial=16.0)) + 1.0)
    column, wide = _upright_columns(index, rows, width, projection.cy / step, lean)
    cell = scale.table()[(d * _LUT).astype(np.int32)]
    cell *= wide
    cell += column
    tall = d * np.float32(1 - low_height / camera_height) > floor_grid[counts]
    peaks = _PeakFinder(
        scale=scale,
        least_rows=np.maximum(3.0, 0.5 * least_height * scale.centres() / projection.baseline)
        / step,
        width=wide,
        gap=(gap_columns + 1) // step,
    )
    components, things = peaks.components(cell[tall])
    around = cv2.dilate(components.astype(np.uint16), _FOOT[step - 1])
    number = around.ravel()[cell].astype(np.int32)
    loose = number == 0
    if np.count_nonzero(loose) > 0:
        others, more = peaks.components(cell[loose])
        found = others.ravel()[cell[loose]]
        number[loose] = np.where(found > 0, found + things, 0)
        things += more
    labels = np.zeros(rows * width, dtype=np.int32)
    labels[index] = number
    grid = labels.reshape(rows, width)
    if step > 1:
        size = (disparity.shape[1], disparity.shape[0])
        # pixels left of and above a sampled one are its thing's, too, where they stand
        grid = cv2.dilate(grid.astype(np.uint16), np.ones((2, 2), dtype=np.uint8), anchor=(0, 0))
        grid = np.asarray(cv2.resize(grid, size, interpolation=cv2.INTER_NEAREST), dtype=np.int32)
        grid *= inside
    return _gathered(grid, index, number, things, width, step)


def _gathered(
    labels: Int32, index: Index, number: Int32, things: int, width: int, step: int
) -> Segments:
    """List the pixels of every thing: all of a small one's, every `step`-th of a large one's."""
    order = np.argsort(number.astype(np.uint16), kind="stable")  # 16 bits: a radix sort
    ends = np.cumsum(np.bincount(number, minlength=things + 1))
    members, strides = [], []
    for k in range(1, things + 1):
        v, u = np.divmod(index[order[ends[k - 1] : ends[k]]], width)
        few = step > 1 and 0 < len(u) < _MANY
        if few:
            top, left = step * int(v.min()), step * int(u.min())
            window = labels[top : step * int(v.max()) + step, left : step * int(u.max()) + step]
            v, u = np.divmod(np.flatnonzero(window == k), window.shape[1])
            v, u = v + top, u + left
        else:
            v, u = step * v, step * u
        members.append((u, v))
        strides.append(1 if few else step)
    return Segments(labels=labels, members=tuple(members), stride=tuple(strides))


def _upright_columns(
    index: Index, rows: int, width: int, centre: float, lean: float
) -> tuple[Int32, int]:
    """Return the column of each pixel along upright lines, and how many there are."""
    shift = np.rint(lean * (np.arange(rows) - centre)).astype(np.int32)
    if not shift.any():
        return index.astype(np.int32) % np.int32(width), width
    upright = np.arange(width, dtype=np.int32)[None, :] - shift[:, None] + shift.max()
    return upright.ravel()[index], width + int(shift.max() - shift.min())


@dataclass(frozen=True, slots=True, kw_only=True)
class _PeakFinder:
    """Finds the connected peaks of a column histogram.

    Attributes
    ----------
    scale : Levels
    least_rows : ndarray of float64, shape (count,)
        Rows that make a peak, by level.
    width : int
        Columns of the histogram.
    gap : int
        Columns without a match that a thing may have.
    """

    scale: Levels
    least_rows: Float64
    width: int
    gap: int

    def components(self, cell: Int32) -> tuple[Int32, int]:
        """Return the numbered peaks of the histogram of `cell`, and how many there are."""
        counts = column_histogram(cell, count=self.scale.count, width=self.width)
        around = cv2.boxFilter(counts, -1, (1, 5), normalize=False, borderType=cv2.BORDER_CONSTANT)
        enough = around >= self.least_rows[:, None].astype(np.float32)
        peaks = (enough & (counts > 0)).astype(np.uint8)
        kernel = np.ones((3, 2 * self.gap + 1), dtype=np.uint8)
        closed = cv2.morphologyEx(peaks, cv2.MORPH_CLOSE, kernel)
        count, components = cv2.connectedComponents(closed, connectivity=8, ltype=cv2.CV_32S)
        return np.asarray(components, dtype=np.int32), count - 1

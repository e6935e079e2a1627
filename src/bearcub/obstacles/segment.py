"""From pixels that stand above the floor to separate things, in the column histogram."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Projection
from bearcub.messages import Bool, Float32, Int32, UInt8
from bearcub.obstacles.histograms import _LUT, Levels, column_histogram

Index = NDArray[np.int64]

_FOOT = np.ones((5, 7), dtype=np.uint8)  # levels and columns around a thing that are still its


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Connected peaks of the column histogram and their pixels.

    Attributes
    ----------
    labels : ndarray of int32, shape (H, W)
        1.. for the pixels of each peak, 0 elsewhere.
    members : tuple of ndarray of int64
        Flat indices (row * W + column) of the pixels of each.
    """

    labels: Int32
    members: tuple[Index, ...]


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
    rows, width = disparity.shape
    scale = Levels(width=0.25, knee=16.0, largest=nearest_level)
    index = np.flatnonzero(standing)
    d = disparity.ravel()[index]
    inside = (d >= farthest_level) & (d <= nearest_level)
    if not inside.all():
        index, d = index[inside], d[inside]
    column, wide = _upright_columns(index, rows, width, projection.cy, lean)
    cell = scale.table()[(d * _LUT).astype(np.int32)]
    cell *= wide
    cell += column
    tall = d * np.float32(1 - low_height / camera_height) > floor.ravel()[index]
    shape = (scale.count, wide)
    components, things = _components(
        cell[tall], shape, scale, projection, least_height, gap_columns
    )
    around = cv2.dilate(components.astype(np.uint16), _FOOT)
    number = around.ravel()[cell].astype(np.int32)
    loose = number == 0
    if np.count_nonzero(loose) > 0:
        others, more = _components(cell[loose], shape, scale, projection, least_height, gap_columns)
        found = others.ravel()[cell[loose]]
        number[loose] = np.where(found > 0, found + things, 0)
        things += more
    labels = np.zeros(rows * width, dtype=np.int32)
    labels[index] = number
    return Segments(labels=labels.reshape(rows, width), members=_members(index, number, things))


def _members(index: Index, number: Int32, things: int) -> tuple[Index, ...]:
    """Return the elements of `index` of every number from 1 to `things`."""
    order = np.argsort(number.astype(np.uint16), kind="stable")  # 16 bits: a radix sort
    ends = np.cumsum(np.bincount(number, minlength=things + 1))
    return tuple(index[order[ends[k - 1] : ends[k]]] for k in range(1, things + 1))


def _upright_columns(
    index: Index, rows: int, width: int, centre: float, lean: float
) -> tuple[Int32, int]:
    """Return the column of each pixel along upright lines, and how many there are."""
    shift = np.rint(lean * (np.arange(rows) - centre)).astype(np.int32)
    if not shift.any():
        return index.astype(np.int32) % np.int32(width), width
    upright = np.arange(width, dtype=np.int32)[None, :] - shift[:, None] + shift.max()
    return upright.ravel()[index], width + int(shift.max() - shift.min())


def _components(
    cell: Int32,
    shape: tuple[int, int],
    scale: Levels,
    projection: Projection,
    least_height: float,
    gap_columns: int,
) -> tuple[Int32, int]:
    """Return the numbered peaks of the histogram of `cell`, and how many there are."""
    counts = column_histogram(cell, count=shape[0], width=shape[1])
    peaks = _peaks(counts, scale, projection, least_height, gap_columns)
    count, components = cv2.connectedComponents(peaks, connectivity=8, ltype=cv2.CV_32S)
    return np.asarray(components, dtype=np.int32), count - 1


def _peaks(
    counts: Float32, scale: Levels, projection: Projection, least_height: float, gap_columns: int
) -> UInt8:
    """Mark the cells whose neighbourhood of levels holds enough rows, small gaps closed."""
    around = cv2.boxFilter(counts, -1, (1, 5), normalize=False, borderType=cv2.BORDER_CONSTANT)
    rows = np.maximum(3.0, 0.5 * least_height * scale.centres() / projection.baseline)
    peaks = ((around >= rows[:, None].astype(np.float32)) & (counts > 0)).astype(np.uint8)
    kernel = np.ones((3, 2 * gap_columns + 1), dtype=np.uint8)
    return np.asarray(cv2.morphologyEx(peaks, cv2.MORPH_CLOSE, kernel), dtype=np.uint8)

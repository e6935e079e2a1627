"""From pixels that stand above the floor to separate things, in the column histogram."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64, Projection
from bearcub.messages import Bool, Int32, UInt8
from bearcub.obstacles.histograms import Levels, column_histogram
from bearcub.obstacles.sorting import Sorter, Sorting

Index = NDArray[np.int64]
Trim = Callable[[Bool, Sorting], Bool]

_STRIP = 0.25  # height of a strip that joins things, as a share of theirs
_MANY = 2500  # sampled pixels that tell as much as all
_SAMPLE = 2500  # pixels that tell all there is to tell of a large thing
# levels and columns around a thing that are still its, by step
_FOOT = {step: np.ones((5, columns), dtype=np.uint8) for step, columns in ((1, 7), (2, 5), (3, 3))}
_TO_LEFT_ABOVE = np.ones((2, 2), dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """The pixels of one segment, or a sample of them that tells as much.

    Attributes
    ----------
    number : int
        Of the segment.
    u, v : ndarray of int64, shape (N,)
        Columns and rows [px].
    stride : int
        They are of every `stride`-th column and row.
    pixels : int
        That the segment has.
    """

    number: int
    u: Index
    v: Index
    stride: int
    pixels: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Connected peaks of the column histogram and their pixels.

    Attributes
    ----------
    labels : ndarray of uint16, shape (H // step, W // step)
        1.. for the pixels of each peak, 0 elsewhere, on the grid that was segmented.
    count : int
        Number of peaks.
    step : int
        Of the grid [px].
    nearest_level, farthest_level : float
        Largest and smallest disparity that was looked at [px].
    """

    labels: "NDArray[np.uint16]"
    count: int
    step: int
    nearest_level: float
    farthest_level: float

    def members(self, sorter: Sorter, *, least: int, trim: Trim | None = None) -> Iterator[Member]:
        """Yield the pixels of each: all of a small thing's, a sample of a large one's.

        Parameters
        ----------
        sorter : Sorter
            Of the same frame.
        least : int
            Smallest thing of interest [px].
        trim : callable, optional
            Takes a window's mask and its sorting, returns the mask without a matcher's fringe.
        """
        index = np.flatnonzero(self.labels)
        number = self.labels.ravel()[index]
        order = np.argsort(number, kind="stable")  # 16 bits: a radix sort
        ends = np.cumsum(np.bincount(number, minlength=self.count + 1)).tolist()
        width = self.labels.shape[1]
        for k in range(1, self.count + 1):
            count = ends[k] - ends[k - 1]
            if count * self.step**2 < least:
                continue
            few = count < _MANY
            thin = 1 if few else _thinned(count)
            v, u = np.divmod(index[order[ends[k - 1] : ends[k] : thin]], width)
            if trim is not None or (few and self.step > 1):
                u, v = self._all_of(k, u, v, sorter, trim)
                if len(u):
                    thin = _thinned(len(u))
                    yield Member(number=k, u=u[::thin], v=v[::thin], stride=1, pixels=len(u))
            else:
                s = self.step
                yield Member(number=k, u=s * u, v=s * v, stride=s, pixels=count * s**2)

    def enlarged(self, labels: "NDArray[np.uint16]", part: Sorting) -> "NDArray[np.uint16]":
        """Return a window of labels at full resolution, where pixels of `part` stand.

        Pixels left of and above a sampled one are its thing's, too.
        """
        if self.step > 1:
            grown = np.asarray(cv2.dilate(labels, _TO_LEFT_ABOVE, anchor=(0, 0)), dtype=np.uint16)
            labels = grown.repeat(self.step, axis=0).repeat(self.step, axis=1)
        height, width = part.standing.shape
        return labels[:height, :width] * self.inside(part)

    def inside(self, part: Sorting) -> Bool:
        """Return which pixels of `part` could belong to a thing."""
        near, far = part.disparity <= self.nearest_level, part.disparity >= self.farthest_level
        found: Bool = part.standing & near & far
        return found

    def _all_of(
        self, k: int, u: Index, v: Index, sorter: Sorter, trim: Trim | None
    ) -> tuple[Index, Index]:
        """Return the columns and rows of every pixel of a thing that was sampled at (u, v)."""
        top, left, bottom, right = int(v.min()), int(u.min()), int(v.max()) + 1, int(u.max()) + 1
        s = self.step
        part = sorter.part(slice(s * top, s * bottom), slice(s * left, s * right))
        own = self.labels[top:bottom, left:right] == k
        window = self.enlarged(own.astype(np.uint16), part) > 0
        if trim is not None:
            window = trim(window, part)
        v, u = np.divmod(np.flatnonzero(window), window.shape[1])
        return u + s * left, v + s * top


def segment(
    sorting: Sorting,
    projection: Projection,
    *,
    step: int,
    camera_height: float,
    lean: float,
    least_height: float,
    low_height: float,
    clearance: float,
    least_pixels: int,
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
    sorting : Sorting
        Every `step`-th pixel of the image in both directions.
    projection : Projection
        Of the image.
    step : int
        1, 2 or 3.
    camera_height : float
        Above the floor [m].
    lean : float
        Columns that an upright line moves to the right per row, ``tan(roll)``: columns are
        counted along it, so that the histogram is exact in roll.
    least_height, low_height : float
        Lowest thing of interest, and lowest that is not "low" [m].
    clearance : float
        What hangs higher does not block the way [m].
    least_pixels : int
        Smallest thing of interest [px].
    nearest_level, farthest_level : float
        Largest and smallest disparity to look at [px].
    gap_columns : int
        Columns without a match that a thing may have.

    Returns
    -------
    Segments
    """
    empty = Segments(
        labels=np.zeros(sorting.standing.shape, dtype=np.uint16),
        count=0,
        step=step,
        nearest_level=nearest_level,
        farthest_level=farthest_level,
    )
    rows, width = sorting.standing.shape
    index = np.flatnonzero(empty.inside(sorting))
    if len(index) == 0:
        return empty
    d = sorting.disparity.ravel().take(index)
    # no more levels than the nearest thing needs
    scale = Levels(width=0.25, knee=16.0, largest=float(d.max(initial=16.0)) + 1.0)
    column, wide = _upright_columns(index, rows, width, projection.cy / step, lean)
    cell = scale.of_many(d)
    cell *= wide
    cell += column
    here = sorting.floor.ravel().take(index)
    tall = d * np.float32(1 - low_height / camera_height) > here
    overhead = d * np.float32(1 - clearance / camera_height) > here
    peaks = _PeakFinder(
        scale=scale,
        least_rows=np.maximum(3.0, 0.5 * least_height * scale.centres() / projection.baseline)
        / step,
        width=wide,
        gap=(gap_columns + 1) // step,
    )
    least = max(1, math.ceil(least_pixels / step**2))
    number, things = peaks.numbers(cell, tall, overhead, foot=_FOOT[step], least=least)
    things = peaks.part(number, things, column, least=least)
    empty.labels.ravel()[index] = number
    return replace(empty, count=things)


def _thinned(count: int) -> int:
    """Return the step that leaves a sample; odd, or it would walk along columns."""
    return max(1, count // _SAMPLE) | 1


def _length(run: tuple[int, int]) -> int:
    return run[1] - run[0]


def _upright_columns(
    index: Index, rows: int, width: int, centre: float, lean: float
) -> tuple[Int32, int]:
    """Return the column of each pixel along upright lines, and how many there are."""
    shift = np.rint(lean * (np.arange(rows) - centre)).astype(np.int32)
    upright = np.arange(width, dtype=np.int32)[None, :] - shift[:, None] + shift.max()
    return upright.ravel().take(index), width + int(shift.max() - shift.min())


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

    def numbers(
        self, cell: Int32, tall: Bool, overhead: Bool, *, foot: UInt8, least: int
    ) -> tuple["NDArray[np.uint16]", int]:
        """Return the number of every pixel's peak, 0 for none, and how many there are.

        What is tall and not overhead comes first, with the `foot` of cells around it; then the
        rest of what stands, and of what hangs, where at least so many pixels are left.
        """
        components, things = self.components(cell[tall & ~overhead])
        around = np.asarray(cv2.dilate(components, foot), dtype=np.uint16)
        number = around.ravel().take(cell)
        for rest in (~overhead, overhead):
            loose = np.flatnonzero((number == 0) & rest)
            if len(loose) >= least:
                others, more = self.components(cell[loose])
                found = others.ravel().take(cell[loose])
                number[loose] = np.where(found > 0, found + np.uint16(things), 0)
                things += more
        return number, things

    def part(self, number: "NDArray[np.uint16]", things: int, column: Int32, *, least: int) -> int:
        """Part things that only a strip joins, as weak matches do along a horizon.

        A strip is much lower than what it joins, and wider than gaps are; it becomes a thing of
        its own. `number` is changed in place; returned is how many things there are then.
        """
        cells = number * np.intp(self.width) + column
        heights = np.bincount(cells, minlength=(things + 1) * self.width)
        heights = heights.reshape(things + 1, self.width)[1:]  # 0 is no thing
        wide = np.count_nonzero(heights, axis=1) > 2 * self.gap + 1
        for k in np.flatnonzero(wide & (heights.sum(axis=1) >= least)):
            runs = self._runs(heights[k])
            if len(runs) > 1:
                own = np.flatnonzero(number == k + 1)
                numbers = np.array([k + 1, *range(things + 1, things + len(runs))], dtype=np.uint16)
                ends = [right for _, right in runs]
                number[own] = numbers[np.searchsorted(ends, column[own], side="right")]
                things += len(runs) - 1
        return things

    def _runs(self, heights: "NDArray[np.int64]") -> list[tuple[int, int]]:
        """Return the columns, first and beyond the last, of the parts of a thing and its strips."""
        side = np.ones((1, 2 * self.gap + 1), dtype=np.uint8)
        closed = cv2.morphologyEx(heights.astype(np.float32)[None, :], cv2.MORPH_CLOSE, side)
        tall = (closed >= _STRIP * closed.max()).view(np.uint8)
        high = cv2.morphologyEx(tall, cv2.MORPH_OPEN, side)[0] > 0
        first, last = np.flatnonzero(heights)[[0, -1]].tolist()
        cuts = (1 + np.flatnonzero(np.diff(high[first : last + 1]))).tolist()
        runs = list(pairwise([first, *(first + cut for cut in cuts), last + 1]))
        # what is lower at a thing's own side is its, unless it goes on for long
        if len(runs) > 1 and not high[first] and _length(runs[0]) < _length(runs[1]):
            runs[:2] = [(first, runs[1][1])]
        if len(runs) > 1 and not high[last] and _length(runs[-1]) < _length(runs[-2]):
            runs[-2:] = [(runs[-2][0], last + 1)]
        return runs

    def components(self, cell: Int32) -> tuple["NDArray[np.uint16]", int]:
        """Return the numbered peaks of the histogram of `cell`, and how many there are."""
        counts = column_histogram(cell, count=self.scale.count, width=self.width)
        around = cv2.boxFilter(counts, -1, (1, 5), normalize=False, borderType=cv2.BORDER_CONSTANT)
        enough = around >= self.least_rows[:, None].astype(np.float32)
        peaks = (enough & (counts > 0)).view(np.uint8)
        kernel = np.ones((3, 2 * self.gap + 1), dtype=np.uint8)
        closed = cv2.morphologyEx(peaks, cv2.MORPH_CLOSE, kernel)
        count, components = cv2.connectedComponents(closed, connectivity=8, ltype=cv2.CV_16U)
        return np.asarray(components, dtype=np.uint16), count - 1

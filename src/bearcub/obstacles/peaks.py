"""Things in the column histogram: its connected peaks, parted where only a strip joins them."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Float32, Int32, UInt8
from bearcub.obstacles.histograms import Cells, column_histogram
from bearcub.stereo.native import core

UInt16 = NDArray[np.uint16]

_FAR_ABOVE = 0.5  # share of a thing's height: what hangs overhead and farther above is not its
_STRIP = 0.25  # height of a strip that joins things, as a share of theirs


@dataclass(frozen=True, slots=True, kw_only=True)
class PeakFinder:
    """Finds the connected peaks of a column histogram.

    Attributes
    ----------
    levels, width : int
        Rows and columns of the histogram.
    least_rows : ndarray of float32, shape (levels,)
        Rows of the image that make a peak.
    gap : int
        Columns without a match that a thing may have.
    foot : tuple of int
        Levels and columns around a thing that are still its.
    compiled : bool
        By the native core, ``native/src/peaks.cpp``; else by NumPy. The same to the bit.
    """

    levels: int
    width: int
    least_rows: Float32
    gap: int
    foot: tuple[int, int]
    compiled: bool

    def numbers(self, cells: Cells, *, least: int) -> tuple[UInt16, int]:
        """Return the number of every pixel's peak, 0 for none, and how many there are.

        What is tall and not overhead comes first, with a foot of cells around it, and without
        what hangs far above it; then the rest of what stands, and of what hangs, where at least
        so many pixels are left.
        """
        return (self._compiled if self.compiled else self._in_numpy)(cells, least)

    def _compiled(self, cells: Cells, least: int) -> tuple[UInt16, int]:
        filled = (cells.cell, cells.tall, cells.overhead, self.levels, self.width)
        number = np.zeros(len(cells.cell), dtype=np.uint16)
        closed = np.empty((self.levels, self.width), dtype=np.uint8)
        things = 0
        for which in range(3):
            few = 1 if which == 0 else least
            marked = core.mark_peaks(*filled, which, few, number, self.least_rows, self.gap, closed)
            if marked[1] > 0:
                found = np.zeros((self.levels, self.width), dtype=np.uint16)
                rows = slice(*marked)
                found[rows], more = _connected(closed[rows])
                core.number_pixels(*filled, which, found, *self.foot, things, number)
                things += more
            if which == 0:
                core.let_go(cells.overhead, cells.index, cells.across, _FAR_ABOVE, number)
        return number, things

    def _in_numpy(self, cells: Cells, least: int) -> tuple[UInt16, int]:
        cell, overhead = cells.cell, cells.overhead
        components, things = self.components(cell[cells.tall & ~overhead])
        foot = np.ones(self.foot, dtype=np.uint8)
        around = np.asarray(cv2.dilate(components, foot), dtype=np.uint16)
        number = around.ravel().take(cell)
        _let_go(number, cells)
        for rest in (~overhead, overhead):
            loose = np.flatnonzero((number == 0) & rest)
            if len(loose) >= least:
                others, more = self.components(cell[loose])
                found = others.ravel().take(cell[loose])
                number[loose] = np.where(found > 0, found + np.uint16(things), 0)
                things += more
        return number, things

    def part(self, number: UInt16, things: int, column: Int32, *, least: int) -> int:
        """Part things that only a strip joins, as weak matches do along a horizon.

        A strip is much lower than what it joins, and wider than gaps are; it becomes a thing of
        its own. `number` is changed in place; returned is how many things there are then.
        """
        heights = self._heights(number, things, column)
        for k in np.flatnonzero(heights.sum(axis=1) >= least):
            wide = np.count_nonzero(heights[k]) > 2 * self.gap + 1
            runs = self._runs(heights[k]) if wide else []
            if len(runs) > 1:
                own = np.flatnonzero(number == k + 1)
                numbers = np.array([k + 1, *range(things + 1, things + len(runs))], dtype=np.uint16)
                ends = [right for _, right in runs]
                number[own] = numbers[np.searchsorted(ends, column[own], side="right")]
                things += len(runs) - 1
        return things

    def _heights(self, number: UInt16, things: int, column: Int32) -> Int32:
        """Return how many pixels of each thing stand in each column, shape (things, width)."""
        if self.compiled:
            heights = np.zeros((things, self.width), dtype=np.int32)
            core.count_heights(number, column, heights)
            return heights
        cells = number * np.intp(self.width) + column
        counts = np.bincount(cells, minlength=(things + 1) * self.width)
        return counts.reshape(things + 1, self.width)[1:].astype(np.int32)  # 0 is no thing

    def _runs(self, heights: Int32) -> list[tuple[int, int]]:
        """Return the columns, first and beyond the last, of the parts of a thing and its strips."""
        find = core.find_strips if self.compiled else _strips
        bounds, first_high, last_high = find(heights, self.gap, _STRIP)
        runs = list(pairwise(bounds))
        # what is lower at a thing's own side is its, unless it goes on for long
        if len(runs) > 1 and not first_high and _length(runs[0]) < _length(runs[1]):
            runs[:2] = [(runs[0][0], runs[1][1])]
        if len(runs) > 1 and not last_high and _length(runs[-1]) < _length(runs[-2]):
            runs[-2:] = [(runs[-2][0], runs[-1][1])]
        return runs

    def components(self, cell: Int32) -> tuple[UInt16, int]:
        """Return the numbered peaks of the histogram of `cell`, and how many there are."""
        # few cells hold pixels; what is above the first level wraps around to the empty last ones
        counts = column_histogram(cell, count=self.levels + 2, width=self.width).ravel()
        filled = np.flatnonzero(counts > 0)
        around = sum(counts.take(filled + k * self.width, mode="wrap") for k in range(-2, 3))
        peaks = np.zeros((self.levels, self.width), dtype=np.uint8)
        peaks.ravel()[filled] = around >= self.least_rows.take(filled // self.width)
        kernel = np.ones((3, 2 * self.gap + 1), dtype=np.uint8)
        closed = cv2.morphologyEx(peaks, cv2.MORPH_CLOSE, kernel)
        return _connected(np.asarray(closed, dtype=np.uint8))


def _let_go(number: UInt16, cells: Cells) -> None:
    """Take off a thing what hangs overhead, farther above it than half its own height."""
    overhead = np.flatnonzero(cells.overhead)
    things = number.take(overhead)
    for k in np.flatnonzero(np.bincount(things)).astype(np.uint16):
        if k == 0:
            continue
        above = overhead[things == k]
        own = np.flatnonzero((number == k) & ~cells.overhead)
        if len(own) > 0:
            lowest, top, foot = cells.index[[above[-1], own[0], own[-1]]] // cells.across
            if top - lowest > _FAR_ABOVE * (foot - top):
                number[above] = 0


def _connected(peaks: UInt8) -> tuple[UInt16, int]:
    count, components = cv2.connectedComponents(peaks, connectivity=8, ltype=cv2.CV_16U)
    return np.asarray(components, dtype=np.uint16), count - 1


def _strips(heights: Int32, gap: int, share: float) -> tuple[list[int], bool, bool]:
    """Return where the columns of a thing change between high and low; what its ends are."""
    side = np.ones((1, 2 * gap + 1), dtype=np.uint8)
    closed = cv2.morphologyEx(heights.astype(np.float32)[None, :], cv2.MORPH_CLOSE, side)
    tall = (closed >= share * closed.max()).view(np.uint8)
    high = cv2.morphologyEx(tall, cv2.MORPH_OPEN, side)[0] > 0
    first, last = np.flatnonzero(heights)[[0, -1]].tolist()
    cuts = (1 + first + np.flatnonzero(np.diff(high[first : last + 1]))).tolist()
    return [first, *cuts, last + 1], bool(high[first]), bool(high[last])


def _length(run: tuple[int, int]) -> int:
    return run[1] - run[0]

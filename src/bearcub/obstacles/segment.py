"""From pixels that stand above the floor to separate things, in the column histogram."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Projection
from bearcub.messages import Bool
from bearcub.obstacles.histograms import Cells, level_centres, to_cells
from bearcub.obstacles.peaks import PeakFinder
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.obstacles.trim import Trimmer, trim_tuning
from bearcub.stereo.native import COMPILED, core

Index = NDArray[np.int64]

_MANY = 2500  # sampled pixels that tell as much as all
_SAMPLE = 2500  # pixels that tell all there is to tell of a large thing
# levels and columns around a thing that are still its, by step
_FOOT = {1: (5, 7), 2: (5, 5), 3: (5, 3)}
_WITHIN = 1.03  # times its sampled disparities are a thing's others: two levels, as about its foot
_LARGE = 4000  # pixels of what may be two things, one before the other
_VALLEY = 0.3  # most pixels at a range between theirs, share of those at either's
_FARTHER = 1.12  # times as far as the one the other is, at least
_PART = 0.1  # share of the pixels that either has, at least
_AROUND = np.ones(3)
_TO_LEFT_ABOVE = np.ones((2, 2), dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """The pixels of one segment, or a sample of them that tells as much.

    Attributes
    ----------
    number : int
        Of the segment.
    u, v : ndarray of int64, shape (N,)
        Columns and rows [px], one row after the other.
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
    index : ndarray of int64, shape (N,)
        Of pixels in that grid, flat: those of the first peak, of the second, ...
    ends : tuple of int
        How many of these come before each peak, and before the end.
    step : int
        Of the grid [px].
    nearest_level, farthest_level : float
        Largest and smallest disparity that was looked at [px].
    """

    labels: "NDArray[np.uint16]"
    index: Index
    ends: tuple[int, ...]
    step: int
    nearest_level: float
    farthest_level: float

    @property
    def count(self) -> int:
        """Number of peaks."""
        return len(self.ends) - 1

    def members(
        self,
        sorter: Sorter,
        *,
        least: int,
        trim: Trimmer | None = None,
        compiled: bool = COMPILED,
    ) -> Iterator[Member]:
        """Yield the pixels of each: all of a small thing's, a sample of a large one's.

        Parameters
        ----------
        sorter : Sorter
            Of the same frame.
        least : int
            Smallest thing of interest [px].
        trim : Trimmer, optional
            Takes off what a matcher carries past the sides.
        compiled : bool
            By the native core, ``native/src/outline.cpp``; else by NumPy. The same but for pixels
            in which rounding decides what to trim.
        """
        all_of = self._all_of_compiled if compiled else self._all_of
        for k, (first, end) in enumerate(pairwise(self.ends), start=1):
            count = end - first
            if count * self.step**2 < least:
                continue
            few = count < _MANY
            thin = 1 if few else _thinned(count)
            index = self.index[first:end:thin]
            if trim is not None or (few and self.step > 1):
                u, v = all_of(k, index, sorter, trim)
                if len(u):
                    thin = _thinned(len(u))
                    yield Member(number=k, u=u[::thin], v=v[::thin], stride=1, pixels=len(u))
            else:
                s, (u, v) = self.step, self._places(index)
                yield Member(number=k, u=s * u, v=s * v, stride=s, pixels=count * s**2)

    def enlarged(self, labels: "NDArray[np.uint16]", standing: Bool) -> "NDArray[np.uint16]":
        """Return a window of labels at full resolution, where pixels of it are `standing`.

        Pixels left of and above a sampled one are its thing's, too.
        """
        if self.step > 1:
            grown = np.asarray(cv2.dilate(labels, _TO_LEFT_ABOVE, anchor=(0, 0)), dtype=np.uint16)
            labels = grown.repeat(self.step, axis=1).repeat(self.step, axis=0)  # the fast order
        height, width = standing.shape
        return labels[:height, :width] * standing

    def _places(self, index: Index) -> tuple[Index, Index]:
        """Return columns and rows of pixels of the grid."""
        width = self.labels.shape[1]
        v = index // width
        return index - v * width, v  # numpy.divmod takes twice as long

    def _all_of_compiled(
        self, k: int, index: Index, sorter: Sorter, trim: Trimmer | None
    ) -> tuple[Index, Index]:
        surface = sorter.surface
        found: tuple[Index, Index] = core.all_pixels(
            self.labels,
            self.step,
            k,
            index,
            sorter.disparity,
            surface.plane.tolist(),
            surface.bend,
            sorter.tolerance,
            self.nearest_level,
            self.farthest_level,
            _WITHIN,
            None if trim is None else trim.left,
            None if trim is None else trim.right,
            0.0 if trim is None else trim.offset,
            trim_tuning(),
        )
        return found

    def _all_of(
        self, k: int, index: Index, sorter: Sorter, trim: Trimmer | None
    ) -> tuple[Index, Index]:
        """Return the columns and rows of every pixel of a thing that was sampled at these.

        What lies between the sampled columns and rows at its side may be of the thing beside it.
        """
        u, v = self._places(index)
        top, left, bottom, right = int(v[0]), int(u.min()), int(v[-1]) + 1, int(u.max()) + 1
        s = self.step
        place = slice(s * top, s * bottom), slice(s * left, s * right)
        own = self.labels[top:bottom, left:right] == k
        d = sorter.disparity[s * v, s * u]
        levels = (
            max(self.farthest_level, float(d.min()) / _WITHIN),
            min(self.nearest_level, float(d.max()) * _WITHIN),
        )
        labels = own.astype(np.uint16)
        if trim is None:
            window = self.enlarged(labels, sorter.standing(*place, *levels)) > 0
        else:
            part = sorter.part(*place)
            window = trim(self.enlarged(labels, part.between(*levels)) > 0, part)
        index = np.flatnonzero(window)
        v = index // window.shape[1]
        return index - window.shape[1] * v + s * left, v + s * top


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
    compiled: bool = COMPILED,
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
    compiled : bool
        By the native core, ``native/src/grid.cpp``; else by NumPy. The same to the bit.

    Returns
    -------
    Segments
    """
    labels = np.zeros(sorting.standing.shape, dtype=np.uint16)
    rows = len(labels)
    cells = to_cells(
        sorting,
        farthest=farthest_level,
        nearest=nearest_level,
        shift=np.rint(lean * (np.arange(rows) - projection.cy / step)).astype(np.int32),
        tall=1 - low_height / camera_height,
        overhead=1 - clearance / camera_height,
        compiled=compiled,
    )
    rows_of_least = least_height * level_centres(cells.scale) / projection.baseline
    peaks = PeakFinder(
        levels=cells.scale.count,
        least_rows=(np.maximum(3.0, 0.5 * rows_of_least) / step).astype(np.float32),
        width=cells.width,
        gap=(gap_columns + 1) // step,
        foot=_FOOT[step],
        compiled=compiled,
    )
    least = max(1, math.ceil(least_pixels / step**2))
    number, things = peaks.numbers(cells, least=least)
    things = _part_by_range(number, things, cells, least=_LARGE // step**2)
    things = peaks.part(number, things, cells.column, least=least)
    labels.ravel()[cells.index] = number
    order = np.argsort(number, kind="stable")  # 16 bits: a radix sort
    ends = number.take(order).searchsorted(np.arange(1, things + 2, dtype=np.uint16))
    return Segments(
        labels=labels,
        index=cells.index.take(order),
        ends=tuple(ends.tolist()),
        step=step,
        nearest_level=nearest_level,
        farthest_level=farthest_level,
    )


def _part_by_range(number: "NDArray[np.uint16]", things: int, cells: Cells, *, least: int) -> int:
    """Part large things before others, in place; returns how many there are then.

    What a matcher smears from one to the other is much less than either.
    """
    sizes = np.bincount(number, minlength=things + 1)
    for k in np.flatnonzero(sizes[1:] > least) + 1:
        own = np.flatnonzero(number == k)
        level = cells.cell.take(own) // cells.width
        first = int(level.min())
        counts = np.convolve(np.bincount(level - first), _AROUND, mode="same")
        nearer = np.maximum.accumulate(counts[::-1])[::-1]
        farther = np.maximum.accumulate(counts)
        shallow = counts / np.minimum(nearer, farther)
        valley = int(shallow.argmin())
        if shallow[valley] > _VALLEY:
            continue
        peaks = int(counts[:valley].argmax()), valley + int(counts[valley:].argmax())
        centres = level_centres(cells.scale)[[first + peak for peak in peaks]]
        beyond = level > first + valley
        few = min(np.count_nonzero(beyond), np.count_nonzero(~beyond))
        if centres[1] > _FARTHER * centres[0] and few > _PART * len(own):
            things += 1
            number[own[beyond]] = things
    return things


def _thinned(count: int) -> int:
    """Return the step that leaves a sample; odd, or it would walk along columns."""
    return max(1, count // _SAMPLE) | 1

"""Regions of the image that look through the floor, grown from their pixels to the rim."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Bool
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.robust import median, quantile

LEAST_PIXELS = 60
_PLAIN = 3.0  # times the tolerance that a tenth of a hole's pixels lie below the floor ...
PLAIN_PIXELS = 500  # ... and how many there must be, that the images are asked of all together
LEAST_COLUMNS = 8
LEAST_ROWS = 3
_RIM = 0.2  # share of a pit's depth at which its rim is taken
_RIM_SIGMAS = 1.5  # ... but no closer to the floor than this many sigmas of noise
EDGE_ROWS = 6  # rows searched beyond a rim for what borders it
MIRRORED = 24  # rows in which the foot of a mirrored thing may hide in the tolerance
_STRAND = 11  # [px] noise that a matcher draws out of a region is no wider
CLOSING = np.ones((7, 7), dtype=np.uint8)

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """A connected part of the image that looks through the floor.

    Attributes
    ----------
    mask : ndarray of bool, shape (H, W)
        In a window of the image.
    sorting : Sorting
        Of that window.
    plain : bool
        It lies so much below the floor as no wrong match does.
    """

    mask: Bool
    sorting: Sorting
    plain: bool

    @property
    def top(self) -> int:
        """First row of the window [px]."""
        return int(self.sorting.v[0])

    @property
    def left(self) -> int:
        """First column of the window [px]."""
        return int(self.sorting.u[0])

    @property
    def fall(self) -> float:
        """How far its disparity lies below the floor's, but for the rim, which is on it [px]."""
        u, v = self.inside()
        return -median(self.sorting.residual[v, u]) if len(u) else 0.0

    def pixels(self) -> tuple[Index, Index]:
        """Return the columns and rows of its pixels in the window."""
        return _places(self.mask)

    def near_rim(self) -> tuple[Index, Index]:
        """Return the columns with enough pixels, and the last row of each, in the window."""
        u = np.flatnonzero(self.mask.sum(axis=0) >= LEAST_ROWS)
        v = self.mask.shape[0] - 1 - self.mask[::-1].argmax(axis=0)[u]
        return u, v

    def holds(self, u: int, v: int) -> bool:
        """Tell whether a pixel of the image is one of its own, or enclosed by them."""
        own_u, own_v = self.pixels()
        column, row = u - self.left, v - self.top
        within: Bool = (own_u.min() <= column <= own_u.max()) & (own_v.min() <= row <= own_v.max())
        return bool(within)

    def down_to_floor(self) -> "Region":
        """Return the region with the unmatched pixels right below it.

        The foot of a dark wall is not matched, nor what one camera alone sees behind the lip. In no
        column are there more of them than pixels above that were.
        """
        unmatched = np.isnan(self.sorting.residual)
        rows = self.mask.sum(axis=0)
        mask, last = self.mask.copy(), self.mask
        for count in range(int(rows.max())):
            below = np.zeros_like(mask)
            below[1:] = last[:-1] & unmatched[1:] & (rows > count)
            last = below & ~mask
            if not last.any():
                break
            mask |= last
        return replace(self, mask=mask)

    def overlaps(self, other: "Region") -> bool:
        """Tell whether two regions share a pixel."""
        v, u = self.sorting.v, self.sorting.u
        rows, columns = np.isin(v, other.sorting.v), np.isin(u, other.sorting.u)
        if not (rows.any() and columns.any()):
            return False
        top, left = int(v[rows][0]) - other.top, int(u[columns][0]) - other.left
        mine = self.mask[np.ix_(rows, columns)]
        shared: Bool = other.mask[top : top + mine.shape[0], left : left + mine.shape[1]] & mine
        return bool(shared.any())

    def inside(self) -> tuple[Index, Index]:
        """Return columns and rows in the window of its matched pixels, but for the outermost."""
        inner = cv2.erode(
            self.mask.astype(np.uint8), CLOSING[:3, :3], borderType=cv2.BORDER_REPLICATE
        )
        inner[np.isnan(self.sorting.residual)] = 0
        return _places(np.asarray(inner))


def regions_below(below: Bool, sorter: Sorter, step: int) -> Iterator[Region]:
    """Yield connected regions grown from `below`, a grid, to the rim."""
    height, width = sorter.disparity.shape
    side = {1: 7, 2: 5}.get(step, 3)
    kernel = CLOSING[:side, :side]
    closed = np.asarray(cv2.morphologyEx(below.view(np.uint8), cv2.MORPH_CLOSE, kernel))
    _, labels = cv2.connectedComponents(closed, connectivity=8, ltype=cv2.CV_16U)
    parts = np.asarray(labels, dtype=np.uint16)
    index = np.flatnonzero(closed.view(np.bool_))  # many times faster than of numbers
    numbers = parts.ravel()[index]
    areas = step**2 * np.bincount(numbers)
    for number in np.flatnonzero(areas >= LEAST_PIXELS).tolist():
        area = int(areas[number])
        u, v = _split(index[numbers == number], parts.shape[1])
        left, top = step * int(u.min()), step * int(v[0])
        wide, high = step * (int(u.max()) + 1) - left, step * (int(v[-1]) + 1) - top
        if wide < LEAST_COLUMNS or high < LEAST_ROWS:
            continue
        margin = max(8, wide // 3, high // 2)
        first, last = max(0, top - margin), min(height, top + high + margin)
        # beyond what the region may grow to, rows that tell what borders it
        above, under = max(MIRRORED, (last - first) // 4) + 1, EDGE_ROWS + 1
        part = sorter.part(
            slice(max(0, first - above), min(height, last + under)),
            slice(max(0, left - margin), min(width, left + wide + margin)),
        )
        seed = _spread(parts, number, part, step)
        strong = seed & part.below
        if np.count_nonzero(strong) < 0.3 * area:
            continue
        depth = -quantile(part.residual[strong], 0.1)
        weak = part.residual < -sorter.noise_of(part, times=_RIM_SIGMAS, least=_RIM * depth)
        weak |= _small_gaps(np.isnan(part.residual), largest=area)
        weak[: first - int(part.v[0])] = False
        weak[last - int(part.v[0]) :] = False
        mask = _grown(seed, weak, wide=min(wide, width - left))
        yield Region(mask=mask, sorting=part, plain=_plain(mask, part))


def _places(mask: NDArray[np.generic]) -> tuple[Index, Index]:
    """Return the columns and rows of what is not zero."""
    return _split(np.flatnonzero(mask), mask.shape[1])


def _split(index: Index, width: int) -> tuple[Index, Index]:
    """Return the columns and rows of flat indices: `numpy.divmod` takes twice as long."""
    v = index // width
    return index - v * width, v


def _spread(parts: NDArray[np.uint16], number: int, part: Sorting, step: int) -> Bool:
    """Return the pixels of a window that lie in one of the parts of the grid."""
    v, u = part.v // step, part.u // step
    own: Bool = parts[v[0] : v[-1] + 1, u[0] : u[-1] + 1] == number
    spread: Bool = own.take(u - u[0], axis=1).take(v - v[0], axis=0)  # the fast order
    return spread


def _plain(mask: Bool, part: Sorting) -> bool:
    """Tell what lies so much below the floor that no wrong match does."""
    fall = -part.residual[mask] / part.allowed[mask]
    fall = fall[np.isfinite(fall)]
    return len(fall) > PLAIN_PIXELS and quantile(fall, 0.9) > _PLAIN


def _small_gaps(unmatched: Bool, *, largest: int) -> Bool:
    """Return the unmatched patches no larger than the hole itself: shade and hidden sides."""
    _, parts, stats, _ = cv2.connectedComponentsWithStats(unmatched.view(np.uint8), connectivity=8)
    small = stats[:, cv2.CC_STAT_AREA] <= largest
    small[0] = False
    gaps: Bool = small.take(np.asarray(parts)) if small.any() else np.zeros_like(unmatched)
    return gaps


def _grown(seed: Bool, weak: Bool, *, wide: int) -> Bool:
    """Return the part of `weak` (closed) that touches the seed, so many columns, with the seed."""
    either = cv2.morphologyEx((weak | seed).view(np.uint8), cv2.MORPH_CLOSE, CLOSING[:5, :5])
    strand = np.ones((1, min(_STRAND, max(1, wide // 3))), dtype=np.uint8)
    either = cv2.morphologyEx(either, cv2.MORPH_OPEN, strand)
    _, parts = cv2.connectedComponents(either, connectivity=4)
    wanted = np.bincount(parts[seed])
    wanted[0] = 0
    grown: Bool = parts == int(np.argmax(wanted))
    return grown

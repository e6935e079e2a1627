"""Where the images alone tell the foot of a thing too small for a matcher: plane and parallax.

A matcher's disparity is as smooth as its window: of a box of ten pixels, whose top lies a pixel of
disparity off the floor, nothing is left. The right image warped to the left one by the disparity
of the floor has no such window [1]_: what lies on the floor falls on itself, and what stands is
off by its parallax, which grows from nothing at the foot by as much as the floor's disparity
falls. With ``g`` the gradient along the row, ``D`` the difference of the images and ``m`` that
parallax, a thing as large as a small box shows where

    ``sum(m g D) / sqrt(sum((m g)^2))``

over its outline is many times the noise of ``D``: the root of the likelihood ratio of "stands
there" against "floor", to first order [2]_. And ``sum(m g D) / sum((m g)^2)``, the share of the
parallax that is seen, must be about 1, or the floor is merely a little off.

References
----------
.. [1] R. Kumar, P. Anandan, K. Hanna: "Direct recovery of shape from multiple views: a parallax
   based approach", ICPR 1994.
.. [2] P. Pinggera, U. Franke, R. Mester: "High-performance long range obstacle detection using
   stereo vision", IROS 2015.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from bearcub.ground.surface import Surface
from bearcub.messages import Float32, UInt8

SIZE = 0.1  # width and height of the thing that is looked for [m]
_SURE = 7.0  # standard errors by which it must show
_SHARES = (0.5, 2.5)  # of the parallax that may be seen: edges lie beside and above the outline
_LEAST_COLUMNS = 5.0  # of a thing that shows [px]
_PARALLAX = (0.3, 2.2)  # of its top off the floor: less is noise, more is the matcher's [px]
_FULL_COLUMNS = 13.0  # columns of a thing beyond which half the columns tell as much
_BAND = 1.7  # farthest over nearest range at which a window fits
_AROUND = (32, 8)  # columns and rows whose brightness and noise are one
_NOISE = 0.3  # variance that rounding leaves [grey levels squared]


@dataclass(frozen=True, slots=True, kw_only=True)
class Foot:
    """Where something seems to stand.

    Attributes
    ----------
    u, v : int
        Column of its middle, row of its foot [px].
    level : float
        The floor's disparity there [px].
    sure : float
        Standard errors by which it stands.
    """

    u: int
    v: int
    level: float
    sure: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Warped:
    """The rows of floor between two levels, the right image warped to the left one.

    `step` full columns and ``2 step`` full rows are one pixel here; `at` is the column of the right
    image.
    """

    left: UInt8
    right: UInt8
    floor: Float32
    at: Float32
    first: int
    step: int


def feet(
    left: UInt8, right: UInt8, surface: Surface, *, baseline: float, offset: float
) -> list[Foot]:
    """Find where things of about `SIZE` seem to stand on the floor.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Rectified pair, grey.
    surface : Surface
        The floor.
    baseline : float
        [m].
    offset : float
        In the floor's disparities, not in the images [px].

    Returns
    -------
    list of Foot
        The surest first.
    """
    per_parallax = (surface.height - SIZE) / SIZE  # levels of floor per pixel of parallax
    farthest, nearest = (share * per_parallax for share in _PARALLAX)
    farthest = max(farthest, _LEAST_COLUMNS * baseline / SIZE)
    full = min(max(_FULL_COLUMNS * baseline / SIZE, farthest), nearest)
    found: list[Foot] = []
    for step, low, high in ((1, farthest, full), (2, full, nearest)):
        warped = _warped(left, right, surface, low, high, step=step, offset=offset)
        if warped is not None:
            found += _peaks(warped, surface, low, high, per_level=SIZE / baseline)
    return sorted(found, key=lambda foot: -foot.sure)


def _rows(surface: Surface, low: float, high: float, columns: int) -> tuple[int, int]:
    """Return the rows, first and beyond the last, that have levels between two of them."""
    a, b, c = surface.plane.tolist()
    ends = [(level - c - a * u) / b for level in (low, high) for u in (0, columns - 1)]
    return math.floor(min(ends)), math.ceil(max(ends)) + 1


def _warped(
    left: UInt8,
    right: UInt8,
    surface: Surface,
    low: float,
    high: float,
    *,
    step: int,
    offset: float,
) -> _Warped | None:
    """Return the floor between two levels, and above it a thing's height."""
    a, b, c = surface.plane.tolist()
    if b <= 0 or high <= low:
        return None
    rows, columns = left.shape
    first, end = _rows(surface, low, high, columns)
    first = max(0, first - 2 * step * math.ceil(_LEAST_COLUMNS))
    count, width = (min(rows, end) - first) // (2 * step), columns // step
    if count < _LEAST_COLUMNS:
        return None
    window = np.s_[first : first + 2 * step * count, : step * width]
    grey = [_shrunk(image[window], step) for image in (left, right)]
    # pixels' middles; the bend is smooth
    u = step * np.arange(width, dtype=np.float32) + np.float32(0.5 * (step - 1))
    v = first + 2 * step * np.arange(count, dtype=np.float32) + np.float32(step - 0.5)
    floor = (b * v + c)[:, None] + a * u[None, :]
    coarse = _coarse(floor.shape)[0]
    middles = (np.arange(coarse, dtype=np.float32) + np.float32(0.5)) * np.float32(columns / coarse)
    bend = surface.look_up(surface.bend, surface.entry((b * v + c)[:, None] + a * middles[None, :]))
    floor += np.asarray(cv2.resize(bend, (width, count)), dtype=np.float32)
    at = floor * np.float32(-1 / step)
    at += np.arange(width, dtype=np.float32) + np.float32(offset / step)
    row = np.repeat(np.arange(count, dtype=np.float32)[:, None], width, axis=1)
    warped = cv2.remap(grey[1], at, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return _Warped(
        left=grey[0],
        right=np.asarray(warped, dtype=np.uint8),
        floor=floor,
        at=at,
        first=first,
        step=step,
    )


def _shrunk(image: UInt8, step: int) -> UInt8:
    """Return an image of every `step` (1 or 2) columns, and twice as many rows, the mean."""
    halved = cv2.addWeighted(image[0::2], 0.5, image[1::2], 0.5, 0.0)
    if step == 2:
        size = image.shape[1] // 2, image.shape[0] // 4
        halved = cv2.resize(halved, size, interpolation=cv2.INTER_AREA)
    return np.asarray(halved, dtype=np.uint8)


def _peaks(
    warped: _Warped, surface: Surface, low: float, high: float, *, per_level: float
) -> Iterator[Foot]:
    """Yield the feet between two levels; a thing has `per_level` columns by its foot's level."""
    step, (rows, columns) = warped.step, warped.floor.shape
    fall = math.hypot(*surface.plane[:2].tolist())  # of the floor's disparity by the row
    g, difference, noise = _contrast(warped.left, warped.right)
    energy, seen = g * g, g * difference
    bands = max(1, math.ceil(math.log(high / low) / math.log(_BAND)))
    edges = [low * (high / low) ** (k / bands) for k in range(bands + 1)]
    for far, near in pairwise(edges):
        size = math.sqrt(near * far) * per_level / step
        wide, tall = round(size) + 2, round(0.5 * size) + 1
        first, end = _rows(surface, far, near, step * columns)
        first, end = ((row - warped.first) // (2 * step) for row in (first, end))
        part = slice(max(0, first - tall), min(rows, end + 1))
        if part.stop - part.start < tall:
            continue
        parallax = 2 * fall * (np.arange(tall, 0, -1, dtype=np.float32) - np.float32(0.5))
        expected = _summed(energy[part], wide, parallax * parallax)
        together = _summed(seen[part], wide, parallax)
        sure = together / np.sqrt(expected * noise[part] + np.float32(1e-6))
        sure[:, -wide:] = 0
        if float(sure.max()) <= _SURE:
            continue
        floor = warped.floor[part]
        sure *= (floor >= far) & (floor < near) & (warped.at[part] > wide)
        sure *= (together > _SHARES[0] * expected) & (together < _SHARES[1] * expected)
        highest = cv2.dilate(sure, np.ones((5, 2 * wide + 1), dtype=np.uint8))
        index = np.flatnonzero((sure >= highest) & (sure > _SURE))
        for v, u in zip(*(k.tolist() for k in np.divmod(index, sure.shape[1])), strict=True):
            yield Foot(
                u=step * u + step // 2,
                v=warped.first + 2 * step * (v + part.start) + step,
                level=float(floor[v, u]),
                sure=float(sure[v, u]),
            )


def _contrast(left: UInt8, right: UInt8) -> tuple[Float32, Float32, Float32]:
    """Return gradient along the row, difference of the images, and its variance around a pixel.

    What differs in brightness over a neighbourhood is the cameras'.
    """
    size = left.shape[::-1]
    coarse = _coarse(left.shape)
    one, other = left.astype(np.float32), right.astype(np.float32)
    ratio = _averaged(one, coarse) / (_averaged(other, coarse) + np.float32(1))
    other *= np.asarray(cv2.resize(ratio, size), dtype=np.float32)
    difference = other - one
    one += other
    gradient = cv2.Sobel(one, cv2.CV_32F, 1, 0, ksize=1, scale=0.25)
    variance = _averaged(difference * difference, coarse) + np.float32(_NOISE)
    return (
        np.asarray(gradient, dtype=np.float32),
        difference,
        np.asarray(cv2.resize(variance, size), dtype=np.float32),
    )


def _coarse(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return how many columns and rows of pixels whose surroundings are one an image has."""
    return max(1, shape[1] // _AROUND[0]), max(1, shape[0] // _AROUND[1])


def _averaged(image: Float32, size: tuple[int, int]) -> Float32:
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def _summed(image: Float32, wide: int, weight: Float32) -> Float32:
    """Return the weighted sums over windows in whose last row's middle the pixels are."""
    across = np.ones(wide, dtype=np.float32)
    anchor = (wide // 2, len(weight) - 1)
    summed = cv2.sepFilter2D(
        image, cv2.CV_32F, across, weight, anchor=anchor, borderType=cv2.BORDER_CONSTANT
    )
    return np.asarray(summed, dtype=np.float32)

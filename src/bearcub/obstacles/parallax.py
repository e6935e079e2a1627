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
from functools import cache
from itertools import pairwise
from typing import Any

import cv2
import numpy as np

from bearcub.ground.surface import Surface
from bearcub.messages import Float32, UInt8
from bearcub.stereo.native import COMPILED, core

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
class _Band:
    """Rows of a strip, `first` to `end`, whose levels from `far` to `near` one window fits.

    It has `wide` columns and `tall` rows.
    """

    far: float
    near: float
    wide: int
    tall: int
    first: int
    end: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Strip:
    """The rows of floor between two levels, and above it a thing's height.

    `step` full columns and ``2 step`` full rows are one pixel here, from the full row `first` on.
    """

    step: int
    first: int
    rows: int
    columns: int
    bands: list[_Band]


def feet(
    left: UInt8,
    right: UInt8,
    surface: Surface,
    *,
    baseline: float,
    offset: float,
    compiled: bool = COMPILED,
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
    compiled : bool
        By the native core, ``native/src/parallax.cpp``; else by NumPy. The same but for rounding,
        which decides of what is hardly sure enough.

    Returns
    -------
    list of Foot
        The surest first.
    """
    per_parallax = (surface.height - SIZE) / SIZE  # levels of floor per pixel of parallax
    farthest, nearest = (share * per_parallax for share in _PARALLAX)
    farthest = max(farthest, _LEAST_COLUMNS * baseline / SIZE)
    full = min(max(_FULL_COLUMNS * baseline / SIZE, farthest), nearest)
    find = _compiled if compiled else _peaks
    found: list[Foot] = []
    for step, low, high in ((1, farthest, full), (2, full, nearest)):
        strip = _strip(left.shape, surface, low, high, step=step, per_level=SIZE / baseline)
        if strip is None:
            continue
        for column, row, level, sure in find(left, right, surface, strip, offset):
            u, v = step * column + step // 2, strip.first + 2 * step * row + step
            found.append(Foot(u=u, v=v, level=level, sure=sure))
    return sorted(found, key=lambda foot: -foot.sure)


def _strip(
    shape: tuple[int, ...],
    surface: Surface,
    low: float,
    high: float,
    *,
    step: int,
    per_level: float,
) -> _Strip | None:
    """Return the strip between two levels; a thing has `per_level` columns by its foot's level."""
    if surface.plane[1] <= 0 or high <= low:
        return None
    first, end = _rows(surface, low, high, shape[1])
    first = max(0, first - 2 * step * math.ceil(_LEAST_COLUMNS))
    rows, columns = (min(shape[0], end) - first) // (2 * step), shape[1] // step
    if min(rows, columns) < _LEAST_COLUMNS:
        return None
    count = max(1, math.ceil(math.log(high / low) / math.log(_BAND)))
    bands = []
    for far, near in pairwise(low * (high / low) ** (k / count) for k in range(count + 1)):
        size = math.sqrt(near * far) * per_level / step
        tall = round(0.5 * size) + 1
        top, bottom = ((row - first) // (2 * step) for row in _rows(surface, far, near, shape[1]))
        top, bottom = max(0, top - tall), min(rows, bottom + 1)
        if bottom - top >= tall:
            wide = round(size) + 2
            bands.append(_Band(far=far, near=near, wide=wide, tall=tall, first=top, end=bottom))
    return _Strip(step=step, first=first, rows=rows, columns=columns, bands=bands)


def _rows(surface: Surface, low: float, high: float, columns: int) -> tuple[int, int]:
    """Return the rows, first and beyond the last, that have levels between two of them."""
    a, b, c = surface.plane.tolist()
    ends = [(level - c - a * u) / b for level in (low, high) for u in (0, columns - 1)]
    return math.floor(min(ends)), math.ceil(max(ends)) + 1


def _compiled(
    left: UInt8, right: UInt8, surface: Surface, strip: _Strip, offset: float
) -> list[tuple[int, int, float, float]]:
    bands = [(b.far, b.near, b.wide, b.tall, b.first, b.end) for b in strip.bands]
    found: list[tuple[int, int, float, float]] = core.find_feet(
        left,
        right,
        surface.plane.tolist(),
        surface.bend,
        offset,
        (strip.step, strip.first, strip.rows, strip.columns),
        bands,
        _tuning(),
    )
    return found


@cache
def _tuning() -> Any:
    """Return the numbers above for the native core."""
    return core.FeetTuning(
        sure=_SURE,
        least_share=_SHARES[0],
        most_share=_SHARES[1],
        noise=_NOISE,
        around_columns=_AROUND[0],
        around_rows=_AROUND[1],
    )


def _peaks(
    left: UInt8, right: UInt8, surface: Surface, strip: _Strip, offset: float
) -> Iterator[tuple[int, int, float, float]]:
    """Yield column and row, in the strip, of each foot, its level, and how sure it is."""
    fall = math.hypot(*surface.plane[:2].tolist())  # of the floor's disparity by the row
    one, other, floor = _warped(left, right, surface, strip, offset)
    g, difference, noise = _contrast(one, other)
    energy, seen = g * g, np.multiply(g, difference, out=difference)
    for band in strip.bands:
        part = slice(band.first, band.end)
        parallax = 2 * fall * (np.arange(band.tall, 0, -1, dtype=np.float32) - np.float32(0.5))
        expected = _summed(energy[part], band.wide, parallax * parallax)
        together = _summed(seen[part], band.wide, parallax)
        variance = expected * noise[part]
        likely = np.flatnonzero(together * together > np.float32(_SURE**2) * variance)
        v, u = np.divmod(likely, strip.columns)
        level, share = floor[part][v, u], together[v, u] / expected[v, u]
        stands = (level >= band.far) & (level < band.near)
        stands &= (share > _SHARES[0]) & (share < _SHARES[1])
        stands &= u - (level - offset) / strip.step > band.wide
        stands &= u < strip.columns - band.wide
        if not stands.any():
            continue
        v, u, level = v[stands], u[stands], level[stands]
        sure = np.zeros_like(variance)
        sure[v, u] = together[v, u] / np.sqrt(variance[v, u])
        highest = cv2.dilate(sure, np.ones((5, 2 * band.wide + 1), dtype=np.uint8))
        peak = sure[v, u] >= highest[v, u]
        columns = (u, v + band.first, level, sure[v, u])
        yield from zip(*(column[peak].tolist() for column in columns), strict=True)


def _warped(
    left: UInt8, right: UInt8, surface: Surface, strip: _Strip, offset: float
) -> tuple[UInt8, UInt8, Float32]:
    """Return a strip of the left image, the right one warped to it, and the floor's disparity."""
    a, b, c = surface.plane.tolist()
    step, rows, columns = strip.step, strip.rows, strip.columns
    window = np.s_[strip.first : strip.first + 2 * step * rows, : step * columns]
    one, other = (_shrunk(image[window], step) for image in (left, right))
    # pixels' middles
    u = step * np.arange(columns, dtype=np.float32) + np.float32(0.5 * (step - 1))
    v = strip.first + 2 * step * np.arange(rows, dtype=np.float32) + np.float32(step - 0.5)
    parts, _ = _coarse((rows, columns))  # the bend is smooth
    middles = (np.arange(parts, dtype=np.float32) + np.float32(0.5)) * (left.shape[1] / parts)
    levels = b * v[:, None] + c
    bend = surface.look_up(surface.bend, surface.entry(levels + a * middles))
    floor = np.asarray(cv2.resize(bend, (columns, rows)), dtype=np.float32)
    floor += levels
    floor += a * u
    at = (floor - np.float32(offset)) * np.float32(-1 / step)
    at += np.arange(columns, dtype=np.float32)
    return one, _linear(other, np.clip(at, 0, columns - 1, out=at)), floor


def _linear(image: UInt8, at: Float32) -> UInt8:
    """Return an image at fractional columns, none of which lies outside.

    OpenCV before 5 would round them to thirty-seconds.
    """
    pixels = np.append(image, image[-1, -1])
    whole = np.floor(at)
    at -= whole
    index = whole.astype(np.intp)
    index += image.shape[1] * np.arange(len(image))[:, None]
    here = pixels[index].astype(np.float32)
    index += 1
    at *= pixels[index] - here
    at += here
    at += np.float32(0.5)
    return at.astype(np.uint8)


def _shrunk(image: UInt8, step: int) -> UInt8:
    """Return an image of every `step` (1 or 2) columns, and twice as many rows, the mean."""
    halved = cv2.addWeighted(image[0::2], 0.5, image[1::2], 0.5, 0.0)
    if step == 2:
        size = image.shape[1] // 2, image.shape[0] // 4
        halved = cv2.resize(halved, size, interpolation=cv2.INTER_AREA)
    return np.asarray(halved, dtype=np.uint8)


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
    for part in ((size[0], len(image)), size):  # fastest by whole numbers of columns alone
        image = np.asarray(cv2.resize(image, part, interpolation=cv2.INTER_AREA), dtype=np.float32)
    return image


def _summed(image: Float32, wide: int, weight: Float32) -> Float32:
    """Return the weighted sums over windows in whose last row's middle the pixels are."""
    across = np.ones(wide, dtype=np.float32)
    anchor = (wide // 2, len(weight) - 1)
    summed = cv2.sepFilter2D(
        image, cv2.CV_32F, across, weight, anchor=anchor, borderType=cv2.BORDER_CONSTANT
    )
    return np.asarray(summed, dtype=np.float32)

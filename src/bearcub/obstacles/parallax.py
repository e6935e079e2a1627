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
from bearcub.obstacles.warp import (
    AROUND,
    LEAST,
    NOISE,
    Window,
    contrast,
    rows_between,
    warped,
    window_between,
)
from bearcub.stereo.native import COMPILED, core

SIZE = 0.1  # width and height of the thing that is looked for [m]
_SURE = 7.0  # standard errors by which it must show
_SHARES = (0.5, 2.5)  # of the parallax that may be seen: edges lie beside and above the outline
_PARALLAX = (0.3, 2.2)  # of its top off the floor: less is noise, more is the matcher's [px]
_FULL_COLUMNS = 13.0  # columns of a thing beyond which half the columns tell as much
_BAND = 1.7  # farthest over nearest range at which a window fits


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
    """Rows of a window, `first` to `end`, whose levels from `far` to `near` one window fits.

    It has `wide` columns and `tall` rows.
    """

    far: float
    near: float
    wide: int
    tall: int
    first: int
    end: int


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
    farthest = max(farthest, LEAST * baseline / SIZE)
    full = min(max(_FULL_COLUMNS * baseline / SIZE, farthest), nearest)
    find = _compiled if compiled else _peaks
    found: list[Foot] = []
    for step, low, high in ((1, farthest, full), (2, full, nearest)):
        window = window_between(left.shape, surface, low, high, step=step)
        if window is None:
            continue
        bands = _bands(window, surface, low, high, per_level=SIZE / baseline)
        for column, row, level, sure in find(left, right, surface, window, bands, offset):
            u, v = step * column + step // 2, window.first + 2 * step * row + step
            found.append(Foot(u=u, v=v, level=level, sure=sure))
    return sorted(found, key=lambda foot: -foot.sure)


def evidence(
    left: UInt8,
    right: UInt8,
    surface: Surface,
    window: Window,
    *,
    offset: float,
    compiled: bool = COMPILED,
) -> tuple[Float32, Float32, Float32]:
    """Return ``g^2``, ``g D`` and the variance of the noise of ``D`` around every pixel.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Rectified pair, grey.
    surface : Surface
        The floor.
    window : Window
        Of which rows.
    offset : float
        In the floor's disparities, not in the images [px].
    compiled : bool
        By the native core, ``native/src/parallax.cpp``; else by NumPy. The same but for rounding:
        of the warped image's grey levels a few are off by one.

    Returns
    -------
    tuple of ndarray of float32
        Of the window's shape each, in squares of grey levels.
    """
    if compiled:
        energy, seen, noise = np.empty((3, window.rows, window.columns), dtype=np.float32)
        plane, place = surface.plane.tolist(), (window.step, window.first)
        core.look_for_parallax(
            left, right, plane, surface.bend, offset, place, _tuning(), energy, seen, noise
        )
        return energy, seen, noise
    one, other, _ = warped(left, right, surface, window, offset=offset)
    gradient, difference, noise = contrast(one, other)
    return gradient * gradient, np.multiply(gradient, difference, out=difference), noise


def _bands(
    window: Window, surface: Surface, low: float, high: float, *, per_level: float
) -> list[_Band]:
    """Return the bands between two levels; a thing has `per_level` columns by its foot's level."""
    step, first, width = window.step, window.first, window.step * window.columns
    count = max(1, math.ceil(math.log(high / low) / math.log(_BAND)))
    bands = []
    for far, near in pairwise(low * (high / low) ** (k / count) for k in range(count + 1)):
        size = math.sqrt(near * far) * per_level / step
        tall = round(0.5 * size) + 1
        ends = rows_between(surface, far, near, width)
        top, bottom = ((row - first) // (2 * step) for row in ends)
        top, bottom = max(0, top - tall), min(window.rows, bottom + 1)
        if bottom - top >= tall:
            wide = round(size) + 2
            bands.append(_Band(far=far, near=near, wide=wide, tall=tall, first=top, end=bottom))
    return bands


def _compiled(
    left: UInt8,
    right: UInt8,
    surface: Surface,
    window: Window,
    bands: list[_Band],
    offset: float,
) -> list[tuple[int, int, float, float]]:
    found: list[tuple[int, int, float, float]] = core.find_feet(
        left,
        right,
        surface.plane.tolist(),
        surface.bend,
        offset,
        (window.step, window.first, window.rows, window.columns),
        [(b.far, b.near, b.wide, b.tall, b.first, b.end) for b in bands],
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
        noise=NOISE,
        around_columns=AROUND[0],
        around_rows=AROUND[1],
    )


def _peaks(
    left: UInt8,
    right: UInt8,
    surface: Surface,
    window: Window,
    bands: list[_Band],
    offset: float,
) -> Iterator[tuple[int, int, float, float]]:
    """Yield column and row, in the window, of each foot, its level, and how sure it is."""
    fall = math.hypot(*surface.plane[:2].tolist())  # of the floor's disparity by the row
    one, other, floor = warped(left, right, surface, window, offset=offset)
    g, difference, noise = contrast(one, other)
    energy, seen = g * g, np.multiply(g, difference, out=difference)
    for band in bands:
        part = slice(band.first, band.end)
        parallax = 2 * fall * (np.arange(band.tall, 0, -1, dtype=np.float32) - np.float32(0.5))
        expected = _summed(energy[part], band.wide, parallax * parallax)
        together = _summed(seen[part], band.wide, parallax)
        variance = expected * noise[part]
        likely = np.flatnonzero(together * together > np.float32(_SURE**2) * variance)
        v, u = np.divmod(likely, window.columns)
        level, share = floor[part][v, u], together[v, u] / expected[v, u]
        stands = (level >= band.far) & (level < band.near)
        stands &= (share > _SHARES[0]) & (share < _SHARES[1])
        stands &= u - (level - offset) / window.step > band.wide
        stands &= u < window.columns - band.wide
        if not stands.any():
            continue
        v, u, level = v[stands], u[stands], level[stands]
        sure = np.zeros_like(variance)
        sure[v, u] = together[v, u] / np.sqrt(variance[v, u])
        highest = cv2.dilate(sure, np.ones((5, 2 * band.wide + 1), dtype=np.uint8))
        peak = sure[v, u] >= highest[v, u]
        columns = (u, v + band.first, level, sure[v, u])
        yield from zip(*(column[peak].tolist() for column in columns), strict=True)


def _summed(image: Float32, wide: int, weight: Float32) -> Float32:
    """Return the weighted sums over windows in whose last row's middle the pixels are."""
    across = np.ones(wide, dtype=np.float32)
    anchor = (wide // 2, len(weight) - 1)
    summed = cv2.sepFilter2D(
        image, cv2.CV_32F, across, weight, anchor=anchor, borderType=cv2.BORDER_CONSTANT
    )
    return np.asarray(summed, dtype=np.float32)

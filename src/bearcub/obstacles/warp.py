"""The floor between two levels in both images: the right one warped to the left one by it."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from bearcub.ground.surface import Surface
from bearcub.messages import Float32, UInt8

_LEAST_COLUMNS = 5.0  # rows below which there is nothing to look at
_AROUND = (32, 8)  # columns and rows whose brightness and noise are one
_NOISE = 0.3  # variance that rounding leaves [grey levels squared]


@dataclass(frozen=True, slots=True, kw_only=True)
class Warped:
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


def _rows(surface: Surface, low: float, high: float, columns: int) -> tuple[int, int]:
    """Return the rows, first and beyond the last, that have levels between two of them."""
    a, b, c = surface.plane.tolist()
    ends = [(level - c - a * u) / b for level in (low, high) for u in (0, columns - 1)]
    return math.floor(min(ends)), math.ceil(max(ends)) + 1


def warped_floor(
    left: UInt8,
    right: UInt8,
    surface: Surface,
    low: float,
    high: float,
    *,
    step: int,
    offset: float,
) -> Warped | None:
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
    return Warped(
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


def contrast(left: UInt8, right: UInt8) -> tuple[Float32, Float32, Float32]:
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

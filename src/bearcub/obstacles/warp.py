"""The floor between two levels in both images: the right one warped to the left one by it."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from bearcub.ground.surface import Surface
from bearcub.messages import Float32, UInt8

LEAST = 5.0  # columns and rows of what shows, and below which there is nothing to look at [px]
AROUND = (32, 8)  # columns and rows whose brightness and noise are one
NOISE = 0.3  # variance that rounding leaves [grey levels squared]


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """The rows of floor between two levels, and a few above for what stands there.

    `step` full columns and ``2 step`` full rows are one pixel here, from the full row `first` on.
    """

    step: int
    first: int
    rows: int
    columns: int


def window_between(
    shape: tuple[int, ...], surface: Surface, low: float, high: float, *, step: int
) -> Window | None:
    """Return the window of floor between two levels, None where too little of it is in view.

    Parameters
    ----------
    shape : tuple of int
        Of the images.
    surface : Surface
        The floor.
    low, high : float
        Levels of its plane [px].
    step : int
        1 or 2.
    """
    if surface.plane[1] <= 0 or high <= low:
        return None
    first, end = rows_between(surface, low, high, shape[1])
    first = max(0, first - 2 * step * math.ceil(LEAST))
    rows, columns = (min(shape[0], end) - first) // (2 * step), shape[1] // step
    if min(rows, columns) < LEAST:
        return None
    return Window(step=step, first=first, rows=rows, columns=columns)


def rows_between(surface: Surface, low: float, high: float, columns: int) -> tuple[int, int]:
    """Return the rows, first and beyond the last, that have levels between two of them."""
    a, b, c = surface.plane.tolist()
    ends = [(level - c - a * u) / b for level in (low, high) for u in (0, columns - 1)]
    return math.floor(min(ends)), math.ceil(max(ends)) + 1


def warped(
    left: UInt8, right: UInt8, surface: Surface, window: Window, *, offset: float
) -> tuple[UInt8, UInt8, Float32]:
    """Return a window of the left image, the right one warped to it, and the floor's disparity."""
    a, b, c = surface.plane.tolist()
    step, rows, columns = window.step, window.rows, window.columns
    part = np.s_[window.first : window.first + 2 * step * rows, : step * columns]
    one, other = (_shrunk(image[part], step) for image in (left, right))
    # pixels' middles
    u = step * np.arange(columns, dtype=np.float32) + np.float32(0.5 * (step - 1))
    v = window.first + 2 * step * np.arange(rows, dtype=np.float32) + np.float32(step - 0.5)
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
    variance = _averaged(difference * difference, coarse) + np.float32(NOISE)
    return (
        np.asarray(gradient, dtype=np.float32),
        difference,
        np.asarray(cv2.resize(variance, size), dtype=np.float32),
    )


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


def _coarse(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return how many columns and rows of pixels whose surroundings are one an image has."""
    return max(1, shape[1] // AROUND[0]), max(1, shape[0] // AROUND[1])


def _averaged(image: Float32, size: tuple[int, int]) -> Float32:
    for part in ((size[0], len(image)), size):  # fastest by whole numbers of columns alone
        image = np.asarray(cv2.resize(image, part, interpolation=cv2.INTER_AREA), dtype=np.float32)
    return image

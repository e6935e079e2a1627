"""The floor as a picture: its disparity, and how far from it a pixel may lie and still be floor."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Float32, Ground

_COARSE = 4  # pixels of a cell of the grid on which bend and noise are looked up
_BORDER_SHARE = 0.5  # the floor's own uncertainty is taken in the lower half of the image


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """The floor of one frame, arrays of shape (H, W).

    Attributes
    ----------
    floor : ndarray of float32
        Its disparity [px]; zero or less above the horizon.
    noise : ndarray of float32
        1-sigma of a pixel of floor there, the floor's own uncertainty included [px].
    """

    floor: Float32
    noise: Float32


def floor_surface(ground: Ground, shape: tuple[int, int]) -> Surface:
    """Return the floor's disparity and noise at every pixel.

    The plane's own disparity (the level) is the coordinate of bend and noise: both are looked up
    on a coarse grid, since they change slowly, and enlarged.

    Parameters
    ----------
    ground : Ground
    shape : tuple of int
        (H, W) of the image.

    Returns
    -------
    Surface
    """
    floor = _plane(ground, shape)
    own = floor_sigma(ground, shape)
    if len(ground.knots) == 0:
        even = np.full(shape, math.hypot(ground.noise, own), dtype=np.float32)
        return Surface(floor=floor, noise=even)
    coarse = (max(1, shape[0] // _COARSE), max(1, shape[1] // _COARSE))
    level = _full_size(floor, (coarse[1], coarse[0]), cv2.INTER_LINEAR)
    noise = np.hypot(np.interp(level, ground.knots, ground.knot_noise), own).astype(np.float32)
    bend = bend_at(ground, level.astype(np.float64)).astype(np.float32)
    size = (shape[1], shape[0])
    floor += _full_size(bend, size, cv2.INTER_LINEAR)
    return Surface(floor=floor, noise=_full_size(noise, size, cv2.INTER_LINEAR))


def _full_size(image: Float32, size: tuple[int, int], interpolation: int) -> Float32:
    """Return `image` at another (width, height), pixel centres kept in place."""
    return np.asarray(cv2.resize(image, size, interpolation=interpolation), dtype=np.float32)


def floor_disparity(ground: Ground, shape: tuple[int, int]) -> Float32:
    """Return the floor's disparity [px], shape (H, W); zero or less above the horizon."""
    return floor_surface(ground, shape).floor


def bend_at(ground: Ground, level: Float64) -> Float64:
    """Return what the bend adds [px] where the plane's own disparity is `level`."""
    if len(ground.knots) == 0:
        return np.zeros_like(level)
    # beyond the last floor seen it stays as high above the plane: less bend for less disparity
    knots, bend = np.append(0.0, ground.knots), np.append(0.0, ground.bend)
    return np.asarray(np.interp(level, knots, bend), dtype=np.float64)


def floor_sigma(ground: Ground, shape: tuple[int, int]) -> float:
    """Return the largest 1-sigma of the floor's disparity over the image [px], noise excluded."""
    rows, columns = shape
    corners = np.array(
        [[u, v, 1.0] for u in (0, columns - 1) for v in (_BORDER_SHARE * rows, rows - 1)]
    )
    variance = np.einsum("ni,ij,nj->n", corners, ground.covariance, corners)
    return float(np.sqrt(variance.max()))


def _plane(ground: Ground, shape: tuple[int, int]) -> Float32:
    a, b, c = ground.plane.astype(np.float32)
    rows, columns = shape
    level: Float32 = (
        b * np.arange(rows, dtype=np.float32)[:, None]
        + (a * np.arange(columns, dtype=np.float32) + c)[None, :]
    )
    return level

"""The floor as a picture: its disparity, and how far from it a pixel may lie and still be floor."""

from dataclasses import dataclass

import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Float32, Ground

_FINE = 16  # steps per pixel of the tables by level
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
    in tables with sixteen steps per pixel of it.

    Parameters
    ----------
    ground : Ground
    shape : tuple of int
        (H, W) of the image.

    Returns
    -------
    Surface
    """
    level = _plane(ground, shape)
    own = floor_sigma(ground, shape)
    if len(ground.knots) == 0:
        noise = np.float32(np.hypot(ground.noise, own))
        return Surface(floor=level, noise=np.full(shape, noise, dtype=np.float32))
    steps = np.arange(0, max(1.0, float(level.max())) + 1.0, 1 / _FINE)
    index = (level * np.float32(_FINE)).astype(np.int32)
    bend = bend_at(ground, steps).astype(np.float32)
    noise_table = np.hypot(np.interp(steps, ground.knots, ground.knot_noise), own)
    level += np.take(bend, index, mode="clip")
    return Surface(floor=level, noise=np.take(noise_table.astype(np.float32), index, mode="clip"))


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

"""The floor by its level: its disparity, and how noisy a pixel of it is, wherever it is asked for.

The plane's own disparity (the level) is the coordinate of bend and noise. Both are tabulated by
level once a frame; any pixel, window or grid of the image then costs one look-up.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import Float32, Ground

_STEPS = 16  # entries of the tables per pixel of level
_BORDER_SHARE = 0.5  # the floor's own uncertainty is taken in the lower half of the image

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """The floor of one frame.

    Attributes
    ----------
    plane : ndarray of float32, shape (3,)
        (a, b, c) of the level ``a u + b v + c``.
    height : float
        Of the camera above it [m].
    bend : ndarray of float32, shape (N,)
        Disparity of the floor less the level [px], by sixteenths of a pixel of level.
    noise : ndarray of float32, shape (N,)
        1-sigma of a pixel of floor there, the floor's own uncertainty included [px].
    levels : ndarray of float32, shape (N,)
        Of the tables' entries [px].
    rising : ndarray of float64, shape (N,)
        The floor's disparity there [px]; where it falls towards the robot, as at a step up, that of
        the floor before.
    """

    plane: Float32
    height: float
    bend: Float32
    noise: Float32
    levels: Float32 = field(init=False)
    rising: Float64 = field(init=False)

    def __post_init__(self) -> None:
        """Tabulate what follows from the bend."""
        levels = np.arange(len(self.bend), dtype=np.float32) / np.float32(_STEPS)
        rising = np.maximum.accumulate(levels + self.bend).astype(np.float64)
        object.__setattr__(self, "levels", levels)
        object.__setattr__(self, "rising", rising)

    @classmethod
    def of(cls, ground: Ground, shape: tuple[int, int]) -> "Surface":
        """Return the surface of `ground` for images of `shape`."""
        rows, columns = shape
        a, b, c = ground.plane
        largest = max(0.0, c) + max(0.0, a * (columns - 1)) + max(0.0, b * (rows - 1))
        levels = np.arange(math.ceil(largest * _STEPS) + 2) / _STEPS
        own = floor_sigma(ground, shape)
        followed = len(ground.knots) > 0
        noise = (
            np.interp(levels, ground.knots, ground.knot_noise)
            if followed
            else np.full_like(levels, ground.noise)
        )
        return cls(
            plane=ground.plane.astype(np.float32),
            height=ground.height,
            bend=bend_at(ground, levels).astype(np.float32),
            noise=np.sqrt(noise**2 + own**2).astype(np.float32),
        )

    def level(self, u: Index, v: Index) -> Float32:
        """Return the plane's disparity [px] at pixels, broadcast against each other."""
        a, b, c = self.plane
        level: Float32 = (a * u.astype(np.float32) + c) + b * v.astype(np.float32)
        return level

    def entry(self, level: Float32) -> Index:
        """Return where the tables hold what belongs to `level`; above the horizon below 0."""
        scaled = level * np.float32(_STEPS)
        scaled += np.float32(0.5)
        return scaled.astype(np.int64)

    @staticmethod
    def look_up(table: Float32, entry: Index) -> Float32:
        """Return what a table by level holds at entries; its first at those above the horizon."""
        return table.take(entry, mode="clip")

    def at(self, u: Index, v: Index) -> Float32:
        """Return the floor's disparity [px] at pixels; zero or less above the horizon."""
        level = self.level(u, v)
        level += self.look_up(self.bend, self.entry(level))
        return level

    def lift(self, disparity: float) -> float:
        """Return how high above the plane the floor lies [m] where it has this disparity [px]."""
        level = float(np.interp(disparity, self.rising, self.levels))
        return self.height * (1 - level / disparity) if disparity > 0 else 0.0


def floor_disparity(ground: Ground, shape: tuple[int, int]) -> Float32:
    """Return the floor's disparity [px], shape (H, W); zero or less above the horizon."""
    return Surface.of(ground, shape).at(np.arange(shape[1])[None, :], np.arange(shape[0])[:, None])


def bend_at(ground: Ground, level: Float64) -> Float64:
    """Return what the bend adds [px] where the plane's own disparity is `level`."""
    if len(ground.knots) == 0:
        return np.zeros_like(level)
    # beyond the last floor seen it stays as high above the plane: less bend for less disparity
    table = np.zeros((2, len(ground.knots) + 1))
    table[0, 1:], table[1, 1:] = ground.knots, ground.bend
    return np.asarray(np.interp(level, *table), dtype=np.float64)


def floor_sigma(ground: Ground, shape: tuple[int, int]) -> float:
    """Return the largest 1-sigma of the floor's disparity over the image [px], noise excluded."""
    rows, columns = shape
    corners = np.array(
        [[u, v, 1.0] for u in (0, columns - 1) for v in (_BORDER_SHARE * rows, rows - 1)]
    )
    variance = (corners @ ground.covariance * corners).sum(axis=1)
    return math.sqrt(variance.max())

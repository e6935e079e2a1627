"""Every pixel against the floor: above it, on it, or below it (the paper's floor cancellation)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bearcub.ground.surface import Surface
from bearcub.messages import Bool, Float32, Ground
from bearcub.stereo.native import COMPILED, core

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sorting:
    """The pixels of a part of one frame sorted by the floor, arrays of shape (H, W).

    Attributes
    ----------
    u, v : ndarray of int64, shape (W,) and (H,)
        Columns and rows of the image that the part holds.
    disparity, floor : ndarray of float32
        Measured; of the floor [px].
    residual : ndarray of float32
        Measured less floor [px]; NaN unmatched.
    allowed : ndarray of float32
        How far from the floor a pixel may lie and still be floor [px].
    standing, on_floor, below : ndarray of bool
    """

    u: Index
    v: Index
    disparity: Float32
    floor: Float32
    residual: Float32
    allowed: Float32
    standing: Bool
    on_floor: Bool
    below: Bool

    def between(self, farthest: float, nearest: float) -> Bool:
        """Return which pixels stand and have a disparity from one to the other [px]."""
        found: Bool = self.standing & (self.disparity <= nearest) & (self.disparity >= farthest)
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Sorter:
    """Sorts any part of a frame by the floor: the whole of it coarsely, a window exactly.

    The tolerance is `sigmas` times the noise at that level, and the bumps that still are floor: a
    bump H high adds ``d H / h`` to the disparity d.

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px], NaN unmatched.
    surface : Surface
    tolerance : ndarray of float32
        By the entries of the surface's tables [px].
    farthest_level : float
        Least disparity of floor that is told from the horizon [px].
    """

    disparity: Float32
    surface: Surface
    tolerance: Float32
    farthest_level: float

    @classmethod
    def of(
        cls,
        disparity: Float32,
        ground: Ground,
        *,
        sigmas: float,
        unevenness: float,
        farthest_level: float,
    ) -> "Sorter":
        """Return the sorter of one frame.

        Parameters
        ----------
        disparity : ndarray of float32, shape (H, W)
            [px], NaN unmatched.
        ground : Ground
        sigmas : float
        unevenness : float
            Height of bumps that still are floor [m].
        farthest_level : float
            Least disparity of floor that is told from the horizon [px].
        """
        surface = Surface.of(ground, disparity.shape)
        bumps = np.maximum(surface.levels + surface.bend, 0) * np.float32(
            unevenness / ground.height
        )
        return cls(
            disparity=disparity,
            surface=surface,
            tolerance=bumps + np.float32(sigmas) * surface.noise,
            farthest_level=farthest_level,
        )

    def part(self, rows: slice, columns: slice, *, compiled: bool = COMPILED) -> Sorting:
        """Sort a window, or with steps in the slices a grid, of the image.

        Parameters
        ----------
        rows, columns : slice
        compiled : bool
            By the native core, ``native/src/grid.cpp``; else by NumPy. The same to the bit.
        """
        height, width = self.disparity.shape
        down, right = rows.indices(height), columns.indices(width)
        v, u = np.arange(*down), np.arange(*right)
        shape = (len(v), len(u))
        floats = np.empty((4, *shape), dtype=np.float32)
        truths = np.empty((3, *shape), dtype=np.bool_)
        if compiled:
            place = (down[0], right[0], down[2], right[2], *shape)
            surface = self.surface
            plane, bend = surface.plane.tolist(), surface.bend
            core.sort_pixels(
                self.disparity,
                plane,
                bend,
                self.tolerance,
                self.farthest_level,
                place,
                *floats,
                *truths,
            )
        else:
            floats[0] = self.disparity[rows, columns]
            self._sort(u, v, floats, truths)
        return Sorting(
            u=u,
            v=v,
            disparity=floats[0],
            floor=floats[1],
            residual=floats[2],
            allowed=floats[3],
            standing=truths[0],
            on_floor=truths[1],
            below=truths[2],
        )

    def standing(self, rows: slice, columns: slice, farthest: float, nearest: float) -> Bool:
        """Return which pixels of a window stand and have a disparity from one to the other [px]."""
        height, width = self.disparity.shape
        v, u = np.arange(*rows.indices(height)), np.arange(*columns.indices(width))
        d = self.disparity[rows, columns]
        floor = self.surface.level(u[None, :], v[:, None])
        entry = self.surface.entry(floor)
        floor += self.surface.look_up(self.surface.bend, entry)
        found: Bool = d - floor > self.surface.look_up(self.tolerance, entry)  # not where NaN
        found &= d <= nearest
        found &= d >= farthest
        return found

    def _sort(self, u: Index, v: Index, floats: Float32, truths: Bool) -> None:
        """Fill in floor, residual and allowed, and what the pixels are."""
        disparity, floor, residual, allowed = floats
        standing, on_floor, below = truths
        level = self.surface.level(u[None, :], v[:, None])
        entry = self.surface.entry(level)
        np.add(level, self.surface.look_up(self.surface.bend, entry), out=floor)
        allowed[:] = self.surface.look_up(self.tolerance, entry)
        np.subtract(disparity, floor, out=residual)
        floor_here = floor > self.farthest_level
        np.greater(residual, allowed, out=standing)  # NaN compares false
        np.logical_and(np.abs(residual) <= allowed, floor_here, out=on_floor)
        np.logical_and(residual < -allowed, floor_here, out=below)

    def noise_of(self, part: Sorting, *, times: float, least: float) -> Float32:
        """Return so many 1-sigmas of a pixel of floor, or `least`, at every pixel [px]."""
        level = self.surface.level(part.u[None, :], part.v[:, None])
        noise = np.maximum(least, times * self.surface.noise)
        return self.surface.look_up(noise, self.surface.entry(level))

    def tolerance_at(self, u: Index, v: Index) -> Float32:
        """Return how far from the floor pixels may lie and still be floor [px]."""
        entry = self.surface.entry(self.surface.level(u, v))
        return self.surface.look_up(self.tolerance, entry)

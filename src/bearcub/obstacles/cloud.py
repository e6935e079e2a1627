"""The points of one thing in ``base_link``, and what measuring asks of them."""

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64, Projection
from bearcub.messages import Float32
from bearcub.obstacles.face import Face, face_of, face_tuning
from bearcub.robust import quantile, ranked_by_group
from bearcub.stereo.native import COMPILED, core

_F = TypeVar("_F", np.float32, np.float64)
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """The camera in ``base_link``: what turns pixels into metres over the floor.

    Attributes
    ----------
    projection : Projection
    base_from_optical : ndarray of float64, shape (3, 3)
    origin : ndarray of float64, shape (3,)
        The left camera in ``base_link`` [m].
    """

    projection: Projection
    base_from_optical: Float64
    origin: Float64

    @property
    def numbers(self) -> tuple[tuple[float, ...], list[list[float]], list[float]]:
        """Projection, rotation and origin as plain numbers."""
        return self.projection.numbers, self.base_from_optical.tolist(), self.origin.tolist()

    def points(self, u: NDArray[_F], v: NDArray[_F], disparity: NDArray[_F]) -> NDArray[_F]:
        """Return the points [m] in ``base_link`` of pixels, shape (3, N), as precise as these."""
        p = self.projection
        rays = np.empty((3, len(u)), dtype=disparity.dtype)
        rays[0], rays[1], rays[2] = (u - p.cx) * (1 / p.fx), (v - p.cy) * (1 / p.fy), 1.0
        points: NDArray[_F] = self.base_from_optical.astype(rays.dtype) @ rays
        with np.errstate(divide="ignore", invalid="ignore"):  # what is infinitely far is nowhere
            points *= p.fx * p.baseline / disparity
        points += self.origin.astype(rays.dtype)[:, None]
        return points

    def pixels(self, points: Float64) -> tuple[Float64, Float64, Float64]:
        """Return columns, rows and disparities [px] of points in ``base_link``, shape (3, N)."""
        p = self.projection
        x, y, z = self.base_from_optical.T @ (points - self.origin[:, None])
        return p.cx + p.fx * x / z, p.cy + p.fy * y / z, p.fx * p.baseline / z


class Cloud(Protocol):
    """Bearings, ranges and heights of a thing's pixels."""

    def sides(self, step: float, share: float) -> tuple[float, float]:
        """Return the bearings between which a thing's pixels lie, right and left [rad].

        Parameters
        ----------
        step : float
            Of the histogram [rad].
        share : float
            Of a typical bin's pixels at which the thing ends.
        """

    def heights(self, step: float, share: float) -> tuple[float, float]:
        """Return the heights between which they lie [m]; see `sides`."""

    def face(
        self, right: float, left: float, pixel: float, blur: float, alike: float
    ) -> tuple[float, ...]:
        """Return the numbers of the `Face` between two bearings: see `face_of`."""

    def range(self, share: float) -> float:
        """Return the range that this share of the pixels are nearer than [m]."""

    def height_before(self, limit: float, share: float) -> float:
        """Return the height that this share of the pixels nearer than `limit` lie below [m].

        NaN where none is nearer.
        """

    def squares(self) -> float:
        """Return the sum of the squares of the ranges [m²]."""

    def spread(self) -> tuple[float, float, float]:
        """Return sums about the means: range squared, range by height, height squared [m²]."""


def cloud_of(
    view: View, u: Float64, v: Float64, disparity: Float32, *, compiled: bool = COMPILED
) -> Cloud:
    """Return the points of pixels.

    Parameters
    ----------
    view : View
    u, v : ndarray of float64, shape (N,)
        Columns and rows [px].
    disparity : ndarray of float32, shape (N,)
        [px], above 0.
    compiled : bool
        By the native core, ``native/src/cloud.cpp``; else by NumPy. Bearings agree to 2e-12 rad.
    """
    if compiled:
        made: Cloud = core.Cloud(*view.numbers, u, v, disparity, face_tuning())
        return made
    return _InNumpy(view, u, v, disparity)


class _InNumpy:
    def __init__(self, view: View, u: Float64, v: Float64, disparity: Float32) -> None:
        x, y, self._height = view.points(u, v, disparity.astype(np.float64))
        self._bearing = np.arctan2(y, x)
        self._range = np.sqrt(x * x + y * y)
        self._ascending = np.sort(self._range)

    def sides(self, step: float, share: float) -> tuple[float, float]:
        return _ends(self._bearing, step, share)

    def heights(self, step: float, share: float) -> tuple[float, float]:
        return _ends(self._height, step, share)

    def face(self, right: float, left: float, pixel: float, blur: float, alike: float) -> Face:
        return face_of(self._directions, right, left, pixel=pixel, blur=blur, alike=alike)

    def _directions(
        self, right: float, left: float, count: int, near: int
    ) -> tuple[list[float], list[float], list[float]]:
        position = (self._bearing - right) / max(left - right, 1e-9) * count
        group = np.minimum(np.maximum(position, 0), count - 1).astype(np.int64)
        counts = np.bincount(group, minlength=count)
        first, middle = ranked_by_group(self._range, group, counts, counts // near, counts // 2)
        return counts.tolist(), first.tolist(), middle.tolist()

    def range(self, share: float) -> float:
        return float(self._ascending[int(share * (len(self._ascending) - 1) + 0.5)])

    def height_before(self, limit: float, share: float) -> float:
        before = self._height[self._range < limit]
        return quantile(before, share) if len(before) else float("nan")

    def squares(self) -> float:
        return float(self._range @ self._range)

    def spread(self) -> tuple[float, float, float]:
        reach, height = self._range - self._range.mean(), self._height - self._height.mean()
        return float(reach @ reach), float(reach @ height), float(height @ height)


def _ends(values: Float64, step: float, share: float) -> tuple[float, float]:
    """Return where the histogram of `values` with bins of `step` rises and falls.

    The ends are interpolated inside the bin where the count crosses a share of the typical one,
    so that stray pixels beyond a thing's edge do not move them.
    """
    start = float(values.min()) - 1.5 * step
    bins = ((values - start) * (1 / step)).astype(np.int64)
    counts = np.bincount(bins)
    typical = _typical(counts)
    threshold = max(share * typical, 0.5)
    first, last = _main_run(counts, threshold)
    # the edge bin is partly covered: its share of the typical count is the covered part
    low = start + (first + 1 - min(1.0, int(counts[first]) / typical)) * step
    high = start + (last + min(1.0, int(counts[last]) / typical)) * step
    return low, high


def _typical(counts: Index) -> int:
    """Return the count of the bin in which the median pixel lies: sparse bins have no say."""
    ordered = np.sort(counts)
    total = ordered.cumsum()
    return int(ordered[total.searchsorted(0.5 * total[-1])])


def _main_run(counts: Index, threshold: float) -> tuple[int, int]:
    """Return the first and last bin of the fullest run of bins above `threshold`.

    Small gaps belong to a run: matches fail on parts of a thing.
    """
    above = np.flatnonzero(counts >= threshold)
    gap = max(4, len(above) // 4)
    gaps = np.flatnonzero(above[1:] - above[:-1] > gap) + 1
    if len(gaps) == 0:
        return int(above[0]), int(above[-1])
    fullest = max(np.split(above, gaps), key=lambda run: int(counts[run].sum()))
    return int(fullest[0]), int(fullest[-1])

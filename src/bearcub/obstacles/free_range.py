"""How far the way is free in each direction, and what ends it."""

import math

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import FreeRange, Layers, Limit, Obstacle, Pixel, Terrain
from bearcub.obstacles.measure import View

_PIXELS = 6000
_CELLS = 64  # of range between nothing and the farthest, each as much longer as it is farther
_NEAREST = 0.2  # least range told [m]
_GAP = 3  # cells without floor that end the way: floor unseen is not free
_FOOT = 1.3  # a thing this much farther than the last floor seen is what ends it
_HITS = 3  # pixels that make an end, against stray ones

Index = NDArray[np.int64]


def free_range(
    layers: Layers,
    obstacles: tuple[Obstacle, ...],
    terrain: Terrain,
    view: View,
    *,
    step: float,
    farthest: float,
    clearance: float,
    steepest: float,
) -> FreeRange:
    """Tell the free range in every direction of the view.

    A way is free as far as floor was seen without a gap and nothing stands on it; what hangs
    higher than `clearance` does not count. Ground that was not seen is not free.

    Parameters
    ----------
    layers : Layers
    obstacles : tuple of Obstacle
    terrain : Terrain
    view : View
    step : float
        Between directions [rad].
    farthest : float
        [m].
    clearance : float
        [m].
    steepest : float
        Steepest ground that is a way [rad].

    Returns
    -------
    FreeRange
        NaN ranges where no floor at all was seen.
    """
    bearings = _directions(view, layers.kind.shape[1], step)
    sector, reach, kind, label = _pixels(layers, view, float(bearings[0]), step, len(bearings))
    ends = _seen_until(sector, reach, kind == Pixel.FLOOR, len(bearings), farthest)
    limits = [Limit.UNSEEN] * len(bearings)
    overhead = np.array([False] + [o.base_height > clearance for o in obstacles])
    blocked = (kind == Pixel.OBSTACLE) & ~overhead[np.maximum(label, 0)]
    for what, mask in ((Limit.OBSTACLE, blocked), (Limit.HOLE, kind == Pixel.HOLE)):
        hit = _first_hits(sector[mask], reach[mask], len(bearings))
        # an unseen strip before a thing is its own foot; beyond the floor's end it is the limit
        reached = hit <= np.where(np.isnan(ends), math.inf, _FOOT * ends)
        for k in np.flatnonzero(reached & np.isfinite(hit)):
            if limits[k] == Limit.UNSEEN or hit[k] < ends[k]:
                limits[k] = what
            ends[k] = np.fmin(hit[k], ends[k])
    for band in terrain.profile:
        if abs(band.slope) - band.sigma > steepest:
            limits = [
                Limit.SLOPE if end > band.start else limit
                for end, limit in zip(ends, limits, strict=True)
            ]
            ends = np.minimum(ends, band.start)
    return FreeRange(bearing=bearings, range=ends, limit=tuple(limits))


def _directions(view: View, columns: int, step: float) -> Float64:
    """Return the multiples of `step` inside the field of view, right to left."""
    p = view.projection
    left = math.atan2(p.cx, p.fx)
    right = -math.atan2(columns - 1 - p.cx, p.fx)
    return step * np.arange(math.ceil(right / step), math.floor(left / step) + 1, dtype=np.float64)


def _pixels(
    layers: Layers, view: View, first: float, step: float, count: int
) -> tuple[Index, Float64, Index, Index]:
    """Return direction, range [m], kind and label of a grid of pixels."""
    rows, columns = layers.kind.shape
    stride = max(1, int(math.sqrt(rows * columns / _PIXELS)))
    kind = layers.kind[::stride, ::stride]
    seen = (kind == Pixel.FLOOR) | (kind == Pixel.OBSTACLE) | (kind == Pixel.HOLE)
    seen &= layers.disparity[::stride, ::stride] > 0
    index = np.flatnonzero(seen)
    what = kind.ravel()[index].astype(np.int64)
    v, u = np.divmod(index, seen.shape[1])
    u, v = u * stride, v * stride
    # a hole begins where its floor is missing, not where the line of sight ends in it
    d = np.where(what == Pixel.HOLE, layers.floor[v, u], layers.disparity[v, u])
    points = view.points(u.astype(np.float64), v.astype(np.float64), d.astype(np.float64))
    bearing = np.arctan2(points[:, 1], points[:, 0])
    sector = np.rint((bearing - first) / step).astype(np.int64)
    inside = (sector >= 0) & (sector < count)
    reach = np.hypot(points[:, 0], points[:, 1])
    label = layers.labels[v, u].astype(np.int64)
    return sector[inside], reach[inside], what[inside], label[inside]


def _seen_until(
    sector: Index, reach: Float64, floor: NDArray[np.bool_], count: int, farthest: float
) -> Float64:
    """Return how far floor is seen in each direction without a gap [m]; NaN where never."""
    growth = math.log(farthest / _NEAREST) / _CELLS
    cell = np.floor(np.log(np.maximum(reach, _NEAREST) / _NEAREST) / growth).astype(np.int64)
    use = floor & (cell < _CELLS)
    seen = np.zeros((count, _CELLS + _GAP), dtype=bool)
    seen[sector[use], cell[use]] = True
    first = seen.argmax(axis=1)
    windows = np.lib.stride_tricks.sliding_window_view(seen, _GAP, axis=1)
    gaps = ~windows.any(axis=2) & (np.arange(windows.shape[1])[None, :] > first[:, None])
    end = np.where(gaps.any(axis=1), gaps.argmax(axis=1), _CELLS)
    ends = np.minimum(_NEAREST * np.exp(end * growth), farthest)
    return np.where(seen.any(axis=1), ends, math.nan)


def _first_hits(sector: Index, reach: Float64, count: int) -> Float64:
    """Return the range of the third nearest pixel of each direction [m], else inf."""
    order = np.lexsort((reach, sector))
    sector, reach = sector[order], reach[order]
    starts = np.searchsorted(sector, np.arange(count + 1))
    enough = np.diff(starts) >= _HITS
    hits = np.full(count, math.inf)
    hits[enough] = reach[starts[:-1][enough] + _HITS - 1]
    return hits

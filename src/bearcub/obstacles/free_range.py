"""How far the way is free in each direction, and what ends it."""

import math

import numpy as np

from bearcub.messages import FreeRange, Ground, Hole, Layers, Limit, Obstacle, Pixel, Terrain
from bearcub.obstacles.measure import View

_PIXELS = 20000


def free_range(
    layers: Layers,
    obstacles: tuple[Obstacle, ...],
    holes: tuple[Hole, ...],
    terrain: Terrain,
    view: View,
    ground: Ground,
    *,
    step: float,
    farthest: float,
    clearance: float,
    steepest: float,
) -> FreeRange:
    """Tell the free range in every direction of the view.

    Ground that was not seen is not free: the range ends where floor was last seen without a gap
    longer than the robot may jump over.
    """
    rows, columns = layers.kind.shape
    stride = max(1, int(math.sqrt(rows * columns / _PIXELS)))
    kind = layers.kind[::stride, ::stride]
    v, u = np.nonzero((kind == Pixel.FLOOR) | (kind == Pixel.OBSTACLE) | (kind == Pixel.HOLE))
    what = kind[v, u]
    label = layers.labels[::stride, ::stride][v, u]
    u, v = u * stride, v * stride
    points = view.points(
        u.astype(np.float64), v.astype(np.float64), layers.disparity[v, u].astype(np.float64)
    )
    bearing = np.arctan2(points[:, 1], points[:, 0])
    reach = np.hypot(points[:, 0], points[:, 1])
    bearings = _directions(view, columns, step)
    overhead = np.array([False] + [o.base_height > clearance for o in obstacles])
    blocking = (what == Pixel.OBSTACLE) & ~overhead[np.maximum(label, 0)]
    sector = np.rint((bearing - bearings[0]) / step).astype(np.int64)
    ranges, limits = [], []
    for k in range(len(bearings)):
        here = sector == k
        seen = np.sort(reach[here & (what == Pixel.FLOOR) & (reach < farthest)])
        end, limit = _seen_until(seen), Limit.UNSEEN
        for kind_of, mask in ((Limit.OBSTACLE, blocking), (Limit.HOLE, what == Pixel.HOLE)):
            hits = reach[here & mask]
            if len(hits) >= 3:
                near = float(np.partition(hits, 2)[2])
                if near < end + 0.3 * max(1.0, end):
                    end, limit = min(near, max(end, near)), kind_of
        ranges.append(end)
        limits.append(limit)
    del holes, terrain, ground, steepest
    return FreeRange(bearing=bearings, range=np.array(ranges), limit=tuple(limits))


def _directions(
    view: View, columns: int, step: float
) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    p = view.projection
    left = math.atan2(p.cx, p.fx)
    right = -math.atan2(columns - 1 - p.cx, p.fx)
    first, last = math.ceil(right / step), math.floor(left / step)
    return np.arange(first, last + 1) * step


def _seen_until(reach: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> float:
    """Return how far the floor is seen without a gap of more than 0.3 m or 15 %."""
    if len(reach) < 3:
        return math.nan
    gap = np.diff(reach) > np.maximum(0.3, 0.15 * reach[:-1])
    last = int(np.argmax(gap)) if gap.any() else len(reach) - 1
    return float(reach[last])

"""How far the way is free in each direction, and what ends it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import Bool, FreeRange, Int32, Limit, Obstacle, Terrain
from bearcub.obstacles.cloud import View
from bearcub.obstacles.layers import Painter
from bearcub.obstacles.sorting import Sorting
from bearcub.robust import ranked_by_group
from bearcub.stereo.native import COMPILED, core

_PIXELS = 6000
_CELLS = 64  # of range between nothing and the farthest, each as much longer as it is farther
_NEAREST = 0.2  # least range told [m]
_GAP = 3  # cells without floor that end the way: floor unseen is not free
_FOOT = 1.3  # a thing this much farther than the last floor seen is what ends it
_HITS = 3  # pixels that make an end, against stray ones

Index = NDArray[np.int64]


def free_range(
    sorting: Sorting,
    painter: Painter,
    obstacles: tuple[Obstacle, ...],
    terrain: Terrain,
    view: View,
    *,
    bearing_step: float,
    farthest: float,
    clearance: float,
    steepest: float,
    compiled: bool = COMPILED,
) -> FreeRange:
    """Tell the free range in every direction of the view.

    A way is free as far as floor was seen without a gap and nothing stands on it; what hangs
    higher than `clearance` does not count. Ground that was not seen is not free.

    Parameters
    ----------
    sorting : Sorting
        The grid of pixels that was segmented.
    painter : Painter
        Knows what they are.
    obstacles : tuple of Obstacle
    terrain : Terrain
    view : View
    bearing_step : float
        Between directions [rad].
    farthest : float
        [m].
    clearance : float
        [m].
    steepest : float
        Steepest ground that is a way [rad].
    compiled : bool
        By the native core, ``native/src/grid.cpp``; else by NumPy.

    Returns
    -------
    FreeRange
        NaN ranges where no floor at all was seen.
    """
    step = bearing_step
    bearings = _directions(view, painter.sorter.disparity.shape[1], step)
    limits = [Limit.UNSEEN] * len(bearings)
    standing = [o for o in obstacles if not o.base_height > clearance]
    blocks = np.zeros(len(obstacles) + 1, dtype=bool)
    blocks[[o.id for o in standing]] = True
    stride = max(1, int(math.sqrt(sorting.on_floor.size / _PIXELS)))
    look = _Look(
        sorting=sorting,
        stride=stride,
        labels=painter.sampled(stride),
        view=view,
        bearings=bearings,
        step=step,
        blocks=blocks,
        farthest=farthest,
    )
    seen, things, holes = (_ends_compiled if compiled else _ends_in_numpy)(look)
    things = np.minimum(things, _narrow_things(standing, bearings, step))
    ends: list[float] = seen.tolist()
    for what, hits in ((Limit.OBSTACLE, things), (Limit.HOLE, holes)):
        for k, hit in enumerate(hits.tolist()):
            end = ends[k]
            # an unseen strip before a thing is its own foot; beyond the floor's end it is the limit
            if hit == math.inf or hit > _FOOT * end:  # NaN, where no floor was seen, is no end
                continue
            if limits[k] == Limit.UNSEEN or hit < end:
                limits[k] = what
            ends[k] = hit if math.isnan(end) else min(hit, end)
    for band in terrain.profile:
        if abs(band.slope) - band.sigma > steepest:
            limits = [
                Limit.SLOPE if end > band.start else limit
                for end, limit in zip(ends, limits, strict=True)
            ]
            ends = [end if math.isnan(end) else min(end, band.start) for end in ends]
    return FreeRange(bearing=bearings, range=np.array(ends), limit=tuple(limits))


def _directions(view: View, columns: int, step: float) -> Float64:
    """Return the multiples of `step` inside the field of view, right to left."""
    p = view.projection
    left = math.atan2(p.cx, p.fx)
    right = -math.atan2(columns - 1 - p.cx, p.fx)
    return step * np.arange(math.ceil(right / step), math.floor(left / step) + 1, dtype=np.float64)


def _narrow_things(things: list[Obstacle], bearings: Float64, step: float) -> Float64:
    """Return the range of the nearest thing no wider than a direction, in each; else inf.

    Few of its pixels are sampled, and a post is an end all the same.
    """
    ends = np.full(len(bearings), math.inf)
    for thing in things:
        half = 0.5 * thing.width / max(thing.distance, 1e-6)
        if half < step:
            near = np.abs(bearings - thing.bearing) <= 0.5 * step + half
            ends[near] = np.minimum(ends[near], thing.distance)
    return ends


_Ends = tuple[Float64, Float64, Float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """What is looked at, and where.

    Every `stride`-th pixel of the grid, with its label; directions `step` apart; `blocks` tells of
    every label whether it is in the way.
    """

    sorting: Sorting
    stride: int
    labels: Int32
    view: View
    bearings: Float64
    step: float
    blocks: Bool
    farthest: float


def _ends_compiled(look: _Look) -> _Ends:
    sorting, grid = look.sorting, np.s_[:: look.stride, :: look.stride]
    seen, things, holes = core.find_ends(
        sorting.disparity[grid],
        sorting.floor[grid],
        sorting.on_floor[grid],
        look.labels,
        sorting.u[:: look.stride].copy(),
        sorting.v[:: look.stride].copy(),
        *look.view.numbers,
        float(look.bearings[0]),
        look.step,
        len(look.bearings),
        look.blocks,
        _NEAREST,
        look.farthest,
        _CELLS,
        _GAP,
        _HITS,
    )
    return np.array(seen), np.array(things), np.array(holes)


def _ends_in_numpy(look: _Look) -> _Ends:
    """Return the ranges [m] to which floor is seen and at which things and holes begin."""
    count = len(look.bearings)
    sector, reach, label = _pixels(look)
    thing, hole = look.blocks.take(np.maximum(label, 0)), label < 0
    return (
        _seen_until(sector, reach, label == 0, count, look.farthest),
        _first_hits(sector[thing], reach[thing], count),
        _first_hits(sector[hole], reach[hole], count),
    )


def _pixels(look: _Look) -> tuple[Index, Float64, Int32]:
    """Return direction, range [m] and label of a grid of pixels: of floor, things and holes."""
    sorting, labels = look.sorting, look.labels
    grid = np.s_[:: look.stride, :: look.stride]
    measured = sorting.disparity[grid]
    index = np.flatnonzero((sorting.on_floor[grid] | (labels != 0)) & (measured > 0))
    # a hole begins where its floor is missing, not where the line of sight ends in it
    d = np.where(labels < 0, sorting.floor[grid], measured).ravel().take(index)
    row = index // labels.shape[1]
    v = sorting.v[:: look.stride].astype(np.float32).take(row)
    u = sorting.u[:: look.stride].astype(np.float32).take(index - row * labels.shape[1])
    x, y, _ = look.view.points(u, v, d)
    sector = np.rint((np.arctan2(y, x) - float(look.bearings[0])) / look.step).astype(np.int64)
    inside = np.flatnonzero((sector >= 0) & (sector < len(look.bearings)))
    reach = np.sqrt(x * x + y * y).take(inside)
    return sector.take(inside), reach, labels.ravel().take(index.take(inside))


def _seen_until(
    sector: Index, reach: Float64, floor: NDArray[np.bool_], count: int, farthest: float
) -> Float64:
    """Return how far floor is seen in each direction without a gap [m]; NaN where never."""
    growth = math.log(farthest / _NEAREST) / _CELLS
    near = floor & (reach < farthest)
    cell = np.log(reach[near] * (1 / _NEAREST))
    cell *= 1 / growth
    seen = np.zeros((count, _CELLS + _GAP), dtype=bool)
    seen.ravel()[sector[near] * seen.shape[1] + np.maximum(cell, 0).astype(np.int64)] = True
    first = seen.argmax(axis=1)
    gaps = ~(seen[:, :-2] | seen[:, 1:-1] | seen[:, 2:])  # as long as _GAP
    gaps &= np.arange(gaps.shape[1])[None, :] > first[:, None]
    end = np.where(gaps.any(axis=1), gaps.argmax(axis=1), _CELLS)
    ends = np.minimum(_NEAREST * np.exp(end * growth), farthest)
    return np.where(seen.any(axis=1), ends, math.nan)


def _first_hits(sector: Index, reach: Float64, count: int) -> Float64:
    """Return the range of the third nearest pixel of each direction [m], else inf."""
    near = reach < math.inf
    sector, reach = sector[near], reach[near]
    counts = np.bincount(sector, minlength=count)
    (hits,) = ranked_by_group(reach, sector, counts, _HITS - 1)
    hits[np.isnan(hits)] = math.inf
    return hits

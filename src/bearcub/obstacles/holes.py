"""Holes: ground that is missing, as a pit that ends or a drop beyond which no floor is seen.

A pixel that looks through the floor has less disparity than the floor there: it sees the far wall
or the bottom of a pit. A line of sight over the near lip at range R of a pit w long meets the far
wall at the depth ``h w / R`` (h the camera's height), so no more of the depth than that can be
seen: a depth close to it is a lower bound [1]_. A reflection in a shiny floor has the same
disparities as a pit before the foot of what it mirrors; the mirrored thing stands directly above
it without floor between, and that tells them apart.

References
----------
.. [1] L. Matthies, A. Rankin: "Negative obstacle detection by thermal signature", IROS 2003;
   the geometry of the visible far wall.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import Bool, Ground, Hole, Int32
from bearcub.obstacles.measure import View
from bearcub.obstacles.sorting import Sorting
from bearcub.obstacles.verify import Witness, confirmed

_LEAST_PIXELS = 60
_LEAST_COLUMNS = 8
_LEAST_ROWS = 3
_RIM = 0.12  # share of a pit's depth at which its rim is taken
_RIM_SIGMAS = 1.5  # ... but no closer to the floor than this many sigmas of noise
_EDGE_ROWS = 6  # rows searched beyond a rim for what borders it
_VISIBLE = 0.8  # share of the visible depth from which on the bottom may be out of sight
_IMPOSSIBLE = 1.6  # times the visible depth, which its own errors allow for
_RESUMED = 0.4  # of the tolerance: floor that lies lower still belongs to the drop
_BORDERED = 0.6  # share of its columns in which floor must border it
_LONGEST = 4.0  # ground that lies lower for longer is no pit but another floor [m]
_DEEPEST = 10  # percentile of height that is called the bottom
_STEEP = math.radians(20.0)  # a hole's walls are at least so steep
_MIRRORED = 24  # rows in which the foot of a mirrored thing may hide in the tolerance
_SAME_RANGE = 0.95  # of the disparity at the far rim: a thing farther behind is not mirrored
_CLOSING = np.ones((7, 7), dtype=np.uint8)

Index = NDArray[np.int64]


def sight_limit(focal: float, height: float, *, length: float = 1.0, rows: int = 6) -> float:
    """Return how far away a hole can be seen at all [m].

    It covers about ``f h w / (R (R + w))`` rows of the image.

    Parameters
    ----------
    focal : float
        [px].
    height : float
        Of the camera [m].
    length : float
        Of the hole along the line of sight [m].
    rows : int
        Least rows it must cover.

    Examples
    --------
    The paper's rig sees a hole of 0.6 m at 6.5 m.

    >>> print(f"{sight_limit(386, 1.2, length=0.6):.1f}")
    6.5
    """
    return 0.5 * (math.sqrt(length**2 + 4 * focal * height * length / rows) - length)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scene:
    """Everything a hole is judged against."""

    sorting: Sorting
    labels: Int32
    view: View
    ground: Ground

    def floor_points(self, u: Float64, v: Float64) -> Float64:
        """Return where the floor at these pixels lies, shape (N, 3) [m]."""
        at = self.sorting.floor[v.astype(int), u.astype(int)].astype(np.float64)
        return self.view.points(u, v, np.maximum(at, 1e-3))


def find_holes(
    sorting: Sorting,
    labels: Int32,
    view: View,
    ground: Ground,
    *,
    farthest: float,
    witness: Witness | None,
    offset: float,
) -> tuple[tuple[Hole, ...], Int32]:
    """Find pits and drops.

    Parameters
    ----------
    sorting : Sorting
        The pixels sorted by the floor.
    labels : ndarray of int32, shape (H, W)
        Obstacles, to tell reflections.
    view : View
    ground : Ground
    farthest : float
        [m].
    witness : Witness or None
        The images, to ask again.
    offset : float
        In the disparity, not in the images [px].

    Returns
    -------
    holes : tuple of Hole
        Nearest first.
    labels : ndarray of int32, shape (H, W)
        -1, -2, ... for their pixels in that order, else 0.
    """
    numbered = np.zeros_like(labels)
    limit = min(farthest, sight_limit(view.projection.fx, ground.height))
    level = view.projection.fx * view.projection.baseline / limit
    below = sorting.below & (sorting.floor > level)
    if not ground.seen or np.count_nonzero(below) < _LEAST_PIXELS:
        return (), numbered
    scene = _Scene(sorting=sorting, labels=labels, view=view, ground=ground)
    found = []
    for region in _regions(below, sorting):
        hole = _judge(region, scene)
        if hole is not None and confirmed(witness, sorting, *region.pixels(), offset=offset):
            found.append((hole, region))
    found.sort(key=lambda item: item[0].distance)
    for number, (_, region) in enumerate(found, start=1):
        numbered[region.rows, region.columns][region.mask] = -number
    return tuple(hole for hole, _ in found), numbered


@dataclass(frozen=True, slots=True, kw_only=True)
class _Region:
    """A connected part of the image that looks through the floor, in a window of the image."""

    rows: slice
    columns: slice
    mask: Bool

    def pixels(self) -> tuple[Index, Index]:
        """Return the columns and rows of its pixels in the whole image."""
        v, u = np.nonzero(self.mask)
        return u + self.columns.start, v + self.rows.start


def _regions(below: Bool, sorting: Sorting) -> Iterator[_Region]:
    """Yield connected regions grown from `below` to the rim."""
    height, width = below.shape
    # a first look at half the resolution: most frames have no hole
    coarse = np.ascontiguousarray(below[::2, ::2]).view(np.uint8)
    closed = cv2.morphologyEx(coarse, cv2.MORPH_CLOSE, _CLOSING[:5, :5])
    count, parts, stats, _ = cv2.connectedComponentsWithStatsWithAlgorithm(
        closed, 8, cv2.CV_32S, cv2.CCL_SAUF
    )
    for number in range(1, count):
        left, top, wide, high = (2 * int(value) for value in stats[number][:4])
        area = 4 * int(stats[number][cv2.CC_STAT_AREA])
        if area < _LEAST_PIXELS or wide < _LEAST_COLUMNS or high < _LEAST_ROWS:
            continue
        margin = max(8, wide // 3, high // 2)
        rows = slice(max(0, top - margin), min(height, top + high + margin))
        columns = slice(max(0, left - margin), min(width, left + wide + margin))
        at = np.ix_(
            np.arange(rows.start, rows.stop) // 2, np.arange(columns.start, columns.stop) // 2
        )
        seed = parts[at] == number
        residual = sorting.residual[rows, columns]
        strong = seed & below[rows, columns]
        if np.count_nonzero(strong) < 0.3 * area:
            continue
        depth = float(-np.percentile(residual[strong], 10))
        rim = np.maximum(_RIM * depth, _RIM_SIGMAS * sorting.noise[rows, columns])
        weak = residual < -rim
        weak |= _small_gaps(np.isnan(residual), largest=area)
        yield _Region(rows=rows, columns=columns, mask=_grown(seed, weak))


def _small_gaps(unmatched: Bool, *, largest: int) -> Bool:
    """Return the unmatched patches no larger than the hole itself: shade and hidden sides."""
    _, parts, stats, _ = cv2.connectedComponentsWithStats(
        unmatched.astype(np.uint8), connectivity=8
    )
    small = stats[:, cv2.CC_STAT_AREA] <= largest
    small[0] = False
    gaps: Bool = small[parts]
    return gaps


def _grown(seed: Bool, weak: Bool) -> Bool:
    """Return the part of `weak` (closed) that touches the seed, with the seed."""
    either = cv2.morphologyEx((weak | seed).astype(np.uint8), cv2.MORPH_CLOSE, _CLOSING[:5, :5])
    _, parts = cv2.connectedComponents(either, connectivity=4)
    wanted = np.bincount(parts[seed], minlength=parts.max() + 1)
    wanted[0] = 0
    grown: Bool = parts == int(np.argmax(wanted))
    return grown


def _judge(region: _Region, scene: _Scene) -> Hole | None:
    """Tell whether a region is a hole, and measure it."""
    mask = region.mask
    counts = mask.sum(axis=0)
    inside = np.flatnonzero(counts >= _LEAST_ROWS)
    if len(inside) < _LEAST_COLUMNS:
        return None
    top = mask.argmax(axis=0)[inside] + region.rows.start
    bottom = mask.shape[0] - 1 - mask[::-1].argmax(axis=0)[inside] + region.rows.start
    u = inside + region.columns.start
    sorting = scene.sorting
    near_floor = _borders(sorting.on_floor, u, bottom, +1)
    resumed = sorting.on_floor & (sorting.residual > -_RESUMED * sorting.allowed)
    beyond = max(_EDGE_ROWS, mask.shape[0] // 4)  # a worn rim is as wide as the hole is large
    far_floor = _borders(resumed, u, top, -1, rows=beyond)
    if near_floor.mean() < _BORDERED or _mirrors(scene, u, top).mean() > 0.5:
        return None
    near = scene.floor_points(u.astype(float), bottom.astype(np.float64) + 0.5)
    far = scene.floor_points(u.astype(float), np.maximum(top - 0.5, 0))
    span = np.hypot(far[:, 0], far[:, 1]) - np.hypot(near[:, 0], near[:, 1])
    pit = far_floor.mean() >= _BORDERED and np.percentile(span, 75) < _LONGEST
    if not pit and not _falls_at_once(sorting, u, bottom):
        return None
    box = (int(u.min()), int(top.min()), int(u.max()), int(bottom.max()))
    return _measure(region, scene, u, near, span, box, pit=bool(pit))


def _mirrors(scene: _Scene, u: Index, top: Index) -> Bool:
    """Tell for each column whether the region ends at the foot of something that stands there.

    A shiny floor shows the picture of what stands on it upside down: below its foot, and no
    nearer than the foot itself.
    """
    rows = np.clip(top[None, :] - np.arange(1, _MIRRORED + 1)[:, None], 0, None)
    thing = scene.labels[rows, u[None, :]] > 0
    first = thing.argmax(axis=0)
    d = scene.sorting.disparity[rows[first, np.arange(len(u))], u]
    foot: Bool = thing.any(axis=0) & (d > _SAME_RANGE * scene.sorting.floor[top, u])
    return foot


def _borders(what: Bool, u: Index, v: Index, way: int, *, rows: int = _EDGE_ROWS) -> Bool:
    """Tell for each column whether `what` is found within some rows beyond row v."""
    searched = v[None, :] + way * np.arange(1, rows + 1)[:, None]
    at = np.clip(searched, 0, what.shape[0] - 1)
    found: Bool = what[at, u[None, :]].sum(axis=0) >= _EDGE_ROWS // 3
    return found


def _falls_at_once(sorting: Sorting, u: Index, bottom: Index) -> bool:
    """Tell a drop from ground that only slopes away: the disparity falls off at the lip."""
    rows = np.clip(bottom[None, :] - np.arange(2, 2 + _EDGE_ROWS)[:, None], 0, None)
    fall = np.nan_to_num(-sorting.residual[rows, u[None, :]])
    fell = np.median(fall, axis=0) > 2 * sorting.allowed[bottom, u]
    return bool(fell.mean() > _BORDERED)


def _measure(
    region: _Region,
    scene: _Scene,
    u: Index,
    near: Float64,
    span: Float64,
    box: tuple[int, int, int, int],
    *,
    pit: bool,
) -> Hole | None:
    """Measure a hole from its near rim (points) and how far behind it the other lies, by column."""
    view, ground = scene.view, scene.ground
    reach = np.hypot(near[:, 0], near[:, 1])
    first = int(np.argmin(reach))
    distance = float(np.percentile(reach, 5))
    bearings = np.arctan2(near[:, 1], near[:, 0])
    left, right = float(bearings.max()), float(bearings.min())
    pixel = 1.0 / view.projection.fx
    across = (left - right + pixel) * float(np.median(reach))
    length = float(np.percentile(span, 75)) if pit else math.nan
    depth, shown = _depth(region, scene, pit=pit)
    if depth <= 0.0:
        return None
    if pit and not _steep(region, scene, u, reach, reach + span, depth):
        return None  # ground that only undulates
    visible = ground.height * max(length, 0.0) / max(distance, 1e-6) if pit else math.inf
    if depth > _IMPOSSIBLE * visible:
        return None  # no line of sight reaches so deep: a wrong match
    level = view.projection.fx * view.projection.baseline / max(distance, 1e-6)
    step = distance * distance * pixel / ground.height  # of the floor per row [m]
    return Hole(
        x=float(near[first, 0]),
        y=float(near[first, 1]),
        distance=distance,
        bearing=0.5 * (left + right),
        width=across,
        length=length,
        depth=depth,
        depth_is_lower_bound=(pit and depth > _VISIBLE * visible) or not pit,
        kind="pit" if pit else "drop",
        sigma_distance=math.hypot(2 * step, distance * ground.noise / level / 4),
        sigma_width=math.hypot(3 * pixel * distance, _RIM * across),
        sigma_length=math.hypot(3 * step, _RIM * length) if pit else math.nan,
        sigma_depth=math.hypot(
            (ground.height + depth) * ground.noise / level / math.sqrt(max(shown / 25, 1)),
            distance * ground.sigma_pitch,
            _RIM * depth,  # where exactly the rim and the bottom are is a matter of definition
        ),
        confidence=1 - math.exp(-shown / (4 * _LEAST_PIXELS)),
        box=box,
        pixels=int(np.count_nonzero(region.mask)),
    )


def _steep(
    region: _Region, scene: _Scene, u: Index, near: Float64, far: Float64, depth: float
) -> bool:
    """Tell a hole from undulating ground: half its depth is reached close to one of its rims.

    `near` and `far` are the ranges [m] of the rims in the columns `u`.
    """
    v, columns = np.nonzero(region.mask[:, u - region.columns.start])
    v = v + region.rows.start
    d = scene.sorting.disparity[v, u[columns]].astype(np.float64)
    # lower than half the depth, without dividing by a disparity of 0; NaN compares false
    height = scene.ground.height
    deep = (d > 0) & (height * (d - scene.sorting.floor[v, u[columns]]) < -0.5 * depth * d)
    v, columns, d = v[deep], columns[deep], d[deep]
    points = scene.view.points(u[columns].astype(float), v.astype(float), d)
    reach = np.hypot(points[:, 0], points[:, 1])
    to_rim = np.minimum(np.abs(reach - near[columns]), np.abs(far[columns] - reach))
    closest = np.full(len(u), np.inf)
    np.minimum.at(closest, columns, to_rim)
    return bool(np.median(closest) * math.tan(_STEEP) < 0.5 * depth)


def _depth(region: _Region, scene: _Scene, *, pit: bool) -> tuple[float, int]:
    """Return how deep the region's deepest tenth lies below the floor [m], and its pixel count."""
    u, v = region.pixels()
    d = scene.sorting.disparity[v, u].astype(np.float64)
    seen = np.isfinite(d) & (d > 0)
    if np.count_nonzero(seen) < _LEAST_PIXELS // 2:
        return 0.0, 0
    d, level = d[seen], scene.sorting.floor[v, u][seen].astype(np.float64)
    if not pit:  # far ground beyond a drop is noisier, and no measure of its lip
        near = d >= np.median(d)
        d, level = d[near], level[near]
    lifts = scene.ground.height * (1 - level / d)
    return float(-np.percentile(lifts, _DEEPEST)), int(np.count_nonzero(seen))

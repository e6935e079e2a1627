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
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import Bool, Ground, Hole
from bearcub.obstacles.measure import MARGIN, View, cut_sides
from bearcub.obstacles.segment import Segments
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.obstacles.verify import Witness, confirmed
from bearcub.robust import median, quantile

_LEAST_PIXELS = 60
_SURE, _SURE_NARROW = 1.5, 3.0  # standard errors by which the images must speak for a hole
_PLAIN = 3.0  # times the tolerance that a tenth of a hole's pixels lie below the floor ...
_PLAIN_PIXELS = 500  # ... and how many there must be, that no other evidence is asked for
_NARROW = 0.4  # width [m] below which gaps between blades and stones look like holes
_LEAST_COLUMNS = 8
_LEAST_ROWS = 3
_RIM = 0.2  # share of a pit's depth at which its rim is taken
_RIM_SIGMAS = 1.5  # ... but no closer to the floor than this many sigmas of noise
_EDGE_ROWS = 6  # rows searched beyond a rim for what borders it
_VISIBLE = 0.8  # share of the visible depth from which on the bottom may be out of sight
_IMPOSSIBLE = 1.6  # times the visible depth, which its own errors allow for
_RESUMED = 0.4  # of the tolerance: floor that lies lower still belongs to the drop
_BORDERED = 0.6  # share of its columns in which floor must border it
_AT_ONCE = 0.6  # of its fall three windows on that a drop has in the first behind its lip
_LONGEST = 4.0  # ground that lies lower for longer is no pit but another floor [m]
_DEEPEST = 0.1  # quantile of height that is called the bottom
_VAGUE = 0.2  # 1-sigma of a hole's width, length and depth, as a share: its rim is a slope
_SHALLOW = 0.05  # depth over length of ground that undulates
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
class Region:
    """A connected part of the image that looks through the floor.

    Attributes
    ----------
    mask : ndarray of bool, shape (H, W)
        In a window of the image.
    sorting : Sorting
        Of that window.
    plain : bool
        It lies so much below the floor as no wrong match does.
    """

    mask: Bool
    sorting: Sorting
    plain: bool

    @property
    def top(self) -> int:
        """First row of the window [px]."""
        return int(self.sorting.v[0])

    @property
    def left(self) -> int:
        """First column of the window [px]."""
        return int(self.sorting.u[0])

    def pixels(self) -> tuple[Index, Index]:
        """Return the columns and rows of its pixels in the window."""
        v, u = np.divmod(np.flatnonzero(self.mask), self.mask.shape[1])
        return u, v


@dataclass(frozen=True, slots=True, kw_only=True)
class _Scene:
    """Everything a hole is judged against.

    `things` are the pixels of obstacles on the grid of every `step`-th pixel; `shape` is that of
    the image.
    """

    things: Bool
    step: int
    shape: tuple[int, int]
    fringe: float
    view: View
    ground: Ground

    def floor_points(self, region: Region, u: Index, v: Float64) -> Float64:
        """Return where the floor at these pixels of the window lies, shape (3, N) [m]."""
        floor = region.sorting.floor[v.astype(int), u].astype(np.float64)
        return self.view.points(
            (u + region.left).astype(np.float64), v + region.top, np.maximum(floor, 1e-3)
        )


def find_holes(
    sorter: Sorter,
    sorting: Sorting,
    segments: Segments,
    things: Bool,
    view: View,
    ground: Ground,
    *,
    farthest: float,
    witness: Witness | None,
    offset: float,
    fringe: float,
) -> tuple[tuple[Hole, ...], tuple[Region, ...]]:
    """Find pits and drops.

    Parameters
    ----------
    sorter : Sorter
    sorting : Sorting
        Of the grid that was segmented: most frames have no hole.
    segments : Segments
        Of the same grid.
    things : ndarray of bool, shape (segments.count + 1,)
        Which of them are obstacles, to tell reflections.
    view : View
    ground : Ground
    farthest : float
        [m].
    witness : Witness or None
        The images, to ask again.
    offset : float
        In the disparity, not in the images [px].
    fringe : float
        How far the matcher carries the floor beside a hole into it [px].

    Returns
    -------
    holes : tuple of Hole
        Nearest first.
    regions : tuple of Region
        Their pixels, in that order.
    """
    limit = min(farthest, sight_limit(view.projection.fx, ground.height))
    level = view.projection.fx * view.projection.baseline / limit
    below = sorting.below & (sorting.floor > level)
    if not ground.seen or np.count_nonzero(below) * segments.step**2 < _LEAST_PIXELS:
        return (), ()
    scene = _Scene(
        things=things.take(segments.labels),
        step=segments.step,
        shape=(sorter.disparity.shape[0], sorter.disparity.shape[1]),
        fringe=fringe,
        view=view,
        ground=ground,
    )
    found = []
    for region in _regions(below, sorter, segments.step):
        hole = _judge(region, scene)
        if hole is None:
            continue
        u, v = region.pixels()
        sure = _SURE if hole.width >= _NARROW else _SURE_NARROW
        if region.plain or confirmed(
            witness, sorter, u + region.left, v + region.top, offset=offset, sure=sure
        ):
            found.append((hole, region))
    found.sort(key=lambda item: item[0].distance)
    return tuple(hole for hole, _ in found), tuple(region for _, region in found)


def _regions(below: Bool, sorter: Sorter, step: int) -> Iterator[Region]:
    """Yield connected regions grown from `below`, a grid, to the rim."""
    height, width = sorter.disparity.shape
    side = {1: 7, 2: 5}.get(step, 3)
    closed = cv2.morphologyEx(below.view(np.uint8), cv2.MORPH_CLOSE, _CLOSING[:side, :side])
    _, parts = cv2.connectedComponents(closed, connectivity=8, ltype=cv2.CV_16U)
    index = np.flatnonzero(parts)
    numbers = parts.ravel()[index]
    areas = step**2 * np.bincount(numbers)
    for number in np.flatnonzero(areas >= _LEAST_PIXELS):
        area = int(areas[number])
        v, u = np.divmod(index[numbers == number], parts.shape[1])
        left, top = step * int(u.min()), step * int(v[0])
        wide, high = step * (int(u.max()) + 1) - left, step * (int(v[-1]) + 1) - top
        if wide < _LEAST_COLUMNS or high < _LEAST_ROWS:
            continue
        margin = max(8, wide // 3, high // 2)
        first, last = max(0, top - margin), min(height, top + high + margin)
        # beyond what the region may grow to, rows that tell what borders it
        above, under = max(_MIRRORED, (last - first) // 4) + 1, _EDGE_ROWS + 1
        part = sorter.part(
            slice(max(0, first - above), min(height, last + under)),
            slice(max(0, left - margin), min(width, left + wide + margin)),
        )
        seed = parts[np.ix_(part.v // step, part.u // step)] == number
        strong = seed & part.below
        if np.count_nonzero(strong) < 0.3 * area:
            continue
        depth = -quantile(part.residual[strong], 0.1)
        rim = np.maximum(_RIM * depth, _RIM_SIGMAS * sorter.noise_of(part))
        weak = part.residual < -rim
        weak |= _small_gaps(np.isnan(part.residual), largest=area)
        weak[: first - int(part.v[0])] = False
        weak[last - int(part.v[0]) :] = False
        mask = _grown(seed, weak)
        yield Region(mask=mask, sorting=part, plain=_plain(mask, part))


def _plain(mask: Bool, part: Sorting) -> bool:
    """Tell what lies so much below the floor that no wrong match does."""
    fall = -part.residual[mask] / part.allowed[mask]
    fall = fall[np.isfinite(fall)]
    return len(fall) > _PLAIN_PIXELS and quantile(fall, 0.9) > _PLAIN


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


def _judge(region: Region, scene: _Scene) -> Hole | None:
    """Tell whether a region is a hole, and measure it."""
    mask, sorting = region.mask, region.sorting
    u = np.flatnonzero(mask.sum(axis=0) >= _LEAST_ROWS)
    if len(u) < _LEAST_COLUMNS:
        return None
    top = mask.argmax(axis=0)[u]
    bottom = mask.shape[0] - 1 - mask[::-1].argmax(axis=0)[u]
    near_floor = _borders(sorting.on_floor, u, bottom, +1)
    resumed = sorting.on_floor & (sorting.residual > -_RESUMED * sorting.allowed)
    rows = int(bottom.max() - top.min()) + 1
    # a worn rim is as wide as the hole is large
    beyond = max(_EDGE_ROWS, rows // 2, rows // 4 + len(u) // 6)
    far_floor = _borders(resumed, u, top, -1, rows=beyond)
    if region.plain:  # the image's lower border may cut it
        near_floor |= bottom + region.top >= scene.shape[0] - MARGIN
    if near_floor.mean() < _BORDERED or _mirrors(region, scene, u, top).mean() > 0.5:
        return None
    near = scene.floor_points(region, u, bottom.astype(np.float64) + 0.5)
    far = scene.floor_points(region, u, np.maximum(top - 0.5, 0))
    span = np.hypot(far[0], far[1]) - np.hypot(near[0], near[1])
    pit = far_floor.mean() >= _BORDERED and quantile(span, 0.75) < _LONGEST
    if not pit and not _falls_at_once(sorting, u, bottom):
        return None
    return _measure(region, scene, (u, top, bottom), near, far, pit=bool(pit))


def _mirrors(region: Region, scene: _Scene, u: Index, top: Index) -> Bool:
    """Tell for each column whether the region ends at the foot of something that stands there.

    A shiny floor shows the picture of what stands on it upside down: below its foot, and no
    nearer than the foot itself.
    """
    rows = np.clip(top[None, :] - np.arange(1, _MIRRORED + 1)[:, None], 0, None)
    at = (rows + region.top) // scene.step, (u + region.left) // scene.step
    thing = scene.things[at[0], at[1][None, :]]
    first = thing.argmax(axis=0)
    d = region.sorting.disparity[rows[first, np.arange(len(u))], u]
    foot: Bool = thing.any(axis=0) & (d > _SAME_RANGE * region.sorting.floor[top, u])
    return foot


def _borders(what: Bool, u: Index, v: Index, way: int, *, rows: int = _EDGE_ROWS) -> Bool:
    """Tell for each column whether `what` is found within some rows beyond row v."""
    searched = v[None, :] + way * np.arange(1, rows + 1)[:, None]
    at = np.clip(searched, 0, what.shape[0] - 1)
    found: Bool = what[at, u[None, :]].sum(axis=0) >= _EDGE_ROWS // 3
    return found


def _falls_at_once(sorting: Sorting, u: Index, bottom: Index) -> bool:
    """Tell a drop from ground that only slopes away: the disparity falls off at the lip."""
    at_lip = _fall(sorting, u, bottom, 2) > 2 * sorting.allowed[bottom, u]
    # lower ground stays as much lower, a descent goes on falling
    behind = _fall(sorting, u, bottom, _EDGE_ROWS)
    beyond = _fall(sorting, u, bottom, 3 * _EDGE_ROWS)
    fell = at_lip & (behind > _AT_ONCE * beyond)
    return bool(fell.mean() > _BORDERED)


def _fall(sorting: Sorting, u: Index, bottom: Index, first: int) -> Float64:
    """Return how far the disparity falls [px] in some rows from the `first` beyond the lip on."""
    rows = np.clip(bottom[None, :] - np.arange(first, first + _EDGE_ROWS)[:, None], 0, None)
    fall = np.nan_to_num(-sorting.residual[rows, u[None, :]])
    return np.asarray(np.median(fall, axis=0), dtype=np.float64)


def _measure(
    region: Region,
    scene: _Scene,
    outline: tuple[Index, Index, Index],
    near: Float64,
    far: Float64,
    *,
    pit: bool,
) -> Hole | None:
    """Measure a hole from its near and its far rim, points by column [m].

    `outline` is columns, first and last rows in the window. Width and length are the extents
    across and along the line of sight, of the mouth of a pit or of the lip of a drop.
    """
    view, ground = scene.view, scene.ground
    u, top, bottom = outline
    reach = np.hypot(near[0], near[1])
    first = int(np.argmin(reach))
    distance = quantile(reach, 0.05)
    bearings = np.arctan2(near[1], near[0])
    bearing = 0.5 * (float(bearings.max()) + float(bearings.min()))
    pixel = 1.0 / view.projection.fx
    across, along = _mouth(np.concatenate([near, far], axis=1) if pit else near, bearing)
    across += (1 + 2 * scene.fringe) * pixel * distance
    length = along if pit else math.nan
    depth, shown = _depth(region, ground, pit=pit)
    if depth <= 0.0:
        return None
    if pit and (
        depth < _SHALLOW * length
        or not _steep(region, scene, u, reach, np.hypot(far[0], far[1]), depth)
    ):
        return None  # ground that only undulates
    visible = ground.height * max(length, 0.0) / max(distance, 1e-6) if pit else math.inf
    if depth > _IMPOSSIBLE * visible:
        return None  # no line of sight reaches so deep: a wrong match
    level = view.projection.fx * view.projection.baseline / max(distance, 1e-6)
    step = distance * distance * pixel / ground.height  # of the floor per row [m]
    hole = Hole(
        x=float(near[0, first]),
        y=float(near[1, first]),
        distance=distance,
        bearing=bearing,
        width=across,
        length=length,
        depth=depth,
        depth_is_lower_bound=(pit and depth > _VISIBLE * visible) or not pit,
        kind="pit" if pit else "drop",
        sigma_distance=math.hypot(5 * step, distance * ground.noise / level / 4),
        sigma_width=math.hypot(3 * pixel * distance, _VAGUE * across),
        sigma_length=math.hypot(3 * step, _VAGUE * length) if pit else math.nan,
        sigma_depth=math.hypot(
            (ground.height + depth) * ground.noise / level / math.sqrt(max(shown / 25, 1)),
            distance * ground.sigma_pitch,
            _VAGUE * depth,  # where exactly the rim and the bottom are is a matter of definition
        ),
        confidence=1 - math.exp(-shown / (4 * _LEAST_PIXELS)),
        box=_box(region, u, top, bottom),
        pixels=int(np.count_nonzero(region.mask)),
    )
    return _cut(hole, scene.shape)


def _box(region: Region, u: Index, top: Index, bottom: Index) -> tuple[int, int, int, int]:
    left, right = int(u[0]) + region.left, int(u[-1]) + region.left
    return left, int(top.min()) + region.top, right, int(bottom.max()) + region.top


def _cut(hole: Hole, shape: tuple[int, int]) -> Hole:
    """Name the image borders that cut a hole; what they cut has no sigma."""
    cut = cut_sides(hole.box, shape)
    return replace(
        hole,
        truncated=cut,
        sigma_width=math.nan if {"left", "right"} & set(cut) else hole.sigma_width,
        sigma_length=math.nan if "bottom" in cut else hole.sigma_length,
    )


def _mouth(rim: Float64, bearing: float) -> tuple[float, float]:
    """Return how far a rim reaches across and along the line of sight [m]."""
    c, s = math.cos(bearing), math.sin(bearing)
    return _extent(rim[1] * c - rim[0] * s), _extent(rim[0] * c + rim[1] * s)


def _extent(values: Float64) -> float:
    """Return how far values reach, but for the outermost hundredth at either end."""
    return quantile(values, 0.99) - quantile(values, 0.01)


def _steep(
    region: Region, scene: _Scene, u: Index, near: Float64, far: Float64, depth: float
) -> bool:
    """Tell a hole from undulating ground: half its depth is reached close to one of its rims.

    `near` and `far` are the ranges [m] of the rims in the columns `u` of the window.
    """
    v, columns = np.nonzero(region.mask[:, u])
    d = region.sorting.disparity[v, u[columns]].astype(np.float64)
    # lower than half the depth, without dividing by a disparity of 0; NaN compares false
    height = scene.ground.height
    deep = (d > 0) & (height * (d - region.sorting.floor[v, u[columns]]) < -0.5 * depth * d)
    v, columns, d = v[deep], columns[deep], d[deep]
    at = (u[columns] + region.left).astype(np.float64), (v + region.top).astype(np.float64)
    points = scene.view.points(*at, d)
    reach = np.hypot(points[0], points[1])
    to_rim = np.minimum(np.abs(reach - near[columns]), np.abs(far[columns] - reach))
    closest = np.full(len(u), np.inf)
    np.minimum.at(closest, columns, to_rim)
    return bool(np.median(closest) * math.tan(_STEEP) < 0.5 * depth)


def _depth(region: Region, ground: Ground, *, pit: bool) -> tuple[float, int]:
    """Return how deep the region's deepest tenth lies below the floor [m], and its pixel count."""
    d = region.sorting.disparity[region.mask].astype(np.float64)
    level = region.sorting.floor[region.mask].astype(np.float64)
    seen = d > 0  # NaN compares false
    shown = int(np.count_nonzero(seen))
    if shown < _LEAST_PIXELS // 2:
        return 0.0, 0
    d, level = d[seen], level[seen]
    if not pit:  # far ground beyond a drop is noisier, and no measure of its lip
        near = d >= median(d)
        d, level = d[near], level[near]
    lifts = ground.height * (1 - level / d)
    return -quantile(lifts, _DEEPEST), shown

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
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64
from bearcub.messages import Bool, Ground, Hole
from bearcub.obstacles.cloud import View
from bearcub.obstacles.descent import slopes_down
from bearcub.obstacles.measure import MARGIN
from bearcub.obstacles.openings import NARROW, large, openings
from bearcub.obstacles.regions import (
    CLOSING,
    EDGE_ROWS,
    LEAST_COLUMNS,
    LEAST_PIXELS,
    MIRRORED,
    PLAIN_PIXELS,
    Region,
    regions_below,
)
from bearcub.obstacles.rims import across_and_along, cut
from bearcub.obstacles.segment import Segments
from bearcub.obstacles.sorting import Sorter, Sorting
from bearcub.obstacles.upright import Scene
from bearcub.obstacles.verify import ALONG, Witness, confirmed
from bearcub.robust import median, middle, quantile

_SURE, _SURE_NARROW = 1.3, 2.0  # standard errors by which the images must speak for a hole
_SHIFTED, _SHIFTED_NARROW = 5.0, 10.0  # ... sigmas for all of its pixels lying lower together
_VISIBLE = 0.8  # share of the visible depth from which on the bottom may be out of sight
_IMPOSSIBLE = 1.6  # times the visible depth, which its own errors allow for
_RESUMED = 0.4  # of the tolerance: floor that lies lower still belongs to the drop
_BORDERED = 0.6  # share of its columns in which floor must border it
_LIP = 1.5  # times what a pixel of floor may lie off that a drop falls at its lip
_AT_ONCE = 0.6  # of its fall three windows on that a drop has in the first behind its lip
_LONGEST = 4.0  # ground that lies lower for longer is no pit but another floor [m]
_DEEPEST = 0.1  # quantile of height that is called the bottom
_VAGUE = 0.15  # 1-sigma of a hole's width, length and depth, as a share: its rim is a slope
_SMOOTHED = 0.3  # ... and of its depth, which the matcher's windows make less
_SHALLOW = 0.05  # depth over length of ground that undulates
_STEEP = math.radians(20.0)  # a hole's walls are at least so steep
_SAME_RANGE = 0.95  # of the disparity at the far rim: a thing farther behind is not mirrored
_SIGMA = 1.4826  # 1-sigma over the distance from quartile to median of a normal distribution
_RELIEF = 1.7  # times the roughness of the ground around it that a pit is deep
_THINGS = 0.1  # share of things' pixels in and about what may be a hole
_DEEP = 2.0  # fall of the disparity that is more than a matcher's error [px]
_ACROSS = 0.9  # share of the image's columns of what reaches from side to side
_AROUND = np.ones((25, 25), dtype=np.uint8)

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
    """Everything a hole is judged against.

    `things` tells which of the `segments` are obstacles; `shape` is that of the image.
    """

    things: Bool
    segments: Segments
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
    rough: bool = False,
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
    rough : bool
        The ground is so rough, as tall grass is, that the images alone show holes all over it.

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
    if not ground.seen:
        return (), ()
    scene = _Scene(
        things=things,
        segments=segments,
        shape=(sorter.disparity.shape[0], sorter.disparity.shape[1]),
        fringe=fringe,
        view=view,
        ground=ground,
    )
    images = None
    if witness is not None:
        images = Scene(
            witness=witness, surface=sorter.surface, projection=view.projection, offset=offset
        )
    found, doubtful = _matched(below, sorter, scene, images)
    if images is not None and not rough:
        known = [region for _, region in found]
        found += openings(
            known, doubtful, images, sorter, view, ground, lambda part: _stands(part, scene)
        )
        # of another shape than is looked for there: a pit whose bottom is in view
        shown = [each for each in doubtful if _shown(each[1], images, sorter, narrow=True)]
        known = [region for _, region in found]
        found += [each for each in _apart(shown) if not any(map(each[1].overlaps, known))]
    found.sort(key=lambda item: item[0].distance)
    return tuple(hole for hole, _ in found), tuple(region for _, region in found)


def _matched(
    below: Bool, sorter: Sorter, scene: _Scene, images: Scene | None
) -> tuple[list[tuple[Hole, Region]], list[tuple[Hole, Region]]]:
    """Return the holes that the disparities show, and what the images alone can tell to be one."""
    found: list[tuple[Hole, Region]] = []
    doubtful: list[tuple[Hole, Region]] = []
    if np.count_nonzero(below) * scene.segments.step**2 < LEAST_PIXELS:
        return found, doubtful
    for seen in regions_below(below, sorter, scene.segments.step):
        region = seen
        told_alone = images is not None and large(region, images)
        if not (images is None or told_alone or _shown(region, images, sorter, narrow=False)):
            continue
        hole = _judge(region, scene)
        if hole is None and region.plain:  # what is not matched may hide the near rim
            region = region.down_to_floor()
            hole = _judge(region, scene)
        if hole is None:
            continue
        pit = hole.kind == "pit"
        sure = region.plain or region.fall > _DEEP or _spans_view(region, scene)
        if images is None:
            found.append((hole, region))
        elif (sure or not pit) and _shown(region, images, sorter, narrow=hole.width < NARROW):
            if pit or not slopes_down(region, images):
                found.append((hole, region))
        elif pit and told_alone:
            doubtful.append((hole, region))
    return _apart(found), doubtful


def _apart(found: list[tuple[Hole, Region]]) -> list[tuple[Hole, Region]]:
    """Drop what is a part of a larger one: two seeds may have grown to the same rim."""
    kept: list[tuple[Hole, Region]] = []
    for hole, region in sorted(found, key=lambda item: -item[0].pixels):
        if not any(region.overlaps(other) for _, other in kept):
            kept.append((hole, region))
    return kept


def _shown(region: Region, images: Scene, sorter: Sorter, *, narrow: bool) -> bool:
    """Tell whether the images show a hole: pixel by pixel and as a whole."""
    witness, offset = images.witness, images.offset
    u, v = region.pixels()
    sure = _SURE_NARROW if narrow else _SURE
    least = _SHIFTED_NARROW if narrow else _SHIFTED
    if not region.plain and not confirmed(
        witness, sorter, u + region.left, v + region.top, offset=offset, sure=sure, window=ALONG
    ):
        if region.fall < _DEEP:
            return False
        least = _SHIFTED_NARROW  # rims are on the floor, pixel by pixel
    u, v = region.inside()
    floor = region.sorting.floor[v, u] - np.float32(offset)
    return witness.shifted(u + region.left, v + region.top, floor, -region.fall) > least


def _judge(region: Region, scene: _Scene) -> Hole | None:
    """Tell whether a region is a hole, and measure it."""
    mask, sorting = region.mask, region.sorting
    u, bottom = region.near_rim()
    if len(u) < LEAST_COLUMNS:
        return None
    top = mask.argmax(axis=0)[u]
    near_floor = _borders(sorting.on_floor, u, bottom, +1)
    resumed = sorting.on_floor & (sorting.residual > -_RESUMED * sorting.allowed)
    rows = int(bottom.max() - top.min()) + 1
    # a worn rim is as wide as the hole is large
    beyond = max(EDGE_ROWS, rows // 2, rows // 4 + len(u) // 6)
    far_floor = _borders(resumed, u, top, -1, rows=beyond)
    cut_off = bottom + region.top >= scene.shape[0] - MARGIN
    if near_floor.mean() < _BORDERED < cut_off.mean() and _spans_view(region, scene):
        return None  # what the robot stands on, before higher ground
    wide = np.count_nonzero(mask) > PLAIN_PIXELS
    if region.plain or (wide and region.fall > _DEEP):  # the image's lower border may cut it
        near_floor |= cut_off
    if near_floor.mean() < _BORDERED or _mirrors(region, scene, u, top).mean() > 0.5:
        return None
    near = scene.floor_points(region, u, bottom.astype(np.float64) + 0.5)
    far = scene.floor_points(region, u, np.maximum(top - 0.5, 0))
    span = np.hypot(far[0], far[1]) - np.hypot(near[0], near[1])
    pit = far_floor.mean() >= _BORDERED and quantile(span, 0.75) < _LONGEST
    if not (_stands_out(region) if pit else _falls_at_once(sorting, u, bottom)):
        return None
    return _measure(region, scene, (u, top, bottom), near, far, pit=bool(pit))


def _spans_view(region: Region, scene: _Scene) -> bool:
    """Tell what reaches from one side of the image to the other."""
    return bool(np.count_nonzero(region.mask.any(axis=0)) > _ACROSS * scene.shape[1])


def _mirrors(region: Region, scene: _Scene, u: Index, top: Index) -> Bool:
    """Tell for each column whether the region ends at the foot of something that stands there.

    A shiny floor shows the picture of what stands on it upside down: below its foot, and no
    nearer than the foot itself.
    """
    rows = np.clip(top[None, :] - np.arange(1, MIRRORED + 1)[:, None], 0, None)
    step = scene.segments.step
    at = (rows + region.top) // step, ((u + region.left) // step)[None, :]
    thing = scene.things.take(scene.segments.labels[at])
    first = thing.argmax(axis=0)
    d = region.sorting.disparity[rows[first, np.arange(len(u))], u]
    foot: Bool = thing.any(axis=0) & (d > _SAME_RANGE * region.sorting.floor[top, u])
    return foot


def _stands(region: Region, scene: _Scene) -> bool:
    """Tell whether things stand about a region: beside one the cameras see different floor."""
    rows, columns = (
        np.arange(first, first + count) // scene.segments.step
        for first, count in zip((region.top, region.left), region.mask.shape, strict=True)
    )
    things = scene.things.take(scene.segments.labels[np.ix_(rows, columns)])
    u = np.flatnonzero(region.mask.any(axis=0))
    behind = _mirrors(region, scene, u, region.mask.argmax(axis=0)[u])
    return bool(things.mean() > _THINGS or behind.mean() > 0.5)


def _borders(what: Bool, u: Index, v: Index, way: int, *, rows: int = EDGE_ROWS) -> Bool:
    """Tell for each column whether `what` is found within some rows beyond row v."""
    searched = v[None, :] + way * np.arange(1, rows + 1)[:, None]
    at = np.clip(searched, 0, what.shape[0] - 1)
    found: Bool = what[at, u[None, :]].sum(axis=0) >= EDGE_ROWS // 3
    return found


def _stands_out(region: Region) -> bool:
    """Tell a pit from a gap between blades: it is deeper than the ground around it is rough.

    The roughness is that of the lower half of what is around it, as things may stand there.
    """
    residual, mask = region.sorting.residual, region.mask.astype(np.uint8)
    around = cv2.dilate(mask, _AROUND) > cv2.dilate(mask, CLOSING[:5, :5])
    outer, inner = residual[around], residual[region.mask]
    outer, inner = outer[np.isfinite(outer)], inner[np.isfinite(inner)]
    if min(len(outer), len(inner)) < LEAST_PIXELS // 2:
        return True
    level = median(outer)
    rough = _SIGMA * (level - quantile(outer, 0.25))
    return level - median(inner) > _RELIEF * rough


def _falls_at_once(sorting: Sorting, u: Index, bottom: Index) -> bool:
    """Tell a drop from ground that only slopes away: the disparity falls off at the lip."""
    at_lip = _fall(sorting, u, bottom, 2) > _LIP * sorting.allowed[bottom, u]
    # lower ground stays as much lower, a descent goes on falling
    behind = _fall(sorting, u, bottom, EDGE_ROWS)
    beyond = _fall(sorting, u, bottom, 3 * EDGE_ROWS)
    fell = at_lip & (behind > _AT_ONCE * beyond)
    return bool(fell.mean() > _BORDERED)


def _fall(sorting: Sorting, u: Index, bottom: Index, first: int) -> Float64:
    """Return how far the disparity falls [px] in some rows from the `first` beyond the lip on."""
    rows = np.clip(bottom[None, :] - np.arange(first, first + EDGE_ROWS)[:, None], 0, None)
    fall = -sorting.residual[rows, u[None, :]]
    fall[np.isnan(fall)] = 0.0
    return middle(fall).astype(np.float64)


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
    across, along = across_and_along(np.concatenate([near, far], axis=1) if pit else near, bearing)
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
        sigma_distance=math.hypot(3 * step, distance * ground.noise / level / 4),
        sigma_width=math.hypot(3 * pixel * distance, _VAGUE * across),
        sigma_length=math.hypot(3 * step, _VAGUE * length) if pit else math.nan,
        sigma_depth=math.hypot(
            (ground.height + depth) * ground.noise / level / math.sqrt(max(shown / 25, 1)),
            distance * ground.sigma_pitch,
            _SMOOTHED * depth,  # where exactly the rim and the bottom are is a matter of definition
        ),
        confidence=1 - math.exp(-shown / (4 * LEAST_PIXELS)),
        box=_box(region, u, top, bottom),
        pixels=int(np.count_nonzero(region.mask)),
    )
    return cut(hole, scene.shape)


def _box(region: Region, u: Index, top: Index, bottom: Index) -> tuple[int, int, int, int]:
    left, right = int(u[0]) + region.left, int(u[-1]) + region.left
    return left, int(top.min()) + region.top, right, int(bottom.max()) + region.top


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
    # a matcher carries the floor into the hole: that is no slope
    carried = scene.fringe * near * near / (scene.view.projection.fy * scene.ground.height)
    return bool(middle(closest - carried) * math.tan(_STEEP) < 0.5 * depth)


def _depth(region: Region, ground: Ground, *, pit: bool) -> tuple[float, int]:
    """Return how deep the region's deepest tenth lies below the floor [m], and its pixel count."""
    d = region.sorting.disparity[region.mask].astype(np.float64)
    level = region.sorting.floor[region.mask].astype(np.float64)
    seen = d > 0  # NaN compares false
    shown = int(np.count_nonzero(seen))
    if shown < LEAST_PIXELS // 2:
        return 0.0, 0
    d, level = d[seen], level[seen]
    if not pit:  # far ground beyond a drop is noisier, and no measure of its lip
        near = d >= median(d)
        d, level = d[near], level[near]
    lifts = ground.height * (1 - level / d)
    return -quantile(lifts, _DEEPEST), shown

"""Things that the images show and the disparity map does not."""

import math

import numpy as np

from bearcub.ground.surface import Surface
from bearcub.obstacles.cloud import View
from bearcub.obstacles.joining import Thing
from bearcub.obstacles.measure import Extent
from bearcub.obstacles.parallax import SIZE, Foot, feet
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.upright import Scene, Upright
from bearcub.obstacles.verify import Witness

_TRIES = 4  # feet that are looked at, the surest first
_WIDE = 0.5  # what may be a kerb or a wall that goes on [m]
_WINDOW = 5  # how far from a thing a matcher may mix it with the floor [px]
_FLOOR = 0.6  # share of what is around a thing that must be floor
_THINNEST = 0.05  # thing that is told from a blade of grass [m]
_FLAT = 0.2  # height over width of what is a part of a kerb or of ground that rises
_BLUR = 0.8  # how far a silhouette's blur carries a thing past it [px]
_EDGE = 1.5  # 1-sigma of where a side is [px]
_NEAR = 1.5  # sizes of a small thing about another in which its own pixels may look like a foot
_RANGE = (0.4, 0.12)  # how far before or behind a thing its own pixels may be put [m], share


def small_things(
    known: list[Thing],
    witness: Witness | None,
    sorter: Sorter,
    view: View,
    *,
    offset: float,
    least_height: float,
    least_area: float,
    bias: float,
) -> list[Thing]:
    """Return things beside the known ones.

    Parameters
    ----------
    known : list of Thing
    witness : Witness or None
        None, for a disparity map without its images, knows no more.
    sorter : Sorter
    view : View
    offset : float
        In the disparities, not in the images [px].
    least_height, least_area : float
        Of a thing [m], [m²].
    bias : float
        1-sigma of the disparity error that all pixels of a thing share [px].
    """
    if witness is None:
        return []
    p, surface = view.projection, sorter.surface
    scene = Scene(witness=witness, surface=surface, projection=p, offset=offset)
    found: list[Thing] = []
    parts: list[Thing] = []
    tries = 0
    for foot in feet(witness.left, witness.right, surface, baseline=p.baseline, offset=offset):
        if any(_at_the_foot(foot, thing, p.baseline) for thing in (*known, *found, *parts)):
            continue
        tries += 1
        if tries > _TRIES:
            break
        upright = scene.standing(foot)
        if upright is None or _floor_around(upright, sorter, p.baseline) < _FLOOR:
            continue
        thing = _thing(upright, surface, view, bias=bias)
        extent = thing.extent
        low = extent.top + extent.sigma_top < least_height
        thin = extent.width < max(_THINNEST, least_area / extent.top)
        if low or thin or extent.top < _FLAT * extent.width:
            continue
        if any(_same(extent, other.extent) for other in (*known, *found, *parts)):
            continue
        if upright.alone:
            found.append(thing)
        elif not any(_in_line(extent, other.extent) for other in known):
            parts.append(thing)
    # they may all be parts of one
    return found + sorted(parts, key=lambda part: part.extent.distance)[:1]


def _at_the_foot(foot: Foot, thing: Thing, baseline: float) -> bool:
    left, top, right, bottom = thing.box
    margin = _NEAR * SIZE * foot.level / baseline
    return left - margin <= foot.u <= right + margin and top <= foot.v <= bottom + margin


def _same(one: Extent, other: Extent) -> bool:
    """Tell whether two things touch: the same one, told twice."""
    apart = max(one.right - other.left, other.right - one.left) * one.distance
    behind = abs(one.distance - other.distance)
    return apart < SIZE and behind < max(_RANGE[0], _RANGE[1] * one.distance)


def _floor_around(upright: Upright, sorter: Sorter, baseline: float) -> float:
    """Return the share of the pixels around an upright surface that were matched as floor."""
    rows, columns = sorter.disparity.shape
    margin = _WINDOW + math.ceil(SIZE * upright.disparity / baseline)
    top, left = max(0, upright.top - margin), max(0, upright.left - margin)
    part = sorter.part(
        slice(top, min(rows, upright.foot + margin)),
        slice(left, min(columns, upright.right + margin)),
    )
    around = np.ones(part.on_floor.shape, dtype=bool)
    own_rows = slice(max(0, upright.top - top - _WINDOW), upright.foot + 1 - top + _WINDOW)
    own_columns = slice(max(0, upright.left - left - _WINDOW), upright.right + 1 - left + _WINDOW)
    around[own_rows, own_columns] = False
    return float(part.on_floor[around].mean())


def _in_line(part: Extent, whole: Extent) -> bool:
    """Tell whether something lies in the straight line of a wide thing."""
    if whole.width < _WIDE:
        return False
    ends = [
        (reach * math.cos(bearing), reach * math.sin(bearing))
        for reach, bearing in ((whole.range_right, whole.right), (whole.range_left, whole.left))
    ]
    (x, y), (other_x, other_y) = ends
    along, across = other_x - x, other_y - y
    off = along * (part.y - y) - across * (part.x - x)
    return abs(off) < _RANGE[0] * math.hypot(along, across)


def _thing(upright: Upright, surface: Surface, view: View, *, bias: float) -> Thing:
    """Return the thing that an upright surface is, without the blur about its silhouette."""
    middle = 0.5 * (upright.left + upright.right)
    row = 0.5 * (upright.top + upright.foot)
    # what only the left camera sees beside it is as wide as its parallax
    floor = surface.at(np.array([int(middle)]), np.array([upright.top]))
    hidden = max(0.0, upright.disparity - float(floor[0]))
    u = np.array([upright.left - 0.5 + _BLUR + hidden, middle, upright.right + 0.5 - _BLUR, middle])
    v = np.array([row, row, row, upright.top - 0.5 + _BLUR])
    x, y, z = view.points(u, v, np.full(4, upright.disparity))
    bearing, reach = np.arctan2(y, x), np.hypot(x, y)
    left, right, distance = float(bearing[0]), float(bearing[2]), float(reach[1])
    edge = math.hypot(_EDGE, 0.5 * upright.step) / view.projection.fx
    spread = math.hypot(upright.sigma, bias) / upright.disparity
    lift = surface.lift(upright.disparity)
    width, top = distance * (left - right), float(z[3]) - lift
    extent = Extent(
        x=float(x[1]),
        y=float(y[1]),
        distance=distance,
        bearing=0.5 * (left + right),
        right=right,
        left=left,
        range_right=float(reach[2]),
        range_left=float(reach[0]),
        width=width,
        top=top,
        bottom=0.0,
        lowest=0.0,
        fill=1.0,
        front=top,
        climb=math.nan,
        ground=lift,
        sigma_distance=distance * spread,
        sigma_bearing=edge / math.sqrt(2),
        sigma_width=math.hypot(math.sqrt(2) * edge * distance, width * spread),
        sigma_top=math.hypot(edge * distance, abs(view.origin[2] - top) * spread),
    )
    box = (upright.left, upright.top, upright.right, upright.foot)
    return Thing(extent=extent, box=box, pixels=upright.pixels, numbers=())

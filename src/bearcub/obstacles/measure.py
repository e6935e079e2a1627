"""How large, how far, at what angle, how high: one thing's pixels become numbers with sigmas."""

import math
from dataclasses import dataclass

import numpy as np

from bearcub.geometry import Float64
from bearcub.ground.surface import Surface
from bearcub.messages import Float32
from bearcub.obstacles.cloud import Cloud, View, cloud_of
from bearcub.robust import line
from bearcub.stereo.native import COMPILED

_SIDE = 0.15  # share of a typical column's pixels at which a thing ends to the sides
_TOP = 0.35  # share of a typical row's pixels at which it ends above and below
_STEEPEST = math.tan(math.radians(20.0))  # of ground that climbs
_EXPLAINED = 0.7  # share of the variance of height that range must explain on a ramp
RISEN = 0.6  # share of its height that what stands upright has at its front
_LONG = 1.5  # farthest over nearest range of what lies along the way
_EXPLAINED_LONG = 0.25  # the same share where range itself is noisy
BEFORE = 1.06  # times a thing's disparity is where its ground begins, before what is its foot
STEP = 0.15  # what rises over a longer way is sloping ground [m]
_NEAREST = 10  # one in so many pixels of a direction is nearer than its face
_LEANS = 2.5  # sigmas of the floor's noise from the nearest tenth to the median of an upright face
_SHARPEST = 0.03  # share of its range that an edge may be nearer than its direction's mean
_STRAIGHT = 5  # directions of a thing that tell whether it is straight, at least
_ON_LINE = 0.02  # how far off a line a direction may be, share of its range
_MOST = 0.6  # share of the directions that a line must have
_EDGE = 1.0  # 1-sigma of where a side is [px]
_UPPER = 1.5  # ... of where the top is
_CARRIED = 0.75  # ... as a share of how far the matcher carries things
_MIDDLE = 0.55  # ... of the middle between two, as a share of it: their errors are alike
_TOP_FACE = 1.6  # times the noise that a top face seen from above is thick, as is the top
_BLURRED = 0.02  # 1-sigma of a width, share of it: tapers
MARGIN = 6  # rows and columns at the image's border that a matcher may lose [px]
_BLOCK = 25.0  # neighbouring pixels of a matcher that err together


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """The size and place of one thing; see `messages.Obstacle` for the meaning.

    `right` and `left` are the bearings of its ends, `range_right` and `range_left` their ranges;
    `lowest` is the lowest part that is seen, `bottom` where the thing is taken to begin;
    `fill` is the share of its outline (width times height) that its pixels cover; `width` is 0
    for what is no wider than the matcher's window alone makes it; `front` is how high it has risen
    a step behind its nearest point; `climb` is the slope (tangent) of ground that rises evenly with
    the range, NaN for what is none; heights are above the floor there, which lies `ground` above
    the plane.
    """

    x: float
    y: float
    distance: float
    bearing: float
    right: float
    left: float
    range_right: float
    range_left: float
    width: float
    top: float
    bottom: float
    lowest: float
    fill: float
    front: float
    climb: float
    ground: float
    sigma_distance: float
    sigma_bearing: float
    sigma_width: float
    sigma_top: float

    @property
    def climbs(self) -> bool:
        """Whether it is ground that climbs."""
        return not math.isnan(self.climb)


def measure(
    view: View,
    surface: Surface,
    u: Float64,
    v: Float64,
    disparity: Float32,
    *,
    stride: int,
    pixels: int,
    noise: float,
    bias: float,
    fattening: float,
    fringe: float,
    witnessed: bool,
    compiled: bool = COMPILED,
) -> Extent:
    """Measure one thing from its pixels.

    Parameters
    ----------
    view : View
    surface : Surface
        The floor that heights are above: where the thing stands.
    u, v : ndarray of float64, shape (N,)
        Columns and rows of the thing's pixels [px].
    disparity : ndarray of float32, shape (N,)
        [px].
    stride : int
        They are of every `stride`-th column and row.
    pixels : int
        That the thing has: these, or more of which these are a sample.
    noise : float
        1-sigma of a pixel's disparity [px], independent between patches.
    bias : float
        1-sigma of the error that all its pixels share [px].
    fattening, fringe : float
        How far the matcher carried the thing past its top, and past its sides [px].
    witnessed : bool
        The images will be asked: an upright face whose noise looks like a ramp need not be one.
    compiled : bool
        By the native core, ``native/src/cloud.cpp``; else by NumPy.

    Returns
    -------
    Extent
    """
    weight = pixels / len(u)
    cloud = cloud_of(view, u, v, disparity, compiled=compiled)
    pixel = 1.0 / view.projection.fx
    face = _face(cloud, view, weight=weight, stride=stride, noise=noise, bias=bias, fringe=fringe)
    distance, width, spread = face.distance, face.width, face.spread
    sigma_distance = distance * spread / face.disparity
    edge = math.hypot(_EDGE, 0.5 * fringe) * pixel
    row = cloud.range(0.5) * pixel
    low, high = _heights(cloud, row, stride=stride, fattening=fattening)
    lift = surface.lift(BEFORE * face.disparity)
    risen = cloud.height_before(distance + STEP + 3 * sigma_distance, 0.9)
    risen = low if math.isnan(risen) else risen
    drop = abs(view.origin[2] - high) / face.disparity  # of height, by a pixel of disparity
    return Extent(
        x=distance * math.cos(face.nearest),
        y=distance * math.sin(face.nearest),
        distance=distance,
        bearing=0.5 * (face.right + face.left),
        right=face.right,
        left=face.left,
        range_right=face.range_right,
        range_left=face.range_left,
        width=width,
        top=high - lift,
        bottom=low + fattening * row - lift,
        lowest=low - lift,
        fill=weight * pixel**2 * cloud.squares() / max(width * (high - low), 1e-6),
        front=risen - lift,
        ground=lift,
        climb=math.nan if witnessed and risen - lift > RISEN * (high - lift) else _climb(cloud),
        sigma_distance=sigma_distance,
        sigma_bearing=_MIDDLE * edge,
        sigma_width=math.hypot(
            math.sqrt(2) * edge * distance, width * spread / face.disparity, _BLURRED * width
        ),
        # a visible top face is as thick as its noise, and ends higher for it
        sigma_top=math.hypot(
            edge * distance,
            drop * spread,
            max(_UPPER, _CARRIED * fattening) * row,
            _TOP_FACE * drop * noise,
        ),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Face:
    """A thing as seen from above, see `Extent`.

    `nearest` is the bearing of its nearest point, `disparity` the one there, `spread` its 1-sigma
    [px].
    """

    right: float
    left: float
    range_right: float
    range_left: float
    width: float
    distance: float
    nearest: float
    disparity: float
    spread: float


def _face(
    cloud: Cloud,
    view: View,
    *,
    weight: float,
    stride: int,
    noise: float,
    bias: float,
    fringe: float,
) -> _Face:
    """Return where a thing faces the camera; each of its pixels here stands for `weight`."""
    pixel = 1.0 / view.projection.fx
    right, left, narrow = _sides(cloud, stride * pixel, pixel=pixel, fringe=fringe)
    focal = view.projection.fx * view.projection.baseline
    ranges, bearings, counts = _near_face(cloud, right, left, pixel, noise / focal)
    nearest = ranges.index(min(ranges))
    distance = ranges[nearest] - _to_the_point(ranges, nearest)
    range_right, range_left = _ends_of_face(ranges, bearings, right, left)
    together = max(weight * counts[nearest], _BLOCK)
    return _Face(
        right=right,
        left=left,
        range_right=range_right,
        range_left=range_left,
        width=0.0 if narrow else _chord(ranges, left - right),
        distance=distance,
        nearest=bearings[nearest],
        disparity=focal / max(distance, 1e-6),
        spread=math.sqrt(noise**2 * _BLOCK / together + bias**2),
    )


def cut_sides(
    box: tuple[int, int, int, int], shape: tuple[int, int], *, first_row: int = 0
) -> tuple[str, ...]:
    """Name the image borders that a box touches, with the margin a matcher loses there.

    Parameters
    ----------
    box : tuple of int
        First column and row, last column and row [px].
    shape : tuple of int
        Rows and columns of the image.
    first_row : int
        The first that was looked at.

    Examples
    --------
    >>> cut_sides((2, 40, 90, 476), (480, 640))
    ('left', 'bottom')
    """
    left, top, right, bottom = box
    rows, columns = shape
    sides = {
        "left": left < MARGIN,
        "right": right >= columns - MARGIN,
        "top": top < first_row + MARGIN,
        "bottom": bottom >= rows - MARGIN,
    }
    return tuple(name for name, touched in sides.items() if touched)


def _sides(cloud: Cloud, step: float, *, pixel: float, fringe: float) -> tuple[float, float, bool]:
    """Return the bearings of both ends without a matcher's fringe; True where it leaves nothing."""
    right, left = cloud.sides(step, _SIDE)
    if left - right <= (2 * fringe + 1) * pixel:
        return right, left, True
    return right + fringe * pixel, left - fringe * pixel, False


def _heights(cloud: Cloud, row: float, *, stride: int, fattening: float) -> tuple[float, float]:
    """Return the heights of a thing's lower end and, without what the matcher adds, its top [m]."""
    low, high = cloud.heights(stride * row, _TOP)
    return low, max(high - fattening * row, low + row)


def _climb(cloud: Cloud) -> float:
    """Return the slope of a ramp (tangent), NaN for what is none.

    Its height follows from range, and rises with it no steeper than a way may.
    """
    spread, together, height = cloud.spread()
    if spread == 0.0:
        return math.nan
    slope = together / spread
    explained = slope * together / max(height, 1e-12)
    long = cloud.range(0.95) > _LONG * cloud.range(0.05)
    if not 0.0 < slope < _STEEPEST or explained <= (_EXPLAINED_LONG if long else _EXPLAINED):
        return math.nan
    return slope / explained  # noise is in the range, which the height is free of


def _near_face(
    cloud: Cloud, right: float, left: float, pixel: float, blur: float
) -> tuple[list[float], list[float], list[float]]:
    """Return the range [m] of the thing in up to 13 directions, the directions and pixel counts.

    Of an upright face that is the median range of its pixels, of one that leans back the range of
    its foot: no more than noise allows beyond the nearest tenth. `blur` is the 1-sigma of 1 / range
    [1/m] that noise makes.
    """
    columns = max(1.0, (left - right) / pixel)
    groups = min(max(int(columns // 4), 1), 13)
    # of so few numbers lists are several times faster than arrays
    each = list(zip(*cloud.directions(right, left, groups, _NEAREST), strict=True))
    least = 0.25 * _middle([count for count, _, _ in each])
    used = [(k, *numbers) for k, numbers in enumerate(each) if numbers[0] > least]
    ranges = [min(middle, near + _LEANS * blur * near * near) for _, _, near, middle in used]
    step = (left - right) / groups
    directions = [right + (k + 0.5) * step for k, *_ in used]
    # where noise reaches farther than the next direction, wrong matches make dents
    if blur * _middle(ranges) > step:
        ranges = _without_dents(ranges)
    inner = [
        0.25 * a + 0.5 * b + 0.25 * c
        for a, b, c in zip(ranges, ranges[1:], ranges[2:], strict=False)
    ]
    return [ranges[0], *inner, *ranges[1:][-1:]], directions, [count for _, count, *_ in used]


def _middle(values: list[float]) -> float:
    """Return the middle one of `values`, the upper of two."""
    return sorted(values)[len(values) // 2]


def _without_dents(ranges: list[float]) -> list[float]:
    """Return the running median of five, of three at the ends, where ranges are much nearer."""
    last = len(ranges) - 1
    if last < 4:
        return ranges
    around = [
        _middle(ranges[max(0, k - 2) : k + 3])
        if 2 <= k <= last - 2
        else _middle(ranges[:3] if k < 2 else ranges[last - 2 :])
        for k in range(len(ranges))
    ]
    return [b if a < (1 - _SHARPEST) * b else a for a, b in zip(ranges, around, strict=True)]


def _to_the_point(ranges: list[float], nearest: int) -> float:
    """Return how much nearer than its direction's smoothed range an edge turned towards us is [m].

    About an edge the range grows by a step s a direction on both sides. The mean over the direction
    is s/4 beyond the edge, the smoothing makes it 5/8 s; at a thing's end the mean is s/2 beyond.
    """
    last = len(ranges) - 1
    if 2 <= nearest <= last - 2:
        outer, inner = (
            ranges[nearest - 2] + ranges[nearest + 2],
            ranges[nearest - 1] + ranges[nearest + 1],
        )
        step, share = 0.5 * (outer - inner), 0.625
    elif last >= 2 and nearest in (0, last):
        step, share = ranges[1 if nearest == 0 else last - 1] - ranges[nearest], 0.5
    else:
        return 0.0
    return min(share * max(step, 0.0), _SHARPEST * ranges[nearest])


def _ends_of_face(
    ranges: list[float], directions: list[float], right: float, left: float
) -> tuple[float, float]:
    """Return the ranges of a thing's right and left end [m].

    They are those of the straight line that most of its directions lie on, where there is one: the
    outermost directions are the ones that wrong matches and feet spoil.
    """
    ends = ranges[0], ranges[-1]
    if len(ranges) < _STRAIGHT:
        return ends
    turned = np.array(directions) - 0.5 * (right + left)
    # seen from the middle, 1 / ahead grows evenly along a line
    across, inverse = np.tan(turned), 1 / (np.array(ranges) * np.cos(turned))
    start, slope = line(across, inverse)
    on = np.abs(start + slope * across - inverse) < _ON_LINE * inverse
    if np.count_nonzero(on) < _MOST * len(ranges):
        return ends
    start, slope = line(across[on], inverse[on])
    half = 0.5 * (left - right)
    inverses = [(start + slope * math.tan(edge)) * math.cos(edge) for edge in (-half, half)]
    if min(inverses) < 0.5 / max(ends):  # seen along, it has no end to speak of
        return ends
    return 1 / inverses[0], 1 / inverses[1]


def _chord(ranges: list[float], angle: float) -> float:
    """Return the extent across the line of sight between the two silhouettes."""
    return (_at_the_end(ranges) + _at_the_end(ranges[::-1])) * math.sin(0.5 * angle)


def _at_the_end(ranges: list[float]) -> float:
    """Return the range at the first end, half a direction beyond the first one's middle [m]."""
    first = ranges[0]
    if len(ranges) < 3:
        return first
    limit = _SHARPEST * first
    return first + min(max(0.5 * (first - ranges[1]), -limit), limit)

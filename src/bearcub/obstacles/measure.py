"""How large, how far, at what angle, how high: one thing's pixels become numbers with sigmas."""

import math
from dataclasses import dataclass

from bearcub.geometry import Float64
from bearcub.ground.surface import Surface
from bearcub.messages import Float32
from bearcub.obstacles.cloud import Cloud, View, cloud_of
from bearcub.obstacles.face import Face
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
_EDGE = 1.0  # 1-sigma of where a side is [px]
_UPPER = 1.5  # ... of where the top is
_CARRIED = 0.75  # ... as a share of how far the matcher carries things
_MIDDLE = 0.55  # ... of the middle between two, as a share of it: their errors are alike
_TOP_FACE = 1.6  # times the noise that a top face seen from above is thick, as is the top
_OWN = 0.85  # share of the error of a height's two disparities, the floor's and its own, in a range
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
    pixel, focal = 1.0 / view.projection.fx, view.projection.fx * view.projection.baseline
    right, left, narrow = _sides(cloud, stride * pixel, pixel=pixel, fringe=fringe)
    face = Face(*cloud.face(right, left, pixel, noise / focal, _BLOCK / weight))
    distance, width = face.distance, 0.0 if narrow else face.width
    level = focal / max(distance, 1e-6)  # the disparity of its nearest point
    spread = math.sqrt(noise**2 * _BLOCK / max(weight * face.pixels, _BLOCK) + bias**2)
    sigma_distance = _OWN * distance * spread / level
    edge = math.hypot(_EDGE, 0.5 * fringe) * pixel
    # the image will tell how sure the sides are, and how upright
    side, tapers = (0.0, 0.0) if witnessed else (edge, _BLURRED)
    row = cloud.range(0.5) * pixel
    low, high = _heights(cloud, row, stride=stride, fattening=fattening)
    lift = surface.lift(BEFORE * level)
    risen = cloud.height_before(distance + STEP + 3 * sigma_distance, 0.9)
    risen = low if math.isnan(risen) else risen
    drop = abs(view.origin[2] - high) / level  # of height, by a pixel of disparity
    return Extent(
        x=distance * math.cos(face.nearest),
        y=distance * math.sin(face.nearest),
        distance=distance,
        bearing=0.5 * (right + left),
        right=right,
        left=left,
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
        sigma_bearing=_MIDDLE * side,
        sigma_width=math.hypot(
            math.sqrt(2) * side * distance, width * spread / level, tapers * width
        ),
        sigma_top=_sigma_top(edge * distance, drop, row, spread, noise=noise, fattening=fattening),
    )


def _sigma_top(
    edge: float, drop: float, row: float, spread: float, *, noise: float, fattening: float
) -> float:
    """Return the 1-sigma of a height [m]; `drop` is of height, by a pixel of disparity."""
    carried = max(_UPPER, _CARRIED * fattening) * row
    # a visible top face is as thick as its noise, and ends higher for it
    return math.hypot(edge, drop * spread, carried, _TOP_FACE * drop * noise)


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
    if not 0.0 < slope < _STEEPEST or explained <= _EXPLAINED_LONG:
        return math.nan
    if explained <= _EXPLAINED and cloud.range(0.95) <= _LONG * cloud.range(0.05):
        return math.nan
    return slope / explained  # noise is in the range, which the height is free of

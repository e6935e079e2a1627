"""What the stages find in one frame: things, holes, ground, the free way, layers of pixels."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from functools import cached_property, partial

import numpy as np

from bearcub.messages.arrays import Float32, Float64, Int32, UInt8


class Pixel(IntEnum):
    """What a pixel of the left image was found to be."""

    UNSEEN = 0  # no disparity
    FLOOR = 1
    OBSTACLE = 2
    HOLE = 3
    OTHER = 4  # measured, neither: too far, overhead, too small to count


class Limit(StrEnum):
    """What ends the free way in one direction."""

    OBSTACLE = "obstacle"
    HOLE = "hole"
    SLOPE = "slope"
    UNSEEN = "unseen"


@dataclass(frozen=True, slots=True, kw_only=True)
class Vote:
    """What one sensor says of one thing."""

    sensor: str
    vote: str  # "for", "against" or "abstain"
    weight: float
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """One thing that stands on the ground or hangs over it; sigmas are one standard deviation.

    Attributes
    ----------
    id : int
        1 for the nearest of the frame; with a tracker, the same number for the same thing.
    x, y : float
        The nearest point [m], base_link.
    distance : float
        Horizontal, origin to that point [m].
    bearing : float
        Of the thing's centre [rad], left positive.
    width : float
        Visible extent across the line of sight [m]; a lower bound where `truncated`.
    height : float
        Top above the ground at its foot [m]; a lower bound where it leaves the image above.
    base_height : float
        Lowest part above the ground [m]; 0 for what stands on it.
    box : tuple of int
        (u_min, v_min, u_max, v_max) in the left image, inclusive [px].
    truncated : tuple of str
        Image borders that cut it: "left", "right", "top", "bottom".
    """

    id: int
    x: float
    y: float
    distance: float
    bearing: float
    width: float
    height: float
    base_height: float
    sigma_distance: float
    sigma_bearing: float
    sigma_width: float
    sigma_height: float
    confidence: float
    box: tuple[int, int, int, int]
    pixels: int
    truncated: tuple[str, ...] = ()
    votes: tuple[Vote, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Hole:
    """Ground that is missing: a pit, or a drop beyond which no ground was seen again.

    Attributes
    ----------
    x, y, distance, bearing
        Of the near lip: nearest point [m], its horizontal distance [m]; bearing of the
        centre [rad].
    width, length : float
        Across and along the line of sight [m]; `length` is NaN for a drop.
    depth : float
        Below the ground [m]; a lower bound where `depth_is_lower_bound`.
    kind : str
        "pit" or "drop".
    """

    x: float
    y: float
    distance: float
    bearing: float
    width: float
    length: float
    depth: float
    depth_is_lower_bound: bool
    kind: str
    sigma_distance: float
    sigma_width: float
    sigma_length: float
    sigma_depth: float
    confidence: float
    box: tuple[int, int, int, int]
    pixels: int
    truncated: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SlopeBand:
    """The ground's inclination in one band of range ahead ([m], [rad], up positive)."""

    start: float
    end: float
    slope: float
    sigma: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Terrain:
    """How the ground ahead lies, from 1.5 to 5 m.

    Attributes
    ----------
    slope, cross_slope : float
        [rad]; up ahead positive, and positive where the ground rises to the left. NaN unknown.
    sigma : float
        Of either [rad].
    roughness : float
        RMS height of the ground about its profile [m], noise removed; NaN where noise hides it.
    reference : str
        "gravity" with a tilt reading, else "robot": against the ground under the robot.
    """

    slope: float
    cross_slope: float
    sigma: float
    roughness: float
    reference: str
    profile: tuple[SlopeBand, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """The floor just ahead of the robot, as a surface in disparity space.

    Attributes
    ----------
    plane : ndarray of float64, shape (3,)
        (a, b, c) of ``d = a u + b v + c`` [px], adjusted disparity.
    covariance : ndarray of float64, shape (3, 3)
        Of `plane`.
    knots, bend : ndarray of float64, shape (K,)
        The profile of a floor that bends: `bend` [px] is added to the plane where the plane's own
        disparity is `knots` [px], ascending, linear between; empty where no profile was seen.
    knot_noise : ndarray of float64, shape (K,)
        Disparity noise measured on the floor there, 1-sigma [px].
    followed_to : float
        Knots below this level [px] lie beyond where the floor could be followed (a wall, a drop):
        there it is taken to go on as it is.
    height, pitch, roll : float
        The camera above and against that floor [m], [rad].
    sigma_height, sigma_pitch, sigma_roll : float
        One standard deviation of each.
    noise : float
        Disparity noise measured on the floor, 1-sigma [px].
    source : str
        What the floor comes from: "tilt+image", "image", "tilt" or "mount".
    seen : bool
        False when no floor was found in the image; the plane is then the prior's.
    residual : float
        Robust RMS of the floor's pixels about it [px]; NaN when not seen.
    tilt_disagreement : float
        Angle between the tilt sensor's and the image's floor [rad]; NaN without either.
    """

    plane: Float64
    covariance: Float64
    height: float
    pitch: float
    roll: float
    sigma_height: float
    sigma_pitch: float
    sigma_roll: float
    noise: float
    source: str
    seen: bool
    residual: float
    tilt_disagreement: float
    knots: Float64 = field(default_factory=lambda: np.zeros(0))
    bend: Float64 = field(default_factory=lambda: np.zeros(0))
    knot_noise: Float64 = field(default_factory=lambda: np.zeros(0))
    followed_to: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeRange:
    """How far the way is free in each direction; arrays of one length, bearings ascending.

    Attributes
    ----------
    bearing : ndarray of float64, shape (N,)
        [rad], left positive.
    range : ndarray of float64, shape (N,)
        Horizontal, from the origin [m].
    limit : tuple of Limit
        What ends it.
    """

    bearing: Float64
    range: Float64
    limit: tuple[Limit, ...]

    def __len__(self) -> int:
        return len(self.limit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Painting:
    """Floor, kind and labels of every pixel; see `Layers`."""

    floor: Float32
    kind: UInt8
    labels: Int32


@dataclass(frozen=True, kw_only=True)
class Layers:
    """Per-pixel results, shape (H, W) each, of the left image, painted when first asked for.

    Attributes
    ----------
    disparity : float32
        As used [px]; NaN unmatched.
    paint : callable
        Returns the other layers.
    """

    disparity: Float32
    paint: Callable[[], Painting]

    @classmethod
    def of(cls, *, disparity: Float32, floor: Float32, kind: UInt8, labels: Int32) -> "Layers":
        """Return layers that are there already.

        Parameters
        ----------
        disparity : ndarray of float32, shape (H, W)
            [px]; NaN unmatched.
        floor : ndarray of float32, shape (H, W)
            Disparity of the floor [px].
        kind : ndarray of uint8, shape (H, W)
            `Pixel` codes.
        labels : ndarray of int32, shape (H, W)
            Numbers of obstacles and holes.
        """
        painting = Painting(floor=floor, kind=kind, labels=labels)
        return cls(disparity=disparity, paint=partial(_as_it_is, painting))

    @cached_property
    def _painting(self) -> Painting:
        return self.paint()

    @property
    def floor(self) -> Float32:
        """Disparity of the floor [px], float32, bend included; zero or less above the horizon."""
        return self._painting.floor

    @property
    def kind(self) -> UInt8:
        """`Pixel` codes, uint8."""
        return self._painting.kind

    @property
    def labels(self) -> Int32:
        """`Obstacle.id` of the pixel, int32; -1, -2, ... for holes in their order; 0 none."""
        return self._painting.labels


def _as_it_is(painting: Painting) -> Painting:
    return painting


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Milliseconds spent per stage."""

    match: float
    ground: float
    obstacles: float
    total: float

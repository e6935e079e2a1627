"""The frozen values that stages exchange, and the answer of one frame with its JSON.

Units are SI and radians; degrees appear only in names that say so and in the JSON. NaN is "not
known" everywhere and becomes ``null`` in the JSON. Frame of every position: ``base_link``.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import InputError

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
UInt8 = NDArray[np.uint8]
Int32 = NDArray[np.int32]
Bool = NDArray[np.bool_]

SCHEMA = "bearcub.answer/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tilt:
    """A tilt sensor's reading of the body against gravity, REP-103 [rad]."""

    pitch: float
    roll: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Everything one cycle looks at: a rectified pair, or a disparity map, and the tilt.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        The rectified pair, colour as BGR. `left` may come with a disparity map, for the picture.
    disparity : ndarray of float32, shape (H, W), or None
        ``u_left - u_right`` [px] as measured, before the rig's `doffs` is added; NaN where
        unmatched, 0 at infinity. When given, nothing is matched.
    tilt : Tilt or None
        None when there is no reading.
    stamp_ns : int
        When the pair was taken [ns].
    """

    left: UInt8 | None = None
    right: UInt8 | None = None
    disparity: Float32 | None = None
    tilt: Tilt | None = None
    stamp_ns: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class DisparityMap:
    """One frame of disparity, adjusted for the principal points (depth = fx B / d).

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN where unmatched, 0 at infinity.
    smallest, largest : float
        The range of disparities [px] that the matcher or sensor could have reported.
    valid_share : float
        Share of pixels with a disparity, 0 to 1.
    epipolar_offset : float
        Measured vertical misalignment of the pair [px], right image lower positive; NaN unknown.
    fattening : float
        How far the matcher carries a near surface's disparity past its edges [px].
    left, right : ndarray of uint8, shape (H, W), or None
        The grey pair it was matched from, rectified.
    offset : float
        What was added to the matched disparity, ``cx_right - cx_left`` [px].
    """

    disparity: Float32
    smallest: float = 0.0
    largest: float = math.inf
    valid_share: float = math.nan
    epipolar_offset: float = math.nan
    fattening: float = 0.0
    left: UInt8 | None = None
    right: UInt8 | None = None
    offset: float = 0.0


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
class Layers:
    """Per-pixel results, shape (H, W) each, of the left image.

    Attributes
    ----------
    disparity : float32
        As used [px]; NaN unmatched.
    floor : float32
        Disparity of the floor there [px], bend included; zero or less above the horizon.
    kind : uint8
        `Pixel` codes.
    labels : int32
        `Obstacle.id` of the pixel; ``-1, -2, ...`` for holes in their order; 0 none.
    """

    disparity: Float32
    floor: Float32
    kind: UInt8
    labels: Int32


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Milliseconds spent per stage."""

    match: float
    ground: float
    obstacles: float
    total: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Everything one frame answers. `notes` are sentences for the operator (not in the JSON)."""

    obstacles: tuple[Obstacle, ...]
    holes: tuple[Hole, ...]
    terrain: Terrain
    ground: Ground
    free_range: FreeRange
    timing: Timing
    layers: Layers
    stamp_ns: int = 0
    frame_id: str = "base_link"
    valid_share: float = math.nan
    epipolar_offset: float = math.nan
    notes: tuple[str, ...] = ()

    def __iter__(self) -> Iterator[Obstacle]:
        return iter(self.obstacles)

    def to_dict(self) -> dict[str, Any]:
        """Return the answer as the JSON object of the contract (``bearcub.answer/1``)."""
        return {
            "schema": SCHEMA,
            "stamp_ns": self.stamp_ns,
            "frame_id": self.frame_id,
            "obstacles": [_obstacle(o) for o in self.obstacles],
            "holes": [_hole(h) for h in self.holes],
            "terrain": _terrain(self.terrain),
            "ground": _ground(self.ground),
            "free_range": [
                {"bearing_deg": _deg(b), "range": _num(r), "limit": str(limit)}
                for b, r, limit in zip(
                    self.free_range.bearing,
                    self.free_range.range,
                    self.free_range.limit,
                    strict=True,
                )
            ],
            "timing_ms": {
                name: _num(getattr(self.timing, name))
                for name in ("match", "ground", "obstacles", "total")
            },
        }

    def to_json(self) -> str:
        """Return `to_dict` as one line of JSON."""
        return json.dumps(self.to_dict(), allow_nan=False)


def _num(value: float) -> float | None:
    return round(float(value), 4) if math.isfinite(value) else None


def _deg(value: float) -> float | None:
    return _num(math.degrees(value))


def _obstacle(o: Obstacle) -> dict[str, Any]:
    return {
        "id": o.id,
        "x": _num(o.x),
        "y": _num(o.y),
        "distance": _num(o.distance),
        "bearing_deg": _deg(o.bearing),
        "width": _num(o.width),
        "height": _num(o.height),
        "base_height": _num(o.base_height),
        "sigma": {
            "distance": _num(o.sigma_distance),
            "bearing_deg": _deg(o.sigma_bearing),
            "width": _num(o.sigma_width),
            "height": _num(o.sigma_height),
        },
        "confidence": _num(o.confidence),
        "votes": [
            {"sensor": v.sensor, "vote": v.vote, "weight": _num(v.weight), "reason": v.reason}
            for v in o.votes
        ],
    }


def _hole(h: Hole) -> dict[str, Any]:
    return {
        "x": _num(h.x),
        "y": _num(h.y),
        "distance": _num(h.distance),
        "bearing_deg": _deg(h.bearing),
        "width": _num(h.width),
        "length": _num(h.length),
        "depth": _num(h.depth),
        "depth_is_lower_bound": h.depth_is_lower_bound,
        "kind": h.kind,
        "sigma": {
            "distance": _num(h.sigma_distance),
            "width": _num(h.sigma_width),
            "length": _num(h.sigma_length),
            "depth": _num(h.sigma_depth),
        },
        "confidence": _num(h.confidence),
    }


def _terrain(t: Terrain) -> dict[str, Any]:
    return {
        "slope_deg": _deg(t.slope),
        "cross_slope_deg": _deg(t.cross_slope),
        "sigma_deg": _deg(t.sigma),
        "roughness": _num(t.roughness),
        "reference": t.reference,
        "profile": [
            {
                "from": _num(b.start),
                "to": _num(b.end),
                "slope_deg": _deg(b.slope),
                "sigma_deg": _deg(b.sigma),
            }
            for b in t.profile
        ],
    }


def _ground(g: Ground) -> dict[str, Any]:
    return {
        "height": _num(g.height),
        "pitch_deg": _deg(g.pitch),
        "roll_deg": _deg(g.roll),
        "source": g.source,
        "residual_px": _num(g.residual),
        "tilt_disagreement_deg": _deg(g.tilt_disagreement),
    }


def as_image(image: object, *, name: str) -> UInt8:
    """Check that `image` is an 8-bit grey or BGR image and return it.

    Raises
    ------
    InputError
        If it is not an array of uint8 of shape (H, W) or (H, W, 3) with at least 16 x 16 pixels.
    """
    shape = getattr(image, "shape", None)
    kind = getattr(image, "dtype", None)
    grey_or_colour = shape is not None and (len(shape) == 2 or (len(shape) == 3 and shape[2] == 3))
    if not isinstance(image, np.ndarray) or kind != np.uint8 or not grey_or_colour:
        raise InputError(
            f"{name}: expected an 8-bit image of shape (H, W) or (H, W, 3), "
            f"found {type(image).__name__} of shape {shape} and type {kind}"
        )
    if min(image.shape[:2]) < 16:
        raise InputError(f"{name}: expected at least 16 x 16 pixels, found {shape}")
    return image


def as_disparity(disparity: object, *, name: str) -> Float32:
    """Check that `disparity` is a floating-point map and return it as contiguous float32.

    Raises
    ------
    InputError
        If it is not a two-dimensional array of floats.
    """
    if (
        not isinstance(disparity, np.ndarray)
        or disparity.ndim != 2
        or not np.issubdtype(disparity.dtype, np.floating)
    ):
        raise InputError(
            f"{name}: expected a disparity map of floats of shape (H, W), found "
            f"{type(disparity).__name__} of shape {getattr(disparity, 'shape', None)} "
            f"and type {getattr(disparity, 'dtype', None)}"
        )
    return np.ascontiguousarray(disparity, dtype=np.float32)

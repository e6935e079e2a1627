"""How the ground lies: slope, cross slope, roughness and its profile by range."""

import math

import numpy as np

from bearcub.geometry import Float64, base_from_optical
from bearcub.messages import Ground, SlopeBand, Terrain
from bearcub.obstacles.cloud import View
from bearcub.obstacles.sorting import Sorting

_BAND = (1.5, 5.0)  # where slope and cross slope are taken [m] (the contract)
_STEP = 0.5  # length of a band of the profile [m]
_STARTS = np.arange(_BAND[0], _BAND[1], _STEP)
_FROM, _TO = np.append(_STARTS, _BAND[0]), np.append(_STARTS + _STEP, _BAND[1])  # and of them all
_DOUBTFUL = math.radians(5.0)  # bands less certain than this are left out
_PIXELS = 2000
_LEAST_PIXELS = 100
_LEAST_KNOTS = 6
_INDEPENDENT = 4.0  # pixels of a bin of the profile that err independently


def lie_of_the_land(
    sorting: Sorting,
    view: View,
    ground: Ground,
    *,
    gravity: Float64 | None,
    tilt_noise: float,
) -> Terrain:
    """Tell how the ground ahead is inclined.

    Parameters
    ----------
    sorting : Sorting
        Of the whole image, or of a grid of it.
    view : View
        Over `ground`.
    ground : Ground
    gravity : ndarray of float64, shape (3,), or None
        Direction of gravity in optical axes; without it slopes are against the ground under the
        robot: the nearest that is seen.
    tilt_noise : float
        1-sigma of that direction [rad].

    Returns
    -------
    Terrain
        With NaN where too little floor was seen.
    """
    reference = "robot" if gravity is None else "gravity"
    nan = math.nan
    if not ground.seen or np.count_nonzero(ground.knots > ground.followed_to) < _LEAST_KNOTS:
        return Terrain(slope=nan, cross_slope=nan, sigma=nan, roughness=nan, reference=reference)
    turn = np.eye(3) if gravity is None else _level_from_base(view, gravity)
    slopes, doubts = _rises(*_profile_ahead(view, ground, turn), _FROM, _TO)
    slope, sigma = slopes.pop(), doubts.pop()
    tilt_noise = 0.0 if gravity is None else tilt_noise
    bands = [
        SlopeBand(
            start=start,
            end=start + _STEP,
            slope=rise,
            sigma=math.hypot(doubt, ground.sigma_pitch, tilt_noise),
        )
        for start, rise, doubt in zip(_STARTS.tolist(), slopes, doubts, strict=True)
        if doubt < _DOUBTFUL
    ]
    up = float(turn[2, 1])  # of the ground's left, seen from the level frame
    return Terrain(
        slope=slope,
        cross_slope=math.asin(min(max(up, -1.0), 1.0)),
        sigma=math.hypot(sigma, max(ground.sigma_pitch, ground.sigma_roll), tilt_noise),
        roughness=_roughness(sorting, view, ground),
        reference=reference,
        profile=tuple(bands),
    )


def _level_from_base(view: View, gravity: Float64) -> Float64:
    """Return the rotation from the ground's frame into the level frame of the same heading."""
    turn = view.base_from_optical
    rotation: Float64 = base_from_optical(gravity, turn[0]) @ turn.T
    return rotation


def _profile_ahead(view: View, ground: Ground, turn: Float64) -> tuple[Float64, Float64, Float64]:
    """Return the floor's profile straight ahead: x, z in the level frame and 1-sigma of z [m]."""
    followed = ground.knots > ground.followed_to
    level, bend = ground.knots[followed][::-1], ground.bend[followed][::-1]
    p = view.projection
    a, b, c = ground.plane
    u = np.full_like(level, p.cx)
    points = view.points(u, (level - a * u - c) / b, level + bend)
    sigma = ground.knot_noise[followed][::-1] / level * (ground.height / math.sqrt(_INDEPENDENT))
    origin = view.origin[:, None]
    x, _, z = turn @ (points - origin) + origin
    return np.maximum.accumulate(x), z, sigma  # noise may not turn the profile back


def _rises(
    x: Float64, z: Float64, sigma: Float64, start: Float64, end: Float64
) -> tuple[list[float], list[float]]:
    """Return the mean slopes from `start` to `end` and their 1-sigmas [rad]; NaN where not seen.

    A missing third of the way at either end is made up for by the rest.
    """
    slack = (end - start) / 3
    seen = (x[0] <= start + slack) & (x[-1] >= end - slack)
    edges = np.stack([np.maximum(start, x[0]), np.minimum(end, x[-1])])
    run = np.where(seen, edges[1] - edges[0], math.nan)
    height, doubt = np.interp(edges, x, z), np.interp(edges, x, sigma)
    slope = np.arctan2(height[1] - height[0], run)
    return slope.tolist(), (np.hypot(*doubt) / run).tolist()


def _roughness(sorting: Sorting, view: View, ground: Ground) -> float:
    """Return the RMS height of the near floor about its profile [m]; NaN where noise hides it."""
    stride = max(1, int(math.sqrt(sorting.on_floor.size / (2 * _PIXELS))))
    grid = np.s_[::stride, ::stride]
    floor = sorting.floor[grid]
    farthest = view.projection.fx * view.projection.baseline / _BAND[1]
    index = np.flatnonzero(sorting.on_floor[grid] & (floor > farthest))
    if len(index) < _LEAST_PIXELS:
        return math.nan
    d = sorting.disparity[grid].ravel().take(index).astype(np.float64)
    floor = floor.ravel().take(index).astype(np.float64)
    noise = np.interp(floor, ground.knots, ground.knot_noise) / d
    lift = 1 - floor / d
    above = float(lift @ lift - noise @ noise) / len(index)
    return ground.height * math.sqrt(above) if above > 0 else math.nan

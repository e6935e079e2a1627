"""The longitudinal profile of the floor: how it bends, and how noisy its disparity is by level.

The plane's own disparity is constant along lines of equal depth whatever the roll, so it serves
as the coordinate "how far ahead". In narrow bins of it the profile is followed outwards from the
robot by the height at which most pixels of the way lie. It may climb or fall no faster than the
steepest ground that is still a way; at a step (a kerb, a wall, a drop) it ends, and what lies
beyond is judged against the floor before it. The spread of the pixels below it, which nothing
that stands on the floor can disturb, is the noise at that level: matchers are worst far away.
"""

import math
from dataclasses import dataclass

import numpy as np

from bearcub.geometry import Float64, Projection
from bearcub.messages import Float32
from bearcub.robust import median, quantile

_BINS = 44
_FARTHEST = 1.0  # least disparity of the floor that is followed [px]
_PIXELS = 8000
_HALF_WIDTH = 2.0  # of the way ahead [m]
_LEAST = 12  # pixels of a bin
_SHARE = 0.3  # of a bin's pixels that must lie on the profile
_STEP = 0.01  # change of height between neighbouring bins that is no step [m]
_CORRELATED = 12.0  # neighbouring pixels of a matcher that err together
_JUST_AHEAD = 0.62  # share of the nearest level to which the floor just ahead reaches
_BENT = 0.06  # least bend of the floor just ahead that is corrected [px]
_SMALLEST = 0.1  # least noise believed [px]
_LARGEST = 1.5  # largest noise believed [px]


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """The floor's bend and noise by level; arrays of one length, levels ascending.

    Attributes
    ----------
    knots : ndarray of float64, shape (K,)
        Disparity of the plane [px].
    bend : ndarray of float64, shape (K,)
        Disparity of the floor less that of the plane [px].
    noise : ndarray of float64, shape (K,)
        1-sigma of a pixel's disparity [px].
    error : ndarray of float64, shape (K,)
        1-sigma of `bend` [px].
    """

    knots: Float64
    bend: Float64
    noise: Float64
    error: Float64


def follow_floor(
    disparity: Float32,
    projection: Projection,
    plane: Float64,
    *,
    noise: float,
    height: float,
    pitch: float,
    steepest: float,
) -> Profile:
    """Follow the floor outwards from the robot.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px], NaN unmatched.
    projection : Projection
    plane : ndarray of float64, shape (3,)
        The floor just ahead.
    noise : float
        1-sigma of a pixel about that plane [px].
    height, pitch : float
        Of the camera against that plane [m], [rad].
    steepest : float
        Steepest ground that is followed [rad].

    Returns
    -------
    Profile
        Of length 0 where too little floor is seen.
    """
    level, residual, lateral, share = _samples(disparity, projection, plane)
    if len(level) < 10 * _LEAST:
        none = np.zeros(0)
        return Profile(knots=none, bend=none, noise=none, error=none)
    edges = np.geomspace(_FARTHEST, np.percentile(level, 99.5) + 1e-6, _BINS + 1)
    index = np.searchsorted(edges, level) - 1
    order = np.argsort(index, kind="stable")
    starts = np.searchsorted(index[order], np.arange(_BINS + 1))
    centres = np.sqrt(edges[:-1] * edges[1:])
    depth = projection.fx * projection.baseline / math.cos(pitch)
    tracker = _Tracker(height=height, depth=depth, steepest=math.tan(steepest), noise=noise)
    found = []
    for k in range(_BINS - 1, -1, -1):
        here = order[starts[k] : starts[k + 1]]
        if len(here) >= _LEAST:
            bend = tracker.advance(float(centres[k]), residual[here], lateral[here])
            spread = tracker.spread(residual[here] - bend)
            # where little of the floor is seen, what is seen errs together
            error = spread / (share * tracker.share**2) * math.sqrt(_CORRELATED / len(here))
            found.append((centres[k], bend, spread, error))
    knots, bends, noises, errors = np.array(found[::-1]).T
    return Profile(knots=knots, bend=_smooth(bends), noise=_never_better_far(noises), error=errors)


def just_ahead(plane: Float64, profile: Profile) -> tuple[Float64, Profile, Float64]:
    """Turn a plane that compromises between floors into the one just ahead.

    Where the floor bends (a ramp, a kerb) a plane fitted to all of it lies across the bend, and
    the profile climbs and falls about it. The nearest part of the profile is the floor the robot
    stands on: the plane is laid through that, and the profile is told about the new plane.

    Parameters
    ----------
    plane : ndarray of float64, shape (3,)
    profile : Profile
        About `plane`.

    Returns
    -------
    plane : ndarray of float64, shape (3,)
    profile : Profile
        The same floor about the new plane; both unchanged where the floor does not bend.
    covariance : ndarray of float64, shape (3, 3)
        What the correction adds to that of the plane.
    """
    knots, bend = profile.knots, profile.bend
    near = knots > _JUST_AHEAD * knots.max(initial=0.0)
    if np.count_nonzero(near) < 5:
        return plane, profile, np.zeros((3, 3))
    (factor, shift), trend = np.polyfit(
        knots[near], bend[near], 1, w=1 / profile.error[near], cov="unscaled"
    )
    doubt = 3 * float(np.median(profile.error[near])) / math.sqrt(np.count_nonzero(near) / 2)
    if np.abs(factor * knots[near] + shift).max() < max(_BENT, doubt):
        return plane, profile, np.zeros((3, 3))
    by_trend = np.stack([plane, [0.0, 0.0, 1.0]], axis=1)
    level = (1 + factor) * knots + shift
    kept = level > 0
    moved = Profile(
        knots=level[kept],
        bend=(knots + bend - level)[kept],
        noise=profile.noise[kept],
        error=profile.error[kept],
    )
    corrected = (1 + factor) * plane + np.array([0.0, 0.0, shift])
    return corrected, moved, by_trend @ trend @ by_trend.T


def _samples(
    disparity: Float32, projection: Projection, plane: Float64
) -> tuple[Float64, Float64, Float64, float]:
    """Return the plane's disparity, residual and lateral offset [m] on a grid, and its share."""
    rows, columns = disparity.shape
    stride = max(1, int(math.sqrt(rows * columns / (2 * _PIXELS))))
    v = np.arange(stride // 2, rows, stride)
    u = np.arange(stride // 2, columns, stride)
    d = disparity[v[0] :: stride, u[0] :: stride]
    level = plane[1] * v[:, None] + (plane[0] * u + plane[2])[None, :]
    ahead = level > _FARTHEST
    valid = np.isfinite(d) & ahead
    share = max(1, int(np.sum(valid))) / max(1, int(np.sum(ahead)))
    lateral = np.broadcast_to((u - projection.cx)[None, :], d.shape)[valid]
    level = level[valid]
    return level, d[valid] - level, lateral * projection.baseline / level, share


class _Tracker:
    """Where the profile is while it is followed outwards."""

    def __init__(self, *, height: float, depth: float, steepest: float, noise: float) -> None:
        self._height = height
        self._depth = depth
        self._steepest = steepest
        self._noise = noise
        self._tail = noise
        self._lift = 0.0  # height of the profile above the plane [m]
        self._x: float | None = None
        self._ended = False
        self.share = 1.0  # of the last bin's pixels that lay on the profile

    def advance(self, level: float, residual: Float64, lateral: Float64) -> float:
        """Move on to the next bin and return the floor's disparity there less the plane's [px]."""
        expected = self._bend(level, self._lift)
        if self._ended:
            return expected
        way = residual[np.abs(lateral) < _HALF_WIDTH]
        if len(way) < _LEAST:
            way = residual
        x = self._depth / (level + expected)
        run = 0.0 if self._x is None else max(0.0, x - self._x)
        rise = self._steepest * run
        reach = 3.0 * self._noise
        low = self._bend(level, self._lift - rise) - reach
        high = self._bend(level, self._lift + rise) + reach
        on = way[(way > low) & (way < high)]
        self.share = max(0.1, len(on) / len(way))
        if len(on) < max(_LEAST // 2, _SHARE * len(way)):
            self._ended = self._ended or self._stepped(way, low, high)
            return expected
        middle = median(on)
        spread = 1.4826 * median(np.abs(on - middle))
        lift = self._height * middle / max(level + middle, 0.1)
        there = self._depth / max(level + middle, 0.1)
        doubt = 2.0 * self._height * spread / level * math.sqrt(_CORRELATED / len(on))
        if self._x is not None:
            climb = self._steepest * max(0.0, there - self._x) + doubt + _STEP
            if abs(lift - self._lift) > climb:
                self._ended = True
                return expected
        self._noise = 0.7 * self._noise + 0.3 * min(max(spread, _SMALLEST), _LARGEST)
        self._lift = lift
        self._x = there
        return self._bend(level, lift)

    def _stepped(self, way: Float64, low: float, high: float) -> bool:
        """Tell whether most of the way has left the floor, to one side."""
        most = (1 - _SHARE) * len(way)
        return bool(np.sum(way >= high) > most or np.sum(way <= low) > most)

    def _bend(self, level: float, lift: float) -> float:
        """Return the extra disparity [px] of ground that lies `lift` above the plane."""
        return level * lift / max(self._height - lift, 0.05 * self._height)

    def spread(self, residual: Float64) -> float:
        """Return the noise told by the pixels below the floor [px]; the last one when few do."""
        if self._ended:  # what lies below is another floor, not noise
            return self._tail
        below = -residual[(residual < 0) & (residual > -3 * _LARGEST)]
        if len(below) >= max(_LEAST // 2, 0.1 * len(residual)):
            tail = quantile(below, 0.95) / 1.96  # matchers' errors have heavy tails
            self._tail = min(max(tail, _SMALLEST), _LARGEST)
        return self._tail


def _never_better_far(noises: Float64) -> Float64:
    """Hold near noise down to what is seen farther away, where a matcher is no better.

    A hole lies below the floor as noise does; unlike noise it is there in few bins only.
    """
    padded = np.pad(noises, 3, mode="edge")
    typical = np.median(np.lib.stride_tricks.sliding_window_view(padded, 7), axis=1)
    return np.minimum(_smooth(noises), 1.5 * np.minimum.accumulate(typical))


def _smooth(values: Float64) -> Float64:
    """Average each value with its neighbours, the ends kept."""
    if len(values) < 3:
        return values
    inner = 0.25 * values[:-2] + 0.5 * values[1:-1] + 0.25 * values[2:]
    return np.concatenate([values[:1], inner, values[-1:]])

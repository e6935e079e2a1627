"""The longitudinal profile of the floor: how it bends, and how noisy its disparity is by level.

The plane's own disparity is constant along lines of equal depth whatever the roll, so it serves
as the coordinate "how far ahead". In narrow bins of it the profile is followed outwards from the
robot by the height at which most pixels of the way lie. It may climb or fall no faster than the
steepest ground that is still a way; at a step (a kerb, a wall, a drop) it ends, and what lies
beyond is judged against the floor before it. The spread of the pixels below it, which nothing
that stands on the floor can disturb, is the noise at that level: matchers are worst far away.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64, Projection
from bearcub.messages import Float32
from bearcub.robust import median, quantile

_KNEE = 8.0  # level from which on bins are narrow [px]
_NEAR_BIN, _FAR_BIN = 1.05, 1.12  # ratio of the levels that bound a bin
_NEAR_BINS = 40  # most of the narrow ones
_APART = 256.0  # of the bins in a key that sorts by bin, then residual: more than any residual [px]
_IQR = 0.7413  # 1-sigma over the interquartile range of a normal distribution
_FARTHEST = 1.0  # least disparity of the floor that is followed [px]
_ROWS, _COLUMNS = 160, 64  # of the image that are looked at: far levels lie in few rows
_HALF_WIDTH = 2.0  # of the way ahead [m]
_LEAST = 12  # pixels of a bin
_SHARE = 0.25  # of a bin's pixels that must lie on the profile
_STEP = 0.01  # change of height between neighbouring bins that is no step [m]
_CORRELATED = 12.0  # neighbouring pixels of a matcher that err together
_JUST_AHEAD = 0.62  # share of the nearest level to which the floor just ahead reaches
_BENT = 0.06  # least bend of the floor just ahead that is corrected [px]
_DEEP = 7.0  # times the noise below the floor, where noise does not reach
_AGAIN = 3  # bins on one level beyond a step up that are ground again
_HIGHEST_STEP = 0.5  # of the camera's height
_MIXED = 2.5  # spread of several surfaces, over the noise of one
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
    step : float
        Level of the nearest step up to other ground [px]; 0 where there is none.
    end : float
        Level to which the floor was followed [px]; 0 where nothing ended it.
    """

    knots: Float64
    bend: Float64
    noise: Float64
    error: Float64
    step: float = 0.0
    end: float = 0.0


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
    edges = _edges(quantile(level, 0.995) + 1e-6)
    index = np.searchsorted(edges, level) - 1
    bins = _sorted_bins(index[::2], residual[::2], len(edges) - 1)
    way = np.abs(lateral) < _HALF_WIDTH
    ways = _sorted_bins(index[way], residual[way], len(edges) - 1)
    centres = np.sqrt(edges[:-1] * edges[1:]).tolist()
    depth = projection.fx * projection.baseline / math.cos(pitch)
    tracker = _Tracker(height=height, depth=depth, steepest=math.tan(steepest), noise=noise)
    found: list[list[float]] = []
    end = 0.0
    parts = [0]  # where ground begins again beyond a step
    for centre, here, ahead in zip(reversed(centres), reversed(bins), reversed(ways), strict=True):
        if len(here) >= _LEAST:
            bend = tracker.advance(centre, ahead if len(ahead) >= _LEAST else here)
            spread = tracker.spread(here, bend)
            # where little of the floor is seen, what is seen errs together
            error = spread / (share * tracker.share**2) * math.sqrt(_CORRELATED / len(here))
            found.append([centre, bend, spread, error])
            if tracker.regained:
                parts.append(len(found) - tracker.regained)
                for entry in found[parts[-1] :]:
                    entry[1:3] = [tracker.bend_at(entry[0]), spread]
                tracker.regained = 0
            end = (end or centre) if tracker.ended else 0.0
    knots, bends, noises, errors = np.array(found).T
    pieces = [_smooth(bends[a:b]) for a, b in pairwise([*parts, len(bends)])]
    return Profile(
        knots=knots[::-1],
        bend=np.concatenate(pieces)[::-1],
        noise=_never_better_far(noises[::-1]),
        error=errors[::-1],
        step=float(knots[parts[1]]) if len(parts) > 1 else 0.0,
        end=end,
    )


def _edges(nearest: float) -> Float64:
    """Return the edges of the bins [px], ascending: narrow near ahead, where steps are seen."""
    knee = min(_KNEE, nearest / _FAR_BIN)
    to_knee, beyond = math.log(knee / _FARTHEST), math.log(nearest / knee)
    near = min(max(int(beyond / math.log(_NEAR_BIN)), 4), _NEAR_BINS)
    far = max(1, round(to_knee / math.log(_FAR_BIN)))
    growth = np.empty(far + near + 1)
    growth[:far] = np.arange(far) * (to_knee / far)
    growth[far:] = to_knee + np.arange(near + 1) * (beyond / near)
    edges: Float64 = _FARTHEST * np.exp(growth)
    return edges


def _sorted_bins(index: NDArray[np.int64], residual: Float64, count: int) -> list[list[float]]:
    """Return the residuals of every bin in ascending order.

    What follows takes a few ranks and counts of each short list: as lists, by bisection, that is
    many times faster than as arrays.
    """
    limit = 0.5 * _APART
    keys = index * _APART + np.minimum(np.maximum(residual, -0.99 * limit), 0.99 * limit)
    keys.sort()
    ends = np.searchsorted(keys, np.arange(count + 1) * _APART - limit).tolist()
    values = (keys - np.rint(keys / _APART) * _APART).tolist()
    return [values[first:last] for first, last in pairwise(ends)]


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
    near = knots > max(_JUST_AHEAD * knots.max(initial=0.0), profile.step)
    if np.count_nonzero(near) < 5:
        return plane, profile, np.zeros((3, 3))
    factor, shift, trend = _line(knots[near], bend[near], profile.error[near])
    doubt = 3 * median(profile.error[near]) / math.sqrt(np.count_nonzero(near) / 2)
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
        step=profile.step,
        end=profile.end,
    )
    corrected = (1 + factor) * plane + np.array([0.0, 0.0, shift])
    return corrected, moved, by_trend @ trend @ by_trend.T


def _line(x: Float64, y: Float64, sigma: Float64) -> tuple[float, float, Float64]:
    """Fit ``y = factor x + shift``; return both and their covariance, shape (2, 2)."""
    weighted = np.stack([x, np.ones_like(x)]) / sigma
    covariance = np.asarray(np.linalg.inv(weighted @ weighted.T), dtype=np.float64)
    factor, shift = covariance @ (weighted @ (y / sigma))
    return float(factor), float(shift), covariance


def _samples(
    disparity: Float32, projection: Projection, plane: Float64
) -> tuple[Float64, Float64, Float64, float]:
    """Return the plane's disparity, residual and lateral offset [m] on a grid, and its share."""
    rows, columns = disparity.shape
    down, right = max(1, rows // _ROWS), max(1, columns // _COLUMNS)
    v = np.arange(down // 2, rows, down)
    u = np.arange(right // 2, columns, right)
    d = disparity[v[0] :: down, u[0] :: right]
    level = plane[1] * v[:, None] + (plane[0] * u + plane[2])[None, :]
    ahead = level > _FARTHEST
    index = np.flatnonzero(np.isfinite(d) & ahead)
    share = max(1, len(index)) / max(1, int(np.count_nonzero(ahead)))
    lateral = (u - projection.cx)[index % len(u)] * projection.baseline
    level = level.ravel()[index]
    return level, d.ravel()[index] - level, lateral / level, share


class _Tracker:
    """Where the profile is while it is followed outwards.

    Residuals are lists in ascending order.
    """

    def __init__(self, *, height: float, depth: float, steepest: float, noise: float) -> None:
        self._height = height
        self._depth = depth
        self._steepest = steepest
        self._noise = noise
        self._tail = noise
        self._lift = 0.0  # height of the profile above the plane [m]
        self._x: float | None = None
        self.ended = False
        self._upper: list[tuple[float, float]] = []  # height and range of ground beyond a step up
        self.share = 1.0  # of the last bin's pixels that lay on the profile
        self.regained = 0  # bins that turned out to be ground beyond a step, the last one included

    def advance(self, level: float, way: Sequence[float]) -> float:
        """Move on to the next bin and return the floor's disparity there less the plane's [px]."""
        expected = self.bend_at(level)
        if self.ended:
            self._look_beyond(level, way)
            return self.bend_at(level)
        x = self._depth / (level + expected)
        run = 0.0 if self._x is None else max(0.0, x - self._x)
        rise = self._steepest * run
        reach = 3.0 * self._noise
        least = max(_LEAST // 2, _SHARE * len(way))
        # what goes on as before is the floor, however much stands beside it
        first, last = _between(way, expected - reach, expected + reach)
        if last - first < least:
            low = self._bend(level, self._lift - rise) - reach
            high = self._bend(level, self._lift + rise) + reach
            first, last = _between(way, low, high)
            if last - first < least:
                # a step takes most of the way off the floor, to one side
                most = (1 - _SHARE) * len(way)
                self.ended = (
                    bisect_left(way, high) < len(way) - most or bisect_right(way, low) > most
                )
                self.share = max(0.1, (last - first) / len(way))
                return expected
        for _ in range(2):  # to the middle of that surface
            middle = way[(first + last) // 2]
            first, last = _between(way, middle - reach, middle + reach)
        count = last - first
        self.share = max(0.1, count / len(way))
        middle = way[(first + last) // 2]
        spread = _spread(way, first, last)
        lift, there = self._place(level, middle)
        # a spread far beyond the noise so far is of several surfaces, and excuses no climb
        noise = min(spread, 1.5 * self._noise)
        doubt = self._height * noise / level * math.sqrt(_CORRELATED / count)
        change = lift - self._lift
        if self._x is not None:
            climb = self._steepest * max(0.0, there - self._x) + 2 * doubt + _STEP
            if abs(change) > climb:
                self.ended = True
                return expected
            # what a few far pixels say is weighed against how much ground changes over the bin
            change *= 1 / (1 + (doubt / (0.5 * (rise + _STEP))) ** 2)
        self._noise = 0.7 * self._noise + 0.3 * min(max(spread, _SMALLEST), _LARGEST)
        self._lift += change
        self._x = there if self._x is None else max(self._x, there)
        return self.bend_at(level)

    def _look_beyond(self, level: float, way: Sequence[float]) -> None:
        """Go on where the way lies on one level again beyond a step up: stairs, a pavement."""
        lift, there = self._place(level, way[len(way) // 2])
        last_lift, last_there = self._upper[-1] if self._upper else (lift, 0.0)
        doubt = 2 * self._height * self._noise / level * math.sqrt(_CORRELATED / len(way))
        above = self._lift + _STEP < lift < _HIGHEST_STEP * self._height
        if not above or _spread(way, 0, len(way)) > _MIXED * self._noise:
            self._upper = []
        elif abs(lift - last_lift) <= doubt + _STEP and there > last_there:
            self._upper.append((lift, there))
        else:
            self._upper = [(lift, there)]
        if len(self._upper) >= _AGAIN:
            self.regained = len(self._upper)
            self._lift = sum(lift for lift, _ in self._upper) / self.regained
            self._x, self._upper, self.ended = there, [], False

    def _place(self, level: float, bend: float) -> tuple[float, float]:
        """Return the height above the plane and the range [m] of ground with this bend."""
        disparity = max(level + bend, 0.1)
        return self._height * bend / disparity, self._depth / disparity

    def bend_at(self, level: float) -> float:
        """Return the floor's disparity less the plane's [px]."""
        return self._bend(level, self._lift)

    def _bend(self, level: float, lift: float) -> float:
        """Return the extra disparity [px] of ground that lies `lift` above the plane."""
        return level * lift / max(self._height - lift, 0.05 * self._height)

    def spread(self, here: Sequence[float], bend: float) -> float:
        """Return the noise told by the pixels below the floor [px]; the last one when few do."""
        if self.ended:  # what lies below is another floor, not noise
            return self._tail
        # what lies many times the noise lower is a hole
        lowest = bend - min(max(_DEEP * self._noise, 1.0), 3 * _LARGEST)
        first, last = bisect_right(here, lowest), bisect_left(here, bend)
        if last - first >= max(_LEAST // 2, 0.1 * len(here)):
            # matchers' errors have heavy tails
            tail = (bend - here[first + int(0.05 * (last - first - 1) + 0.5)]) / 1.96
            self._tail = min(max(tail, _SMALLEST), _LARGEST)
        return self._tail


def _between(values: Sequence[float], low: float, high: float) -> tuple[int, int]:
    """Return the first, and beyond the last, of the values in ascending order between two."""
    return bisect_right(values, low), bisect_left(values, high)


def _spread(values: Sequence[float], first: int, last: int) -> float:
    """Return a robust 1-sigma of some of the values in ascending order."""
    count = last - first
    return _IQR * (values[first + 3 * count // 4] - values[first + count // 4])


def _never_better_far(noises: Float64) -> Float64:
    """Hold near noise down to what is seen farther away, where a matcher is no better.

    A hole lies below the floor as noise does; unlike noise it is there in few bins only.
    """
    around = np.arange(-3, 4)[:, None] + np.arange(len(noises))[None, :]
    typical = np.sort(noises.take(around, mode="clip"), axis=0)[3]
    return np.minimum(_smooth(noises), 1.5 * np.minimum.accumulate(typical))


def _smooth(values: Float64) -> Float64:
    """Average each value with its neighbours, the ends kept."""
    if len(values) < 3:
        return values
    inner = 0.25 * values[:-2] + 0.5 * values[1:-1] + 0.25 * values[2:]
    return np.concatenate([values[:1], inner, values[-1:]])

"""The longitudinal profile of the floor: how it bends, and how noisy its disparity is by level.

The plane's own disparity is constant along lines of equal depth whatever the roll, so it serves
as the coordinate "how far ahead". In narrow bins of it the profile is followed outwards from the
robot by the height at which most pixels of the way lie. It may climb or fall no faster than the
steepest ground that is still a way; at a step (a kerb, a wall, a drop) it ends, and what lies
beyond is judged against the floor before it. Only pixels whose disparity grows with the row, as
that of ground does, tell where it lies: in the dark a matcher finds the things far away, and
little of the floor around them. The spread of the pixels below it, which nothing that stands on
the floor can disturb, is the noise at that level: matchers are worst far away.
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64, Projection
from bearcub.ground import tracker as following
from bearcub.ground.tracker import CORRELATED, LEAST, Tracker
from bearcub.messages import Bool, Float32
from bearcub.robust import median, quantile
from bearcub.stereo.native import COMPILED, core

_KNEE = 8.0  # level from which on bins are narrow [px]
_NEAR_BIN, _FAR_BIN = 1.05, 1.12  # ratio of the levels that bound a bin
_NEAR_BINS = 40  # most of the narrow ones
_APART, _MOST = 256.0, 126.0  # of the bins in a key that sorts by bin, then residual; and most of
# that [px]
_FARTHEST = 1.0  # least disparity of the floor that is followed [px]
_ROWS, _COLUMNS = 160, 64  # of the image that are looked at: far levels lie in few rows
_REACH = 40  # part of the rows over which a pixel's disparity must grow to either side
_HALF_WIDTH = 2.0  # of the way ahead [m]
_JUST_AHEAD = 0.62  # share of the nearest level to which the floor just ahead reaches
_BENT = 0.06  # least bend of the floor just ahead that is corrected [px]


Index = NDArray[np.int64]


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
    compiled: bool = COMPILED,
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
    compiled : bool
        By the native core, ``native/src/profile.cpp``; else by NumPy.

    Returns
    -------
    Profile
        Of length 0 where too little floor is seen.
    """
    start = _Start(
        plane=plane, noise=noise, height=height, pitch=pitch, steepest=math.tan(steepest)
    )
    follow = _compiled if compiled else _in_numpy
    return follow(disparity, projection, start).profile()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Start:
    """What is known of the floor before it is followed; `steepest` is a tangent."""

    plane: Float64
    noise: float
    height: float
    pitch: float
    steepest: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Followed:
    """Level, bend, noise and error of the bins in which floor was followed, outwards.

    `parts` are the first bins of every piece of ground, which steps part; `end` is the level to
    which it was followed, 0 where nothing ended it.
    """

    bins: Sequence[Sequence[float]]
    parts: list[int]
    end: float

    def profile(self) -> Profile:
        """Return what was found as a profile, its bend and noise smoothed."""
        if not self.bins:
            none = np.zeros(0)
            return Profile(knots=none, bend=none, noise=none, error=none)
        knots, bends, noises, errors = np.array(self.bins).T
        pieces = [_smooth(bends[a:b]) for a, b in pairwise([*self.parts, len(bends)])]
        return Profile(
            knots=knots[::-1],
            bend=np.concatenate(pieces)[::-1],
            noise=_never_better_far(noises[::-1]),
            error=errors[::-1],
            step=float(knots[self.parts[1]]) if len(self.parts) > 1 else 0.0,
            end=self.end,
        )


def _compiled(disparity: Float32, projection: Projection, start: _Start) -> _Followed:
    bins, parts, end = core.follow_floor(
        disparity,
        projection.numbers,
        start.plane.tolist(),
        start.noise,
        start.height,
        start.pitch,
        start.steepest,
        _tuning(),
    )
    return _Followed(bins=bins, parts=parts, end=end)


@cache
def _tuning() -> Any:
    return core.ProfileTuning(
        knee=_KNEE,
        near_bin=_NEAR_BIN,
        far_bin=_FAR_BIN,
        near_bins=_NEAR_BINS,
        iqr=following.IQR,
        farthest=_FARTHEST,
        rows=_ROWS,
        columns=_COLUMNS,
        reach=_REACH,
        half_width=_HALF_WIDTH,
        least=LEAST,
        share=following.SHARE,
        step=following.STEP,
        correlated=CORRELATED,
        deep=following.DEEP,
        again=following.AGAIN,
        highest_step=following.HIGHEST_STEP,
        mixed=following.MIXED,
        smallest=following.SMALLEST,
        largest=following.LARGEST,
        noisiest=following.NOISIEST,
        rounding=following.ROUNDING,
        most=_MOST,
    )


def _in_numpy(disparity: Float32, projection: Projection, start: _Start) -> _Followed:
    depth = projection.fx * projection.baseline / math.cos(start.pitch)
    level, residual, way, lies, share = _samples(disparity, projection, start, depth)
    found: list[list[float]] = []
    end = 0.0
    parts = [0]  # where ground begins again beyond a step
    if len(level) < 10 * LEAST:
        return _Followed(bins=found, parts=parts, end=end)
    edges = _edges(quantile(level, 0.995) + 1e-6)
    index = np.searchsorted(edges, level) - 1
    count = len(edges) - 1
    half = np.arange(0, len(index), 2)
    here, ahead, lying_ahead = (
        _Bins(index.take(which), residual.take(which), count)
        for which in (half, way, way[lies.take(way)])
    )
    # where the way shows too little, all that is seen has to tell
    few = np.diff(ahead.ends) < LEAST
    half = half[lies.take(half) & few.take(index.take(half), mode="clip")]
    lying = _Bins(index.take(half), residual.take(half), count)
    centres = np.sqrt(edges[:-1] * edges[1:]).tolist()
    tracker = Tracker(
        height=start.height,
        depth=depth,
        steepest=start.steepest,
        noise=start.noise,
    )
    for number in np.flatnonzero(np.diff(here.ends) >= LEAST)[::-1].tolist():
        centre, pixels = centres[number], here[number]
        seen = (pixels, lying[number]) if few[number] else (ahead[number], lying_ahead[number])
        bend = tracker.advance(centre, *seen)
        spread = tracker.spread(pixels, bend)
        # where little of the floor is seen, what is seen errs together
        error = spread / (share * tracker.share**2) * math.sqrt(CORRELATED / len(pixels))
        found.append([centre, bend, spread, error])
        if tracker.regained:
            parts.append(len(found) - tracker.regained)
            for entry in found[parts[-1] :]:
                entry[1:3] = [tracker.bend_at(entry[0]), spread]
            tracker.regained = 0
        if tracker.refused:
            bank = found[-tracker.refused :]
            for entry in bank:
                entry[1] = tracker.bend_at(entry[0])
            end, tracker.refused = bank[0][0], 0
        end = (end or centre) if tracker.ended else 0.0
    return _Followed(bins=found, parts=parts, end=end)


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


class _Bins:
    """The residuals of every bin in ascending order.

    What follows takes a few ranks and counts of each short one: by bisection of Python's own
    arrays that is many times faster than of NumPy's.
    """

    def __init__(self, index: Index, residual: Float64, count: int) -> None:
        keys = index * _APART + np.minimum(np.maximum(residual, -_MOST), _MOST)
        keys.sort()
        self.ends = np.searchsorted(keys, np.arange(count + 1) * _APART - 0.5 * _APART)
        self._bounds = self.ends.tolist()
        self._values = array("d", (keys - np.rint(keys / _APART) * _APART).tobytes())

    def __getitem__(self, number: int) -> Sequence[float]:
        first, last = self._bounds[number : number + 2]
        return self._values[first:last]


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
    one = 1 / sigma
    x, y = x * one, y * one
    xx, x1, n = float(x @ x), float(x @ one), float(one @ one)
    covariance: Float64 = np.array([[n, -x1], [-x1, xx]]) / (xx * n - x1 * x1)
    factor, shift = (covariance @ (x @ y, one @ y)).tolist()
    return factor, shift, covariance


def _samples(
    disparity: Float32, projection: Projection, start: _Start, depth: float
) -> tuple[Float64, Float64, Index, Bool, float]:
    """Return the plane's disparity and residual on a grid, which are of the way, and its share.

    The fourth value tells which pixels lie as ground does; `depth` is that at a pixel [m px].
    """
    plane = start.plane
    rows, columns = disparity.shape
    down, right = max(1, rows // _ROWS), max(1, columns // _COLUMNS)
    v = np.arange(down // 2, rows, down)
    u = np.arange(right // 2, columns, right)
    reach = max(4, rows // _REACH)
    every = math.gcd(down, reach)  # in no other row is anything looked at
    looked_at = np.ascontiguousarray(disparity[v[0] % every :: every, u[0] :: right])
    d = looked_at[v[0] // every :: down // every]
    level = plane[1] * v[:, None] + (plane[0] * u + plane[2])[None, :]
    ahead = level > _FARTHEST
    index = np.flatnonzero(np.isfinite(d) & ahead)
    share = max(1, len(index)) / max(1, int(np.count_nonzero(ahead)))
    lateral = np.abs(u - projection.cx) * (projection.baseline / _HALF_WIDTH)
    way = np.flatnonzero((lateral < level).ravel().take(index))
    level = level.ravel().take(index)
    about = _grown(looked_at, v // every, reach // every)
    grown, over = (each.ravel().take(index) for each in about)
    over *= every
    # the steepest ground that comes into view there
    rate = plane[1] * start.height * math.hypot(1.0, start.steepest)
    lies = grown * (start.height * level + start.steepest * depth) > over * rate * level
    return level, d.ravel().take(index) - level, way, lies, share


def _grown(columns: Float32, v: Index, reach: int) -> tuple[Float32, Index]:
    """Return by how much disparity grows about each pixel [px], and over how many rows.

    From a neighbour above to one below, or where one of these is unmatched between two on the
    other side: its own disparity has no say, or what errs to the far side would seem to grow.
    """
    rows = v + reach * np.array([-2, -1, 1, 2])[:, None]
    around = columns.take(rows, axis=0, mode="clip")
    around[(rows < 0) | (rows >= len(columns))] = np.nan
    highest, upper, lower, lowest = around
    grown = lower - upper
    both = np.isfinite(grown)
    one_side = np.where(np.isfinite(upper), upper - highest, lowest - lower)
    return np.where(both, grown, one_side), (both + 1) * reach


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

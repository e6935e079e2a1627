"""A robust fit of the floor's plane ``d = a u + b v + c`` to a disparity map.

Seeded random triples of pixels that can be floor propose planes; the plane that most pixels
support, few lie below and the prior does not contradict is refined by iteratively re-weighted
least squares [1]_. The floor is the lowest surface in view, so pixels below a plane count
against it: that keeps table tops, bonnets and walls from being taken for the floor.

References
----------
.. [1] M. A. Fischler, R. C. Bolles: "Random sample consensus", CACM 1981; P. J. Huber: "Robust
   Statistics", 1981 (Tukey's biweight).
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from bearcub.geometry import Float64, Projection, down_vector, inverse
from bearcub.ground.prior import Prior
from bearcub.messages import Bool, Float32
from bearcub.robust import quantile
from bearcub.stereo.native import COMPILED, core

_TRIPLES, _SEED = 200, 0  # the same map gives the same floor
_INCLINED = np.radians([-6.0, -3.0, 0.0, 3.0, 6.0])  # pitch and roll about the expected ones
_PITCHED, _ROLLED = (turn.ravel() for turn in np.meshgrid(_INCLINED, _INCLINED, indexing="ij"))
_SCORED = 700  # pixels a proposal is scored on
_FINALISTS = 16  # proposals that are scored on all of these
_REFINED = 4200  # pixels the refinement uses
_ANNEAL = 0.5  # assumed noise of the refinement's first step [px]
_STEPS, _MOST_STEPS = 3, 8  # of the refinement
_SETTLED = 0.02  # change of the floor that needs no further step [px] ...
_FEW = 50  # ... looked at on every so many pixels
_NOISE = (0.1, 0.6)  # least and largest noise of a pixel that the refinement believes [px]
_REMOTE = 0.15  # loss of a plane one sigma from the prior, as a share of its score
_BELOW = 0.5  # what a pixel below the plane costs, in supporting pixels
_NEAR = 0.3  # the floor just ahead reaches to this share of its nearest level
_WHOLE = 0.8  # of that share, in which the refinement may find it
_HALF_WIDTH = 3.0  # of the way just ahead [m]; ground further aside counts less
_CLOSE = 0.5  # pixels farther than this share of the nearest level count less
_BIWEIGHT = 3.5  # Tukey's constant in sigmas
_CORRELATED = 140.0  # neighbouring pixels of a matcher that err together: windows of 9 px, smoothed
_LOCKING = 0.05  # bias of sub-pixel matching [px], hardware-independent (pixel locking)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gates:
    """How far from the prior a floor may lie: factor on the height, angles [rad]."""

    height: float
    pitch: float
    roll: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaneFit:
    """A fitted floor.

    Attributes
    ----------
    plane : ndarray of float64, shape (3,)
    covariance : ndarray of float64, shape (3, 3)
    noise : float
        Robust 1-sigma of a pixel about the plane [px].
    support : float
        Share of the pixels just ahead and not above the plane that lie on it.
    count : int
        Pixels of the image on the plane.
    """

    plane: Float64
    covariance: Float64
    noise: float
    support: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Refined:
    """A refined plane and what its uncertainty follows from.

    `normal` is the matrix of its equations, shape (3, 3); `here`, `on` and `above` are how many
    pixels of the grid, of every `stride`-th column and row, lie just ahead, on it and above it.
    """

    plane: Float64
    noise: float
    normal: Float64
    here: int
    on: int
    above: int
    stride: int

    def summary(self) -> PlaneFit:
        """Return the fit with its covariance."""
        each = max(1.0, _CORRELATED / self.stride**2)
        covariance: Float64 = each * inverse(self.normal)
        covariance[2, 2] += _LOCKING**2
        return PlaneFit(
            plane=self.plane,
            covariance=covariance,
            noise=self.noise,
            support=self.on / max(1, self.here - self.above),
            count=self.on * self.stride**2,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pixels:
    """A grid of measured pixels.

    The rows of `uv1d`, shape (4, N), are their homogeneous coordinates and disparities; `aside`
    weighs how near the line of sight ahead they lie; `area` is that of the grid.
    """

    uv1d: Float64
    aside: Float64
    floorlike: Bool
    stride: int
    area: float

    @property
    def uv1(self) -> Float64:
        """The first three rows."""
        return self.uv1d[:3]

    @property
    def d(self) -> Float64:
        """The last one."""
        d: Float64 = self.uv1d[3]
        return d


def fit_plane(
    disparity: Float32,
    projection: Projection,
    prior: Prior,
    gates: Gates,
    *,
    unevenness: float,
    compiled: bool = COMPILED,
) -> PlaneFit | None:
    """Fit the floor to a disparity map.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Adjusted [px], NaN unmatched.
    projection : Projection
    prior : Prior
        Where to look first.
    gates : Gates
        Where to look at all.
    unevenness : float
        Height of bumps that are still floor [m].
    compiled : bool
        By the native core, ``native/src/fit.cpp``; else by NumPy.

    Returns
    -------
    PlaneFit or None
        None when no plane within the gates finds support.
    """
    find = _compiled if compiled else _in_numpy
    refined = find(disparity, projection, prior, gates, unevenness)
    return None if refined is None else refined.summary()


def _in_numpy(
    disparity: Float32, projection: Projection, prior: Prior, gates: Gates, unevenness: float
) -> _Refined | None:
    pixels = _sample(disparity, projection, prior)
    if len(pixels.d) < 50:
        return None
    planes = np.concatenate([_prior_planes(projection, prior), _triples(pixels)])
    allowed, remoteness = _within(planes, projection, prior, gates)
    planes = planes[allowed]
    if len(planes) == 0:
        return None
    bump = unevenness / prior.height
    best, score = _best(pixels, planes, 1.0 / (1.0 + _REMOTE * remoteness[allowed]), bump)
    if score <= 0:
        return None
    height, _ = projection.floor(best)
    return _refine(pixels, best, projection, prior, gates, unevenness / height)


def _compiled(
    disparity: Float32, projection: Projection, prior: Prior, gates: Gates, unevenness: float
) -> _Refined | None:
    sigma = prior.sigma.tolist()
    expected = (
        prior.height,
        prior.pitch,
        prior.roll,
        *sigma,
        gates.height,
        gates.pitch,
        gates.roll,
    )
    found = core.fit_plane(disparity, projection.numbers, expected, unevenness, _tuning())
    if found is None:
        return None
    plane, noise, normal, here, on, above, stride = found
    return _Refined(
        plane=np.array(plane),
        noise=noise,
        normal=np.array(normal),
        here=here,
        on=on,
        above=above,
        stride=stride,
    )


@cache
def _tuning() -> Any:
    return core.FitTuning(
        draws=_draws().ravel().tolist(),
        steps=_INCLINED.tolist(),
        scored=_SCORED,
        finalists=_FINALISTS,
        refined=_REFINED,
        anneal=_ANNEAL,
        least_steps=_STEPS,
        most_steps=_MOST_STEPS,
        settled=_SETTLED,
        few=_FEW,
        least_noise=_NOISE[0],
        most_noise=_NOISE[1],
        remote=_REMOTE,
        below=_BELOW,
        near=_NEAR,
        whole=_WHOLE,
        half_width=_HALF_WIDTH,
        close=_CLOSE,
        biweight=_BIWEIGHT,
    )


def _sample(disparity: Float32, projection: Projection, prior: Prior) -> _Pixels:
    """Take a regular grid of measured pixels; note which climb with the row as a floor does."""
    rows, columns = disparity.shape
    stride = max(1, int(np.sqrt(rows * columns / _REFINED)))
    reach = max(4, rows // 40)
    first, last = stride // 2, rows - reach
    d = disparity[reach:last:stride, first::stride]
    lower, upper = disparity[2 * reach :: stride, first::stride], disparity[::stride, first::stride]
    climb = (lower[: len(d)] - upper[: len(d)]) * np.float32(0.5 / reach)
    expected = projection.baseline / prior.height
    floorlike = (climb > 0.3 * expected) & (climb < 3.0 * expected)
    index = np.flatnonzero(d > 0)  # NaN compares false
    v = index // d.shape[1]
    u = index - v * d.shape[1]  # numpy.divmod takes twice as long
    uv1d = np.empty((4, len(index)))
    uv1d[0], uv1d[1], uv1d[2] = u * stride + first, v * stride + reach, 1.0
    uv1d[3] = d.ravel().take(index)
    return _Pixels(
        uv1d=uv1d,
        aside=_aside(uv1d, projection),
        floorlike=floorlike.ravel().take(index),
        stride=stride,
        area=float(d.size * stride**2),
    )


def _aside(uv1d: Float64, projection: Projection) -> Float64:
    """Weigh pixels by how far aside they lie: the verge of a way is not its floor."""
    lateral = (uv1d[0] - projection.cx) * (projection.baseline / _HALF_WIDTH) / uv1d[3]
    weight: Float64 = 1.0 / (1.0 + lateral * lateral)
    return weight


def _prior_planes(projection: Projection, prior: Prior) -> Float64:
    """Return the prior's plane and some inclined about it, for floors too rough for triples."""
    down = down_vector(roll=prior.roll + _ROLLED, pitch=prior.pitch + _PITCHED)
    return projection.plane(height=prior.height, down=down).T


@cache
def _draws() -> Float64:
    """Return random numbers from 0 to 1, shape (3, triples)."""
    return np.random.default_rng(_SEED).random((3, _TRIPLES))


def _triples(pixels: _Pixels) -> Float64:
    """Propose planes through random triples of floor-like pixels, shape (N, 3)."""
    candidates = np.flatnonzero(pixels.floorlike)
    if len(candidates) < 30:
        return np.zeros((0, 3))
    pick = candidates[(_draws() * len(candidates)).astype(np.int64)]
    u, v, _, d = pixels.uv1d[:, pick]
    (u1, u2), (v1, v2), (d1, d2) = u[1:] - u[0], v[1:] - v[0], d[1:] - d[0]
    area = u1 * v2 - u2 * v1
    wide = np.abs(area) > 0.02 * pixels.area
    area = np.where(wide, area, 1.0)
    a, b = (d1 * v2 - d2 * v1) / area, (u1 * d2 - u2 * d1) / area
    planes: Float64 = np.stack([a, b, d[0] - a * u[0] - b * v[0]])[:, wide].T
    return planes


def _within(
    planes: Float64, projection: Projection, prior: Prior, gates: Gates
) -> tuple["np.ndarray[tuple[int], np.dtype[np.bool_]]", Float64]:
    """Tell which planes lie within the gates, and how far each is from the prior (z squared)."""
    p = projection
    a, b, c = planes.T
    x, y, z = a, b * (p.fy / p.fx), (c + a * p.cx + b * p.cy) * (1 / p.fx)
    across = x * x + y * y
    norm = np.sqrt(np.maximum(across + z * z, 1e-24))
    log_height = np.log(p.baseline / prior.height / norm)
    pitch = np.arctan2(z, np.sqrt(across)) - prior.pitch
    roll = np.arctan2(x, y) - prior.roll
    allowed = np.abs(log_height) < math.log(gates.height)
    allowed &= np.abs(pitch) < gates.pitch
    allowed &= np.abs(roll) < gates.roll
    share = max(prior.sigma[0] / prior.height, 0.05)
    z2 = (log_height / share) ** 2 + (pitch / prior.sigma[1]) ** 2 + (roll / prior.sigma[2]) ** 2
    return allowed, z2


def _best(pixels: _Pixels, planes: Float64, belief: Float64, bump: float) -> tuple[Float64, float]:
    """Return the plane that most pixels and the prior support, and its score.

    All proposals run on few pixels, the better ones again on many.
    """
    nearest = quantile(pixels.d, 0.98)
    scores = belief * _scores(pixels, planes, bump, nearest, _SCORED // 5)
    if len(planes) > _FINALISTS:
        finalists = np.argpartition(scores, -_FINALISTS)[-_FINALISTS:]
        planes, belief = planes[finalists], belief[finalists]
    scores = belief * _scores(pixels, planes, bump, nearest, _SCORED)
    best = int(np.argmax(scores))
    return planes[best], float(scores[best])


def _scores(pixels: _Pixels, planes: Float64, bump: float, nearest: float, count: int) -> Float64:
    """Count for each plane the pixels on it, less a share of those below it."""
    # contiguous: BLAS takes a hundred times as long for a float32 product with a transposed view
    step = max(1, len(pixels.d) // count)
    uv1d = pixels.uv1d[:, ::step].astype(np.float32, order="C")
    uv1, d = uv1d[:3], uv1d[3]
    planes = planes.astype(np.float32)
    # the floor just ahead counts most: what lies beyond or beside may be another one
    close = planes @ (uv1 * np.float32(1 / nearest))
    np.maximum(np.minimum(close, 1, out=close), 0, out=close)
    close *= pixels.aside[::step].astype(np.float32)
    tolerance = 1 / (0.6 + bump * d)
    residual = planes @ (uv1 * tolerance)
    np.subtract(d * tolerance, residual, out=residual)
    below = residual < -1.5
    residual *= residual
    support = np.maximum(np.subtract(1, residual, out=residual), 0, out=residual)
    np.copyto(support, np.float32(-_BELOW), where=below)
    total: Float64 = np.einsum("ij,ij->i", close, support).astype(np.float64)
    return total


def _refine(
    pixels: _Pixels,
    plane: Float64,
    projection: Projection,
    prior: Prior,
    gates: Gates,
    bump: float,
) -> _Refined | None:
    """Sharpen a proposed plane on all pixels of the grid that lie near ahead."""
    floor = plane @ pixels.uv1
    nearest = _nearest(floor, pixels.d, bump)
    # what is farther has no say
    ahead = np.flatnonzero(floor > _WHOLE * _NEAR * nearest)
    uv1d, aside = pixels.uv1d.take(ahead, axis=1), pixels.aside.take(ahead)
    uv1, d = uv1d[:3], uv1d[3]
    bumps = (0.5 * bump * d) ** 2
    scale, roughest = _ANNEAL, float(bumps.max(initial=0.0))
    for step in range(1, _MOST_STEPS + 1):
        floor = plane @ uv1
        residual = d - floor
        variance = bumps + scale**2
        off = residual * residual / (_BIWEIGHT**2 * variance)
        inside = (off < 1) & (floor > _NEAR * nearest)
        if np.count_nonzero(inside) < 30:
            return None
        share = aside * inside
        weight = (1 - off) * np.minimum(floor * (1 / (_CLOSE * nearest)), 1)
        weight *= weight
        weight *= share
        equations = uv1d @ (uv1 * (weight / variance)).T
        try:
            solved = inverse(equations[:3]) @ equations[3]
        except ZeroDivisionError:
            return None
        moved = float(np.abs((solved - plane) @ uv1[:, ::_FEW]).max())
        plane = solved
        most = _BIWEIGHT * math.sqrt(roughest + scale**2)
        scale = 1.4826 * _weighted_median(np.minimum(np.abs(residual), most), share)
        scale = min(max(scale, _NOISE[0]), _NOISE[1])
        if step >= _STEPS and moved < _SETTLED:
            break
    if not _within(plane[None], projection, prior, gates)[0][0]:
        return None
    return _summary(uv1d, plane, scale, weight, bumps, nearest, pixels.stride)


def _weighted_median(values: Float64, weights: Float64) -> float:
    """Return the weighted median of positive values, to a hundredth (pixels)."""
    total = np.bincount((100 * values).astype(np.int64), weights=weights).cumsum()
    return 0.01 * (int(total.searchsorted(0.5 * total[-1])) + 0.5)


def _nearest(floor: Float64, d: Float64, bump: float) -> float:
    """Return the nearest level [px] at which pixels lie on the floor."""
    off = (d - floor) ** 2 / ((0.5 * bump * d) ** 2 + _ANNEAL**2)
    on = floor[(off < 9.0) & (floor > 0)]
    return quantile(on, 0.98) if len(on) else math.inf


def _summary(
    uv1d: Float64,
    plane: Float64,
    scale: float,
    weight: Float64,
    bumps: Float64,
    nearest: float,
    stride: int,
) -> _Refined:
    uv1, d = uv1d[:3], uv1d[3]
    floor = plane @ uv1
    residual = d - floor
    variance = bumps + scale**2
    here = floor > _NEAR * nearest
    on = residual * residual < 9.0 * variance
    return _Refined(
        plane=plane,
        noise=scale,
        normal=(uv1 * (weight / variance)) @ uv1.T,
        here=int(np.count_nonzero(here)),
        on=int(np.count_nonzero(here & on)),
        above=int(np.count_nonzero(here & ~on & (residual > 0))),
        stride=stride,
    )

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

import numpy as np

from bearcub.geometry import Attitude, Float64, Projection
from bearcub.ground.prior import Prior
from bearcub.messages import Float32

_TRIPLES = 250
_SCORED = 800  # pixels a proposal is scored on
_REFINED = 5000  # pixels the refinement uses
_ANNEAL = (0.6, 0.4, 0.4)  # assumed noise while the refinement closes in [px]
_NOISE = (0.1, 0.6)  # least and largest noise of a pixel that the refinement believes [px]
_REMOTE = 0.15  # loss of a plane one sigma from the prior, as a share of its score
_BELOW = 0.5  # what a pixel below the plane costs, in supporting pixels
_NEAR = 0.3  # the floor just ahead reaches to this share of its nearest level
_HALF_WIDTH = 3.0  # of the way just ahead [m]; ground further aside counts less
_CLOSE = 0.5  # pixels farther than this share of the nearest level count less
_BIWEIGHT = 3.5  # Tukey's constant in sigmas
_CORRELATED = 12.0  # neighbouring pixels of a matcher that err together
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
class _Pixels:
    """A grid of measured pixels: homogeneous coordinates (N, 3) and disparities (N,)."""

    uv1: Float64
    d: Float64
    floorlike: np.ndarray[tuple[int], np.dtype[np.bool_]]
    stride: int


def fit_plane(
    disparity: Float32,
    projection: Projection,
    prior: Prior,
    gates: Gates,
    *,
    unevenness: float,
    seed: int = 0,
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
    seed : int
        Of the random triples; the same map gives the same floor.

    Returns
    -------
    PlaneFit or None
        None when no plane within the gates finds support.
    """
    pixels = _sample(disparity, projection, prior)
    if len(pixels.d) < 50:
        return None
    planes = np.concatenate([_prior_planes(projection, prior), _triples(pixels, seed)])
    allowed, remoteness = _within(planes, projection, prior, gates)
    planes = planes[allowed]
    if len(planes) == 0:
        return None
    bump = unevenness / prior.height
    scores = _scores(pixels, planes, bump) / (1.0 + _REMOTE * remoteness[allowed])
    best = int(np.argmax(scores))
    if scores[best] <= 0:
        return None
    height, _ = projection.floor(planes[best])
    return _refine(pixels, planes[best], projection, prior, gates, unevenness / height)


def _sample(disparity: Float32, projection: Projection, prior: Prior) -> _Pixels:
    """Take a regular grid of measured pixels; note which climb with the row as a floor does."""
    rows, columns = disparity.shape
    stride = max(1, int(np.sqrt(rows * columns / _REFINED)))
    reach = max(4, rows // 40)
    v = np.arange(reach, rows - reach, stride)
    u = np.arange(stride // 2, columns, stride)
    d = disparity[np.ix_(v, u)].astype(np.float64)
    climb = (disparity[np.ix_(v + reach, u)] - disparity[np.ix_(v - reach, u)]) / (2.0 * reach)
    grid_u, grid_v = np.meshgrid(u.astype(np.float64), v.astype(np.float64))
    valid = np.isfinite(d) & (d > 0)
    expected = projection.baseline / prior.height
    floorlike = (climb > 0.3 * expected) & (climb < 3.0 * expected)
    uv1 = np.stack([grid_u[valid], grid_v[valid], np.ones(int(valid.sum()))], axis=1)
    return _Pixels(uv1=uv1, d=d[valid], floorlike=floorlike[valid], stride=stride)


def _prior_planes(projection: Projection, prior: Prior) -> Float64:
    """Return the prior's plane and some inclined about it, for floors too rough for triples."""
    steps = np.radians([-6.0, -3.0, 0.0, 3.0, 6.0])
    return np.array(
        [
            projection.plane(
                height=prior.height,
                down=Attitude(roll=prior.roll + roll, pitch=prior.pitch + pitch).down(),
            )
            for pitch in steps
            for roll in steps
        ]
    )


def _triples(pixels: _Pixels, seed: int) -> Float64:
    """Propose planes through random triples of floor-like pixels."""
    candidates = np.flatnonzero(pixels.floorlike)
    if len(candidates) < 30:
        return np.zeros((0, 3))
    pick = np.random.default_rng(seed).choice(candidates, size=(_TRIPLES, 3))
    corners = pixels.uv1[pick]
    area = np.abs(np.linalg.det(corners))
    wide = area > 0.02 * np.ptp(pixels.uv1[:, 0]) * np.ptp(pixels.uv1[:, 1])
    solved = np.linalg.solve(corners[wide], pixels.d[pick][wide][..., None])
    planes: Float64 = solved[..., 0]
    return planes


def _within(
    planes: Float64, projection: Projection, prior: Prior, gates: Gates
) -> tuple["np.ndarray[tuple[int], np.dtype[np.bool_]]", Float64]:
    """Tell which planes lie within the gates, and how far each is from the prior (z squared)."""
    p = projection
    scaled = np.stack(
        [
            planes[:, 0],
            planes[:, 1] * p.fy / p.fx,
            (planes[:, 2] + planes[:, 0] * p.cx + planes[:, 1] * p.cy) / p.fx,
        ],
        axis=1,
    )
    norm = np.maximum(np.linalg.norm(scaled, axis=1), 1e-12)
    down = scaled / norm[:, None]
    log_height = np.log(p.baseline / norm / prior.height)
    pitch = np.arcsin(np.clip(down[:, 2], -1, 1)) - prior.pitch
    roll = np.arctan2(down[:, 0], down[:, 1]) - prior.roll
    allowed = (
        (np.abs(log_height) < np.log(gates.height))
        & (np.abs(pitch) < gates.pitch)
        & (np.abs(roll) < gates.roll)
    )
    share = max(prior.sigma[0] / prior.height, 0.05)
    z2 = (log_height / share) ** 2 + (pitch / prior.sigma[1]) ** 2 + (roll / prior.sigma[2]) ** 2
    return allowed, z2


def _scores(pixels: _Pixels, planes: Float64, bump: float) -> Float64:
    """Count for each plane the pixels on it, less a share of those below it."""
    step = max(1, len(pixels.d) // _SCORED)
    d = pixels.d[::step].astype(np.float32)
    # contiguous: BLAS takes a hundred times as long for a float32 product with a transposed view
    uv1 = np.ascontiguousarray(pixels.uv1[::step].T, dtype=np.float32)
    floor = planes.astype(np.float32) @ uv1
    scale = 1 / (0.6 + bump * d)
    residual = (d - floor) * scale
    # the floor just ahead counts most: what lies beyond may be another one
    close = np.clip(floor / np.float32(np.percentile(d, 98)), 0, 1)
    support = np.maximum(1.0 - residual * residual, 0.0)
    support -= np.float32(_BELOW) * (residual < -1.5)
    total: Float64 = np.einsum("ij,ij->i", close, support, dtype=np.float64)
    return total


def _refine(
    pixels: _Pixels,
    plane: Float64,
    projection: Projection,
    prior: Prior,
    gates: Gates,
    bump: float,
) -> PlaneFit | None:
    """Sharpen a proposed plane on all pixels of the grid that lie near ahead."""
    lateral = (pixels.uv1[:, 0] - projection.cx) * projection.baseline / pixels.d
    aside = 1.0 / (1.0 + (lateral / _HALF_WIDTH) ** 2)
    scale, nearest = _ANNEAL[0], 0.0
    for assumed in (*_ANNEAL, 0.0, 0.0):
        scale = assumed or scale
        floor = pixels.uv1 @ plane
        residual = pixels.d - floor
        width = np.hypot(scale, 0.5 * bump * pixels.d)
        if nearest == 0.0:
            nearest = _nearest(floor, residual, width)
        near = floor > _NEAR * nearest
        weight = np.where(near, np.clip(1 - (residual / (_BIWEIGHT * width)) ** 2, 0, None), 0) ** 2
        weight *= (scale / width) ** 2 * aside
        weight *= np.clip(floor / (_CLOSE * nearest), 0, 1) ** 2
        if np.count_nonzero(weight) < 30:
            return None
        weighted = pixels.uv1 * weight[:, None]
        normal = weighted.T @ pixels.uv1
        try:
            plane = np.linalg.solve(normal, weighted.T @ pixels.d)
        except np.linalg.LinAlgError:
            return None
        inside = near & (np.abs(residual) < _BIWEIGHT * width)
        scale = 1.4826 * _weighted_median(np.abs(residual[inside]), aside[inside])
        scale = min(max(scale, _NOISE[0]), _NOISE[1])
    allowed, _ = _within(plane[None], projection, prior, gates)
    if not allowed[0]:
        return None
    return _summary(pixels, plane, scale, weight, bump)


def _weighted_median(values: Float64, weights: Float64) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def _nearest(floor: Float64, residual: Float64, width: Float64) -> float:
    """Return the nearest level [px] at which floor is seen."""
    on = floor[(np.abs(residual) < 3 * width) & (floor > 0)]
    return float(np.percentile(on, 98)) if len(on) else math.inf


def _summary(
    pixels: _Pixels, plane: Float64, scale: float, weight: Float64, bump: float
) -> PlaneFit:
    floor = pixels.uv1 @ plane
    residual = pixels.d - floor
    width = np.hypot(scale, 0.5 * bump * pixels.d)
    on = np.abs(residual) < 3 * width
    here = floor > _NEAR * _nearest(floor, residual, width)
    normal = (pixels.uv1 * weight[:, None]).T @ pixels.uv1
    each = max(1.0, _CORRELATED / pixels.stride**2)
    covariance: Float64 = scale**2 * each * np.asarray(np.linalg.inv(normal), dtype=np.float64)
    covariance[2, 2] += _LOCKING**2
    not_above = here & (residual < 3 * width)
    return PlaneFit(
        plane=plane,
        covariance=covariance,
        noise=scale,
        support=int(np.sum(on & here)) / max(1, int(np.sum(not_above))),
        count=int(np.sum(on & here)) * pixels.stride**2,
    )

"""How large is what stands there? The likeliest rectangle of an upright surface on the floor.

Two explanations of the same pixels: the floor, and an upright surface that stands on it and faces
the camera. Each warps the right image to the left one; the difference of their squared misfits, in
variances of the images' noise, is a pixel's log-likelihood ratio [1]_. The rectangle, from its foot
on the floor up, over which its sum is largest is the thing's likeliest extent: pixels of floor
beside a thing speak against it.

References
----------
.. [1] P. Pinggera, S. Ramos, S. Gehrig, U. Franke, C. Rother, R. Mester: "Lost and Found: detecting
   small road hazards for self-driving vehicles", IROS 2016.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.geometry import Float64, Projection
from bearcub.ground.surface import Surface
from bearcub.messages import Bool, Float32
from bearcub.obstacles.parallax import SIZE, Foot
from bearcub.obstacles.verify import Witness
from bearcub.robust import median

_REACHES = (0.3, 0.6, 1.2, 2.4)  # how far to the sides and up a thing is looked for [m] ...
_COLUMNS = 60  # ... by steps that leave so many columns on a side
_HIGHER, _LOWER = -4, 9  # rows above and below the foot in which it is looked for
_OFF = (-0.25, -0.12, 0.0, 0.12, 0.25)  # that the floor may be off where it is told [px]
_TOGETHER = 1.5  # neighbouring pixels whose noise is one
_LARGEST = 16.0  # squared misfit that says all there is to say [variances]
_KNOWN = 0.5  # share of pixels that must be in both images
_PRICE = 0.1  # log-likelihood of a pixel: noise alone makes nothing larger
_LIKELY = 35.0  # least log-likelihood ratio of a thing against the floor where it is told ...
_LARGER = 12.0  # ... where its extent alone is asked, of fewer pixels
_CERTAIN = 18.0  # ... and where it may be
_BESIDE = 3  # columns beside a thing that may show both [px]
_APART = 4.0  # log-likelihood ratio by which what is beside a thing must be floor
_WORSE = 6.0  # misfit by which the floor may be better explained elsewhere [variances]
_ROUNDING = 0.3  # variance of grey levels that rounding leaves
_BENT = 0.1  # least curvature of a log-likelihood that has a peak [per step²]
_MEDIAN_SQUARE = 0.455  # of a normal variable

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Upright:
    """An upright surface, as the images tell it.

    Attributes
    ----------
    left, right : int
        First and last column at half its height [px].
    top, foot : int
        First and last row [px].
    disparity : float
        In its middle [px].
    sigma : float
        1-sigma of it [px].
    pixels : int
    step : int
        Columns and rows between the pixels that tell where it ends [px].
    alone : bool
        Floor shows beside it: it is no part of something long.
    """

    left: int
    right: int
    top: int
    foot: int
    disparity: float
    sigma: float
    pixels: int
    step: int
    alone: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class _Window:
    """Pixels around a foot: in every row the columns of the same upright lines.

    Attributes
    ----------
    u, v : ndarray of int64, shape (H, W)
        Columns and rows, every `step`-th [px].
    step : int
    ahead : ndarray of float64, shape (3,)
        Of the disparity of an upright surface across the way, but for its scale ...
    upright : ndarray of float64, shape (H, W)
        ... and that itself.
    known : ndarray of bool
        Which of them both images show.
    left, floor : ndarray of float32
        Grey, and disparity of the floor [px].
    right : ndarray of float32
        Rows of the right image, as bright as the left one; `row` tells which is which.
    row : ndarray of float32
    variance : float
        Of the images' noise.
    misfit : ndarray of float32, shape (N, H, W)
        Of the floor, off by each of `_OFF`.
    """

    u: Index
    v: Index
    step: int
    ahead: Float64
    upright: Float64
    known: Bool
    left: Float32
    floor: Float32
    right: Float32
    row: Float32
    variance: float
    misfit: Float32

    @property
    def told(self) -> Float32:
        """Misfit of the floor where it is told to be."""
        told: Float32 = self.misfit[len(_OFF) // 2]
        return told


@dataclass(frozen=True, slots=True, kw_only=True)
class _Claim:
    """The likeliest rectangle of an upright surface that stands at one row.

    `foot` is that row, `gain` the rectangle's log-likelihood ratio against the floor, `alive`
    tells which pixels are above their floor, `misfit` and `disparity` are those of all pixels.
    """

    foot: int
    gain: float
    top: int
    left: int
    right: int
    alive: Bool
    misfit: Float32
    disparity: Float32

    @property
    def part(self) -> tuple[slice, slice]:
        """Rows and columns of the rectangle, and of what is below it."""
        return np.s_[self.top :, self.left : self.right + 1]

    def whole(self, known: Bool, beside: int) -> bool:
        """Tell whether it ends inside of its window, with so many `known` columns beside it."""
        if self.top == 0 or self.left < beside or self.right + beside >= known.shape[1]:
            return False
        sides = (self.left - beside, self.left), (self.right + 1, self.right + 1 + beside)
        return all(known[self.top :, first:end].mean() > _KNOWN for first, end in sides)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """Two images, the floor, and what turns them into metres.

    Attributes
    ----------
    witness : Witness
    surface : Surface
    projection : Projection
    offset : float
        In the disparities, not in the images [px].
    """

    witness: Witness
    surface: Surface
    projection: Projection
    offset: float

    def standing(self, foot: Foot) -> Upright | None:
        """Return what stands about a foot, None for nothing and for what has no end."""
        per_metre = foot.level / self.projection.baseline  # columns
        for reach in _REACHES:
            window = self._window(foot, math.ceil(reach * per_metre))
            if window is None:
                return None
            claim, gains = self._likeliest(window, foot)
            if reach > _REACHES[0]:
                if claim.gain < _LARGER:
                    return None
            elif claim.gain < _LIKELY or not _sure(window, claim):
                return None
            beside = _BESIDE + max(_BESIDE + 1, round(SIZE * per_metre / window.step))
            if claim.whole(window.known, beside):
                sides = _beside(window, claim, beside)
                if max(sides) > 2 * _APART:
                    return None
                alone = sum(sides) < -_APART and max(sides) < 0
                return self._upright(window, claim, gains, alone=alone)
        return None

    def _likeliest(self, window: _Window, foot: Foot) -> tuple[_Claim, list[float]]:
        """Return the claim whose gain is largest, and the gains a step above, at and below it."""
        step = window.step
        rows = range(foot.v + _HIGHER * step, foot.v + _LOWER * step, 2 * step)
        claims = {v: self._claim(window, foot, v) for v in rows}
        best = max(claims, key=lambda v: claims[v].gain)
        claims |= {v: self._claim(window, foot, v) for v in (best - step, best + step)}
        best = max(claims, key=lambda v: claims[v].gain)
        around = [claims.get(v) for v in (best - step, best, best + step)]
        return claims[best], [claim.gain for claim in around if claim is not None]

    def _window(self, foot: Foot, columns: int) -> _Window | None:
        """Return the pixels up to so many columns away, None where too few are in both images."""
        height, width = self.witness.left.shape
        a, b, _ = self.surface.plane.tolist()
        step = math.ceil(columns / _COLUMNS)
        reach = columns // step
        rows = foot.v + step * np.arange(-reach, _LOWER + 2)
        rows = rows[(rows >= 0) & (rows < height)]
        lean = a / b * (self.projection.fy / self.projection.fx)
        shift = np.rint(lean * (rows - foot.v)).astype(np.int64)
        u = foot.u + step * np.arange(-reach, reach + 1)[None, :] + shift[:, None]
        inside = (u >= 0) & (u < width)
        u = np.clip(u, 0, width - 1)
        v = np.broadcast_to(rows[:, None], u.shape)
        floor = np.maximum(self.surface.at(u, v), np.float32(0))
        at = u.astype(np.float32) - (floor - np.float32(self.offset))
        known = inside & (at >= 0)
        if known.mean() < _KNOWN:
            return None
        left = self.witness.left[v, u].astype(np.float32)
        right = self.witness.right[rows[0] : rows[-1] + 1].astype(np.float32)
        row = np.subtract(v, rows[0], dtype=np.float32)
        right *= np.float32(left[known].mean() / max(float(_at(right, at, row)[known].mean()), 1.0))
        misfit = np.stack([(left - _at(right, at - np.float32(off), row)) ** 2 for off in _OFF])
        variance = median(misfit[len(_OFF) // 2][known]) / _MEDIAN_SQUARE + _ROUNDING
        ahead = self._ahead()
        return _Window(
            u=u,
            v=v,
            step=step,
            ahead=ahead,
            upright=ahead[0] * u + ahead[1] * v + ahead[2],
            known=known,
            left=left,
            floor=floor,
            right=right,
            row=row,
            variance=variance,
            misfit=np.minimum(misfit / np.float32(variance), np.float32(_LARGEST)),
        )

    def _claim(self, window: _Window, foot: Foot, row: int) -> _Claim:
        """Return the likeliest rectangle that stands on a row, below or above a foot."""
        a, b, c = window.ahead
        level = float(self.surface.at(np.array(foot.u), np.array(row)))
        share = level / (a * foot.u + b * row + c)
        disparity = (share * window.upright).astype(np.float32)
        at = window.u.astype(np.float32) - (disparity - np.float32(self.offset))
        alive = window.known & (disparity > window.floor) & (at >= 0)
        misfit = (window.left - _at(window.right, at, window.row)) ** 2
        misfit = np.minimum(misfit / np.float32(window.variance), np.float32(_LARGEST))
        ratio = (window.told - misfit) / (2 * _TOGETHER) - _PRICE
        gain, top, left, right = likeliest(np.where(alive, ratio, 0.0))
        return _Claim(
            foot=row,
            gain=gain,
            top=top,
            left=left,
            right=right,
            alive=alive,
            misfit=misfit,
            disparity=disparity,
        )

    def _ahead(self) -> Float64:
        """Return the disparity of an upright surface across the way, but for its scale."""
        p = self.projection
        _, down = p.floor(self.surface.plane.astype(np.float64))
        ahead = np.array([0.0, 0.0, 1.0]) - down[2] * down
        return p.plane(height=1.0, down=ahead / np.linalg.norm(ahead))

    def _upright(
        self, window: _Window, claim: _Claim, gains: list[float], *, alone: bool
    ) -> Upright:
        """Return what a claim says; its disparity is where a parabola through the gains peaks."""
        fall = window.step * math.hypot(*self.surface.plane[:2].tolist())
        off, bent = 0.0, -1.0
        if len(gains) > 2:
            bent = min(gains[0] - 2 * gains[1] + gains[2], -_BENT)
            off = 0.5 * (gains[0] - gains[2]) / bent
        rows, columns = self.witness.left.shape
        top, lowest = int(window.v[claim.top, 0]), min(claim.foot, rows - 1)
        row = int(np.searchsorted(window.v[:, 0], (top + lowest) // 2))
        reach = (window.u.shape[1] - 1) // 2
        first = int(window.u[row, reach]) - window.step * reach
        return Upright(
            left=max(0, first + window.step * claim.left),
            right=min(columns, first + window.step * (claim.right + 1)) - 1,
            top=top,
            foot=lowest,
            disparity=float(claim.disparity[row, (claim.left + claim.right) // 2]) + off * fall,
            sigma=fall / math.sqrt(-bent),
            pixels=window.step**2 * int(np.count_nonzero(claim.alive[claim.part])),
            step=window.step,
            alone=alone,
        )


def _at(image: Float32, u: Float32, v: Float32) -> Float32:
    """Return an image at fractional columns, linear between."""
    return np.asarray(cv2.remap(image, u, v, cv2.INTER_LINEAR), dtype=np.float32)


def _sure(window: _Window, claim: _Claim) -> bool:
    """Tell whether a claim stands against a floor that may be off, and the floor is not off.

    It is off at the foot of a ramp that it does not follow, and in a hole: what is beside the claim
    and before it shows that.
    """
    alive = claim.alive[claim.part]
    floor = window.misfit[(slice(None), *claim.part)][:, alive].sum(axis=1)
    upright = claim.misfit[claim.part][alive].sum()
    around = window.known.copy()
    around[: claim.top + (claim.alive.shape[0] - claim.top) // 3] = False
    near = slice(max(0, claim.left - _BESIDE), claim.right + 1 + _BESIDE)
    around[claim.top :, near] &= ~claim.alive[claim.top :, near]
    misfit = window.misfit[:, around].sum(axis=1)
    told = min(misfit[0], misfit[-1]) >= misfit[1:-1].min() - _WORSE
    return bool(told and floor.min() - upright >= 2 * _TOGETHER * _CERTAIN)


def _beside(window: _Window, claim: _Claim, beside: int) -> tuple[float, float]:
    """Return the log-likelihood ratios, against the floor, that a claim goes on to its sides."""
    ratio = np.where(claim.alive, window.told - claim.misfit, 0)[claim.top :]
    ratio /= 2 * _TOGETHER
    left = float(ratio[:, claim.left - beside : claim.left - _BESIDE].sum())
    right = float(ratio[:, claim.right + 1 + _BESIDE : claim.right + 1 + beside].sum())
    return left, right


def likeliest(ratio: NDArray[np.floating]) -> tuple[float, int, int, int]:
    """Return the rectangle down to the last row with the largest sum.

    Parameters
    ----------
    ratio : ndarray, shape (H, W)
        Log-likelihood ratio of each pixel.

    Returns
    -------
    tuple
        The sum; first row, first and last column.

    Examples
    --------
    >>> likeliest(np.array([[-1.0, -1, -1, -1], [-1, 2, 1, -1], [-1, 0, 1, -1]]))
    (4.0, 1, 1, 2)
    """
    columns = np.cumsum(ratio[::-1], axis=0)[::-1]
    until = np.cumsum(columns, axis=1)
    before = until - columns
    least = np.minimum.accumulate(before, axis=1)
    gain = until - least
    top, right = (int(k) for k in np.unravel_index(int(gain.argmax()), gain.shape))
    left = int(before[top, : right + 1].argmin())
    return float(gain[top, right]), top, left, right

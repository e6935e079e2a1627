"""Lines of floor of one level each in both images: what explains their pixels, floor or not."""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Bool, Float32, UInt8
from bearcub.obstacles.upright import Scene
from bearcub.robust import median

_OFF = (-0.3, -0.15, 0.0, 0.15, 0.3)  # that the floor may be off where it is told [px]
_SMOOTH = np.array([0.25, 0.5, 0.25], dtype=np.float32)  # or noise would look like texture
_TOGETHER = (2.67, 1.4)  # neighbours along an axis whose noise is one: smoothed, shrunk
LARGEST = 16.0  # squared misfit that says all there is to say [variances]
_ROUNDING = 0.1  # variance of grey levels that rounding leaves, smoothed
_MEDIAN_SQUARE = 0.455  # of a normal variable
_KNOWN = 0.7  # share of pixels that must be in both images
_LEAST = (9, 8)  # lines and columns


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorLines:
    """Lines of one level each, the far ones first.

    Attributes
    ----------
    level, floor : ndarray of float32, shape (N,)
        Of the plane, and of the floor where the images put it [px].
    bend : ndarray of float64, shape (N,)
        Of the floor that was told less the plane [px].
    u : ndarray of float32, shape (M,)
        Columns [px].
    v : ndarray of float32, shape (N, M)
        Rows in `right` [px].
    step : tuple of int
        Columns and rows from one to the next.
    known : ndarray of bool, shape (N, M)
        Which pixels both images show.
    left : ndarray of float32, shape (N, M)
    right : ndarray of float32
        Rows of the right image, as bright as the left one.
    first : int
        First column of `right`.
    scale : float
        Of squared differences to variances of their noise.
    misfit : ndarray of float32, shape (N, M)
        Of the floor.
    together : float
        Pixels whose noise is one.
    """

    level: Float32
    floor: Float32
    bend: Float64
    u: Float32
    v: Float32
    step: tuple[int, int]
    known: Bool
    left: Float32
    right: Float32
    first: float
    scale: float
    misfit: Float32
    together: float

    @property
    def weight(self) -> float:
        """What a difference of misfits weighs as a log-likelihood ratio of a pixel."""
        return 0.5 / self.together

    def ratios(self, claims: Float32) -> Float32:
        """Return log-likelihood ratios of claimed disparities against the floor's.

        Parameters
        ----------
        claims : ndarray of float32, shape (K, N)
            Of the lines [px].

        Returns
        -------
        ndarray of float32, shape (K, N, M)
        """
        ratios = _misfits(self, claims)
        np.subtract(self.misfit, ratios, out=ratios)
        ratios *= self.known * np.float32(self.weight)
        return ratios

    def ratio(self, claim: Float32) -> Float32:
        """Return those of one claim, shape (N, M)."""
        ratio: Float32 = self.ratios(claim[None, :])[0]
        return ratio


def floor_lines(
    scene: Scene,
    columns: tuple[float, float],
    levels: tuple[float, float],
    *,
    most: tuple[int, int],
    shrunk: bool = True,
) -> FloorLines | None:
    """Sample lines of floor between two columns and two levels.

    Parameters
    ----------
    scene : Scene
    columns : tuple of float
        First and last [px].
    levels : tuple of float
        Of the farthest and the nearest line [px].
    most : tuple of int
        Lines and columns; there are no more, by larger steps.
    shrunk : bool
        What lies between is averaged, not left out.

    Returns
    -------
    FloorLines or None
        None where too little of it is in both images.
    """
    a, b, c = scene.surface.plane.tolist()
    height, width = scene.witness.left.shape
    first, last = max(columns[0], 0.0), min(columns[1], width - 1.0)
    far, near = levels
    step = (
        max(1, math.ceil((last - first) / most[1])),
        max(1, math.ceil((near - far) / b / most[0])),
    )
    level = np.arange(far, near, b * step[1], dtype=np.float32)
    u = np.arange(first, last, step[0]).round().astype(np.float32)
    if len(level) < _LEAST[0] or len(u) < _LEAST[1]:
        return None
    v = ((level[:, None] - c - a * u) / b).astype(np.float32)
    bend = scene.surface.look_up(scene.surface.bend, scene.surface.entry(level))
    raw = level + bend - np.float32(scene.offset)
    known = (v >= 0) & (v <= height - 1) & (u >= raw[:, None])
    if np.count_nonzero(known) < _KNOWN * known.size:
        return None
    left, right, corner = _cropped(scene, u, v, float(raw[-1]), step if shrunk else (1, 1))
    v -= np.float32(corner[1])
    here = _at(left, np.broadcast_to(u - np.float32(corner[0]), v.shape), v)
    found = FloorLines(
        level=level,
        floor=raw,
        bend=bend.astype(np.float64),
        u=u,
        v=v,
        step=step,
        known=known,
        left=here,
        right=right,
        first=float(corner[0]),
        scale=1.0,
        misfit=here,
        together=math.prod(_TOGETHER[shrunk and k > 1] for k in step),
    )
    return _settled(found)


def _cropped(
    scene: Scene, u: Float32, v: Float32, disparity: float, step: tuple[int, int]
) -> tuple[Float32, Float32, tuple[int, int]]:
    """Return the part of both images that is looked at, smoothed, and its first column and row."""
    height, width = scene.witness.left.shape
    more = (_OFF[-1] + disparity + 2 * step[0], 2 * step[1])
    left, top = max(0, int(u[0] - more[0])), min(max(0, int(v.min() - more[1])), height - 1)
    right = min(width, int(u[-1] + 2 * step[0]) + 2)
    bottom = max(top + 1, min(height, int(v.max() + more[1]) + 2))
    part = np.s_[top:bottom, left:right]
    one, other = (
        _smoothed(image[part], step) for image in (scene.witness.left, scene.witness.right)
    )
    return one, other, (left, top)


def _settled(found: FloorLines) -> FloorLines:
    """Return lines with the brightness, the noise and the floor that its images tell."""
    claims = found.floor + np.array(_OFF, dtype=np.float32)[:, None]
    there = _seen(found, found.floor[None, :])[0]
    known = found.known
    right = found.right * np.float32(
        found.left[known].mean() / max(float(there[known].mean()), 1.0)
    )
    brighter = replace(found, right=right)
    squares = _squares(brighter, claims)
    middle = len(_OFF) // 2
    scale = 1 / (median(squares[middle][known]) / _MEDIAN_SQUARE + _ROUNDING)
    squares *= np.float32(scale)
    np.minimum(squares, np.float32(LARGEST), out=squares)
    best = int((squares * known).sum(axis=(1, 2)).argmin())
    return replace(brighter, floor=claims[best], scale=scale, misfit=squares[best])


def _misfits(found: FloorLines, claims: Float32) -> Float32:
    squares = _squares(found, claims)
    squares *= np.float32(found.scale)
    return np.minimum(squares, np.float32(LARGEST), out=squares)


def _squares(found: FloorLines, claims: Float32) -> Float32:
    difference = _seen(found, claims)
    difference -= found.left
    difference *= difference
    return difference


def _seen(found: FloorLines, claims: Float32) -> Float32:
    """Return the right image at claimed disparities, shape (K, N, M)."""
    count, (lines, columns) = len(claims), found.v.shape
    at = (found.u - np.float32(found.first)) - claims[:, :, None]
    row = np.broadcast_to(found.v, at.shape)
    shape = count * lines, columns
    return _at(found.right, at.reshape(shape), row.reshape(shape)).reshape(at.shape)


def _smoothed(image: UInt8, step: tuple[int, int]) -> Float32:
    across, down = (_SMOOTH if k == 1 else np.full(k, 1 / k, dtype=np.float32) for k in step)
    return np.asarray(cv2.sepFilter2D(image, cv2.CV_32F, across, down), dtype=np.float32)


def _at(image: Float32, u: Float32, v: Float32) -> Float32:
    """Return an image at fractional columns and rows, linear between."""
    return np.asarray(cv2.remap(image, u, v, cv2.INTER_LINEAR), dtype=np.float32)

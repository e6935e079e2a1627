"""Where the images alone tell that the floor opens: plane and parallax below it.

What is seen through the mouth of a pit has less disparity than the floor: in the right image warped
by the floor's it is off the other way than what stands (`bearcub.obstacles.parallax`). The far wall
is upright and has the disparity of the floor at the far lip, so that the parallax is largest in the
line of the near lip and falls to nothing in that of the far one. Over lines of one level and the
columns of a mouth, ``sum(m g D) / sqrt(sum((m g)^2))`` is the root of the likelihood ratio of "a
wall behind this lip" against "floor", to first order; sums over any number of lines are differences
of sums from the first one on, as `m` is linear in the floor's disparity.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from bearcub.geometry import Float64, Projection
from bearcub.ground.surface import Surface
from bearcub.messages import Float32
from bearcub.obstacles.parallax import evidence
from bearcub.obstacles.verify import Witness
from bearcub.obstacles.warp import Window, window_between

_WIDTH = 0.35  # of the part of a mouth that is looked for [m]
_LENGTHS = (0.4, 0.8)  # of mouths that are looked for [m]
_RANGE = (3.6, 7.0)  # lips that are looked for [m]: nearer matchers tell, farther nothing does
_CELL = 8  # columns that are one [px]
_SURE = 3.9  # standard errors by which it must show
_SHARES = (0.4, 2.0)  # of the parallax that may be seen
_APART = np.ones((7, 5), dtype=np.uint8)  # lines and cells in which one mouth is the surest


@dataclass(frozen=True, slots=True, kw_only=True)
class Mouth:
    """Where the floor seems to open.

    Attributes
    ----------
    u : int
        Column of its middle [px].
    level : float
        Of its near lip: the floor's plane there [px].
    sure : float
        Standard errors by which it does.
    """

    u: int
    level: float
    sure: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lines:
    """Sums over the columns of a mouth, by lines of one level (far ones first) and cells.

    Attributes
    ----------
    level, floor : ndarray of float64, shape (N,)
        Of the lines' plane and floor [px].
    u : ndarray of float32, shape (M,)
        Middles of the cells [px].
    seen, energy : ndarray of float32, shape (N, M)
        ``g D`` and ``g^2``, in variances.
    """

    level: Float64
    floor: Float64
    u: Float32
    seen: Float32
    energy: Float32


def mouths(
    witness: Witness, surface: Surface, projection: Projection, *, offset: float
) -> list[Mouth]:
    """Find where holes seem to open in the floor.

    Parameters
    ----------
    witness : Witness
        The images.
    surface : Surface
        The floor.
    projection : Projection
    offset : float
        In the floor's disparities, not in the images [px].

    Returns
    -------
    list of Mouth
        The surest first.
    """
    focal = projection.fx * projection.baseline
    near, far = (focal / reach for reach in _RANGE)
    farthest = focal / (_RANGE[1] + _LENGTHS[-1])
    window = window_between(witness.left.shape, surface, farthest, near, step=1)
    if window is None:
        return []
    lines = _lines(witness, surface, window, projection.baseline, offset)
    return sorted(_peaks(lines, focal, far, near), key=lambda mouth: -mouth.sure)


def _lines(
    witness: Witness, surface: Surface, window: Window, baseline: float, offset: float
) -> _Lines:
    """Sum what tells of parallax over the columns of a mouth, along lines of one level."""
    rows, columns = window.rows, window.columns
    cells, middle = columns // _CELL, 0.5 * columns
    a, b, c = surface.plane.tolist()
    u = (np.arange(cells, dtype=np.float32) + np.float32(0.5)) * _CELL - np.float32(0.5)
    level = a * middle + b * (window.first + 2 * np.arange(rows) + 0.5) + c
    floor = level + surface.look_up(surface.bend, surface.entry(level.astype(np.float32)))
    # two rows of the image are one of these; there are none beyond the first and the last
    row = np.rint(a / b * (u - middle) / 2).astype(np.int64)
    beyond = int(np.abs(row).max())
    place = (beyond + np.arange(rows)[:, None] - row) * cells + np.arange(cells)
    half = np.maximum(1, np.rint(0.5 * _WIDTH / baseline / _CELL * level)).astype(np.int64)
    line = (cells + 1) * np.arange(rows)[:, None]
    first = np.maximum(np.arange(cells) - half[:, None], 0) + line
    end = np.minimum(np.arange(cells) + half[:, None], cells) + line

    def summed(image: Float32) -> Float32:
        small = cv2.resize(image, (cells, rows), interpolation=cv2.INTER_AREA)
        padded = cv2.copyMakeBorder(small, beyond, beyond, 0, 0, cv2.BORDER_CONSTANT)
        until = np.zeros((rows, cells + 1), dtype=np.float32)
        np.cumsum(_CELL * padded.take(place), axis=1, out=until[:, 1:])
        sums: Float32 = until.take(end) - until.take(first)
        return sums

    energy, seen, noise = evidence(witness.left, witness.right, surface, window, offset=offset)
    np.divide(seen, noise, out=seen)
    np.divide(energy, noise, out=energy)
    return _Lines(level=level, floor=floor, u=u, seen=summed(seen), energy=summed(energy))


def _peaks(lines: _Lines, focal: float, low: float, high: float) -> Iterator[Mouth]:
    """Yield the mouths whose near lip lies between two levels."""
    level, floor = lines.level, lines.floor
    first = int(np.searchsorted(level, low))
    near = np.arange(first, int(np.searchsorted(level, high)))
    if len(near) == 0:
        return
    at = floor[:, None].astype(np.float32)
    sums = np.zeros((len(at) + 1, 5, len(lines.u)), dtype=np.float32)
    for k, image in enumerate(
        (lines.seen, at * lines.seen, lines.energy, at * lines.energy, at * at * lines.energy)
    ):
        sums[1:, k] = image
    sums = accumulated(np.add, sums)  # of the lines before each
    sure = np.zeros((len(near), len(lines.u)), dtype=np.float32)
    for length in _LENGTHS:
        lip = focal / (focal / level[near] + length)
        far = np.searchsorted(level, lip)
        wall = np.interp(lip, level, floor).astype(np.float32)[:, None]
        between = sums[near[0] + 1 : near[-1] + 2] - sums[far]
        total, weighed, one, linear, square = between.transpose(1, 0, 2)
        together = wall * total - weighed
        expected = square - 2 * wall * linear + wall * wall * one
        told = (together > _SHARES[0] * expected) & (together < _SHARES[1] * expected)
        told &= ((far > 0) & (near > far))[:, None]
        np.maximum(
            sure, told * together / np.sqrt(np.maximum(expected, np.float32(1e-3))), out=sure
        )
    highest = cv2.dilate(sure, _APART)
    for k, j in np.argwhere((sure >= highest) & (sure > _SURE)).tolist():
        yield Mouth(u=round(float(lines.u[j])), level=float(level[near[k]]), sure=float(sure[k, j]))


def accumulated(operation: np.ufunc, values: Float32) -> Float32:
    """Accumulate along the first axis, as the ufunc does, several times as fast.

    Parameters
    ----------
    operation : ufunc
        Of two arguments.
    values : ndarray of float32, shape (N, ...)
    """
    result = np.ascontiguousarray(values)
    for last, row in pairwise(result):
        operation(last, row, out=row)
    return result

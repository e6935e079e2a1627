"""Where the floor is dark: patches as large as a hole, darker than the ground on every side.

Light that falls through a mouth is lost in it, so that most holes are darker than the ground around
them; shadows and stains are as well. What is dark is therefore no evidence, but worth a look.
"""

import math

import cv2
import numpy as np

from bearcub.geometry import Float64, Projection
from bearcub.ground.surface import Surface
from bearcub.messages import Float32, UInt8
from bearcub.obstacles.mouths import Mouth

_CELL = 0.1  # of the ground [m]
_DEPTHS = (2.2, 7.0)  # that are looked at: nearer matchers tell, farther nothing does [m]
_ASIDE = 30  # cells to either side that are
_AROUND = 8  # cells from a patch to the ground around it: the largest hole is 1 m
_DARK = 0.72  # of the darkest ground around that a patch may have: side walls take the rest
_SMOOTH = (7, 3)  # columns and rows whose mean is taken, against noise [px]
_BLACK = 3.0  # what noise makes of no light [grey levels]
_APART = np.ones((9, 9), dtype=np.uint8)  # cells in which one patch is the darkest
_PATCH = np.ones((3, 3), dtype=np.uint8)  # cells


def dark_patches(left: UInt8, surface: Surface, projection: Projection) -> list[Mouth]:
    """Find where the floor is dark.

    Parameters
    ----------
    left : ndarray of uint8, shape (H, W)
        Grey.
    surface : Surface
        The floor.
    projection : Projection

    Returns
    -------
    list of Mouth
        With the level of their near ends, the darkest first; `sure` is how many times as bright
        the ground around is.
    """
    if surface.plane[1] <= 0:
        return []
    u, v, level = _cells(surface, projection)
    inside = (u >= 0) & (u <= left.shape[1] - 1) & (v >= 0) & (v <= left.shape[0] - 1)
    first = max(0, math.floor(float(v.min())) - _SMOOTH[1])  # rows beyond need no smoothing
    rows = left[first : max(first + 1, math.ceil(float(v.max())) + _SMOOTH[1])]
    smooth = cv2.blur(rows, _SMOOTH)
    grey = cv2.remap(smooth, u, v - np.float32(first), cv2.INTER_LINEAR).astype(np.float32)
    patch = cv2.blur(grey, _PATCH.shape)
    known = cv2.erode(inside.astype(np.uint8), _PATCH, borderValue=0) > 0
    around = _darkest_around(np.where(known, patch, np.float32(np.nan)))
    ratio = np.where(known & (around > 0), (patch + _BLACK) / (around + _BLACK), np.float32(1))
    darkest = (ratio < _DARK) & (ratio <= cv2.erode(ratio, _APART))
    found = []
    for k, j in np.argwhere(darkest).tolist():
        bright = grey[k:, j] > 0.5 * (patch[k, j] + around[k, j])
        near = k + int(bright.argmax()) - 1 if bright.any() else k
        column, times = round(float(u[near, j])), float(1 / ratio[k, j])
        found.append(Mouth(u=column, level=float(level[near]), sure=times))
    return sorted(found, key=lambda mouth: -mouth.sure)


def _cells(surface: Surface, projection: Projection) -> tuple[Float32, Float32, Float64]:
    """Return columns and rows of the ground's cells, far ones first, and the lines' levels [px]."""
    a, b, c = surface.plane.tolist()
    depth = np.arange(_DEPTHS[1], _DEPTHS[0], -_CELL)
    level = projection.fx * projection.baseline / depth
    aside = _CELL / projection.baseline * np.arange(-_ASIDE, _ASIDE + 1)
    u = projection.cx + aside * level[:, None]
    v = (level[:, None] - c - a * u) / b
    return u.astype(np.float32), v.astype(np.float32), level


def _darkest_around(patch: Float32) -> Float32:
    """Return the least that is known on four sides, NaN where less than three are."""
    far = _AROUND
    rows, columns = patch.shape
    wide = np.full((rows + 2 * far, columns + 2 * far), np.nan, dtype=np.float32)
    wide[far:-far, far:-far] = patch
    sides = np.stack(
        [
            wide[far + down : far + down + rows, far + right : far + right + columns]
            for down, right in ((0, -far), (0, far), (-far, 0), (far, 0))
        ]
    )
    left, right, *ends = np.isfinite(sides)
    both = left & right & np.logical_or(*ends)
    return np.where(both, np.fmin.reduce(sides, axis=0), np.float32(np.nan))

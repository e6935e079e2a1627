"""Does the picture really say so? Floor or not floor as two explanations of the same pixels.

Where texture is weak a matcher reports disparities that fit hardly better than the floor's would.
Each claim off the floor is therefore put to the images once more: the left pixels against the
right ones at the claimed disparity, and at the floor's. What the floor explains almost as well is
no obstacle and no hole.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import DisparityMap, Float32, UInt8
from bearcub.obstacles.sorting import Sorter

_WINDOW = (11, 11)  # the brightness of a neighbourhood is no evidence: the cameras may differ in it
_SAMPLES = 1500
_BETTER = 0.7  # share of the floor's disagreement that a claim may leave

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Witness:
    """The two images that a disparity map was matched from, grey."""

    left: UInt8
    right: UInt8

    @classmethod
    def of(cls, disparity: DisparityMap) -> "Witness | None":
        """Return the witness of a matched pair; None for a disparity map without its images."""
        if disparity.left is None or disparity.right is None:
            return None
        return cls(left=disparity.left, right=disparity.right)

    def supports(self, u: Index, v: Index, claimed: Float32, floor: Float32) -> bool:
        """Tell whether the images speak for the claimed disparities against the floor's.

        Parameters
        ----------
        u, v : ndarray of int64, shape (N,)
            Columns and rows of the pixels.
        claimed, floor : ndarray of float32, shape (N,)
            Raw disparities (without the rig's `doffs`) [px]; NaN in `claimed` is left out.
        """
        known = np.isfinite(claimed)
        u, v, claimed, floor = u[known], v[known], claimed[known], floor[known]
        if len(u) == 0:
            return False
        margin = _WINDOW[0] // 2
        first = max(0, int(v.min()) - margin)
        rows = slice(first, int(v.max()) + margin + 1)
        right = _flattened(self.right[rows])
        here = _flattened(self.left[rows])[v - first, u]
        off = np.abs(here - _between(right, u - claimed, v - first)).mean()
        on = np.abs(here - _between(right, u - floor, v - first)).mean()
        return bool(off < _BETTER * on)


def confirmed(
    witness: Witness | None, sorter: Sorter, u: Index, v: Index, *, offset: float
) -> bool:
    """Ask the images whether pixels' disparities explain them better than the floor's.

    Parameters
    ----------
    witness : Witness or None
        None, for a disparity map without its images, confirms.
    sorter : Sorter
        The disparities and the floor's; above the horizon the floor is infinitely far.
    u, v : ndarray of int64, shape (N,)
        Columns and rows.
    offset : float
        In the disparities, not in the images [px].
    """
    if witness is None:
        return True
    step = max(1, len(u) // _SAMPLES)
    u, v = u[::step], v[::step]
    shift = np.float32(offset)
    floor = np.maximum(sorter.surface.at(u, v), 0)
    return witness.supports(u, v, sorter.disparity[v, u] - shift, floor - shift)


def _between(image: Float32, u: Float32, v: Index) -> Float32:
    """Return an image at fractional columns, linear between."""
    u = np.clip(u, 0, image.shape[1] - 1.001)
    whole = u.astype(np.int64)
    part = (u - whole).astype(np.float32)
    value: Float32 = (1 - part) * image[v, whole] + part * image[v, whole + 1]
    return value


def _flattened(image: UInt8) -> Float32:
    flat: Float32 = image.astype(np.float32)
    flat -= cv2.blur(flat, _WINDOW)
    return flat

"""Where exactly a thing ends to its sides: what a matcher carries past them is taken off."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import cv2
import numpy as np

from bearcub.messages import Bool, Float32, UInt8
from bearcub.obstacles.sorting import Sorting
from bearcub.stereo.native import core

_NARROW = (3, 9)  # window at a thing's side: its columns decide where the side is
_FRINGE = 0.5  # share of a narrow window's texture on which the images may disagree
_WIDEST_FRINGE = 10  # [px]
_EDGE = 2  # how far inwards the larger gradient of a silhouette is looked for [px]
_GROWS = 1.5  # how many times larger


@dataclass(frozen=True, slots=True, kw_only=True)
class Trimmer:
    """Takes off the fringe that a matcher carries past a thing's sides.

    From both sides inwards, pixels are dropped until the images agree at the thing's disparity in a
    narrow window, as they do at its silhouette, however plain it is, and not in the background
    beside it; and until the gradient, largest at the silhouette, does not grow further inwards.
    With ``g`` the horizontal gradient, the images agree where ``sum (g_left - g_right)^2`` is less
    than a share of ``sum (g_left^2 + g_right^2)``.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W)
        The grey pair that the disparities were matched from.
    offset : float
        In the disparities, not in the images [px].
    """

    left: UInt8
    right: UInt8
    offset: float

    def __call__(self, mask: Bool, part: Sorting) -> Bool:
        """Return a thing's pixels without the fringe.

        Parameters
        ----------
        mask : ndarray of bool, shape (H, W)
            Pixels of the thing in a window of the image.
        part : Sorting
            Of that window.
        """
        outside_left, outside_right = self._beside(mask, part)
        kept = mask.copy()
        for _ in range(_WIDEST_FRINGE):
            off, right = kept & outside_left, kept & outside_right
            # of bools "more than" is "and not", in one pass
            np.greater(off[:, 1:], kept[:, :-1], out=off[:, 1:])
            np.greater(right[:, :-1], kept[:, 1:], out=right[:, :-1])
            off |= right
            if not off.any():
                break
            kept ^= off
        return kept

    def _beside(self, mask: Bool, part: Sorting) -> tuple[Bool, Bool]:
        """Return which pixels cannot be a thing's leftmost and rightmost in their row."""
        rows = slice(int(part.v[0]), int(part.v[-1]) + 1)
        columns = slice(int(part.u[0]), int(part.u[-1]) + 1)
        claimed = np.where(mask, part.disparity - np.float32(self.offset), np.float32(0))
        at = np.broadcast_to(part.u.astype(np.float32), claimed.shape) - claimed
        row = np.broadcast_to((part.v - part.v[0]).astype(np.float32)[:, None], claimed.shape)
        here = _gradient(self.left[rows, columns].astype(np.float32))
        right = np.ascontiguousarray(self.right[rows], dtype=np.float32)
        there = _gradient(np.asarray(cv2.remap(right, at, row, cv2.INTER_LINEAR), dtype=np.float32))
        balance = (here - there) ** 2 - _FRINGE * (here * here + there * there)
        disagreed = cv2.boxFilter(balance, -1, _NARROW, normalize=False) >= 0
        edge = cv2.blur(np.abs(here), (1, _NARROW[1]))
        left_bad, right_bad = disagreed.copy(), disagreed
        for k in range(1, min(_EDGE, mask.shape[1] - 1) + 1):
            left_bad[:, :-k] |= edge[:, k:] > _GROWS * edge[:, :-k]
            right_bad[:, k:] |= edge[:, :-k] > _GROWS * edge[:, k:]
        return left_bad, right_bad


def _gradient(image: Float32) -> Float32:
    return np.asarray(cv2.Sobel(image, cv2.CV_32F, 1, 0, ksize=1), dtype=np.float32)


@cache
def trim_tuning() -> Any:
    """Return these numbers for the native core."""
    return core.TrimTuning(
        narrow_columns=_NARROW[0],
        narrow_rows=_NARROW[1],
        fringe=_FRINGE,
        widest_fringe=_WIDEST_FRINGE,
        edge=_EDGE,
        grows=_GROWS,
    )

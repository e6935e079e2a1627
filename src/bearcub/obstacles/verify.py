"""Does the picture really say so? Floor or not floor as two explanations of the same pixels.

Where texture is weak a matcher reports disparities that fit hardly better than the floor's would.
Each claim off the floor is therefore put to the images once more: the left pixels against the
right ones at the claimed disparity, and at the floor's. What the floor explains almost as well is
no obstacle and no hole.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import DisparityMap, Float32, UInt8
from bearcub.obstacles.sorting import Sorter
from bearcub.robust import median
from bearcub.stereo.grain import smoothed

AROUND = (11, 11)  # the brightness of a neighbourhood is no evidence: the cameras may differ in it
ALONG = (11, 1)  # ... of a row alone: what is above and below may be of another surface
_SAMPLES = 1500
_PATCH = 9.0  # neighbouring pixels that witness together ...
_SMOOTH_PATCH = 15.0  # ... in smoothed images: as many as the smoothing makes one of
_LARGEST = 40.0  # difference that says all there is to say [grey levels]
_SHARES = (0.5, 1.0, 1.5)  # of a shift of many pixels that is tried: their median is no mean
_LAST = 1.001  # how far from the end of a row there is a column to the right [px]
_TOGETHER = 3.0  # neighbouring pixels whose noise is one, where they share one shift

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Witness:
    """The two images that a disparity map was matched from, grey.

    `patch` is how many neighbouring pixels witness together.
    """

    left: UInt8
    right: UInt8
    patch: float = _PATCH

    @classmethod
    def of(cls, disparity: DisparityMap) -> "Witness | None":
        """Return the witness of a matched pair; None for a disparity map without its images."""
        if disparity.left is None or disparity.right is None:
            return None
        return cls(left=disparity.left, right=disparity.right)

    def without_grain(self) -> "Witness":
        """Return what images in which noise outweighs the texture witness when smoothed."""
        left, right = smoothed(self.left, self.right)
        return Witness(left=left, right=right, patch=_SMOOTH_PATCH)

    def supports(
        self,
        u: Index,
        v: Index,
        claimed: Float32,
        floor: Float32,
        *,
        sure: float,
        window: tuple[int, int] = AROUND,
    ) -> bool:
        """Tell whether the images speak for the claimed disparities against the floor's.

        Parameters
        ----------
        u, v : ndarray of int64, shape (N,)
            Columns and rows of the pixels.
        claimed, floor : ndarray of float32, shape (N,)
            Raw disparities (without the rig's `doffs`) [px]; NaN in `claimed` is left out.
        sure : float
            Standard errors by which the claim must explain the images better than the floor.
        window : tuple of int
            Columns and rows of the neighbourhood whose brightness is taken off.
        """
        known = np.isfinite(claimed)
        u, v, claimed, floor = u[known], v[known], claimed[known], floor[known]
        if len(u) == 0:
            return False
        gain = self.gains(u, v, claimed, floor, window=window)
        independent = len(u) / self.patch
        return bool(gain.mean() * math.sqrt(independent) > sure * gain.std())

    def gains(
        self,
        u: Index,
        v: Index,
        claimed: Float32,
        floor: Float32,
        *,
        window: tuple[int, int] = AROUND,
    ) -> Float32:
        """Return how much better each pixel fits at the claimed disparity than at the floor's.

        Parameters are those of `supports`, with nothing unmatched. Of shape (N,), squared
        differences of grey levels.
        """
        rows = _around(v, window[1], len(self.left))
        columns = _around(u, window[0], self.left.shape[1])
        v = v - rows.start
        here = _flattened(self.left[rows, columns], window)[v, u - columns.start]
        at = np.clip(u - np.stack([claimed, floor]), 0, self.right.shape[1] - _LAST)
        columns = _around(at, window[0], self.right.shape[1])
        right = _flattened(self.right[rows, columns], window)
        off, on = _squared(here - _between(right, at - columns.start, v))
        gain: Float32 = on - off
        return gain

    def shifted(self, u: Index, v: Index, floor: Float32, shift: float) -> float:
        """Return by how many sigmas the images speak for one shift of all pixels off the floor.

        Matchers lock to strong edges, and noise moves their disparities by chance, each pixel's
        its own way. One shift of many pixels has no such freedom: where it explains the
        images better than the floor does, by the noise that it leaves itself, the pixels do lie
        off the floor (the root of a likelihood ratio). Of a difference of brightness between
        the cameras nothing is left when the median difference of all pixels is taken off.

        Parameters
        ----------
        u, v : ndarray of int64, shape (N,)
            Columns and rows of the pixels.
        floor : ndarray of float32, shape (N,)
            Raw disparity of the floor there [px].
        shift : float
            Off the floor's disparity, about [px].
        """
        count = len(u)
        if count == 0:
            return 0.0
        step = max(1, count // _SAMPLES)
        u, v, floor = u[::step], v[::step], floor[::step]
        first = int(v.min())
        right = self.right[first : int(v.max()) + 1].astype(np.float32)
        here = self.left[v, u].astype(np.float32)

        def misfit(share: float) -> float:
            difference = here - _between(right, u - floor - np.float32(share * shift), v - first)
            return float(_squared(difference - np.float32(median(difference))).mean())

        least = min(misfit(share) for share in _SHARES)
        gain = misfit(0.0) / max(least, 1e-6) - 1
        return math.sqrt(max(gain, 0.0) * count / _TOGETHER)


def confirmed(
    witness: Witness | None,
    sorter: Sorter,
    u: Index,
    v: Index,
    *,
    offset: float,
    sure: float,
    window: tuple[int, int] = AROUND,
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
    sure : float
        Standard errors by which they must.
    window : tuple of int
        Columns and rows of the neighbourhood whose brightness is taken off.
    """
    if witness is None:
        return True
    step = max(1, len(u) // _SAMPLES)
    u, v = u[::step], v[::step]
    claimed, floor = _claims(sorter, u, v, offset)
    return witness.supports(u, v, claimed, floor, sure=sure, window=window)


def gains(witness: Witness, sorter: Sorter, u: Index, v: Index, *, offset: float) -> Float32:
    """Return how much better each pixel fits at its disparity than at the floor's.

    Parameters
    ----------
    witness : Witness
    sorter : Sorter
        The disparities and the floor's; above the horizon the floor is infinitely far.
    u, v : ndarray of int64, shape (N,)
        Columns and rows, all matched.
    offset : float
        In the disparities, not in the images [px].

    Returns
    -------
    ndarray of float32, shape (N,)
        Squared differences of grey levels.
    """
    return witness.gains(u, v, *_claims(sorter, u, v, offset))


def _claims(sorter: Sorter, u: Index, v: Index, offset: float) -> tuple[Float32, Float32]:
    """Return the raw disparities of pixels and of the floor there."""
    shift = np.float32(offset)
    floor = np.maximum(sorter.surface.at(u, v), 0)
    return sorter.disparity[v, u] - shift, floor - shift


def _around(places: NDArray[np.generic], window: int, size: int) -> slice:
    """Return the rows or columns of all windows around these places, and one more."""
    first, last = int(places.min()), int(places.max())
    return slice(max(0, first - window // 2), min(size, last + 2 + window // 2))


def _squared(difference: Float32) -> Float32:
    limited: Float32 = np.minimum(np.abs(difference), np.float32(_LARGEST))
    return limited * limited


def _between(image: Float32, u: Float32, v: Index) -> Float32:
    """Return an image at fractional columns, linear between."""
    u = np.clip(u, 0, image.shape[1] - _LAST)
    whole = u.astype(np.int64)
    part = (u - whole).astype(np.float32)
    value: Float32 = (1 - part) * image[v, whole] + part * image[v, whole + 1]
    return value


def _flattened(image: UInt8, window: tuple[int, int]) -> Float32:
    flat: Float32 = image.astype(np.float32)
    flat -= cv2.blur(flat, window)
    return flat

"""From the pair as the lenses see it to the rectified pair, by maps built once."""

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.errors import InputError
from bearcub.messages import Float64, UInt8
from bearcub.rig.camera import Lens, Rectification

_Maps = tuple[NDArray[np.int16], NDArray[np.uint16]]


class Rectifier:
    """Rectifies pairs of one size; the maps are built at the first pair.

    Parameters
    ----------
    rectification : Rectification
        From `bearcub.rig.Rig.rectification`. Pairs of another size than its camera's are taken
        as the same view scaled.
    """

    def __init__(self, rectification: Rectification) -> None:
        self._rectification = rectification
        self._size = (0, 0)
        self._maps: tuple[_Maps, ...] = ()

    def __call__(self, left: UInt8, right: UInt8) -> tuple[UInt8, UInt8]:
        """Return the rectified pair, of the same size; black where the raw image has nothing.

        Parameters
        ----------
        left, right : ndarray of uint8, shape (H, W) or (H, W, 3)

        Returns
        -------
        left, right : ndarray of uint8, shapes as given

        Raises
        ------
        InputError
            If the two sizes differ, or their aspect is not that of the calibration.
        """
        height, width = left.shape[:2]
        if right.shape[:2] != (height, width):
            raise InputError(
                f"the left image is {width} x {height} px, the right one {right.shape[1]} x "
                f"{right.shape[0]} px: expected one size"
            )
        if self._size != (width, height):
            self._maps = _maps(self._rectification.for_image(width=width, height=height))
            self._size = (width, height)
        return _remap(left, self._maps[0]), _remap(right, self._maps[1])


def _remap(image: UInt8, maps: _Maps) -> UInt8:
    return np.asarray(cv2.remap(image, *maps, cv2.INTER_LINEAR), dtype=np.uint8)


def _maps(rectification: Rectification) -> tuple[_Maps, ...]:
    size = (rectification.camera.width, rectification.camera.height)
    return (
        _lens_maps(rectification.left, rectification.left_projection, size),
        _lens_maps(rectification.right, rectification.right_projection, size),
    )


def _lens_maps(lens: Lens, projection: Float64, size: tuple[int, int]) -> _Maps:
    fisheye = lens.model == "equidistant"
    build = cv2.fisheye.initUndistortRectifyMap if fisheye else cv2.initUndistortRectifyMap
    whole, fraction = build(
        lens.matrix, lens.coefficients, lens.rectified_from_raw, projection, size, cv2.CV_16SC2
    )
    return np.asarray(whole, dtype=np.int16), np.asarray(fraction, dtype=np.uint16)

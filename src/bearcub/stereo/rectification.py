"""From the pair as the lenses see it to the rectified pair, by maps built once."""

import cv2
import numpy as np

from bearcub.errors import InputError
from bearcub.messages import Float64, UInt8
from bearcub.rig.camera import Lens, Rectification
from bearcub.stereo.native import NativeRemap, RawPixels, reason_missing


class Rectifier:
    """Rectifies pairs of one size; the maps are built at the first pair.

    Parameters
    ----------
    rectification : Rectification
        From `bearcub.rig.Rig.rectification`. Pairs of another size than its camera's are taken
        as the same view scaled.
    threads : int
        That the compiled core uses, which rectifies grey pairs where it is there.
    """

    def __init__(self, rectification: Rectification, *, threads: int = 1) -> None:
        self._rectification = rectification
        self._threads = threads
        self._size = (0, 0)
        self._maps: tuple[RawPixels, RawPixels] | None = None
        self._native: NativeRemap | None = None

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
        left_map, right_map = self._maps_for(width=width, height=height)
        if left.ndim == right.ndim == 2 and not reason_missing():
            self._native = self._native or NativeRemap(left_map, right_map, threads=self._threads)
            return self._native(left, right)
        return _remap(left, left_map), _remap(right, right_map)

    def left(self, image: UInt8) -> UInt8:
        """Return the left image rectified alone, for a picture.

        Parameters
        ----------
        image : ndarray of uint8, shape (H, W) or (H, W, 3)

        Raises
        ------
        InputError
            If its aspect is not that of the calibration.
        """
        height, width = image.shape[:2]
        return _remap(image, self._maps_for(width=width, height=height)[0])

    def _maps_for(self, *, width: int, height: int) -> tuple[RawPixels, RawPixels]:
        if self._maps is None or self._size != (width, height):
            self._maps = _maps(self._rectification.for_image(width=width, height=height))
            self._size = (width, height)
            self._native = None
        return self._maps


def _remap(image: UInt8, maps: RawPixels) -> UInt8:
    return np.asarray(cv2.remap(image, *maps, cv2.INTER_LINEAR), dtype=np.uint8)


def _maps(rectification: Rectification) -> tuple[RawPixels, RawPixels]:
    size = (rectification.camera.width, rectification.camera.height)
    return (
        _lens_maps(rectification.left, rectification.left_projection, size),
        _lens_maps(rectification.right, rectification.right_projection, size),
    )


def _lens_maps(lens: Lens, projection: Float64, size: tuple[int, int]) -> RawPixels:
    fisheye = lens.model == "equidistant"
    build = cv2.fisheye.initUndistortRectifyMap if fisheye else cv2.initUndistortRectifyMap
    whole, fraction = build(
        lens.matrix, lens.coefficients, lens.rectified_from_raw, projection, size, cv2.CV_16SC2
    )
    return np.asarray(whole, dtype=np.int16), np.asarray(fraction, dtype=np.uint16)

"""From the projection matrices and lenses of two cameras to one rectified stereo camera."""

from dataclasses import replace

import cv2
import numpy as np

from bearcub.errors import CalibrationError
from bearcub.messages import Float64
from bearcub.rig.camera import Camera, Lens, Rectification
from bearcub.rig.values import LARGEST_NUMBER

Projections = tuple[tuple[float, ...], tuple[float, ...]]
"""The 3 x 4 projection matrices of the rectified left and right camera, row by row."""


def camera_from_projections(
    projections: Projections, *, size: tuple[int, int], unit: float | None
) -> Camera:
    """Return the camera of two projection matrices ``K [I | t]`` of one rectified pair.

    Only the difference of their fourth columns counts: the baseline is
    ``(P_left[0, 3] - P_right[0, 3]) / fx``, so the reference may be a third camera (KITTI).

    Parameters
    ----------
    projections : tuple of tuple of float, length 12 each
    size : tuple of int
        Width and height [px]; (0, 0) unknown.
    unit : float or None
        Metres per unit of length; None means 1.

    Raises
    ------
    CalibrationError
        If the two do not belong to one rectified pair with its cameras side by side.
    """
    left, right = projections
    fx, fy = left[0], left[5]
    if fx <= 0.0:
        raise CalibrationError(f"fx = {fx:g} px in the left P: expected a positive focal length")
    for name, index, tolerance in (("fx", 0, 1e-3 * fx), ("fy", 5, 1e-3 * fx), ("cy", 6, 0.5)):
        if abs(left[index] - right[index]) > tolerance:
            raise CalibrationError(
                f"{name} = {left[index]:g} px in the left P but {right[index]:g} px in the right "
                f"one: expected the same in both, as in one rectified pair"
            )
    across, down = left[3] - right[3], left[7] - right[7]
    if abs(down) > abs(across):
        raise CalibrationError(
            f"P[1, 3] differs by {down:g} and P[0, 3] by {across:g}: the cameras are one above "
            f"the other, expected side by side"
        )
    return Camera(
        width=size[0],
        height=size[1],
        fx=fx,
        fy=fy,
        cx=left[2],
        cy=left[6],
        baseline=across / fx * (unit or 1.0),
        doffs=right[2] - left[2],
    )


def needed_lenses(camera: Camera, lenses: tuple[Lens, Lens]) -> tuple[Lens, Lens] | None:
    """Return the lenses, or None where the raw pair is the rectified one."""
    both = Rectification(camera=camera, left=lenses[0], right=lenses[1])
    return lenses if both.needed else None


def rectify_lenses(
    lenses: tuple[Lens, Lens], rotation: Float64, translation: Float64, size: tuple[int, int]
) -> tuple[Projections, tuple[Lens, Lens]]:
    """Find the common rectified view of two lenses (OpenCV's ``stereoRectify``, no black border).

    Fisheye lenses keep the resolution of their image's middle: no plane image can hold their whole
    view, and theirs is wider than that of a plane image of the same focal length and size.

    Parameters
    ----------
    lenses : tuple of Lens
        Left and right; their `rotation` is replaced.
    rotation, translation : ndarray of float64, shape (3, 3), (3,)
        ``X_right = rotation X_left + translation``.
    size : tuple of int
        Width and height [px].

    Raises
    ------
    CalibrationError
        If no such view exists.
    """
    left, right = lenses
    try:
        found = cv2.stereoRectify(
            *(left.matrix, _bending(left), right.matrix, _bending(right), size),
            *(rotation, translation.reshape(3, 1)),
            flags=cv2.CALIB_ZERO_DISPARITY,
            alpha=0.0,
        )[:4]
    except cv2.error:
        raise CalibrationError("the lenses have no common rectified view") from None
    matrices = [np.asarray(matrix, dtype=np.float64) for matrix in found]
    if not all((np.abs(matrix) < LARGEST_NUMBER).all() for matrix in matrices):
        raise CalibrationError("the lenses have no common rectified view")
    flat = [tuple(float(entry) for entry in matrix.ravel()) for matrix in matrices]
    turned = replace(left, rotation=flat[0]), replace(right, rotation=flat[1])
    return (flat[2], flat[3]), turned


def _bending(lens: Lens) -> Float64:
    """Return what the choice of the view has to know of the distortion."""
    return np.zeros(4) if lens.model == "equidistant" else lens.coefficients

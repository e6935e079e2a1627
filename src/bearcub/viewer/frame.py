"""The annotated frame: the picture and the plan view side by side, ready for a video."""

import cv2
import numpy as np

from bearcub.messages import Answer, UInt8
from bearcub.rig import Rig
from bearcub.viewer.birdseye import birdseye
from bearcub.viewer.overlay import overlay
from bearcub.viewer.palette import NIGHT


def annotate(answer: Answer, image: UInt8 | None, rig: Rig, *, reach: float | None = None) -> UInt8:
    """Draw an answer over the left image, with the plan view beside it.

    Parameters
    ----------
    answer : Answer
        Of this frame.
    image : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        The rectified left image; None draws the disparity.
    rig : Rig
        Camera of the size of the answer's layers, and its mount.
    reach : float, optional
        How far ahead the plan view shows [m]; fix it for a video.

    Returns
    -------
    ndarray of uint8, shape (rows, columns, 3)
        BGR; rows and columns are even and depend on the image's size alone.

    Raises
    ------
    InputError
        If `image` is no picture of the layers' size.
    """
    picture = overlay(answer, image, rig.camera.projection)
    height = picture.shape[0]
    plan = birdseye(answer, rig, size=(max(height, 360), height), reach=reach)
    return side_by_side(picture, plan)


def side_by_side(left: UInt8, right: UInt8) -> UInt8:
    """Put two pictures beside each other, the right one scaled to the left one's height.

    Returns
    -------
    ndarray of uint8, shape (rows, columns, 3)
        BGR, with even rows and columns, as video codecs want them.

    Examples
    --------
    >>> side_by_side(np.zeros((31, 40, 3), np.uint8), np.zeros((62, 60, 3), np.uint8)).shape
    (32, 74, 3)
    """
    height = left.shape[0]
    if right.shape[0] != height:
        width = round(right.shape[1] * height / right.shape[0])
        right = np.asarray(
            cv2.resize(right, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8
        )
    gap = np.full((height, 4, 3), NIGHT, dtype=np.uint8)
    both = np.hstack([left, gap, right])
    rows, columns = both.shape[0] % 2, both.shape[1] % 2
    padded = cv2.copyMakeBorder(both, 0, rows, 0, columns, cv2.BORDER_CONSTANT, value=NIGHT)
    return np.asarray(padded, dtype=np.uint8)

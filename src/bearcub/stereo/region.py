"""Which rows of the image can hold anything that is in the robot's way."""

import math

import numpy as np

from bearcub.geometry import Attitude, Float64
from bearcub.rig.model import Camera

_SIGMAS = 3.0  # of attitude and height that are allowed for
_ABOVE = 16  # rows that a matcher needs to get going
_STEP = 32  # rows: a matcher sets itself up anew for every size
_MOST = 0.5  # share of the rows that is left out at most


def first_row(
    camera: Camera,
    *,
    height: float,
    attitude: Attitude,
    sigma: Float64,
    clearance: float,
    nearest: float,
    farthest: float,
) -> int:
    """Return the first row that shows something lower than the robot is high.

    A point at height C above a level floor and at depth Z stands in the row

        v = cy + fy ((h - C) / Z - n_x x - n_z) / n_y,   x = (u - cx) / fx ,

    with ``n`` the direction down to the floor. What is above that row everywhere between the
    nearest and the farthest depth is higher than C, or farther away. Where the robot is higher
    than its camera, the nearest depth tells, and hardly a row is left out.

    Parameters
    ----------
    camera : Camera
        At the size of the images to match.
    height : float
        Of the camera above the floor, as expected [m].
    attitude : Attitude
        Of the camera against the floor, as expected.
    sigma : ndarray of float64, shape (3,)
        Of height [m], pitch and roll [rad]; three of them are allowed for.
    clearance : float
        What is higher than this is not in the way [m].
    nearest, farthest : float
        Depths that matter [m].

    Returns
    -------
    int
        A multiple of 32, half the rows at most.

    Examples
    --------
    The rig of the paper, on a robot 0.8 m high, with the sigmas of a tilt sensor; its horizon is
    row 200.

    >>> vga = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
    >>> expected = {"height": 1.2, "attitude": Attitude(roll=0.0, pitch=np.radians(5.9))}
    >>> sigma = np.array([0.12, np.radians(1.5), np.radians(1.5)])
    >>> first_row(vga, **expected, sigma=sigma, clearance=0.8, nearest=1.0, farthest=20.0)
    128
    >>> first_row(vga, **expected, sigma=sigma, clearance=2.0, nearest=1.0, farthest=20.0)
    0
    """
    lowest, pitch, roll = _SIGMAS * sigma
    above = max(height - lowest, 0.5 * height) - clearance
    x = (np.array([0.0, camera.width - 1.0]) - camera.cx) / camera.fx
    rows = [
        camera.cy + camera.fy * (above / depth - n_x * x - n_z) / n_y
        for depth in (nearest, farthest)
        for n_x, n_y, n_z in (
            Attitude(roll=attitude.roll, pitch=attitude.pitch + pitch).down(),
            Attitude(roll=attitude.roll - roll, pitch=attitude.pitch).down(),
            Attitude(roll=attitude.roll + roll, pitch=attitude.pitch).down(),
        )
    ]
    highest = min(float(np.min(rows)) - _ABOVE, _MOST * camera.height)
    return max(math.floor(highest / _STEP), 0) * _STEP

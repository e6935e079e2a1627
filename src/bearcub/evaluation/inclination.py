"""The inclination of a floor against gravity, from its direction as a camera sees both."""

import math

from bearcub.geometry import Attitude, base_from_optical, forward_in_camera
from bearcub.messages import Float64


def inclination(floor: Float64, *, gravity: Float64, mount: Attitude) -> tuple[float, float]:
    """Return slope (up ahead positive) and cross slope (up to the left positive) [rad].

    Parameters
    ----------
    floor : ndarray of float64, shape (3,)
        Unit vector to the floor, square to it, in optical axes.
    gravity : ndarray of float64, shape (3,)
        Direction of gravity in optical axes.
    mount : Attitude
        Of the camera against the body, which says where ahead is.

    Examples
    --------
    A level camera over a floor that comes up to meet it:

    >>> level = Attitude(roll=0.0, pitch=0.0)
    >>> floor = Attitude(roll=0.0, pitch=math.radians(5)).down()
    >>> [round(math.degrees(x), 6) for x in inclination(floor, gravity=level.down(), mount=level)]
    [5.0, 0.0]
    """
    x, y, z = base_from_optical(gravity, forward_in_camera(mount)) @ -floor
    return math.atan2(-x, z), math.atan2(-y, z) + 0.0

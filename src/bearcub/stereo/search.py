"""Which disparities to search: from infinity to the nearest thing that matters."""

import math

import numpy as np

from bearcub.geometry import Attitude
from bearcub.rig.model import Camera, Mount
from bearcub.stereo.matchers import SearchRange

_PITCH = math.radians(10.0)  # how far the body may nod, without a better word from the mount
_ROLL = math.radians(15.0)
_HEIGHT = 0.85  # of the mount's height: the least the camera may be above the ground


def search_range(camera: Camera, mount: Mount, *, nearest: float = 0.0) -> SearchRange:
    """Return the disparities that a matcher must try for this rig.

    The far end is infinity: ``-doffs`` in disparities as measured. The near end is the disparity
    ``fx B / Z`` of the nearest range; by itself, that of the nearest floor in view, in the worst
    corner of the image, with the body nodding by 10 deg or rolling by 15 deg and the camera 15 %
    lower than mounted (or by the mount's own sigmas, where it has them). A
    quarter of the image width is the most (nearer, the two views hardly overlap), a tenth the
    least, rounded up to what the matchers want, a multiple of 16.

    Parameters
    ----------
    camera : Camera
        At the size of the images to match.
    mount : Mount
        Height and attitude of the camera.
    nearest : float
        Nearest range to search [m]; 0 takes the floor.

    Returns
    -------
    SearchRange

    Examples
    --------
    The rig of the paper: the floor's disparity at the lower corners is 32 px at most.

    >>> vga = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
    >>> search_range(vga, Mount(height=1.2, pitch=np.radians(5.9)))
    SearchRange(smallest=0, count=64)
    >>> search_range(vga, Mount(height=1.2), nearest=0.4)
    SearchRange(smallest=0, count=128)
    """
    if nearest > 0.0:
        largest = camera.fx * camera.baseline / nearest
    else:
        largest = min(_nearest_floor(camera, mount), camera.width / 4)
        largest = max(largest, camera.width / 10 - 1)
    smallest = math.floor(-camera.doffs)
    count = math.ceil(min(largest, camera.width - 1) - camera.doffs) - smallest + 1
    return SearchRange(smallest=smallest, count=16 * max(math.ceil(count / 16), 1))


def _nearest_floor(camera: Camera, mount: Mount) -> float:
    """Return the largest disparity of the floor in view, in the worst attitude expected [px]."""
    pitch = _or_default(mount.sigma_pitch, _PITCH)
    roll = _or_default(mount.sigma_roll, _ROLL)
    lowest = mount.height - _or_default(mount.sigma_height, (1.0 - _HEIGHT) * mount.height)
    corners = np.array([(u, v, 1) for u in (0, camera.width - 1) for v in (0, camera.height - 1)])
    attitudes = (
        Attitude(roll=mount.roll, pitch=mount.pitch + pitch),
        Attitude(roll=mount.roll - roll, pitch=mount.pitch),
        Attitude(roll=mount.roll + roll, pitch=mount.pitch),
    )
    height = max(lowest, 0.5 * mount.height)
    return max(
        float((corners @ camera.projection.plane(height=height, down=attitude.down())).max())
        for attitude in attitudes
    )


def _or_default(sigma: float, default: float) -> float:
    return default if math.isnan(sigma) else sigma

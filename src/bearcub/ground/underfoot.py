"""The ground under the robot, where higher or lower ground fills the view.

Close before a step nearly all that is seen is the ground behind it, and the plane that most pixels
support is that one. The strip before the step, at the image's lower border, would be taken for a
thing or for a hole. But it lies as deep under the camera as the mount says, and the other does not.
"""

import numpy as np

from bearcub.geometry import Projection
from bearcub.ground.fit import PlaneFit
from bearcub.ground.prior import Prior
from bearcub.messages import Float32
from bearcub.robust import median

_ROWS = 40  # part of the image's rows that the robot is nearest to
_HALF_WIDTH = 0.5  # of the robot's way [m]
_SEEN = 0.5  # share of the pixels there that must be matched, and of these that must lie level
_SIGMAS = 3.0  # of its noise that level ground is off


def height_underfoot(
    disparity: Float32, projection: Projection, fit: PlaneFit, prior: Prior, *, unevenness: float
) -> float:
    """Return the height of the camera above the ground just before the robot [m].

    It is taken to be parallel to the plane that was fitted: how it lies itself is found by
    following it.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Adjusted [px], NaN unmatched.
    projection : Projection
    fit : PlaneFit
        Of what fills the view.
    prior : Prior
    unevenness : float
        Height of bumps that are still floor [m].

    Returns
    -------
    float
        That above the fitted plane, unless it is farther off than the mount's 1-sigma allows and
        what lies before the robot is level and as far below the camera as the mount says.
    """
    height, _ = projection.floor(fit.plane)
    mounted, sigma = prior.height, float(prior.sigma[0])
    if abs(height - mounted) <= sigma:
        return height
    rows, columns = disparity.shape
    v, u = np.mgrid[rows - max(1, rows // _ROWS) : rows, 0:columns]
    floor = fit.plane[0] * u + fit.plane[1] * v + fit.plane[2]
    d = disparity[v, u]
    way = np.abs(u - projection.cx) * projection.baseline < _HALF_WIDTH * floor
    known = way & (d > 0)  # NaN compares false
    if np.count_nonzero(known) <= _SEEN * np.count_nonzero(way):
        return height
    below = height * floor[known] / d[known]  # the camera, each pixel
    near = median(below)
    off = _SIGMAS * fit.noise * below / d[known] + unevenness
    level = np.count_nonzero(np.abs(below - near) < off)
    found = abs(near - mounted) <= sigma and level > _SEEN * len(below)
    return near if found else height

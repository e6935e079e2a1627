"""Every pixel against the floor: above it, on it, or below it (the paper's floor cancellation)."""

from dataclasses import dataclass

import numpy as np

from bearcub.ground.surface import floor_surface
from bearcub.messages import Bool, Float32, Ground


@dataclass(frozen=True, slots=True, kw_only=True)
class Sorting:
    """The pixels of one frame sorted by the floor, arrays of shape (H, W).

    Attributes
    ----------
    disparity, floor, noise : ndarray of float32
        Measured; of the floor; 1-sigma of a pixel of floor [px].
    residual : ndarray of float32
        Measured less floor [px]; NaN unmatched.
    allowed : ndarray of float32
        How far from the floor a pixel may lie and still be floor [px].
    standing, on_floor, below : ndarray of bool
    """

    disparity: Float32
    floor: Float32
    noise: Float32
    residual: Float32
    allowed: Float32
    standing: Bool
    on_floor: Bool
    below: Bool


def sort_by_floor(
    disparity: Float32, ground: Ground, *, sigmas: float, unevenness: float, farthest_level: float
) -> Sorting:
    """Sort the pixels of a disparity map by the floor.

    The tolerance is `sigmas` times the noise at that level, and the bumps that still are floor: a
    bump H high adds ``d H / h`` to the disparity d.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px], NaN unmatched.
    ground : Ground
    sigmas : float
    unevenness : float
        Height of bumps that still are floor [m].
    farthest_level : float
        Least disparity of floor that is told from the horizon [px].

    Returns
    -------
    Sorting
    """
    surface = floor_surface(ground, disparity.shape)
    floor = surface.floor
    allowed = floor * np.float32(unevenness / ground.height)
    np.maximum(allowed, 0, out=allowed)
    allowed += np.float32(sigmas) * surface.noise
    residual = disparity - floor
    floor_here = floor > farthest_level
    standing = residual > allowed  # NaN compares false
    below = (residual < -allowed) & floor_here
    known = residual == residual  # noqa: PLR0124 (False for NaN, faster than isfinite)
    on_floor = known & floor_here & ~(standing | below)
    return Sorting(
        disparity=disparity,
        floor=floor,
        noise=surface.noise,
        residual=residual,
        allowed=allowed,
        standing=standing,
        on_floor=on_floor,
        below=below,
    )

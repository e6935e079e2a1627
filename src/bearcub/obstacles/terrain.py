"""How the ground lies: slope, cross slope, roughness and its profile by range."""

import math

import numpy as np

from bearcub.geometry import Attitude, Float64, base_from_optical
from bearcub.messages import Bool, Float32, Ground, SlopeBand, Terrain
from bearcub.obstacles.measure import View

_BAND = (1.5, 5.0)  # where slope and cross slope are taken [m] (the contract)
_STEP = 0.5  # length of a band of the profile [m]
_PIXELS = 6000
_HALF_WIDTH = 1.5  # of the strip ahead whose slope is told [m]
_CORRELATED = 12.0


def lie_of_the_land(
    disparity: Float32,
    on_floor: Bool,
    view: View,
    ground: Ground,
    *,
    gravity: Float64 | None,
) -> Terrain:
    """Tell how the ground ahead is inclined.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px].
    on_floor : ndarray of bool, shape (H, W)
    view : View
        Over `ground`.
    ground : Ground
    gravity : ndarray of float64, shape (3,), or None
        Direction of gravity in optical axes; without it slopes are against the ground under the
        robot.

    Returns
    -------
    Terrain
        With NaN where too little floor was seen.
    """
    reference = "robot" if gravity is None else "gravity"
    stride = max(1, int(math.sqrt(on_floor.size / (2 * _PIXELS))))
    v, u = np.nonzero(on_floor[::stride, ::stride])
    u, v = u * stride, v * stride
    d = disparity[v, u].astype(np.float64)
    points = view.points(u.astype(np.float64), v.astype(np.float64), d)
    if gravity is not None:
        points = _level(points, view, ground, gravity)
    x, y, z = points.T
    sigma_z = ground.height * ground.noise / np.maximum(d, 1e-3)
    whole = _fit(x, y, z, sigma_z, *_BAND, stride=stride)
    bands = []
    for start in np.arange(_BAND[0], _BAND[1], _STEP):
        fit = _fit(x, y, z, sigma_z, start, start + _STEP, stride=stride)
        if fit is not None and fit[2] < math.radians(5.0):
            bands.append(
                SlopeBand(start=float(start), end=float(start + _STEP), slope=fit[0], sigma=fit[2])
            )
    nan = math.nan
    if whole is None:
        return Terrain(
            slope=nan,
            cross_slope=nan,
            sigma=nan,
            roughness=nan,
            reference=reference,
            profile=tuple(bands),
        )
    slope, cross, sigma, rough = whole
    sigma = math.hypot(sigma, max(ground.sigma_pitch, ground.sigma_roll))
    return Terrain(
        slope=slope,
        cross_slope=cross,
        sigma=sigma,
        roughness=rough,
        reference=reference,
        profile=tuple(bands),
    )


def _level(points: Float64, view: View, ground: Ground, gravity: Float64) -> Float64:
    """Turn points over the ground into the level frame of gravity, same heading."""
    forward = view.base_from_optical[0]
    down = Attitude(roll=ground.roll, pitch=ground.pitch).down()
    level_from_base = base_from_optical(gravity, forward) @ base_from_optical(down, forward).T
    turned: Float64 = (points - view.origin) @ level_from_base.T
    return turned + view.origin


def _fit(
    x: Float64, y: Float64, z: Float64, sigma_z: Float64, start: float, end: float, *, stride: int
) -> tuple[float, float, float, float] | None:
    """Fit z = z0 + sx x + sy y to a strip; return slope, cross slope, sigma [rad], roughness."""
    inside = (x >= start) & (x < end) & (np.abs(y) < _HALF_WIDTH)
    if np.count_nonzero(inside) < 40 or np.ptp(x[inside]) < 0.5 * (end - start):
        return None
    px, py, pz, weight = x[inside], y[inside], z[inside], sigma_z[inside] ** -2.0
    design = np.stack([np.ones_like(px), px, py], axis=1)
    for _ in range(3):
        normal = (design * weight[:, None]).T @ design
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        solution = inverse @ ((design * weight[:, None]).T @ pz)
        residual = pz - design @ solution
        scale = max(1e-4, 1.4826 * float(np.median(np.abs(residual))))
        weight = sigma_z[inside] ** -2.0 * (np.abs(residual) < 3 * scale)
    each = max(1.0, _CORRELATED / stride**2)
    sigma = math.sqrt(each * max(inverse[1, 1], inverse[2, 2]))
    rough = math.sqrt(max(0.0, scale**2 - float(np.median(sigma_z[inside])) ** 2))
    return math.atan(solution[1]), math.atan(solution[2]), sigma, rough

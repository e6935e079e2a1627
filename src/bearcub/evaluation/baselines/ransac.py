"""RANSAC plane and clusters: the usual way with point clouds.

500 planes through three random points each [1]_; the one with most points within 5 cm (and within
a pixel of disparity where that is more), fitted once more to those. Only planes within 20 deg of
the attitude that mount and tilt reading tell, and from half to twice the mount's height, are
considered. Points more than 0.1 m above it and twice that tolerance form clusters on a grid of
0.1 m. So do points as far below it: holes, whose mouth is where the lines of sight to them cross
the plane.

References
----------
.. [1] Fischler and Bolles, "Random sample consensus", Communications of the ACM, 1981.
"""

import math

import numpy as np

from bearcub.evaluation.baselines.clusters import clustered
from bearcub.evaluation.baselines.frame import LEAST_HEIGHT, Frame, measured
from bearcub.evaluation.report import Found, Report
from bearcub.messages import Float64

_TRIALS = 500
_POINTS = 3000
_INLIER = 0.05  # [m]
_STEEPEST = math.radians(20.0)
_HIGHEST = 2.0  # [m]


def answer(frame: Frame) -> Report:
    """Answer one frame; the same frame gives the same answer."""
    mount, camera = frame.rig.mount, frame.rig.camera
    down = frame.expected.down()
    points = frame.points(down=down, height=mount.height)
    seen = np.isfinite(points[..., 2])
    cloud = points[seen]
    normal, offset = _plane(cloud, mount.height, camera.fx * camera.baseline)
    height = float(normal[2] * mount.height + normal[:2] @ (mount.x, mount.y) + offset)
    floor = frame.level_from_optical(down).T @ -normal
    placed = frame.points(down=floor, height=height)[seen]
    slack = 2.0 * _tolerance(placed, height, camera.fx * camera.baseline)
    up = placed[:, 2]
    standing = placed[(up > np.maximum(LEAST_HEIGHT, slack)) & (up < _HIGHEST)]
    below = placed[up < -np.maximum(LEAST_HEIGHT, slack)]
    return frame.report(
        measured(standing, clustered(standing)),
        height=height,
        down=floor,
        holes=_holes(below, height, (mount.x, mount.y)),
    )


def _holes(below: Float64, height: float, foot: tuple[float, float]) -> tuple[Found, ...]:
    """Return the mouths through which points below the floor are seen.

    Parameters
    ----------
    below : ndarray of float64, shape (N, 3)
    height : float
        Of the camera above the floor [m].
    foot : tuple of float
        The place under the camera [m].
    """
    labels = clustered(below)
    share = height / (height - below[:, 2:])
    mouth = np.concatenate([foot + (below[:, :2] - foot) * share, 0.0 * share], axis=1)
    return tuple(
        Found(
            distance=hole.distance,
            bearing=hole.bearing,
            width=hole.width,
            depth=float(-np.quantile(below[labels == k, 2], 0.02)),
        )
        for k, hole in enumerate(measured(mouth, labels), 1)
    )


def _tolerance(points: Float64, height: float, focal_baseline: float) -> Float64:
    """Return what a point of the floor may be off: 5 cm, or what a pixel of disparity makes."""
    far = np.hypot(points[:, 0], points[:, 1])
    off: Float64 = np.maximum(_INLIER, height * far / focal_baseline)
    return off


def _plane(cloud: Float64, height: float, focal_baseline: float) -> tuple[Float64, float]:
    """Return (n, k) of the floor ``n . p + k = 0`` with n up; the expected one without points."""
    best = np.array([0.0, 0.0, 1.0]), 0.0
    if len(cloud) < 3:
        return best
    rng = np.random.default_rng(0)
    sample = cloud[rng.integers(len(cloud), size=_POINTS)]
    slack = _tolerance(sample, height, focal_baseline)
    corners = sample[rng.integers(_POINTS, size=(_TRIALS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals, corners = normals[lengths > 0.0], corners[lengths > 0.0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals *= np.where(normals[:, 2:] < 0.0, -1.0, 1.0)
    offsets = -(normals * corners[:, 0]).sum(axis=1)
    above = normals[:, 2] * height + offsets
    likely = (normals[:, 2] > math.cos(_STEEPEST)) & (above > 0.5 * height) & (above < 2.0 * height)
    if not likely.any():
        return best
    normals, offsets = normals[likely], offsets[likely]
    inside = np.abs(sample @ normals.T + offsets) < slack[:, None]
    winner = int(inside.sum(axis=0).argmax())
    return _refined(sample[inside[:, winner]], normals[winner], float(offsets[winner]))


def _refined(points: Float64, normal: Float64, offset: float) -> tuple[Float64, float]:
    """Return the least-squares plane of points; the given one where they are too few."""
    if len(points) < 10:
        return normal, offset
    centre = points.mean(axis=0)
    found = np.linalg.svd(points - centre, full_matrices=False)[2][2]
    found = found if found[2] > 0.0 else -found
    return found, float(-(found @ centre))

"""The exact truth of a view, with rays cast only where a part can be seen.

The same analytic surfaces in double precision as the ray caster's; a part that is bounded is asked
about the pixels of its bounding box alone.
"""

import math
from dataclasses import replace

import numpy as np

from bearcub.messages import Bool, Float64
from bearcub.sim import truth
from bearcub.sim.mujoco.bounds import corners
from bearcub.sim.render import SKY, View
from bearcub.sim.world import Scene

_MARGIN = 1.0  # a box's corners are exact, the pixels' centres half a pixel off [px]


def cast(scene: Scene, view: View) -> truth.Hits:
    """Meet the scene along the ray through every left pixel's centre."""
    camera = view.camera
    shape = (camera.height, camera.width)
    rays = view.rays(np.arange(shape[1], dtype=np.float64), np.arange(shape[0], dtype=np.float64))
    grid = rays.reshape(3, *shape)
    origin = view.position[:, None]
    depth = np.full(shape, np.inf)
    labels = np.full(shape, SKY, dtype=np.int32)
    alone: dict[int, Bool] = {}
    with np.errstate(all="ignore"):
        for part, label in scene.parts():
            covered = alone.setdefault(label, np.zeros(shape, dtype=bool))
            window = _window(corners(part), view)
            asked = grid[:, *window]
            t = part.hit(origin, asked.reshape(3, -1)).reshape(asked.shape[1:])
            nearer = t < depth[window]
            depth[window][nearer], labels[window][nearer] = t[nearer], label
            covered[window] |= np.isfinite(t)
        points = origin + depth.reshape(-1) * rays
    return truth.Hits(
        pixel=1.0 / camera.fx,
        depth=depth,
        labels=labels,
        points=points.reshape(3, *shape),
        alone=alone,
    )


def behind_grass(hits: truth.Hits, blades: Float64, view: View) -> truth.Hits:
    """Return the hits with standing blades before them.

    A blade's pixel has the blade's disparity and the label 0, ground: grass grows on the ground
    and is no obstacle. What it hides of a thing is not seen of it.

    Parameters
    ----------
    hits : Hits
    blades : ndarray of float64, shape (H, W)
        Depth of the nearest blade [m], inf where there is none.
    view : View
    """
    covered = blades < hits.depth
    if not covered.any():
        return hits
    v, u = np.nonzero(covered)
    camera, depth = view.camera, blades[covered]
    sight = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.size)])
    points = hits.points.copy()
    points[:, covered] = view.position[:, None] + view.level_from_optical @ (sight * depth)
    return replace(
        hits,
        depth=np.where(covered, blades, hits.depth),
        labels=np.where(covered, np.int32(0), hits.labels),
        points=points,
    )


def _window(points: Float64 | None, view: View) -> tuple[slice, slice]:
    """Return the rows and columns in which a body with these corners (3, N) may be seen."""
    camera = view.camera
    everywhere = (slice(0, camera.height), slice(0, camera.width))
    if points is None:
        return everywhere
    x, y, z = view.level_from_optical.T @ (points - view.position[:, None])
    if z.min() < 1e-3:  # a corner behind the camera has no place in the image
        return everywhere
    u, v = camera.cx + camera.fx * x / z, camera.cy + camera.fy * y / z
    return _span(v, camera.height), _span(u, camera.width)


def _span(values: Float64, size: int) -> slice:
    low = math.floor(float(values.min()) - _MARGIN)
    high = math.ceil(float(values.max()) + _MARGIN) + 1
    return slice(min(max(low, 0), size), min(max(high, 0), size))

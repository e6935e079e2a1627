"""A planar LADAR in a scene: exact rays, and what a scanner makes of them."""

import numpy as np

from bearcub.geometry import Attitude, rotation
from bearcub.messages import Float64, Scan
from bearcub.sim.sensors import LadarModel
from bearcub.sim.world import Scene

BEAMS = 361
HEIGHT = 0.3
"""Above the ground under the left camera, where the LADAR sits [m]."""

_PERFECT = LadarModel(sigma=0.0, quantum=1e-6, lost=0.0)


def sweep(scene: Scene, body: Attitude, *, seed: int | None = None) -> Scan:
    """Return one sweep of half a turn, in steps of half a degree.

    The LADAR is fixed to the body, straight below the left camera: it pitches and rolls with it,
    and then sees the ground. It sees no grass.

    Parameters
    ----------
    scene : Scene
    body : Attitude
        Of the body against gravity [rad].
    seed : int, optional
        Of the noise and the lost beams of a `LadarModel`; without it the ranges are exact.

    Returns
    -------
    Scan
        +inf where nothing is within reach.
    """
    angles = np.radians(np.linspace(-90.0, 90.0, BEAMS))
    beams = np.stack([np.cos(angles), np.sin(angles), np.zeros(BEAMS)])
    ranges = _exact(scene, rotation(roll=body.roll, pitch=body.pitch) @ beams)
    model = _PERFECT if seed is None else LadarModel()
    return model.measured(ranges, angles, np.random.default_rng((seed or 0, BEAMS)))


def _exact(scene: Scene, rays: Float64) -> Float64:
    """Return how far rays of unit length get [m], shape (N,); inf in the open."""
    origin = np.array([[0.0], [0.0], [HEIGHT]])
    reach = np.full(rays.shape[1], np.inf)
    with np.errstate(all="ignore"):
        for part, _ in scene.parts():
            reach = np.fmin(reach, part.hit(origin, rays))
    return reach

"""The standing grass of a scene as meshes for MuJoCo."""

from dataclasses import replace

import numpy as np

from bearcub.messages import Float64, UInt8
from bearcub.sim.grass import Blades, blades, palette
from bearcub.sim.light import Light
from bearcub.sim.sensor import quantised
from bearcub.sim.world import Ground, Scene


def lawns(scene: Scene, light: Light, *, seed: int) -> list[Blades]:
    """Return the blades of every patch, on the ground; none stand in pits."""
    sun = light.towards_sun(scene.sun)
    grown = [blades(patch, sun=sun, seed=seed + index) for index, patch in enumerate(scene.grass)]
    return [_rooted(grass, scene.ground) for grass in grown]


def palette_image(light: Light) -> UInt8:
    """Return the colours of the blades (red, green, blue), shape (steps, tones, 3)."""
    image: UInt8 = quantised(palette(light))[::-1].transpose(1, 2, 0)
    return np.ascontiguousarray(image)


def _rooted(grass: Blades, ground: Ground) -> Blades:
    """Put blades on the ground and leave out those above pits."""
    x, y = grass.roots.T
    inside = np.zeros(len(x), dtype=bool)
    for pit in ground.pits:
        inside |= pit.mouth(x, y)
    lifted = grass.vertices + np.column_stack([np.zeros((len(x), 2)), heights(ground, x, y)])
    return replace(grass, vertices=lifted, faces=grass.faces[~inside[grass.faces[:, 0]]])


def heights(ground: Ground, x: Float64, y: Float64) -> Float64:
    """Return the ground's z [m] at points (pits filled), shape (N,)."""
    z = np.zeros_like(x)
    for plane in ground.planes:
        there = (x >= plane.start) & (x <= plane.end)
        z[there] = plane.at(0.0, 0.0) + plane.slope * x[there] + plane.cross * y[there]
    return z

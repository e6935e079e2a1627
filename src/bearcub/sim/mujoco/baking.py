"""The light that leaves every texel, so that MuJoCo has only to draw: no lamps, no shadow maps.

Sun, sky, cast shadows and haze are those of the ray caster, computed once for every texel. What
stands still may be baked, and the robot is the only thing that moves.
"""

from collections.abc import Hashable, Iterator
from functools import cache, lru_cache
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Bool, Float32, Float64, UInt8
from bearcub.sim.light import Light
from bearcub.sim.mujoco.bounds import corners
from bearcub.sim.mujoco.surfaces import Patch
from bearcub.sim.sensor import quantised
from bearcub.sim.solids import Solid
from bearcub.sim.texture import Reals, Texture
from bearcub.sim.world import PitInside, Plane, Scene

_CODES = 65535  # albedo and light are looked up in 16 bit
_LIFT = 2e-3  # shadow rays start so far from the surface [m]


class Baker:
    """Makes the textures of one scene in one light.

    Parameters
    ----------
    scene : Scene
        What is lit, and what casts shadows.
    light : Light
    eye : ndarray of float64, shape (3,)
        From where haze is reckoned, level [m].
    """

    def __init__(self, scene: Scene, light: Light, eye: Float64) -> None:
        self._light, self._eye = light, eye.astype(np.float32)
        self._sun = light.towards_sun(scene.sun).astype(np.float32)
        self._shadows = scene.shadows and light.shadows and light.strength > 0
        self._beside = _across(self._sun)
        self._casters = [
            (solid, *_extent(solid, self._beside))
            for thing in scene.things
            for solid in thing.parts
        ]

    def texture(self, patch: Patch) -> UInt8:
        """Return a patch's texture (red, green, blue), shape (rows, columns, 3)."""
        points = patch.place(*patch.centres()).astype(np.float32)
        normal, s, t = patch.part.surface(points)
        colour = _albedo(patch, s, t) * self.light_on(patch, points, normal)
        return _image(self._light.through_haze(colour, points - self._eye[:, None]), patch.texels)

    def light_on(self, patch: Patch, points: Reals, normal: Reals) -> Float32:
        """Return the light that falls on points of a patch, shape (3, N)."""
        sunny = np.clip(self._sun @ normal, 0.0, None)
        if self._shadows:
            sunny = sunny * ~self._in_shadow(patch, points + _LIFT * normal, sunny > 0)
        skyward = 0.6 + 0.4 * normal[2]
        if isinstance(patch.part, PitInside):
            skyward = skyward * patch.part.daylight(points)
        return self._light.falling(sunny, skyward)

    def _in_shadow(self, patch: Patch, points: Reals, lit: Bool) -> Bool:
        """Return which points things, or the walls of their own pit, keep the sun from."""
        shadow = np.zeros(points.shape[1], dtype=bool)
        if isinstance(patch.part, PitInside):
            shadow |= patch.part.shaded(points, self._sun.astype(np.float64))
        seen = self._beside @ points
        low, high = seen.min(axis=1), seen.max(axis=1)
        for solid, first, last in self._casters:
            if (first > high).any() or (last < low).any():
                continue
            inside = ((seen >= first[:, None]) & (seen <= last[:, None])).all(axis=0)
            asked = np.flatnonzero(inside & lit & ~shadow)
            if asked.size:
                shadow[asked] = np.isfinite(solid.hit(points[:, asked], self._sun[:, None]))
        return shadow


def sky_ramp(light: Light, steps: int) -> UInt8:
    """Return the sky from the horizon to the zenith, equal steps of ``sqrt(sin elevation)``.

    Shape (steps, 1, 3), red, green, blue.
    """
    share = (np.arange(steps) + 0.5) / steps
    return _image(light.sky(share**2), (1, steps))


def mip_maps(image: UInt8) -> Iterator[UInt8]:
    """Yield an image and its halves, quarters, ... down to one texel."""
    while True:
        yield image
        rows, columns = image.shape[:2]
        if max(rows, columns) == 1:
            return
        half = (max(1, columns // 2), max(1, rows // 2))
        image = np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _albedo(patch: Patch, s: Reals, t: Reals) -> Float32:
    if isinstance(patch.part, Plane):
        codes = _ground_albedo(cast(Hashable, patch.part.texture), patch.s, patch.t, patch.texels)
        return codes.astype(np.float32) / np.float32(_CODES)
    footprint = np.full(s.shape, patch.texel(), dtype=np.float32)
    return patch.part.texture.albedo(
        np.ascontiguousarray(s, np.float32), np.ascontiguousarray(t, np.float32), footprint
    )


@lru_cache(maxsize=1024)
def _ground_albedo(
    texture: Hashable, s: tuple[float, float], t: tuple[float, float], texels: tuple[int, int]
) -> NDArray[np.uint16]:
    """Return a tile's albedo in 16 bit; scenes on the same ground share it."""
    columns, rows = texels
    step_s, step_t = (s[1] - s[0]) / columns, (t[1] - t[0]) / rows
    grid = np.meshgrid(
        s[0] + (np.arange(columns) + 0.5) * step_s, t[0] + (np.arange(rows) + 0.5) * step_t
    )
    at = [np.ascontiguousarray(part.reshape(-1), np.float32) for part in grid]
    footprint = np.full(at[0].shape, max(step_s, step_t), dtype=np.float32)
    albedo = cast(Texture, texture).albedo(at[0], at[1], footprint)
    return np.rint(np.clip(albedo, 0, 1) * _CODES).astype(np.uint16)


def _across(sun: Float32) -> Float32:
    """Return two directions across the sun's rays, shape (2, 3)."""
    one = np.cross(sun, [0.0, 0.0, 1.0] if abs(sun[2]) < 0.9 else [1.0, 0.0, 0.0])
    one /= np.linalg.norm(one)
    return np.stack([one, np.cross(sun, one)]).astype(np.float32)


def _extent(solid: Solid, axes: Float32) -> tuple[Float64, Float64]:
    """Return the least and the greatest coordinates of a solid along two axes."""
    box = corners(solid)
    if box is None:
        return np.full(2, -np.inf), np.full(2, np.inf)
    along = axes @ box
    return along.min(axis=1), along.max(axis=1)


def _image(light: Float32, texels: tuple[int, int]) -> UInt8:
    """Return light (blue, green, red), shape (3, N), as an image (red, green, blue)."""
    codes = np.rint(np.clip(light, 0, 1) * _CODES).astype(np.uint16)
    columns, rows = texels
    flat: UInt8 = _display()[codes[::-1].T]
    return np.ascontiguousarray(flat.reshape(rows, columns, 3))


@cache
def _display() -> UInt8:
    return quantised((np.arange(_CODES + 1) / _CODES).astype(np.float32))

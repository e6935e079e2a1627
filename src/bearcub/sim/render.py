"""Cast the rays of both cameras into a scene: images, exact disparity, labels and truth."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from bearcub.geometry import Attitude, base_from_optical, camera_attitude, forward_in_camera
from bearcub.messages import Bool, Float32, Float64, Int32, UInt8
from bearcub.rig import Camera, Rig
from bearcub.sim import truth
from bearcub.sim.sensor import Strength, degrade_pair, quantised
from bearcub.sim.solids import Part
from bearcub.sim.texture import Reals
from bearcub.sim.world import PitInside, Scene

SKY = int(np.iinfo(np.int32).min)  # label of pixels that see nothing
LEVEL = Attitude(roll=0.0, pitch=0.0)

_BAND = 32  # image rows rendered at once: the working set stays in the cache
_ZENITH = np.array([[0.72], [0.36], [0.15]], dtype=np.float32)  # linear light, blue green red
_HAZE = np.array([[0.84], [0.74], [0.64]], dtype=np.float32)
_SUNLIGHT = np.array([[1.15], [1.32], [1.45]], dtype=np.float32)
_SKYLIGHT = np.array([[0.46], [0.40], [0.36]], dtype=np.float32)
_SIGHT = 220.0  # distance at which haze has swallowed 63 % of a colour [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """The left camera in the level frame.

    Attributes
    ----------
    camera : Camera
    position : ndarray of float64, shape (3,)
        [m], level.
    level_from_optical : ndarray of float64, shape (3, 3)
    down : ndarray of float64, shape (3,)
        Direction of gravity in optical axes.
    """

    camera: Camera
    position: Float64
    level_from_optical: Float64
    down: Float64

    @classmethod
    def of(cls, rig: Rig, body: Attitude) -> "View":
        """Return the view of a rig on a body inclined so; the left camera stays in its place."""
        down = camera_attitude(body=body, mount=rig.mount.attitude).down()
        turn = base_from_optical(down, forward_in_camera(rig.mount.attitude))
        position = np.array([0.0, 0.0, rig.mount.height])
        return cls(camera=rig.camera, position=position, level_from_optical=turn, down=down)

    def right_position(self) -> Float64:
        """Return where the right camera is: a baseline along the optical x axis."""
        offset: Float64 = self.level_from_optical[:, 0] * self.camera.baseline
        return self.position + offset

    def rays(self, u: Float64, v: Float64, *, shift: float = 0.0) -> Float64:
        """Return level directions, one metre of depth long, through columns `u` and rows `v`.

        `shift` moves the principal point to the right [px]. Shape (3, len(v) * len(u)).
        """
        camera = self.camera
        x = (u - camera.cx - shift) / camera.fx
        y = (v - camera.cy) / camera.fy
        grid = np.broadcast_arrays(x[None, :], y[:, None], np.ones((1, 1)))
        directions: Float64 = self.level_from_optical @ np.stack([g.reshape(-1) for g in grid])
        return directions


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendered:
    """A stereo pair with its truth.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W, 3)
        BGR.
    disparity : ndarray of float32, shape (H, W)
        Exact, of the ray through each left pixel's centre [px], adjusted for the principal points
        (depth = fx B / d); 0 in the sky.
    labels : ndarray of int32, shape (H, W)
        What that ray meets: 0 ground, 1, 2, ... things, -1, -2, ... holes, `SKY`.
    truth : dict
        JSON-able; see `bearcub.sim.truth.describe`.
    """

    left: UInt8
    right: UInt8
    disparity: Float32
    labels: Int32
    truth: dict[str, Any]


def render(
    scene: Scene,
    rig: Rig,
    *,
    body: Attitude = LEVEL,
    noise: Strength | None = None,
    seed: int = 0,
    rig_seed: int | None = None,
    supersample: int = 2,
) -> Rendered:
    """Render the stereo pair that `rig` takes of `scene`, with the exact truth.

    Parameters
    ----------
    scene : Scene
    rig : Rig
        The left camera is `mount.height` above the level frame's origin, whatever the tilt.
    body : Attitude
        Of the body against gravity [rad]; what a perfect tilt sensor reads.
    noise : {"weak", "medium", "strong"} or None
        Sensor model applied to both images (`degrade_pair`), with `seed` and `rig_seed`.
    supersample : int
        Rays per pixel in each direction.
    """
    view = View.of(rig, body)
    hits = _exact(scene, view)
    left, right = _pair(scene, view, supersample=supersample)
    if noise is not None:
        left, right = degrade_pair(left, right, noise, (seed,), rig=rig_seed)
    disparity = (rig.camera.fx * rig.camera.baseline / hits.depth).astype(np.float32)
    for flags in (left.flags, right.flags, disparity.flags, hits.labels.flags):
        flags.writeable = False
    return Rendered(
        left=left,
        right=right,
        disparity=disparity,
        labels=hits.labels,
        truth=truth.describe(scene, rig, body, view.down, hits),
    )


def _pair(scene: Scene, view: View, *, supersample: int) -> tuple[UInt8, UInt8]:
    """Render both cameras' images."""
    beside, shift = view.right_position(), view.camera.doffs
    left = _image(scene, view, view.position, shift=0.0, supersample=supersample)
    return left, _image(scene, view, beside, shift=shift, supersample=supersample)


def _exact(scene: Scene, view: View) -> truth.Hits:
    """Meet the scene along the ray through every left pixel's centre, in double precision."""
    height, width = view.camera.height, view.camera.width
    ray = view.rays(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    origin = view.position[:, None]
    depth = np.full(ray.shape[1], np.inf)
    labels = np.full(ray.shape[1], SKY, dtype=np.int32)
    alone: dict[int, Bool] = {}
    with np.errstate(all="ignore"):
        for part, label in scene.parts():
            t = part.hit(origin, ray)
            nearer = t < depth
            depth[nearer], labels[nearer] = t[nearer], label
            alone[label] = alone.get(label, False) | np.isfinite(t)
        points = origin + depth * ray
    return truth.Hits(
        pixel=1.0 / view.camera.fx,
        depth=depth.reshape(height, width),
        labels=labels.reshape(height, width),
        points=points.reshape(3, height, width),
        alone={label: mask.reshape(height, width) for label, mask in alone.items()},
    )


def _image(scene: Scene, view: View, position: Float64, *, shift: float, supersample: int) -> UInt8:
    """Render one camera's image, band by band."""
    height, width = view.camera.height, view.camera.width
    offsets = (np.arange(supersample) + 0.5) / supersample - 0.5
    u = (np.arange(width)[:, None] + offsets).reshape(-1)
    light = np.empty((height, width, 3), dtype=np.float32)
    origin = position.astype(np.float32)[:, None]
    spacing = 1.0 / (view.camera.fx * supersample)
    for top in range(0, height, _BAND):
        rows = np.arange(top, min(top + _BAND, height))
        v = (rows[:, None] + offsets).reshape(-1)
        ray = view.rays(u, v, shift=shift).astype(np.float32)
        with np.errstate(all="ignore"):
            colour = _colour(scene, origin, ray, spacing)
        samples = colour.reshape(3, rows.size, supersample, width, supersample)
        light[rows] = samples.mean(axis=(2, 4)).transpose(1, 2, 0)
    return quantised(light)


def _colour(scene: Scene, origin: Reals, ray: Reals, spacing: float) -> Reals:
    """Return linear light (blue, green, red) along rays, shape (3, N)."""
    parts = [part for part, _ in scene.parts()]
    depth = np.full(ray.shape[1], np.inf, dtype=np.float32)
    met = np.full(ray.shape[1], -1, dtype=np.int16)
    for index, part in enumerate(parts):
        t = part.hit(origin, ray)
        nearer = t < depth
        depth[nearer], met[nearer] = t[nearer], index
    length = np.sqrt((ray**2).sum(axis=0))
    colour = _sky(ray[2] / length)
    for index, part in enumerate(parts):
        chosen = np.flatnonzero(met == index)
        if chosen.size:
            r, t, reach = ray[:, chosen], depth[chosen], length[chosen]
            surface = _shade(scene, part, origin + t * r, r, spacing * t * reach**2)
            clear = np.exp(-t * reach / _SIGHT)
            colour[:, chosen] = surface * clear + colour[:, chosen] * (1 - clear)
    return colour


def _sky(upward: Reals) -> Reals:
    """Return a smooth gradient from the horizon (and below) to the zenith."""
    share = np.sqrt(np.clip(upward, 0, 1))
    return (_HAZE + (_ZENITH - _HAZE) * share).astype(np.float32)


def _shade(scene: Scene, part: Part, point: Reals, ray: Reals, spread: Reals) -> Reals:
    """Return the light from surface points: Lambert's law in sun and sky, with cast shadows."""
    normal, s, t = part.surface(point)
    facing = np.abs((normal * ray).sum(axis=0))
    footprint = (spread / np.maximum(facing, 1e-6)).astype(np.float32)
    albedo = part.texture.albedo(
        np.ascontiguousarray(s, np.float32), np.ascontiguousarray(t, np.float32), footprint
    )
    sun = np.array(scene.sun) / float(np.linalg.norm(scene.sun))
    direct = np.clip((normal * sun.astype(np.float32)[:, None]).sum(axis=0), 0, None)
    if scene.shadows:
        direct = direct * ~_in_shadow(scene, part, point + 2e-3 * normal, sun)
    sky = 0.6 + 0.4 * normal[2]
    if isinstance(part, PitInside):
        sky = sky * part.daylight(point)
    light: Reals = albedo * (_SUNLIGHT * direct + _SKYLIGHT * sky)
    return light


def _in_shadow(scene: Scene, part: Part, point: Reals, sun: Float64) -> Bool:
    """Return which points things (or the walls of their own pit) keep the sun from."""
    towards = sun.astype(np.float32)[:, None]
    shadow = np.zeros(point.shape[1], dtype=bool)
    for thing in scene.things:
        for solid in thing.parts:
            shadow |= np.isfinite(solid.hit(point, towards))
    if isinstance(part, PitInside):
        shadow |= part.shaded(point, sun)
    return shadow

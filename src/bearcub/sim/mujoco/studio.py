"""Stereo pairs of a still scene, drawn by MuJoCo, with the ray caster's exact truth."""

from types import TracebackType
from typing import Self

import numpy as np

from bearcub.geometry import Attitude
from bearcub.messages import Float32, Scan, UInt8
from bearcub.rig import Rig
from bearcub.sim import truth
from bearcub.sim.ladar import sweep
from bearcub.sim.light import Light
from bearcub.sim.mujoco.casting import behind_grass, cast
from bearcub.sim.mujoco.stage import Stage
from bearcub.sim.render import LEVEL, Rendered, View
from bearcub.sim.sensor import Strength, degrade_pair
from bearcub.sim.world import Scene

_CLEAR = Light()


class Studio:
    """A scene that a rig takes pictures of; the model is compiled once.

    Parameters
    ----------
    scene : Scene
    rig : Rig
        Its left camera is `mount.height` above the level frame's origin, whatever the tilt.
    light : Light
    seed : int
        Of the places and shapes of standing grass, with each patch's own.
    rig_seed : int, optional
        Of what the cameras keep from pair to pair: see `degrade_pair`.

    Raises
    ------
    ConfigError
        If the camera's pixels are not square.
    DeviceError
        If MuJoCo or OpenGL is missing; the message names the command that installs it.
    """

    def __init__(
        self,
        scene: Scene,
        rig: Rig,
        *,
        light: Light = _CLEAR,
        seed: int = 0,
        rig_seed: int | None = None,
    ) -> None:
        self._scene, self._rig, self._rig_seed = scene, rig, rig_seed
        eye = View.of(rig, LEVEL).position
        self._stage = Stage(scene, light, rig.camera, eye[None], seed=seed)

    def shot(
        self, *, body: Attitude = LEVEL, noise: Strength | None = None, seed: int = 0
    ) -> Rendered:
        """Take one stereo pair, with the exact truth.

        Where standing grass hides what is behind it, `disparity` is that of the blade and the
        label is 0, ground: see `behind_grass`.

        Parameters
        ----------
        body : Attitude
            Of the body against gravity [rad]; what a perfect tilt sensor reads.
        noise : {"weak", "medium", "strong"} or None
            Sensor model applied to both images (`degrade_pair`), with `seed`.
        seed : int
        """
        view = View.of(self._rig, body)
        left, right = photograph(self._stage, view, noise=noise, seed=(seed,), rig=self._rig_seed)
        hits = behind_grass(cast(self._scene, view), self._stage.grass_depth(view), view)
        return Rendered(
            left=left,
            right=right,
            disparity=disparity_of(hits, self._rig),
            labels=hits.labels,
            truth=truth.describe(self._scene, self._rig, body, view.down, hits),
        )

    def scan(self, *, body: Attitude = LEVEL, seed: int | None = None) -> Scan:
        """Return a sweep of the LADAR below the camera: see `bearcub.sim.ladar.sweep`."""
        return sweep(self._scene, body, seed=seed)

    def close(self) -> None:
        """Give OpenGL's memory back."""
        self._stage.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def render(
    scene: Scene,
    rig: Rig,
    *,
    body: Attitude = LEVEL,
    noise: Strength | None = None,
    seed: int = 0,
    light: Light = _CLEAR,
) -> Rendered:
    """Render one stereo pair as `Studio.shot` does; many of one scene are cheaper with that."""
    with Studio(scene, rig, light=light, seed=seed) as studio:
        return studio.shot(body=body, noise=noise, seed=seed)


def photograph(
    stage: Stage,
    view: View,
    *,
    noise: Strength | None,
    seed: tuple[int, ...],
    rig: int | None,
) -> tuple[UInt8, UInt8]:
    """Return both cameras' pictures, read-only, each with noise of its own: see `degrade_pair`."""
    left, right = stage.pair(view)
    if noise is not None:
        left, right = degrade_pair(left, right, noise, seed, rig=rig)
    left.flags.writeable = right.flags.writeable = False
    return left, right


def disparity_of(hits: truth.Hits, rig: Rig) -> Float32:
    """Return the exact disparity [px], read-only, shape (H, W); 0 in the sky."""
    disparity = (rig.camera.fx * rig.camera.baseline / hits.depth).astype(np.float32)
    disparity.flags.writeable = hits.labels.flags.writeable = False
    return disparity

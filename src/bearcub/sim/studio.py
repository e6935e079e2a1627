"""What takes the pictures of a case's world: MuJoCo, or the ray caster."""

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal, Protocol

from bearcub.geometry import Attitude
from bearcub.rig import Rig
from bearcub.sim.case import Case
from bearcub.sim.render import LEVEL, Rendered, render
from bearcub.sim.sensor import Strength
from bearcub.sim.world import Scene

Renderer = Literal["mujoco", "raycast"]


class Studio(Protocol):
    """Takes stereo pairs of one world."""

    def shot(
        self, *, body: Attitude = LEVEL, noise: Strength | None = None, seed: int = 0
    ) -> Rendered:
        """Take one pair, with its truth."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class _RayStudio:
    scene: Scene
    rig: Rig
    rig_seed: int

    def shot(
        self, *, body: Attitude = LEVEL, noise: Strength | None = None, seed: int = 0
    ) -> Rendered:
        """Cast the rays of one pair."""
        return render(
            self.scene, self.rig, body=body, noise=noise, seed=seed, rig_seed=self.rig_seed
        )


def has_mujoco() -> bool:
    """Return whether MuJoCo is installed; whether it can draw shows when it is used."""
    return importlib.util.find_spec("mujoco") is not None


@contextmanager
def open_studio(case: Case, renderer: Renderer) -> Iterator[Studio]:
    """Provide what takes pictures of a case's world, for all frames that share it.

    Parameters
    ----------
    case : Case
        Any of these frames.
    renderer : {"mujoco", "raycast"}
        Fast, of the extra ``sim``; or slow, with core dependencies, without grass and with the
        same brightness in every light.

    Raises
    ------
    DeviceError
        If MuJoCo or its OpenGL is missing; the message names the command that installs it.
    """
    if renderer == "mujoco":
        # an optional extra that takes a second to import
        from bearcub.sim.mujoco import Studio as Drawn  # noqa: PLC0415

        with Drawn(case.scene, case.rig, light=case.light, rig_seed=case.rig_seed) as studio:
            yield studio
        return
    x, y, z = (float(axis) for axis in case.light.towards_sun(case.scene.sun))
    shadows = case.scene.shadows and case.light.shadows
    scene = replace(case.scene, sun=(x, y, z), shadows=shadows)
    yield _RayStudio(scene=scene, rig=case.rig, rig_seed=case.rig_seed)

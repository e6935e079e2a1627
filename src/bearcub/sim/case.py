"""One frame to be rendered and answered: world, rig, attitude, tilt reading, light and noise."""

from collections.abc import Mapping
from dataclasses import dataclass

from bearcub.geometry import Attitude
from bearcub.messages import Tilt
from bearcub.rig import Rig
from bearcub.sim.light import Light
from bearcub.sim.sensor import Strength
from bearcub.sim.world import Scene

FRAME_TIME = 1.0 / 15.0
"""From frame to frame of a world [s]: the rate of the paper."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One frame of a scenario.

    Frames of one world follow each other and share the objects `scene`, `rig` and `light`
    (compare with ``is``), so that a renderer builds its world once.

    Attributes
    ----------
    name : str
        Unique: scenario, world and frame, such as ``holes/012-3``.
    scenario : str
    scene : Scene
    rig : Rig
    body : Attitude
        Of the body against gravity, truly.
    tilt : Tilt or None
        What the tilt sensor reads: noisy, biased or late; None where it is missing.
    light : Light
    noise : {"weak", "medium", "strong"}
        Strength of the sensor model.
    seed : int
        Of everything random in the rendering of this frame.
    rig_seed : int
        Of what the cameras keep through all frames of the world.
    tags : mapping of str to str or float
        What the case counts for in the table: "surface", "light", "noise", "height", "hfov_deg",
        "baseline", "pitch_deg" and "roll_deg" of the body, "tilt" ("exact", "good", "biased",
        "late" or "missing"), "clearance" (height of the robot [m]); ``"empty": True`` on a floor
        without anything on it or in it; "kind" and "range" where there is one thing, hole or
        slope.
    """

    name: str
    scenario: str
    scene: Scene
    rig: Rig
    body: Attitude
    tilt: Tilt | None
    light: Light
    noise: Strength
    seed: int
    rig_seed: int
    tags: Mapping[str, str | float]

"""A wheeled robot and the ground under it, as a MuJoCo model without pictures."""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from bearcub.errors import ConfigError
from bearcub.messages import Float64
from bearcub.rig import Mount
from bearcub.sim.mujoco.lawn import heights
from bearcub.sim.mujoco.library import mujoco
from bearcub.sim.solids import Box, Cone, Cylinder, Solid
from bearcub.sim.world import Scene

TIMESTEP = 0.002
_CELL = 0.05  # side of the height field's cells [m]
_BED = 0.5  # thickness of the ground below its lowest point [m]
_BUMP = 0.12  # half the width of a bump of rough ground [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chassis:
    """A robot on two driven wheels, with a swivelling caster behind.

    Attributes
    ----------
    mass : float
        With everything [kg].
    track : float
        Between the middles of the wheels [m].
    wheel_radius : float
        [m].
    length, width, height : float
        Of the hull [m]; it stands 0.12 m above the ground, its front 0.25 m before the axle.
    """

    mass: float = 60.0
    track: float = 0.6
    wheel_radius: float = 0.16
    length: float = 0.9
    width: float = 0.46
    height: float = 0.35


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """The rectangle of ground that can be driven on [m], level."""

    x0: float = -6.0
    x1: float = 18.0
    y0: float = -9.0
    y1: float = 9.0


_ROBOT = """
<mujoco>
 <option timestep="{timestep}" integrator="implicitfast"/>
 <worldbody>
  <body name="chassis" pos="{x} {y} {z}" xyaxes="{axes}">
   <freejoint/>
   <geom name="hull" type="box" size="{hull}" pos="{middle} 0 {high}" mass="{hull_mass}"/>
   <geom name="mast" type="capsule" fromto="{mast}" size="0.03" mass="1"/>
   <body name="left" pos="0 {half} {r}">
    <joint name="left" axis="0 1 0" armature="0.02"/>
    <geom name="left" type="cylinder" size="{r} 0.03" euler="90 0 0" mass="4" friction="1"/>
   </body>
   <body name="right" pos="0 -{half} {r}">
    <joint name="right" axis="0 1 0" armature="0.02"/>
    <geom name="right" type="cylinder" size="{r} 0.03" euler="90 0 0" mass="4" friction="1"/>
   </body>
   <body name="fork" pos="{rear} 0 0.1">
    <joint name="fork" axis="0 0 1" damping="0.05"/>
    <geom type="capsule" fromto="0 0 0.06 -0.05 0 0.01" size="0.015" mass="0.5" contype="0"
     conaffinity="0"/>
    <body name="caster" pos="-0.05 0 0">
     <joint name="caster" axis="0 1 0"/>
     <geom name="caster" type="ellipsoid" size="0.1 0.03 0.1" mass="1.5" friction="0.8"/>
    </body>
   </body>
  </body>
 </worldbody>
 <contact>
  <exclude body1="chassis" body2="fork"/>
  <exclude body1="chassis" body2="caster"/>
 </contact>
 <actuator>
  <velocity name="left" joint="left" kv="60" forcerange="-45 45"/>
  <velocity name="right" joint="right" kv="60" forcerange="-45 45"/>
 </actuator>
</mujoco>
"""


def model(
    scene: Scene,
    chassis: Chassis,
    area: Area,
    *,
    mount: Mount,
    start: tuple[float, float, float],
    roughness: float,
    seed: int,
) -> Any:
    """Return the compiled model of a robot in a scene.

    Parameters
    ----------
    scene : Scene
    chassis : Chassis
    area : Area
    mount : Mount
        Of the camera: a mast carries it.
    start : tuple of float
        x, y [m] and yaw [rad] of the robot's ``base_link``.
    roughness : float
        RMS height of bumps [m].
    seed : int
        Of the bumps.
    """
    spec = mujoco().MjSpec.from_string(_robot(scene, chassis, mount, start))
    _add_ground(spec, scene, area, roughness=roughness, seed=seed)
    for number, thing in enumerate(scene.things, 1):
        for index, solid in enumerate(thing.parts):
            _add_solid(spec, solid, f"thing {number} {index}")
    return spec.compile()


def _robot(scene: Scene, chassis: Chassis, mount: Mount, start: tuple[float, float, float]) -> str:
    x, y, yaw = start
    foot = f"{mount.x} {mount.y} {min(0.15, 0.5 * mount.height)}"
    return _ROBOT.format(
        timestep=TIMESTEP,
        x=x,
        y=y,
        z=scene.ground.at(x, y) + 0.002,  # settles by so much
        axes=_standing(scene, x, yaw),
        hull=f"{chassis.length / 2} {chassis.width / 2} {chassis.height / 2}",
        middle=0.25 - chassis.length / 2,
        high=0.12 + chassis.height / 2,
        hull_mass=chassis.mass - 11.0,
        mast=f"{foot} {mount.x} {mount.y} {mount.height}",
        half=chassis.track / 2,
        r=chassis.wheel_radius,
        rear=0.3 - chassis.length,
    )


def _standing(scene: Scene, x: float, yaw: float) -> str:
    """Return the x and y axes of a body that stands on the ground at `x`, heading along `yaw`."""
    up = next(p for p in reversed(scene.ground.planes) if x >= p.start).normal()
    heading = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    ahead = heading - (heading @ up) * up
    return " ".join(f"{value:.12f}" for value in (*ahead, *np.cross(up, ahead)))


def _add_ground(spec: Any, scene: Scene, area: Area, *, roughness: float, seed: int) -> None:
    """Add the ground as a height field: what the wheels roll on."""
    columns = round((area.x1 - area.x0) / _CELL) + 1
    rows = round((area.y1 - area.y0) / _CELL) + 1
    x, y = np.meshgrid(np.linspace(area.x0, area.x1, columns), np.linspace(area.y0, area.y1, rows))
    z = heights(scene.ground, x.reshape(-1), y.reshape(-1)).reshape(x.shape)
    for pit in scene.ground.pits:
        z = z - pit.depth * pit.mouth(x, y)
    z = z + _bumps(x.shape, roughness, seed)
    low, rise = float(z.min()), max(float(np.ptp(z)), 1e-3)
    size = [(area.x1 - area.x0) / 2, (area.y1 - area.y0) / 2, rise, _BED]
    spec.add_hfield(
        name="ground",
        nrow=rows,
        ncol=columns,
        size=size,
        userdata=((z - low) / rise).astype(np.float32).reshape(-1),
    )
    spec.worldbody.add_geom(
        name="ground",
        type=mujoco().mjtGeom.mjGEOM_HFIELD,
        hfieldname="ground",
        pos=[(area.x0 + area.x1) / 2, (area.y0 + area.y1) / 2, low],
        friction=[0.9, 0.005, 0.0001],
    )


def _bumps(shape: tuple[int, ...], roughness: float, seed: int) -> Float64:
    """Return smooth bumps of zero mean and so much deviation [m]."""
    if roughness == 0.0:
        return np.zeros(shape)
    white = np.random.default_rng((seed, 4)).standard_normal(shape)
    smooth = np.asarray(cv2.GaussianBlur(white, (0, 0), _BUMP / _CELL), dtype=np.float64)
    bumps: Float64 = roughness * (smooth - smooth.mean()) / smooth.std()
    return bumps


def _add_solid(spec: Any, solid: Solid, name: str) -> None:
    """Add a part of a thing as what it is, a cone as a cylinder of its wider end."""
    kinds = mujoco().mjtGeom
    if isinstance(solid, Box):
        spec.worldbody.add_geom(
            name=name,
            type=kinds.mjGEOM_BOX,
            size=[0.5 * side for side in solid.size],
            pos=[solid.x, solid.y, solid.bottom + 0.5 * solid.size[2]],
            quat=[math.cos(0.5 * solid.yaw), 0.0, 0.0, math.sin(0.5 * solid.yaw)],
        )
        return
    if isinstance(solid, Cylinder):
        ends, radius = [*solid.start, *solid.end], solid.radius
    elif isinstance(solid, Cone):
        ends = [solid.x, solid.y, solid.bottom, solid.x, solid.y, solid.top]
        radius = max(solid.radii)
    else:
        raise ConfigError(
            f"a {type(solid).__name__} has no body in the MuJoCo world: expected Box, Cylinder "
            "or Cone"
        )
    spec.worldbody.add_geom(
        name=name, type=kinds.mjGEOM_CYLINDER, fromto=ends, size=[radius, 0.0, 0.0]
    )

"""Small scenes for tests, the sample and the accuracy table."""

import math
from dataclasses import replace

from bearcub.geometry import Attitude
from bearcub.rig import Camera, Mount, Rig
from bearcub.sim.materials import (
    ASPHALT,
    BRICK,
    CONCRETE,
    GRASS,
    PLAIN,
    SOIL,
    TILES,
    WOOD,
)
from bearcub.sim.objects import can, upright
from bearcub.sim.solids import Box, Cylinder, Solid
from bearcub.sim.texture import Lane, Texture
from bearcub.sim.world import Ground, Pit, Scene, Thing

__all__ = [
    "ASPHALT",
    "BRICK",
    "CONCRETE",
    "GRASS",
    "PLAIN",
    "SOIL",
    "TILES",
    "WOOD",
    "branch",
    "can",
    "cross_slope",
    "drop",
    "floor",
    "garbage_can",
    "kerb",
    "paper_rig",
    "pit",
    "posts",
    "ramp",
    "small_box",
    "standing",
    "table",
    "two_cans",
    "upright",
    "wall",
]


def paper_rig(*, width: int = 640, height: int = 480) -> Rig:
    """Return the rig that the paper's constants imply: f = 386 px at 640 x 480, B = 0.12 m."""
    camera = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
    mount = Mount(height=1.2, pitch=math.radians(5.9))
    return Rig(camera=camera.scaled(width=width, height=height), mount=mount)


def garbage_can(*, distance: float = 3.05, bearing: float = math.radians(2.0)) -> Scene:
    """Return the paper's scene: a garbage can 10 ft ahead on a paved path through grass."""
    ground = Ground(texture=Lane(inside=ASPHALT, outside=GRASS, left=1.5, right=-1.9))
    centre = distance + 0.225
    x, y = centre * math.cos(bearing), centre * math.sin(bearing)
    return Scene(ground=ground, things=(can(x, y, ground=ground),))


def floor(*, texture: Texture = ASPHALT) -> Scene:
    """Return an empty level floor."""
    return Scene(ground=Ground(texture=texture))


def ramp(
    *, start: float = 3.0, slope: float = math.radians(8.5), texture: Texture = ASPHALT
) -> Scene:
    """Return a ramp that goes up (or down: negative) by `slope` [rad] from `start` on."""
    return Scene(ground=Ground(texture=texture, pieces=((start, 0.0, math.tan(slope)),)))


def cross_slope(*, slope: float = math.radians(6.0), texture: Texture = ASPHALT) -> Scene:
    """Return ground that rises to the left by `slope` [rad]."""
    return Scene(ground=Ground(texture=texture, cross=math.tan(slope)))


def standing(scene: Scene) -> Attitude:
    """Return the attitude of a body that stands on the ground at the origin."""
    plane = next(p for p in reversed(scene.ground.planes) if p.start <= 0.0)
    along = math.atan(plane.slope)
    return Attitude(pitch=-along, roll=math.atan(plane.cross * math.cos(along)))


def pit(
    *,
    distance: float = 2.5,
    width: float = 0.8,
    length: float = 0.6,
    depth: float = 0.3,
    y: float = 0.0,
    texture: Texture = ASPHALT,
) -> Scene:
    """Return a floor with a rectangular pit, its near lip at `distance`."""
    hole = Pit(
        x0=distance,
        x1=distance + length,
        y0=y - 0.5 * width,
        y1=y + 0.5 * width,
        depth=depth,
        texture=SOIL,
    )
    return Scene(ground=Ground(texture=texture, pits=(hole,)))


def drop(*, distance: float = 3.0, depth: float = 0.5, texture: Texture = CONCRETE) -> Scene:
    """Return a floor that ends in a step down (a loading dock)."""
    return Scene(ground=Ground(texture=texture, pieces=((distance, -depth, 0.0),)))


def kerb(*, distance: float = 3.0, height: float = 0.12, texture: Texture = CONCRETE) -> Scene:
    """Return a floor with a step up."""
    return Scene(ground=Ground(texture=texture, pieces=((distance, height, 0.0),)))


def wall(*, distance: float = 3.0, texture: Texture = BRICK) -> Scene:
    """Return a wall across the whole view, 4 m high."""
    face = Box(x=distance + 0.15, y=0.0, bottom=0.0, size=(0.3, 60.0, 4.0), texture=texture)
    thing = Thing(name="wall", foot=(distance, 0.0), parts=(face,))
    return Scene(ground=Ground(texture=ASPHALT), things=(thing,))


def two_cans(*, near: float = 2.5, far: float = 4.5) -> Scene:
    """Return two cans at one bearing, a low one before a tall one."""
    ground = Ground(texture=ASPHALT)
    front = can(near + 0.2, 0.0, ground=ground, radius=0.2, height=0.7, name="low can")
    back = can(
        far + 0.3,
        0.0,
        ground=ground,
        radius=0.3,
        height=1.1,
        paint=(0.06, 0.20, 0.42),
        name="tall can",
    )
    return Scene(ground=ground, things=(front, back))


def branch(*, distance: float = 3.0, base: float = 0.9) -> Scene:
    """Return a branch across the way, nothing below it."""
    log = Cylinder(
        start=(distance + 0.06, 0.8, base + 0.06),
        end=(distance + 0.06, -0.8, base + 0.06),
        radius=0.06,
        texture=WOOD,
    )
    thing = Thing(name="branch", foot=(distance, 0.0), parts=(log,))
    return Scene(ground=Ground(texture=GRASS), things=(thing,))


def table(*, distance: float = 3.0, y: float = 0.0) -> Scene:
    """Return a table 1.2 m wide, 0.8 m deep and 0.74 m high on four legs."""
    x = distance + 0.4
    top = Box(x=x, y=y, bottom=0.70, size=(0.8, 1.2, 0.04), texture=WOOD)
    legs: list[Solid] = [
        Box(x=x + dx, y=y + dy, bottom=0.0, size=(0.06, 0.06, 0.70), texture=WOOD)
        for dx in (-0.35, 0.35)
        for dy in (-0.55, 0.55)
    ]
    thing = Thing(name="table", foot=(x, y), parts=(top, *legs))
    return Scene(ground=Ground(texture=TILES), things=(thing,))


def posts(*, distance: float = 3.0, count: int = 5, spacing: float = 0.8) -> Scene:
    """Return a row of posts, 70 mm thick and 0.9 m high, across the way."""
    ys = [(0.5 * (count - 1) - index) * spacing for index in range(count)]
    things = tuple(
        Thing(
            name=f"post {index}",
            foot=(distance + 0.035, y),
            parts=(upright(distance + 0.035, y, 0.0, 0.9, 0.035, replace(WOOD, seed=index)),),
        )
        for index, y in enumerate(ys, 1)
    )
    return Scene(ground=Ground(texture=GRASS), things=things)


def small_box(*, distance: float = 2.5, y: float = 0.0, yaw: float = 0.0) -> Scene:
    """Return a box of 10 cm on the floor."""
    box = Box(x=distance + 0.05, y=y, bottom=0.0, size=(0.1, 0.1, 0.1), texture=WOOD, yaw=yaw)
    return Scene(
        ground=Ground(texture=ASPHALT),
        things=(Thing(name="box", foot=(distance, y), parts=(box,)),),
    )

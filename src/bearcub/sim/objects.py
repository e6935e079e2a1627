"""What stands, lies and hangs in the world, built of solids.

Every builder takes the place (x, y) [m] of the thing's centre and the `ground` that it stands on;
lengths are in metres, `yaw` [rad] turns the thing to the left about its centre, and `seed` moves
the blotches of its surface. `place` builds any of `KINDS` so that its nearest point is at a given
distance.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from bearcub.config import require_known
from bearcub.sim.materials import (
    BLACK,
    BLUE,
    BRICK,
    GREEN,
    ORANGE,
    RED,
    WHITE,
    WOOD,
    YELLOW,
    ZINC,
    paint,
)
from bearcub.sim.solids import Box, Cone, Cylinder, Solid
from bearcub.sim.texture import Colour, Material, Texture
from bearcub.sim.world import Ground, Thing

_COLOURS = (GREEN, BLUE, RED, YELLOW, ORANGE)


def upright(
    x: float, y: float, bottom: float, top: float, radius: float, texture: Texture
) -> Cylinder:
    """Return a standing cylinder."""
    return Cylinder(start=(x, y, bottom), end=(x, y, top), radius=radius, texture=texture)


def can(
    x: float,
    y: float,
    *,
    ground: Ground,
    radius: float = 0.225,
    height: float = 0.70,
    paint: Colour = GREEN,
    name: str = "can",
) -> Thing:
    """Return a ribbed garbage can with a rim, standing at (x, y)."""
    z = ground.at(x, y)
    steel = Material(
        dark=(0.7 * paint[0], 0.7 * paint[1], 0.7 * paint[2]),
        light=(1.3 * paint[0], 1.3 * paint[1], 1.3 * paint[2]),
        octaves=((0.5, 0.3), (0.15, 0.4), (0.05, 0.4), (0.02, 0.4)),
        ribs=(0.0471, 0.4),
        bands=tuple((k * height, (k + 0.02) * height, ZINC) for k in (0.26, 0.64)),
        seed=8,
    )
    rim = replace(steel, ribs=None, bands=(), seed=9)
    lid = replace(rim, dark=(0.04, 0.04, 0.04), light=(0.16, 0.16, 0.16))
    levels = [z, z + 0.93 * height, z + 0.985 * height, z + height]
    return Thing(
        name=name,
        foot=(x, y),
        parts=(
            upright(x, y, levels[0], levels[1], radius - 0.006, steel),
            upright(x, y, levels[1], levels[2], radius, rim),
            upright(x, y, levels[2], levels[3], 0.9 * radius, lid),
        ),
    )


def barrel(
    x: float, y: float, *, ground: Ground, radius: float = 0.29, height: float = 0.98, seed: int = 0
) -> Thing:
    """Return a construction barrel: orange with four white stripes, on a black ring."""
    z = ground.at(x, y)
    stripe = height / 9
    white = tuple((k * stripe, (k + 1) * stripe, WHITE) for k in (1.5, 3.5, 5.5, 7.5))
    return Thing(
        name="barrel",
        foot=(x, y),
        parts=(
            upright(x, y, z, z + 0.07, 1.15 * radius, paint(BLACK, seed=seed, contrast=0.6)),
            Cone(
                x=x,
                y=y,
                bottom=z,
                height=height,
                radii=(radius, 0.88 * radius),
                texture=paint(ORANGE, seed=seed, bands=white, contrast=0.25),
            ),
        ),
    )


def traffic_cone(
    x: float, y: float, *, ground: Ground, height: float = 0.75, seed: int = 0
) -> Thing:
    """Return a traffic cone with two white bands on a square black foot."""
    z, thick = ground.at(x, y), 0.04
    white = ((0.42 * height, 0.56 * height, WHITE), (0.68 * height, 0.80 * height, WHITE))
    foot = paint(BLACK, seed=seed, contrast=0.6)
    return Thing(
        name="cone",
        foot=(x, y),
        parts=(
            Box(x=x, y=y, bottom=z, size=(0.5 * height, 0.5 * height, thick), texture=foot),
            Cone(
                x=x,
                y=y,
                bottom=z + thick,
                height=height - thick,
                radii=(0.19 * height, 0.035 * height),
                texture=paint(ORANGE, seed=seed, bands=white, contrast=0.25),
            ),
        ),
    )


def box(
    x: float,
    y: float,
    *,
    ground: Ground,
    size: tuple[float, float, float],
    yaw: float = 0.0,
    texture: Texture = WOOD,
    name: str = "box",
) -> Thing:
    """Return a box of `size` along, across and up [m], turned by `yaw` [rad]."""
    part = Box(x=x, y=y, bottom=ground.at(x, y), size=size, yaw=yaw, texture=texture)
    return Thing(name=name, foot=(x, y), parts=(part,))


def post(
    x: float,
    y: float,
    *,
    ground: Ground,
    diameter: float,
    height: float = 0.9,
    texture: Texture = WOOD,
    name: str = "post",
) -> Thing:
    """Return a standing post."""
    z = ground.at(x, y)
    part = upright(x, y, z, z + height, 0.5 * diameter, texture)
    return Thing(name=name, foot=(x, y), parts=(part,))


def person(x: float, y: float, *, ground: Ground, height: float = 1.72, seed: int = 0) -> Thing:
    """Return a person of cylinders: legs, trunk and head."""
    z = ground.at(x, y)
    legs, trunk = z + 0.48 * height, z + 0.85 * height
    clothes = _COLOURS[seed % len(_COLOURS)]
    head: Colour = (0.22, 0.30, 0.45)
    return Thing(
        name="person",
        foot=(x, y),
        parts=(
            upright(x, y, z, legs, 0.16, paint((0.12, 0.08, 0.06), seed=seed, contrast=0.6)),
            upright(x, y, legs, trunk, 0.22, paint(clothes, seed=seed + 1, contrast=0.5)),
            upright(x, y, trunk, z + height, 0.10, paint(head, seed=seed + 2)),
        ),
    )


def lying_test_piece(x: float, y: float, *, ground: Ground, yaw: float = 0.0) -> Thing:
    """Return test piece A of driverless trucks (EN 1525, ISO 3691-4): a torso on the floor.

    A cylinder of 200 mm diameter and 600 mm length; at `yaw` 0 it lies across the way.
    """
    z, half = ground.at(x, y) + 0.1, 0.3
    off = (-half * math.sin(yaw), half * math.cos(yaw))
    part = Cylinder(
        start=(x - off[0], y - off[1], z),
        end=(x + off[0], y + off[1], z),
        radius=0.1,
        texture=paint((0.10, 0.10, 0.10), seed=3, contrast=0.7),
    )
    return Thing(name="lying test piece", foot=(x, y), parts=(part,))


def standing_test_piece(x: float, y: float, *, ground: Ground) -> Thing:
    """Return test piece B of driverless trucks: a leg of 70 mm diameter and 400 mm height."""
    grey = paint((0.10, 0.10, 0.10), seed=4, contrast=0.7)
    return post(
        x, y, ground=ground, diameter=0.07, height=0.4, texture=grey, name="standing test piece"
    )


def plate(x: float, y: float, *, ground: Ground, yaw: float = 0.0) -> Thing:
    """Return the flat upright plate of ANSI/ITSDF B56.5, 500 mm square."""
    grey = paint((0.25, 0.25, 0.25), seed=5, contrast=0.4)
    size = (0.02, 0.5, 0.5)
    return box(x, y, ground=ground, size=size, yaw=yaw, texture=grey, name="plate")


def table(
    x: float,
    y: float,
    *,
    ground: Ground,
    size: tuple[float, float, float] = (0.8, 1.2, 0.74),
) -> tuple[Thing, ...]:
    """Return a table's top and its four legs: things apart, one can drive between the legs."""
    z, thick, leg = ground.at(x, y), 0.04, 0.06
    length, width, height = size
    board = Box(x=x, y=y, bottom=z + height - thick, size=(length, width, thick), texture=WOOD)
    legs = tuple(
        box(
            x + dx * (0.5 * length - leg),
            y + dy * (0.5 * width - leg),
            ground=ground,
            size=(leg, leg, height - thick),
            name="table leg",
        )
        for dx in (-1, 1)
        for dy in (-1, 1)
    )
    return (Thing(name="table top", foot=(x, y), parts=(board,)), *legs)


def branch(
    x: float, y: float, *, ground: Ground, base: float = 2.2, length: float = 1.8, seed: int = 0
) -> Thing:
    """Return a level branch with twigs across the way, nothing below it."""
    rng = np.random.default_rng((seed, 5))
    z, bark = ground.at(x, y) + base, replace(WOOD, seed=seed)
    twigs: list[Solid] = []
    for share in np.linspace(-0.42, 0.42, 7):
        reach, turn = rng.uniform(0.15, 0.35), rng.uniform(-0.7, 0.7)
        at, up = y + share * length, z + rng.uniform(0.02, 0.09)
        end = (x + reach * math.cos(turn), at + reach * math.sin(turn), up)
        twigs.append(Cylinder(start=(x - 0.1, at, up), end=end, radius=0.012, texture=bark))
    stem = Cylinder(
        start=(x, y - 0.5 * length, z + 0.05),
        end=(x, y + 0.5 * length, z + 0.05),
        radius=0.05,
        texture=bark,
    )
    return Thing(name="branch", foot=(x, y), parts=(stem, *twigs))


Build = Callable[[float, float, Ground, np.random.Generator], tuple[Thing, ...]]
"""Builds one variant of a kind, centred at (x, y)."""


def _colour(rng: np.random.Generator) -> Colour:
    return _COLOURS[int(rng.integers(len(_COLOURS)))]


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(1, 40))


def _any_can(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    radius, height = rng.uniform(0.19, 0.30), rng.uniform(0.6, 1.0)
    return (can(x, y, ground=ground, radius=radius, height=height, paint=_colour(rng)),)


def _any_box(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    length, width, height = (float(side) for side in rng.uniform(0.3, 0.8, 3))
    skin: Material = replace(WOOD, seed=_seed(rng)) if rng.random() < 0.5 else _skin(rng)
    yaw, size = float(rng.uniform(-0.8, 0.8)), (length, width, height)
    return (box(x, y, ground=ground, size=size, yaw=yaw, texture=skin),)


def _skin(rng: np.random.Generator) -> Material:
    return paint(_colour(rng), seed=_seed(rng), contrast=0.4)


def _small_box(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    yaw, skin = float(rng.uniform(-0.8, 0.8)), replace(WOOD, seed=_seed(rng))
    size = (0.1, 0.1, 0.1)
    return (box(x, y, ground=ground, size=size, yaw=yaw, texture=skin, name="small box"),)


def _any_post(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    wide, high = rng.uniform(0.05, 0.10), rng.uniform(0.6, 1.2)
    return (post(x, y, ground=ground, diameter=wide, height=high, texture=_skin(rng)),)


def _thin_post(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    high, skin = rng.uniform(0.8, 1.2), _skin(rng)
    thin = post(x, y, ground=ground, diameter=0.03, height=high, texture=skin, name="thin post")
    return (thin,)


def _any_wall(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    size = (0.2, float(rng.uniform(1.2, 2.4)), float(rng.uniform(0.6, 2.0)))
    yaw = math.atan2(y, x) + float(rng.uniform(-0.5, 0.5))
    return (box(x, y, ground=ground, size=size, yaw=yaw, texture=BRICK, name="wall"),)


def _lying(x: float, y: float, ground: Ground, rng: np.random.Generator) -> tuple[Thing, ...]:
    yaw = math.atan2(y, x) + float(rng.uniform(-0.4, 0.4))
    return (lying_test_piece(x, y, ground=ground, yaw=yaw),)


KINDS: Mapping[str, Build] = {
    "can": _any_can,
    "paper-can": lambda x, y, ground, _: (can(x, y, ground=ground),),
    "barrel": lambda x, y, ground, rng: (barrel(x, y, ground=ground, seed=_seed(rng)),),
    "cone": lambda x, y, ground, rng: (
        traffic_cone(x, y, ground=ground, height=rng.uniform(0.5, 0.9), seed=_seed(rng)),
    ),
    "box": _any_box,
    "small-box": _small_box,
    "post": _any_post,
    "thin-post": _thin_post,
    "wall": _any_wall,
    "person": lambda x, y, ground, rng: (
        person(x, y, ground=ground, height=rng.uniform(1.5, 1.9), seed=_seed(rng)),
    ),
    "lying-test-piece": _lying,
    "standing-test-piece": lambda x, y, ground, _: (standing_test_piece(x, y, ground=ground),),
    "plate": lambda x, y, ground, _: (plate(x, y, ground=ground, yaw=math.atan2(y, x)),),
    "plate-45": lambda x, y, ground, _: (
        plate(x, y, ground=ground, yaw=math.atan2(y, x) + math.radians(45)),
    ),
    "table": lambda x, y, ground, _: table(x, y, ground=ground),
    "branch": lambda x, y, ground, rng: (
        branch(x, y, ground=ground, base=rng.uniform(2.1, 2.3), seed=_seed(rng)),
    ),
    "low-branch": lambda x, y, ground, rng: (
        branch(x, y, ground=ground, base=rng.uniform(0.85, 1.0), seed=_seed(rng)),
    ),
}
"""What scenarios may place, by name; sizes, colours and turns are drawn."""


def place(
    kind: str, distance: float, bearing: float, *, ground: Ground, seed: tuple[int, ...]
) -> tuple[Thing, ...]:
    """Build a thing in a direction, its nearest point as far away as asked for.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    distance : float
        From the camera's foot to the nearest point [m]; kept to about a millimetre.
    bearing : float
        Of the thing's centre [rad].
    ground : Ground
    seed : tuple of int
        The same seed builds the same variant.

    Raises
    ------
    ConfigError
        If there is no such kind.
    """
    require_known(kind, KINDS, what="kind")
    centre = distance
    for _ in range(3):
        x, y = centre * math.cos(bearing), centre * math.sin(bearing)
        things = KINDS[kind](x, y, ground, np.random.default_rng(seed))
        eye = np.zeros(2)
        corners = np.array([part.nearest(eye) for thing in things for part in thing.parts])
        centre += distance - float(np.linalg.norm(corners, axis=1).min())
    return things

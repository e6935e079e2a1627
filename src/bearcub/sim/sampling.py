"""Draw the worlds and frames of a scenario: seeded, and balanced over every sweep.

Each sweep is a deck of cards: shuffled, dealt to its end, shuffled again. So every value of every
sweep gets its share, whatever it is combined with.
"""

import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import islice
from typing import Any

import numpy as np

from bearcub.geometry import Attitude
from bearcub.messages import Float64, Tilt
from bearcub.rig import Camera, Mount, Rig
from bearcub.sim.case import FRAME_TIME, Case
from bearcub.sim.grass import Grass
from bearcub.sim.light import PRESETS, Light
from bearcub.sim.materials import SOIL, SURFACES
from bearcub.sim.objects import place
from bearcub.sim.scenes import standing
from bearcub.sim.sweeps import TABLES, Plan
from bearcub.sim.world import Ground, Pit, Scene, Thing

WIDTH, HEIGHT = 640, 480

_ATTEMPTS = 20  # to find a free place for a thing
_GAP = 0.15  # between two things [m]
_LAWN = (0.4, 12.4, -6.0, 6.0)  # where blades stand: x0, x1, y0, y1 [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """What the frames of one world share; `drawn` holds the value of every sweep."""

    index: int
    drawn: Mapping[str, Any]
    scene: Scene
    rig: Rig
    light: Light


def deal(values: Sequence[Any], count: int, *, seed: int, name: str) -> list[Any]:
    """Return `count` values: whole shuffled decks of `values`, one after another.

    Examples
    --------
    >>> sorted(deal([1, 2, 3], 6, seed=0, name="height"))
    [1, 1, 2, 2, 3, 3]
    """
    rng = np.random.default_rng((seed, zlib.crc32(name.encode())))
    cards: list[Any] = []
    while values and len(cards) < count:
        cards += [values[index] for index in rng.permutation(len(values))]
    return cards[:count]


def cases(name: str, plan: Plan, chosen: Sequence[int]) -> Iterator[Case]:
    """Yield the chosen frames of a plan.

    Parameters
    ----------
    name : str
        Of the scenario.
    plan : Plan
    chosen : sequence of int
        Numbers of frames, counted through all worlds; ascending.
    """
    hands = _hands(plan)
    by_world: dict[int, list[int]] = {}
    for number in chosen:
        by_world.setdefault(number // plan.frames, []).append(number % plan.frames)
    for index, frames in by_world.items():
        world = _world(plan, index, {key: hand[index] for key, hand in hands.items()})
        bodies, tilts = _attitudes(plan, world)
        for frame in frames:
            yield Case(
                name=f"{name}/{index:03d}-{frame}",
                scenario=name,
                scene=world.scene,
                rig=world.rig,
                body=bodies[frame],
                tilt=tilts[frame],
                light=world.light,
                noise=world.drawn["noise"],
                seed=(plan.seed * 1000 + index) * 1000 + frame,
                rig_seed=plan.seed * 1000 + index,
                tags=_tags(world, bodies[frame]),
            )


def _hands(plan: Plan) -> dict[str, list[Any]]:
    """Deal every sweep to the worlds, under names such as ``rig.height``.

    A world gets one value of most, one for each frame of ``body.pitch_deg`` and ``body.roll_deg``,
    one for each thing of ``things.kind`` and ``things.range``.
    """
    once = [1] * plan.worlds
    counts = deal(plan.things.count, plan.worlds, seed=plan.seed, name="things.count")
    several = {
        "body.pitch_deg": [plan.frames] * plan.worlds,
        "body.roll_deg": [plan.frames] * plan.worlds,
        "things.kind": [int(count) for count in counts],
        "things.range": [int(count) for count in counts],
    }
    sweeps = {"light": plan.light, "noise": plan.noise}
    for table in TABLES:
        values = getattr(plan, table)
        sweeps |= {f"{table}.{item.name}": getattr(values, item.name) for item in fields(values)}
    hands: dict[str, list[Any]] = {}
    for name, values in sweeps.items():
        shares = several.get(name, once)
        cards = iter(deal(values, sum(shares), seed=plan.seed, name=name))
        dealt = [list(islice(cards, share)) for share in shares]
        if values:
            hands[name] = dealt if name in several else [one for (one,) in dealt]
    return hands


def _world(plan: Plan, index: int, drawn: Mapping[str, Any]) -> World:
    rig = _rig(drawn)
    ground = _ground(drawn)
    scene = Scene(
        ground=ground,
        things=_things(plan, index, drawn, ground),
        grass=_grass(plan, index, drawn),
        clearance=drawn["rig.clearance"],
    )
    return World(index=index, drawn=drawn, scene=scene, rig=rig, light=PRESETS[drawn["light"]])


def _rig(drawn: Mapping[str, Any]) -> Rig:
    f = 0.5 * WIDTH / math.tan(0.5 * math.radians(drawn["rig.hfov_deg"]))
    camera = Camera(
        width=WIDTH,
        height=HEIGHT,
        fx=f,
        fy=f,
        cx=0.5 * (WIDTH - 1),
        cy=0.5 * (HEIGHT - 1),
        baseline=drawn["rig.baseline"],
    )
    pitch = math.radians(drawn["rig.mount_pitch_deg"])
    return Rig(camera=camera, mount=Mount(height=drawn["rig.height"], pitch=pitch))


def _ground(drawn: Mapping[str, Any]) -> Ground:
    start, step = drawn["ground.start"], drawn["ground.step"]
    slope = math.tan(math.radians(drawn["ground.slope_deg"]))
    pieces: list[tuple[float, float, float]] = []
    if step or slope:
        pieces.append((start, step, slope))
    if slope:
        pieces.append((start + drawn["ground.rise"] / abs(slope), 0.0, 0.0))
    return Ground(
        texture=SURFACES[drawn["ground.surface"]],
        pieces=tuple(pieces),
        cross=math.tan(math.radians(drawn["ground.cross_slope_deg"])),
        pits=_pits(drawn),
    )


def _pits(drawn: Mapping[str, Any]) -> tuple[Pit, ...]:
    if not drawn["hole.count"]:
        return ()
    x, y, half = drawn["hole.range"], drawn["hole.y"], 0.5 * drawn["hole.width"]
    pit = Pit(
        x0=x,
        x1=x + drawn["hole.length"],
        y0=y - half,
        y1=y + half,
        depth=drawn["hole.depth"],
        texture=SOIL,
    )
    return (pit,)


def _grass(plan: Plan, index: int, drawn: Mapping[str, Any]) -> tuple[Grass, ...]:
    if not drawn["grass.height"]:
        return ()
    x0, x1, y0, y1 = _LAWN
    patch = Grass(
        height=drawn["grass.height"],
        density=drawn["grass.density"],
        x0=x0,
        x1=x1,
        y0=y0,
        y1=y1,
        seed=plan.seed * 1000 + index,
    )
    return (patch,)


def _things(plan: Plan, index: int, drawn: Mapping[str, Any], ground: Ground) -> tuple[Thing, ...]:
    """Place things, the field of view cut into as many sectors; what finds no room is left out."""
    kinds, ranges = drawn["things.kind"], drawn["things.range"]
    rng = np.random.default_rng((plan.seed, index, 1))
    placed: list[Thing] = []
    for number, kind in enumerate(kinds):
        for attempt in range(_ATTEMPTS):
            far = ranges[number] if attempt == 0 else float(rng.choice(plan.things.range))
            bearing = _bearing(drawn, number, rng)
            found = place(kind, far, bearing, ground=ground, seed=(plan.seed, index, 2, number))
            if all(_apart(new, old) for new in found for old in placed):
                placed += found
                break
    return tuple(placed)


def _bearing(drawn: Mapping[str, Any], number: int, rng: np.random.Generator) -> float:
    """Return where in its sector a thing stands [rad]."""
    count = drawn["things.count"]
    if count == 1 and "things.bearing_deg" in drawn:
        return math.radians(drawn["things.bearing_deg"])
    field = math.radians(drawn["rig.hfov_deg"]) * drawn["things.spread"]
    share = (number + rng.uniform(0.2, 0.8)) / count - 0.5
    return float(-field * share)


def _apart(one: Thing, other: Thing) -> bool:
    """Tell whether the discs about two things leave a gap."""
    (a, reach_a), (b, reach_b) = _disc(one), _disc(other)
    return float(np.linalg.norm(a - b)) > reach_a + reach_b + _GAP


def _disc(thing: Thing) -> tuple[Any, float]:
    eye = np.zeros(2)
    points = np.concatenate([part.outline(eye) for part in thing.parts])
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def _attitudes(plan: Plan, world: World) -> tuple[list[Attitude], list[Tilt | None]]:
    """Return body and reading of every frame of a world."""
    before, now = _swing(plan, world)
    read = _read(world, before, now, np.random.default_rng((plan.seed, world.index, 3)))
    missing = world.drawn["tilt.reading"] == "missing"
    bodies = [Attitude(pitch=float(pitch), roll=float(roll)) for pitch, roll in now]
    tilts = [None if missing else Tilt(pitch=float(p), roll=float(r)) for p, r in read]
    return bodies, tilts


def _swing(plan: Plan, world: World) -> tuple[Float64, Float64]:
    """Return pitch and roll a frame before each frame and at it [rad], shape (frames, 2) each.

    A body that does not shake stands still before every frame, however it stood in the last.
    """
    drawn = np.array([world.drawn["body.pitch_deg"], world.drawn["body.roll_deg"]], dtype=float).T
    shake = world.drawn["body.shake_deg"]
    if shake:
        rng = np.random.default_rng((plan.seed, world.index, 4))
        path = shake * np.cumsum(rng.choice([-1.0, 1.0], (plan.frames + 1, 2)), axis=0)
        path += drawn[0] - path.mean(axis=0)
        before, now = path[:-1], path[1:]
    else:
        before, now = drawn, drawn
    stance = standing(world.scene)
    upright = np.array([stance.pitch, stance.roll])
    return upright + np.radians(before), upright + np.radians(now)


def _read(world: World, before: Float64, now: Float64, rng: np.random.Generator) -> Float64:
    """Return what the sensor reads at each frame [rad], shape (frames, 2)."""
    drawn, reading = world.drawn, world.drawn["tilt.reading"]
    towards = rng.uniform(0.0, 2.0 * math.pi)
    noise = math.radians(drawn["tilt.noise_deg"]) * rng.standard_normal(now.shape)
    read = now if reading == "exact" else now + noise
    if reading == "late":  # the body moves evenly from frame to frame
        read = read - 1e-3 * drawn["tilt.late_ms"] / FRAME_TIME * (now - before)
    if reading == "biased":
        bias = math.radians(drawn["tilt.bias_deg"])
        read = read + bias * np.array([math.cos(towards), math.sin(towards)])
    return read


def _tags(world: World, body: Attitude) -> dict[str, str | float]:
    drawn, scene = world.drawn, world.scene
    tags: dict[str, str | float] = {
        "surface": "tall-grass" if scene.grass else drawn["ground.surface"],
        "light": drawn["light"],
        "noise": drawn["noise"],
        "tilt": drawn["tilt.reading"],
        "pitch_deg": round(math.degrees(body.pitch), 3),
        "roll_deg": round(math.degrees(body.roll), 3),
        **{key: drawn[f"rig.{key}"] for key in ("height", "hfov_deg", "baseline", "clearance")},
    }
    kind, distance = _only(world)
    if kind:
        tags |= {"kind": kind, "range": distance}
    if not (scene.things or scene.ground.pits or scene.ground.pieces or scene.ground.cross):
        tags["empty"] = True
    return tags


def _only(world: World) -> tuple[str, float]:
    """Return what the one thing, hole, slope or step of a world is, and its range [m]."""
    scene, start = world.scene, world.drawn["ground.start"]
    if scene.things:
        if world.drawn["things.count"] > 1:
            return "", math.nan
        eye = np.zeros(2)
        points = [part.nearest(eye) for thing in scene.things for part in thing.parts]
        return scene.things[0].name, round(float(np.linalg.norm(points, axis=1).min()), 3)
    if scene.ground.pits:
        return "pit", world.drawn["hole.range"]
    if scene.ground.pieces:
        return _bend(world), start
    return ("cross slope", 0.0) if scene.ground.cross else ("", math.nan)


def _bend(world: World) -> str:
    """Return what begins where the ground is no longer flat."""
    ground = world.scene.ground
    if ground.faces():
        return ground.faces()[0].name
    if ground.drops():
        return "drop"
    return "low step" if world.drawn["ground.step"] else "ramp"

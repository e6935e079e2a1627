"""A world of flat ground pieces with pits, and of things that stand on it.

Coordinates and rays as in `bearcub.sim.solids`.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from bearcub.config import Detection
from bearcub.errors import ConfigError
from bearcub.messages import Bool, Float64
from bearcub.sim.grass import Grass
from bearcub.sim.solids import Part, Solid
from bearcub.sim.texture import Reals, Texture

STEEPEST = math.tan(math.radians(30.0))
"""Ground steeper than this is an obstacle, not a way."""
HIGHEST_STEP = 0.1
"""A rise steeper than `STEEPEST` blocks the way from this height on [m]."""

_SEAM = 1e-5  # neighbouring pieces overlap by so much [m], so that no ray slips between


@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """The ground piece ``z = height + slope (x - start) + cross y`` from `start` to `end`."""

    start: float
    end: float
    height: float
    slope: float
    cross: float
    texture: Texture
    pits: tuple["Pit", ...] = ()

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return t of every ray; rays through the mouth of a pit pass."""
        t = self.through(origin, ray)
        x, y = origin[0] + t * ray[0], origin[1] + t * ray[1]
        met = (x >= self.start - _SEAM) & (x <= self.end + _SEAM)
        for pit in self.pits:
            met &= ~pit.mouth(x, y)
        return np.where(met, t, np.inf).astype(t.dtype)

    def through(self, origin: Reals, ray: Reals, below: float = 0.0) -> Reals:
        """Return t where rays pass the unbounded plane, or one so far `below` it."""
        anchor = self.start if math.isfinite(self.start) else 0.0
        gap = self.height - below + self.slope * (origin[0] - anchor) + self.cross * origin[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (gap - origin[2]) / (ray[2] - self.slope * ray[0] - self.cross * ray[1])
        return np.where(t > 0, t, np.nan).astype(t.dtype)

    def at(self, x: float, y: float) -> float:
        """Return the ground's z [m]."""
        anchor = self.start if math.isfinite(self.start) else 0.0
        return self.height + self.slope * (x - anchor) + self.cross * y

    def below(self, point: Reals) -> Reals:
        """Return how far points, shape (3, N), lie vertically below the plane [m]."""
        depth: Reals = self.at(0.0, 0.0) + self.slope * point[0] + self.cross * point[1] - point[2]
        return depth

    def normal(self) -> Float64:
        """Return the unit vector out of the ground, shape (3,)."""
        n = np.array([-self.slope, -self.cross, 1.0])
        return n / float(np.linalg.norm(n))

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return normal and (x, y)."""
        return _same(self.normal(), point), point[0], point[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Riser:
    """The vertical face at `x` between two ground pieces, which looks back at the robot."""

    x: float
    lower: Plane
    upper: Plane
    texture: Texture

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return t of every ray that comes from smaller x."""
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (self.x - origin[0]) / ray[0]
            z = origin[2] + t * ray[2] - self.lower.cross * (origin[1] + t * ray[1])
        met = (t > 0) & (z >= self.lower.at(self.x, 0.0)) & (z <= self.upper.at(self.x, 0.0))
        return np.where(met, t, np.inf).astype(t.dtype)

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return normal and (y, z)."""
        return _same(np.array([-1.0, 0.0, 0.0]), point), point[1], point[2]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pit:
    """A rectangular hole with vertical walls and a bottom `depth` below the ground."""

    x0: float
    x1: float
    y0: float
    y1: float
    depth: float
    texture: Texture

    def mouth(self, x: Reals, y: Reals) -> Bool:
        """Return which points of the ground are missing."""
        inside: Bool = (x > self.x0) & (x < self.x1) & (y > self.y0) & (y < self.y1)
        return inside

    def outline(self) -> Float64:
        """Return the corners of the mouth (x, y), shape (4, 2)."""
        return np.array([[x, y] for x in (self.x0, self.x1) for y in (self.y0, self.y1)])


@dataclass(frozen=True, slots=True, kw_only=True)
class PitInside:
    """The walls and the bottom of a pit in its ground piece."""

    pit: Pit
    plane: Plane

    @property
    def texture(self) -> Texture:
        """What it looks like."""
        return self.pit.texture

    def hit(self, origin: Reals, ray: Reals) -> Reals:
        """Return t where rays that enter through the mouth meet a wall or the bottom."""
        pit = self.pit
        t = self.plane.through(origin, ray)
        entered = pit.mouth(origin[0] + t * ray[0], origin[1] + t * ray[1])
        with np.errstate(divide="ignore", invalid="ignore"):
            wall_x = (np.where(ray[0] > 0, pit.x1, pit.x0).astype(t.dtype) - origin[0]) / ray[0]
            wall_y = (np.where(ray[1] > 0, pit.y1, pit.y0).astype(t.dtype) - origin[1]) / ray[1]
        bottom = self.plane.through(origin, ray, pit.depth)
        leaves = np.fmin(np.fmin(wall_x, wall_y), bottom)
        return np.where(entered, leaves, np.inf).astype(t.dtype)

    def surface(self, point: Reals) -> tuple[Reals, Reals, Reals]:
        """Return normal and coordinates on the nearest of the five faces."""
        pit, (x, y, z) = self.pit, point
        gaps = np.stack(
            [pit.depth - self.plane.below(point), x - pit.x0, pit.x1 - x, y - pit.y0, pit.y1 - y]
        )
        face = np.argmin(np.abs(gaps), axis=0)
        normals = np.array(
            [self.plane.normal(), [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=point.dtype
        )
        s = np.where((face == 1) | (face == 2), y, x)
        return normals[face].T, s, np.where(face == 0, y, z)

    def daylight(self, point: Reals) -> Reals:
        """Return the share of the sky's light that reaches points inside, by their depth."""
        opening = min(self.pit.x1 - self.pit.x0, self.pit.y1 - self.pit.y0)
        below = np.maximum(self.plane.below(point), 0)
        share: Reals = (1.0 / (1.0 + 1.5 * below / opening)).astype(point.dtype)
        return share

    def shaded(self, point: Reals, sun: Float64) -> Bool:
        """Return which points inside the walls keep the sun from."""
        t = self.plane.through(point, sun.astype(point.dtype)[:, None])
        return ~self.pit.mouth(point[0] + t * sun[0], point[1] + t * sun[1])


@dataclass(frozen=True, slots=True, kw_only=True)
class Face:
    """A part of the ground that nobody drives up: see `Ground.faces`.

    Attributes
    ----------
    name : str
        "step" (vertical: a kerb, a stair) or "bank" (steep).
    start, end : float
        Of its foot and its upper edge along x [m].
    foot : float
        z at the foot, on the x axis [m].
    rise : float
        [m]; inf where it has no upper edge.
    """

    name: str
    start: float
    end: float
    foot: float
    rise: float


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Flat pieces along x, all with one cross slope, with pits.

    Attributes
    ----------
    texture : Texture
    pieces : tuple of (float, float, float)
        (x where it starts [m], step up there [m], slope ahead as tangent); ascending. Ahead of
        the first the ground is flat.
    cross : float
        Tangent of the cross slope; positive where the ground rises to the left.
    pits : tuple of Pit
        Each within one piece.
    """

    texture: Texture
    pieces: tuple[tuple[float, float, float], ...] = ()
    cross: float = 0.0
    pits: tuple[Pit, ...] = ()

    def __post_init__(self) -> None:
        starts = [x for x, _, _ in self.pieces]
        if any(b <= a for a, b in pairwise(starts)):
            raise ConfigError(f"ground.pieces start at {starts}: must ascend")

    @cached_property
    def planes(self) -> tuple[Plane, ...]:
        """The pieces as planes with their pits, from behind the robot to infinity."""
        ends = [x for x, _, _ in self.pieces] + [math.inf]
        planes = [self._plane(start=-math.inf, end=ends[0], height=0.0, slope=0.0)]
        for (start, step, slope), end in zip(self.pieces, ends[1:], strict=True):
            height = planes[-1].at(start, 0.0) + step
            planes.append(self._plane(start=start, end=end, height=height, slope=slope))
        return tuple(planes)

    def _plane(self, *, start: float, end: float, height: float, slope: float) -> Plane:
        inside = tuple(pit for pit in self.pits if start <= pit.x0 < end)
        return Plane(
            start=start,
            end=end,
            height=height,
            slope=slope,
            cross=self.cross,
            texture=self.texture,
            pits=inside,
        )

    def at(self, x: float, y: float) -> float:
        """Return the ground's z [m] (pits filled)."""
        return next(plane for plane in reversed(self.planes) if x >= plane.start).at(x, y)

    def faces(self) -> list[Face]:
        """Return what of the ground is an obstacle, ascending in x.

        These are steps up and pieces steeper than `STEEPEST`, where they rise by `HIGHEST_STEP`
        or more. What is lower or less steep is terrain, as is everything that leads down.
        """
        found = []
        for below, plane in pairwise(self.planes):
            x, foot = plane.start, below.at(plane.start, 0.0)
            step, climb = plane.height - foot, plane.slope * (plane.end - x)
            if step >= HIGHEST_STEP:
                found.append(Face(name="step", start=x, end=x, foot=foot, rise=step))
            if plane.slope > STEEPEST and climb >= HIGHEST_STEP:
                found.append(
                    Face(name="bank", start=x, end=plane.end, foot=plane.height, rise=climb)
                )
        return found

    def parts(self, *, things: int = 0) -> list[tuple[Part, int]]:
        """Return its surfaces with their labels.

        0 is the ground; -1, -2, ... are pits, then what lies beyond drops; `faces` are numbered on
        after so many `things`.
        """
        names = [(face.name, face.start) for face in self.faces()]
        parts: list[tuple[Part, int]] = []
        hole, level = 0, -len(self.pits)
        label = 0

        def of_face(name: str, x: float) -> int:
            return 1 + things + names.index((name, x)) if (name, x) in names else label

        for before, plane in zip((None, *self.planes), self.planes, strict=False):
            step = 0.0 if before is None else plane.height - before.at(plane.start, 0.0)
            if before is not None and step > 0:
                riser = Riser(x=plane.start, lower=before, upper=plane, texture=self.texture)
                parts.append((riser, of_face("step", plane.start)))
            if step < 0:
                level -= 1
                label = level
            parts.append((plane, of_face("bank", plane.start)))
            for pit in plane.pits:
                hole -= 1
                parts.append((PitInside(pit=pit, plane=plane), hole))
        return parts

    def drops(self) -> list[tuple[float, float]]:
        """Return (x, depth) of every step down [m]."""
        return [(x, -step) for x, step, _ in self.pieces if step < 0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """One obstacle, made of solid parts; it stands on (or hangs over) the ground at `foot`."""

    name: str
    foot: tuple[float, float]
    parts: tuple[Solid, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A world to look at.

    Attributes
    ----------
    ground : Ground
    things : tuple of Thing
    grass : tuple of Grass
        Patches of standing blades on the ground; the ray caster leaves them out.
    sun : tuple of float
        Direction to the sun.
    shadows : bool
        Whether things cast shadows.
    clearance : float
        Height of the robot [m]: what hangs this high or higher does not block its way.
    """

    ground: Ground
    things: tuple[Thing, ...] = ()
    grass: tuple[Grass, ...] = ()
    sun: tuple[float, float, float] = (-0.55, 0.52, 0.65)
    shadows: bool = True
    clearance: float = Detection().clearance

    def parts(self) -> list[tuple[Part, int]]:
        """Return every surface with its label; things are 1, 2, ... in their order."""
        solids: list[tuple[Part, int]] = [
            (part, label) for label, thing in enumerate(self.things, 1) for part in thing.parts
        ]
        return self.ground.parts(things=len(self.things)) + solids


def _same(vector: Float64, point: Reals) -> Reals:
    """Repeat one vector for every point."""
    return np.broadcast_to(vector.astype(point.dtype)[:, None], point.shape)

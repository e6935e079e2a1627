"""A scene's surfaces as flat meshes: patches, each small enough for one texture.

A surface is parametrised by (s, t) [m]; `Sheet.place` gives the point in level coordinates. Sheets
are cut along lines that move apart with the distance from the eye, because what is far needs
fewer texels; all sheets of one surface share the lines, so that meshes meet without cracks.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import ConfigError
from bearcub.messages import Float64
from bearcub.sim.solids import Box, Cone, Cylinder, Part
from bearcub.sim.world import PitInside, Plane, Riser, Scene

FAR = 1500.0  # the ground ends so far from the origin [m]
REAR = 12.0  # and so far behind it
_FACETS = 96  # of a cylinder: its outline is off by 0.05 % of the radius
_DENSITY = 0.5  # texels per pixel and direction, inverse
_GRAZING = 24.0  # a surface seen more edge-on than this gets no coarser texels
_PROBES = 5  # points along a tile's side where its distance is measured
_LARGEST = 2048  # side of a texture [texels]

# where the ground is cut into tiles [m]
_TILES_X = (-3, 0, 0.4, 0.8, 1.4, 2, 2.8, 4, 5.6, 8, 12, 20, 40, 100, 300)
_TILES_Y = (0.0, *(side * y for side in (-1.0, 1.0) for y in (1, 3, 10, 40, 200)))

Place = Callable[[Float64, Float64], Float64]


@dataclass(frozen=True, kw_only=True)
class Patch:
    """A piece of a surface with a texture of its own.

    Attributes
    ----------
    part : Part
        The surface it belongs to.
    s, t : tuple of float
        The rectangle of parameters that the texture covers [m].
    texels : tuple of int
        Columns (along s) and rows (along t) of the texture.
    place : callable
        Returns the points, shape (3, N), at parameters of shape (N,).
    st : ndarray of float64, shape (K, 2)
        Parameters of the mesh's vertices.
    faces : ndarray of int32, shape (M, 3)
    """

    part: Part
    s: tuple[float, float]
    t: tuple[float, float]
    texels: tuple[int, int]
    place: Place
    st: Float64
    faces: NDArray[np.int32]

    def vertices(self) -> Float64:
        """Return the mesh's vertices in level coordinates [m], shape (K, 3)."""
        return np.ascontiguousarray(self.place(self.st[:, 0], self.st[:, 1]).T)

    def texture_coordinates(self) -> Float64:
        """Return (u, v) of every vertex, 0 to 1, shape (K, 2)."""
        low = np.array([self.s[0], self.t[0]])
        size = np.array([self.s[1] - self.s[0], self.t[1] - self.t[0]])
        share: Float64 = (self.st - low) / size
        return share

    def centres(self) -> tuple[Float64, Float64]:
        """Return the parameters of the texels' centres, row by row, each of shape (N,)."""
        columns, rows = self.texels
        s = self.s[0] + (np.arange(columns) + 0.5) * ((self.s[1] - self.s[0]) / columns)
        t = self.t[0] + (np.arange(rows) + 0.5) * ((self.t[1] - self.t[0]) / rows)
        grid_s, grid_t = np.meshgrid(s, t)
        return grid_s.reshape(-1), grid_t.reshape(-1)

    def facing(self) -> tuple[Float64, Float64] | None:
        """Return a point and the outward normal there of a flat patch; None of a curved one."""
        centre = self.place(*(np.array([0.5 * (low + high)]) for low, high in (self.s, self.t)))
        normal = np.asarray(self.part.surface(centre)[0][:, 0], dtype=np.float64)
        off = (self.vertices() - centre.T) @ normal
        return (centre[:, 0], normal) if float(np.abs(off).max()) < 1e-6 * FAR else None

    def texel(self) -> float:
        """Return the side of a texel [m]."""
        return max(
            (self.s[1] - self.s[0]) / self.texels[0], (self.t[1] - self.t[0]) / self.texels[1]
        )


@dataclass(frozen=True, kw_only=True)
class _Sheet:
    """A rectangle of parameters, with the lines along which its mesh must be cut."""

    part: Part
    place: Place
    s: tuple[float, float]
    t: tuple[float, float]
    s_lines: tuple[float, ...] = ()
    t_lines: tuple[float, ...] = ()
    missing: Callable[[float, float], bool] = lambda _s, _t: False
    tiles: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())


def patches(scene: Scene, eyes: Float64, focal: float) -> Iterator[Patch]:
    """Cut all surfaces of a scene into patches.

    Parameters
    ----------
    scene : Scene
    eyes : ndarray of float64, shape (K, 3)
        Where cameras will be, level [m].
    focal : float
        Focal length of these cameras [px].
    """
    for part, _ in scene.parts():
        if isinstance(part, Cylinder | Cone):
            yield from _ends(_turned(part), eyes, focal)
        for sheet in _sheets(part):
            yield from _cut(sheet, eyes, focal)


def _sheets(part: Part) -> list[_Sheet]:
    if isinstance(part, Plane):
        return [_ground(part)]
    if isinstance(part, Riser):
        return [_riser(part)]
    if isinstance(part, PitInside):
        return _inside(part)
    if isinstance(part, Box):
        return _faces(part)
    if isinstance(part, Cylinder | Cone):
        return [_side(_turned(part))]
    raise ConfigError(
        f"a {type(part).__name__} has no mesh in the MuJoCo world: expected Plane, Riser, "
        "PitInside, Box, Cylinder or Cone"
    )


def _ground(plane: Plane) -> _Sheet:
    return _Sheet(
        part=plane,
        place=lambda s, t: np.stack([s, t, _heights(plane, s, t)]),
        s=(max(plane.start, -REAR), min(plane.end, FAR)),
        t=(-FAR, FAR),
        s_lines=tuple(x for pit in plane.pits for x in (pit.x0, pit.x1)),
        t_lines=tuple(y for pit in plane.pits for y in (pit.y0, pit.y1)),
        missing=lambda s, t: any(pit.x0 < s < pit.x1 and pit.y0 < t < pit.y1 for pit in plane.pits),
        tiles=(_TILES_X, _TILES_Y),
    )


def _heights(plane: Plane, s: Float64, t: Float64) -> Float64:
    """Return the plane's z at points; `Plane.at` for arrays."""
    z: Float64 = plane.at(0.0, 0.0) + plane.slope * s + plane.cross * t
    return z


def _riser(riser: Riser) -> _Sheet:
    low, high = riser.lower.at(riser.x, 0.0), riser.upper.at(riser.x, 0.0)
    return _Sheet(
        part=riser,
        place=lambda s, t: np.stack([np.full_like(s, riser.x), s, t + riser.lower.cross * s]),
        s=(-FAR, FAR),
        t=(low, high),
        tiles=(_TILES_Y, ()),
    )


def _inside(inside: PitInside) -> list[_Sheet]:
    pit, plane = inside.pit, inside.plane

    def bottom(s: Float64, t: Float64) -> Float64:
        return np.stack([s, t, _heights(plane, s, t) - pit.depth])

    def wall_x(x: float) -> Place:
        def place(s: Float64, t: Float64) -> Float64:
            at = np.full_like(s, x)
            return np.stack([at, s, _heights(plane, at, s) + t])

        return place

    def wall_y(y: float) -> Place:
        def place(s: Float64, t: Float64) -> Float64:
            at = np.full_like(s, y)
            return np.stack([s, at, _heights(plane, s, at) + t])

        return place

    deep = (-pit.depth, 0.0)
    return [
        _Sheet(part=inside, place=bottom, s=(pit.x0, pit.x1), t=(pit.y0, pit.y1)),
        *(
            _Sheet(part=inside, place=wall_x(x), s=(pit.y0, pit.y1), t=deep)
            for x in (pit.x0, pit.x1)
        ),
        *(
            _Sheet(part=inside, place=wall_y(y), s=(pit.x0, pit.x1), t=deep)
            for y in (pit.y0, pit.y1)
        ),
    ]


def _faces(box: Box) -> list[_Sheet]:
    half = 0.5 * np.array(box.size)
    c, s = math.cos(box.yaw), math.sin(box.yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    centre = np.array([box.x, box.y, box.bottom + half[2]])
    sheets = []
    for axis in range(3):
        one, two = [other for other in range(3) if other != axis]
        for side in (-1.0, 1.0):
            middle = centre + turn[:, axis] * (side * half[axis])
            sheets.append(
                _Sheet(
                    part=box,
                    place=_flat(middle, turn[:, one], turn[:, two]),
                    s=(-half[one], half[one]),
                    t=(-half[two], half[two]),
                    tiles=(_doubling(half[one]), _doubling(half[two])),
                )
            )
    return sheets


def _doubling(half: float) -> tuple[float, ...]:
    """Return cuts that keep the tiles of a long face short near its middle."""
    steps = [2.0**k for k in range(12) if 2.0**k < half]
    return (*steps, *(-x for x in steps))


def _flat(middle: Float64, along: Float64, across: Float64) -> Place:
    def place(s: Float64, t: Float64) -> Float64:
        return middle[:, None] + along[:, None] * s + across[:, None] * t

    return place


@dataclass(frozen=True, kw_only=True)
class _Turned:
    """A cylinder or cone: radii at both ends of an axis, turned from `across` to `third`."""

    part: Part
    start: Float64
    axis: Float64
    across: Float64
    third: Float64
    length: float
    radii: tuple[float, float]

    def side(self, s: Float64, t: Float64) -> Float64:
        """Return the points at arc `s` (of the first radius) and height `t` along the axis."""
        angle = s / self.radii[0]
        radius = self.radii[0] + (self.radii[1] - self.radii[0]) * t / self.length
        out = self.across[:, None] * np.cos(angle) + self.third[:, None] * np.sin(angle)
        points: Float64 = self.start[:, None] + radius * out + self.axis[:, None] * t
        return points


def _turned(part: Cylinder | Cone) -> _Turned:
    """Return the axes as `surface` of the part has them."""
    if isinstance(part, Cone):
        x, y, z = np.eye(3)
        return _Turned(
            part=part,
            start=np.array([part.x, part.y, part.bottom]),
            axis=z,
            across=x,
            third=y,
            length=part.height,
            radii=part.radii,
        )
    start, end = np.array(part.start), np.array(part.end)
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / length
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    return _Turned(
        part=part,
        start=start,
        axis=axis,
        across=across,
        third=np.cross(axis, across),
        length=length,
        radii=(part.radius, part.radius),
    )


def _side(turned: _Turned) -> _Sheet:
    half = math.pi * turned.radii[0]
    return _Sheet(
        part=turned.part,
        place=turned.side,
        s=(-half, half),
        t=(0.0, turned.length),
        s_lines=tuple(np.linspace(-half, half, _FACETS + 1)[1:-1]),
    )


def _ends(turned: _Turned, eyes: Float64, focal: float) -> Iterator[Patch]:
    angles = np.linspace(0, 2 * math.pi, _FACETS, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    one = np.arange(_FACETS)
    faces = np.stack([np.full(_FACETS, _FACETS), one, (one + 1) % _FACETS], axis=1)
    for level, radius in zip((0.0, turned.length), turned.radii, strict=True):
        place = _flat(turned.start + level * turned.axis, turned.across, turned.third)
        extent = (-radius, radius)
        yield Patch(
            part=turned.part,
            s=extent,
            t=extent,
            texels=_texels(place, extent, extent, eyes, focal),
            place=place,
            st=np.vstack([radius * circle, np.zeros((1, 2))]),
            faces=faces.astype(np.int32),
        )


def _cut(sheet: _Sheet, eyes: Float64, focal: float) -> Iterator[Patch]:
    """Cut a sheet along its tiles' lines, and every tile's mesh along all lines."""
    tiles_s, tiles_t = _within(sheet.tiles[0], sheet.s), _within(sheet.tiles[1], sheet.t)
    all_s, all_t = _within(sheet.s_lines, sheet.s), _within(sheet.t_lines, sheet.t)
    lines_s, lines_t = sorted({*tiles_s, *all_s}), sorted({*tiles_t, *all_t})
    for s in pairwise(tiles_s):
        for t in pairwise(tiles_t):
            st, faces = _grid(
                [x for x in lines_s if s[0] <= x <= s[1]],
                [x for x in lines_t if t[0] <= x <= t[1]],
                sheet.missing,
            )
            if faces.size:
                yield Patch(
                    part=sheet.part,
                    s=s,
                    t=t,
                    texels=_texels(sheet.place, s, t, eyes, focal),
                    place=sheet.place,
                    st=st,
                    faces=faces,
                )


def _within(lines: tuple[float, ...], bounds: tuple[float, float]) -> list[float]:
    return sorted({*bounds, *(x for x in lines if bounds[0] < x < bounds[1])})


def _grid(
    s: list[float], t: list[float], missing: Callable[[float, float], bool]
) -> tuple[Float64, NDArray[np.int32]]:
    """Return vertices (s, t) and the triangles of all cells that are not missing."""
    vertices = np.array([(x, y) for y in t for x in s])
    faces: list[tuple[int, int, int]] = []
    for row, (t0, t1) in enumerate(pairwise(t)):
        for column, (s0, s1) in enumerate(pairwise(s)):
            if not missing(0.5 * (s0 + s1), 0.5 * (t0 + t1)):
                a = row * len(s) + column
                b = a + len(s)
                faces += [(a, a + 1, b + 1), (a, b + 1, b)]
    return vertices, np.array(faces, dtype=np.int32).reshape(-1, 3)


def _texels(
    place: Place, s: tuple[float, float], t: tuple[float, float], eyes: Float64, focal: float
) -> tuple[int, int]:
    """Return how many texels a tile needs to be as sharp as the nearest eye can see."""
    share = np.linspace(0.0, 1.0, _PROBES)
    grid_s, grid_t = np.meshgrid(s[0] + share * (s[1] - s[0]), t[0] + share * (t[1] - t[0]))
    points = place(grid_s.reshape(-1), grid_t.reshape(-1)).T
    away: Any = points[None] - eyes[:, None]
    gaps = np.linalg.norm(away, axis=2)
    eye, point = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
    near = float(gaps[eye, point])
    normal = np.cross(points[_PROBES - 1] - points[0], points[-_PROBES] - points[0])
    area = float(np.linalg.norm(normal))  # 0 of what is curved into a ring
    facing = abs(float(away[eye, point] @ normal)) / (near * area) if area > 1e-9 else 1.0
    texel = _DENSITY * near / focal / max(facing, 1.0 / _GRAZING)
    columns, rows = (math.ceil((x[1] - x[0]) / texel) for x in (s, t))
    return min(max(columns, 2), _LARGEST), min(max(rows, 2), _LARGEST)

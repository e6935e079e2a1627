"""Patches of standing grass: bent blades, each of its own height, lean and tone."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Float32, Float64
from bearcub.sim.light import Light

TONES = 64
"""Columns of a palette: eight greens, each in eight strengths of light."""
_GREENS, _STRENGTHS = 8, 8
_STEPS = 16  # rows of a palette, from the root to the tip
_WIDTH = 0.014  # of a blade at its root: broad, as few stand for the many of a lawn [m]
_DETAILED = 4.0  # nearer than this blades are bent, farther ones straight [m]
_DRY = np.array([0.10, 0.36, 0.30], dtype=np.float32)  # albedo, blue green red
_FRESH = np.array([0.04, 0.22, 0.09], dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class Grass:
    """A rectangle of ground with standing blades.

    Attributes
    ----------
    height : float
        Of the tallest blades [m].
    density : float
        Blades per square metre.
    x0, x1, y0, y1 : float
        The rectangle [m], level.
    seed : int
        Of the blades' places and shapes.
    """

    height: float
    density: float
    x0: float
    x1: float
    y0: float
    y1: float
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Blades:
    """Blades as one mesh of triangles that are seen from both sides.

    Attributes
    ----------
    vertices : ndarray of float64, shape (N, 3)
        Level, above the ground at each blade's root [m].
    roots : ndarray of float64, shape (N, 2)
        (x, y) of the root of each vertex's blade [m].
    faces : ndarray of int32, shape (M, 3)
    tones, up : ndarray of float64, shape (N,)
        Where a vertex's colour is in the palette, 0 to 1: along the tones, and from root to tip.
    """

    vertices: Float64
    roots: Float64
    faces: NDArray[np.int32]
    tones: Float64
    up: Float64


def blades(patch: Grass, *, sun: Float64, seed: int = 0) -> Blades:
    """Grow the blades of a patch.

    Parameters
    ----------
    patch : Grass
    sun : ndarray of float64, shape (3,)
        Unit vector to the sun: blades edge-on to it are darker.
    seed : int
        Together with the patch's own.
    """
    rng = np.random.default_rng((patch.seed, seed, 17))
    area = (patch.x1 - patch.x0) * (patch.y1 - patch.y0)
    count = max(1, round(area * patch.density))
    root = rng.uniform([patch.x0, patch.y0], [patch.x1, patch.y1], (count, 2))
    tall = patch.height * rng.uniform(0.45, 1.0, count)
    turn, lean = rng.uniform(-np.pi, np.pi, (2, count))
    reach = tall * rng.uniform(0.1, 0.6, count)
    half = 0.5 * _WIDTH * rng.uniform(0.7, 1.4, count)
    side = half[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    tip = reach[:, None] * np.stack([np.cos(lean), np.sin(lean)], axis=1)
    tone = _tones(side, tip, tall, sun, rng)
    near = np.linalg.norm(root, axis=1) < _DETAILED
    shapes = [_straight(*(a[~near] for a in (root, side, tip, tall, tone)))]
    shapes.append(_bent(*(a[near] for a in (root, side, tip, tall, tone))))
    return _merged(shapes)


def palette(light: Light, *, shade: float = 0.3) -> Float32:
    """Return the light of blades, blue green red: shape (3, steps, tones), roots first.

    Blades cast no shadows and stand in none; deep between others they are darker instead.

    Parameters
    ----------
    light : Light
    shade : float
        Share of the light that reaches the roots.
    """
    mix = np.repeat(np.linspace(0.0, 1.0, _GREENS, dtype=np.float32), _STRENGTHS)
    albedo = _FRESH[:, None] + (_DRY - _FRESH)[:, None] * mix
    sunny = np.tile(np.linspace(0.15, 0.85, _STRENGTHS, dtype=np.float32), _GREENS)
    colour = albedo * light.falling(sunny, np.full(TONES, 0.8, dtype=np.float32))
    reaching = np.linspace(shade, 1.0, _STEPS, dtype=np.float32)
    return np.asarray(colour[:, None, :] * reaching[:, None], dtype=np.float32)


def _tones(
    side: Float64, tip: Float64, tall: Float64, sun: Float64, rng: np.random.Generator
) -> Float64:
    """Return every blade's column of the palette, 0 to 1: its green and how the sun meets it."""
    flat = np.zeros(len(tall))
    normal = np.cross(np.column_stack([side, flat]), np.column_stack([tip, tall]), axisa=1, axisb=1)
    facing = np.abs(normal @ sun) / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    strength = np.minimum(facing * _STRENGTHS, _STRENGTHS - 1).astype(int)
    column: Float64 = rng.integers(_GREENS, size=len(tall)) * _STRENGTHS + strength
    return (column + 0.5) / TONES


def _straight(root: Float64, side: Float64, tip: Float64, tall: Float64, tone: Float64) -> Blades:
    """Return blades of one triangle each."""
    return _strips(root, [(-side, 0.0), (side, 0.0), (tip, 1.0)], [(0, 1, 2)], tall, tone)


def _bent(root: Float64, side: Float64, tip: Float64, tall: Float64, tone: Float64) -> Blades:
    """Return blades that bend over: three triangles each."""
    knee, narrow = 0.25 * tip, 0.7 * side
    points = [
        (-side, 0.0),
        (side, 0.0),
        (knee - narrow, 0.6),
        (knee + narrow, 0.6),
        (tip, 1.0),
    ]
    return _strips(root, points, [(0, 1, 3), (0, 3, 2), (2, 3, 4)], tall, tone)


def _strips(
    root: Float64,
    points: list[tuple[Float64, float]],
    faces: list[tuple[int, int, int]],
    tall: Float64,
    tone: Float64,
) -> Blades:
    """Repeat one shape, given as offsets from the root and shares of the height."""
    count, corners = len(tall), len(points)
    places = [
        np.column_stack([root + off, np.broadcast_to(share * tall, count)]) for off, share in points
    ]
    first = corners * np.arange(count, dtype=np.int32)[:, None, None]
    return Blades(
        vertices=np.stack(places, axis=1).reshape(-1, 3),
        roots=np.repeat(root, corners, axis=0),
        faces=(first + np.array(faces, dtype=np.int32)).reshape(-1, 3),
        tones=np.repeat(tone, corners),
        up=np.tile([share for _, share in points], count),
    )


def _merged(shapes: list[Blades]) -> Blades:
    starts = np.cumsum([0, *(len(shape.vertices) for shape in shapes)])
    return Blades(
        vertices=np.concatenate([shape.vertices for shape in shapes]),
        roots=np.concatenate([shape.roots for shape in shapes]),
        faces=np.concatenate(
            [shape.faces + np.int32(start) for shape, start in zip(shapes, starts, strict=False)]
        ),
        tones=np.concatenate([shape.tones for shape in shapes]),
        up=np.concatenate([shape.up for shape in shapes]),
    )

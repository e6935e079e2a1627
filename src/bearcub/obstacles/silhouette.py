"""Where things end to their sides: a matcher tells it to some pixels, the image to parts of one."""

import math
from dataclasses import replace

import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import UInt8
from bearcub.obstacles.cloud import View
from bearcub.obstacles.joining import Thing
from bearcub.obstacles.measure import MARGIN, Extent

_ROWS = 16  # heights at which a side is looked at
_INWARDS, _OUTWARDS = 6, 24  # columns inside and outside of a side that are looked at
_NEAREST = (-3.0, 6.0)  # ... in which the side is, by the matcher [px]
_HALF = 0.4  # ... share of the width of what is narrow
_OFF = (1.0, 3.0)  # 1-sigmas of how far too far out, and too far in, a matched side is [px]
_SHARP = 4  # power of the gradients that leaves the largest
_SHARPER = 6  # ... and hardly any others
_LEAST = 0.1  # 1-sigma of where a side is that the image shows, and nothing else [px]
_SPREAD = 0.5  # ... as a share of how far from it other edges are
_BLUR = 2.0  # how far a silhouette's edge reaches inwards [px]
_FOOT = 0.06  # height of what may be a foot: it is hardly told from the floor [m]
_WIDEST = 0.2  # ... how far outside of a side it is looked for [m]
_WIDER = 1.3  # 1-sigma of size and place for a foot, share of how far outside that seems to end
_NOTHING = 1e-9  # weight of a column without a gradient


def with_silhouettes(things: list[Thing], image: UInt8, view: View) -> list[Thing]:
    """Move the sides of things to their silhouettes, and say how sure these are.

    Along a side, which is taken to be upright, the image's horizontal gradients are added up (root
    of the mean square over its height). The side is where they are largest, near where the matcher
    tells it: each column counts by the fourth power of what it exceeds the typical column by, times
    a normal prior. Where the matcher missed the silhouette, that is an edge elsewhere: the 1-sigma
    of a side is half the RMS distance of all edges around from it, the strongest counting most. So
    the side of a dark end that was matched as floor is doubtful, of a cone, whose sides are not
    upright, or before a neighbour; that of a post is not. A foot too low to be matched shows in the
    same way in the lowest rows, but so do shadows: it does not move the sides, but the width is as
    doubtful as the foot would make it wider, and the distance as it would be nearer.

    Parameters
    ----------
    things : list of Thing
        With sides that were matched; their 1-sigmas do not contain those of the sides. What is no
        segment has its sides from the images already and stays as it is.
    image : ndarray of uint8, shape (H, W)
        The left one.
    view : View
    """
    matched = [thing.extent for thing in things if thing.numbers]
    if not matched:
        return things
    reach = np.array([(e.range_left, e.range_right) for e in matched])
    u, v = _sides(matched, reach, view)
    strong, x = _edges(u, v, image)
    moved, doubt = _silhouettes(strong[:, 0], x[:, 0], np.abs(np.diff(u[:, 0, :, 0]))[:, 0])
    stands = np.array([e.bottom <= 0.0 for e in matched])
    wider = _wider(strong, x, moved, _WIDEST * view.projection.fx / reach)
    wider[~stands] = 0.0
    middle = u[:, 0].mean(axis=2)
    cut = (middle < MARGIN) | (middle > image.shape[1] - 1 - MARGIN)
    moved[cut] = 0.0  # the image ends there, not the thing
    p = view.projection
    angle = p.fx / (p.fx**2 + (middle - p.cx) ** 2)  # of a column there [rad]
    in_angles = ((angle * columns).tolist() for columns in (moved, doubt, wider))
    found = iter(zip(matched, *in_angles, strict=True))
    return [
        replace(thing, extent=_between(*next(found))) if thing.numbers else thing
        for thing in things
    ]


def _sides(extents: list[Extent], reach: Float64, view: View) -> tuple[Float64, Float64]:
    """Return columns and rows along sides [px].

    Shape (things, whole and foot, left and right, heights).
    """
    bearing = np.array([(e.left, e.right) for e in extents])
    ground, bottom, top = np.array([(e.ground, e.bottom, e.top) for e in extents]).T
    low = np.stack([ground + bottom, ground], axis=1)
    high = np.stack([ground + top, ground + _FOOT], axis=1)
    height = low[..., None] + (high - low)[..., None] * ((np.arange(_ROWS) + 0.5) / _ROWS)
    points = np.empty((3, len(extents), 2, 2, _ROWS))
    points[0] = (reach * np.cos(bearing))[:, None, :, None]
    points[1] = (reach * np.sin(bearing))[:, None, :, None]
    points[2] = height[:, :, None]
    u, v, _ = view.pixels(points.reshape(3, -1))
    return u.reshape(points.shape[1:]), v.reshape(points.shape[1:])


def _edges(u: Float64, v: Float64, image: UInt8) -> tuple[Float64, Float64]:
    """Return by how much columns' gradients exceed the typical one, and how far outside they are.

    The latter in columns from the side; both of shape (things, whole and foot, left and right,
    columns).
    """
    rows, columns = image.shape
    away = np.arange(-_INWARDS, _OUTWARDS + 2)
    outwards = np.array([-1, 1])
    nearest = np.rint(u)
    beside = nearest[..., None] + (outwards[:, None] * away)[:, None]
    column = np.minimum(np.maximum(beside, 0), columns - 1).astype(np.int64)
    row = np.minimum(np.maximum(np.rint(v), 0), rows - 1).astype(np.int64)
    grey = image.ravel().take(row[..., None] * columns + column).astype(np.float32)
    step = grey[..., 1:] - grey[..., :-1]
    gradient = np.sqrt(np.einsum("...hc,...hc->...c", step, step) / _ROWS).astype(np.float64)
    strong = np.maximum(gradient - np.median(gradient, axis=-1, keepdims=True), 0.0)
    off = outwards * (nearest - u).mean(axis=-1)
    return strong, away[:-1] + 0.5 + off[..., None]


def _silhouettes(strong: Float64, x: Float64, columns: Float64) -> tuple[Float64, Float64]:
    """Return how far outwards the sides are moved and their 1-sigmas [px], shape (things, 2).

    `columns` are the things' widths, shape (things,).
    """
    inwards = np.maximum(_NEAREST[0], -_HALF * columns)[:, None, None]
    off = np.where(x < 0.0, *_OFF)
    near = (strong * np.exp(-0.5 * (x / off) ** 2)) ** _SHARP
    moved = _mean(near * ((x > inwards) & (x < _NEAREST[1])), x)
    weight = strong**_SHARPER + _NOTHING
    square = _mean(weight, (x - moved[..., None]) ** 2)
    return moved, np.sqrt(_LEAST**2 + _SPREAD**2 * square)


def _wider(strong: Float64, x: Float64, moved: Float64, widest: Float64) -> Float64:
    """Return how far outside of the sides those of a foot are [px], shape (things, 2).

    Less where they are less clear than the silhouettes above them: texture of the floor is that.
    """
    above, below = strong[:, 0], strong[:, 1]
    near = below * ((x[:, 1] > -_BLUR) & (x[:, 1] < widest[..., None]))
    clear = near.max(axis=-1) / np.maximum(above.max(axis=-1), 1.0)
    wider = _mean(near**_SHARP, x[:, 1]) - moved
    return np.asarray(wider * np.sqrt(np.minimum(clear, 1.0)), dtype=np.float64)


def _mean(weight: Float64, x: Float64) -> Float64:
    """Return the weighted mean over the columns, 0 where nothing has weight."""
    mean: Float64 = (weight * x).sum(axis=-1) / np.maximum(weight.sum(axis=-1), _NOTHING)
    return mean


def _between(extent: Extent, moved: list[float], doubt: list[float], wider: list[float]) -> Extent:
    """Return a thing with its left and right side moved outwards by angles [rad]."""
    left, right = extent.left + moved[0], extent.right - moved[1]
    foot = extent.distance * max(0.0, min(wider))  # of a shadow one side is wider
    gained = moved[0] * extent.range_left + moved[1] * extent.range_right
    return replace(
        extent,
        left=left,
        right=right,
        bearing=0.5 * (left + right),
        width=max(extent.width + gained, 0.0),
        sigma_distance=math.hypot(extent.sigma_distance, _WIDER * foot),
        sigma_bearing=0.5 * math.hypot(*doubt),
        sigma_width=math.hypot(
            extent.sigma_width,
            extent.range_left * math.hypot(doubt[0], _WIDER * wider[0]),
            extent.range_right * math.hypot(doubt[1], _WIDER * wider[1]),
        ),
    )

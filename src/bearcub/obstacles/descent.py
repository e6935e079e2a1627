"""Does ground fall at once behind a lip, or does it slope down? Two explanations of the images.

Of a drop the disparity falls off in the line of its lip; of a slope line by line, down to its foot.
Beyond both lies lower ground. On a slope that is steep for a camera so low there are few lines, too
few for a matcher that smooths over them, but each of them is as wide as the way.
"""

import math

import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Float32
from bearcub.obstacles.floor_lines import FloorLines, floor_lines
from bearcub.obstacles.regions import Region
from bearcub.obstacles.upright import Scene
from bearcub.robust import median

_BEFORE, _BEHIND = 8, 26  # lines before and behind a lip that are looked at
_MOST = (36, 180)  # lines and columns of them
_STEP = 0.5  # of the fall that is tried [px]
_LOWER = 0.04 * np.arange(1, 15)  # falls that are tried, share of the floor's disparity
_AT_ONCE = (0, 2, 3)  # lines over which a drop may fall: a matcher's lip is no pixel's
_LINES = (5, 6, 7, 8, 10, 12, 14, 17, 20)  # ... and a slope
_AS_LIKELY = -1.5  # log-likelihood ratio from which on a slope is as likely as a drop
_STEEPEST = math.tan(math.radians(20.0))  # slope that is no drop


def slopes_down(region: Region, scene: Scene) -> bool:
    """Tell whether ground behind the near rim of a region slopes down, or may as well.

    Parameters
    ----------
    region : Region
        What seems to be a drop.
    scene : Scene
    """
    u, v = region.near_rim()
    u, v = u + region.left, v + region.top
    lip = median(scene.surface.level(u, v))
    likelier, steepness = descent(scene, (float(u[0]), float(u[-1])), lip)
    return likelier > _AS_LIKELY and steepness < _STEEPEST


def descent(scene: Scene, columns: tuple[float, float], lip: float) -> tuple[float, float]:
    """Tell a slope down from a drop.

    Parameters
    ----------
    scene : Scene
    columns : tuple of float
        First and last, between which the ground falls [px].
    lip : float
        Level of the lip, about [px].

    Returns
    -------
    likelier : float
        Log-likelihood ratio of the likeliest slope against the likeliest drop; -inf where too
        little is seen.
    steepness : float
        Of that slope, a tangent.
    """
    line = float(scene.surface.plane[1])
    levels = max(lip - _BEHIND * line, line), lip + _BEFORE * line
    part = floor_lines(scene, columns, levels, most=_MOST, shrunk=False)
    if part is None:
        return -math.inf, math.inf
    count = int(_LOWER[-1] * float(part.floor[-1]) / _STEP) + 2
    falls = np.float32(_STEP) * np.arange(count, dtype=np.float32)
    gains = part.ratios(part.floor - falls[:, None]).sum(axis=2)
    drop = max(_likeliest(part, gains, lines)[0] for lines in _AT_ONCE)
    gain, share, foot, edge = max(_likeliest(part, gains, lines) for lines in _LINES)
    return gain - drop, _steepness(scene, part, share, foot, edge)


def _likeliest(part: FloorLines, gains: Float32, lines: int) -> tuple[float, float, int, int]:
    """Return the likeliest descent over so many lines.

    Its log-likelihood ratio against the floor; the share of the floor's disparity by which what is
    beyond lies lower; the lines of its foot and edge.
    """
    floor = part.floor.astype(np.float64)
    line = np.arange(len(floor))
    edge = np.arange(len(floor) - 2 * _BEFORE, len(floor) - 1)[:, None]
    foot = np.clip(edge - lines, 0, None)
    share = np.clip((edge - line) / np.maximum(edge - foot, 1), 0, 1)
    fall: Float64 = share * np.where(line < foot, floor, floor[foot])
    whole = _LOWER[:, None, None] * (fall / _STEP)
    at = np.minimum(whole.astype(np.int64), len(gains) - 2)
    part_of = whole - at
    told = ((1 - part_of) * gains[at, line] + part_of * gains[at + 1, line]).sum(axis=2)
    k, e = np.unravel_index(int(told.argmax()), told.shape)
    return float(told[k, e]), float(_LOWER[k]), int(foot[e, 0]), int(edge[e, 0])


def _steepness(scene: Scene, part: FloorLines, share: float, foot: int, edge: int) -> float:
    """Return the tangent of the slope between two lines, the far one of ground so much lower."""
    p = scene.projection
    depth = scene.surface.height * share / (1 - share)
    run = (
        p.fx
        * p.baseline
        * (1 / (float(part.floor[foot]) * (1 - share)) - 1 / float(part.floor[edge]))
    )
    return depth / run if run > 0 else math.inf

"""The face that a thing turns to the camera: its range in some directions, and where it ends."""

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from bearcub.robust import line
from bearcub.stereo.native import core

_NEAREST = 10  # one in so many pixels of a direction is nearer than its face
_LEANS = 2.5  # sigmas of the floor's noise from the nearest tenth to the median of an upright face
_SHARPEST = 0.03  # share of its range that an edge may be nearer than its direction's mean
_ROUND = 3.0  # times what growth of range grows by towards a silhouette that a round thing recedes
_NO_NOISE = 2.0  # sigmas beyond which it does
_ROUNDEST = 0.05  # ... share of its range that it may
_STRAIGHT = 5  # directions of a thing that tell whether it is straight, at least
_ON_LINE = 0.02  # how far off a line a direction may be, share of its range
_MOST = 0.6  # share of the directions that a line must have


class Face(NamedTuple):
    """A thing as seen from above.

    Attributes
    ----------
    range_right, range_left : float
        Of its ends [m].
    width : float
        Across the line of sight, between the two silhouettes [m].
    distance, nearest : float
        Range [m] and bearing [rad] of its nearest point.
    pixels : float
        In the direction of that.
    """

    range_right: float
    range_left: float
    width: float
    distance: float
    nearest: float
    pixels: float


Directions = Callable[
    [float, float, int, int], tuple[Sequence[float], Sequence[float], Sequence[float]]
]
"""From bearings right and left, a number of directions and one in how many pixels is near: of each
direction how many pixels it has, and the range of the near and of the middle one."""


@cache
def face_tuning() -> Any:
    """Return the numbers above for the native core."""
    return core.FaceTuning(
        near=_NEAREST,
        leans=_LEANS,
        sharpest=_SHARPEST,
        rounds=_ROUND,
        no_noise=_NO_NOISE,
        roundest=_ROUNDEST,
        straight=_STRAIGHT,
        on_line=_ON_LINE,
        most=_MOST,
    )


def face_of(
    directions: Directions, right: float, left: float, *, pixel: float, blur: float, alike: float
) -> Face:
    """Return the face of a thing between two bearings.

    Parameters
    ----------
    directions : callable
    right, left : float
        The bearings [rad].
    pixel : float
        [rad].
    blur : float
        1-sigma of 1 / range that noise makes [1/m].
    alike : float
        Neighbouring pixels that err together.
    """
    ranges, bearings, counts = _ranges(directions, right, left, pixel, blur)
    nearest = ranges.index(min(ranges))
    distance = ranges[nearest] - _to_the_point(ranges, nearest)
    grain = blur * distance * distance * math.sqrt(alike / max(counts[nearest], alike))
    return Face(
        *_ends(ranges, bearings, right, left),
        width=_chord(ranges, left - right, grain),
        distance=distance,
        nearest=bearings[nearest],
        pixels=counts[nearest],
    )


def _ranges(
    directions: Directions, right: float, left: float, pixel: float, blur: float
) -> tuple[list[float], list[float], list[float]]:
    """Return the range [m] of the thing in up to 13 directions, the directions and pixel counts.

    Of an upright face that is the median range of its pixels, of one that leans back the range of
    its foot: no more than noise allows beyond the nearest tenth.
    """
    columns = max(1.0, (left - right) / pixel)
    groups = min(max(int(columns // 4), 1), 13)
    # of so few numbers lists are several times faster than arrays
    each = list(zip(*directions(right, left, groups, _NEAREST), strict=True))
    least = 0.25 * _middle([count for count, _, _ in each])
    used = [(k, *numbers) for k, numbers in enumerate(each) if numbers[0] > least]
    ranges = [min(middle, near + _LEANS * blur * near * near) for _, _, near, middle in used]
    step = (left - right) / groups
    bearings = [right + (k + 0.5) * step for k, *_ in used]
    # where noise reaches farther than the next direction, wrong matches make dents
    if blur * _middle(ranges) > step:
        ranges = _without_dents(ranges)
    inner = [
        0.25 * a + 0.5 * b + 0.25 * c
        for a, b, c in zip(ranges, ranges[1:], ranges[2:], strict=False)
    ]
    return [ranges[0], *inner, *ranges[1:][-1:]], bearings, [count for _, count, *_ in used]


def _middle(values: list[float]) -> float:
    """Return the middle one of `values`, the upper of two."""
    return sorted(values)[len(values) // 2]


def _without_dents(ranges: list[float]) -> list[float]:
    """Return the running median of five, of three at the ends, where ranges are much nearer."""
    last = len(ranges) - 1
    if last < 4:
        return ranges
    around = [
        _middle(ranges[max(0, k - 2) : k + 3])
        if 2 <= k <= last - 2
        else _middle(ranges[:3] if k < 2 else ranges[last - 2 :])
        for k in range(len(ranges))
    ]
    return [b if a < (1 - _SHARPEST) * b else a for a, b in zip(ranges, around, strict=True)]


def _to_the_point(ranges: list[float], nearest: int) -> float:
    """Return how much nearer than its direction's smoothed range an edge turned towards us is [m].

    About an edge the range grows by a step s a direction on both sides. The mean over the direction
    is s/4 beyond the edge, the smoothing makes it 5/8 s; at a thing's end the mean is s/2 beyond.
    """
    last = len(ranges) - 1
    if 2 <= nearest <= last - 2:
        outer, inner = (
            ranges[nearest - 2] + ranges[nearest + 2],
            ranges[nearest - 1] + ranges[nearest + 1],
        )
        step, share = 0.5 * (outer - inner), 0.625
    elif last >= 2 and nearest in (0, last):
        step, share = ranges[1 if nearest == 0 else last - 1] - ranges[nearest], 0.5
    else:
        return 0.0
    return min(share * max(step, 0.0), _SHARPEST * ranges[nearest])


def _ends(
    ranges: list[float], bearings: list[float], right: float, left: float
) -> tuple[float, float]:
    """Return the ranges of a thing's right and left end [m].

    They are those of the straight line that most of its directions lie on, where there is one: the
    outermost directions are the ones that wrong matches and feet spoil.
    """
    ends = ranges[0], ranges[-1]
    if len(ranges) < _STRAIGHT:
        return ends
    turned = np.array(bearings) - 0.5 * (right + left)
    # seen from the middle, 1 / ahead grows evenly along a line
    across, inverse = np.tan(turned), 1 / (np.array(ranges) * np.cos(turned))
    start, slope = line(across, inverse)
    on = np.abs(start + slope * across - inverse) < _ON_LINE * inverse
    if np.count_nonzero(on) < _MOST * len(ranges):
        return ends
    start, slope = line(across[on], inverse[on])
    half = 0.5 * (left - right)
    inverses = [(start + slope * math.tan(edge)) * math.cos(edge) for edge in (-half, half)]
    if min(inverses) < 0.5 / max(ends):  # seen along, it has no end to speak of
        return ends
    return 1 / inverses[0], 1 / inverses[1]


def _chord(ranges: list[float], angle: float, grain: float) -> float:
    """Return the extent across the line of sight between the two silhouettes.

    `grain` is the 1-sigma of a direction's range that noise makes [m].
    """
    ends = (_at_the_end(each, grain) for each in (ranges, ranges[::-1]))
    return sum(ends) * math.sin(0.5 * angle)


def _at_the_end(ranges: list[float], grain: float) -> float:
    """Return the range at the first end, half a direction beyond the first one's middle [m].

    It goes on along the line through the first two. Of a round thing it grows ever faster: of 13
    directions of a circle of radius r the outermost is 0.39 r before the silhouette, 0.23 r behind
    the next (smoothed) one, and that 0.16 r behind the third. So four times what the growth grows
    by are missing; three times of what noise does not explain are added.
    """
    first = ranges[0]
    if len(ranges) < 3:
        return first
    growth, before = first - ranges[1], ranges[1] - ranges[2]
    rounded = growth - before - _NO_NOISE * grain if before > 0.0 else 0.0
    more = 0.5 * growth + _ROUND * max(rounded, 0.0)
    return first + min(max(more, -_SHARPEST * first), _ROUNDEST * first)

"""Strips beside a thing that are no part of it.

An edge along the row looks the same at every disparity: where a horizon, or the line between two
floors, passes behind a thing, a matcher carries the thing's disparity along it to either side.
"""

import math
from dataclasses import replace

import cv2
import numpy as np

from bearcub.messages import Float32
from bearcub.obstacles.segment import Index, Member
from bearcub.obstacles.sorting import Sorter
from bearcub.obstacles.verify import Witness, gains
from bearcub.robust import quantile

_ALONG = 9  # columns over which heights are averaged
_TALLEST = 0.9  # the share of columns that are lower than a thing is high
_LOW = 0.5  # share of a thing's height below which its outer columns may be a strip
_WIDE = 8  # least columns of one
_SURE = 3.0  # standard errors by which the images speak for a thing of which a strip is to be told
_SILENT = 0.1  # share of what they say of the thing that they may say of a strip


def without_strips(witness: Witness, sorter: Sorter, member: Member, *, offset: float) -> Member:
    """Return a thing without the low strips at its sides for which the images do not speak.

    Where a strip ends is where what the images gain by its disparities, summed from the outer
    side, less half of what they gain on the rest, is least: the change between two means of known
    size that is most likely [1]_. A side of the thing itself stops the sum, however plain the
    thing is: its outline speaks for it.

    Parameters
    ----------
    witness : Witness
    sorter : Sorter
        Of the frame.
    member : Member
        The thing.
    offset : float
        In the disparities, not in the images [px].

    References
    ----------
    .. [1] E. S. Page, "Continuous Inspection Schemes", Biometrika 41, 1954.
    """
    column = member.u - int(member.u.min())
    left, right = _low_sides(np.bincount(column))
    count = int(column.max()) + 1
    if max(left, right) < _WIDE:
        return member
    gain = gains(witness, sorter, member.u, member.v, offset=offset)
    mean, error = _mean(gain[(column >= left) & (column < count - right)], witness.patch)
    if mean < _SURE * error:
        return member
    sums = np.bincount(column, weights=gain - 0.5 * mean)
    kept = np.ones(len(column), dtype=bool)
    for side, outer in ((column, sums[:left]), (count - 1 - column, sums[::-1][:right])):
        wide = int(np.argmin(np.concatenate([[0.0], np.cumsum(outer)])))
        if wide < _WIDE:
            continue
        strip = side < wide
        of_strip, doubt = _mean(gain[strip], witness.patch)
        if of_strip < _SILENT * mean + doubt:
            kept &= ~strip
    if kept.all():
        return member
    pixels = int(member.pixels * kept.mean())
    return replace(member, u=member.u[kept], v=member.v[kept], pixels=pixels)


def _low_sides(heights: Index) -> tuple[int, int]:
    """Return how many of the outermost columns, left and right, are low."""
    smooth = np.asarray(cv2.blur(heights[None].astype(np.float32), (_ALONG, 1)))[0]
    tall = np.flatnonzero(smooth >= _LOW * quantile(smooth, _TALLEST))
    return int(tall[0]), len(heights) - 1 - int(tall[-1])


def _mean(gain: Float32, patch: float) -> tuple[float, float]:
    """Return a mean and its standard error where so many pixels witness together."""
    return float(gain.mean()), float(gain.std() / math.sqrt(max(1.0, len(gain) / patch)))

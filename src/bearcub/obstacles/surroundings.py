"""What is around a thing in the image: something nearer beside it, its foot or floor below it."""

import math
from collections.abc import Sequence

import numpy as np

from bearcub.messages import Bool, Float32
from bearcub.obstacles.cloud import View
from bearcub.obstacles.joining import Box
from bearcub.obstacles.measure import Extent
from bearcub.obstacles.segment import Member, Segments
from bearcub.obstacles.sorting import Sorter
from bearcub.robust import median
from bearcub.stereo.native import COMPILED, core

_FOOT_SHARE = 0.3  # of the pixels below that must belong to a thing rather than to the floor
_FOOT_ROWS, _FOOT_COLUMNS = 40, 40  # at which they are looked at, at most
_FOOT_CLEAR = 0.3  # least difference between a thing's disparity and the floor's that tells [px]
_MATCHED = 0.4  # share of a column's pixels that are matched where something is seen
_BEHIND = 0.1  # share of what is matched between two things that may be of what is behind them
_BESIDE_ROWS = 24  # at which what is beside a thing is looked at
_WIDEST = 64  # columns of it
_FACE = (0.4, 0.55, 0.7, 0.85)  # heights at which a face is looked at, shares of its own
_OFF_FACE = 0.05  # how far off its line a face may be, share of the disparity
_ALONG_FACE = 0.7  # share of the way between two pieces in which it must be seen
_BESIDE = 8  # columns or rows to a nearer thing's edge [px]


def mixed(d: Float32, segments: Segments, member: Member, *, compiled: bool = COMPILED) -> bool:
    """Tell pixels that a matcher put between a nearer thing's edge and what is behind it."""
    find = _nearer_compiled if compiled else _nearer_thing
    beside = find(d, segments, member, ((-_BESIDE, 0), (_BESIDE, 0), (0, _BESIDE)))
    return bool(np.count_nonzero(beside) > 0.5 * len(beside))


def hidden_below(
    d: Float32, segments: Segments, member: Member, *, compiled: bool = COMPILED
) -> bool:
    """Tell whether a nearer thing hides what is below these pixels."""
    find = _nearer_compiled if compiled else _nearer_thing
    hidden = find(d, segments, member, ((0, _BESIDE),))
    columns, below = np.bincount(member.u), np.bincount(member.u[hidden])
    return bool(np.count_nonzero(below) > 0.5 * np.count_nonzero(columns))


def goes_on_below(sorter: Sorter, member: Member) -> bool:
    """Tell whether what is below a thing, down to the floor it would stand on, is its own.

    There the floor's disparity comes close to the thing's, and the tolerance hides the difference
    of a pixel; not that of many.
    """
    level = median(sorter.disparity[member.v, member.u])
    lowest = np.full(int(member.u.max()) + 1, -1)
    np.maximum.at(lowest, member.u, member.v + member.stride - 1)
    columns = np.flatnonzero(lowest >= 0)
    columns = columns[:: max(1, len(columns) // _FOOT_COLUMNS)]
    below = sorter.disparity.shape[0] - 1 - lowest[columns].min()
    rows = lowest[columns][None, :] + np.arange(1, below + 1, max(1, below // _FOOT_ROWS))[:, None]
    inside = rows < sorter.disparity.shape[0]
    rows = np.minimum(rows, sorter.disparity.shape[0] - 1)
    u = np.broadcast_to(columns[None, :], rows.shape)
    floor, d = sorter.surface.at(u, rows), sorter.disparity[rows, u]
    above = inside & (floor < level - _FOOT_CLEAR)
    # close under it is the rest of what hangs, as the underside of a table
    low = np.cumsum(above, axis=0) > 0.5 * above.sum(axis=0)
    clear = above & low & np.isfinite(d)
    own = clear & (np.abs(d - level) < 0.5 * (level - floor))
    seen = clear.sum(axis=0)
    # of a table every leg goes on below, but not the table
    goes_on = own.sum(axis=0) > _FOOT_SHARE * seen
    return bool(np.count_nonzero(goes_on) > 0.5 * len(goes_on))


def flaring(member: Member) -> float:
    """Return how much wider the lower third of a thing's rows is than the upper third [px]."""
    first, last = int(member.v[0]), int(member.v[-1])
    third = (last - first + member.stride) / 3
    above = np.count_nonzero(member.v < first + third)
    below = np.count_nonzero(member.v > last - third)
    return max(0.0, (below - above) / third * member.pixels / len(member.v))


def unseen_beside(d: Float32, box: Box, disparity: float) -> tuple[float, float]:
    """Return how many columns left and right of a thing are hardly matched: it may go on there.

    Left of a thing the right image does not show what is behind it, over as many columns as their
    disparities differ by: these do not count.

    Parameters
    ----------
    d : ndarray of float32, shape (H, W)
        [px], NaN unmatched.
    box : tuple of int
        First column and row, last column and row of the thing [px].
    disparity : float
        Of the thing [px].
    """
    first, top, last, bottom = box
    rows = d[top : bottom + 1 : max(1, (bottom + 1 - top) // _BESIDE_ROWS)]
    left, behind = _unseen(rows[:, max(0, first - _WIDEST) : first][:, ::-1])
    right, _ = _unseen(rows[:, last + 1 : last + 1 + _WIDEST])
    return max(0.0, left - max(0.0, disparity - behind)), float(right)


def unseen_between(d: Float32, one: Box, other: Box, *, farthest: float) -> bool:
    """Tell whether little is matched between two things side by side, and hardly any of it behind.

    So looks the plain or shiny middle of a thing whose ends are matched.

    Parameters
    ----------
    d : ndarray of float32, shape (H, W)
        [px], NaN unmatched.
    one, other : tuple of int
        First column and row, last column and row of the things [px].
    farthest : float
        Disparity of what is behind them [px].
    """
    top, bottom = max(one[1], other[1]), min(one[3], other[3])
    left, right = sorted((one, other))
    between = d[top : bottom + 1, left[2] + 1 : right[0]]
    if between.size == 0:
        return False
    matched = np.count_nonzero(np.isfinite(between))
    behind = np.count_nonzero(between < farthest)
    return bool(matched < _MATCHED * between.size and behind < _BEHIND * matched)


def stands_between(
    sorter: Sorter, view: View, one: Extent, other: Extent, *, along: int = 24
) -> bool:
    """Tell whether the face of one thing is seen between two of its pieces side by side.

    Of a kerb hardly higher than the tolerance only parts stand out. Where it goes on between them,
    its pixels are nearer to the disparity of the straight line between their ends than to the
    floor's; where two things stand side by side, the floor is seen between them.

    Parameters
    ----------
    sorter : Sorter
        Of the frame.
    view : View
    one, other : Extent
        The pieces.
    along : int
        Places between them that are looked at.
    """
    right, left = sorted((one, other), key=lambda extent: extent.bearing)
    ends = (right.left, right.range_left), (left.right, left.range_right)
    (x0, y0), (x1, y1) = ((r * math.cos(b), r * math.sin(b)) for b, r in ends)
    share = (np.arange(along) + 0.5) / along
    lift = 0.5 * (one.ground + other.ground)
    top = min(one.top, other.top)
    shape = (len(_FACE), along)
    points = np.empty((3, *shape))
    points[0], points[1] = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
    points[2] = lift + top * np.array(_FACE)[:, None]
    u, v, expected = view.pixels(points.reshape(3, -1))
    rows, columns = sorter.disparity.shape
    inside = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
    column, row = np.where(inside, u, 0).astype(int), np.where(inside, v, 0).astype(int)
    # the floor before them: behind a kerb it may go on higher
    plane = sorter.surface
    floor = plane.level(column, row) * (plane.height / (plane.height - lift))
    off = np.abs(sorter.disparity[row, column] - expected)
    known = (inside & np.isfinite(off)).reshape(shape)
    limit = np.minimum(0.5 * (expected - floor), _OFF_FACE * expected)
    own = known & (off < limit).reshape(shape)
    goes_on = own.sum(axis=0) > 0.5 * known.sum(axis=0)
    return bool(np.count_nonzero(goes_on) > _ALONG_FACE * along)


def _unseen(columns: Float32) -> tuple[int, float]:
    """Return how many columns are hardly matched, and the disparity beyond them [px]."""
    known = np.isfinite(columns)
    matched = np.flatnonzero(known.sum(axis=0) > _MATCHED * len(known))
    gap = int(matched[0]) if len(matched) else columns.shape[1]
    beyond = columns[:, gap : gap + _BESIDE][known[:, gap : gap + _BESIDE]]
    return gap, median(beyond) if len(beyond) else 0.0


def _nearer_thing(
    d: Float32, segments: Segments, member: Member, beside: Sequence[tuple[int, int]]
) -> Bool:
    """Tell which pixels have a nearer other thing at any of these columns and rows beside them."""
    (height, width), step, labels = d.shape, segments.step, segments.labels
    right, down = np.array(beside).T[:, :, None]
    column = np.minimum(np.maximum(member.u + right, 0), width - 1)
    row = np.minimum(member.v + down, height - 1)
    disparity = d.ravel()  # taken from by flat indices: several times faster than by pairs
    nearer = disparity.take(row * width + column) > disparity.take(member.v * width + member.u)
    other = labels.ravel().take(row // step * labels.shape[1] + column // step)
    found: Bool = np.logical_or.reduce((other != 0) & (other != member.number) & nearer)
    return found


def _nearer_compiled(
    d: Float32, segments: Segments, member: Member, beside: Sequence[tuple[int, int]]
) -> Bool:
    found = np.empty(len(member.u), dtype=np.bool_)
    u, v = np.ascontiguousarray(member.u), np.ascontiguousarray(member.v)
    core.find_nearer(segments.labels, segments.step, member.number, d, u, v, beside, found)
    return found

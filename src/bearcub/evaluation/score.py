"""Answers against truth, as pure functions of numbers."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from bearcub.messages import Bool, Float64, Int32

Box = tuple[int, int, int, int]
"""(u_min, v_min, u_max, v_max), inclusive [px]."""


def match(found: ArrayLike, truth: ArrayLike, *, gate: float) -> list[tuple[int, int]]:
    """Pair what was found with what is there, the closest pairs first, each once.

    What was found and has no partner is false; what is there and has none was missed.

    Parameters
    ----------
    found, truth : array_like, shape (N, 2) and (M, 2)
        Positions [m] in one frame.
    gate : float
        Pairs farther apart than this [m] are none.

    Returns
    -------
    list of (int, int)
        Indices into `found` and `truth`.

    Examples
    --------
    Two pieces of one thing: the closer one is it, the other is false.

    >>> match([[3.0, 0.3], [3.0, 0.1]], [[3.0, 0.0]], gate=0.5)
    [(1, 0)]
    """
    a = np.asarray(found, dtype=np.float64).reshape(-1, 2)
    b = np.asarray(truth, dtype=np.float64).reshape(-1, 2)
    apart = np.linalg.norm(a[:, None] - b[None], axis=2)
    pairs: list[tuple[int, int]] = []
    for flat in np.argsort(apart, axis=None):
        i, j = (int(k) for k in np.unravel_index(flat, apart.shape))
        if not apart[i, j] <= gate:  # an unknown place is no place nearby
            break
        if all(i != p and j != q for p, q in pairs):
            pairs.append((i, j))
    return pairs


def worst(errors: ArrayLike) -> float:
    """Return the largest magnitude; NaN when one is not known or there is none.

    Examples
    --------
    >>> worst([0.5, -2.0]), worst([])
    (2.0, nan)
    """
    values = np.abs(np.asarray(errors, dtype=np.float64))
    return float(values.max()) if values.size else float("nan")


def rms(errors: ArrayLike) -> float:
    """Return the root mean square; NaN when one is not known or there is none.

    Examples
    --------
    >>> rms([3.0, -4.0, 0.0, 0.0])
    2.5
    """
    values = np.asarray(errors, dtype=np.float64)
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def covered(errors: ArrayLike, sigmas: ArrayLike, *, k: float = 2.0) -> float:
    """Return the share of errors within `k` of their own sigmas; 0.95 is right for ``k = 2``.

    An unknown error or sigma counts as outside.

    Examples
    --------
    >>> covered([0.1, -0.3, 0.1], [0.1, 0.1, float("nan")])
    0.3333333333333333
    """
    e, s = np.asarray(errors, dtype=np.float64), np.asarray(sigmas, dtype=np.float64)
    return float(np.mean(np.abs(e) <= k * s)) if e.size else float("nan")


def inside_corridor(points: ArrayLike, path: Float64, *, half_width: float, reach: float) -> Bool:
    """Tell which points a vehicle sweeps on its way.

    Parameters
    ----------
    points : array_like, shape (N, 2)
        [m], in the frame of `path`.
    path : ndarray of float64, shape (M, 2)
        Where the vehicle goes, straight between these positions; the corridor begins with the
        first and ends with the last, square to the path.
    half_width : float
        To either side [m].
    reach : float
        Along the path, from its first position [m]; a shorter path ends the corridor.

    Returns
    -------
    ndarray of bool, shape (N,)

    Examples
    --------
    >>> path = np.array([[0.0, 0.0], [5.0, 0.0], [20.0, 0.0]])
    >>> beside, ahead, beyond, behind = [3, 1.1], [11, -0.9], [12.1, 0], [-0.1, 0]
    >>> inside_corridor([beside, ahead, beyond, behind], path, half_width=1.0, reach=12.0)
    array([False,  True, False, False])
    """
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    corners = cut(path, reach)
    starts, steps = corners[:-1], np.diff(corners, axis=0)
    if not len(steps):
        return np.zeros(len(p), dtype=bool)
    lengths = (steps**2).sum(axis=1)
    # Parameter of each point's foot on each piece of the path, 0 to 1 along the piece.
    along = ((p[:, None] - starts) * steps).sum(axis=2) / lengths
    feet = starts + np.clip(along, 0.0, 1.0)[:, :, None] * steps
    apart = np.linalg.norm(p[:, None] - feet, axis=2)
    nearest = apart.argmin(axis=1)
    behind = (nearest == 0) & (along[:, 0] < 0.0)
    beyond = (nearest == len(steps) - 1) & (along[:, -1] > 1.0)
    swept: Bool = (apart.min(axis=1) <= half_width) & ~behind & ~beyond
    return swept


def cut(path: Float64, reach: float) -> Float64:
    """Return the first `reach` metres of a path, without the places where it stands still.

    Examples
    --------
    >>> cut(np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 4.0], [9.0, 4.0]]), 7.0)
    array([[0., 0.], [3., 4.], [5., 4.]])
    """
    moved = np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-6
    corners = path[np.concatenate([[True], moved])]
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    if run[-1] <= reach:
        return np.asarray(corners, dtype=np.float64)
    end = np.array([[np.interp(reach, run, corners[:, axis]) for axis in (0, 1)]])
    kept: Float64 = np.concatenate([corners[run < reach], end])
    return kept


def best_label(labels: Int32, region: Bool) -> tuple[int, float]:
    """Return the obstacle that covers most of a region, and the share that it covers.

    Parameters
    ----------
    labels : ndarray of int32, shape (H, W)
        Positive for obstacles.
    region : ndarray of bool, shape (H, W)
        Pixels that count, such as the measured ones of a thing.

    Returns
    -------
    (int, float)
        ``(0, 0.0)`` when no obstacle covers any of it.
    """
    here = labels[region]
    counts = np.bincount(here[here > 0]) if (here > 0).any() else np.zeros(1)
    label = int(counts.argmax())
    return (label, float(counts[label] / here.size)) if label else (0, 0.0)


def box_region(box: Box, shape: Sequence[int]) -> Bool:
    """Return the pixels of an image of `shape` that lie in a box."""
    region = np.zeros((shape[0], shape[1]), dtype=bool)
    region[box[1] : box[3] + 1, box[0] : box[2] + 1] = True
    return region


def overlap(a: Box, b: Box) -> float:
    """Return the intersection of two boxes over their union.

    Examples
    --------
    >>> overlap((0, 0, 9, 9), (5, 0, 14, 9)) == 50 / 150
    True
    """
    width = min(a[2], b[2]) - max(a[0], b[0]) + 1
    height = min(a[3], b[3]) - max(a[1], b[1]) + 1
    common = max(width, 0) * max(height, 0)
    return common / (_area(a) + _area(b) - common)


def _area(box: Box) -> int:
    return (box[2] - box[0] + 1) * (box[3] - box[1] + 1)

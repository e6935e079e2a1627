"""What the paper's figures count: levels, profiles, and grey values spread over a histogram."""

import numpy as np
from numpy.typing import NDArray

from bearcub.messages import Answer, Float32, UInt8

_MOST_LEVELS = 3


def level_counts(disparity: Float32) -> NDArray[np.int64]:
    """Count the pixels of every level: disparities rounded to whole pixels, shape (levels,).

    Examples
    --------
    >>> level_counts(np.array([[0, 2.6, np.nan], [3, 1, 1]], dtype=np.float32))
    array([1, 2, 0, 2])
    """
    known = np.clip(disparity[np.isfinite(disparity)], 0.0, None)
    return np.bincount(known.round().astype(np.int64), minlength=2)


def level_profile(disparity: Float32, level: int, *, axis: int) -> NDArray[np.int64]:
    """Count the pixels of one level in every column (axis 0) or row (axis 1).

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN is not counted.
    level : int
        Disparities from ``level - 0.5`` to just below ``level + 0.5`` belong to it.
    axis : int
        The axis summed over.

    Returns
    -------
    ndarray of int64, shape (W,) or (H,)

    Examples
    --------
    >>> d = np.array([[3, 2.6, 0], [3.5, 1, np.nan]], dtype=np.float32)
    >>> level_profile(d, 3, axis=0), level_profile(d, 3, axis=1)
    (array([1, 1, 0]), array([2, 0]))
    """
    with np.errstate(invalid="ignore"):
        chosen = (disparity >= level - 0.5) & (disparity < level + 0.5)
    return np.asarray(chosen.sum(axis=axis), dtype=np.int64)


def equalised(disparity: Float32) -> UInt8:
    """Spread the disparities of a map evenly over 1 to 255; NaN becomes 0, shape (H, W).

    Examples
    --------
    >>> equalised(np.array([[1, 1, 2, 40], [np.nan, 2, 2, 2]], dtype=np.float32))
    array([[ 74,  74, 219, 255],
           [  0, 219, 219, 219]], dtype=uint8)
    """
    known = np.isfinite(disparity)
    values = disparity[known]
    result = np.zeros(disparity.shape, dtype=np.uint8)
    if values.size:
        edges = np.linspace(float(values.min()), float(values.max()) + 1e-3, 4097)
        bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, 4095)
        share = np.bincount(bins, minlength=4096).cumsum() / values.size
        result[known] = 1 + (share[bins] * 254).round().astype(np.uint8)
    return result


def nearest_levels(answer: Answer) -> list[int]:
    """Return the levels [px] of the nearest obstacles, at most three, nearest first."""
    levels: list[int] = []
    for thing in sorted(answer.obstacles, key=lambda o: o.distance):
        face = answer.layers.disparity[answer.layers.labels == thing.id]
        face = face[np.isfinite(face)]
        if face.size and (level := round(float(np.median(face)))) not in levels:
            levels.append(level)
    return levels[:_MOST_LEVELS]


def quartile_levels(disparity: Float32) -> list[int]:
    """Return the quartiles of a map's disparities above 0.5 px as levels, nearest first."""
    with np.errstate(invalid="ignore"):
        values = disparity[disparity > 0.5]
    if not values.size:
        return [1]
    quartiles = np.quantile(values, [0.75, 0.5, 0.25]).round().astype(int).tolist()
    return sorted({max(1, q) for q in quartiles}, reverse=True)


def proportional(disparity: Float32) -> UInt8:
    """Return disparities in proportion as 1 to 255, NaN as 0."""
    top = max(1.0, float(np.nanmax(disparity, initial=0.0)))
    place = np.nan_to_num(1.0 + 254.0 * np.clip(disparity, 0.0, top) / top, nan=0.0)
    return np.asarray(place.round(), dtype=np.uint8)

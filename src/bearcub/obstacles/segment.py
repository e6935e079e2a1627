"""From pixels that stand above the floor to separate things, in the column histogram."""

from dataclasses import dataclass

import cv2
import numpy as np

from bearcub.geometry import Projection
from bearcub.messages import Bool, Float32, Int32
from bearcub.obstacles.histograms import _LUT, Levels, column_histogram


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Connected peaks of the column histogram and their pixels.

    Attributes
    ----------
    labels : ndarray of int32, shape (H, W)
        1.. for the pixels of each peak, 0 elsewhere.
    spans : ndarray of int32, shape (K, 2)
        First and last image column of peak k + 1.
    """

    labels: Int32
    spans: Int32


def segment(
    disparity: Float32,
    standing: Bool,
    projection: Projection,
    *,
    least_height: float,
    nearest_level: float,
    farthest_level: float,
    gap_columns: int = 5,
) -> Segments:
    """Group standing pixels into things by connected peaks of the column histogram.

    A thing at least `least_height` high covers ``least_height * d / B`` rows at level d, so the
    threshold of a peak grows in proportion to the level. Neighbouring levels and columns belong
    together; one thing behind another, or beside it with floor between, stays apart.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px].
    standing : ndarray of bool, shape (H, W)
        Pixels above the floor; NaN disparities must be False.
    projection : Projection
    least_height : float
        [m].
    nearest_level, farthest_level : float
        Largest and smallest disparity to look at [px].
    gap_columns : int
        Columns without a match that a thing may have.

    Returns
    -------
    Segments
    """
    rows, width = disparity.shape
    scale = Levels(width=0.25, knee=16.0, largest=nearest_level)
    index = np.flatnonzero(standing)
    d = disparity.ravel()[index]
    inside = (d >= farthest_level) & (d <= nearest_level)
    index, d = index[inside].astype(np.int32), d[inside]
    level = scale.table()[(d * _LUT).astype(np.int32)]
    column = index % np.int32(width)
    counts = column_histogram(level, column, count=scale.count, width=width)
    peaks = _peaks(counts, scale, projection, least_height, gap_columns)
    _, components, stats, _ = cv2.connectedComponentsWithStats(
        peaks, connectivity=8, ltype=cv2.CV_32S
    )
    labels = np.zeros(rows * width, dtype=np.int32)
    labels[index] = components.ravel()[level * width + column]
    first = stats[1:, cv2.CC_STAT_LEFT]
    spans = np.stack([first, first + stats[1:, cv2.CC_STAT_WIDTH] - 1], axis=1)
    return Segments(labels=labels.reshape(rows, width), spans=spans.astype(np.int32))


def _peaks(
    counts: Float32, scale: Levels, projection: Projection, least_height: float, gap_columns: int
) -> "np.ndarray[tuple[int, int], np.dtype[np.uint8]]":
    """Mark the cells whose neighbourhood of levels holds enough rows, small gaps closed."""
    around = cv2.boxFilter(counts, -1, (1, 5), normalize=False, borderType=cv2.BORDER_CONSTANT)
    rows = np.maximum(3.0, 0.5 * least_height * scale.centres() / projection.baseline)
    peaks = ((around >= rows[:, None].astype(np.float32)) & (counts > 0)).astype(np.uint8)
    kernel = np.ones((3, 2 * gap_columns + 1), dtype=np.uint8)
    return cv2.morphologyEx(peaks, cv2.MORPH_CLOSE, kernel)

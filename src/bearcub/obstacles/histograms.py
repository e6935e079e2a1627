"""Column and row histograms of disparity, with levels finer than a pixel (paper, sec. 3.1).

The paper counts the pixels of each disparity level in each image column: an upright object is a
peak as wide as the object. The field calls the image u-disparity, its row twin v-disparity.
"""

from dataclasses import dataclass

import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Float32, Int32

_LUT = 16  # steps of the level table per pixel of disparity


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """A scale of disparity levels: even up to `knee`, then in proportion to the disparity.

    A surface spreads over a range of disparities that is the matcher's noise when far and the
    surface's own relief, in proportion to the disparity, when near.

    Attributes
    ----------
    width : float
        Of a level below the knee [px].
    knee : float
        Where levels begin to widen [px].
    largest : float
        Largest disparity counted [px].
    """

    width: float
    knee: float
    largest: float

    def of(self, disparity: Float64) -> Float64:
        """Return the fractional level of `disparity` [px]."""
        d = np.asarray(disparity, dtype=np.float64)
        above = np.maximum(d, self.knee) / self.knee
        return (np.minimum(d, self.knee) + self.knee * np.log(above)) / self.width

    @property
    def count(self) -> int:
        """Number of levels."""
        return int(self.of(np.array(self.largest))) + 2

    def centres(self) -> Float64:
        """Return the disparity [px] at the middle of every level, shape (count,)."""
        middle = (np.arange(self.count) + 0.5) * self.width
        return np.where(middle < self.knee, middle, self.knee * np.exp(middle / self.knee - 1))

    def of_many(self, disparity: Float32) -> Int32:
        """Return the whole level of every disparity, to a sixteenth of a pixel, by table."""
        steps = np.arange(int(self.largest * _LUT) + 2) / _LUT
        table = self.of(steps).astype(np.int32)
        return table.take((disparity * np.float32(_LUT)).astype(np.int64))


def column_histogram(
    cells: "np.ndarray[tuple[int], np.dtype[np.int32]]", *, count: int, width: int
) -> Float32:
    """Count pixels per (level, column); the u-disparity image.

    Parameters
    ----------
    cells : ndarray of int32, shape (N,)
        ``level * width + column`` of every pixel that counts.
    count, width : int
        Number of levels and of columns.

    Returns
    -------
    ndarray of float32, shape (count, width)

    Examples
    --------
    >>> column_histogram(np.array([5, 5, 0]), count=2, width=3)
    array([[1., 0., 0.], [0., 0., 2.]], dtype=float32)
    """
    flat = np.bincount(cells, minlength=count * width)
    return flat.reshape(count, width).astype(np.float32)

"""Order statistics of small arrays, without the overhead of NumPy's general functions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def quantile(values: NDArray[Any], share: float) -> float:
    """Return the value that `share` of `values` lie below, to the nearest rank.

    Parameters
    ----------
    values : ndarray, shape (N,)
        At least one, none NaN.
    share : float
        0 to 1.

    Examples
    --------
    >>> quantile(np.array([5.0, 1.0, 3.0]), 0.5)
    3.0
    """
    rank = int(share * (len(values) - 1) + 0.5)
    return float(np.partition(values, rank)[rank])


def median(values: NDArray[Any]) -> float:
    """Return the middle one of `values`, the upper of two.

    Parameters
    ----------
    values : ndarray, shape (N,)
        At least one, none NaN.
    """
    return quantile(values, 0.5)

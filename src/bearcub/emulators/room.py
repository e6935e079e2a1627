"""What an emulated LADAR sees where no world stands behind it: a room with a post in it."""

from collections.abc import Callable

import numpy as np

from bearcub.messages import Float64

Beams = Callable[[int, Float64], Float64]
"""From the time [ns] and the beams' angles [rad] to their ranges [m]; both of shape (N,)."""

_HALF_WIDTH, _HALF_LENGTH = 2.5, 4.0  # of the room, the scanner in its middle [m]
_POST_ANGLE, _POST_HALF_WIDTH, _POST_RANGE = 0.3, 0.05, 1.5  # [rad], [rad], [m]; on the left


def room(now_ns: int, angles: Float64) -> Float64:  # noqa: ARG001 (nothing moves)
    """Return the ranges [m] in a room 8 m long and 5 m wide, with a post ahead on the left.

    Examples
    --------
    >>> room(0, np.array([-np.pi / 2, 0.0, 0.3]))
    array([2.5, 4. , 1.5])
    """
    with np.errstate(divide="ignore"):
        across = _HALF_WIDTH / np.abs(np.sin(angles))
        ahead = _HALF_LENGTH / np.abs(np.cos(angles))
    ranges: Float64 = np.minimum(across, ahead)
    ranges[np.abs(angles - _POST_ANGLE) < _POST_HALF_WIDTH] = _POST_RANGE
    return ranges

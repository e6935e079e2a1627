"""Is this disparity at all? Whole inputs that cannot be what they are used as."""

import math

import numpy as np

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.gates import gate
from bearcub.stereo.images import shrunk
from bearcub.stereo.matchers import SearchRange, SgbmMatcher

_SMALL = 240  # px; width at which the two orders of a pair are compared
_ENOUGH = 0.2  # share of matched pixels that settles the order


def check_disparity(disparity: Float32, *, name: str) -> None:
    """Raise when a map as a whole cannot be disparity.

    Parameters
    ----------
    disparity : ndarray of float32, shape (H, W)
        Adjusted disparity [px]; NaN or infinite where unmatched.
    name : str
        What to call it in an error.

    Raises
    ------
    InputError
        If nothing is matched, or most disparities are negative.
    """
    if -1.0 <= np.fmin.reduce(disparity, axis=None) < math.inf:
        return  # something is matched, and nothing negative: a quick look that leaves NaN out
    known = int(np.count_nonzero(np.abs(disparity) < math.inf))  # NaN compares false
    if known == 0:
        raise InputError(
            f"{name}: none of the {disparity.size} pixels holds a disparity: "
            "is the encoding right, is the file from the right stage?"
        )
    negative = int(np.count_nonzero((disparity < -1.0) & (disparity > -math.inf)))
    if negative > known / 2:
        raise InputError(
            f"{name}: {100 * negative / known:.0f} % of the disparities are negative, expected "
            "u_left - u_right > 0: left and right are swapped, or the sign is"
        )


def check_order(left: UInt8, right: UInt8, *, largest: float, doffs: float = 0.0) -> bool:
    """Raise when a pair can only have been taken with its images in the other order.

    The pair is matched at a width of about 240 px for disparities of both signs. In the right
    order a measured disparity of less than ``-doffs`` lies beyond infinity; in the other order,
    one of more than ``doffs`` does.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W)
        Grey rectified pair.
    largest : float
        Largest disparity searched, as measured [px].
    doffs : float
        Added to disparities as measured [px].

    Returns
    -------
    bool
        Whether enough was matched to tell; call it again on another pair if not.

    Raises
    ------
    InputError
        If most of what matches lies beyond infinity, and would not with the images swapped.
    """
    factor = max(left.shape[1] / _SMALL, 1.0)
    width, height = round(left.shape[1] / factor), round(left.shape[0] / factor)
    small_left, small_right = (shrunk(x, width=width, height=height) for x in (left, right))
    reach = 8 * math.ceil(max(largest, abs(doffs)) / factor / 8 + 0.5)
    raw = SgbmMatcher(SearchRange(-reach, 2 * reach))(small_left, small_right)
    matched = gate(small_left, small_right, raw, agreement=0.5, contrast=0.5, speckle_area=100)
    measured = matched[np.isfinite(matched)] * factor
    if len(measured) < _ENOUGH * matched.size:
        return False
    beyond, beyond_swapped = np.mean([measured < -doffs - 1, measured > doffs + 1], axis=1)
    if beyond > 0.5 and beyond_swapped < 0.25:
        raise InputError(
            f"left and right image: {100 * beyond:.0f} % of what matches lies beyond infinity, "
            f"{100 * beyond_swapped:.0f} % would with the two swapped: give them in the other "
            "order, or turn both by 180 degrees if they are upside down"
        )
    return True

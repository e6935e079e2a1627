"""What one cycle looks at: a pair or a disparity map, with what goes along."""

import math
from dataclasses import dataclass

from bearcub.messages.arrays import Float32, UInt8
from bearcub.messages.sensors import Tilt


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Everything one cycle looks at: a rectified pair, or a disparity map, and the tilt.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        The rectified pair, colour as BGR. `left` may come with a disparity map, for the picture.
    disparity : ndarray of float32, shape (H, W), or None
        ``u_left - u_right`` [px] as measured, before the rig's `doffs` is added; NaN where
        unmatched, 0 at infinity. When given, nothing is matched.
    tilt : Tilt or None
        None when there is no reading.
    stamp_ns : int
        When the pair was taken [ns].
    """

    left: UInt8 | None = None
    right: UInt8 | None = None
    disparity: Float32 | None = None
    tilt: Tilt | None = None
    stamp_ns: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class DisparityMap:
    """One frame of disparity, adjusted for the principal points (depth = fx B / d).

    Attributes
    ----------
    disparity : ndarray of float32, shape (H, W)
        [px]; NaN where unmatched, 0 at infinity.
    smallest, largest : float
        The range of disparities [px] that the matcher or sensor could have reported.
    valid_share : float
        Share of the pixels that were looked at with a disparity, 0 to 1.
    epipolar_offset : float
        Measured vertical misalignment of the pair [px], right image lower positive; NaN unknown.
    fattening : float
        How far the matcher carries a near surface's disparity past its edges [px].
    left, right : ndarray of uint8, shape (H, W), or None
        The grey pair it was matched from, rectified.
    offset : float
        What was added to the matched disparity, ``cx_right - cx_left`` [px].
    first_row : int
        What is above it was not looked at.
    grainy : bool
        Noise outweighs the texture of the pair: it was smoothed to match.
    """

    disparity: Float32
    smallest: float = 0.0
    largest: float = math.inf
    valid_share: float = math.nan
    epipolar_offset: float = math.nan
    fattening: float = 0.0
    left: UInt8 | None = None
    right: UInt8 | None = None
    offset: float = 0.0
    first_row: int = 0
    grainy: bool = False

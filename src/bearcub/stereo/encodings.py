"""What the numbers in a disparity or depth file mean: the only place that knows reserved codes.

Everything behind this module is float32 pixels, NaN where unmatched and 0 at infinity.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import FormatError, InputError
from bearcub.messages import Bool, Float32, Int32


class Encoding(StrEnum):
    """How a file holds disparity.

    ============ ================ ========================= ====================================
    name         stored           disparity [px]            not measured
    ============ ================ ========================= ====================================
    auto         as the file's suffix and header say
    pointgrey8   uint8            value, 0 at infinity      240 to 255
    pointgrey16  uint16, 8.8      value / 256, 0 infinity   0xFF00 and above
    opencv16     int16            value / 16                (minimum - 1) * 16 and below
    kitti        uint16           value / 256               0
    integer      unsigned         value / `scale`           0
    pixels       float            value, 0 at infinity      NaN and infinite
    depth_mm     uint16 [mm]      1000 fx B / value         0 and 65535
    depth_m      float [m]        fx B / value, +inf is 0   NaN, 0 and below; -inf: see `decode`
    ============ ================ ========================= ====================================
    """

    AUTO = "auto"
    POINTGREY8 = "pointgrey8"
    POINTGREY16 = "pointgrey16"
    OPENCV16 = "opencv16"
    KITTI = "kitti"
    INTEGER = "integer"
    PIXELS = "pixels"
    DEPTH_MM = "depth_mm"
    DEPTH_M = "depth_m"


MANY_JUMPS = 0.5
"""Share of jumps (see `Reading`) that no disparity map has."""

_LARGEST = 1e6  # px; a larger number, infinity among them, is no measurement

_STORED: dict[Encoding, tuple[str, ...]] = {
    Encoding.POINTGREY8: ("uint8",),
    Encoding.POINTGREY16: ("uint16",),
    Encoding.OPENCV16: ("int16", "uint16"),
    Encoding.KITTI: ("uint16",),
    Encoding.INTEGER: ("uint8", "uint16"),
    Encoding.PIXELS: ("float16", "float32", "float64"),
    Encoding.DEPTH_MM: ("uint16",),
    Encoding.DEPTH_M: ("float16", "float32", "float64"),
}


def decode(
    values: NDArray[Any],
    encoding: Encoding,
    *,
    name: str,
    minimum: int = 0,
    scale: float = 1.0,
    focal_baseline: float = math.nan,
) -> Float32:
    """Turn stored values into disparity.

    Parameters
    ----------
    values : ndarray, shape (H, W)
        As stored.
    encoding : Encoding
        Any but `Encoding.AUTO`.
    name : str
        The file's name, for errors.
    minimum : int
        OpenCV's ``minDisparity`` [px], for `Encoding.OPENCV16`.
    scale : float
        Stored units a pixel, for `Encoding.INTEGER`.
    focal_baseline : float
        ``fx B`` [px m], for depths.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Disparity [px]; NaN where not measured, 0 at infinity. A depth of -inf ("too close to
        measure", REP-117) becomes the largest disparity of the map: something is there, at most
        that far.

    Raises
    ------
    FormatError
        If the values are not stored as `encoding` stores them.
    InputError
        If a depth is to be read without ``fx B``, or `scale` is not positive.
    """
    _require_stored(values, encoding, name=name)
    if encoding in (Encoding.DEPTH_MM, Encoding.DEPTH_M):
        unit = 1e-3 if encoding is Encoding.DEPTH_MM else 1.0
        return _from_depth(values, unit=unit, focal_baseline=focal_baseline, name=name)
    if encoding is Encoding.PIXELS:
        return _where(np.abs(values) < _LARGEST, values, 1.0)  # false for NaN
    if encoding is Encoding.POINTGREY8:
        return _where(values < 240, values, 1.0)
    if encoding is Encoding.POINTGREY16:
        return _where(values < 0xFF00, values, 256.0)
    if encoding is Encoding.OPENCV16:
        signed = values.view(np.int16)
        return _where(signed > (minimum - 1) * 16, signed, 16.0)
    if encoding is Encoding.INTEGER and not scale > 0.0:
        raise InputError(f"{name}: scale {scale}: expected more than 0 stored units a pixel")
    return _where(values > 0, values, 256.0 if encoding is Encoding.KITTI else scale)


def encode(disparity: Float32, encoding: Encoding, *, name: str) -> NDArray[Any]:
    """Turn disparity into stored values, rounded to the encoding's steps.

    Only `pointgrey8`, `pointgrey16`, `kitti` and `pixels` can be written. KITTI has no code for
    infinity: disparity 0 becomes 1/256 px, as in the benchmark's own development kit.

    Raises
    ------
    InputError
        If the encoding cannot be written, or cannot hold a disparity.
    """
    if encoding is Encoding.PIXELS:
        return np.ascontiguousarray(disparity, dtype=np.float32)
    steps, largest, invalid, dtype = _writable(encoding, name=name)
    known = np.isfinite(disparity)
    codes = np.rint(np.where(known, disparity, 0.0).astype(np.float64) * steps)
    beyond = (codes < 0) | (codes > largest)
    if beyond.any():
        raise InputError(
            f"{name}: {encoding} holds disparities from 0 to {largest / steps:.2f} px, "
            f"found {disparity[beyond][0]:.2f} px"
        )
    if encoding is Encoding.KITTI:
        codes = np.maximum(codes, 1)
    return np.where(known, codes, invalid).astype(dtype)


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Reading:
    """How 8.8 words look when read in one byte order; the order with the smaller one is right.

    Attributes
    ----------
    fractional : bool
        False for whole pixels alone, among which neighbours agree. First, because in the other
        order they are fractions alone, which are smooth whatever the scene.
    jumps : float
        Share of neighbours more than 2 px apart, or at the impossible 240 px and above, along rows
        or columns, whichever is more. The wrong order makes whole parts of fractions.
    measured : float
        Share of the words that are no code for "not measured".
    levels : int
        Distinct whole parts.
    """

    fractional: bool
    jumps: float
    measured: float
    levels: int


def read_both_ways(values: NDArray[np.uint16]) -> tuple[Reading, Reading]:
    """Judge 8.8 words of shape (H, W), read as big-endian, in this order and in the other.

    PGM is big-endian, but programs that dump a PC's memory behind a PGM header are common.

    Returns
    -------
    big, little : Reading
    """
    high, low = (byte.astype(np.int32) for byte in divmod(values, 256))
    # In either order a byte 0xFF may mean "not measured" and 0 means infinity: both are judged
    # by the other words alone.
    usable = (high < 255) & (low < 255) & (values > 0)
    return _reading(high, low, usable), _reading(low, high, usable)


def is_little_endian(values: NDArray[np.uint16]) -> bool:
    """Tell whether 8.8 words read as big-endian were in truth written little-endian.

    A draw is big-endian.
    """
    big, little = read_both_ways(values)
    return little < big


def _reading(whole: Int32, fraction: Int32, usable: Bool) -> Reading:
    words = 256 * whole + fraction
    jumps = max(
        _jumping(words[1:], words[:-1], usable[1:] & usable[:-1]),
        _jumping(words[:, 1:], words[:, :-1], usable[:, 1:] & usable[:, :-1]),
    )
    wholes, fractions = (int(np.count_nonzero(byte[usable])) for byte in (whole, fraction))
    return Reading(
        fractional=fractions >= 0.01 * wholes or jumps > MANY_JUMPS,
        jumps=jumps,
        measured=_share(whole < 255),
        levels=int(np.count_nonzero(np.bincount(whole.ravel()))),
    )


def _jumping(words: Int32, neighbours: Int32, usable: Bool) -> float:
    apart = np.abs(words - neighbours) > 2 * 256
    return _share((apart | (words >= 240 * 256))[usable])


def _share(which: Bool) -> float:
    return float(np.count_nonzero(which) / max(which.size, 1))


def _require_stored(values: NDArray[Any], encoding: Encoding, *, name: str) -> None:
    if values.ndim != 2 or values.size == 0:
        raise FormatError(f"{name}: expected one channel (H, W), found an array {values.shape}")
    if encoding not in _STORED:
        raise InputError(f"{name}: {encoding} says nothing of how to read an array")
    if values.dtype.name not in _STORED[encoding]:
        raise FormatError(
            f"{name}: {encoding} is stored as {' or '.join(_STORED[encoding])}, "
            f"found {values.dtype.name}"
        )


def _where(known: Bool, values: NDArray[Any], steps: float) -> Float32:
    with np.errstate(invalid="ignore"):  # signalling NaNs, which damaged files hold
        scaled = np.divide(values, steps, dtype=np.float64)
        return np.where(known, scaled, np.nan).astype(np.float32)


def _from_depth(values: NDArray[Any], *, unit: float, focal_baseline: float, name: str) -> Float32:
    if not focal_baseline > 0.0:
        raise InputError(
            f"{name}: holds depth, which needs the rig's focal length and baseline to become "
            "disparity: give the rig"
        )
    depth = values.astype(np.float64) * unit
    known = depth > focal_baseline / _LARGEST
    if values.dtype == np.uint16:
        known &= values != 65535
    disparity = np.full(depth.shape, np.nan, dtype=np.float64)
    disparity[known] = focal_baseline / depth[known]
    if known.any():
        disparity[np.isneginf(depth)] = disparity[known].max()
    return disparity.astype(np.float32)


def _writable(encoding: Encoding, *, name: str) -> tuple[float, int, int, type[Any]]:
    """Return (steps a pixel, largest code, code of NaN, type) of an integer encoding."""
    writable: dict[Encoding, tuple[float, int, int, type[Any]]] = {
        Encoding.POINTGREY8: (1.0, 239, 255, np.uint8),
        Encoding.POINTGREY16: (256.0, 0xFEFF, 0xFFFF, np.uint16),
        Encoding.KITTI: (256.0, 65535, 0, np.uint16),
    }
    if encoding not in writable:
        raise InputError(
            f"{name}: cannot write {encoding}: expected {', '.join(writable)} or pixels"
        )
    return writable[encoding]

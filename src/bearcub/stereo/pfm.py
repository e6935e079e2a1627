"""Portable float maps (PFM), the format of Middlebury's ground truth.

References
----------
.. [1] D. Scharstein et al., Middlebury Stereo Evaluation version 3, "File formats": header ``Pf``,
   width and height, a scale whose sign is the byte order (negative: little-endian), then rows of
   float32 from the bottom to the top; +inf is unknown.
"""

import re

import numpy as np

from bearcub.errors import FormatError
from bearcub.messages import Float32

_HEADER = re.compile(rb"(P[Ff])\s+(\d{1,6})\s+(\d{1,6})\s+([-+.0-9eE]{1,32})[ \t]*\r?[\n ]")


def parse_pfm(data: bytes, *, name: str) -> Float32:
    """Decode a grey PFM file; the magnitude of its scale is ignored, as by Middlebury.

    Returns
    -------
    ndarray of float32, shape (H, W)
        Rows from the top to the bottom, values as stored (+inf is unknown).

    Raises
    ------
    FormatError
        If `data` is not one complete grey PFM image.
    """
    match = _HEADER.match(data[:256])
    if match is None:
        raise FormatError(f"{name}: expected the header of a PFM image, found {data[:16]!r}")
    if match[1] == b"PF":
        raise FormatError(f"{name}: expected a grey PFM (Pf), found a colour one (PF)")
    width, height = int(match[2]), int(match[3])
    expected, found = 4 * width * height, len(data) - match.end()
    if expected == 0 or expected != found:
        raise FormatError(
            f"{name}: {width} x {height} floats need {expected} bytes from offset {match.end()}, "
            f"found {found}: the file is damaged"
        )
    order = "<" if _scale(match[4], name) < 0 else ">"
    rows = np.frombuffer(data, f"{order}f4", offset=match.end()).reshape(height, width)
    return rows[::-1].astype(np.float32)


def encode_pfm(values: Float32) -> bytes:
    """Encode floats of shape (H, W) as a little-endian grey PFM."""
    height, width = values.shape
    return b"Pf\n%d %d\n-1.0\n" % (width, height) + values[::-1].astype("<f4").tobytes()


def _scale(text: bytes, name: str) -> float:
    try:
        scale = float(text)
    except ValueError:
        scale = 0.0
    if scale == 0.0:
        raise FormatError(
            f"{name}: expected a scale whose sign tells the byte order, found {text!r}"
        )
    return scale

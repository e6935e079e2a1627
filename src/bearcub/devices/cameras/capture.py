"""What every camera driver gives, and the picture conversions that they share."""

import math
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from bearcub.devices.images import RawImage
from bearcub.errors import FormatError
from bearcub.messages import UInt8


@dataclass(frozen=True, slots=True, kw_only=True)
class Taken:
    """What a camera, or a pair of them, has taken at one moment.

    Attributes
    ----------
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
        Colour as BGR; `right` is None for a single camera.
    stamp_ns : int
        Middle of the two moments, by the clock that the capture was given [ns].
    skew : float
        Right after left [s]; 0 where one shutter takes both, NaN where that is not known.
    dropped : int
        Pictures that were taken since the last one and are not delivered.
    """

    left: UInt8
    right: UInt8 | None = None
    stamp_ns: int
    skew: float = math.nan
    dropped: int = 0


class Capture(Protocol):
    """A camera driver; not open when it is made, and used again after a failure."""

    @property
    def name(self) -> str:
        """What it is called in messages: ``/dev/video0``."""
        ...

    def open(self) -> None:
        """Open the camera and set it.

        Raises
        ------
        DeviceError
            If that is not possible now, or the camera does not take the settings.
        """
        ...

    def take(self) -> Taken:
        """Wait for the next picture or pair.

        Raises
        ------
        DeviceError
            If none comes.
        """
        ...

    def close(self) -> None:
        """Let go of the camera; a second call does nothing."""
        ...


def split_side_by_side(picture: UInt8, *, name: str) -> tuple[UInt8, UInt8]:
    """Return the left and the right half of a picture, as copies.

    Raises
    ------
    FormatError
        If its width is odd.

    Examples
    --------
    >>> left, right = split_side_by_side(np.array([[1, 2, 3, 4]], dtype=np.uint8), name="camera")
    >>> left.tolist(), right.tolist()
    ([[1, 2]], [[3, 4]])
    """
    if picture.shape[1] % 2:
        raise FormatError(
            f"{name}: {picture.shape[1]} columns, expected an even number for two halves; "
            "check size in its settings"
        )
    left, right = np.split(picture, 2, axis=1)
    return np.ascontiguousarray(left), np.ascontiguousarray(right)


_BAYER = {  # GenICam names the first two pixels of the first row, OpenCV those at (1, 1) and (1, 2)
    "BayerRG": cv2.COLOR_BayerBG2BGR,
    "BayerGB": cv2.COLOR_BayerGR2BGR,
    "BayerGR": cv2.COLOR_BayerGB2BGR,
    "BayerBG": cv2.COLOR_BayerRG2BGR,
}


def decode_pixels(
    data: RawImage,
    *,
    width: int,
    height: int,
    pixel_format: str,
    name: str,
) -> UInt8:
    """Return a GenICam buffer as a grey or BGR picture of 8 bit.

    Parameters
    ----------
    data : ndarray of uint8 or uint16
        The buffer, in any shape.
    width, height : int
        [px].
    pixel_format : str
        Name of the Pixel Format Naming Convention [1]_: Mono8 to Mono16, BayerRG8 and its kin,
        RGB8 and BGR8.
    name : str
        The camera's, for messages.

    Returns
    -------
    ndarray of uint8, shape (height, width) or (height, width, 3)

    Raises
    ------
    FormatError
        If the format is another one or the buffer is not of that size.

    References
    ----------
    .. [1] EMVA: "GenICam Pixel Format Naming Convention", version 2.1.
    """
    base = pixel_format.rstrip("0123456789")
    bits = int(pixel_format[len(base) :] or 0)
    if (base in ("RGB", "BGR") and bits != 8) or not (
        base in ("Mono", "RGB", "BGR", *_BAYER) and bits in (8, 10, 12, 14, 16)
    ):
        raise FormatError(
            f"{name}: pixel format {pixel_format}: expected Mono8, BayerRG8, RGB8 or BGR8; "
            "set PixelFormat of the camera"
        )
    channels = 3 if base in ("RGB", "BGR") else 1
    if data.size != width * height * channels:
        raise FormatError(
            f"{name}: {data.size} values in a buffer of {width} x {height} {pixel_format}: "
            f"expected {width * height * channels}"
        )
    shape = (height, width, 3) if channels == 3 else (height, width)
    eight_bit = (data if bits == 8 else data >> (bits - 8)).astype(np.uint8).reshape(shape)
    if base in _BAYER:
        return np.asarray(cv2.cvtColor(eight_bit, _BAYER[base]), dtype=np.uint8)
    return np.ascontiguousarray(eight_bit[..., ::-1]) if base == "RGB" else eight_bit

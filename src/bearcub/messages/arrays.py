"""What arrays between stages are called, and the checks at the door."""

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import InputError

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
UInt8 = NDArray[np.uint8]
Int32 = NDArray[np.int32]
Bool = NDArray[np.bool_]


def as_image(image: object, *, name: str) -> UInt8:
    """Check that `image` is an 8-bit grey or BGR image and return it.

    Raises
    ------
    InputError
        If it is not an array of uint8 of shape (H, W) or (H, W, 3) with at least 16 x 16 pixels.
    """
    shape = getattr(image, "shape", None)
    kind = getattr(image, "dtype", None)
    grey_or_colour = shape is not None and (len(shape) == 2 or (len(shape) == 3 and shape[2] == 3))
    if not isinstance(image, np.ndarray) or kind != np.uint8 or not grey_or_colour:
        raise InputError(
            f"{name}: expected an 8-bit image of shape (H, W) or (H, W, 3), "
            f"found {type(image).__name__} of shape {shape} and type {kind}"
        )
    if min(image.shape[:2]) < 16:
        raise InputError(f"{name}: expected at least 16 x 16 pixels, found {shape}")
    return image


def as_disparity(disparity: object, *, name: str) -> Float32:
    """Check that `disparity` is a floating-point map and return it as contiguous float32.

    Raises
    ------
    InputError
        If it is not a two-dimensional array of floats.
    """
    if (
        not isinstance(disparity, np.ndarray)
        or disparity.ndim != 2
        or not np.issubdtype(disparity.dtype, np.floating)
    ):
        raise InputError(
            f"{name}: expected a disparity map of floats of shape (H, W), found "
            f"{type(disparity).__name__} of shape {getattr(disparity, 'shape', None)} "
            f"and type {getattr(disparity, 'dtype', None)}"
        )
    return np.ascontiguousarray(disparity, dtype=np.float32)

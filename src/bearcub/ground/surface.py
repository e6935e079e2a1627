"""The floor as a picture: its disparity, and how far from it a pixel may lie and still be floor."""

import numpy as np

from bearcub.geometry import Float64
from bearcub.messages import Float32, Ground


def floor_disparity(ground: Ground, shape: tuple[int, int]) -> Float32:
    """Return the floor's disparity [px] at every pixel; zero or less above the horizon.

    Parameters
    ----------
    ground : Ground
    shape : tuple of int
        (H, W) of the image.

    Returns
    -------
    ndarray of float32, shape (H, W)
    """
    a, b, c = ground.plane.astype(np.float32)
    rows, columns = shape
    floor: Float32 = (
        b * np.arange(rows, dtype=np.float32)[:, None]
        + (a * np.arange(columns, dtype=np.float32) + c)[None, :]
    )
    if len(ground.knots):
        floor += _bend(ground, floor)
    return floor


def _bend(ground: Ground, plane: Float32) -> Float32:
    """Look the bend up by the plane's own disparity, in steps of a sixteenth of a pixel."""
    table = bend_at(ground, np.arange(0, max(1.0, float(plane.max())) + 1.0, 1 / 16))
    index = np.clip(plane * 16.0, 0, len(table) - 1).astype(np.int32)
    return table.astype(np.float32)[index]


def bend_at(ground: Ground, plane_disparity: Float64) -> Float64:
    """Return what the bend adds [px] where the plane's own disparity is `plane_disparity`."""
    if len(ground.knots) == 0:
        return np.zeros_like(plane_disparity)
    return np.interp(plane_disparity, ground.knots, ground.bend)


def floor_sigma(ground: Ground, shape: tuple[int, int]) -> float:
    """Return the largest 1-sigma of the floor's disparity over the image [px], noise excluded."""
    rows, columns = shape
    corners = np.array(
        [[u, v, 1.0] for u in (0, columns - 1) for v in (rows / 2, rows - 1)], dtype=np.float64
    )
    variance = np.einsum("ni,ij,nj->n", corners, ground.covariance, corners)
    return float(np.sqrt(variance.max()))

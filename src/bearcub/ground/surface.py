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
    return _look_up(ground.knots, ground.bend, plane)


def _look_up(knots: Float64, values: Float64, level: Float32) -> Float32:
    """Interpolate `values` at every pixel through a table with sixteen steps per pixel."""
    steps = np.arange(0, max(1.0, float(level.max())) + 1.0, 1 / 16)
    table = np.interp(steps, knots, values).astype(np.float32)
    return table[np.clip(level * 16.0, 0, len(table) - 1).astype(np.int32)]


def tolerance(ground: Ground, floor: Float32, *, sigmas: float, unevenness: float) -> Float32:
    """Return how far from the floor a pixel's disparity may lie and still be floor [px].

    `sigmas` times the noise at that level and the floor's own uncertainty, and the bumps that
    still are floor: a bump H high adds ``d H / h`` to the disparity d.

    Parameters
    ----------
    ground : Ground
    floor : ndarray of float32, shape (H, W)
        Its disparity.
    sigmas : float
    unevenness : float
        [m].

    Returns
    -------
    ndarray of float32, shape (H, W)
    """
    own = floor_sigma(ground, floor.shape)
    steps = np.arange(0, max(1.0, float(floor.max())) + 1.0, 1 / 16)
    noise = np.full_like(steps, ground.noise)
    if len(ground.knots):
        noise = np.interp(steps, ground.knots + ground.bend, ground.knot_noise)
    table = sigmas * np.hypot(noise, own) + unevenness / ground.height * steps
    index = np.clip(floor * 16.0, 0, len(steps) - 1).astype(np.int32)
    return table.astype(np.float32)[index]


def floor_sigma(ground: Ground, shape: tuple[int, int]) -> float:
    """Return the largest 1-sigma of the floor's disparity over the image [px], noise excluded."""
    rows, columns = shape
    corners = np.array(
        [[u, v, 1.0] for u in (0, columns - 1) for v in (rows / 2, rows - 1)], dtype=np.float64
    )
    variance = np.einsum("ni,ij,nj->n", corners, ground.covariance, corners)
    return float(np.sqrt(variance.max()))

"""What real cameras do to perfect images."""

import math
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8, as_image

GAMMA = 2.2

Strength = Literal["weak", "medium", "strong"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """What a camera of one quality does, and the pair that it is of."""

    blur: float  # deviation of the point spread function [px]
    vignetting: float  # light lost in the corners
    gain: float  # largest mismatch of gain between cameras, relative
    full_well: float  # electrons at white
    read_noise: float  # [electrons]
    rows: float  # deviation of what rectification leaves between the cameras' rows [px]
    motion: float  # longest way of the image during an exposure [px]


# Engineering choices, not a calibration of any camera.
SENSORS = {
    "weak": Sensor(
        blur=0.5, vignetting=0.1, gain=0.02, full_well=8000, read_noise=8, rows=0.1, motion=0.5
    ),
    "medium": Sensor(
        blur=0.7, vignetting=0.25, gain=0.06, full_well=4000, read_noise=12, rows=0.2, motion=1.0
    ),
    "strong": Sensor(
        blur=0.9, vignetting=0.5, gain=0.15, full_well=1500, read_noise=20, rows=0.3, motion=2.0
    ),
}


def linear(image: UInt8) -> Float32:
    """Return the light, 0 to 1, that an 8-bit image stands for."""
    table = (np.arange(256, dtype=np.float32) / 255) ** GAMMA
    return np.asarray(table[image], dtype=np.float32)


def quantised(light: Float32) -> UInt8:
    """Return linear light, 0 to 1, as an 8-bit image."""
    image: UInt8 = np.rint(255 * np.clip(light, 0, 1) ** (1 / GAMMA)).astype(np.uint8)
    return image


def degrade(image: UInt8, strength: Strength, seed: int | tuple[int, ...]) -> UInt8:
    """Return `image` as a camera of that quality would have taken it.

    In linear light: blur of the lens, vignetting about a centre of its own, gain, shot and read
    noise; then gamma and 8 bit, and colour noise is smoothed. The same seed gives the same image;
    give the two cameras of a pair different ones.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
    strength : {"weak", "medium", "strong"}
    seed : int or tuple of int

    Raises
    ------
    InputError
        If the image is not 8-bit or the strength is unknown.
    """
    sensor = _sensor(strength)
    return _taken(linear(as_image(image, name="image")), sensor, np.random.default_rng(seed))


def degrade_pair(
    left: UInt8,
    right: UInt8,
    strength: Strength,
    seed: tuple[int, ...],
    *,
    rig: int | None = None,
) -> tuple[UInt8, UInt8]:
    """Return a pair as two cameras of that quality on a moving robot would have taken it.

    As `degrade` does, each with noise of its own. Before, the image moves during the exposure, in
    both cameras alike, and the right one's rows are where a rectification that is a little off
    leaves them: shifted, and turned about the middle. Columns stay, so that disparity is exact.

    Parameters
    ----------
    left, right : ndarray of uint8, shape (H, W) or (H, W, 3)
    strength : {"weak", "medium", "strong"}
    seed : tuple of int
        The same seeds give the same pair.
    rig : int, optional
        Seed of what a rig keeps from pair to pair, its rows; without it every `seed` has a rig of
        its own.

    Raises
    ------
    InputError
        If an image is not 8-bit or the strength is unknown.
    """
    sensor = _sensor(strength)
    rng = np.random.default_rng((*seed, 2))
    way = _way(sensor.motion * rng.uniform(), math.pi * rng.uniform())
    mounted = rng if rig is None else np.random.default_rng((rig, 3))
    shift, turn = sensor.rows * np.sqrt([0.5, 1.5]) * mounted.standard_normal(2)
    light = linear(as_image(left, name="left"))
    off = _with_rows_off(linear(as_image(right, name="right")), shift, turn)
    one, other = (
        _taken(np.asarray(cv2.filter2D(light, -1, way)), sensor, np.random.default_rng((*seed, k)))
        for k, light in enumerate((light, off))
    )
    return one, other


def _sensor(strength: str) -> Sensor:
    if strength not in SENSORS:
        raise InputError(f"strength = {strength!r}: must be one of {', '.join(SENSORS)}")
    return SENSORS[strength]


def _taken(light: Float32, sensor: Sensor, rng: np.random.Generator) -> UInt8:
    light = np.asarray(cv2.GaussianBlur(light, (0, 0), sensor.blur), dtype=np.float32)
    gain = 1 + sensor.gain * rng.uniform(-1, 1)
    falloff = _vignette(light.shape[0], light.shape[1], sensor.vignetting, rng)
    factor = (gain * falloff).astype(np.float32)
    light = light * (factor if light.ndim == 2 else factor[:, :, None])
    electrons = light * sensor.full_well
    deviation = np.sqrt(electrons + sensor.read_noise**2)
    electrons += deviation * rng.standard_normal(electrons.shape, dtype=np.float32)
    taken = quantised(electrons / sensor.full_well)
    return taken if taken.ndim == 2 else _calm_colour(taken)


def _way(length: float, direction: float) -> Float32:
    """Return the point spread function of a way of the image [px, rad]."""
    half = math.ceil(0.5 * length)
    at = length * ((np.arange(64) + 0.5) / 64 - 0.5)
    u, v = (half + at * turn for turn in (math.cos(direction), math.sin(direction)))
    nodes = np.arange(2 * half + 1)
    across, down = (np.clip(1 - np.abs(nodes[:, None] - x), 0, None) for x in (u, v))
    spread: Float32 = (down @ across.T / len(at)).astype(np.float32)
    return spread


def _with_rows_off(light: Float32, shift: float, turn: float) -> Float32:
    """Return an image whose rows are off by a shift, and by a turn as much more at its right end.

    [px]
    """
    height, width = light.shape[:2]
    slope = 2 * turn / (width - 1)
    matrix = np.array([[1, 0, 0], [slope, 1, shift - turn]])
    off = cv2.warpAffine(
        light, matrix, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return np.clip(np.asarray(off, dtype=np.float32), 0, 1)


def _calm_colour(image: UInt8) -> UInt8:
    """Take the noise out of the colour and leave it in the brightness, as colour cameras do."""
    split = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb), dtype=np.uint8)
    calm = np.asarray(cv2.GaussianBlur(split, (0, 0), 1.5), dtype=np.uint8)
    calm[:, :, 0] = split[:, :, 0]
    return np.asarray(cv2.cvtColor(calm, cv2.COLOR_YCrCb2BGR), dtype=np.uint8)


def _vignette(height: int, width: int, loss: float, rng: np.random.Generator) -> Float32:
    """Return the share of light kept: 1 in a centre that is a little off, ``1 - loss`` outside."""
    off_u, off_v = rng.uniform(-0.05, 0.05, 2)
    u = np.linspace(-0.5, 0.5, width, dtype=np.float32) - off_u
    v = (np.linspace(-0.5, 0.5, height, dtype=np.float32) - off_v) * height / width
    corner = 0.25 * (1 + (height / width) ** 2)
    kept: Float32 = 1 - loss * (u[None, :] ** 2 + v[:, None] ** 2) / corner
    return kept.astype(np.float32)

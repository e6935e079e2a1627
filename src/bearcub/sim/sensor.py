"""What a real camera does to a perfect image."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from bearcub.errors import InputError
from bearcub.messages import Float32, UInt8, as_image

GAMMA = 2.2

Strength = Literal["weak", "medium", "strong"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sensor:
    blur: float  # deviation of the point spread function [px]
    vignetting: float  # light lost in the corners
    gain: float  # largest mismatch of gain between cameras, relative
    full_well: float  # electrons at white
    read_noise: float  # [electrons]


# Engineering choices, not a calibration of any camera.
_SENSORS = {
    "weak": _Sensor(blur=0.5, vignetting=0.1, gain=0.02, full_well=8000, read_noise=8),
    "medium": _Sensor(blur=0.7, vignetting=0.25, gain=0.06, full_well=4000, read_noise=12),
    "strong": _Sensor(blur=0.9, vignetting=0.5, gain=0.15, full_well=1500, read_noise=20),
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
    if strength not in _SENSORS:
        raise InputError(f"strength = {strength!r}: must be one of {', '.join(_SENSORS)}")
    sensor = _SENSORS[strength]
    rng = np.random.default_rng(seed)
    light = linear(as_image(image, name="image"))
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

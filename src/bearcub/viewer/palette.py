"""The colours of every picture, BGR, told apart by colour-blind readers too [1]_.

References
----------
.. [1] M. Okabe, K. Ito: "Color Universal Design", 2008: eight colours that stay distinct under
   protanopia, deuteranopia and tritanopia.
"""

import math

import cv2
import numpy as np

from bearcub.messages import Float32, Limit, UInt8

Colour = tuple[int, int, int]

BLACK: Colour = (0, 0, 0)
WHITE: Colour = (255, 255, 255)
INK: Colour = (48, 42, 40)
PAPER: Colour = (255, 255, 255)
NIGHT: Colour = (32, 27, 24)
MUTED: Colour = (150, 145, 140)
VERMILLION: Colour = (0, 94, 213)
ORANGE: Colour = (0, 159, 230)
YELLOW: Colour = (66, 228, 240)
GREEN: Colour = (115, 158, 0)
SKY: Colour = (233, 180, 86)
BLUE: Colour = (178, 114, 0)
PURPLE: Colour = (167, 121, 204)

FLOOR: Colour = (140, 190, 20)
HOLE: Colour = (190, 70, 215)
SERIES: tuple[Colour, ...] = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)
LIMITS: dict[Limit, Colour] = {
    Limit.OBSTACLE: VERMILLION,
    Limit.HOLE: HOLE,
    Limit.SLOPE: YELLOW,
    Limit.UNSEEN: MUTED,
}

NEAREST, FARTHEST = 1.0, 20.0  # the ends of the scale of distances [m], the same in every frame


def blended(stops: tuple[Colour, ...], *, steps: int = 256) -> UInt8:
    """Return a scale of colours running through `stops` at equal spacing, shape (steps, 3)."""
    at = np.linspace(0, len(stops) - 1, steps)
    channels = [np.interp(at, range(len(stops)), channel) for channel in zip(*stops, strict=True)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


DISTANCE_SCALE: UInt8 = blended((VERMILLION, ORANGE, YELLOW, SKY, BLUE))
DISTANCE_SCALE.flags.writeable = False


def distance_code(distance: float) -> int:
    """Return the place of a distance [m] on `DISTANCE_SCALE`: near warm, far cool, by its log.

    Examples
    --------
    >>> [distance_code(d) for d in (0.0, 1.0, 4.48, 20.0, float("inf"), float("nan"))]
    [0, 0, 127, 255, 255, 255]
    """
    if not distance < FARTHEST:
        return 255
    return int(255 * math.log(max(distance, NEAREST) / NEAREST) / math.log(FARTHEST / NEAREST))


def distance_colour(distance: float) -> Colour:
    """Return the colour of one distance [m]."""
    blue, green, red = DISTANCE_SCALE[distance_code(distance)].tolist()
    return blue, green, red


def coloured(codes: UInt8, scale: UInt8) -> UInt8:
    """Return the picture, shape (H, W, 3), of codes through a scale of 256 colours."""
    return np.asarray(cv2.applyColorMap(codes, scale.reshape(256, 1, 3)), dtype=np.uint8)


def in_colour(image: UInt8) -> UInt8:
    """Return an image, grey or BGR, as BGR."""
    if image.ndim == 3:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def blank(width: int, height: int, colour: Colour) -> UInt8:
    """Return a picture of one colour, shape (height, width, 3)."""
    canvas = np.empty((height, width, 3), dtype=np.uint8)
    cv2.rectangle(canvas, (0, 0), (width, height), colour, cv2.FILLED)
    return canvas


def depth_picture(disparity: Float32, *, focal_baseline: float) -> UInt8:
    """Return a disparity map [px] in the colours of distance, shape (H, W, 3).

    `focal_baseline` is ``fx B`` [px m]. Colours are subdued, for drawing on; NaN is dark.
    """
    nearest, farthest = focal_baseline / NEAREST, focal_baseline / FARTHEST
    known = disparity.copy()
    cv2.patchNaNs(known, -1.0)
    missing = known < 0
    logarithm = cv2.log(np.clip(known, np.float32(farthest), np.float32(nearest)))
    steps = 254.0 / np.log(nearest / farthest)
    codes = cv2.convertScaleAbs(logarithm, alpha=-steps, beta=steps * np.log(nearest))
    scale = (DISTANCE_SCALE * 0.62).astype(np.uint8)
    scale[255] = (46, 42, 40)
    return coloured(np.where(missing, 255, codes).astype(np.uint8), scale)

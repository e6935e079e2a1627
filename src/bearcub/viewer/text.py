"""Text on pictures: crisp at small sizes, on a dark box where the background is unknown."""

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np

from bearcub.messages import UInt8
from bearcub.viewer.palette import BLACK, NIGHT, WHITE, Colour, blended, coloured

_SUPERSAMPLE = 3
_EM = 30.0  # rows of a line of OpenCV's font at scale 1
_OUTLINES = hasattr(cv2, "FontFace")  # OpenCV 5 has outline fonts; 4 draws strokes, in ASCII only
_ASCII = str.maketrans({"±": "+-", "°": "deg", "σ": "s", "×": "x", "≥": ">=", "·": "-", "−": "-"})
_FADING = blended((WHITE, BLACK))
_FADING.flags.writeable = False


def line_height(size: float) -> int:
    """Return the rows [px] that one line of text of this size takes."""
    return round(1.3 * size)


@lru_cache(maxsize=1024)
def text_mask(text: str, size: float, *, bold: bool = False) -> UInt8:
    """Return the coverage of a line of text, 0 to 255, shape (line_height(size), width).

    Drawn large and shrunk, which spaces small letters evenly.
    """
    shown = text if _OUTLINES else text.translate(_ASCII)
    scale = size * _SUPERSAMPLE / _EM
    stroke = (2 if bold else 1) if _OUTLINES else max(1, round(scale * (3.4 if bold else 2.2)))
    font = cv2.FONT_HERSHEY_SIMPLEX
    (wide, _), _ = cv2.getTextSize(shown, font, scale, stroke)
    rows, columns = line_height(size), wide // _SUPERSAMPLE + 3
    large = np.zeros((rows * _SUPERSAMPLE, columns * _SUPERSAMPLE), dtype=np.uint8)
    origin = (_SUPERSAMPLE, round(0.98 * size * _SUPERSAMPLE))
    cv2.putText(large, shown, origin, font, scale, 255, stroke, cv2.LINE_AA)
    mask = np.asarray(
        cv2.resize(large, (columns, rows), interpolation=cv2.INTER_AREA), dtype=np.uint8
    )
    mask.flags.writeable = False
    return mask


def text_width(text: str, size: float, *, bold: bool = False) -> int:
    """Return the columns [px] that a line of text takes."""
    return int(text_mask(text, size, bold=bold).shape[1])


def blend(canvas: UInt8, mask: UInt8, *, x: int, y: int, colour: Colour) -> None:
    """Paint `colour` through `mask` with its top left corner at (x, y), clipped to the canvas."""
    top, left = max(0, -y), max(0, -x)
    part = canvas[max(0, y) : y + mask.shape[0], max(0, x) : x + mask.shape[1]]
    if part.size == 0:
        return
    cover = np.ascontiguousarray(mask[top : top + part.shape[0], left : left + part.shape[1]])
    kept = cv2.multiply(part, coloured(cover, _FADING), scale=1.0 / 255.0)
    part[:] = cv2.add(kept, coloured(cover, _growing(colour)))


@lru_cache(maxsize=64)
def _growing(colour: Colour) -> UInt8:
    """Return a scale from black to `colour`."""
    return blended((BLACK, colour))


def draw_text(
    canvas: UInt8,
    text: str,
    at: tuple[float, float],
    *,
    size: float,
    colour: Colour = WHITE,
    bold: bool = False,
    anchor: tuple[float, float] = (0.0, 0.0),
    upwards: bool = False,
) -> None:
    """Write one line of text on a BGR picture.

    Parameters
    ----------
    canvas : ndarray of uint8, shape (H, W, 3)
        Changed in place; what leaves it is cut off.
    text : str
        One line.
    at : tuple of float
        (x, y) [px] of the anchor.
    size : float
        Size of the font [px].
    colour : tuple of int
        BGR.
    bold : bool
        Heavier strokes.
    anchor : tuple of float
        Which point of the text lies at `at`: (0, 0) its top left, (0.5, 1) its bottom centre.
    upwards : bool
        Turned by 90 deg, to be read from below to above.
    """
    mask = text_mask(text, size, bold=bold)
    if upwards:
        mask = np.rot90(mask)
    x = round(at[0] - anchor[0] * mask.shape[1])
    y = round(at[1] - anchor[1] * mask.shape[0])
    blend(canvas, mask, x=x, y=y, colour=colour)


def shade(canvas: UInt8, *, x: int, y: int, width: int, height: int, opacity: float) -> None:
    """Darken a rectangle, so that light text on it can be read on any background."""
    part = canvas[max(0, y) : y + height, max(0, x) : x + width]
    if part.size:
        part[:] = cv2.convertScaleAbs(part, alpha=1.0 - opacity, beta=opacity * NIGHT[1])


def label_size(lines: Sequence[str], size: float) -> tuple[int, int]:
    """Return (width, height) [px] of the box that `draw_label` draws."""
    widths = [text_width(line, size, bold=not i) for i, line in enumerate(lines)]
    return max(widths) + 2 * _margin(size) + 3, len(lines) * line_height(size) + _margin(size)


def draw_label(
    canvas: UInt8, lines: Sequence[str], *, x: int, y: int, size: float, colour: Colour
) -> None:
    """Write lines, the first one bold, in a dark box with a coloured bar at its left.

    (x, y) [px] is the box's top left corner; `label_size` tells how large it is.
    """
    width, height = label_size(lines, size)
    shade(canvas, x=x, y=y, width=width, height=height, opacity=0.78)
    cv2.rectangle(canvas, (x, y), (x + 2, y + height - 1), colour, cv2.FILLED)
    for i, line in enumerate(lines):
        top = y + _margin(size) // 2 + i * line_height(size)
        draw_text(canvas, line, (x + 3 + _margin(size), top), size=size, bold=not i)


def wrap(text: str, *, size: float, width: int) -> list[str]:
    """Break a text into lines of at most `width` [px]; a longer word keeps a line to itself."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def _margin(size: float) -> int:
    return max(2, round(0.3 * size))

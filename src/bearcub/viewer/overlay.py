"""The left image with what was found in it drawn over it."""

import math
from functools import lru_cache

import cv2
import numpy as np

from bearcub.errors import InputError
from bearcub.geometry import Projection
from bearcub.messages import Answer, Bool, Float64, Ground, Layers, Pixel, UInt8, as_image
from bearcub.viewer.palette import (
    BLACK,
    DISTANCE_SCALE,
    FLOOR,
    HOLE,
    MUTED,
    NIGHT,
    WHITE,
    YELLOW,
    Colour,
    blank,
    coloured,
    depth_picture,
    distance_code,
    distance_colour,
    in_colour,
)
from bearcub.viewer.placing import Area, Placing
from bearcub.viewer.text import (
    draw_label,
    draw_text,
    label_size,
    line_height,
    shade,
    text_width,
    wrap,
)
from bearcub.viewer.wording import hole_lines, metres, obstacle_lines, status

_SKY = 8  # tint codes besides those of `Pixel`: not seen, above the horizon
_STRIPE = 8 + Pixel.HOLE
_NEAR = 16  # the distances' colours share the codes from here on: (256 - 16) steps
_NOTE_LINES = 3
_COVERS = (0.2, 0.5, 1.0)  # share of a label that may cover things, from the longest on


def overlay(answer: Answer, image: UInt8 | None, camera: Projection) -> UInt8:
    """Draw an answer over the left image.

    The floor is green, an obstacle has the colour of its distance (near warm, far cool), a hole
    is hatched, ground that is not seen is grey; below the picture one line says how the camera
    stands. Every label carries the 1-sigma of its distance.

    Parameters
    ----------
    answer : Answer
        Of this frame, with its layers of shape (H, W).
    image : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        The rectified left image, grey or BGR; None draws the disparity in the colours of distance.
    camera : Projection
        Of the layers' size.

    Returns
    -------
    ndarray of uint8, shape (H + S, W, 3)
        BGR; pixel (u, v) of the image is at (u, v). The status strip of S rows is below it, S
        depending on the image's size alone.

    Raises
    ------
    InputError
        If `image` is no picture of the layers' size.
    """
    canvas = _tinted(answer, _background(answer.layers, image, camera))
    height, width = canvas.shape[:2]
    size = font_size(width, height)
    placing = Placing(Area(0, 0, width, height))
    _draw_horizon(canvas, answer.ground, placing, size=size)
    _draw_notes(canvas, answer, placing, size=size)
    _draw_things(canvas, answer, placing, size=size)
    return np.vstack([canvas, _status_strip(answer, width=width, size=size)])


def font_size(width: int, height: int) -> float:
    """Return the size of the text [px] on a picture of this size [px]."""
    return min(max(min(width / 48.0, height / 30.0), 11.0), 36.0)


def horizon(plane: Float64, *, width: int, height: int) -> tuple[Float64, Float64] | None:
    """Return the two ends (u, v) [px] of the line where the floor's disparity is 0.

    Parameters
    ----------
    plane : ndarray of float64, shape (3,)
        (a, b, c) of the floor ``d = a u + b v + c``.
    width, height : int
        Of the picture [px]; the ends lie on its left and right borders, or, where the line is
        steeper than its diagonal, on its top and bottom ones.

    Returns
    -------
    tuple of ndarray, or None
        None when the plane has no horizon.

    Examples
    --------
    >>> horizon(np.array([0.0, 0.1, -20.0]), width=640, height=480)
    (array([  0., 200.]), array([639., 200.]))
    """
    a, b, c = plane
    if not np.isfinite(plane).all() or (a == 0 and b == 0):
        return None
    if abs(b) * height >= abs(a) * width:
        left, right = -c / b, -(a * (width - 1) + c) / b
        return np.array([0.0, left]), np.array([width - 1.0, right])
    top, bottom = -c / a, -(b * (height - 1) + c) / a
    return np.array([top, 0.0]), np.array([bottom, height - 1.0])


def _background(layers: Layers, image: UInt8 | None, camera: Projection) -> UInt8:
    if image is None:
        return depth_picture(layers.disparity, focal_baseline=camera.fx * camera.baseline)
    picture = as_image(image, name="image")
    if picture.shape[:2] != layers.kind.shape:
        raise InputError(
            f"image: expected {layers.kind.shape[1]} x {layers.kind.shape[0]} pixels like the "
            f"disparity map, found {picture.shape[1]} x {picture.shape[0]}"
        )
    return in_colour(picture)


def _tinted(answer: Answer, picture: UInt8) -> UInt8:
    """Mix every pixel with the colour of what it was found to be, by two look-up tables."""
    codes = _tint_codes(answer)
    paint, keep = _tint_tables()
    kept = cv2.multiply(picture, coloured(codes, keep), scale=1.0 / 255.0)
    return np.asarray(cv2.add(kept, coloured(codes, paint)), dtype=np.uint8)


def _tint_codes(answer: Answer) -> UInt8:
    layers = answer.layers
    kind = layers.kind
    above = (kind == Pixel.UNSEEN) & (layers.floor <= 0)
    striped = (kind == Pixel.HOLE) & _stripes(*kind.shape)
    codes: UInt8 = kind | above * np.uint8(_SKY) | striped * np.uint8(_STRIPE)
    for thing in answer.obstacles:
        u0, v0, u1, v1 = thing.box
        part = (slice(v0, v1 + 1), slice(u0, u1 + 1))
        tint = _NEAR + distance_code(thing.distance) * (255 - _NEAR) // 255
        codes[part][layers.labels[part] == thing.id] = tint
    return codes


@lru_cache(maxsize=4)
def _stripes(height: int, width: int) -> Bool:
    period = max(8, round(font_size(width, height)))
    v, u = np.ogrid[:height, :width]
    return np.asarray((u + v) % period < period // 2)


@lru_cache(maxsize=1)
def _tint_tables() -> tuple[UInt8, UInt8]:
    """Return what is added and what is kept (of 255) of the picture for every tint code."""
    colour = np.zeros((256, 3))
    opacity = np.zeros((256, 1))
    for code, tint, share in (
        (Pixel.UNSEEN, (118, 118, 118), 0.55),
        (Pixel.FLOOR, FLOOR, 0.30),
        (Pixel.OBSTACLE, MUTED, 0.25),
        (Pixel.HOLE, NIGHT, 0.45),
        (_STRIPE, HOLE, 0.80),
    ):
        colour[code], opacity[code] = tint, share
    for code in range(_NEAR, 256):
        colour[code] = DISTANCE_SCALE[(code - _NEAR) * 255 // (255 - _NEAR)]
        opacity[code] = 0.42
    keep = np.repeat(255.0 * (1.0 - opacity), 3, axis=1)
    return (colour * opacity).round().astype(np.uint8), keep.round().astype(np.uint8)


def _draw_horizon(canvas: UInt8, ground: Ground, placing: Placing, *, size: float) -> None:
    height, width = canvas.shape[:2]
    ends = horizon(ground.plane, width=width, height=height)
    if ends is None or max(float(np.abs(end).max()) for end in ends) > 1e6:
        return
    start, end = ((round(16 * x), round(16 * y)) for x, y in ends)
    for colour, thickness in ((BLACK, 3), (WHITE if ground.seen else MUTED, 1)):
        cv2.line(canvas, start, end, colour, thickness, cv2.LINE_AA, 4)
    name = "horizon" if ground.seen else "horizon expected"
    wide, small = text_width(name, 0.85 * size), 0.85 * size
    right = max(ends, key=lambda end: float(end[0]))
    place = placing.place((wide, line_height(small)), beside=_spot(right, canvas))
    if place:
        draw_text(canvas, name, (place.x + 1, place.y + 1), size=small, colour=BLACK)
        draw_text(canvas, name, (place.x, place.y), size=small)


def _spot(point: Float64, canvas: UInt8) -> Area:
    """Return the pixel of the picture nearest to a point (u, v)."""
    height, width = canvas.shape[:2]
    u, v = np.clip(point, 0, [width - 7, height - 1])
    return Area(int(u), int(v), 1, 1)


def _draw_notes(canvas: UInt8, answer: Answer, placing: Placing, *, size: float) -> None:
    width = canvas.shape[1]
    lines: list[str] = []
    for note in answer.notes:
        lines += wrap(note, size=size, width=width - round(3 * size))
    if not lines:
        return
    if len(lines) > _NOTE_LINES:
        lines = [*lines[: _NOTE_LINES - 1], f"{lines[_NOTE_LINES - 1]} ..."]
    rows = len(lines) * line_height(size) + round(0.6 * size)
    shade(canvas, x=0, y=0, width=width, height=rows, opacity=0.8)
    cv2.rectangle(canvas, (0, 0), (3, rows - 1), YELLOW, cv2.FILLED)
    for i, line in enumerate(lines):
        at = (0.9 * size, 0.3 * size + i * line_height(size))
        draw_text(canvas, line, at, size=size, colour=YELLOW)
    placing.taken.append(Area(0, 0, width, rows))


def _draw_things(canvas: UInt8, answer: Answer, placing: Placing, *, size: float) -> None:
    """Draw boxes from far to near, then labels from near to far: the nearest are never covered."""
    things: list[tuple[float, Area, Colour, list[tuple[str, ...]]]] = []
    for o in answer.obstacles:
        lines = obstacle_lines(o)
        shorter = [lines, lines[:1], (f"{o.id}  {metres(o.distance, math.nan)}",)]
        things.append((o.distance, _area(o.box), distance_colour(o.distance), shorter))
    for h in answer.holes:
        texts = hole_lines(h)
        things.append((h.distance, _area(h.box), HOLE, [texts, texts[:1]]))
    things.sort(key=lambda thing: thing[0])
    thickness = max(1, round(size / 7))
    for _, area, colour, _ in reversed(things):
        corners = (area.x, area.y), (area.x + area.width - 1, area.y + area.height - 1)
        cv2.rectangle(canvas, *corners, NIGHT, thickness + 2)
        cv2.rectangle(canvas, *corners, colour, thickness)
    placing.things.extend(area for _, area, _, _ in things)
    for _, area, colour, texts_by_length in things:
        for text, cover in zip(texts_by_length, _COVERS[-len(texts_by_length) :], strict=True):
            place = placing.place(label_size(text, size), beside=area, cover=cover)
            if place:
                draw_label(canvas, text, x=place.x, y=place.y, size=size, colour=colour)
                break


def _area(box: tuple[int, int, int, int]) -> Area:
    u0, v0, u1, v1 = box
    return Area(u0, v0, u1 - u0 + 1, v1 - v0 + 1)


def _status_strip(answer: Answer, *, width: int, size: float) -> UInt8:
    """Return one line of as many rows as the width asks for, smaller where it would not fit."""
    rows = line_height(size) + round(0.6 * size)
    strip = blank(width, rows, NIGHT)
    text = "    ".join(status(answer))
    wide = text_width(text, size)
    fitting = size * min(1.0, (width - 1.6 * size) / wide)
    colour = WHITE if answer.ground.seen else YELLOW
    draw_text(strip, text, (0.8 * size, rows / 2), size=fitting, colour=colour, anchor=(0, 0.5))
    return strip

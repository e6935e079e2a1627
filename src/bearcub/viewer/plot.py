"""Small, tidy plots: panels with axes, ticks, titles, units and legends, drawn by OpenCV.

A panel is a frozen value; `draw_panel` turns one into a picture, `draw_page` lays several out
under a title and over a caption.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from bearcub.errors import InputError
from bearcub.messages import Float64, UInt8
from bearcub.viewer.palette import INK, PAPER, Colour, blank
from bearcub.viewer.placing import Area
from bearcub.viewer.text import blend, draw_text, line_height, text_width, wrap

_SHIFT = 4  # bits of a pixel's fraction in OpenCV's drawing
_GRID: Colour = (232, 230, 228)
_CAPTION: Colour = (112, 106, 102)
_TEXT = 15.0
_TITLE = 18.0
_TICK = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """One curve of a panel.

    Attributes
    ----------
    x, y : ndarray of float64, shape (N,)
        In the panel's units; a NaN interrupts a line.
    colour : tuple of int
        BGR.
    label : str
        In the legend; empty leaves it out.
    kind : str
        "line", "dashed", "area" (filled down to 0) or "bars" (centred at x, touching).
    width : int
        Of lines [px].
    """

    x: Float64
    y: Float64
    colour: Colour
    label: str = ""
    kind: Literal["line", "dashed", "area", "bars"] = "line"
    width: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One pair of axes and what they show.

    Attributes
    ----------
    title, x_label, y_label : str
        Labels with their unit, as "column [px]".
    series : tuple of Series
        Drawn in this order.
    picture : ndarray of uint8, shape (H, W, 3), or None
        BGR, fills the axes behind the series; its pixel corners are the ranges.
    x_range, y_range : tuple of float, or None
        (left, right) and (bottom, top); a range may run backwards, as image rows do. None fits
        the series, with the y axis from 0.
    aspect : float or None
        Height over width of the axes; None takes the panel's size as it is.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...] = ()
    picture: UInt8 | None = None
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    aspect: float | None = None


def nice_ticks(low: float, high: float, *, about: int = 6) -> list[float]:
    """Return round numbers, 1, 2 or 5 times a power of ten apart, from `low` to `high`.

    Examples
    --------
    >>> nice_ticks(0, 640)
    [0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0]
    >>> nice_ticks(0.13, 0.47, about=3)
    [0.2, 0.3, 0.4]
    >>> nice_ticks(480, 0, about=5)
    [0.0, 100.0, 200.0, 300.0, 400.0]
    """
    low, high = min(low, high), max(low, high)
    if not high > low:
        return [low]
    rough = (high - low) / max(1, about)
    power = 10.0 ** math.floor(math.log10(rough))
    step = min((1.0, 2.0, 5.0, 10.0), key=lambda k: abs(math.log(k * power / rough))) * power
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [float(f"{k * step:.12g}") for k in range(first, last + 1)]


def draw_page(
    panels: Sequence[Panel],
    *,
    columns: int = 1,
    title: str = "",
    caption: str = "",
    width: int = 1200,
    row_height: int = 380,
) -> UInt8:
    """Lay panels out in rows under a title and over a caption.

    Parameters
    ----------
    panels : sequence of Panel
        In reading order.
    columns : int
        Panels in one row.
    title, caption : str
        Empty for none; the caption is wrapped.
    width : int
        Of the page [px].
    row_height : int
        Of a row of panels [px]; a row whose panels all have an aspect takes what they need.

    Returns
    -------
    ndarray of uint8, shape (rows, width, 3)
        BGR.
    """
    parts = [blank(width, 12, PAPER)]
    if title:
        parts.append(_paragraph([title], width=width, size=1.35 * _TITLE, bold=True))
    for start in range(0, len(panels), columns):
        row = panels[start : start + columns]
        each = width // columns
        height = max(_height(panel, width=each, otherwise=row_height) for panel in row)
        strip = blank(width, height, PAPER)
        for i, panel in enumerate(row):
            drawn = draw_panel(panel, width=each, height=height)
            strip[:, i * each : (i + 1) * each] = drawn
        parts.append(strip)
    if caption:
        lines = wrap(caption, size=_TEXT, width=width - 48)
        parts.append(_paragraph(lines, width=width, size=_TEXT, bold=False))
    return np.vstack([*parts, blank(width, 12, PAPER)])


def draw_panel(panel: Panel, *, width: int, height: int) -> UInt8:
    """Draw one panel.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        BGR.
    """
    canvas = blank(width, height, PAPER)
    axes = _Axes.of(panel, width=width, height=height)
    frame = axes.frame
    if panel.picture is not None:
        part = canvas[frame.y : frame.y + frame.height, frame.x : frame.x + frame.width]
        shrinks = panel.picture.shape[1] > frame.width
        method = cv2.INTER_AREA if shrinks else cv2.INTER_NEAREST
        part[:] = cv2.resize(panel.picture, (frame.width, frame.height), interpolation=method)
    _draw_ticks(canvas, axes, grid=panel.picture is None)
    part = canvas[frame.y : frame.y + frame.height, frame.x : frame.x + frame.width]
    for series in panel.series:
        _draw_series(part, series, axes)
    _draw_spines(canvas, frame, closed=panel.picture is not None)
    _draw_titles(canvas, panel, frame)
    _draw_legend(canvas, panel, frame)
    return canvas


def save(picture: UInt8, path: Path) -> Path:
    """Write a picture as PNG and return its path.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    encoded = cv2.imencode(".png", picture)[1].tobytes()
    try:
        path.write_bytes(encoded)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
    return path


@dataclass(frozen=True, slots=True, kw_only=True)
class _Axes:
    """Where the numbers of a panel lie in its picture."""

    frame: Area
    x_range: tuple[float, float]
    y_range: tuple[float, float]

    @classmethod
    def of(cls, panel: Panel, *, width: int, height: int) -> "_Axes":
        x_range = panel.x_range or _fitted([s.x for s in panel.series])
        tallest = _fitted([np.zeros(1), *(s.y for s in panel.series)])
        y_range = panel.y_range or (tallest[0], tallest[1] * 1.06 or 1.0)
        left, right, top, bottom = _margins(panel, y_range)
        room = Area(left, top, max(16, width - left - right), max(16, height - top - bottom))
        if panel.aspect:
            fitted = min(room.width, round(room.height / panel.aspect))
            room = Area(left, top, fitted, round(fitted * panel.aspect))
        return cls(frame=room, x_range=x_range, y_range=y_range)

    def inside(self, x: Float64, y: Float64) -> Float64:
        """Return pixels (column, row) within the frame, shape (N, 2)."""
        (x0, x1), (y0, y1) = self.x_range, self.y_range
        across = (np.asarray(x, dtype=np.float64) - x0) / (x1 - x0) * self.frame.width - 0.5
        down = (y1 - np.asarray(y, dtype=np.float64)) / (y1 - y0) * self.frame.height - 0.5
        return np.stack(np.broadcast_arrays(across, down), axis=-1)


def _fitted(values: Sequence[Float64]) -> tuple[float, float]:
    finite = np.concatenate([np.zeros(0), *(np.ravel(v) for v in values)])
    finite = finite[np.isfinite(finite)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    return (low, high) if high > low else (low, low + 1.0)


def _margins(panel: Panel, y_range: tuple[float, float]) -> tuple[int, int, int, int]:
    """Return the room for text left, right, above and below of the axes [px]."""
    numbers = ["0000", *(f"{tick:g}" for tick in nice_ticks(*y_range))]
    widest = max(text_width(number, _TEXT) for number in numbers)
    named = any(s.label for s in panel.series)
    left = widest + _TICK + 12 + line_height(_TEXT)
    top = line_height(_TITLE) + (line_height(_TEXT) if named else 0) + 14
    return left, 24, top, 2 * line_height(_TEXT) + _TICK + 14


def _height(panel: Panel, *, width: int, otherwise: int) -> int:
    """Return the rows a panel of this width takes."""
    if not panel.aspect:
        return otherwise
    left, right, top, bottom = _margins(panel, panel.y_range or (0.0, 1.0))
    return top + bottom + round((width - left - right) * panel.aspect)


def _draw_ticks(canvas: UInt8, axes: _Axes, *, grid: bool) -> None:
    frame = axes.frame
    right, foot = frame.x + frame.width, frame.y + frame.height
    for tick in nice_ticks(*axes.x_range, about=max(2, frame.width // 110)):
        x = round(float(axes.inside(np.array(tick), np.array(0.0))[0])) + frame.x
        if grid:
            cv2.line(canvas, (x, frame.y), (x, foot - 1), _GRID, 1)
        cv2.line(canvas, (x, foot), (x, foot + _TICK), INK, 1)
        at = (x, foot + _TICK + 3)
        draw_text(canvas, f"{tick:g}", at, size=_TEXT, colour=INK, anchor=(0.5, 0))
    for tick in nice_ticks(*axes.y_range, about=max(2, frame.height // 45)):
        y = round(float(axes.inside(np.array(0.0), np.array(tick))[1])) + frame.y
        if grid:
            cv2.line(canvas, (frame.x, y), (right - 1, y), _GRID, 1)
        cv2.line(canvas, (frame.x - _TICK, y), (frame.x - 1, y), INK, 1)
        at = (frame.x - _TICK - 3, y)
        draw_text(canvas, f"{tick:g}", at, size=_TEXT, colour=INK, anchor=(1, 0.5))


def _draw_spines(canvas: UInt8, frame: Area, *, closed: bool) -> None:
    left, top = frame.x - 1, frame.y - 1
    right, foot = frame.x + frame.width, frame.y + frame.height
    if closed:
        cv2.rectangle(canvas, (left, top), (right, foot), INK, 1)
    else:
        cv2.line(canvas, (left, frame.y), (left, foot), INK, 1)
        cv2.line(canvas, (left, foot), (right, foot), INK, 1)


def _draw_titles(canvas: UInt8, panel: Panel, frame: Area) -> None:
    foot = frame.y + frame.height + _TICK + line_height(_TEXT) + 5
    middle = frame.x + frame.width / 2
    draw_text(canvas, panel.title, (frame.x, 8), size=_TITLE, colour=INK, bold=True)
    draw_text(canvas, panel.x_label, (middle, foot), size=_TEXT, colour=INK, anchor=(0.5, 0))
    at = (4, frame.y + frame.height / 2)
    draw_text(canvas, panel.y_label, at, size=_TEXT, colour=INK, anchor=(0, 0.5), upwards=True)


def _draw_legend(canvas: UInt8, panel: Panel, frame: Area) -> None:
    """Write the series' names in one line between title and axes."""
    x, y = float(frame.x), line_height(_TITLE) + 8 + line_height(_TEXT) / 2
    for series in panel.series:
        if not series.label:
            continue
        start, end = (round(x), round(y)), (round(x) + 22, round(y))
        if series.kind in {"area", "bars"}:
            cv2.rectangle(canvas, (start[0], start[1] - 5), (end[0], end[1] + 5), series.colour, -1)
        elif series.kind == "dashed":
            cv2.line(canvas, start, (start[0] + 8, end[1]), series.colour, 2, cv2.LINE_AA)
            cv2.line(canvas, (end[0] - 8, start[1]), end, series.colour, 2, cv2.LINE_AA)
        else:
            cv2.line(canvas, start, end, series.colour, 2, cv2.LINE_AA)
        at = (x + 29, y)
        draw_text(canvas, series.label, at, size=_TEXT, colour=INK, anchor=(0, 0.5))
        x += 50 + text_width(series.label, _TEXT)


def _draw_series(part: UInt8, series: Series, axes: _Axes) -> None:
    """Draw a curve into the frame's part of the picture, which clips it."""
    if series.kind == "bars":
        _draw_bars(part, series, axes)
        return
    points = axes.inside(series.x, series.y)
    runs = _runs(points)
    if series.kind == "area":
        floor = float(axes.inside(np.array(0.0), np.array(0.0))[1])
        cover = np.zeros(part.shape[:2], dtype=np.uint8)
        for run in runs:
            ends = np.array([[run[-1, 0], floor], [run[0, 0], floor]])
            polygon = _fixed(np.concatenate([run, ends]))
            cv2.fillPoly(cover, [polygon], 72, cv2.LINE_AA, _SHIFT)
        blend(part, cover, x=0, y=0, colour=series.colour)
    if series.kind == "dashed":
        runs = [dash for run in runs for dash in _dashes(run)]
    lines = [_fixed(run) for run in runs]
    cv2.polylines(part, lines, False, series.colour, series.width, cv2.LINE_AA, _SHIFT)


def _draw_bars(part: UInt8, series: Series, axes: _Axes) -> None:
    half = float(np.diff(series.x).min()) / 2.0 if len(series.x) > 1 else 0.5
    low = axes.inside(series.x - half, np.zeros(1))
    high = axes.inside(series.x + half, series.y)
    for (left, foot), (right, top) in zip(low.round(), high.round(), strict=True):
        gap = 1 if right - left > 4 else 0
        corner = (int(left), int(foot)), (max(int(left), int(right) - 1 - gap), int(top))
        if top < foot:
            cv2.rectangle(part, *corner, series.colour, cv2.FILLED)


def _runs(points: Float64) -> list[Float64]:
    """Return the stretches of points between NaN."""
    known = np.isfinite(points).all(axis=-1)
    breaks = np.flatnonzero(np.diff(known.astype(np.int8))) + 1
    stretches = np.split(points, breaks)
    return [run for run in stretches if len(run) and np.isfinite(run[0]).all()]


def _dashes(run: Float64, *, dash: float = 9.0, gap: float = 6.0) -> list[Float64]:
    """Cut a polyline into dashes [px]."""
    along = np.concatenate([[0.0], np.hypot(*np.diff(run, axis=0).T).cumsum()])
    starts = np.arange(0.0, along[-1], dash + gap)
    pieces = []
    for start in starts:
        end = min(start + dash, along[-1])
        at = np.concatenate([[start], along[(along > start) & (along < end)], [end]])
        corners = [np.interp(at, along, channel) for channel in run.T]
        pieces.append(np.stack(corners, axis=-1))
    return pieces


def _fixed(points: Float64) -> np.ndarray[tuple[int, ...], np.dtype[np.int32]]:
    return (np.clip(points, -30000, 30000) * (1 << _SHIFT)).round().astype(np.int32)


def _paragraph(lines: Sequence[str], *, width: int, size: float, bold: bool) -> UInt8:
    part = blank(width, len(lines) * line_height(size) + 10, PAPER)
    for i, line in enumerate(lines):
        at = (24, 4 + i * line_height(size))
        draw_text(part, line, at, size=size, colour=INK if bold else _CAPTION, bold=bold)
    return part
